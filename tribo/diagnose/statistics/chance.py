"""What chance gives: campaigns that a fitted model makes itself, many at a time, and fitted again.

Replicates keep the design and draw specimens, pattern errors and repeats anew. The law is linear over the little it
moves from replicate to replicate, so that derivatives are those of the fit; robust weights, noise sizes and random
effects are estimated for every replicate by the steps of :mod:`tribo.diagnose.statistics.fit`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribo.diagnose.statistics.linear import ModelFit
from tribo.diagnose.statistics.model import FIXED
from tribo.diagnose.statistics.scatter import (
    Sizes,
    fitted_sizes,
    log_priors,
    products_of,
    replicate_weights,
    sizes_updated,
)
from tribo.records import FloatArray

STEPS = 4
# Of the logarithms of the sizes (GAIN, SLOPE: two each; PATTERN): what a look explains of the patterns makes their
# error smaller, and what it explains of a specimen makes the spread of the specimens smaller.
SIZE_STEPS = np.array([[0.0, 0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0, -0.7], [-0.7, -0.7, -0.7, -0.7, 0.0]])
ROUNDING = 1e-9


@dataclass(frozen=True)
class Replicates:
    """Fitted replicates: ``precision`` (r, 3, n) of every test, robust weight included, as static, mixed, sliding;
    ``residual`` (r, 2, n) of ln T. ``weighted`` (r, p + q, 2n) are the model's columns times that precision, and
    ``normal`` (r, p + q, p + q) their products without the prior. ``prior`` (r, p + q) is the precision of these
    columns, ``group`` (p + q,) that of the size of each, FIXED where there is none, and ``log_priors`` (steps, r)
    the log density of the sizes after each of SIZE_STEPS.
    """

    precision: FloatArray
    residual: FloatArray
    weighted: FloatArray
    normal: FloatArray
    prior: FloatArray
    group: NDArray[np.int64]
    log_priors: FloatArray


def as_measured(f: ModelFit) -> Replicates:
    """The fitted campaign itself, as if it were one replicate."""
    s, left = f.setup, (f.residual - f.setup.random @ f.effects).T[None]
    sizes = fitted_sizes(s, f.noise, 1)
    precision = sizes.inverse * replicate_weights(sizes, left, f.noise.tail)[:, None]
    return _replicates(f, sizes, precision, f.residual.T[None], log_priors(s, sizes, SIZE_STEPS))


def _replicates(
    f: ModelFit, sizes: Sizes, precision: FloatArray, residual: FloatArray, log_prior: FloatArray
) -> Replicates:
    p = f.linear.jacobian.shape[2]
    group = np.concatenate([np.full(p, FIXED), f.setup.group])
    weighted, normal = _normal(_along_of(f), precision)
    return Replicates(precision, residual, weighted, normal, _prior(p, sizes), group, log_prior)


def _along_of(f: ModelFit) -> FloatArray:
    """The model's columns, (2, n, p + q)."""
    return np.ascontiguousarray(np.concatenate([f.linear.jacobian, f.linear.random], axis=2).transpose(1, 0, 2))


def drawn_residuals(f: ModelFit, rng: np.random.Generator, replicates: int) -> FloatArray:
    """ln T less what the fit predicts, (replicates, 2, n): new specimens and pattern errors, repeats resampled."""
    s = f.setup
    n = s.observations.n
    effects = rng.normal(size=(replicates, s.random.shape[2])) / np.sqrt(f.linear.precision)
    left = standardised(f)
    noise = np.linalg.solve(f.linear.factor, left[rng.integers(0, n, (replicates, n))][..., None])[..., 0]
    return np.asarray(noise.transpose(0, 2, 1) + np.tensordot(effects, s.random, axes=(1, 2)).transpose(0, 2, 1))


def standardised(f: ModelFit) -> FloatArray:
    """What is left of every test in units of the fitted noise, (n, 2).

    The random effects follow the tests, so that what is left is smaller than the noise: it is scaled to the noise that
    the fit states, to a weighted covariance of one.
    """
    left = np.einsum("nij,nj->ni", f.linear.factor, f.residual - f.setup.random @ f.effects)
    left = left - left.mean(axis=0)
    for _ in range(3):
        weight = (f.noise.tail + 2.0) / (f.noise.tail + np.sum(left**2, axis=1))
        root = np.linalg.cholesky((left * weight[:, None]).T @ left / len(left))
        left = np.linalg.solve(root, left.T).T
    return np.asarray(left)


