"""What is reported beside the fits: other weights and laws, the budget, differences, power, and outliers.

Outlying pulls and specimens are found by robust fits. They are reported and never removed.

Properties of a specimen (thickness, cut, glue) affect both laws of a sample that is pulled two ways, such as one
pattern along x and along y, and cancel in their difference. The mean of the differences is therefore known better than
the difference of two independent means. The scatter of the differences over G specimens gives its interval by t(G-1).

The power to detect a difference between two samples is that of the two-sided t test of their specimens' means, by the
noncentral t distribution (Cohen, Statistical Power Analysis for the Behavioral Sciences, 1988). The scatter of
specimens and of repeats is pooled over the samples of the campaign: three specimens are too few to determine it.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import lru_cache
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from tribo.errors import FitError, Problem
from tribo.fitting.alternatives import compared_laws, dependence, fit_three_term, mixed_model
from tribo.fitting.budget import NUMBERS, PRESSURE_PA, campaign_budgets, sensitivities
from tribo.fitting.linear import (
    WEIGHTS,
    Rows,
    expected_force_N,
    least_squares,
    repeat_scatter,
    sample_rows,
    weights_by_repeats,
    weights_of,
)
from tribo.fitting.samples import fit_samples
from tribo.fitting.siblings import MOST_ALONE
from tribo.laws import design_over_load
from tribo.records import MEDIAN_TO_SD, REGIMES, FloatArray, Ingested, LawFit, Regime

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


FALSE_ALARMS = 0.05  # chance of flagging anything at all in a campaign without outliers, for Gaussian scatter


def assessment(ingested: Ingested, fits: tuple[LawFit, ...], weights: str) -> dict[str, Any]:
    """The results that complete the fits of a study, by the name of their field in ``Study``."""
    table, area = ingested.table(), ingested.campaign.nominal_area_m2
    budgets = campaign_budgets(ingested, fits, weights=weights) if area is not None and fits else ()
    parts = [budget.assign(sample=fit.sample, regime=fit.regime) for fit, budget in budgets]
    power: list[str] = []
    outlying: list[str] = []
    laws = compared_laws(table)
    for regime in REGIMES:
        if area is not None:
            with suppress(FitError):
                power += power_sentences(power_of_campaign(table, regime, area, weights=weights))
        with suppress(FitError):
            outlying += outlying_sentences(outlying_pulls(table, regime, area, exponents_of(laws, regime)))
        with suppress(FitError):
            outlying += outlying_sentences(outlying_specimens(table, regime, area))
    paired = paired_differences(fits)
    return {
        "other_fits": _other_fits(ingested, fits, weights),
        "budget": pd.concat(parts, ignore_index=True) if parts else None,
        "power": tuple(power),
        "outlying": tuple(outlying),
        "laws": laws,
        "dependence": dependence(ingested),
        "differences": paired if len(paired) else None,
    }


def _other_fits(ingested: Ingested, fits: tuple[LawFit, ...], weights: str) -> tuple[LawFit, ...]:
    """The same law under the other weights, mixed models where they converge, and the three-term law."""
    table, area = ingested.table(), ingested.campaign.nominal_area_m2
    fractions = {s: ingested.campaign.area_fraction(s) for s in sorted(set(table["sample"]))}
    found: list[LawFit] = []
    for regime in REGIMES:
        for others in WEIGHTS:
            if others != weights:
                with suppress(FitError):  # "repeats" needs repeats, "ratio" loads above zero
                    found += fit_samples(table, regime, area, weights=others)
        resolved = {f.sample for f in fits if f.regime == regime and np.isfinite(f.values).all()}
        mixed = (mixed_model(rows, regime, area) for s, rows in table.groupby("sample") if s in resolved)
        found += [fit for fit in mixed if fit is not None]
        with suppress(FitError):
            found.append(fit_three_term(table, regime, area, fractions))
    return tuple(found)


def power_sentences(power: pd.DataFrame) -> list[str]:
    """What :func:`tribo.fitting.power_of_campaign` found, a sentence for each number."""
    found = []
    for row in power.to_dict("records"):
        number = {"mu": "mu", "tau0_kPa": "tau0", "T_N": f"T at {row['pressure_Pa'] / 1e3:g} kPa"}[row["number"]]
        specimens, repeats = row["specimens_needed"], row["repeats_needed"]
        enough = f"more than {MOST_SPECIMENS}" if pd.isna(specimens) else f"{specimens}"
        more = "; more repeats alone are not sufficient" if pd.isna(repeats) else f" or {repeats} repeats at each load"
        found.append(
            f"{row['regime']} {number}: a difference of {row['smallest_difference_pct']:.0f} % between two samples "
            f"would be detected with probability {row['power']:g} at significance level {row['level']:g}. Detecting "
            f"{row['wanted_pct']:g} % requires {enough} specimens per sample{more}."
        )
    return found


OUTLYING = ["kind", "name", "sample", "regime", "deviation_pct", "score", "limit"]


def outlying_sentences(outlying: pd.DataFrame) -> list[str]:
    """What :func:`outlying_pulls` or :func:`outlying_specimens` found, a sentence each; many of one sample in one."""
    siblings = {"pull": "the law of {} specimen", "specimen": "the other specimens of {} sample"}
    ways = outlying.assign(way=["above" if d > 0 else "below" for d in outlying["deviation_pct"]])
    found = []
    for (kind, sample, regime, way), rows in ways.groupby(["kind", "sample", "regime", "way"], sort=False):
        beside, limit = siblings[str(kind)], f"(limit {rows['limit'].iloc[0]:.1f})"
        size = rows["deviation_pct"].abs()
        if len(rows) > MOST_ALONE:
            found.append(
                f"{len(rows)} {kind}s ({sample}, {regime}): {size.min():.0f} to {size.max():.0f} % {way} "
                f"{beside.format('their')}, up to {rows['score'].max():.1f} robust standard deviations {limit}: "
                f"{', '.join(rows['name'][:MOST_ALONE])} and {len(rows) - MOST_ALONE} more"
            )
            continue
        found += [
            f"{kind} {name} ({sample}, {regime}): {deviation:.0f} % {way} {beside.format('its')}, {score:.1f} robust "
            f"standard deviations {limit}"
            for name, deviation, score in zip(rows["name"], size, rows["score"], strict=True)
        ]
    return found


def exponents_of(laws: pd.DataFrame, regime: Regime) -> dict[str, float]:
    """The exponent of each sample whose chosen law is a power of the load; of :func:`tribo.fitting.compared_laws`."""
    powers = laws[laws["chosen"] & (laws["regime"] == regime) & (laws["law"] == "power")]
    return dict(zip(powers["sample"], powers["b"], strict=True))


def outlying_pulls(
    table: pd.DataFrame, regime: Regime, nominal_area_m2: float | None, exponents: Mapping[str, float] | None = None
) -> pd.DataFrame:
    """Pulls far from the robust line (Tukey's biweight) of their specimen, one row each, furthest first.

    ``name`` is the test_id, ``deviation_pct`` that of T from the line, ``score`` the same in robust standard
    deviations, and ``limit`` the score that chance exceeds in 5 % of campaigns, all comparisons counted. Deviations are
    judged against the scatter of repeats as a function of force (:mod:`tribo.fitting.linear`), the same for all
    samples. Specimens with fewer than five pulls are skipped: they determine no line. A sample in ``exponents`` follows
    a power of the load: its line is one over the load to that power.
    """
    samples = [rows for rows in sample_rows(table, regime) if len(np.unique(rows.load_N)) > 1]
    powers = exponents or {}
    samples = [replace(rows, load_N=rows.load_N ** powers.get(rows.sample, 1.0)) for rows in samples]
    scatter = repeat_scatter(tuple(samples)) if samples else None
    lines = []
    for rows in samples:
        expected = expected_force_N(rows, nominal_area_m2)
        weight = weights_by_repeats(expected, scatter)
        for name in rows.specimens:
            keep = rows.specimen == name
            if keep.sum() >= 5 and len(np.unique(rows.load_N[keep])) > 1:
                lines.append(_robust_line(rows.take(keep), weight[keep], nominal_area_m2))
    if not lines:
        return pd.DataFrame(columns=OUTLYING)
    bulk = np.concatenate([residual / np.sqrt(1 - leverage) for _, _, residual, leverage in lines])
    scale = MEDIAN_TO_SD * float(np.median(np.abs(bulk)))
    if scale == 0:
        return pd.DataFrame(columns=OUTLYING)
    limit = _limit(len(bulk), float(sum((1 - leverage).sum() for *_, leverage in lines)))
    found = []
    for rows, force_N, residual, leverage in lines:
        # a far pull has next to no weight in its line: its residual is that of a pull left out, wider by 1/(1 - h)
        score = np.abs(residual) * np.sqrt(1 - leverage) / scale
        found += [
            (
                "pull", str(rows.test_id[k]), rows.sample, regime,
                100 * float(rows.force_N[k] / force_N[k] - 1), float(score[k]), limit,
            )
            for k in np.flatnonzero(score > limit)
        ]  # fmt: skip
    return pd.DataFrame(found, columns=OUTLYING).sort_values("score", ascending=False, kind="stable", ignore_index=True)


def outlying_specimens(table: pd.DataFrame, regime: Regime, nominal_area_m2: float | None) -> pd.DataFrame:
    """Specimens whose force deviates from that of the other specimens of their sample, one row each, furthest first.

    Columns are those of :func:`outlying_pulls`. Judged at the lowest and the highest load of the campaign by a robust
    fit (Huber) of log T on the sample; needs samples of three specimens or more. With three, one that differs is found
    only if the specimens of the other samples agree well among themselves.
    """
    names, samples, forces = _specimen_forces(table, regime, nominal_area_m2)
    columns = np.log(forces).T if len(names) else ()
    found = [row for column in columns for row in _apart(names, samples, column, regime, len(columns))]
    table = pd.DataFrame(found, columns=OUTLYING).sort_values("score", ascending=False, kind="stable")
    return table.drop_duplicates(["sample", "name"], ignore_index=True)


def _robust_line(rows: Rows, weight: FloatArray, area: float | None) -> tuple[Rows, FloatArray, FloatArray, FloatArray]:
    """Robust line of one specimen: its pulls, fitted force, weighted residual and leverage, arrays (n,)."""
    from statsmodels.robust.norms import TukeyBiweight
    from statsmodels.robust.robust_linear_model import RLM

    root = np.sqrt(weight)
    design = design_over_load(rows.load_N, area)
    plain = least_squares(design, rows.force_N, weight)
    weighted = design * root[:, None]
    leverage = np.einsum("ij,jk,ik->i", weighted, plain.unscaled, weighted)
    values = plain.values
    if plain.residuals @ plain.residuals > 1e-20 * (rows.force_N * root) @ (rows.force_N * root):
        tau0_in_kPa = np.array([1.0, 1e3])  # columns of comparable length
        fit = RLM(rows.force_N * root, weighted * tau0_in_kPa, M=TukeyBiweight()).fit()
        values = np.asarray(fit.params) * tau0_in_kPa
    force = design @ values
    return rows, force, (rows.force_N - force) * root, leverage


def _specimen_forces(
    table: pd.DataFrame, regime: Regime, area: float | None
) -> tuple[np.ndarray, np.ndarray, FloatArray]:
    """Names (g,), samples (g,) and fitted forces (g, 2) at the lowest and highest load of the campaign."""
    names, samples, lines = [], [], []
    every = [rows for rows in sample_rows(table, regime) if len(np.unique(rows.load_N)) > 1]
    for rows in every:
        weight = weights_of(rows, area, "relative")
        own = [s for s in rows.specimens if len(np.unique(rows.load_N[rows.specimen == s])) > 1]
        for name in own if len(own) > 2 else []:
            keep = rows.specimen == name
            design = design_over_load(rows.load_N[keep], area)
            lines.append(least_squares(design, rows.force_N[keep], weight[keep]).values)
            names.append(name)
            samples.append(rows.sample)
    if not lines:
        return np.array([]), np.array([]), np.zeros((0, 2))
    loads = np.concatenate([rows.load_N for rows in every])
    at = design_over_load(np.array([loads[loads > 0].min(), loads.max()]), area)
    forces = np.array(lines) @ at.T
    above = (forces > 0).all(axis=1)
    return np.array(names)[above], np.array(samples)[above], forces[above]


def _apart(
    names: np.ndarray, samples: np.ndarray, log_force: FloatArray, regime: Regime, comparisons: int
) -> list[tuple[object, ...]]:
    """Rows of OUTLYING: specimens whose log force (g,) is far from that of their sample."""
    from statsmodels.robust.norms import HuberT
    from statsmodels.robust.robust_linear_model import RLM

    kinds, index = np.unique(samples, return_inverse=True)
    dof = len(names) - len(kinds)
    design = np.eye(len(kinds))[index]
    leverage = 1 / np.bincount(index)[index]
    fit = RLM(log_force, design, M=HuberT()).fit()
    residual = np.asarray(fit.resid)
    scale = MEDIAN_TO_SD * float(np.median(np.abs(residual) / np.sqrt(1 - leverage)))
    if scale == 0:
        return []
    score = np.abs(residual) / (scale * np.sqrt(1 - leverage))
    limit = _limit(comparisons * len(names), dof)
    return [
        (
            "specimen", str(names[k]), str(samples[k]), regime,
            100 * float(np.expm1(residual[k])), float(score[k]), limit,
        )
        for k in np.flatnonzero(score > limit)
    ]  # fmt: skip


def _limit(comparisons: int, dof: float) -> float:
    """Score that the largest of ``comparisons`` passes with probability FALSE_ALARMS (Bonferroni, t with ``dof``).

    The robust scale is worth about 0.37 of the degrees of freedom of a standard deviation (the efficiency of
    the median absolute deviation under Gaussian scatter).
    """
    from scipy.stats import t

    return float(t.ppf(1 - FALSE_ALARMS / (2 * comparisons), max(0.37 * dof, 1.0)))
