"""What is reported beside the fits: other weights and laws, the budget, power, and outlying pulls and specimens.

Outlying pulls and specimens are found by robust fits. They are reported and never removed.
"""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import numpy as np
import pandas as pd

from tribo.errors import FitError
from tribo.fitting.alternatives import compared_laws, fit_three_term, mixed_model
from tribo.fitting.budget import campaign_budgets
from tribo.fitting.dependence import dependence
from tribo.fitting.differences import MOST_SPECIMENS, paired_differences, power_of_campaign
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
from tribo.laws import design_over_load
from tribo.records import REGIMES, FloatArray, Ingested, LawFit, Regime

FALSE_ALARMS = 0.05  # chance of flagging anything at all in a campaign without outliers, for Gaussian scatter
_MEDIAN_TO_SD = 1.4826


def assessment(ingested: Ingested, fits: tuple[LawFit, ...], weights: str) -> dict[str, Any]:
    """The results that complete the fits of a study, by the name of their field in ``Study``."""
    table, area = ingested.table(), ingested.campaign.nominal_area_m2
    budgets = campaign_budgets(ingested, fits, weights=weights) if area is not None and fits else ()
    parts = [budget.assign(sample=fit.sample, regime=fit.regime) for fit, budget in budgets]
    power: list[str] = []
    outlying: list[str] = []
    for regime in REGIMES:
        if area is not None:
            with suppress(FitError):
                power += power_sentences(power_of_campaign(table, regime, area, weights=weights))
        for search in (outlying_pulls, outlying_specimens):
            with suppress(FitError):
                outlying += outlying_sentences(search(table, regime, area))
    paired = paired_differences(fits)
    return {
        "other_fits": _other_fits(ingested, fits, weights),
        "budget": pd.concat(parts, ignore_index=True) if parts else None,
        "power": tuple(power),
        "outlying": tuple(outlying),
        "laws": compared_laws(table),
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
    """What :func:`outlying_pulls` or :func:`outlying_specimens` found, a sentence each."""
    siblings = {"pull": "the line of its specimen", "specimen": "the other specimens of its sample"}
    return [
        f"{o['kind']} {o['name']} ({o['sample']}, {o['regime']}): {abs(o['deviation_pct']):.0f} % "
        f"{'above' if o['deviation_pct'] > 0 else 'below'} {siblings[o['kind']]}, {o['score']:.1f} robust standard "
        f"deviations (limit {o['limit']:.1f})"
        for o in outlying.to_dict("records")
    ]


def outlying_pulls(table: pd.DataFrame, regime: Regime, nominal_area_m2: float | None) -> pd.DataFrame:
    """Pulls far from the robust line (Tukey's biweight) of their specimen, one row each, furthest first.

    ``name`` is the test_id, ``deviation_pct`` that of T from the line, ``score`` the same in robust standard
    deviations, and ``limit`` the score that chance exceeds in 5 % of campaigns, all comparisons counted. Deviations are
    judged against the scatter of repeats as a function of force (:mod:`tribo.fitting.linear`), the same for all
    samples. Specimens with fewer than five pulls are skipped: they determine no line.
    """
    samples = [rows for rows in sample_rows(table, regime) if len(np.unique(rows.load_N)) > 1]
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
    scale = _MEDIAN_TO_SD * float(np.median(np.abs(bulk)))
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
    scale = _MEDIAN_TO_SD * float(np.median(np.abs(residual) / np.sqrt(1 - leverage)))
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