def refit(f: ModelFit, residual: FloatArray) -> Replicates:
    """Law, random effects, weights and noise sizes of campaigns that differ from ``f`` by ``residual`` (r, 2, n)."""
    return _refitted(f, residual)[0]


def refit_sizes(f: ModelFit, residual: FloatArray) -> Sizes:
    """The noise alone, estimated in each of these campaigns."""
    return _refitted(f, residual)[1]


def _refitted(f: ModelFit, residual: FloatArray) -> tuple[Replicates, Sizes]:
    s, along, tail = f.setup, _along_of(f), f.noise.tail
    p = f.linear.jacobian.shape[2]
    sizes, left = fitted_sizes(s, f.noise, len(residual)), residual
    solution = np.zeros((len(residual), along.shape[2]))
    for _ in range(STEPS):
        weight = replicate_weights(sizes, left, tail)
        spread, solution = _solve(along, sizes.inverse * weight[:, None], residual, _prior(p, sizes))
        left = residual - _along(along, solution)
        squares = weight[:, None] * (products_of(left) + _blurred(along, spread))
        found = solution[:, p:], np.diagonal(spread, axis1=1, axis2=2)[:, p:]
        sizes = sizes_updated(s, sizes, found, squares, tail)
    precision = sizes.inverse * replicate_weights(sizes, left, tail)[:, None]
    without = left + _along(along[:, :, p:], solution[:, p:])
    return _replicates(f, sizes, precision, without, log_priors(s, sizes, SIZE_STEPS)), sizes


def _along(along: FloatArray, solution: FloatArray) -> FloatArray:
    """Sums of columns (2, n, k) with coefficients (r, k), shape (r, 2, n)."""
    return np.asarray(np.tensordot(solution, along, axes=(1, 2)))


def _blurred(along: FloatArray, spread: FloatArray) -> FloatArray:
    """The same products expected from the uncertainty ``spread`` (r, k, k) of the coefficients, (r, 3, n)."""
    n, k = along.shape[1:]
    moved = (along.reshape(-1, k) @ spread).reshape(len(spread), 2, n, k)
    pairs = ((0, 0), (0, 1), (1, 1))
    return np.stack([np.einsum("rnk,nk->rn", moved[:, a], along[b]) for a, b in pairs], axis=1)


def _prior(p: int, sizes: Sizes) -> FloatArray:
    """Precision of the columns of the model, (r, p + q): next to none for law and mechanisms."""
    return np.concatenate([np.full((len(sizes.effects), p), 1e-12), sizes.precision], axis=1)


def _weighted(precision: FloatArray, columns: FloatArray) -> FloatArray:
    """Columns (2, n, k) times the precision of every replicate, (r, 2, n, k)."""
    static, mixed, sliding = (precision[:, i, :, None] for i in range(3))
    return np.stack([static * columns[0] + mixed * columns[1], mixed * columns[0] + sliding * columns[1]], axis=1)


def _normal(along: FloatArray, precision: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Weighted columns (r, p, 2n) and the normal matrices (r, p, p) without the prior."""
    r, k = len(precision), along.shape[2]
    weighted = np.ascontiguousarray(_weighted(precision, along).reshape(r, -1, k).transpose(0, 2, 1))
    normal = (weighted.reshape(r * k, -1) @ along.reshape(-1, k)).reshape(r, k, k)
    return weighted, normal


def _solve(
    along: FloatArray, precision: FloatArray, residual: FloatArray, prior: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Inverse normal matrices (r, p, p) and solutions (r, p), the diagonal scaled to one."""
    weighted, normal = _normal(along, precision)
    normal[:, np.arange(along.shape[2]), np.arange(along.shape[2])] += prior
    scale = 1.0 / np.sqrt(np.diagonal(normal, axis1=1, axis2=2))
    both = scale[:, :, None] * scale[:, None, :]
    inverse = np.linalg.inv(normal * both + ROUNDING * np.eye(along.shape[2])) * both
    right = np.einsum("rpm,rm->rp", weighted, residual.reshape(len(residual), -1))
    return inverse, np.einsum("rpq,rq->rp", inverse, right)
