"""Differences between samples: those on the same specimens, and those that a campaign could have detected.

Properties of a specimen (thickness, cut, glue) affect both laws of a sample that is pulled two ways, such as one
pattern along x and along y, and cancel in their difference. The mean of the differences is therefore known better than
the difference of two independent means. The scatter of the differences over G specimens gives its interval by t(G-1).

The power to detect a difference between two samples is that of the two-sided t test of their specimens' means, by the
noncentral t distribution (Cohen, Statistical Power Analysis for the Behavioral Sciences, 1988). The scatter of
specimens and of repeats is pooled over the samples of the campaign: three specimens are too few to determine it.
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
from tribo.fitting.budget import NUMBERS, PRESSURE_PA, sensitivities
from tribo.fitting.linear import Rows, least_squares, sample_rows, weights_of
from tribo.fitting.samples import fit_samples
from tribo.laws import design_over_load
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
    area) change both samples alike; they scale the difference and are not in its interval. ``fits`` are those of a
    campaign with a nominal area.
    """
    usable = [fit for fit in fits if len(fit.specimens) >= _FEWEST and fit.parameters == ("mu", "tau0_Pa")]
    found = []
    for one, other in combinations(usable, 2):
        shared = tuple(name for name in one.specimens if name in other.specimens)
        if one.regime == other.regime and one.sample != other.sample and len(shared) >= _FEWEST:
            found += [_difference(one, other, number, pressure_Pa, shared) for number in NUMBERS]
    return tuple(found)


def _difference(
    one: LawFit, other: LawFit, number: str, pressure_Pa: float, shared: tuple[str, ...]
) -> PairedDifference:
    from scipy.stats import t

    assert one.nominal_area_m2 is not None
    row = sensitivities(one, pressure_Pa * one.nominal_area_m2)[number]
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


MOST_SPECIMENS = 100
MOST_REPEATS = 50


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


def label(number: str, pressure_Pa: float) -> str:
    """A number in words: mu, tau0, T at 10 kPa."""
    return {"mu": "mu", "tau0_kPa": "tau0", "T_N": f"T at {pressure_Pa / 1e3:g} kPa"}[number]


def power_of_campaign(
    table: pd.DataFrame,
    regime: Regime,
    nominal_area_m2: float,
    *,
    weights: str = "relative",
    wanted_pct: float = 10.0,
    level: float = 0.05,
    power: float = 0.8,
) -> tuple[Power, ...]:
    """Power for mu, tau0 and T at 10 kPa of the campaign in ``table`` (as for ``fit_samples``).

    A difference counts as found where the two-sided t test at ``level`` finds it with probability ``power``;
    ``wanted_pct`` is the one to plan for.

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
    covariances, pulls_at_a_load = zip(*(_of_one_pull(rows[fit.sample], fit, weights) for fit in fits), strict=True)
    repeats = float(np.mean(pulls_at_a_load))
    specimens = float(np.mean([len(fit.specimens) for fit in fits]))
    dof = np.array([fit.dof for fit in fits])
    wanted = wanted_pct / 100
    powers = []
    for number in NUMBERS:  # T and mu scatter by shares, tau0 by kPa
        by = [sensitivities(fit, PRESSURE_PA * nominal_area_m2)[number] for fit in fits]
        size = np.array([abs(float(b @ fit.values)) for b, fit in zip(by, fits, strict=True)])
        reference = float(size.mean())
        unit = np.full(len(fits), reference) if number == "tau0_kPa" else size
        seen = np.array([float(b @ fit.covariance @ b) * len(fit.specimens) for b, fit in zip(by, fits, strict=True)])
        pulls = np.array([float(b @ covariance @ b) for b, covariance in zip(by, covariances, strict=True)])
        total = float(dof @ (seen / unit**2) / dof.sum())
        repeat = float(dof @ (pulls / unit**2) / dof.sum())
        specimen_sd, repeat_sd = float(np.sqrt(max(total - repeat / repeats, 0.0))), float(np.sqrt(repeat))

        sd = (specimen_sd, repeat_sd)

        def enough_specimens(count: int, sd: tuple[float, float] = sd) -> bool:
            return _smallest(sd, count, repeats, level, power) <= wanted

        def enough_repeats(count: int, sd: tuple[float, float] = sd) -> bool:
            return _smallest(sd, specimens, count, level, power) <= wanted

        more_specimens = _fewest(range(2, MOST_SPECIMENS + 1), enough_specimens)
        more_repeats = _fewest(range(1, MOST_REPEATS + 1), enough_repeats)
        powers.append(
            Power(
                regime, number, reference, specimens, repeats, 100 * specimen_sd, 100 * repeat_sd,
                100 * _smallest(sd, specimens, repeats, level, power), wanted_pct, more_specimens, more_repeats, level,
                power, PRESSURE_PA,
            )
        )  # fmt: skip
    return tuple(powers)


def _smallest(sd: tuple[float, float], specimens: float, repeats: float, level: float, power: float) -> float:
    """The smallest difference found, by the scatter of specimens and that of one pull at each load."""
    return smallest_difference(float(np.sqrt(sd[0] ** 2 + sd[1] ** 2 / repeats)), specimens, level, power)


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


def _of_one_pull(rows: Rows, fit: LawFit, weights: str) -> tuple[FloatArray, float]:
    """Mean covariance (2, 2) of one specimen's parameters with one pull per load; mean number of pulls at a load."""
    weight = weights_of(rows, fit.nominal_area_m2, weights)
    covariances, repeats = [], []
    for name in fit.specimens:
        own = rows.specimen == name
        design = design_over_load(rows.load_N[own], fit.nominal_area_m2)
        line = least_squares(design, rows.force_N[own], weight[own])
        repeats.append(own.sum() / len(np.unique(rows.load_N[own])))
        if line.dof:
            covariances.append(line.covariance * repeats[-1])
    covariance = np.mean(covariances, axis=0) if covariances else np.zeros((2, 2))
    return covariance, float(np.mean(repeats))


def _fewest(counts: range, enough: Callable[[int], bool]) -> int | None:
    """The first count that is enough, by bisection: what is enough stays so with more."""
    at = bisect_left(counts, True, key=enough)
    return counts[at] if at < len(counts) else None
