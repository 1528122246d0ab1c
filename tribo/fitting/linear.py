"""Weighted linear least squares: the one place where the normal algebra of a fit is done."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribo.errors import FitError, Problem
from tribo.records import FloatArray


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
