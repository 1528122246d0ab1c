"""What chance gives: campaigns that a fitted model makes itself, many at a time, fitted and looked at again.

Replicates keep the design and draw specimens, pattern errors and repeats anew. The law is linear over the little it
moves from replicate to replicate, so that derivatives are those of the fit; robust weights, noise sizes and random
effects are estimated for every replicate by the steps of :mod:`tribo.diagnose.statistics.fit`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribo.diagnose.statistics.fit import jacobian_at
from tribo.diagnose.statistics.model import FIXED, ModelFit
from tribo.diagnose.statistics.scatter import (
    inverse_noise,
    log_size_prior,
    prior_precision,
    prior_sd,
    updated_repeats,
    updated_sizes,
    whitener,
)
from tribo.records import FloatArray

STEPS = 4
# Of the logarithms of the sizes (GAIN, SLOPE: two each; PATTERN): what a look explains of the patterns makes their
# error smaller, and what it explains of a specimen makes the spread of the specimens smaller.
SIZE_STEPS = np.array([[0.0, 0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0, -0.7], [-0.7, -0.7, -0.7, -0.7, 0.0]])
AS_FITTED = SIZE_STEPS[:1]
ROUNDING = 1e-9
TAKEN_UP = 1e-6  # share of a column's information below which nothing of it is left to see


@dataclass(frozen=True)
class Columns:
    """The columns of all looks, (2, n, k) regime by regime, and the products that their informations need.

    Each look spans ``spans`` of the k; ``products`` (3, n, m) are the static, mixed and sliding products of every
    pair of columns of one look, those of each look at ``pairs`` of the m.
    """

    columns: FloatArray
    spans: tuple[slice, ...]
    products: FloatArray
    pairs: tuple[slice, ...]


def columns_of(stacked: FloatArray, spans: Sequence[slice]) -> Columns:
    """Columns (n, 2, k) of all looks, made ready for many replicates."""
    columns = np.ascontiguousarray(stacked.transpose(1, 0, 2))
    index = [np.arange(span.start, span.stop) for span in spans]
    first = np.concatenate([np.repeat(i, len(i)) for i in index])
    second = np.concatenate([np.tile(i, len(i)) for i in index])
    ends = np.cumsum([len(i) ** 2 for i in index])
    pairs = [slice(int(end) - len(i) ** 2, int(end)) for end, i in zip(ends, index, strict=True)]
    return Columns(columns, tuple(spans), _products(columns, first, second), tuple(pairs))


def _products(columns: FloatArray, first: NDArray[np.int64], second: NDArray[np.int64]) -> FloatArray:
    static, sliding = columns
    mixed = static[:, first] * sliding[:, second] + sliding[:, first] * static[:, second]
    return np.stack([static[:, first] * static[:, second], mixed, sliding[:, first] * sliding[:, second]])


@dataclass(frozen=True)
class Replicates:
    """Fitted replicates: ``precision`` (r, 3, n) of every test, robust weight included, as static, mixed, sliding;
    ``residual`` (r, 2, n) of ln T; ``prior`` (r, p + q), the precision of the model's columns ``along`` (2, n, p + q);
    ``group`` (p + q,) is that of the size of each, FIXED where there is none, and ``sizes`` (r, 5) are the sizes.
    """

    precision: FloatArray
    residual: FloatArray
    prior: FloatArray
    along: FloatArray
    group: NDArray[np.int64]
    sizes: FloatArray


@dataclass(frozen=True)
class Sizes:
    """The noise of every replicate: ``repeat`` (r, 2, 2), what the repeats depend on, ``scatter`` (r, k), and sizes of
    the random ``effects`` (r, 5).
    """

    repeat: FloatArray
    scatter: FloatArray
    effects: FloatArray


def as_measured(f: ModelFit) -> Replicates:
    """The fitted campaign itself, as if it were one replicate."""
    left = (f.residual - f.setup.random @ f.effects).T[None]
    sizes = _fitted_sizes(f, 1)
    inverse = inverse_noise(f.setup, sizes.repeat, sizes.scatter)
    return _replicates(f, sizes, inverse * _weights(f, inverse, left)[:, None], f.residual.T[None])


def _replicates(f: ModelFit, sizes: Sizes, precision: FloatArray, residual: FloatArray) -> Replicates:
    p = len(np.concatenate([f.law, *f.values]))
    group = np.concatenate([np.full(p, FIXED), f.setup.group])
    return Replicates(precision, residual, _prior(f, sizes), _along_of(f), group, sizes.effects)


def _along_of(f: ModelFit) -> FloatArray:
    """The model's columns, (2, n, p + q)."""
    return np.ascontiguousarray(np.concatenate([jacobian_at(f), f.setup.random], axis=2).transpose(1, 0, 2))


