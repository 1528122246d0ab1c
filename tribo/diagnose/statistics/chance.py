"""What chance gives: campaigns that a fitted model makes itself, many at a time, and fitted again.

Replicates keep the design and draw specimens, pattern errors and repeats anew. The law is linear over the little it
moves from replicate to replicate, so that derivatives are those of the fit; robust weights, noise sizes and random
effects are estimated for every replicate by the steps of :mod:`tribo.diagnose.statistics.fit`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribo.diagnose.statistics.linearisation import ModelFit
from tribo.diagnose.statistics.scatter import (
    Replicates,
    Sizes,
    blurred,
    fitted_sizes,
    prior_of_columns,
    products_of,
    replicate_weights,
    replicates_at,
    sizes_updated,
    solved_at_once,
)
from tribo.records import FloatArray

STEPS = 4


def as_measured(f: ModelFit) -> Replicates:
    """The fitted campaign itself, as if it were one replicate."""
    left = (f.residual - f.setup.random @ f.effects).T[None]
    sizes = fitted_sizes(f.setup, f.noise, 1)
    return replicates_at(f.setup, _along_of(f), sizes, left, f.residual.T[None], f.noise.tail)


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


@dataclass(frozen=True)
class Refits:
    """Campaigns fitted again: the noise of each, the coefficients (r, p + q) of the model's columns with their
    covariance (r, p + q, p + q), and what is left of every test, (r, 2, n)."""

    sizes: Sizes
    solution: FloatArray
    covariance: FloatArray
    left: FloatArray


def refit(f: ModelFit, residual: FloatArray) -> Replicates:
    """Law, random effects, weights and noise sizes of campaigns that differ from ``f`` by ``residual`` (r, 2, n)."""
    found, along, p = refits(f, residual), _along_of(f), f.linear.jacobian.shape[2]
    without = found.left + np.tensordot(found.solution[:, p:], along[:, :, p:], axes=(1, 2))
    return replicates_at(f.setup, along, found.sizes, found.left, without, f.noise.tail)


def refit_sizes(f: ModelFit, residual: FloatArray) -> Sizes:
    """The noise alone, estimated in each of these campaigns."""
    return refits(f, residual).sizes


def refits(f: ModelFit, residual: FloatArray) -> Refits:
    """Each of these campaigns fitted, linear about ``f``."""
    s, along, tail = f.setup, _along_of(f), f.noise.tail
    p = f.linear.jacobian.shape[2]
    sizes, left = fitted_sizes(s, f.noise, len(residual)), residual
    spread, solution = np.zeros(0), np.zeros((len(residual), along.shape[2]))
    for _ in range(STEPS):
        weight = replicate_weights(sizes, left, tail)
        spread, solution = solved_at_once(along, sizes.inverse * weight[:, None], residual, prior_of_columns(p, sizes))
        left = residual - np.tensordot(solution, along, axes=(1, 2))
        squares = weight[:, None] * (products_of(left) + blurred(along, spread))
        found = solution[:, p:], np.diagonal(spread, axis1=1, axis2=2)[:, p:]
        sizes = sizes_updated(s, sizes, found, squares, tail)
    return Refits(sizes, solution, spread, left)
