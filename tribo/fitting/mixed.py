"""The same law as a linear mixed model, for comparison with the fit of each specimen."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np

from tribo.errors import FitError, Problem
from tribo.fitting.rows import sample_rows
from tribo.fitting.weighting import WEIGHTS, weights_of
from tribo.laws.table import LAWS
from tribo.records import LawFit, Regime

if TYPE_CHECKING:
    import pandas as pd

LAW = LAWS["coulomb_adhesion"]


def mixed_model(
    table: pd.DataFrame,
    regime: Regime,
    nominal_area_m2: float,
    *,
    weights: str = "relative",
) -> LawFit | None:
    """One sample's T = mu N + tau0 A with random mu and tau0 per specimen (statsmodels MixedLM, REML).

    ``table`` holds the rows of one sample. None where the fit does not converge, as with two or three
    specimens it often does not. Its intervals are those of statsmodels, normal (dof infinite): with few
    specimens they are too narrow (docs/results/interval-coverage.md), so this fit is not the default.
    What statsmodels warned of is in ``notes``.

    Raises
    ------
    FitError
        More than one sample, missing columns or impossible loads.
    """
    samples = sample_rows(table, regime)
    if len(samples) != 1:
        what = "a mixed model can be fitted to one sample only"
        raise FitError(Problem("one_sample", what, found=f"{len(samples)} samples"))
    rows = samples[0]
    if len(rows.specimens) < 2 or len(np.unique(rows.load_N)) < 2:
        return None
    root = np.sqrt(weights_of(rows, nominal_area_m2, weights))
    scale = np.array([1.0, 1e3])  # tau0 in kPa keeps the random effects of comparable size
    design = LAW.design_matrix(rows.load_N, nominal_area_m2) * scale * root[:, None]
    found = _reml(rows.force_N * root, design, rows.specimen)
    if found is None:
        return None
    values, covariance, warned = found
    return LawFit(
        rows.sample, regime, LAW.name, LAW.parameter_names, values * scale,
        covariance * np.outer(scale, scale), float("inf"), len(rows.specimens), len(rows),
        f"MixedLM, random mu and tau0 per specimen, REML; {WEIGHTS[weights]}",
        float("nan"), nominal_area_m2, notes=warned,
    )  # fmt: skip


def _reml(
    response: np.ndarray, design: np.ndarray, specimen: np.ndarray
) -> tuple[np.ndarray, np.ndarray, tuple[str, ...]] | None:
    from statsmodels.regression.mixed_linear_model import MixedLM

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            result = MixedLM(response, design, specimen, exog_re=design).fit(reml=True)
        except (np.linalg.LinAlgError, ValueError):
            return None
    covariance = np.asarray(result.cov_params())[:2, :2]
    if not result.converged or not np.isfinite(covariance).all() or (np.diag(covariance) <= 0).any():
        return None
    return np.asarray(result.fe_params), covariance, tuple(dict.fromkeys(str(w.message) for w in caught))
