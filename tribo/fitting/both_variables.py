"""T = mu N + tau0 A where the normal load of each pull is uncertain too (orthogonal distance regression).

An error in N that changes from pull to pull lowers the slope of an ordinary fit by the share it has in the
scatter of N. An error that all pulls share does not show here at all: it belongs to the budget.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from tribo.errors import FitError, Problem
from tribo.fitting.linear import Rows, least_squares, sample_rows, weights_of
from tribo.fitting.samples import combine, fit_samples
from tribo.laws import LAWS
from tribo.records import FloatArray, LawFit, Regime

if TYPE_CHECKING:
    import pandas as pd

LAW = LAWS["coulomb_adhesion"]
_PA_PER_KPA = 1e3  # tau0 is fitted in kPa, of a size with mu
_EXACT = 1e-3  # of the largest uncertainty of a load: one below, as at zero load, is taken as this small
_LEAST_SHARE = 0.05  # of the scatter about the line that is left to T when N is said to explain it all


def fit_errors_in_both(
    table: pd.DataFrame,
    regime: Regime,
    nominal_area_m2: float,
    *,
    load_u_N: float = 0.0,
    load_u_share: float = 0.0,
    weights: str = "relative",
) -> tuple[LawFit, ...]:
    """As ``fit_samples``, each specimen by odrpack with N known to sqrt(load_u_N^2 + (load_u_share N)^2).

    The standard uncertainty of N is that of one pull, independent from pull to pull. The scatter of T is
    that of the pulls about their line (with ``weights``), minus the part explained by the stated errors of N.

    Raises
    ------
    FitError
        As ``fit_samples``; negative uncertainties, or none at all.
    """
    if min(load_u_N, load_u_share) < 0 or load_u_N + load_u_share == 0:
        found, allowed = f"{load_u_N:g} N and a share of {load_u_share:g}", "at least one of them above zero"
        raise FitError(Problem("bad_load_uncertainty", "no uncertainty of the load", found=found, allowed=allowed))
    plain = fit_samples(table, regime, nominal_area_m2, weights=weights)
    rows = {r.sample: r for r in sample_rows(table, regime)}
    return tuple(_refitted(fit, rows[fit.sample], load_u_N, load_u_share, weights) for fit in plain)


def _refitted(fit: LawFit, rows: Rows, load_u_N: float, load_u_share: float, weights: str) -> LawFit:
    if not fit.specimens:
        return replace(fit, notes=(*fit.notes, "the uncertainty of the normal load is not taken into account"))
    load_u = np.hypot(load_u_N, load_u_share * rows.load_N)
    force_variance = _force_variance(rows, fit, load_u, weights)
    own, covariances = {}, []
    for name in fit.specimens:
        keep = rows.specimen == name
        own[name], covariance = _orthogonal(
            rows.load_N[keep], rows.force_N[keep], load_u[keep], force_variance[keep], fit
        )
        covariances.append(covariance)
    values, covariance = combine(np.array(list(own.values()))) if len(own) > 1 else (*own.values(), covariance)
    how = f"errors in both variables (odrpack), N known to {load_u_N:g} N and {100 * load_u_share:g} %"
    return replace(
        fit, values=values, covariance=covariance, specimens=own, method=f"{fit.method}; {how}"
    )  # fmt: skip


def _force_variance(rows: Rows, fit: LawFit, load_u: FloatArray, weights: str) -> FloatArray:
    """Variance (n,) of T: that about the specimens' lines, less mu^2 u(N)^2."""
    weight = weights_of(rows, fit.nominal_area_m2, weights)
    square, dof = 0.0, 0
    for name in fit.specimens:
        keep = rows.specimen == name
        design = LAW.design_matrix(rows.load_N[keep], fit.nominal_area_m2)
        line = least_squares(design, rows.force_N[keep], weight[keep])
        square, dof = square + float(line.residuals @ line.residuals), dof + line.dof
    about_line = (square / dof if dof and square else 1.0) / weight
    return np.maximum(about_line - (fit.value("mu") * load_u) ** 2, _LEAST_SHARE * about_line)


def _orthogonal(
    load_N: FloatArray, force_N: FloatArray, load_u: FloatArray, force_variance: FloatArray, fit: LawFit
) -> tuple[FloatArray, FloatArray]:
    """(mu, tau0_Pa) of one specimen and their covariance, scaled by its own residuals."""
    from odrpack import odr_fit

    area = fit.nominal_area_m2 * _PA_PER_KPA
    by = np.array([1.0, _PA_PER_KPA])
    result = odr_fit(
        lambda load, beta: beta[0] * load + beta[1] * area,
        load_N,
        force_N,
        fit.values / by,
        weight_x=np.maximum(load_u, _EXACT * load_u.max()) ** -2.0,
        weight_y=1 / force_variance,
        jac_beta=lambda load, beta: np.stack([load, np.full_like(load, area)]),
        jac_x=lambda load, beta: np.full_like(load, beta[0]),
    )
    if not result.success:
        what = f"errors in both variables: no convergence for sample {fit.sample}"
        raise FitError(Problem("no_convergence", what, found=str(result.stopreason)))
    covariance = np.outer(by, by) * result.cov_beta * result.res_var
    return result.beta * by, covariance
