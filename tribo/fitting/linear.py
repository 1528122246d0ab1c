"""Weighted linear least squares of the tests of a sample: rows that a fit may use, their weights, the fit itself.

Weights come from an assumption about the scatter of repeats. The law is always T = mu N + tau0 A. The choices differ in
the scatter that is assumed constant over the loads:

"relative"  the coefficient of variation of T: weights 1/T^2, with T from the fit itself (the default)
"ratio"     the scatter of T/N: weights 1/N^2, the fit T/N = mu + tau0/p of the paper's Fig. 4
"force"     the scatter of T: equal weights, the fit T = mu N + tau0 A of the paper's Figs. 6 and 7
"repeats"   nothing: a constant and a share of T, both estimated from the repeats of the sample
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tribo.errors import FitError, Problem
from tribo.laws import design_over_load
from tribo.records import FloatArray, Regime

if TYPE_CHECKING:
    import pandas as pd


SAME_LOAD = 0.02  # share by which loads may differ and still be repeats of one load
ONE_LOAD = 0.05  # share of their median within which all loads of a sample lie if they were meant to be one


def levels_of(load_N: FloatArray, tolerance: float = SAME_LOAD) -> FloatArray:
    """The mean load of the level of each load (n,): a level holds the loads up to ``tolerance`` above its lowest."""
    order = np.argsort(load_N, kind="stable")
    level = np.zeros(load_N.size, int)
    lowest, number = -np.inf, -1
    for place, load in zip(order, load_N[order], strict=True):
        if not load - lowest <= tolerance * abs(load):
            lowest, number = load, number + 1
        level[place] = number
    means = np.bincount(level, load_N) / np.bincount(level) if load_N.size else load_N
    return np.asarray(means[level])


def meant_to_be_one(load_N: FloatArray) -> bool:
    """Whether all loads lie so close together that they are one load with scatter."""
    loads = load_N[np.isfinite(load_N)]
    return loads.size == 0 or float(np.ptp(loads)) <= ONE_LOAD * abs(float(np.median(loads)))


@dataclass(frozen=True)
class Rows:
    """Normal load, friction force, its reading uncertainty and the specimen of n tests; arrays (n,).

    ``n_missing`` tests have no force. ``without_force`` are tests whose force is exactly 0 N: nothing was measured.
    """

    sample: str
    load_N: FloatArray
    force_N: FloatArray
    u_N: FloatArray
    specimen: NDArray[np.str_]
    test_id: NDArray[np.str_]
    n_missing: int = 0
    without_force: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.load_N)

    @property
    def specimens(self) -> tuple[str, ...]:
        return tuple(str(s) for s in np.unique(self.specimen))

    def take(self, keep: NDArray[np.bool_]) -> Rows:
        """The rows where ``keep`` is true."""
        return Rows(
            self.sample, self.load_N[keep], self.force_N[keep], self.u_N[keep],
            self.specimen[keep], self.test_id[keep],
        )  # fmt: skip


def sample_rows(table: pd.DataFrame, regime: Regime) -> tuple[Rows, ...]:
    """One :class:`Rows` a sample, samples in alphabetical order.

    ``table`` is that of ``Ingested.table()``. Tests without a force in ``regime``, and those of exactly 0 N, are left
    out. Tests whose specimen is not named count as one specimen.

    Raises
    ------
    FitError
        A column is missing, or a normal load is negative or not a number (each row listed).
    """
    needed = ["sample", "specimen", "normal_load_N", f"{regime}_N"]
    if absent := [name for name in needed if name not in table.columns]:
        allowed = ", ".join(needed)
        what = "a required column is missing from the table"
        raise FitError([Problem("missing_column", what, column=c, allowed=allowed) for c in absent])
    load = table["normal_load_N"].to_numpy(float)
    ids = (table["test_id"] if "test_id" in table else table.index.to_series()).astype(str).to_numpy(str)
    if len(bad := np.flatnonzero(~np.isfinite(load) | (load < 0))):
        raise FitError(
            Problem(
                "bad_load", "not a possible normal load", column="normal_load_N",
                found=f"{load[k]:g}", allowed="0 N or more", test_id=str(ids[k]),
            )
            for k in bad
        )  # fmt: skip
    force = table[f"{regime}_N"].to_numpy(float)
    u_name = f"{regime}_u_N"
    u = table[u_name].to_numpy(float) if u_name in table else np.full(len(table), np.nan)
    sample = table["sample"].astype(str).to_numpy(str)
    everything = Rows("", load, force, u, table["specimen"].fillna("").astype(str).to_numpy(str), ids)
    found, read = np.isfinite(force), force != 0
    return tuple(
        replace(
            everything.take(own & found & read), sample=str(name), n_missing=int((own & ~found).sum()),
            without_force=tuple(ids[own & found & ~read]),
        )
        for name in np.unique(sample)
        for own in [sample == name]
    )


@dataclass(frozen=True)
class LinearFit:
    """Values (k,), their covariance (k, k) at unit variance, weighted residuals (n,), dof = n - k."""

    values: FloatArray
    unscaled: FloatArray
    residuals: FloatArray
    dof: int

    @property
    def residual_variance(self) -> float:
        """Weighted residual sum of squares over its degrees of freedom; NaN where none are left."""
        return float(self.residuals @ self.residuals) / self.dof if self.dof > 0 else float("nan")

    @property
    def covariance(self) -> FloatArray:
        """Covariance of ``values`` with the scale taken from the residuals, as in the NIST StRD."""
        return self.unscaled * self.residual_variance


def least_squares(design: FloatArray, response: FloatArray, weights: FloatArray | None = None) -> LinearFit:
    """Minimise sum w (y - X b)^2 through the singular values of the scaled design.

    ``design`` X is (n, k), ``response`` y and ``weights`` w are (n,), w as 1/variance. Columns are scaled to
    unit length first, so that newtons beside square metres cost no digits.

    Raises
    ------
    FitError
        Fewer rows than parameters, or linearly dependent columns.
    """
    root = np.ones(len(response)) if weights is None else np.sqrt(weights)
    weighted = design * root[:, None]
    length = np.linalg.norm(weighted, axis=0)
    rows, columns = design.shape
    if rows < columns or not length.all():
        raise FitError(_rank_problem(rows, columns))
    u, s, vt = np.linalg.svd(weighted / length, full_matrices=False)
    if s[-1] <= s[0] * rows * np.finfo(float).eps:
        raise FitError(_rank_problem(rows, columns))
    target = response * root
    values = (vt.T @ ((u.T @ target) / s)) / length
    unscaled = (vt.T / s**2) @ vt / np.outer(length, length)
    return LinearFit(values, unscaled, target - weighted @ values, rows - columns)


def _rank_problem(rows: int, columns: int) -> Problem:
    return Problem(
        "too_few_loads",
        f"{rows} tests cannot determine {columns} parameters",
        allowed=f"at least {columns} different loads",
    )


_ROUNDS_OF_SCATTER = 20
_ROUNDING = 1e-24  # relative variance that rounding alone gives
_TOO_FAR = 1e-3  # a cell of repeats that chance gives so rarely holds an outlier and does not count


def repeat_scatter(samples: tuple[Rows, ...]) -> tuple[float, float, int] | None:
    """Scatter of the repeats (same specimen, same load) of ``samples``; None without any.

    Returns a standard deviation in N and one as a share of T, to be added in squares, and their degrees of freedom.
    Weighted least squares of the cell variances on the squared cell means, the weights their own expected
    scatter 2 sigma^4 / dof, both terms held at zero or above. Cells with too much scatter are left out.
    """
    mean, variance, dof = (np.concatenate(parts) for parts in zip(*map(_cells, samples), strict=True))
    if not (variance > _ROUNDING * mean**2).any():
        return None
    from scipy.stats import chi2

    limit = chi2.isf(_TOO_FAR, dof) / dof
    terms = np.array([0.0, float((dof * variance).sum() / (dof * mean**2).sum())])
    keep = np.ones(len(dof), dtype=bool)
    for _ in range(_ROUNDS_OF_SCATTER):
        expected = terms[0] + terms[1] * mean**2
        keep = variance <= limit * expected
        if not variance[keep].any():  # equal repeats but for the cells that scatter too much
            break
        terms = _not_negative(mean[keep] ** 2, variance[keep], dof[keep] / expected[keep] ** 2)
    return float(np.sqrt(terms[0])), float(np.sqrt(terms[1])), int(dof[keep].sum())


def weights_by_repeats(expected_N: FloatArray, scatter: tuple[float, float, int] | None) -> FloatArray:
    """1 over the variance (n,) of pulls of these expected forces, by :func:`repeat_scatter`; without it, relative."""
    if scatter is None:
        return expected_N**-2.0
    constant_N, share, _ = scatter
    return np.asarray(1 / (constant_N**2 + (share * expected_N) ** 2))


def _cells(rows: Rows) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Mean, variance and degrees of freedom of every cell (one specimen at one load) of two pulls or more."""
    _, specimen = np.unique(rows.specimen, return_inverse=True)
    _, load = np.unique(rows.load_N, return_inverse=True)
    _, cell = np.unique(specimen * (load.max(initial=0) + 1) + load, return_inverse=True)
    count = np.bincount(cell)
    mean = np.bincount(cell, rows.force_N) / np.maximum(count, 1)
    square = np.bincount(cell, (rows.force_N - mean[cell]) ** 2)
    several = count > 1
    dof = count[several] - 1.0
    variance = np.asarray(square[several] / dof, float)
    return mean[several], variance, np.asarray(dof, float)