def _fitted_sizes(f: ModelFit, replicates: int) -> Sizes:
    scatter = np.zeros(f.setup.scatter.shape[1]) if f.noise.scatter is None else f.noise.scatter
    parts = (f.noise.repeat, scatter, f.noise.sizes)
    return Sizes(*(np.repeat(part[None], replicates, axis=0) for part in parts))


def drawn_residuals(f: ModelFit, rng: np.random.Generator, replicates: int) -> FloatArray:
    """ln T less what the fit predicts, (replicates, 2, n): new specimens and pattern errors, repeats resampled."""
    s = f.setup
    n = s.observations.n
    effects = rng.normal(size=(replicates, s.random.shape[2])) / np.sqrt(prior_precision(s, f.noise))
    factor = whitener(s, f.noise)
    left = standardised(f, factor)
    noise = np.linalg.solve(factor, left[rng.integers(0, n, (replicates, n))][..., None])[..., 0]
    return np.asarray(noise.transpose(0, 2, 1) + np.tensordot(effects, s.random, axes=(1, 2)).transpose(0, 2, 1))


def standardised(f: ModelFit, factor: FloatArray) -> FloatArray:
    """What is left of every test in units of the fitted noise, (n, 2).

    The random effects follow the tests, so that what is left is smaller than the noise: it is scaled to the noise that
    the fit states, to a weighted covariance of one.
    """
    s = f.setup
    left = np.einsum("nij,nj->ni", factor, f.residual - s.random @ f.effects)
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
    s, along = f.setup, _along_of(f)
    p = along.shape[2] - s.random.shape[2]
    sizes, left = _fitted_sizes(f, len(residual)), residual
    solution = np.zeros((len(residual), along.shape[2]))
    for _ in range(STEPS):
        inverse = inverse_noise(s, sizes.repeat, sizes.scatter)
        weight = _weights(f, inverse, left)
        spread, solution = _solve(along, inverse * weight[:, None], residual, _prior(f, sizes))
        left = residual - _along(along, solution)
        effects = updated_sizes(s, sizes.effects, solution[:, p:], np.diagonal(spread, axis1=1, axis2=2)[:, p:])
        squares = weight[:, None] * (_squares(left) + _blurred(along, spread))
        sizes = Sizes(*updated_repeats(s, (sizes.repeat, sizes.scatter), squares, f.noise.tail), effects)
    inverse = inverse_noise(s, sizes.repeat, sizes.scatter)
    precision = inverse * _weights(f, inverse, left)[:, None]
    return _replicates(f, sizes, precision, left + _along(along[:, :, p:], solution[:, p:])), sizes


def _along(along: FloatArray, solution: FloatArray) -> FloatArray:
    """Sums of columns (2, n, k) with coefficients (r, k), shape (r, 2, n)."""
    return np.asarray(np.tensordot(solution, along, axes=(1, 2)))


def _squares(left: FloatArray) -> FloatArray:
    """Static, mixed and sliding products of what is left, (r, 3, n)."""
    return np.stack([left[:, 0] ** 2, left[:, 0] * left[:, 1], left[:, 1] ** 2], axis=1)


def _blurred(along: FloatArray, spread: FloatArray) -> FloatArray:
    """The same products expected from the uncertainty ``spread`` (r, k, k) of the coefficients, (r, 3, n)."""
    n, k = along.shape[1:]
    moved = (along.reshape(-1, k) @ spread).reshape(len(spread), 2, n, k)
    pairs = ((0, 0), (0, 1), (1, 1))
    return np.stack([np.einsum("rnk,nk->rn", moved[:, a], along[b]) for a, b in pairs], axis=1)


def _weights(f: ModelFit, inverse: FloatArray, left: FloatArray) -> FloatArray:
    """Weight of every test under the bivariate t, (r, n), for the inverse of its noise (r, 3, n)."""
    distance = np.einsum("ran,ran,a->rn", inverse, _squares(left), [1.0, 2.0, 1.0])
    return np.asarray((f.noise.tail + 2.0) / (f.noise.tail + distance))


def _prior(f: ModelFit, sizes: Sizes) -> FloatArray:
    """Precision of the columns of the model, (r, p + q): next to none for law and mechanisms."""
    p = len(np.concatenate([f.law, *f.values]))
    return np.concatenate([np.full((len(sizes.effects), p), 1e-12), prior_sd(f.setup, sizes.effects) ** -2], axis=1)


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


@dataclass(frozen=True)
class Products:
    """Products of the model's columns, the looks and the residual of every replicate, whatever the random sizes are."""

    normal: FloatArray  # (r, p, p)
    right: FloatArray  # (r, p)
    crossed: FloatArray  # (r, p, k)
    pull: FloatArray  # (r, k)
    whole: FloatArray  # (r, m)


