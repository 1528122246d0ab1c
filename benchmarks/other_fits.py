"""Fits that evidence and tests compare with the fits of tribo: power laws, errors in both variables, pooled scatter.

Power laws of pressure are not linear in their parameters and are fitted specimen by specimen.

Errors in both variables: T = mu N + tau0 A where the normal load of each pull is uncertain too (orthogonal distance
regression). An error in N that changes from pull to pull lowers the slope of an ordinary fit by the share it has in the
scatter of N. An error that all pulls share does not show here at all: it belongs to the budget.

Pooled scatter: three specimens leave two degrees of freedom and t = 4.3. Where specimens of every sample scatter by the
same share of their force, as scatter from moulding, mounting and cleaning does, all samples together determine that
share much better. This is an assumption about the campaign and not a property of one sample.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from tribo.errors import FitError, Problem
from tribo.fitting.budget import degrees_of_freedom
from tribo.fitting.linear import WEIGHTS, LinearFit, Rows, least_squares, sample_rows, weights_of
from tribo.fitting.samples import ONE_SPECIMEN, combine, fit_samples
from tribo.laws import BERARDO, LAWS, Law, Parameter, design_over_load
from tribo.records import FloatArray, LawFit, Regime


def pressure_power(
    normal_load_N: Any, nominal_area_m2: Any, reference_pressure_Pa: Any, mu_ref: Any, n: Any
) -> Any:
    """T = mu_ref (p/p_ref)^-n N, p = N/A. N in newton, A in m2, p_ref in pascal, mu_ref and n dimensionless.

    n = 0 is Amontons' law, n = 1/3 a single Hertzian contact (T as N^(2/3)), n = 1 a load-independent T.
    Singular case: N = 0, where T = 0 for n < 1; the function returns 0 there. N must not be negative.
    Source: Bowden and Tabor, The Friction and Lubrication of Solids (1950), elastic contacts.
    """
    load = np.asarray(normal_load_N, float)
    ratio = np.where(load > 0, load, 1.0) / (nominal_area_m2 * reference_pressure_Pa)
    return mu_ref * np.where(load > 0, load * ratio ** (-n), 0.0)


def pressure_power_gradient(
    normal_load_N: Any, nominal_area_m2: Any, reference_pressure_Pa: Any, mu_ref: Any, n: Any
) -> tuple[Any, Any]:
    """(dT/dmu_ref, dT/dn) = (T/mu_ref, -T ln(p/p_ref)), in newton; both 0 at N = 0, their limit for n < 1."""
    load = np.asarray(normal_load_N, float)
    ratio = np.where(load > 0, load, 1.0) / (nominal_area_m2 * reference_pressure_Pa)
    unit_force = pressure_power(normal_load_N, nominal_area_m2, reference_pressure_Pa, 1.0, n)
    return unit_force, -mu_ref * unit_force * np.log(ratio)


def pressure_power_adhesion(
    normal_load_N: Any, nominal_area_m2: Any, reference_pressure_Pa: Any, mu_ref: Any, n: Any, tau0_Pa: Any
) -> Any:
    """T = mu_ref (p/p_ref)^-n N + tau0 A: the power law with the adhesion term of Coulomb's.

    Units as in :func:`pressure_power`, tau0 in pascal. Singular case: N = 0, where T = tau0 A for n < 1; at
    n = 1 the two terms have the same form and only their sum can be determined.
    """
    pressed = pressure_power(normal_load_N, nominal_area_m2, reference_pressure_Pa, mu_ref, n)
    return pressed + tau0_Pa * nominal_area_m2


def pressure_power_adhesion_gradient(
    normal_load_N: Any, nominal_area_m2: Any, reference_pressure_Pa: Any, mu_ref: Any, n: Any, tau0_Pa: Any
) -> tuple[Any, Any, Any]:
    """(dT/dmu_ref, dT/dn, dT/dtau0): those of the power law, and A."""
    by_mu, by_n = pressure_power_gradient(normal_load_N, nominal_area_m2, reference_pressure_Pa, mu_ref, n)
    return by_mu, by_n, nominal_area_m2


CONDITIONS = ("normal_load_N", "nominal_area_m2", "reference_pressure_Pa")
MU_REF = Parameter("mu_ref", "μ_ref", "", "T/N at the reference pressure", low=0.0)
EXPONENT = Parameter("n", "n", "", "exponent by which T/N falls with pressure", low=-1.0, high=1.0)
TAU0 = LAWS["coulomb_adhesion"].parameters[1]
POWER_LAWS: dict[str, Law] = {
    law.name: law
    for law in (
        Law(
            "pressure_power", "T = μ_ref (p/p_ref)^-n N", pressure_power, pressure_power_gradient,
            CONDITIONS, (MU_REF, EXPONENT), False,
            "Bowden and Tabor, The Friction and Lubrication of Solids (1950)",
        ),
        Law(
            "pressure_power_adhesion", "T = μ_ref (p/p_ref)^-n N + τ₀ A",
            pressure_power_adhesion, pressure_power_adhesion_gradient,
            CONDITIONS, (MU_REF, EXPONENT, TAU0), False,
            "Bowden and Tabor (1950) with the adhesion term of " + BERARDO,
        ),
    )
}  # fmt: skip

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
    power = POWER_LAWS.get(law)
    if power is None:
        allowed = ", ".join(POWER_LAWS)
        raise FitError(Problem("unknown_law", "not a power law", found=law, allowed=allowed))
    return tuple(
        _power_law_of(rows, regime, nominal_area_m2, power, weights, reference_pressure_Pa)
        for rows in sample_rows(table, regime)
    )


def _power_law_of(
    rows: Rows, regime: Regime, area: float, law: Law, weights: str, reference_pressure_Pa: float
) -> LawFit:
    own, notes, alone = {}, [], np.full((len(law.parameters),) * 2, np.nan)
    dof = 0.0
    weight = weights_of(rows, area, weights) if len(np.unique(rows.load_N)) > 1 else np.ones(len(rows))
    for name in rows.specimens:
        keep = rows.specimen == name
        conditions = (rows.load_N[keep], area, reference_pressure_Pa)
        start = starting_values(law, rows.load_N[keep], rows.force_N[keep], area, reference_pressure_Pa)
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


def starting_values(law: Law, load_N: FloatArray, force_N: FloatArray, area: float, reference_Pa: float) -> FloatArray:
    """First guess: Coulomb's line, its slope as mu_ref and no bend."""
    line = np.polynomial.polynomial.polyfit(load_N, force_N, 1) if len(np.unique(load_N)) > 1 else (0.0, 1.0)
    guess = {"mu_ref": line[1] or 1.0, "n": 0.0, "tau0_Pa": line[0] / area}
    if "tau0_Pa" not in law.parameter_names:
        guess["mu_ref"] = line[1] + line[0] / (reference_Pa * area) or 1.0
    return np.array([guess[name] for name in law.parameter_names])


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
        design = design_over_load(rows.load_N[keep], fit.nominal_area_m2)
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


