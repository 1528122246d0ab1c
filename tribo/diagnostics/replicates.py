"""What chance gives: campaigns that a fitted model makes itself, many at a time, and fitted again.

Replicates keep the design and draw specimens, pattern errors and repeats anew. The law is linear over the little it
moves from replicate to replicate, so that derivatives are those of the fit; robust weights, noise sizes and random
effects are estimated for every replicate by the steps of :mod:`tribo.diagnostics.fit`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribo.diagnostics.fit import ModelFit
from tribo.diagnostics.scatter import (
    Replicates,
    Sizes,
    fitted_sizes,
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
    left = (f.residual - f.setup.random_effects.on_tests(f.effects)).T[None]
    sizes = fitted_sizes(f.setup, f.noise, 1)
    return replicates_at(f.setup, f.linear.columns, sizes, left, f.residual.T[None], f.noise.tail)


def drawn_residuals(f: ModelFit, rng: np.random.Generator, replicates: int) -> FloatArray:
    """ln T less what the fit predicts, (replicates, 2, n): new specimens and pattern errors, repeats resampled."""
    s = f.setup
    n = s.observations.n
    effects = rng.normal(size=(replicates, s.random_effects.count)) / np.sqrt(f.linear.precision)
    left = standardised(f)
    noise = np.linalg.solve(f.linear.factor, left[rng.integers(0, n, (replicates, n))][..., None])[..., 0]
    return np.asarray((noise + s.random_effects.on_tests(effects)).transpose(0, 2, 1))


def standardised(f: ModelFit) -> FloatArray:
    """What is left of every test in units of the fitted noise, (n, 2).

    The random effects follow the tests, so that what is left is smaller than the noise: it is scaled to the noise that
    the fit states, to a weighted covariance of one.
    """
    left = np.einsum("nij,nj->ni", f.linear.factor, f.residual - f.setup.random_effects.on_tests(f.effects))
    left = left - left.mean(axis=0)
    for _ in range(3):
        weight = (f.noise.tail + 2.0) / (f.noise.tail + np.sum(left**2, axis=1))
        root = np.linalg.cholesky((left * weight[:, None]).T @ left / len(left))
        left = np.linalg.solve(root, left.T).T
    return np.asarray(left)


@dataclass(frozen=True)
class Refits:
    """Campaigns fitted again: the noise of each, the coefficients (r, p) of law and mechanisms with their ``variance``
    (r, p), what is left of every test, (r, 2, n), and the same ``without`` the random effects taken out."""

    sizes: Sizes
    solution: FloatArray
    variance: FloatArray
    left: FloatArray
    without: FloatArray


def refit(f: ModelFit, residual: FloatArray) -> Replicates:
    """Law, random effects, weights and noise sizes of campaigns that differ from ``f`` by ``residual`` (r, 2, n)."""
    found = refits(f, residual)
    return replicates_at(f.setup, f.linear.columns, found.sizes, found.left, found.without, f.noise.tail)


def refit_sizes(f: ModelFit, residual: FloatArray) -> Sizes:
    """The noise alone, estimated in each of these campaigns."""
    return refits(f, residual).sizes


def refits(f: ModelFit, residual: FloatArray) -> Refits:
    """Each of these campaigns fitted, linear about ``f``."""
    s, columns, tail = f.setup, f.linear.columns, f.noise.tail
    p = columns.parameters
    sizes, left = fitted_sizes(s, f.noise, len(residual)), residual
    for _ in range(STEPS):
        weight = replicate_weights(sizes, left, tail)
        inverse, (own, border) = solved_at_once(columns, sizes.inverse * weight[:, None], residual, sizes)
        left = residual - columns.on_tests(own, border)
        squares = weight[:, None] * (products_of(left) + inverse.spread(columns))
        effects, variances = (columns.vector(*sides)[:, p:] for sides in ((own, border), inverse.variances))
        sizes = sizes_updated(s, sizes, (effects, variances), squares, tail)
    law = np.tensordot(border[:, :p], columns.border[:, :, :p], axes=(1, 2)).transpose(0, 2, 1)
    variance = np.diagonal(inverse.border, axis1=1, axis2=2)[:, :p]
    return Refits(sizes, border[:, :p], variance, left, residual - law)
