"""How well the model agrees with the measurement: the ratio of their forces at each load, with its 95 % interval.

mu and tau0 trade off against each other in a fit, so a model is judged by T at a load, not by either alone. The
sentences of these records are in ``wording``.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any, Literal

import numpy as np
import pandas as pd

from tribo.fitting.linear import levels_of
from tribo.records import MEDIAN_TO_SD, REGIMES, ComparisonRow, FloatArray, LawFit, Pattern, Regime, SetAside, Study

COLUMNS = ["sample_number", "sample", "regime", "normal_load_N", "ratio", "ratio_low", "ratio_high"]
LEVEL = 0.95


def ratios_of(study: Study) -> pd.DataFrame:
    """T measured over T simulated at each load (N), with the 95 % interval of the ratio.

    The interval is symmetric in the logarithm of the ratio, with Student's t and the degrees of freedom of
    both sides carried through Welch-Satterthwaite (GUM G.4): those of the sample's own fit, and for the model
    those of the measured flat sample, on whose calibration it rests.
    """
    comparison = study.comparison
    if comparison is None or not comparison.rows:
        return pd.DataFrame(columns=COLUMNS)
    order = sample_numbers(study)
    rows = [
        {
            "sample_number": order.get(row.sample, len(order)),
            "sample": row.sample,
            "regime": row.regime,
            "normal_load_N": row.normal_load_N,
            **_ratio(row, _dof(study, row.sample, row), _dof(study, comparison.flat, row)),
        }
        for row in comparison.rows
    ]
    table = pd.DataFrame(rows, columns=COLUMNS)
    table = table[np.isfinite(table["ratio"])]
    return table.sort_values(["sample_number", "regime", "normal_load_N"], ascending=[True, False, True])


def _dof(study: Study, sample: str, row: ComparisonRow) -> float:
    fit = fit_of(study.fits, sample, row.regime)
    return fit.by_itself.dof if fit is not None else float("inf")


def _ratio(row: ComparisonRow, measured_dof: float, simulated_dof: float) -> dict[str, float]:
    from scipy.stats import t

    if not (row.measured_N > 0 and row.simulated_N > 0):
        return dict.fromkeys(("ratio", "ratio_low", "ratio_high"), float("nan"))
    ratio = row.measured_N / row.simulated_N
    measured, simulated = row.measured_u_N / row.measured_N, row.simulated_u_N / row.simulated_N
    u = float(np.hypot(measured, simulated))
    dof = welch_dof((measured, measured_dof), (simulated, simulated_dof))
    half = float(t.ppf(0.5 + LEVEL / 2, dof)) * u
    return {"ratio": ratio, "ratio_low": ratio * np.exp(-half), "ratio_high": ratio * np.exp(half)}


def welch_dof(*components: tuple[float, float]) -> float:
    """Degrees of freedom of a sum of (standard uncertainty, degrees of freedom), Welch-Satterthwaite (GUM G.4).

    NaN where a part has an uncertainty without degrees of freedom, infinite where no part is uncertain.
    """
    uncertain = [(u, dof) for u, dof in components if u != 0]
    if not all(dof > 0 for _, dof in uncertain):
        return float("nan")
    parts = sum(u**4 / dof for u, dof in uncertain)
    return float(sum(u**2 for u, _ in uncertain) ** 2 / parts) if parts > 0 else float("inf")


Verdict = Literal["agrees", "model too high", "model too low", "inconclusive"]
TELLING_FACTOR = 1.2  # an interval wider than a factor of 1.2 either way is no evidence for the model


@dataclass(frozen=True)
class LoadRatio:
    """Measured over simulated friction force at one load, with its 95 % interval."""

    normal_load_N: float
    ratio: float
    low: float
    high: float

    @property
    def verdict(self) -> Verdict:
        """Conclusion from the interval; "inconclusive" where it contains 1 but is too wide."""
        if not (math.isfinite(self.low) and math.isfinite(self.high)):
            return "inconclusive"
        if self.high < 1:
            return "model too high"
        if self.low > 1:
            return "model too low"
        wide = math.log(self.high / self.low) / 2 > math.log(TELLING_FACTOR)
        return "inconclusive" if wide else "agrees"

    @property
    def deviation(self) -> float:
        """measured / simulated - 1: below zero where the model predicts too much friction."""
        return self.ratio - 1


@dataclass(frozen=True)
class Agreement:
    """One sample in one regime at all its loads."""

    sample: str
    regime: Regime
    loads: tuple[LoadRatio, ...]
    calibrated: bool

    def count(self, *verdicts: Verdict) -> int:
        return sum(load.verdict in verdicts for load in self.loads)

    @property
    def worst(self) -> LoadRatio:
        """The load with the largest deviation."""
        return max(self.loads, key=lambda load: abs(load.deviation))

    @property
    def mean_deviation(self) -> float:
        """Geometric mean over the loads of measured / simulated, less 1: the mean that the diagnosis tells."""
        return float(np.exp(np.mean(np.log([load.ratio for load in self.loads]))) - 1.0)

    @property
    def verdict(self) -> Verdict | Literal["mixed"]:
        """Conclusion for all loads together: that of at least half of them.

        By chance, one load in twenty lies outside its interval; a single one therefore does not decide.
        """
        high, low, half = self.count("model too high"), self.count("model too low"), len(self.loads) / 2
        if high + low >= half:
            return "mixed" if high and low else "model too high" if high else "model too low"
        return "agrees" if self.count("agrees") >= half else "inconclusive"

    @property
    def n_outside(self) -> int:
        """Number of loads at which the interval excludes the model."""
        return self.count("model too high", "model too low")


def agreements(study: Study) -> list[Agreement]:
    """Every sample in both regimes, static first; empty without a comparison."""
    ratios = ratios_of(study)
    flat = flat_sample(study)
    columns = ["normal_load_N", "ratio", "ratio_low", "ratio_high"]
    return [
        Agreement(
            str(sample), regime, tuple(LoadRatio(*map(float, row)) for row in part[columns].to_numpy(float)),
            sample == flat,
        )
        for regime in REGIMES
        for sample, part in ratios[ratios["regime"] == regime].groupby("sample", sort=False)
    ]  # fmt: skip


@dataclass(frozen=True)
class Ranking:
    """Samples from most to least friction at one load, measured and simulated.

    ``told_apart`` are the pairs (higher, lower) that the measurement separates with 95 % confidence; ``reversed``
    those of them that the model predicts in the opposite order.
    """

    regime: Regime
    normal_load_N: float
    measured: tuple[str, ...]
    simulated: tuple[str, ...]
    told_apart: tuple[tuple[str, str], ...]
    reversed: tuple[tuple[str, str], ...]

    @property
    def n_pairs(self) -> int:
        return math.comb(len(self.measured), 2)


def common_loads(study: Study) -> tuple[float, float, float]:
    """Lowest, middle and highest load level of the campaign, in newton."""
    levels = np.unique(load_levels(np.array([t.normal_load_N for t in study.ingested.campaign.tests])))
    return float(levels[0]), float(levels[len(levels) // 2]), float(levels[-1])


def rankings(study: Study) -> list[Ranking]:
    """The order of the samples at the middle load, static and sliding; empty for fewer than two."""
    if study.comparison is None:
        return []
    load = common_loads(study)[1]
    fits = [fit.by_itself for fit in study.fits]  # what all pulls share does not order the samples
    found = [_ranking(fits, study.comparison.simulated, regime, load) for regime in REGIMES]
    return [ranking for ranking in found if len(ranking.measured) > 1]


def _ranking(fits: Iterable[LawFit], simulated: Iterable[LawFit], regime: Regime, load: float) -> Ranking:
    usable = [f for f in simulated if f.regime == regime and math.isfinite(f.force_N(load))]
    model = {f.sample: float(f.force_N(load)) for f in usable}
    both = {f.sample: f for f in fits if f.regime == regime and math.isfinite(f.force_N(load)) and f.sample in model}
    order = sorted(both, key=lambda s: -float(both[s].force_N(load)))
    apart = tuple((a, b) for a, b in combinations(order, 2) if _differ(both[a], both[b], load))
    wrong = tuple((a, b) for a, b in apart if model[a] < model[b])
    return Ranking(
        regime, load, tuple(order), tuple(sorted(model.keys() & both, key=lambda s: -model[s])), apart, wrong
    )


def _differ(a: LawFit, b: LawFit, load: float) -> bool:
    """Whether two fitted forces differ at 95 %, by Welch's t with the fits' degrees of freedom."""
    from scipy.stats import t

    u_a, u_b = float(a.force_u_N(load)), float(b.force_u_N(load))
    half = float(t.ppf(0.975, welch_dof((u_a, a.dof), (u_b, b.dof)))) * math.hypot(u_a, u_b)
    return abs(float(a.force_N(load) - b.force_N(load))) > half


DIRECTION_COLUMNS = ["pattern", "x", "y", "regime", "normal_load_N", "measured", "low", "high", "simulated"]


def direction_pairs(study: Study) -> list[tuple[str, str, str]]:
    """(pattern, sample along x, sample along y) for every pattern pulled both ways."""
    samples = study.ingested.campaign.samples
    names = {pattern.name for pattern in samples.values()}
    both = [(n, f"{n}x", f"{n}y") for n in sorted(names) if f"{n}x" in samples and f"{n}y" in samples]
    # a pattern that is itself called Sx is not pattern S along x
    return [(n, x, y) for n, x, y in both if samples[x].name == samples[y].name == n]


def direction_ratios(study: Study) -> pd.DataFrame:
    """T along x over T along y of every pattern pulled both ways, at the lowest, middle and highest load.

    ``measured`` with its 95 % interval from ``low`` to ``high``, and ``simulated``; x and y are the names of samples.
    """
    pairs = direction_pairs(study) if study.comparison is not None else []
    found = [
        (pattern, x, y, regime, load, *ratio)
        for pattern, x, y in pairs
        for regime in REGIMES
        for load in dict.fromkeys(common_loads(study))
        if (ratio := _direction_ratio(study, x, y, regime, load)) is not None
    ]
    return pd.DataFrame(found, columns=DIRECTION_COLUMNS)


def _direction_ratio(
    study: Study, x: str, y: str, regime: Regime, load: float
) -> tuple[float, float, float, float] | None:
    """Measured ratio with the ends of its 95 % interval, and the simulated one; None without a fit of all four."""
    from scipy.stats import t

    assert study.comparison is not None
    measured = [study.fits.of(s, regime) for s in (x, y)]
    model = [fit_of(study.comparison.simulated, s, regime) for s in (x, y)]
    if any(f is None for f in measured + model):
        return None
    (fx, fy), (mx, my) = [[f.by_itself for f in pair if f is not None] for pair in (measured, model)]
    ratio = float(fx.force_N(load) / fy.force_N(load))
    if not ratio > 0:
        return None
    ux, uy = (float(f.force_u_N(load) / f.force_N(load)) for f in (fx, fy))
    half = float(t.ppf(0.975, welch_dof((ux, fx.dof), (uy, fy.dof)))) * math.hypot(ux, uy)
    simulated = float(mx.force_N(load) / my.force_N(load))
    return ratio, ratio * math.exp(-half), ratio * math.exp(half), simulated


def parameter_correlations(fits: Iterable[LawFit]) -> list[float]:
    """Correlation coefficient of mu and tau0 in each fit."""
    found = []
    for fit in fits:
        if "tau0_Pa" in fit.parameters:
            scale = fit.standard_uncertainty("mu") * fit.standard_uncertainty("tau0_Pa")
            i, j = fit.parameters.index("mu"), fit.parameters.index("tau0_Pa")
            if scale > 0:
                found.append(float(fit.covariance[i, j]) / scale)
    return found


def flat_sample(study: Study) -> str:
    """The flat sample of the campaign; empty where none was measured or chosen."""
    return study.ingested.campaign.flat_sample


def sample_numbers(study: Study) -> dict[str, int]:
    """Each sample with its place, the flat one first, then in the order of the campaign."""
    campaign = study.ingested.campaign
    tested = {test.sample for test in campaign.tests}
    named = [s for s in campaign.samples if s in tested]
    rest = sorted(tested - set(named))
    order = sorted([*named, *rest], key=lambda s: s != flat_sample(study))
    return {sample: k for k, sample in enumerate(order)}


def tested_samples(study: Study) -> list[str]:
    """The samples of which a pull was read, in the order of their places."""
    read = {t.sample for t in study.ingested.used_tests}
    return [sample for sample in sample_numbers(study) if sample in read]


def is_anisotropic(pattern: Pattern) -> bool:
    """True where the cavities or their spacing differ between x and y."""
    unequal_size = pattern.size_m is not None and pattern.size_m[0] != pattern.size_m[1]
    unequal_pitch = pattern.pitch_m is not None and pattern.pitch_m[0] != pattern.pitch_m[1]
    return unequal_size or unequal_pitch


def fit_of(fits: Iterable[LawFit], sample: str, regime: str) -> LawFit | None:
    """The fit of one sample in one regime, None where there is none."""
    return next((f for f in fits if f.sample == sample and f.regime == regime), None)


def load_levels(normal_load_N: FloatArray) -> FloatArray:
    """The mean load of the level each load belongs to."""
    return levels_of(np.asarray(normal_load_N, float))


def shown(study: Study) -> bool:
    """Whether the study was made without the spring-block model, whose report shows other figures."""
    return study.comparison is None and bool(study.ingested.pulls)


def all_set_aside(study: Study) -> dict[str, SetAside]:
    """Every test that takes no part, by its id: faulty rows of tests.csv and exports that fail."""
    ingested = study.ingested
    return {fault.test_id: fault for fault in (*ingested.campaign.set_aside, *ingested.set_aside)}


ODD_SCORE = 3.5  # modified z-score of Iglewicz and Hoaglin (1993)
FEWEST_SIBLINGS = 2


def standings(study: Study) -> dict[str, dict[str, Any]]:
    """Deviation of every pull, in the regime in which it is larger: regime, deviation, score and siblings by test.

    ``deviation`` is from the median of the other pulls of the sample at the load, of which there are ``siblings``;
    ``score`` is the same in robust standard deviations.

    Deviations are taken in ln T from the median of the other pulls of the sample at the load, and scaled by the
    median absolute deviation over the whole campaign: one cell has too few pulls to determine a scale. A pull
    excluded by hand is judged like any other; a pull with fewer than two others to compare with is not judged.
    """
    ingested = study.ingested
    left_out = {i: o.automatic for i, o in ingested.by_hand.items() if o.action == "exclude"}
    table = replace(ingested, pulls={**ingested.pulls, **left_out}).table()
    found: dict[str, dict[str, Any]] = {}
    for regime in REGIMES if not table.empty else ():
        for test_id, pull in _judged_in(table, regime).items():
            if test_id not in found or abs(pull["score"]) > abs(found[test_id]["score"]):
                found[test_id] = pull
    return found


def _judged_in(table: pd.DataFrame, regime: Regime) -> dict[str, dict[str, Any]]:
    table = table[table[f"{regime}_N"] > 0]
    level_N = load_levels(table["normal_load_N"].to_numpy(float))
    log_force = np.log(table[f"{regime}_N"])
    cells = log_force.groupby([table["sample"], level_N])
    siblings = cells.transform("size") - 1
    deviation = cells.transform(_from_the_others)
    judged = siblings >= FEWEST_SIBLINGS
    scale = MEDIAN_TO_SD * float(deviation[judged].abs().median())
    if not scale > 0:
        return {}
    rows = zip(table["test_id"][judged], deviation[judged], siblings[judged], strict=True)
    return {
        str(i): {"regime": regime, "deviation": float(np.expm1(d)), "score": float(d) / scale, "siblings": int(n)}
        for i, d, n in rows
    }


def _from_the_others(values: pd.Series) -> np.ndarray:
    """Each value less the median of all the others; NaN for a value alone."""
    x = values.to_numpy(float)
    others = len(x) - 1
    if others < 1:
        return np.full(len(x), np.nan)
    rank = np.empty(len(x), int)
    rank[np.argsort(x)] = np.arange(len(x))
    ordered = np.sort(x)
    low, high = ((others - 1) // 2, others // 2)  # the middle of the others, counted without the value itself
    return np.asarray(x - (ordered[low + (rank <= low)] + ordered[high + (rank <= high)]) / 2)
