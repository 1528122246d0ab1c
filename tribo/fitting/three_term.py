"""The paper's three-term law over all samples of a campaign together."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from tribo.errors import FitError, Problem
from tribo.fitting.linear import LinearFit, least_squares
from tribo.fitting.rows import Rows, sample_rows
from tribo.fitting.weighting import WEIGHTS, weights_of
from tribo.laws.table import LAWS
from tribo.records import FloatArray, LawFit, Regime

if TYPE_CHECKING:
    import pandas as pd

LAW = LAWS["three_term"]
_ROUNDS = 4
_SMALLEST_SHARE = 0.05  # of the median force, below which no fitted force may set a weight


def fit_three_term(
    table: pd.DataFrame,
    regime: Regime,
    nominal_area_m2: float,
    area_fractions: Mapping[str, float],
    *,
    weights: str = "relative",
) -> LawFit:
    """T = mu N + (a AF + b) A, one mu, a and b for all samples; ``sample`` of the result is "all".

    A specimen has one area fraction, so that a and b cannot be separated; all pulls are fitted at once and the
    covariance comes from leaving out one specimen after the other (jackknife over specimens, dof = G minus 3
    parameters). A specimen name that occurs in several samples (pattern S pulled along x and along y) is one
    specimen. ``area_fractions`` maps each sample to its AF; samples it lacks take no part, with a note.
    ``chi2_red`` is the scatter of samples about the law over that of specimens about their samples.

    Raises
    ------
    FitError
        Fewer than two area fractions or four specimens, or tests that cannot fix the law.
    """
    samples = sample_rows(table, regime)
    used = [rows for rows in samples if rows.sample in area_fractions and len(rows)]
    unknown = [rows.sample for rows in samples if rows.sample not in area_fractions]
    notes = tuple(f"sample {sample} left out: area fraction not known" for sample in unknown)
    if len({area_fractions[rows.sample] for rows in used}) < 2:
        what = "a and b cannot be separated with one area fraction"
        raise FitError(Problem("too_few_samples", what, allowed="two or more area fractions"))
    design, force, weight, specimen = _stack(used, nominal_area_m2, area_fractions, weights)
    names = np.unique(specimen)
    if len(names) <= len(LAW.parameters):
        found, allowed = str(len(names)), f"more than {len(LAW.parameters)}"
        raise FitError(Problem("too_few_specimens", "too few specimens", found=found, allowed=allowed))
    if weights == "relative":
        weight = _relative_to_the_law(design, force, weight)
    whole = least_squares(design, force, weight)
    without = np.array([_without(design, force, weight, specimen == name).values for name in names])
    spread = without - without.mean(axis=0)
    return LawFit(
        "all", regime, LAW.name, LAW.parameter_names, whole.values,
        spread.T @ spread * (len(names) - 1) / len(names), float(len(names) - len(LAW.parameters)),
        len(names), len(force),
        f"all samples at once, jackknife over {len(names)} specimens; "
        f"weighted least squares, {WEIGHTS[weights]}",
        _misfit_of_samples(used, whole, specimen), nominal_area_m2, notes=notes,
    )  # fmt: skip


def _stack(
    used: list[Rows], area: float, area_fractions: Mapping[str, float], weights: str
) -> tuple[FloatArray, FloatArray, FloatArray, np.ndarray]:
    design = [LAW.design_matrix(rows.load_N, area, area_fractions[rows.sample]) for rows in used]
    weight = [weights_of(rows, area, weights) for rows in used]
    return (
        np.concatenate(design),
        np.concatenate([rows.force_N for rows in used]),
        np.concatenate(weight),
        np.concatenate([rows.specimen for rows in used]),
    )


def _relative_to_the_law(design: FloatArray, force: FloatArray, weight: FloatArray) -> FloatArray:
    """Weights 1/T^2 with T of the common law: a sample's own T would weigh lucky specimens less."""
    floor = _SMALLEST_SHARE * float(np.median(np.abs(force)))
    for _ in range(_ROUNDS):
        weight = np.maximum(np.abs(design @ least_squares(design, force, weight).values), floor) ** -2.0
    return weight


def _without(design: FloatArray, force: FloatArray, weight: FloatArray, out: np.ndarray) -> LinearFit:
    return least_squares(design[~out], force[~out], weight[~out])


def _misfit_of_samples(used: list[Rows], whole: LinearFit, specimen: np.ndarray) -> float:
    """F ratio of sample means to specimen means of the weighted residuals; NaN with one specimen per sample."""
    sample = np.concatenate([np.full(len(rows), k) for k, rows in enumerate(used)])
    own = np.array([f"{k}/{name}" for k, name in zip(sample, specimen, strict=True)])
    cells, index = np.unique(own, return_inverse=True)
    count = np.bincount(index)
    mean = np.bincount(index, whole.residuals) / count
    of_sample = np.bincount(index, sample).astype(int) // count
    total = np.bincount(of_sample, count * mean) / np.bincount(of_sample, count)
    dof_sample, dof_specimen = len(used) - 2, len(cells) - len(used)
    if dof_sample < 1 or dof_specimen < 1:
        return float("nan")
    between = float((np.bincount(of_sample, count) * total**2).sum()) / dof_sample
    within = float((count * (mean - total[of_sample]) ** 2).sum()) / dof_specimen
    return between / within if within > 0 else float("nan")
