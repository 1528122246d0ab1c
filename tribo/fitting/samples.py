"""mu and tau0 of every sample: each specimen fitted first, then the specimens combined.

Pulls of one specimen are not independent of each other: they share the specimen. The scatter that counts for
another specimen of the same pattern is therefore that of the specimens' own values. With G specimens the
interval of their mean by t(G-1) is exact for Gaussian specimens of equal precision, whatever the scatter of
mu, of tau0 and of repeats; where precisions differ it is conservative at 95 % and above (Bakirov and Szekely,
Zap. Nauchn. Sem. POMI 328 (2005) 5; Ibragimov and Mueller, J. Bus. Econ. Stat. 28 (2010) 453).
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from tribo.errors import FitError, Problem
from tribo.fitting.linear import WEIGHTS, LinearFit, Rows, least_squares, sample_rows, weights_of
from tribo.laws import design_over_load, law_over_load
from tribo.records import REGIMES, FloatArray, LawFit, Regime

if TYPE_CHECKING:
    import pandas as pd

ONE_SPECIMEN = "only one specimen: the interval applies to this specimen, not to the pattern"
LACK_OF_FIT_LEVEL = 0.01


def fit_regimes(table: pd.DataFrame, nominal_area_m2: float | None, *, weights: str = "relative") -> tuple[LawFit, ...]:
    """The fits of :func:`fit_samples` to static and to sliding friction; a regime that no pull shows has none.

    Nor has one that is known at too few loads, as the static friction of ladders: each has one start from rest.

    Raises
    ------
    FitError
        No sample has enough loads for the law.
    """
    found: list[LawFit] = []
    problems: list[Problem] = []
    for regime in REGIMES:
        try:
            found += fit_samples(table, regime, nominal_area_m2, weights=weights)
        except FitError as why:
            too_few = {problem.kind for problem in why.problems} == {"too_few_loads"}
            if np.isfinite(table[f"{regime}_N"]).any() and not too_few:
                raise
            problems += why.problems  # a log of steps while sliding has no static peaks, and a law all the same
    if not found:
        raise FitError(list(dict.fromkeys(problems)))
    return tuple(found)


def fit_samples(
    table: pd.DataFrame,
    regime: Regime,
    nominal_area_m2: float | None,
    *,
    weights: str = "relative",
    by: str = "specimens",
) -> tuple[LawFit, ...]:
    """T = mu N + tau0 A of every sample by its own tests alone, samples in alphabetical order.

    Parameters
    ----------
    table : DataFrame
        As returned by ``Ingested.table()``: sample, specimen, normal_load_N, static_N, sliding_N. Tests
        without a force (NaN) are left out.
    regime : "static" or "sliding"
    nominal_area_m2 : float or None
        A, in m2. None where it is not known: the law is then T = mu N + T0, T0 in newton.
    weights : "relative", "ratio", "force" or "repeats"
        Which scatter is constant over the loads; see :mod:`tribo.fitting.linear`.
    by : "specimens" or "tests"
        "tests" pools all pulls as if they were independent; offered for comparison, its intervals are too
        narrow wherever specimens differ.

    Returns
    -------
    tuple of LawFit
        ``covariance`` of the two parameters is that of the mean over specimens, ``dof`` = G - 1. One specimen:
        its own covariance, dof = n - 2, and a note. tau0 is never clamped. A sample whose tests do not
        determine the law, such as at loads too close to each other, has NaN values and a note with the reason.
        ``chi2_red`` is the reduced chi-squared of the load means about each specimen's line, the variance of a mean
        taken from its repeats (NaN without repeats).

    Raises
    ------
    FitError
        Missing columns, impossible loads or area, unknown weights, or no sample that can be fitted.

    Examples
    --------
    >>> import pandas as pd
    >>> loads = pd.Series([0.2, 0.5, 1.0] * 3)
    >>> specimen = pd.Series(["A1"] * 3 + ["A2"] * 3 + ["A3"] * 3)
    >>> table = pd.DataFrame({"sample": "A", "specimen": specimen, "normal_load_N": loads, "static_N": 2 * loads + 0.1})
    >>> (fit,) = fit_samples(table, "static", 50e-6)
    >>> round(fit.mu, 6), round(fit.tau0_Pa, 3), fit.n_specimens
    (2.0, 2000.0, 3)
    """
    if by not in ("specimens", "tests"):
        what = "unknown way to combine tests"
        raise FitError(Problem("unknown_nesting", what, found=by, allowed="specimens or tests"))
    if nominal_area_m2 is not None and not (np.isfinite(nominal_area_m2) and nominal_area_m2 > 0):
        found = f"{nominal_area_m2:g} m2"
        raise FitError(Problem("bad_area", "not a possible nominal area", found=found, allowed="more than 0 m2"))
    samples = sample_rows(table, regime)
    fits = tuple(_fit_sample(rows, regime, nominal_area_m2, weights, by) for rows in samples)
    if not any(np.isfinite(fit.values).all() for fit in fits):
        wanted = "two or more loads for each sample, a factor of two or more apart"
        reasons = [Problem("too_few_loads", f"sample {f.sample}: {f.notes[-1]}", allowed=wanted) for f in fits]
        raise FitError(reasons or Problem("no_tests", "the table contains no tests"))
    return fits


def _fit_sample(rows: Rows, regime: Regime, area: float | None, weights: str, by: str) -> LawFit:
    notes: tuple[str, ...] = ()
    if rows.n_missing:
        notes = (f"{rows.n_missing} of {rows.n_missing + len(rows)} tests have no {regime} force",)
    if rows.without_force:
        ids, number = ", ".join(rows.without_force), len(rows.without_force)
        notes += (f"{number} tests set aside: a {regime} force of exactly 0 N is no measurement ({ids})",)
    law = law_over_load(area)
    empty = LawFit(
        rows.sample, regime, law.name, law.parameter_names, np.full(2, np.nan), np.full((2, 2), np.nan),
        0.0, len(rows.specimens), len(rows), "none", float("nan"), area, notes=notes,
    )  # fmt: skip
    if weights == "ratio" and not rows.load_N.all():
        notes += (f"{int((rows.load_N == 0).sum())} tests at zero load left out: T/N is not defined at zero load",)
        rows = rows.take(rows.load_N > 0)
        empty = replace(empty, n_tests=len(rows), n_specimens=len(rows.specimens))
    if len(np.unique(rows.load_N)) < 2:
        return replace(empty, notes=(*notes, "tests at fewer than two loads: mu and tau0 cannot be separated"))
    weight = weights_of(rows, area, weights)
    own: dict[str, LinearFit] = {}
    for name in rows.specimens:
        keep = rows.specimen == name
        if len(np.unique(rows.load_N[keep])) > 1:
            own[name] = least_squares(design_over_load(rows.load_N[keep], area), rows.force_N[keep], weight[keep])
    mean, covariance, dof, method, said = _over_specimens(rows, weight, area, {} if by == "tests" else own, by)
    if too_close := loads_too_close(rows, float(np.sqrt(covariance[0, 0]))):
        return replace(empty, notes=(*notes, too_close))
    ratio, bend = lack_of_fit(rows, own)
    left_out = [name for name in rows.specimens if name not in own]
    if left_out and own:
        notes += (f"specimens left out because they were pulled at fewer than two loads: {', '.join(left_out)}",)
    return replace(
        empty,
        values=mean,
        covariance=covariance,
        dof=dof,
        n_specimens=len(own) or len(rows.specimens),
        method=f"{method}; weighted least squares, {WEIGHTS[weights]}",
        chi2_red=ratio,
        specimens={name: fit.values for name, fit in own.items()},
        notes=(*notes, *said, *bend),
        bent=bool(bend),
    )


def _over_specimens(
    rows: Rows, weight: FloatArray, area: float | None, own: dict[str, LinearFit], by: str
) -> tuple[FloatArray, FloatArray, float, str, tuple[str, ...]]:
    """Mean over specimens, its covariance and degrees of freedom, the method in words, and notes."""
    if len(own) > 1:
        values, covariance = combine(np.array([fit.values for fit in own.values()]))
        method = f"each specimen fitted, mean of {len(own)} specimens, t({len(own) - 1})"
        return values, covariance, float(len(own) - 1), method, ()
    note = ONE_SPECIMEN
    if own:
        (fit,) = own.values()
        method = "one specimen, scatter of its tests"
    elif by == "tests":
        fit = least_squares(design_over_load(rows.load_N, area), rows.force_N, weight)
        note = "tests pooled as if independent: the interval is too narrow if specimens differ"
        method = "all tests pooled"
    else:  # every specimen stands at one load
        index = [np.flatnonzero(rows.specimen == name) for name in rows.specimens]
        load, force, w = (np.array([a[k].mean() for k in index]) for a in (rows.load_N, rows.force_N, weight))
        fit = least_squares(design_over_load(load, area), force, w)
        note = "each specimen was pulled at one load: scatter between specimens and about the line cannot be separated"
        method = "line through the specimens' means"
    return fit.values, fit.covariance, float(fit.dof), method, (note,)


def combine(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean (k,) over specimens and its covariance (k, k) from their scatter; ``values`` is (G, k), G > 1."""
    return values.mean(axis=0), np.atleast_2d(np.cov(values, rowvar=False)) / len(values)


