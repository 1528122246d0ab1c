"""Sizes of the noise: how tests and random effects are weighed by them, and how they are estimated.

Sizes of random effects are updated by the fixed point of expectation-maximisation that counts the effects a campaign
determines (MacKay 1992), the repeats by expectation-maximisation, and what the repeats depend on by Fisher scoring.
Functions with ``...`` in a shape take one campaign or a batch of replicates.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribo.diagnostics.model import GAIN, PATTERN, SLOPE, Setup
from tribo.diagnostics.normal_equations import (
    Inverse,
    ModelColumns,
    Normal,
    Sides,
    Weighted,
    normal_of,
    weighted_columns,
)
from tribo.display import displayed
from tribo.records import FloatArray

# Expected size, and how many effects that is worth: specimen gains and slopes, pattern factor
SPECIMEN_PRIOR, SLOPE_PRIOR, PATTERN_PRIOR = (0.05, 4.0), (0.01, 2.0), (1.0, 1.0)
SIZE_PRIORS = np.array([SPECIMEN_PRIOR, SPECIMEN_PRIOR, SLOPE_PRIOR, SLOPE_PRIOR, PATTERN_PRIOR])
REPEAT_PRIOR = (0.08, 4.0)
SCATTER_SD = 0.5  # of ln of the ratio of repeats between samples, and of the power of the force they follow
SMALLEST_SD = 0.003  # of ln T: no reading repeats better
# Of the logarithms of the sizes (GAIN, SLOPE: two each; PATTERN): what a contrast explains of the patterns makes their
# error smaller, and what it explains of a specimen makes the spread of the specimens smaller.
SIZE_STEPS = np.array([[0.0, 0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0, -0.7], [-0.7, -0.7, -0.7, -0.7, 0.0]])


@displayed()
@dataclass(frozen=True)
class Noise:
    """Sizes of the random parts, standard deviations of ln T: repeats (2, 2) covariance; specimen gains (2,) and
    slopes (2,) per e-fold of load, along the mean of static and sliding friction and along their difference.

    ``pattern`` is the factor on the error that the predictor states for its patterns. The standard deviation of the
    repeats of a test is multiplied by exp(``scatter`` @ setup.scatter). ``tail`` is the number of degrees of freedom of
    the t distribution of the repeats.
    """

    repeat: FloatArray
    specimen: FloatArray
    slope: FloatArray = field(default_factory=lambda: np.array([0.02, 0.02]))
    pattern: float = 1.0
    scatter: FloatArray | None = None
    tail: float = 8.0

    @property
    def sizes(self) -> FloatArray:
        """Of every group of random effects, (5,)."""
        return np.array([*self.specimen, *self.slope, self.pattern])

    def with_sizes(self, sizes: FloatArray) -> Noise:
        return replace(
            self, specimen=sizes[GAIN:SLOPE], slope=sizes[SLOPE:PATTERN], pattern=float(sizes[PATTERN])
        )

    def per_test(self, s: Setup) -> FloatArray:
        """Covariance of the repeats of every test, (n, 2, 2)."""
        if self.scatter is None:
            return np.repeat(self.repeat[None], s.observations.n, axis=0)
        return np.asarray(self.repeat * np.exp(2.0 * s.scatter @ self.scatter)[:, None, None])


def first_noise() -> Noise:
    """Where the estimation of the noise starts."""
    return Noise(np.diag([REPEAT_PRIOR[0] ** 2] * 2), np.zeros(2)).with_sizes(SIZE_PRIORS[:, 0])


@displayed()
@dataclass(frozen=True)
class AtNoise:
    """What the tests and random effects of a campaign are weighed with at one noise.

    ``factor`` (n, 2, 2) whitens the tests, ``precision`` (q,) is that of the random effects, and ``log_prior`` the log
    density of the sizes.
    """

    noise: Noise
    factor: FloatArray
    precision: FloatArray
    log_prior: float


def at_noise(s: Setup, noise: Noise) -> AtNoise:
    """The weighing of a campaign at this noise."""
    return AtNoise(noise, whitener(s, noise), prior_precision(s, noise), log_prior(s, noise))


def at_estimated_noise(
    s: Setup, at: AtNoise, effects: tuple[FloatArray, FloatArray], squares: FloatArray
) -> AtNoise:
    """The same at the noise estimated anew from the random effects with their variances, (q,) each, and from the
    weighted products ``squares`` (3, n) expected of what is left."""
    noise = at.noise
    sizes = updated_sizes(s, noise.sizes, *effects)
    scatter = np.zeros(s.scatter.shape[1]) if noise.scatter is None else noise.scatter
    repeat, scatter = updated_repeats(s, (noise.repeat, scatter), squares, noise.tail)
    return at_noise(s, replace(noise, repeat=repeat, scatter=scatter).with_sizes(sizes))


def whitener(s: Setup, noise: Noise) -> FloatArray:
    """Inverse Cholesky factor of the noise of every test, repeats plus reading, shape (n, 2, 2)."""
    cov = noise.per_test(s) + s.observations.reading[:, :, None] ** 2 * np.eye(2)
    a = np.sqrt(cov[:, 0, 0])
    b = cov[:, 1, 0] / a
    c = np.sqrt(cov[:, 1, 1] - b**2)
    factor = np.zeros_like(cov)
    factor[:, 0, 0], factor[:, 1, 0], factor[:, 1, 1] = 1 / a, -b / (a * c), 1 / c
    return factor


def log_prior(s: Setup, noise: Noise) -> float:
    """Log density of the sizes, without constants; of those alone that some random effect has."""
    found = -0.5 * float(np.sum(noise.scatter**2)) / SCATTER_SD**2 if noise.scatter is not None else 0.0
    for group, size in enumerate(noise.sizes):
        if (s.group == group).any():
            found += float(log_size_prior(group, size))
    size, worth = REPEAT_PRIOR
    determinant = float(np.linalg.slogdet(noise.repeat)[1])
    return float(found - 0.5 * worth * (determinant + size**2 * np.trace(np.linalg.inv(noise.repeat))))


def prior_sd(s: Setup, sizes: FloatArray) -> FloatArray:
    """Standard deviation of every random effect for sizes (..., 5), shape (..., q)."""
    known = np.ones((*sizes.shape[:-1], 1))
    return np.asarray(s.unit * np.concatenate([sizes, known], axis=-1)[..., s.group])


def prior_precision(s: Setup, noise: Noise) -> FloatArray:
    """One over the variance of every random effect, shape (q,)."""
    return prior_sd(s, noise.sizes) ** -2


def updated_sizes(s: Setup, sizes: FloatArray, effects: FloatArray, variance: FloatArray) -> FloatArray:
    """Sizes (..., 5) from predicted effects (..., q) and their variances (..., q)."""
    known = 1.0 - variance / prior_sd(s, sizes) ** 2
    squares = (effects / s.unit) ** 2
    found = sizes.copy()
    for group, (expected, worth) in enumerate(SIZE_PRIORS):
        here = s.group == group
        if here.any():
            total = squares[..., here].sum(axis=-1) + worth * expected**2
            found[..., group] = np.sqrt(total / (np.maximum(known[..., here].sum(axis=-1), 0.0) + worth))
    return found


def updated_repeats(
    s: Setup, noise: tuple[FloatArray, FloatArray], squares: FloatArray, tail: float
) -> tuple[FloatArray, FloatArray]:
    """One step for the covariance of the repeats (..., 2, 2) and what it depends on, (..., k).

    ``squares`` (..., 3, n) are the weighted static, mixed and sliding products expected of what is left of every test.
    """
    repeat, scatter = noise
    times = np.exp(2.0 * scatter @ s.scatter.T)[..., None, :]
    own = repeat[..., [0, 0, 1], [0, 1, 1]][..., None] * times
    inverse = inverse_noise(s, repeat, scatter)
    share = own[..., ::2, :] / (own[..., ::2, :] + (s.observations.reading**2).T)
    both = np.stack([share[..., 0, :] ** 2, share[..., 0, :] * share[..., 1, :], share[..., 1, :] ** 2], axis=-2)
    rest = 1.0 - np.stack([share[..., 0, :], both[..., 1, :], share[..., 1, :]], axis=-2)
    total = np.sum((both * squares + rest * own) / times, axis=-1)
    size, worth = REPEAT_PRIOR
    found = (total[..., [[0, 1], [1, 2]]] + worth * size**2 * np.eye(2)) / (s.observations.n + worth)
    distances = np.einsum("...an,...an,a->...n", inverse, squares, [1.0, 2.0, 1.0])
    scatter = _updated_scatter(s, scatter, (distances - 2.0) * share.mean(axis=-2), tail)
    common = scatter[..., :-1].mean(axis=-1, keepdims=True)  # of all samples: that is the covariance itself
    scatter = np.concatenate([scatter[..., :-1] - common, scatter[..., -1:]], axis=-1)
    return _floored(found * np.exp(2.0 * common)[..., None]), scatter


def inverse_noise(s: Setup, repeat: FloatArray, scatter: FloatArray) -> FloatArray:
    """Inverse of the noise of every test, repeats plus reading: static, mixed and sliding entries, (..., 3, n)."""
    times, reading = np.exp(2.0 * scatter @ s.scatter.T), s.observations.reading**2
    static = repeat[..., 0, 0, None] * times + reading[:, 0]
    sliding = repeat[..., 1, 1, None] * times + reading[:, 1]
    mixed = repeat[..., 0, 1, None] * times
    return np.stack([sliding, -mixed, static], axis=-2) / (static * sliding - mixed**2)[..., None, :]


def _updated_scatter(s: Setup, scatter: FloatArray, excess: FloatArray, tail: float) -> FloatArray:
    """One scoring step; ``excess`` (..., n) is the weighted squared distance of every test above its expectation."""
    information = 4.0 * tail / (tail + 4.0)
    precision = np.eye(s.scatter.shape[1]) / SCATTER_SD**2
    normal = information * s.scatter.T @ s.scatter + precision
    step = np.linalg.solve(normal, (excess @ s.scatter - scatter @ precision)[..., None])[..., 0]
    return np.asarray(scatter + np.clip(step, -0.5, 0.5))


def _floored(repeat: FloatArray) -> FloatArray:
    """The nearest covariance (..., 2, 2) with no standard deviation below SMALLEST_SD."""
    values, vectors = np.linalg.eigh(repeat)
    return np.asarray((vectors * np.maximum(values, SMALLEST_SD**2)[..., None, :]) @ np.swapaxes(vectors, -1, -2))


def log_size_prior(group: int, size: FloatArray) -> FloatArray:
    """Log density of the logarithm of a size, without constants: a scaled inverse chi."""
    expected, worth = SIZE_PRIORS[group]
    return np.asarray(-worth * (np.log(size) + 0.5 * (expected / size) ** 2))


@displayed()
@dataclass(frozen=True)
class Sizes:
    """The noise of every replicate: ``repeat`` (r, 2, 2), what the repeats depend on, ``scatter`` (r, k), and sizes of
    the random ``effects`` (r, 5); with the ``inverse`` (r, 3, n) of the noise of every test and the ``precision``
    (r, q) of the random effects at these sizes.
    """

    repeat: FloatArray
    scatter: FloatArray
    effects: FloatArray
    inverse: FloatArray
    precision: FloatArray


def sizes_at(s: Setup, repeat: FloatArray, scatter: FloatArray, effects: FloatArray) -> Sizes:
    """The noise of every replicate at these sizes."""
    return Sizes(repeat, scatter, effects, inverse_noise(s, repeat, scatter), prior_sd(s, effects) ** -2)


def fitted_sizes(s: Setup, noise: Noise, replicates: int) -> Sizes:
    """The noise of a fit, once per replicate."""
    scatter = np.zeros(s.scatter.shape[1]) if noise.scatter is None else noise.scatter
    parts = (noise.repeat, scatter, noise.sizes)
    return sizes_at(s, *(np.repeat(part[None], replicates, axis=0) for part in parts))


def products_of(left: FloatArray) -> FloatArray:
    """Static, mixed and sliding products of what is left, (r, 3, n)."""
    return np.stack([left[:, 0] ** 2, left[:, 0] * left[:, 1], left[:, 1] ** 2], axis=1)


def replicate_weights(sizes: Sizes, left: FloatArray, tail: float) -> FloatArray:
    """Weight of every test of every replicate under the bivariate t, (r, n)."""
    distance = np.einsum("ran,ran,a->rn", sizes.inverse, products_of(left), [1.0, 2.0, 1.0])
    return np.asarray((tail + 2.0) / (tail + distance))


def sizes_updated(
    s: Setup, sizes: Sizes, found: tuple[FloatArray, FloatArray], squares: FloatArray, tail: float
) -> Sizes:
    """The noise estimated anew from the random effects with their variances ``found``, (r, q) each, and from the
    weighted products ``squares`` (r, 3, n) expected of what is left."""
    effects = updated_sizes(s, sizes.effects, *found)
    return sizes_at(s, *updated_repeats(s, (sizes.repeat, sizes.scatter), squares, tail), effects)


def log_priors(s: Setup, sizes: Sizes, steps: FloatArray) -> FloatArray:
    """Log density of the sizes of every replicate after each of ``steps`` (steps, 5) of their logarithms."""
    there = [group for group in range(len(SIZE_PRIORS)) if group in s.group]
    each = [sum(log_size_prior(g, sizes.effects[:, g] * np.exp(step[g])) for g in there) for step in steps]
    return np.array(each).reshape(len(steps), -1)


def precision_of_prior(columns: ModelColumns, sizes: Sizes) -> Sides:
    """Precision of the coefficients of a model, (r, S, 4) and (r, m): next to none for law and mechanisms."""
    known = np.full((len(sizes.effects), columns.parameters), 1e-12)
    return columns.sides(np.concatenate([known, sizes.precision], axis=1))


def solved_at_once(
    columns: ModelColumns, precision: FloatArray, residual: FloatArray, sizes: Sizes
) -> tuple[Inverse, Sides]:
    """Inverse normal matrices and solutions for the residuals (r, 2, n) at the precision (r, 3, n) of every test."""
    found = weighted_columns(columns, precision)
    inverse = normal_of(found).with_prior(*precision_of_prior(columns, sizes)).inverse()
    return inverse, inverse.solution(*found.with_residual(residual))


@displayed()
@dataclass(frozen=True)
class Replicates:
    """Fitted replicates: ``precision`` (r, 3, n) of every test, robust weight included, as static, mixed, sliding;
    ``residual`` (r, 2, n) of ln T. ``weighted`` are the model's columns times that precision, and ``normal`` their
    products without the prior. ``sizes`` holds the precision of the random effects, ``group`` (q,) the group of the
    size of each, and ``log_priors`` (steps, r) the log density of the sizes after each of SIZE_STEPS.
    """

    precision: FloatArray
    residual: FloatArray
    weighted: Weighted
    normal: Normal
    sizes: Sizes
    group: NDArray[np.int64]
    log_priors: FloatArray

    def one(self, k: int) -> Replicates:
        """One of them, as a batch of one."""
        sizes, normal, weighted = (_cut(part, k) for part in (self.sizes, self.normal, self.weighted))
        precision, residual = self.precision[k : k + 1], self.residual[k : k + 1]
        return Replicates(precision, residual, weighted, normal, sizes, self.group, self.log_priors[:, k : k + 1])


def _cut(batch: Any, k: int) -> Any:
    """One of a batch: what is not an array is common to all."""
    arrays = {f.name: v[k : k + 1] for f in fields(batch) if isinstance(v := getattr(batch, f.name), np.ndarray)}
    return replace(batch, **arrays)


def replicates_at(
    s: Setup, columns: ModelColumns, sizes: Sizes, left: FloatArray, residual: FloatArray, tail: float
) -> Replicates:
    """Replicates fitted with the ``columns`` of a model at given sizes; ``left`` (r, 2, n) is what is left of every
    test and ``residual`` the same with the random effects."""
    precision = sizes.inverse * replicate_weights(sizes, left, tail)[:, None]
    found = weighted_columns(columns, precision)
    priors = log_priors(s, sizes, SIZE_STEPS)
    return Replicates(precision, residual, found, normal_of(found), sizes, s.group, priors)