def scores(
    fitted: Replicates, looks: Columns, steps: FloatArray = SIZE_STEPS
) -> tuple[FloatArray, list[FloatArray]]:
    """Score test of every look beyond the model's own columns.

    The scores are taken at several sizes of the random effects, ``steps`` (steps, 5) of their logarithms from the
    fitted ones; each pays what it loses of the likelihood of the model without the look. Returns the largest
    chi-squared values (r, looks) and the coefficients of each look, (r, d) each, at the first sizes.
    """
    found = _products_of(fitted, looks)
    each = [_scores_at(fitted, looks, found, step) for step in steps]
    evidence = np.stack([e for _, _, e in each])
    chi2 = np.stack([c for c, _, _ in each]) + 2.0 * (evidence - evidence.max(axis=0))[:, :, None]
    return np.maximum(chi2.max(axis=0), 0.0), each[0][1]


def _products_of(fitted: Replicates, looks: Columns) -> Products:
    r, columns = len(fitted.precision), looks.columns.reshape(-1, looks.columns.shape[2])
    weighted, normal = _normal(fitted.along, fitted.precision)
    k = weighted.shape[1]
    return Products(
        normal=normal,
        right=np.einsum("rpm,rm->rp", weighted, fitted.residual.reshape(r, -1)),
        crossed=(weighted.reshape(r * k, -1) @ columns).reshape(r, k, -1),
        pull=_weighted_residual(fitted) @ columns,
        whole=fitted.precision.reshape(r, -1) @ looks.products.reshape(-1, looks.products.shape[2]),
    )


def _scores_at(
    fitted: Replicates, looks: Columns, found: Products, step: FloatArray
) -> tuple[FloatArray, list[FloatArray], FloatArray]:
    """Chi-squared values, coefficients, and the log likelihood (r,) of the model without the looks, at one step."""
    k = found.right.shape[1]
    prior = fitted.prior * np.exp(-2.0 * np.append(step, 0.0))[fitted.group]
    normal = found.normal.copy()
    normal[:, np.arange(k), np.arange(k)] += prior
    scale = 1.0 / np.sqrt(np.diagonal(normal, axis1=1, axis2=2) + 1e-300)
    root = np.linalg.cholesky(normal * scale[:, :, None] * scale[:, None, :] + ROUNDING * np.eye(k))
    clear = np.linalg.inv(root) * scale[:, None, :]
    crossed = clear @ found.crossed
    own = (clear @ found.right[:, :, None])[:, :, 0]
    pull = found.pull - np.einsum("rpk,rp->rk", crossed, own)
    chi2, coefficients = _solved(looks, pull, found.whole, crossed)
    curvature = np.log(np.diagonal(root, axis1=1, axis2=2) / scale).sum(axis=1)
    sizes = sum(log_size_prior(g, fitted.sizes[:, g] * np.exp(step[g])) for g in range(len(step)) if g in fitted.group)
    evidence = 0.5 * np.log(prior).sum(axis=1) - curvature + 0.5 * np.sum(own**2, axis=1) + sizes
    return chi2, coefficients, evidence


def _weighted_residual(fitted: Replicates) -> FloatArray:
    static, mixed, sliding = (fitted.precision[:, i] for i in range(3))
    first, second = fitted.residual[:, 0], fitted.residual[:, 1]
    both = np.stack([static * first + mixed * second, mixed * first + sliding * second], axis=1)
    return np.asarray(both.reshape(len(both), -1))


def _solved(
    looks: Columns, pull: FloatArray, whole: FloatArray, crossed: FloatArray
) -> tuple[FloatArray, list[FloatArray]]:
    """Chi-squared values (r, looks) and coefficients of each look, (r, d): those of one column all at once."""
    first = [span.start for span in looks.spans]
    left = whole[:, [pair.start for pair in looks.pairs]] - np.sum(crossed**2, axis=1)[:, first]
    seen = left > TAKEN_UP * whole[:, [pair.start for pair in looks.pairs]]
    alone = np.where(seen, pull[:, first] / np.maximum(left, 1e-300), 0.0)
    chi2, coefficients = alone * pull[:, first], list(alone.T[:, :, None])
    for i, (span, pair) in enumerate(zip(looks.spans, looks.pairs, strict=True)):
        if span.stop > span.start + 1:
            coefficients[i] = _solution(pull[:, span], whole[:, pair], crossed[:, :, span])
            chi2[:, i] = np.sum(pull[:, span] * coefficients[i], axis=1)
    return chi2, coefficients


def _solution(pull: FloatArray, whole: FloatArray, crossed: FloatArray) -> FloatArray:
    """Coefficients of one look (r, d) from its scores (r, d), its raw information (r, d d) and its share (r, p, d) of
    the model's columns."""
    r, d = pull.shape
    whole = whole.reshape(r, d, d)
    floor = ROUNDING * (np.diagonal(whole, axis1=1, axis2=2) + 1e-12)
    information = whole - crossed.transpose(0, 2, 1) @ crossed + floor[:, :, None] * np.eye(d)
    return np.asarray(np.linalg.solve(information, pull[:, :, None])[:, :, 0])
