"""Difference between two samples measured on the same specimens, such as one pattern pulled along x and along y.

Properties of a specimen (thickness, cut, glue) affect both of its laws and cancel in their difference. The mean of the
differences is therefore known better than the difference of two independent means. The scatter of the differences over
G specimens gives its interval by t(G-1).

Smallest difference between two samples that a campaign can detect, and the tests needed for a given difference.

Two samples are compared by the two-sided t test of their specimens' means, the power by the noncentral t
distribution (Cohen, Statistical Power Analysis for the Behavioral Sciences, 1988). The scatter of specimens
and of repeats is pooled over the samples of the campaign: three specimens are too few to determine it.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from tribo.display import displayed
from tribo.errors import FitError, Problem
from tribo.fitting.budget import NUMBERS, PRESSURE_PA, label, sensitivities
from tribo.fitting.linear import Rows, least_squares, sample_rows, weights_of
from tribo.fitting.samples import fit_samples
from tribo.laws import LAWS
from tribo.records import FloatArray, LawFit, Regime

if TYPE_CHECKING:
    import pandas as pd


_FEWEST = 2
_LEVEL = 0.95
_UNITS = {"mu": "", "tau0_kPa": " kPa", "T_N": " N"}


@displayed()
@dataclass(frozen=True)
class PairedDifference:
    """One number ("mu", "tau0_kPa", "T_N" at ``pressure_Pa``) of ``sample`` minus that of ``other``, same specimens.

    ``u`` is its standard uncertainty, ``unpaired_u`` what it would be with different specimens for each sample,
    ``low`` to ``high`` its 95 % interval by t(``dof``), ``p`` the probability of so large a difference by chance.
    """

    sample: str
    other: str
    regime: Regime
    number: str
    pressure_Pa: float
    difference: float
    u: float
    unpaired_u: float
    dof: float
    low: float
    high: float
    p: float
    specimens: tuple[str, ...]

    def text(self) -> str:
        """One sentence."""
        unit, name = _UNITS[self.number], label(self.number, self.pressure_Pa)
        verdict = "differ significantly" if self.p < 1 - _LEVEL else "do not differ significantly"
        return (
            f"{self.sample} and {self.other} {verdict} in {self.regime} {name}: {self.difference:+.3g}{unit} "
            f"[{self.low:.3g}, {self.high:.3g}] ({len(self.specimens)} specimens measured as both samples)"
        )


def paired_differences(fits: Iterable[LawFit], *, pressure_Pa: float = PRESSURE_PA) -> tuple[PairedDifference, ...]:
    """Differences between every two samples that share two specimens or more, by regime and number.

    Specimens are the same if their names in tests.csv are. Type B uncertainties that all pulls share (load cell,
    area) change both samples alike; they scale the difference and are not in its interval.
    """
    usable = [fit for fit in fits if len(fit.specimens) >= _FEWEST and fit.parameters == ("mu", "tau0_Pa")]
    return tuple(
        _difference(one, other, number, pressure_Pa)
        for one, other in combinations(usable, 2)
        if one.regime == other.regime and one.sample != other.sample and len(_shared(one, other)) >= _FEWEST
        for number in NUMBERS
    )


def _shared(one: LawFit, other: LawFit) -> tuple[str, ...]:
    return tuple(name for name in one.specimens if name in other.specimens)


def _difference(one: LawFit, other: LawFit, number: str, pressure_Pa: float) -> PairedDifference:
    from scipy.stats import t

    shared = _shared(one, other)
    row = sensitivities(one, pressure_Pa)[number]
    first, second = (np.array([row @ fit.specimens[name] for name in shared]) for fit in (one, other))
    apart = first - second
    mean, dof = float(apart.mean()), float(len(shared) - 1)
    u = float(apart.std(ddof=1) / np.sqrt(len(shared)))
    unpaired = float(np.hypot(first.std(ddof=1), second.std(ddof=1)) / np.sqrt(len(shared)))
    half = float(t.ppf(0.5 + _LEVEL / 2, dof)) * u
    p = float(2 * t.sf(abs(mean) / u, dof)) if u > 0 else float("nan")
    return PairedDifference(
        one.sample, other.sample, one.regime, number, pressure_Pa, mean, u, unpaired, dof, mean - half, mean + half, p,
        shared,
    )  # fmt: skip


def differences_table(differences: Iterable[PairedDifference]) -> pd.DataFrame:
    """One row per difference; the specimens in one cell."""
    import pandas as pd

    columns = [name for name in PairedDifference.__dataclass_fields__ if name != "specimens"]
    rows = [{**{c: getattr(d, c) for c in columns}, "specimens": ";".join(d.specimens)} for d in differences]
    return pd.DataFrame(rows, columns=[*columns, "specimens"])


LAW = LAWS["coulomb_adhesion"]
MOST_SPECIMENS = 100
MOST_REPEATS = 50


@dataclass(frozen=True)
class TwoSidedTest:
    """A two-sided t test: its level, and the probability with which a difference is to be found."""

    level: float = 0.05
    power: float = 0.8


TEST = TwoSidedTest()


@dataclass(frozen=True)
class Power:
    """Power of one campaign for one number ("mu", "tau0_kPa", "T_N" at ``pressure_Pa``) in one regime.

    All in percent of ``reference``, the mean of |number| over the samples. ``specimen_sd_pct`` is the scatter
    of specimens beyond that of their repeats, ``repeat_sd_pct`` what repeats would give one specimen's number
    with one pull at each load. ``smallest_difference_pct`` is the difference of two samples that a test at
    ``level`` finds with probability ``power`` in this design; ``specimens_needed`` and ``repeats_needed``
    would find ``wanted_pct``, each with the other left as it is (None: not within 100 specimens or 50
    repeats, however many).
    """

    regime: Regime
    number: str
    reference: float
    specimens: float
    repeats: float
    specimen_sd_pct: float
    repeat_sd_pct: float
    smallest_difference_pct: float
    wanted_pct: float
    specimens_needed: int | None
    repeats_needed: int | None
    level: float
    power: float
    pressure_Pa: float

    def text(self) -> str:
        """One sentence."""
        more = (
            f"{self.specimens_needed} specimens per sample"
            if self.specimens_needed
            else f"more than {MOST_SPECIMENS} specimens per sample"
        )
        repeats = (
            f" or {self.repeats_needed} repeats at each load"
            if self.repeats_needed
            else "; more repeats alone are not sufficient"
        )
        what = f"{self.regime} {label(self.number, self.pressure_Pa)}"
        return (
            f"{what}: a difference of {self.smallest_difference_pct:.0f} % between two samples would be "
            f"detected with probability {self.power:g} at significance level {self.level:g}. Detecting "
            f"{self.wanted_pct:g} % requires {more}{repeats}."
        )


def power_of_campaign(
    table: pd.DataFrame,
    regime: Regime,
    nominal_area_m2: float,
    *,
    weights: str = "relative",
    wanted_pct: float = 10.0,
    test: TwoSidedTest = TEST,
    pressure_Pa: float = PRESSURE_PA,
) -> tuple[Power, ...]:
    """Power for mu, tau0 and T at ``pressure_Pa`` of the campaign in ``table`` (as for ``fit_samples``).

    A difference counts as found where the two-sided t ``test`` finds it; ``wanted_pct`` is the one to plan for.

    Raises
    ------
    FitError
        No sample with two specimens: the scatter between specimens is unknown.
    """
    fits = [
        fit
        for fit in fit_samples(table, regime, nominal_area_m2, weights=weights)
        if len(fit.specimens) > 1 and np.isfinite(fit.covariance).all()
    ]
    if not fits:
        what = "the scatter between specimens cannot be determined"
        raise FitError(Problem("too_few_specimens", what, allowed="at least one sample with two or more specimens"))
    rows = {r.sample: r for r in sample_rows(table, regime)}
    within = [_one_pull_covariance(rows[fit.sample], fit, weights) for fit in fits]
    repeats = float(np.mean([w.repeats for w in within]))
    specimens = float(np.mean([len(fit.specimens) for fit in fits]))
    powers = []
    for number in NUMBERS:
        scatter = _pooled(fits, within, number, pressure_Pa, repeats)
        smallest = smallest_difference(scatter.specimen_mean_sd(repeats), specimens, test.level, test.power)
        powers.append(
            Power(
                regime, number, scatter.reference, specimens, repeats,
                100 * scatter.specimen_sd, 100 * scatter.repeat_sd, 100 * smallest, wanted_pct,
                _specimens_needed(scatter, repeats, wanted_pct / 100, test),
                _repeats_needed(scatter, specimens, wanted_pct / 100, test),
                test.level, test.power, pressure_Pa,
            )
        )  # fmt: skip
    return tuple(powers)


def smallest_difference(sd: float, specimens: float, level: float = 0.05, power: float = 0.8) -> float:
    """Difference of two means of ``specimens`` values each that is found with probability ``power``.

    In the unit of ``sd``, the standard deviation of the values; two-sided t test at ``level`` with
    2 (specimens - 1) degrees of freedom. Infinite for fewer than two specimens.
    """
    return sd * np.sqrt(2 / specimens) * _noncentrality(2 * (specimens - 1), level, power)


@lru_cache(maxsize=4096)
def _noncentrality(dof: float, level: float, power: float) -> float:
    from scipy.optimize import brentq
    from scipy.stats import nct, t

    if dof <= 0:
        return float("inf")
    critical = float(t.ppf(1 - level / 2, dof))
    # the far tail adds nothing at any power worth asking for
    return float(brentq(lambda shift: float(nct.sf(critical, dof, shift)) - power, 0.0, 10 * critical + 10))


@dataclass(frozen=True)
class _WithinSpecimen:
    """Mean covariance (2, 2) of one specimen's (mu, tau0_Pa) with one pull per load; mean pulls at a load."""

    covariance: FloatArray
    repeats: float


