"""Laws that are not linear in their parameters, fitted specimen by specimen."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from tribo.errors import FitError, Problem
from tribo.fitting.linear import WEIGHTS, LinearFit, Rows, least_squares, sample_rows, weights_of
from tribo.fitting.samples import ONE_SPECIMEN, combine
from tribo.laws import LAWS, Law
from tribo.records import FloatArray, LawFit, Regime

if TYPE_CHECKING:
    import pandas as pd

REFERENCE_PRESSURE_PA = 10e3


def fit_curve(
    law: Law,
    conditions: tuple[Any, ...],
    force_N: FloatArray,
    start: FloatArray,
    weights: FloatArray | None = None,
) -> LinearFit:
    """Weighted least squares of any law (scipy's trust region with the law's own gradient).

    ``conditions`` are those of the law, arrays (n,) or scalars; ``start`` (k,) the first guess. Values,
    residuals and covariance are as in :func:`tribo.fitting.linear.least_squares`, the covariance from the
    gradient at the solution. Parameters are not bounded.

    Raises
    ------
    FitError
        No convergence, fewer pulls than parameters, or parameters that the data cannot separate.
    """
    from scipy.optimize import least_squares as minimise

    if len(force_N) < len(law.parameters):
        found, allowed = f"{len(force_N)} pulls", f"{len(law.parameters)} or more"
        raise FitError(Problem("too_few_tests", f"too few pulls to fit {law.formula}", found=found, allowed=allowed))
    root = np.ones(len(force_N)) if weights is None else np.sqrt(weights)

    def residuals(values: FloatArray) -> FloatArray:
        return (law.force_N(conditions, values) - force_N) * root

    def slopes(values: FloatArray) -> FloatArray:
        return law.design_matrix(*conditions, at=values) * root[:, None]

    found = minimise(residuals, start, slopes, x_scale="jac", xtol=1e-15, ftol=1e-15, gtol=1e-15)
    if not found.success or not np.isfinite(found.x).all():
        raise FitError(Problem("no_convergence", f"the fit of {law.formula} does not converge", found=found.message))
    tangent = least_squares(law.design_matrix(*conditions, at=found.x), -found.fun / root, weights)
    return LinearFit(found.x, tangent.unscaled, -found.fun, tangent.dof)


def fit_power_law(
    table: pd.DataFrame,
    regime: Regime,
    nominal_area_m2: float,
    *,
    law: str = "pressure_power_adhesion",
    weights: str = "relative",
    reference_pressure_Pa: float = REFERENCE_PRESSURE_PA,
) -> tuple[LawFit, ...]:
    """A power law of pressure ("pressure_power" or "pressure_power_adhesion") of every sample, specimens first.

    ``dof`` and covariance as in ``fit_samples``. Samples whose specimens do not determine the law have NaN
    values and a note. If the interval of the exponent n contains zero, T against N shows no significant curvature.

    Raises
    ------
    FitError
        Another law, or errors in the table.
    """
    power = LAWS.get(law)
    if power is None or power.linear:
        allowed = ", ".join(name for name, one in LAWS.items() if not one.linear)
        raise FitError(Problem("unknown_law", "not a power law", found=law, allowed=allowed))
    return tuple(
        _fit_sample(rows, regime, nominal_area_m2, power, weights, reference_pressure_Pa)
        for rows in sample_rows(table, regime)
    )


def _fit_sample(
    rows: Rows, regime: Regime, area: float, law: Law, weights: str, reference_pressure_Pa: float
) -> LawFit:
    own, notes, alone = {}, [], np.full((len(law.parameters),) * 2, np.nan)
    dof = 0.0
    weight = weights_of(rows, area, weights) if len(np.unique(rows.load_N)) > 1 else np.ones(len(rows))
    for name in rows.specimens:
        keep = rows.specimen == name
        conditions = (rows.load_N[keep], area, reference_pressure_Pa)
        start = _start(law, rows.load_N[keep], rows.force_N[keep], area, reference_pressure_Pa)
        try:
            line = fit_curve(law, conditions, rows.force_N[keep], start, weight[keep])
        except FitError as why:
            notes.append(f"specimen {name} left out: {why}")
            continue
        own[name], alone, dof = line.values, line.covariance, float(line.dof)
    values, covariance = np.full(len(law.parameters), np.nan), alone
    if len(own) == 1:
        (values,) = own.values()
        notes.append(ONE_SPECIMEN)
    elif own:
        values, covariance = combine(np.array(list(own.values())))
        dof = len(own) - 1.0
    method = f"each specimen fitted, mean of {len(own)} specimens; least squares, {WEIGHTS[weights]}"
    return LawFit(
        rows.sample, regime, law.name, law.parameter_names, values, covariance, dof, len(own), len(rows),
        f"{method}, p_ref {reference_pressure_Pa / 1e3:g} kPa", float("nan"), area, own, tuple(notes),
    )  # fmt: skip


def _start(law: Law, load_N: FloatArray, force_N: FloatArray, area: float, reference_Pa: float) -> FloatArray:
    """First guess: Coulomb's line, its slope as mu_ref and no bend."""
    line = np.polynomial.polynomial.polyfit(load_N, force_N, 1) if len(np.unique(load_N)) > 1 else (0.0, 1.0)
    guess = {"mu_ref": line[1] or 1.0, "n": 0.0, "tau0_Pa": line[0] / area}
    if "tau0_Pa" not in law.parameter_names:
        guess["mu_ref"] = line[1] + line[0] / (reference_Pa * area) or 1.0
    return np.array([guess[name] for name in law.parameter_names])