def loads_too_close(rows: Rows, mu_u: float) -> str:
    """Why the tests of a sample determine no slope, as a note; empty where they do.

    ``mu_u`` is the standard uncertainty of the slope from the scatter of tests or specimens, NaN where there is none.

    A slope is not resolved where its standard uncertainty exceeds the friction coefficient T/N itself: the data then
    exclude neither that the friction force is independent of the load nor that it rises twice as fast as the load. The
    uncertainty is the larger of ``mu_u`` and of what the reading uncertainty of the forces alone gives for a line
    through these loads.
    """
    load, force = float(rows.load_N.mean()), float(rows.force_N.mean())
    coefficient = abs(force) / load if load > 0 else math.inf
    from_readings = math.nan
    known = np.isfinite(rows.u_N) & (rows.u_N > 0)
    if np.count_nonzero(known) > 1:
        weight, loads = rows.u_N[known] ** -2.0, rows.load_N[known]
        spread = float(weight @ (loads - np.average(loads, weights=weight)) ** 2)
        from_readings = 1.0 / math.sqrt(spread) if spread > 0 else math.nan
    uncertainty = max([u for u in (mu_u, from_readings) if math.isfinite(u)], default=0.0)
    if uncertainty <= coefficient:
        return ""
    low, high = rows.load_N.min(), rows.load_N.max()
    return (
        f"the loads span only {100 * (high / low - 1.0):.2g} % ({low:.5g} to {high:.5g} N), which does not determine a "
        f"slope: the standard uncertainty of mu ({uncertainty:.2g}) exceeds the friction coefficient T/N "
        f"({coefficient:.2g})"
    )