def _one_pull_covariance(rows: Rows, fit: LawFit, weights: str) -> _WithinSpecimen:
    weight = weights_of(rows, fit.nominal_area_m2, weights)
    covariances, repeats = [], []
    for name in fit.specimens:
        own = rows.specimen == name
        design = LAW.design_matrix(rows.load_N[own], fit.nominal_area_m2)
        line = least_squares(design, rows.force_N[own], weight[own])
        repeats.append(own.sum() / len(np.unique(rows.load_N[own])))
        if line.dof:
            covariances.append(line.covariance * repeats[-1])
    covariance = np.mean(covariances, axis=0) if covariances else np.zeros((2, 2))
    return _WithinSpecimen(covariance, float(np.mean(repeats)))


@dataclass(frozen=True)
class _Scatter:
    reference: float
    specimen_sd: float
    repeat_sd: float

    def specimen_mean_sd(self, repeats: float) -> float:
        """Standard deviation of one specimen's number with ``repeats`` pulls at each load."""
        return float(np.sqrt(self.specimen_sd**2 + self.repeat_sd**2 / repeats))


def _pooled(
    fits: list[LawFit], within: list[_WithinSpecimen], number: str, pressure_Pa: float, repeats: float
) -> _Scatter:
    """Pooled over samples, as shares of the mean |number|: T and mu scatter by shares, tau0 by kPa."""
    by = [sensitivities(fit, pressure_Pa)[number] for fit in fits]
    size = np.array([abs(float(b @ fit.values)) for b, fit in zip(by, fits, strict=True)])
    reference = float(size.mean())
    unit = np.full(len(fits), reference) if number == "tau0_kPa" else size
    dof = np.array([fit.dof for fit in fits])
    seen = np.array([float(b @ fit.covariance @ b) * len(fit.specimens) for b, fit in zip(by, fits, strict=True)])
    pulls = np.array([float(b @ w.covariance @ b) for b, w in zip(by, within, strict=True)])
    total = float(dof @ (seen / unit**2) / dof.sum())
    repeat = float(dof @ (pulls / unit**2) / dof.sum())
    return _Scatter(reference, float(np.sqrt(max(total - repeat / repeats, 0.0))), float(np.sqrt(repeat)))


def _specimens_needed(scatter: _Scatter, repeats: float, wanted: float, test: TwoSidedTest) -> int | None:
    sd = scatter.specimen_mean_sd(repeats)
    return _fewest(lambda g: smallest_difference(sd, g, test.level, test.power) <= wanted, range(2, MOST_SPECIMENS + 1))


def _repeats_needed(scatter: _Scatter, specimens: float, wanted: float, test: TwoSidedTest) -> int | None:
    def enough(repeats: int) -> bool:
        return smallest_difference(scatter.specimen_mean_sd(repeats), specimens, test.level, test.power) <= wanted

    return _fewest(enough, range(1, MOST_REPEATS + 1))


def _fewest(enough: Callable[[int], bool], counts: range) -> int | None:
    """The first count that is enough, by bisection: what is enough stays so with more."""
    at = bisect_left(counts, True, key=enough)
    return counts[at] if at < len(counts) else None
