"""``tribo diagnose --published berardo2019``: what a printed table says about the model, and what it leaves open.

The three explanations that the authors propose are mechanisms of the library. They are weighed like all others, in
every reading of what the table leaves open: the correlation of mu and tau0, whether the standard deviations are
those of a mean, and which simulation is the model.

The deviations of a published table, pattern by pattern, for a law across patterns.

``tribo diagnose --published berardo2019``: the diagnosis of a printed table, in every reading of it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tribo.berardo2019.table_model import (
    PATTERNS,
    RANGE_PA,
    Outlook,
    Reading,
    Table,
    TableFit,
    TableLook,
    Weighed,
    candidates_of,
    design_correlation,
    even_loads,
    fit_table,
    friction_at,
    model_covariance,
    predict_table,
    read_table,
    root_of,
)
from tribo.berardo2019.table_verdict import verdict_of
from tribo.diagnostics.verdict import Gain, Verdict
from tribo.lawsearch.across_patterns import AcrossPatterns, Deviations, across_patterns, geometry_of
from tribo.mechanisms.table import MECHANISMS
from tribo.records import REGIMES, FloatArray

if TYPE_CHECKING:
    import pandas as pd


LEAST_CORRELATION = -2.0 * np.sqrt(RANGE_PA[0] * RANGE_PA[1]) / (RANGE_PA[0] + RANGE_PA[1])
REPLICATES = 4000
TAKEN_UP = 0.02  # share of a look that must be left once the flat law is free
RESAMPLES = 400
Progress = Callable[[str, int, int], None]


def readings() -> list[Reading]:
    """The paper's own column under even loads first; then the other correlations, means of three, our simulation."""
    even = design_correlation(even_loads())
    correlations = {
        even: "loads evenly over the range",
        -0.95: "loads close together",
        LEAST_CORRELATION: "the least that a line over this range can have",
        0.0: "independent, as no line fit gives",
    }
    return [
        Reading(model, correlation, specimens, why)
        for model in ("paper", "tribo")
        for specimens in (1, 3)
        for correlation, why in correlations.items()
    ]


def look_at(table: Table, reading: Reading, rng: np.random.Generator) -> Outlook:
    """Fit the baseline, compare its strongest look with chance, weigh every mechanism, examine what remains."""
    baseline = fit_table(table)
    looks = _screen(baseline, rng)
    weighed = weigh_table(baseline)
    best = weighed[0]
    earned = float(np.sqrt(2.0 * max(best.fit.score - baseline.score, 0.0)))
    left = _screen(_widened(best.fit), rng)
    return Outlook(
        reading, table, baseline, looks.adjusted(), tuple(weighed), looks.p_library(earned), left.adjusted()
    )


def weigh_table(baseline: TableFit) -> list[Weighed]:
    """Every mechanism that the table can show on top of the baseline, the best choice of each, best first."""
    found: dict[str, Weighed] = {}
    for acting in candidates_of(baseline.table):
        fitted = fit_table(baseline.table, (acting,), baseline.root)
        gain = fitted.score - baseline.score - (len(acting.mechanism.parameters) - 1)
        known = found.get(acting.mechanism.name)
        if known is None or gain > known.gain:
            found[acting.mechanism.name] = Weighed(acting, fitted, float(gain))
    return sorted(found.values(), key=lambda w: -w.gain)


def _widened(f: TableFit) -> TableFit:
    """The same fit with its law allowed to be wrong in form by a share of its own effect."""
    change = np.log(friction_at(f.table, f.law, f.acting, f.parameters) / friction_at(f.table, f.law))
    friction = friction_at(f.table, f.law, f.acting, f.parameters)
    covariance = f.table.data_covariance + model_covariance(f.table, friction, change)
    return fit_table(f.table, f.acting, root_of(covariance))


@dataclass(frozen=True)
class _Screen:
    names: tuple[TableLook | str, ...]
    strength: FloatArray  # (looks,)
    chance: FloatArray  # (replicates, looks)
    library: np.ndarray  # which looks are laws

    def adjusted(self) -> dict[TableLook | str, float]:
        """Chance that the strongest of all looks is at least as strong as each."""
        most = np.sort(self.chance.max(axis=1))
        above = len(most) - np.searchsorted(most, self.strength)
        return {n: float((1 + k) / (1 + len(most))) for n, k in zip(self.names, above, strict=True)}

    def p_library(self, strength: float) -> float:
        """Chance that some mechanism looks at least this strong."""
        most = self.chance[:, self.library].max(axis=1)
        return float((1 + np.sum(most >= strength)) / (1 + len(most)))


