"""What a printed table says about the model, and what it leaves open: ``tribo diagnose --published berardo2019``.

The three explanations that the authors propose are mechanisms of the library. They are weighed like all others, in
every reading of what the table leaves open: the correlation of mu and tau0, whether the standard deviations are
those of a mean, and which simulation is the model.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import logsumexp

from tribo.berardo2019.table_model import (
    RANGE_PA,
    PublishedTable,
    TableFit,
    candidates_of,
    design_correlation,
    estimate_of,
    even_loads,
    fit_table,
    friction_at,
    model_covariance,
    predict_table,
    read_table,
    upper_limit,
)
from tribo.diagnostics.verdict import Cause, Excluded, Gain, Misfit, NextTest, Outcome, Verdict
from tribo.lawsearch.across_patterns import Deviations, LawsAcross, across_patterns, geometry_of
from tribo.mechanisms import MECHANISMS
from tribo.records import REGIMES, FloatArray

if TYPE_CHECKING:
    import pandas as pd

LEAST_CORRELATION = -2.0 * np.sqrt(RANGE_PA[0] * RANGE_PA[1]) / (RANGE_PA[0] + RANGE_PA[1])
REPLICATES = 4000
TAKEN_UP = 0.02  # share of a contrast that must be left once the flat law is free
RESAMPLES = 400
LEVEL = 0.01
CLOSE = 3.0
FLOOR = 1e-3  # of T/N: a printed line may reach zero at a load
PATTERNS = "patterns"  # the flat law is free: a misfit of F is one of the patterned samples together
TableContrast = tuple[str, str, bool]  # observable (static, sliding, both), sample, whether over the load
REGIME_ROWS = {"static": [0], "sliding": [1], "both": [0, 1]}
Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class TableReading:
    """One way to read the table, and what it gives.

    It is read by whose simulation is the ``model``, the ``correlation`` of mu and tau0 and ``why`` that one, and the
    meaning of the standard deviations: of a mean (1), or of so many ``specimens``. It gives the adjusted p value of
    every contrast, before and after the best mechanism. A contrast is one of a sample, or of the patterned ones
    together: its level, or its course over the load; or the name of a mechanism. ``weighed`` are the fits with one
    mechanism each, the best first.
    """

    model: str
    correlation: float
    specimens: int
    why: str
    baseline: TableFit
    contrasts: Mapping[TableContrast | str, float]
    weighed: tuple[TableFit, ...]
    p_library: float
    contrasts_left: Mapping[TableContrast | str, float]

    @property
    def p_misfit(self) -> float:
        """Adjusted p value of the strongest contrast."""
        return min(self.contrasts.values())

    @property
    def p_left(self) -> float:
        """The same for what the best mechanism leaves over."""
        return min(self.contrasts_left.values())

    @property
    def outcome(self) -> Outcome:
        if self.p_misfit >= LEVEL:
            return "no_misfit"
        if self.p_library >= LEVEL or self.p_left < LEVEL:
            return "unknown"
        return "undetermined" if len(self.near) > 1 else "named"

    @property
    def near(self) -> tuple[TableFit, ...]:
        """The best and those that explain about as much."""
        return tuple(w for w in self.weighed if w.gain > self.weighed[0].gain - CLOSE)


def readings() -> list[tuple[str, float, int, str]]:
    """Model, correlation, specimens and why, as of :class:`TableReading`: the paper's own column under even loads
    first; then the other correlations, means of three, our simulation."""
    even = design_correlation(even_loads())
    correlations = {
        even: "loads evenly over the range",
        -0.95: "loads close together",
        LEAST_CORRELATION: "the least that a line over this range can have",
        0.0: "independent, as no line fit gives",
    }
    return [
        (model, correlation, specimens, why)
        for model in ("paper", "tribo")
        for specimens in (1, 3)
        for correlation, why in correlations.items()
    ]


def diagnose_reading(
    table: PublishedTable, reading: tuple[str, float, int, str], rng: np.random.Generator
) -> TableReading:
    """Fit the baseline, compare its strongest contrast with chance, weigh every mechanism, examine what remains."""
    baseline = fit_table(table)
    weighed = weigh_table(baseline)
    earned = float(np.sqrt(2.0 * max(weighed[0].score - baseline.score, 0.0)))
    contrasts, p_library = _screen(baseline, rng, earned)
    left, _ = _screen(_widened(weighed[0]), rng)
    return TableReading(*reading, baseline, contrasts, tuple(weighed), p_library, left)


def weigh_table(baseline: TableFit) -> list[TableFit]:
    """Every mechanism that the table can show on top of the baseline, the best choice of each, best first."""
    found: dict[str, TableFit] = {}
    for acting in candidates_of(baseline.table):
        fitted = fit_table(baseline.table, (acting,), baseline.root)
        gain = fitted.score - baseline.score - (len(acting.mechanism.parameters) - 1)
        known = found.get(fitted.name)
        if known is None or gain > known.gain:
            found[fitted.name] = replace(fitted, gain=float(gain))
    return sorted(found.values(), key=lambda w: -w.gain)


def _widened(f: TableFit) -> TableFit:
    """The same fit with its law allowed to be wrong in form by a share of its own effect."""
    friction = friction_at(f.table, f.law, f.acting, f.parameters)
    change = np.log(friction / friction_at(f.table, f.law))
    covariance = f.table.data_covariance + model_covariance(f.table, friction, change)
    return fit_table(f.table, f.acting, np.asarray(np.linalg.cholesky(covariance), float))


def _screen(
    f: TableFit, rng: np.random.Generator, earned: float = 0.0
) -> tuple[dict[TableContrast | str, float], float]:
    """Adjusted p values: the chance that the strongest of all contrasts is at least as strong as each, and that some
    mechanism is as strong as ``earned``; from tables drawn from the fit and fitted again."""
    names, columns, library = _contrasts(f)
    white = np.linalg.solve(f.root, columns)
    basis = np.linalg.qr(np.linalg.solve(f.root, _jacobian(f)))[0]
    clear = white - basis @ (basis.T @ white)
    length = np.linalg.norm(clear, axis=0)
    shown = length > TAKEN_UP * np.linalg.norm(white, axis=0)
    clear = clear[:, shown] / length[shown]
    chance = np.abs(rng.normal(size=(REPLICATES, len(f.table.values))) @ clear)
    most = np.sort(chance.max(axis=1))
    above = len(most) - np.searchsorted(most, np.abs(clear.T @ f.residual))
    kept = (n for n, s in zip(names, shown, strict=True) if s)
    adjusted = {n: float((1 + k) / (1 + len(most))) for n, k in zip(kept, above, strict=True)}
    some = chance[:, library[shown]].max(axis=1)
    return adjusted, float((1 + np.sum(some >= earned)) / (1 + len(some)))


def _contrasts(f: TableFit) -> tuple[list[TableContrast | str], FloatArray, np.ndarray]:
    """Offset and slope of ln T of every sample in either regime and in both; every mechanism."""
    table = f.table
    friction = friction_at(table, f.law, f.acting, f.parameters)
    log_p = np.log(table.pressures_Pa) - np.log(table.pressures_Pa).mean()
    names: list[TableContrast | str] = []
    columns = []
    for i, sample in enumerate(table.samples):
        for regimes, observable in (((0,), "static"), ((1,), "sliding"), ((0, 1), "both")):
            for shape, along in ((np.ones_like(log_p), False), (log_p, True)):
                change = np.zeros_like(friction)
                for r in regimes:
                    change[i, r] = friction[i, r] * shape
                names.append((observable, PATTERNS if sample == "F" else sample, along))
                columns.append((change @ table.line.T).ravel())
    for acting in candidates_of(table):
        if acting not in f.acting:
            small = acting.mechanism.start() * np.array([0.1, *np.ones(len(acting.mechanism.parameters) - 1)])
            names.append(acting.mechanism.name)
            moved = predict_table(table, f.law, (*f.acting, acting), (*f.parameters, small))
            columns.append(moved - f.predicted)
    return names, np.column_stack(columns), np.array([n in MECHANISMS for n in names])


def _jacobian(f: TableFit) -> FloatArray:
    """Derivatives of the predicted values by law and parameters, central differences."""
    x = np.concatenate([f.law, *f.parameters])
    sizes = np.cumsum([len(p) for p in f.parameters])[:-1]
    columns = []
    for k, scale in enumerate(np.maximum(np.abs(x), 1e-12)):
        step = np.zeros_like(x)
        step[k] = 1e-4 * scale
        up, down = (
            predict_table(f.table, y[:4], f.acting, np.split(y[4:], sizes) if f.acting else [])
            for y in (x + step, x - step)
        )
        columns.append((up - down) / (2e-4 * scale))
    return np.column_stack(columns)


def gain_on_samples(baseline: TableFit, extended: TableFit, rng: np.random.Generator) -> Gain:
    """Log score per number and RMSE of T over the loads on whole samples left out, both models fitted anew."""
    from scipy.stats import multivariate_normal

    table = baseline.table
    patterned = [s for s in table.samples if s != "F"]
    scores, errors = np.zeros((len(patterned), 2)), np.zeros((len(patterned), 2))
    for i, sample in enumerate(patterned):
        place = table.samples.index(sample)
        out = np.zeros(len(table.values), bool)
        out[4 * place : 4 * place + 4] = True
        for k, acting in enumerate(((), extended.acting)):
            f = fit_table(table, acting, baseline.root, keep=~out)
            jacobian = _jacobian(f)[out]
            spread = (f.root @ f.root.T)[np.ix_(out, out)] + jacobian @ f.covariance @ jacobian.T
            scores[i, k] = multivariate_normal.logpdf(table.values[out], f.predicted[out], spread)
            measured, modelled = (np.maximum(table.friction(x)[place], 0.05) for x in (table.values, f.predicted))
            errors[i, k] = np.sqrt(np.mean(np.log(measured / modelled) ** 2))
    difference = (scores[:, 1] - scores[:, 0]) / 4
    drawn = rng.integers(0, len(patterned), (RESAMPLES, len(patterned)))
    rmse = 100 * np.sqrt(np.mean(errors**2, axis=0))
    return Gain(
        "samples", float(scores[:, 0].mean() / 4), float(scores[:, 1].mean() / 4), float(difference.mean()),
        float(np.std(difference[drawn].mean(axis=1))), float(rmse[0]), float(rmse[1]),
    )  # fmt: skip


def table_deviations(table: PublishedTable) -> Deviations:
    """What the printed lines are over the model calibrated on the printed flat sample, at the loads of the table."""
    flat = table.samples.index("F")
    law = table.values.reshape(-1, 2 * len(REGIMES))[flat]
    ratio = np.log(np.maximum(table.friction(table.values), FLOOR) / friction_at(table, law))
    patterns = [k for k in range(len(table.samples)) if k != flat]
    rows = (table.shares * law)[patterns]
    adhesion = np.stack([rows[:, 2 * r + 1, None] / table.pressures_kPa for r in range(len(REGIMES))], axis=1)
    load = np.stack([rows[:, 2 * r, None] + 0.0 * table.pressures_kPa for r in range(len(REGIMES))], axis=1)
    first = [k * len(table.pressures_Pa) for k in patterns]
    c = table.conditions
    return Deviations(
        tuple(table.samples[k] for k in patterns),
        geometry_of(c.area_fraction[first], c.rim_per_m[first], c.cavity_width_m[first], c.elongation[first]),
        table.pressures_Pa, ratio[patterns], adhesion / (adhesion + load),
    )  # fmt: skip


def verdict_of(results: Sequence[TableReading], gain: Gain) -> Verdict:
    """The verdict on the first reading, which shows all of them."""
    main = results[0]
    named = main.outcome in ("named", "undetermined")
    return Verdict(
        verdict=main.outcome,
        misfits=tuple(misfits(main)),
        causes=tuple(_cause(w, main) for w in main.near) if named else (),
        excluded=tuple(exclusions(main, {w.name for w in main.near} if named else set())),
        gain=gain if main.outcome != "no_misfit" else None,
        next_test=_next_test(),
        model={"shares_from": "the numerical column of Table 2", "readings": [reading_record(o) for o in results]},
        shows=(tuple(results), gain),
    )


def reading_record(o: TableReading) -> dict[str, object]:
    """One reading in plain values: what was assumed, and what came out."""
    return {
        "model": o.model, "correlation": o.correlation, "correlation_is": o.why,
        "standard_deviations_of": "a mean" if o.specimens == 1 else f"{o.specimens} specimens",
        "outcome": o.outcome, "p_misfit": o.p_misfit, "best": o.weighed[0].name, "gain_of_best": o.weighed[0].gain,
        "p_left": o.p_left,
    }  # fmt: skip


def misfits(result: TableReading) -> list[Misfit]:
    """Samples whose friction differs from the model beyond chance, the most certain first.

    Each shows measured less modelled T in percent of the model, the least and the most of both ends of the pressures,
    and these two pressures in kPa.
    """
    found: list[Misfit] = []
    pressures = result.baseline.table.pressures_kPa
    for contrast, p in sorted(result.contrasts.items(), key=lambda item: item[1]):
        if p >= LEVEL or isinstance(contrast, str):
            continue
        observable, where, along_load = contrast
        low, high = _ratio_percent(result, where, observable)
        sample = "" if where == PATTERNS else where
        column = "normal_load_N" if along_load else "sample"
        over_loads = (low, high), (float(pressures[0]), float(pressures[-1]))
        found.append(Misfit(observable, sample, column, (low + high) / 2, p, shows=over_loads))
    once = {(m.sample, m.observable): m for m in reversed(found)}
    return [m for m in found if once[m.sample, m.observable] is m]


def _ratio_percent(result: TableReading, sample: str, observable: str) -> tuple[float, float]:
    """Measured less modelled T in percent of the model: the mean at either end of the loads, lowest first."""
    table = result.baseline.table
    picked = [k for k, s in enumerate(table.samples) if s == sample or (sample == PATTERNS and s != "F")]
    rows = REGIME_ROWS[observable]
    flat = table.values.reshape(-1, 4)[table.samples.index("F")]
    ratio = np.log(table.friction(table.values) / friction_at(table, flat))[np.ix_(picked, rows)]
    ends = 100.0 * np.expm1(ratio[..., [0, -1]].mean(axis=(0, 1)))
    return float(ends.min()), float(ends.max())


def _cause(w: TableFit, main: TableReading) -> Cause:
    share = float(np.exp(w.gain - logsumexp([n.gain for n in main.near])))
    return Cause(w.name, share, estimate_of(w))


def exclusions(main: TableReading, shown: set[str]) -> list[Excluded]:
    """Every mechanism that is not among the causes, and why, in the first reading."""
    best = main.weighed[0]
    found = []
    for name, m in MECHANISMS.items():
        weighed = next((w for w in main.weighed if w.name == name), None)
        if name in shown or (not shown and weighed is best):
            continue
        if m.in_table.missing:
            found.append(Excluded(name, "not printed"))
        elif m.in_table.barred:
            found.append(Excluded(name, "contradicted"))
        elif weighed is None:
            found.append(Excluded(name, "not varied"))
        elif m.amplitude.low == 0.0 and float(weighed.parameters[0][0]) < 1e-3 * m.amplitude.start:
            found.append(Excluded(name, "wrong sign", shows=upper_limit(main.baseline, name)))
        else:
            found.append(Excluded(name, "explains less", best.gain - weighed.gain))
    return found


def _next_test() -> NextTest | None:
    """The bench test that a mechanism of the library proposes."""
    table = next((m.in_table for m in MECHANISMS.values() if m.in_table.next_test), None)
    return NextTest("at the bench", table.separates, table.design, shows=table.next_test) if table is not None else None


@dataclass(frozen=True)
class PublishedDiagnosis:
    """The verdict on a printed table, with every reading of it; the first is the one the verdict speaks of."""

    source: str
    verdict: Verdict
    results: tuple[TableReading, ...]

    @property
    def main(self) -> TableReading:
        return self.results[0]


def diagnose_published(
    table2: pd.DataFrame,
    own: pd.DataFrame,
    *,
    seed: int = 0,
    progress: Progress | None = None,
) -> PublishedDiagnosis:
    """The diagnosis of Table 2 of Berardo et al. (2019) in every reading.

    Parameters
    ----------
    table2 : DataFrame
        As :func:`tribo.berardo2019.published_tables.load_table2` gives it.
    own : DataFrame
        The same table simulated anew: sample, regime, mu, tau0_kPa.
    seed : int
        Of the simulated tables that stand for chance.
    progress : callable, optional
        Called with a stage, the readings done and the readings there are.

    Returns
    -------
    PublishedDiagnosis
        The verdict on the first reading, and what every reading gives.
    """
    measured = table2[table2["source"] == "experiment"]
    models = {"paper": table2[table2["source"] == "simulation"], "tribo": own}
    found = []
    for k, (model, correlation, specimens, why) in enumerate(readings()):
        if progress is not None:
            progress("reading the table", k, len(readings()))
        table = read_table(measured, models[model], correlation, specimens)
        found.append(diagnose_reading(table, (model, correlation, specimens, why), np.random.default_rng(seed)))
    rng = np.random.default_rng(seed)
    gain = gain_on_samples(found[0].baseline, found[0].weighed[0], rng)
    return PublishedDiagnosis("berardo2019", verdict_of(found, gain), tuple(found))


def across_published(d: PublishedDiagnosis, *, seed: int = 0) -> tuple[LawsAcross, ...]:
    """Laws of up to three terms across the patterns of the table, in the main reading.

    Readings differ in the correlation and the number of specimens, which this search does not use, and in the model.
    """
    found = across_patterns(table_deviations(d.main.baseline.table), most_terms=3, seed=seed)
    if not found:
        raise ValueError("a law across patterns needs at least four patterns")
    return found
