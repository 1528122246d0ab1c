"""Scatter of repeats as a function of force: the variance function Var T = s0^2 + (c T)^2, estimated from repeats."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribo.fitting.rows import Rows
from tribo.records import FloatArray

_ROUNDS = 20
_ROUNDING = 1e-24  # relative variance that rounding alone gives
_TOO_FAR = 1e-3  # a cell of repeats that chance gives so rarely holds an outlier and does not count


@dataclass(frozen=True)
class RepeatScatter:
    """Standard deviation of repeats: ``constant_N`` and ``share`` of T added in squares; dof of the estimate."""

    constant_N: float
    share: float
    dof: int

    def variance(self, force_N: FloatArray) -> FloatArray:
        """Variance of a pull whose expected force is ``force_N``, in N^2."""
        return np.asarray(self.constant_N**2 + (self.share * force_N) ** 2)


def repeat_scatter(samples: tuple[Rows, ...]) -> RepeatScatter | None:
    """Variance function of the repeats (same specimen, same load) of ``samples``; None without scatter.

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
    for _ in range(_ROUNDS):
        expected = terms[0] + terms[1] * mean**2
        keep = variance <= limit * expected
        terms = _not_negative(mean[keep] ** 2, variance[keep], dof[keep] / expected[keep] ** 2)
    return RepeatScatter(float(np.sqrt(terms[0])), float(np.sqrt(terms[1])), int(dof[keep].sum()))


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