PRESSURES_PA = (3e3, 25e3)  # where the share of scatter is taken: the paper's range
UNLIKE_LEVEL = 0.05


def pool_specimen_scatter(
    fits: tuple[LawFit, ...], *, pressures_Pa: tuple[float, float] = PRESSURES_PA
) -> tuple[LawFit, ...]:
    """The same fits with the covariance of specimens pooled over samples, regime by regime.

    ``fits`` are those of ``fit_samples``. What is pooled is the covariance of (T at the lower, T at the higher
    pressure) relative to the sample's own forces. ``dof`` becomes that of all specimens together, samples that
    share specimens counted once. Samples of one specimen gain an interval for their pattern; samples without
    values stay as they are. Where Bartlett's test finds that samples differ in scatter at 5 %, a note says that
    the pooled intervals are not to be trusted.

    Raises
    ------
    FitError
        No sample has two specimens, a fitted force is not positive, or a law other than T = mu N + tau0 A.
    """
    regimes = dict.fromkeys(fit.regime for fit in fits)
    pooled = {r: _pool(tuple(f for f in fits if f.regime == r), pressures_Pa) for r in regimes}
    return tuple(pooled[fit.regime][fit.sample] for fit in fits)


def _pool(fits: tuple[LawFit, ...], pressures_Pa: tuple[float, float]) -> dict[str, LawFit]:
    if wrong := [fit for fit in fits if fit.law != "coulomb_adhesion"]:
        what, allowed = "this law cannot be pooled", "coulomb_adhesion"
        raise FitError(Problem("unknown_law", what, found=wrong[0].law, allowed=allowed))
    used = [fit for fit in fits if fit.specimens]
    shares = {fit.sample: _shares(fit, pressures_Pa) for fit in used}
    several = [fit.sample for fit in used if len(fit.specimens) > 1]
    if not several:
        what = "the scatter between specimens cannot be determined"
        raise FitError(Problem("too_few_specimens", what, allowed="at least one sample with two or more specimens"))
    freedom = np.array([len(shares[s]) - 1.0 for s in several])
    covariances = np.array([np.cov(shares[s], rowvar=False) for s in several])
    common = np.einsum("s,sij->ij", freedom, covariances) / freedom.sum()
    dof = degrees_of_freedom([fit for fit in used if len(fit.specimens) > 1])
    notes = _unlike([shares[s] for s in several])
    found = {fit.sample: fit for fit in fits}
    for fit in used:
        found[fit.sample] = replace(
            fit,
            covariance=_back(common, fit, pressures_Pa) / len(fit.specimens),
            dof=dof,
            method=f"{fit.method}; scatter of specimens pooled over {len(several)} samples, t({dof:g})",
            notes=(*(n for n in fit.notes if n != ONE_SPECIMEN), *notes),
        )
    return found


def _map(fit: LawFit, pressures_Pa: tuple[float, float]) -> FloatArray:
    """(2, 2) that takes (mu, tau0_Pa) to the forces at both pressures, relative to the sample's own."""
    area = fit.nominal_area_m2
    forces = design_over_load(np.array(pressures_Pa) * area, area)
    own = forces @ fit.values
    if (own <= 0).any():
        found = f"sample {fit.sample}: {own.min():.3g} N"
        raise FitError(Problem("no_force", "a fitted force is not positive", found=found))
    return np.asarray(forces / own[:, None])


def _shares(fit: LawFit, pressures_Pa: tuple[float, float]) -> FloatArray:
    return np.array(list(fit.specimens.values())) @ _map(fit, pressures_Pa).T


def _back(common: FloatArray, fit: LawFit, pressures_Pa: tuple[float, float]) -> FloatArray:
    inverse = np.linalg.inv(_map(fit, pressures_Pa))
    return np.asarray(inverse @ common @ inverse.T)


def _unlike(shares: list[FloatArray]) -> tuple[str, ...]:
    from scipy.stats import bartlett

    middle = [s.mean(axis=1) for s in shares]
    if len(middle) < 2 or any(np.ptp(m) == 0 for m in middle):
        return ()
    p = float(bartlett(*middle).pvalue)
    if p >= UNLIKE_LEVEL:
        return ()
    return (f"the scatter of specimens differs between samples (p = {p:.1g}): the pooled interval is not reliable",)