def _screen(f: TableFit, rng: np.random.Generator) -> _Screen:
    """Strength of every look, and of the same looks at tables drawn from the fit and fitted again."""
    names, columns, library = _looks(f)
    white = np.linalg.solve(f.root, columns)
    basis = np.linalg.qr(np.linalg.solve(f.root, _jacobian(f)))[0]
    clear = white - basis @ (basis.T @ white)
    length = np.linalg.norm(clear, axis=0)
    shown = length > TAKEN_UP * np.linalg.norm(white, axis=0)
    clear = clear[:, shown] / length[shown]
    drawn = rng.normal(size=(REPLICATES, len(f.table.values)))
    kept = tuple(n for n, s in zip(names, shown, strict=True) if s)
    return _Screen(kept, np.abs(clear.T @ f.residual), np.abs(drawn @ clear), library[shown])


def _looks(f: TableFit) -> tuple[list[TableLook | str], FloatArray, np.ndarray]:
    """Offset and slope of ln T of every sample in either regime and in both; every mechanism."""
    table = f.table
    friction = friction_at(table, f.law, f.acting, f.parameters)
    log_p = np.log(table.pressures_Pa) - np.log(table.pressures_Pa).mean()
    names: list[TableLook | str] = []
    columns = []
    for i, sample in enumerate(table.samples):
        for regimes, observable in (((0,), "static"), ((1,), "sliding"), ((0, 1), "both")):
            for shape, along in ((np.ones_like(log_p), False), (log_p, True)):
                change = np.zeros_like(friction)
                for r in regimes:
                    change[i, r] = friction[i, r] * shape
                names.append(TableLook(observable, PATTERNS if sample == "F" else sample, along))
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


def gain_on_samples(baseline: TableFit, w: Weighed, rng: np.random.Generator) -> Gain:
    """Log score per number and RMSE of T over the loads on whole samples left out, both models fitted anew."""
    table = baseline.table
    patterned = [s for s in table.samples if s != "F"]
    scores, errors = np.zeros((len(patterned), 2)), np.zeros((len(patterned), 2))
    for i, sample in enumerate(patterned):
        place = table.samples.index(sample)
        out = np.zeros(len(table.values), bool)
        out[4 * place : 4 * place + 4] = True
        for k, acting in enumerate(((), (w.acting,))):
            f = fit_table(table, acting, baseline.root, keep=~out)
            scores[i, k], errors[i, k] = _held_out(f, out, place)
    difference = (scores[:, 1] - scores[:, 0]) / 4
    drawn = rng.integers(0, len(patterned), (RESAMPLES, len(patterned)))
    rmse = 100 * np.sqrt(np.mean(errors**2, axis=0))
    return Gain(
        "samples", float(scores[:, 0].mean() / 4), float(scores[:, 1].mean() / 4), float(difference.mean()),
        float(np.std(difference[drawn].mean(axis=1))), float(rmse[0]), float(rmse[1]),
    )  # fmt: skip


def _held_out(f: TableFit, out: np.ndarray, place: int) -> tuple[float, float]:
    from scipy.stats import multivariate_normal

    jacobian = _jacobian(f)[out]
    spread = (f.root @ f.root.T)[np.ix_(out, out)] + jacobian @ f.covariance @ jacobian.T
    density = float(multivariate_normal.logpdf(f.table.values[out], f.predicted[out], spread))
    measured = f.table.friction(f.table.values)[place]
    modelled = f.table.friction(f.predicted)[place]
    return density, float(np.sqrt(np.mean(np.log(np.maximum(measured, 0.05) / np.maximum(modelled, 0.05)) ** 2)))


FLOOR = 1e-3  # of T/N: a printed line may reach zero at a load


def table_deviations(table: Table) -> Deviations:
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


@dataclass(frozen=True)
class PublishedDiagnosis:
    """The verdict on a printed table, with every reading of it; the first is the one the verdict speaks of."""

    source: str
    verdict: Verdict
    outlooks: tuple[Outlook, ...]

    @property
    def main(self) -> Outlook:
        return self.outlooks[0]


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
    table2 : as :func:`tribo.berardo2019.published_tables.load_table2` gives it
    own : the same table simulated anew: sample, regime, mu, tau0_kPa
    seed : of the simulated tables that stand for chance
    """
    measured = table2[table2["source"] == "experiment"]
    models = {"paper": table2[table2["source"] == "simulation"], "tribo": own}
    found = []
    for k, reading in enumerate(readings()):
        if progress is not None:
            progress("reading the table", k, len(readings()))
        table = read_table(measured, models[reading.model], reading.correlation, reading.specimens)
        found.append(look_at(table, reading, np.random.default_rng(seed)))
    rng = np.random.default_rng(seed)
    gain = gain_on_samples(found[0].baseline, found[0].weighed[0], rng)
    return PublishedDiagnosis("berardo2019", verdict_of(found, gain), tuple(found))


def across_published(d: PublishedDiagnosis, *, seed: int = 0) -> AcrossPatterns:
    """Laws of up to three terms across the patterns of the table, in the main reading.

    Readings differ in the correlation and the number of specimens, which this search does not use, and in the model.
    """
    found = across_patterns(table_deviations(d.main.table), most_terms=3, seed=seed)
    if found is None:
        raise ValueError("a law across patterns needs at least four patterns")
    return found
