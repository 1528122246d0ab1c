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
from functools import lru_cache
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

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


def paired_differences(fits: Iterable[LawFit], *, pressure_Pa: float = PRESSURE_PA) -> pd.DataFrame:
    """Differences between every two samples that share two specimens or more, one row a regime and number.

    Specimens are the same if their names in tests.csv are. Type B uncertainties that all pulls share (load cell,
    area) change both samples alike; they scale the difference and are not in its interval.

    Parameters
    ----------
    fits : those of a campaign with a nominal area
    pressure_Pa : nominal pressure at which T is compared

    Returns
    -------
    DataFrame
        ``difference`` of a ``number`` ("mu", "tau0_kPa", "T_N" at ``pressure_Pa``) of ``sample`` minus that of
        ``other``; ``u``, its standard uncertainty; ``unpaired_u``, what that would be with different specimens for each
        sample; ``low`` to ``high``, its 95 % interval by t(``dof``); ``p``, the probability of so large a difference
        by chance; ``specimens``, separated by semicolons.
    """
    import pandas as pd

    usable = [fit for fit in fits if len(fit.specimens) >= _FEWEST and fit.parameters == ("mu", "tau0_Pa")]
    found = []
    for one, other in combinations(usable, 2):
        shared = [name for name in one.specimens if name in other.specimens]
        if one.regime == other.regime and one.sample != other.sample and len(shared) >= _FEWEST:
            found += [_difference(one, other, number, pressure_Pa, shared) for number in NUMBERS]
    return pd.DataFrame(found)


def _difference(one: LawFit, other: LawFit, number: str, pressure_Pa: float, shared: list[str]) -> dict[str, object]:
    from scipy.stats import t

    assert one.nominal_area_m2 is not None
    row = sensitivities(one, pressure_Pa * one.nominal_area_m2)[number]
    first, second = (np.array([row @ fit.specimens[name] for name in shared]) for fit in (one, other))
    apart = first - second
    mean, dof = float(apart.mean()), float(len(shared) - 1)
    u = float(apart.std(ddof=1) / np.sqrt(len(shared)))
    half = float(t.ppf(0.5 + _LEVEL / 2, dof)) * u
    return {
        "sample": one.sample, "other": other.sample, "regime": one.regime, "number": number, "pressure_Pa": pressure_Pa,
        "difference": mean, "u": u,
        "unpaired_u": float(np.hypot(first.std(ddof=1), second.std(ddof=1)) / np.sqrt(len(shared))),
        "dof": dof, "low": mean - half, "high": mean + half,
        "p": float(2 * t.sf(abs(mean) / u, dof)) if u > 0 else float("nan"), "specimens": ";".join(shared),
    }  # fmt: skip


MOST_SPECIMENS = 100
MOST_REPEATS = 50


def power_of_campaign(
    table: pd.DataFrame,
    regime: Regime,
    nominal_area_m2: float,
    *,
    weights: str = "relative",
    wanted_pct: float = 10.0,
    level: float = 0.05,
    power: float = 0.8,
) -> pd.DataFrame:
    """Power for mu, tau0 and T at 10 kPa of the campaign in ``table`` (as for ``fit_samples``), a row each.

    A difference counts as found where the two-sided t test at ``level`` finds it with probability ``power``;
    ``wanted_pct`` is the one to plan for.

    Returns
    -------
    DataFrame
        All in percent of ``reference``, the mean of the number over the samples without its sign.
        ``specimen_sd_pct`` is the scatter of specimens beyond that of their repeats, ``repeat_sd_pct`` what repeats
        would give one specimen's number with one pull at each load. ``smallest_difference_pct`` of two samples is found
        in this design, with ``specimens`` and ``repeats`` at each load; ``specimens_needed`` and ``repeats_needed``
        would find ``wanted_pct``, each with the other left as it is (NA: not within 100 specimens or 50 repeats).

    Raises
    ------
    FitError
        No sample with two specimens: the scatter between specimens is unknown.
    """
    import pandas as pd

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
    rows_of_power = []
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

        def smallest(specimens: float, repeats: float, sd: float = specimen_sd, repeat_sd: float = repeat_sd) -> float:
            both = float(np.sqrt(sd**2 + repeat_sd**2 / repeats))
            return smallest_difference(both, specimens, level, power)

        rows_of_power.append(
            {"regime": regime, "number": number, "reference": reference, "specimens": specimens, "repeats": repeats,
             "specimen_sd_pct": 100 * specimen_sd, "repeat_sd_pct": 100 * repeat_sd,
             "smallest_difference_pct": 100 * smallest(specimens, repeats), "wanted_pct": wanted_pct,
             "specimens_needed": _fewest(range(2, MOST_SPECIMENS + 1), wanted, lambda n: smallest(n, repeats)),
             "repeats_needed": _fewest(range(1, MOST_REPEATS + 1), wanted, lambda n: smallest(specimens, n)),
             "level": level, "power": power, "pressure_Pa": PRESSURE_PA}
        )  # fmt: skip
    return pd.DataFrame(rows_of_power).astype({"specimens_needed": "Int64", "repeats_needed": "Int64"})


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


def _fewest(counts: range, wanted: float, smallest: Callable[[int], float]) -> int | None:
    """The first count that finds a difference, by bisection: what is enough stays so with more."""
    at = bisect_left(counts, True, key=lambda count: smallest(count) <= wanted)
    return counts[at] if at < len(counts) else None
