"""Sizes of the noise: how tests and random effects are weighed by them, and how they are estimated.

Sizes of random effects are updated by the fixed point of expectation-maximisation that counts the effects a campaign
determines (MacKay 1992), the repeats by expectation-maximisation, and what the repeats depend on by Fisher scoring.
Functions with ``...`` in a shape take one campaign or a batch of replicates.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tribo.diagnostics.model import FIXED, SPECIMEN_DRIFT, Setup
from tribo.display import displayed
from tribo.records import FloatArray

# Expected size, and how many effects that is worth: specimen gains and slopes, pattern factor; drift of specimens,
# sessions and drift of the series
SPECIMEN_PRIOR, SLOPE_PRIOR, PATTERN_PRIOR = (0.05, 4.0), (0.01, 2.0), (1.0, 1.0)
NUISANCE_PRIOR = (0.005, 1.0)
SIZE_PRIORS = np.array([*(2 * [SPECIMEN_PRIOR]), *(2 * [SLOPE_PRIOR]), *(3 * [PATTERN_PRIOR]), *(6 * [NUISANCE_PRIOR])])
FIRST_NUISANCE = 0.03  # size from which the estimation of each of the last six starts
REPEAT_PRIOR = (0.08, 4.0)
SCATTER_SD = 0.5  # of ln of the ratio of repeats between samples, and of the power of the force they follow
SMALLEST_SD = 0.003  # of ln T: no reading repeats better


@displayed()
@dataclass(frozen=True)
class Noise:
    """Sizes of the random parts, standard deviations of ln T: repeats (2, 2) covariance, and ``sizes`` (13,) of the
    groups of random effects, in the order of :mod:`tribo.diagnostics.model`.

    Those of the patterns are factors on the error that the predictor states. The standard deviation of the
    repeats of a test is multiplied by exp(``scatter`` @ setup.scatter). ``tail`` is the number of degrees of freedom of
    the t distribution of the repeats.
    """

    repeat: FloatArray
    sizes: FloatArray
    scatter: FloatArray | None = None
    tail: float = 8.0

    def per_test(self, s: Setup) -> FloatArray:
        """Covariance of the repeats of every test, (n, 2, 2)."""
        if self.scatter is None:
            return np.repeat(self.repeat[None], s.observations.n, axis=0)
        return np.asarray(self.repeat * np.exp(2.0 * s.scatter @ self.scatter)[:, None, None])


def first_noise() -> Noise:
    """Where the estimation of the noise starts."""
    sizes = SIZE_PRIORS[:, 0].copy()
    sizes[SPECIMEN_DRIFT:] = FIRST_NUISANCE
    return Noise(np.diag([REPEAT_PRIOR[0] ** 2] * 2), sizes)


def held_at(s: Setup, here: NDArray[np.bool_], sizes: FloatArray) -> Setup:
    """The same with the random effects that are ``here`` (q,) held at the ``sizes`` of their groups."""
    unit = np.where(here, sizes[np.maximum(s.group, 0)] * s.unit, s.unit)
    return replace(s, unit=unit, group=np.where(here, FIXED, s.group))


def held_still(s: Setup, nuisances: NDArray[np.bool_]) -> tuple[Setup, float]:
    """The same with the random effects of ``nuisances`` (q,) held at the size that is expected of none; and the log
    density of these sizes, by which the score of a fit is to be raised to be compared with one where they are free."""
    expected = SIZE_PRIORS[:, 0]
    density = sum(float(log_size_prior(int(g), expected[g])) for g in np.unique(s.group[nuisances]))
    return held_at(s, nuisances, expected), float(density)


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
    density = -0.5 * float(np.sum(noise.scatter**2)) / SCATTER_SD**2 if noise.scatter is not None else 0.0
    for group, size in enumerate(noise.sizes):
        if (s.group == group).any():
            density += float(log_size_prior(group, size))
    size, worth = REPEAT_PRIOR
    determinant = float(np.linalg.slogdet(noise.repeat)[1])
    return float(density - 0.5 * worth * (determinant + size**2 * np.trace(np.linalg.inv(noise.repeat))))


def prior_sd(s: Setup, sizes: FloatArray) -> FloatArray:
    """Standard deviation of every random effect for sizes (..., 13), shape (..., q)."""
    known = np.ones((*sizes.shape[:-1], 1))
    return np.asarray(s.unit * np.concatenate([sizes, known], axis=-1)[..., s.group])


def updated_sizes(s: Setup, sizes: FloatArray, effects: FloatArray, variance: FloatArray) -> FloatArray:
    """Sizes (..., 13) from predicted effects (..., q) and their variances (..., q)."""
    known = 1.0 - variance / prior_sd(s, sizes) ** 2
    squares = (effects / s.unit) ** 2
    updated = sizes.copy()
    for group, (expected, worth) in enumerate(SIZE_PRIORS):
        here = s.group == group
        if here.any():
            total = squares[..., here].sum(axis=-1) + worth * expected**2
            updated[..., group] = np.sqrt(total / (np.maximum(known[..., here].sum(axis=-1), 0.0) + worth))
    return updated


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
    covariance = (total[..., [[0, 1], [1, 2]]] + worth * size**2 * np.eye(2)) / (s.observations.n + worth)
    distances = np.einsum("...an,...an,a->...n", inverse, squares, [1.0, 2.0, 1.0])
    excess = (distances - 2.0) * share.mean(axis=-2)  # of every test above its expectation
    information, precision = 4.0 * tail / (tail + 4.0), np.eye(s.scatter.shape[1]) / SCATTER_SD**2
    normal = information * s.scatter.T @ s.scatter + precision
    step = np.linalg.solve(normal, (excess @ s.scatter - scatter @ precision)[..., None])[..., 0]
    scatter = scatter + np.clip(step, -0.5, 0.5)
    common = scatter[..., :-1].mean(axis=-1, keepdims=True)  # of all samples: that is the covariance itself
    scatter = np.concatenate([scatter[..., :-1] - common, scatter[..., -1:]], axis=-1)
    values, vectors = np.linalg.eigh(covariance * np.exp(2.0 * common)[..., None])
    floored = np.maximum(values, SMALLEST_SD**2)  # the nearest covariance without a smaller standard deviation
    return np.asarray((vectors * floored[..., None, :]) @ np.swapaxes(vectors, -1, -2)), scatter


def inverse_noise(s: Setup, repeat: FloatArray, scatter: FloatArray) -> FloatArray:
    """Inverse of the noise of every test, repeats plus reading: static, mixed and sliding entries, (..., 3, n)."""
    times, reading = np.exp(2.0 * scatter @ s.scatter.T), s.observations.reading**2
    static = repeat[..., 0, 0, None] * times + reading[:, 0]
    sliding = repeat[..., 1, 1, None] * times + reading[:, 1]
    mixed = repeat[..., 0, 1, None] * times
    return np.stack([sliding, -mixed, static], axis=-2) / (static * sliding - mixed**2)[..., None, :]


def log_size_prior(group: int, size: FloatArray) -> FloatArray:
    """Log density of the logarithm of a size, without constants: a scaled inverse chi."""
    expected, worth = SIZE_PRIORS[group]
    return np.asarray(-worth * (np.log(size) + 0.5 * (expected / size) ** 2))