def lack_of_fit(rows: Rows, lines: dict[str, LinearFit]) -> tuple[float, tuple[str, ...]]:
    """Reduced chi-squared of load means about the specimens' lines, and a note where they deviate significantly.

    The classical lack-of-fit ratio: weighted mean square of (cell mean - line) over that of the repeats about
    their cell mean; a cell is one specimen at one load. NaN without repeats or with two loads only.
    """
    from scipy.special import fdtrc

    residual, cell, cells = [], [], 0
    for name, fit in lines.items():
        loads, index = np.unique(rows.load_N[rows.specimen == name], return_inverse=True)
        residual.append(fit.residuals)
        cell.append(index + cells)
        cells += len(loads)
    if not residual:
        return float("nan"), ()
    r, c = np.concatenate(residual), np.concatenate(cell)
    count = np.bincount(c)
    mean = np.bincount(c, r) / count
    dof_line, dof_repeat = cells - 2 * len(lines), len(r) - cells
    if dof_line < 1 or dof_repeat < 1:
        return float("nan"), ()
    repeat = float(((r - mean[c]) ** 2).sum()) / dof_repeat
    if repeat == 0:
        return float("nan"), ()
    ratio = float((count * mean**2).sum()) / dof_line / repeat
    p = float(fdtrc(dof_line, dof_repeat, ratio))
    if p >= LACK_OF_FIT_LEVEL:
        return ratio, ()
    note = f"the load means deviate from a straight line: chi2_red {ratio:.2f}, p = {p:.1g}"
    return ratio, (note,)