def _not_negative(square: FloatArray, variance: FloatArray, weight: FloatArray) -> FloatArray:
    """Terms of variance = a + b square, both at least zero and not both zero."""
    from scipy.optimize import nnls

    root = np.sqrt(weight)
    length = np.array([1.0, max(float(square.max(initial=0.0)), 1e-300)])
    design = np.column_stack([np.ones_like(square), square / length[1]]) * root[:, None]
    terms, _ = nnls(design, variance * root)
    found = np.asarray(terms) / length
    return found if found.any() else np.array([float(variance.mean()), 0.0])


WEIGHTS: dict[str, str] = {
    "relative": "constant relative scatter of T",
    "ratio": "constant scatter of T/N",
    "force": "constant scatter of T",
    "repeats": "scatter of T estimated from repeats",
}
_ROUNDS_OF_WEIGHTS = 4  # the weights move the fit by less than its error, and the fit moves the weights by far less
_SMALLEST_SHARE = 0.05  # of the median force: where the fitted force nears zero its weight must not diverge


def weights_of(rows: Rows, nominal_area_m2: float | None, weights: str) -> FloatArray:
    """Weights (n,) in 1/N^2, shared by all specimens of a sample so that none gets its own.

    Raises
    ------
    FitError
        An unknown name; "ratio" with a load of zero, where T/N is singular.
    """
    if weights == "force":
        return np.ones(len(rows))
    if weights == "ratio":
        if not rows.load_N.all():
            what, allowed = "T/N is not defined at zero load", "weights relative or force"
            raise FitError(Problem("zero_load", what, column="normal_load_N", allowed=allowed))
        return rows.load_N**-2.0
    if weights == "relative":
        return expected_force_N(rows, nominal_area_m2) ** -2.0
    if weights == "repeats":
        return weights_by_repeats(expected_force_N(rows, nominal_area_m2), repeat_scatter((rows,)))
    allowed = ", ".join(WEIGHTS)
    raise FitError(Problem("unknown_weights", "unknown weights", found=weights, allowed=allowed))


def expected_force_N(rows: Rows, nominal_area_m2: float | None) -> FloatArray:
    """Force (n,) of the sample's line at each load, kept above a share of the median force."""
    design = design_over_load(rows.load_N, nominal_area_m2)
    floor = _SMALLEST_SHARE * float(np.median(np.abs(rows.force_N))) or 1.0
    expected = np.full(len(rows), floor)
    for _ in range(_ROUNDS_OF_WEIGHTS):
        fit = least_squares(design, rows.force_N, expected**-2.0)
        expected = np.maximum(np.abs(design @ fit.values), floor)
    return expected
