"""Sizes of the noise: how tests and random effects are weighed by them, and how they are estimated.

Sizes of random effects are updated by the fixed point of expectation-maximisation that counts the effects a campaign
determines (MacKay 1992), the repeats by expectation-maximisation, and what the repeats depend on by Fisher scoring.
Functions with ``...`` in a shape take one campaign or a batch of replicates.
"""

from __future__ import annotations

import numpy as np

from tribo.diagnose.statistics.model import Noise, Setup
from tribo.records import FloatArray

# Expected size, and how many effects that is worth: specimen gains and slopes, pattern factor
SPECIMEN_PRIOR, SLOPE_PRIOR, PATTERN_PRIOR = (0.05, 4.0), (0.03, 2.0), (1.0, 2.0)
SIZE_PRIORS = np.array([SPECIMEN_PRIOR, SPECIMEN_PRIOR, SLOPE_PRIOR, SLOPE_PRIOR, PATTERN_PRIOR])
REPEAT_PRIOR = (0.08, 4.0)
SCATTER_SD = 0.5  # of ln of the ratio of repeats between samples, and of the power of the force they follow
SMALLEST_SD = 0.003  # of ln T: no reading repeats better


def first_noise(s: Setup) -> Noise:
    """Where the estimation of the noise starts."""
    start = Noise(np.diag([REPEAT_PRIOR[0] ** 2] * 2), np.zeros(2), scatter=np.zeros(s.scatter.shape[1]))
    return start.with_sizes(SIZE_PRIORS[:, 0])


def whitener(s: Setup, noise: Noise) -> FloatArray:
    """Inverse Cholesky factor of the noise of every test, repeats plus reading, shape (n, 2, 2)."""
    cov = noise.per_test(s) + s.observations.reading[:, :, None] ** 2 * np.eye(2)
    a = np.sqrt(cov[:, 0, 0])
    b = cov[:, 1, 0] / a
    c = np.sqrt(cov[:, 1, 1] - b**2)
    factor = np.zeros_like(cov)
    factor[:, 0, 0], factor[:, 1, 0], factor[:, 1, 1] = 1 / a, -b / (a * c), 1 / c
    return factor


def weights(s: Setup, noise: Noise, left: FloatArray, factor: FloatArray | None = None) -> FloatArray:
    """Weight of every test under the bivariate t, one on average for normal noise, shape (n,)."""
    return (noise.tail + 2.0) / (noise.tail + distance(whitener(s, noise) if factor is None else factor, left))


def distance(factor: FloatArray, left: FloatArray) -> FloatArray:
    """Squared length of what is left of every test, whitened, shape (n,)."""
    static = factor[:, 0, 0] * left[:, 0]
    return static**2 + (factor[:, 1, 0] * left[:, 0] + factor[:, 1, 1] * left[:, 1]) ** 2


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


def updated_scatter(s: Setup, scatter: FloatArray, excess: FloatArray, tail: float) -> FloatArray:
    """One scoring step of what the repeats depend on, (..., k); ``excess`` (..., n) is the weighted squared distance of
    every test above its expectation of two."""
    information = 4.0 * tail / (tail + 4.0)
    precision = np.eye(s.scatter.shape[1]) / SCATTER_SD**2
    normal = information * s.scatter.T @ s.scatter + precision
    step = np.linalg.solve(normal, (excess @ s.scatter - scatter @ precision)[..., None])[..., 0]
    return np.asarray(scatter + np.clip(step, -0.5, 0.5))


def updated_repeat(s: Setup, total: FloatArray) -> FloatArray:
    """Covariance of the repeats (..., 2, 2) from its weighted sum of squares over the tests (..., 2, 2)."""
    size, worth = REPEAT_PRIOR
    reading = np.diag(np.mean(s.observations.reading**2, axis=0))
    repeat = (total + worth * size**2 * np.eye(2)) / (s.observations.n + worth) - reading
    values, vectors = np.linalg.eigh(0.5 * (repeat + np.swapaxes(repeat, -1, -2)))
    floored = vectors * np.maximum(values, SMALLEST_SD**2)[..., None, :]
    return np.asarray(floored @ np.swapaxes(vectors, -1, -2))


def log_prior(s: Setup, noise: Noise) -> float:
    """Log density of the sizes, without constants; of those alone that some random effect has."""
    found = -0.5 * float(np.sum(noise.scatter**2)) / SCATTER_SD**2 if noise.scatter is not None else 0.0
    for group, (size, (expected, worth)) in enumerate(zip(noise.sizes, SIZE_PRIORS, strict=True)):
        if (s.group == group).any():
            found -= worth * (np.log(size) + 0.5 * (expected / size) ** 2)
    size, worth = REPEAT_PRIOR
    determinant = float(np.linalg.slogdet(noise.repeat)[1])
    return float(found - 0.5 * worth * (determinant + size**2 * np.trace(np.linalg.inv(noise.repeat))))


