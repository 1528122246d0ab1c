"""What chance gives: campaigns that a fitted model makes itself, many at a time, and fitted again.

Replicates keep the design and draw specimens, pattern errors and repeats anew. The law is linear over the little it
moves from replicate to replicate, so that derivatives are those of the fit; robust weights, noise sizes and random
effects are estimated for every replicate by the steps of :mod:`tribo.diagnostics.fit`. Arrays of r replicates have the
shapes of one campaign behind the r.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribo.diagnostics.fit import ModelFit
from tribo.diagnostics.model import GAIN, OF_PATTERNS, PATTERN, SPECIMEN_DRIFT, Setup
from tribo.diagnostics.normal_equations import Inverse, ModelColumns, Normal, Sides, Weighted
from tribo.diagnostics.scatter import (
    SIZE_PRIORS,
    Noise,
    inverse_noise,
    log_size_prior,
    prior_sd,
    updated_repeats,
    updated_sizes,
)
from tribo.display import displayed
from tribo.records import FloatArray

ITERATIONS = 4
# The noise of every replicate: of the repeats (r, 2, 2), what they depend on, (r, k), and of the random effects (r, 13)
RandomSizes = tuple[FloatArray, FloatArray, FloatArray]
# Of the logarithms of the sizes of all groups: what a contrast explains of the patterns makes their error smaller, and
# what it explains of a specimen, or of the course of the series, makes the spread of these smaller. The step OF_SEVERAL
# is for what several specimens share, such as a lot: one specimen that differs belongs to their spread. The last step
# is for what acts alike in both regimes of all patterns, such as suction: it looks like the error common to both.
OF_SEVERAL = 3
SIZE_STEPS = np.zeros((7, len(SIZE_PRIORS)))
SIZE_STEPS[1, OF_PATTERNS] = -0.7
SIZE_STEPS[2, :PATTERN] = -0.7
SIZE_STEPS[OF_SEVERAL, GAIN] = -1.0
SIZE_STEPS[4, SPECIMEN_DRIFT:] = -0.7
SIZE_STEPS[5, SPECIMEN_DRIFT:] = -2.0
SIZE_STEPS[6, PATTERN] = -1.0


def fitted_noise(s: Setup, noise: Noise, replicates: int) -> RandomSizes:
    """The noise of a fit, once per replicate."""
    scatter = np.zeros(s.scatter.shape[1]) if noise.scatter is None else noise.scatter
    repeat, scatter, effects = (
        np.repeat(part[None], replicates, axis=0) for part in (noise.repeat, scatter, noise.sizes)
    )
    return repeat, scatter, effects


def products_of(left: FloatArray) -> FloatArray:
    """Static, mixed and sliding products of what is left of every test (r, 2, n), (r, 3, n)."""
    return np.stack([left[:, 0] ** 2, left[:, 0] * left[:, 1], left[:, 1] ** 2], axis=1)


def replicate_weights(inverse: FloatArray, left: FloatArray, tail: float) -> FloatArray:
    """Weight of every test of every replicate under the bivariate t, (r, n), by the inverse (r, 3, n) of its noise."""
    distance = np.einsum("ran,ran,a->rn", inverse, products_of(left), [1.0, 2.0, 1.0])
    return np.asarray((tail + 2.0) / (tail + distance))


def log_priors(s: Setup, sizes: FloatArray, steps: FloatArray) -> FloatArray:
    """Log density of sizes (r, 13) after each of ``steps`` (steps, 13) of their logarithms, (steps, r)."""
    there = [group for group in range(len(SIZE_PRIORS)) if group in s.group]
    each = [sum(log_size_prior(g, sizes[:, g] * np.exp(step[g])) for g in there) for step in steps]
    return np.array(each).reshape(len(steps), -1)


def solved_at_once(
    columns: ModelColumns, precision: FloatArray, residual: FloatArray, of_effects: FloatArray
) -> tuple[Inverse, Sides]:
    """Inverse normal matrices and solutions for the residuals (r, 2, n) at the precision (r, 3, n) of every test and
    ``of_effects`` (r, q) of the random effects."""
    weighted = columns.weighted(precision)
    inverse = weighted.normal.with_prior(*columns.sides(columns.prior(of_effects))).inverse()
    return inverse, inverse.solution(*weighted.with_residual(residual))


@displayed()
@dataclass(frozen=True)
class Replicates:
    """Fitted replicates: ``precision`` (r, 3, n) of every test, robust weight included, as static, mixed, sliding;
    ``residual`` (r, 2, n) of ln T. ``weighted`` are the model's columns times that precision, and ``normal`` their
    products without the prior. ``of_effects`` (r, q) is the precision of the random effects, ``group`` (q,) the group
    of the size of each, and ``log_priors`` (steps, r) the log density of the sizes after each of SIZE_STEPS.
    """

    precision: FloatArray
    residual: FloatArray
    weighted: Weighted
    normal: Normal
    of_effects: FloatArray
    group: NDArray[np.int64]
    log_priors: FloatArray

    def one(self, k: int) -> Replicates:
        """One of them, as a batch of one."""

        def cut(batch: Any) -> Any:  # what is not an array is common to all
            arrays = {f.name: getattr(batch, f.name) for f in fields(batch)}
            return replace(batch, **{n: v[k : k + 1] for n, v in arrays.items() if isinstance(v, np.ndarray)})

        return Replicates(
            self.precision[k : k + 1], self.residual[k : k + 1], cut(self.weighted), cut(self.normal),
            self.of_effects[k : k + 1], self.group, self.log_priors[:, k : k + 1],
        )  # fmt: skip


def replicates_at(
    s: Setup, columns: ModelColumns, noise: RandomSizes, left: FloatArray, residual: FloatArray, tail: float
) -> Replicates:
    """Replicates fitted with the ``columns`` of a model at a given noise; ``left`` (r, 2, n) is what is left of every
    test and ``residual`` the same with the random effects."""
    repeat, scatter, sizes = noise
    inverse = inverse_noise(s, repeat, scatter)
    precision = inverse * replicate_weights(inverse, left, tail)[:, None]
    weighted = columns.weighted(precision)
    priors = log_priors(s, sizes, SIZE_STEPS)
    return Replicates(
        precision, residual, weighted, weighted.normal, prior_sd(s, sizes) ** -2, s.group, priors
    )


def as_measured(f: ModelFit) -> Replicates:
    """The fitted campaign itself, as if it were one replicate."""
    left = f.left.T[None]
    noise = fitted_noise(f.setup, f.noise, 1)
    return replicates_at(f.setup, f.columns, noise, left, f.residual.T[None], f.noise.tail)


def drawn_residuals(f: ModelFit, rng: np.random.Generator, replicates: int) -> FloatArray:
    """ln T less what the fit predicts, (replicates, 2, n): new specimens and pattern errors, repeats resampled."""
    s = f.setup
    n = s.observations.n
    effects = rng.normal(size=(replicates, s.n_effects)) / np.sqrt(f.precision)
    left = standardised(f)
    noise = np.linalg.solve(f.factor, left[rng.integers(0, n, (replicates, n))][..., None])[..., 0]
    return np.asarray((noise + s.on_tests(effects)).transpose(0, 2, 1))


def standardised(f: ModelFit) -> FloatArray:
    """What is left of every test in units of the fitted noise, (n, 2).

    The random effects follow the tests, so that what is left is smaller than the noise: it is scaled to the noise that
    the fit states, to a weighted covariance of one.
    """
    left = np.einsum("nij,nj->ni", f.factor, f.left)
    left = left - left.mean(axis=0)
    for _ in range(3):
        weight = (f.noise.tail + 2.0) / (f.noise.tail + np.sum(left**2, axis=1))
        root = np.linalg.cholesky((left * weight[:, None]).T @ left / len(left))
        left = np.linalg.solve(root, left.T).T
    return np.asarray(left)


def refit(f: ModelFit, residual: FloatArray) -> Replicates:
    """Law, random effects, weights and noise of campaigns that differ from ``f`` by ``residual`` (r, 2, n)."""
    noise, solution, _, left = refits(f, residual)
    columns = f.columns
    of_law = columns.border[:, :, : columns.parameters]
    law = np.tensordot(solution, of_law, axes=(1, 2)).transpose(0, 2, 1)
    return replicates_at(f.setup, columns, noise, left, residual - law, f.noise.tail)


def refits(f: ModelFit, residual: FloatArray) -> tuple[RandomSizes, FloatArray, FloatArray, FloatArray]:
    """Each of these campaigns fitted, linear about ``f``: the noise, the coefficients (r, p) of law and mechanisms with
    their variances (r, p), and what is left of every test, (r, 2, n)."""
    s, columns, tail = f.setup, f.columns, f.noise.tail
    p = columns.parameters
    (repeat, scatter, sizes), left = fitted_noise(s, f.noise, len(residual)), residual
    for _ in range(ITERATIONS):
        of_tests = inverse_noise(s, repeat, scatter)
        weight = replicate_weights(of_tests, left, tail)
        precision = of_tests * weight[:, None]
        inverse, (own, border) = solved_at_once(columns, precision, residual, prior_sd(s, sizes) ** -2)
        left = residual - columns.on_tests(own, border)
        squares = weight[:, None] * (products_of(left) + inverse.spread(columns))
        effects, variances = (columns.vector(*sides)[:, p:] for sides in ((own, border), inverse.variances))
        sizes = updated_sizes(s, sizes, effects, variances)
        repeat, scatter = updated_repeats(s, (repeat, scatter), squares, tail)
    return (repeat, scatter, sizes), border[:, :p], np.diagonal(inverse.border, axis1=1, axis2=2)[:, :p], left
