"""What chance gives: campaigns that a fitted model makes itself, many at a time, fitted and looked at again.

Replicates keep the design and draw specimens, sample errors and repeats anew. The law is linear over the little it
moves from replicate to replicate, so that derivatives are those of the fit; robust weights, noise sizes and random
effects are estimated for every replicate by the steps of :mod:`tribo.diagnose.statistics.fit`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribo.diagnose.statistics.fit import (
    REPEAT_PRIOR,
    SMALLEST_SD,
    SPECIMEN_PRIOR,
    jacobian_at,
    prior_precision,
    whitener,
)
from tribo.diagnose.statistics.model import ModelFit
from tribo.records import FloatArray

STEPS = 4
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
    ``residual`` (r, 2, n) of ln T; ``prior`` (r, p + q), the precision of the model's columns ``along`` (2, n, p + q).
    """

    precision: FloatArray
    residual: FloatArray
    prior: FloatArray
    along: FloatArray


def as_measured(f: ModelFit) -> Replicates:
    """The fitted campaign itself, as if it were one replicate."""
    p = len(np.concatenate([f.law, *f.values]))
    along = np.ascontiguousarray(np.concatenate([jacobian_at(f), f.setup.random], axis=2).transpose(1, 0, 2))
    left = (f.residual - f.setup.random @ f.effects).T[None]
    precision = _precision(f, f.noise.repeat[None], _weights(f, f.noise.repeat[None], left))
    return Replicates(precision, f.residual.T[None], _prior(f, f.noise.specimen[None], p), along)


def drawn_residuals(f: ModelFit, rng: np.random.Generator, replicates: int) -> FloatArray:
    """ln T less what the fit predicts, (replicates, 2, n): new specimens and sample errors, repeats resampled."""
    s = f.setup
    n = s.observations.n
    effects = rng.normal(size=(replicates, s.random.shape[2])) / np.sqrt(prior_precision(s, f.noise))
    factor = whitener(s, f.noise)
    left = np.einsum("nij,nj->ni", factor, f.residual - s.random @ f.effects)
    left = (left - left.mean(axis=0)) * np.sqrt(n / (n - 4.0))
    noise = np.linalg.solve(factor, left[rng.integers(0, n, (replicates, n))][..., None])[..., 0]
    return np.asarray(noise.transpose(0, 2, 1) + np.tensordot(effects, s.random, axes=(1, 2)).transpose(0, 2, 1))


def refit(f: ModelFit, residual: FloatArray) -> Replicates:
    """Law, random effects, weights and noise sizes of campaigns that part from ``f`` by ``residual`` (r, 2, n)."""
    s, r = f.setup, len(residual)
    p = len(np.concatenate([f.law, *f.values]))
    along = np.ascontiguousarray(np.concatenate([jacobian_at(f), s.random], axis=2).transpose(1, 0, 2))
    random = along[:, :, p:]
    moments = np.einsum("anp,bnq->abpq", random, random, optimize=True)
    repeat, specimen = np.repeat(f.noise.repeat[None], r, axis=0), np.repeat(f.noise.specimen[None], r, axis=0)
    left, solution = residual, np.zeros((r, along.shape[2]))
    for _ in range(STEPS):
        weight = _weights(f, repeat, left)
        inverse, solution = _solve(along, _precision(f, repeat, weight), residual, _prior(f, specimen, p))
        left = residual - _along(along, solution)
        spread = inverse[:, p:, p:]
        repeat = _repeat(f, weight, left, np.einsum("rpq,abpq->rab", spread, moments, optimize=True), p)
        specimen = _specimen(s.group, solution[:, p:] ** 2 + np.diagonal(spread, axis1=1, axis2=2))
    precision = _precision(f, repeat, _weights(f, repeat, left))
    without_effects = left + _along(random, solution[:, p:])
    return Replicates(precision, without_effects, _prior(f, specimen, p), along)


def _along(along: FloatArray, solution: FloatArray) -> FloatArray:
    """Sums of columns (2, n, k) with coefficients (r, k), shape (r, 2, n)."""
    return np.asarray(np.tensordot(solution, along, axes=(1, 2)))


def _inverse_noise(f: ModelFit, repeat: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Inverse of the noise of every test, repeats plus reading: its three entries, each (r, n)."""
    reading = f.setup.observations.reading**2
    static, sliding = repeat[:, 0, 0, None] + reading[:, 0], repeat[:, 1, 1, None] + reading[:, 1]
    mixed = repeat[:, 0, 1, None]
    determinant = static * sliding - mixed**2
    return sliding / determinant, -mixed / determinant, static / determinant


def _weights(f: ModelFit, repeat: FloatArray, left: FloatArray) -> FloatArray:
    """Weight of every test under the bivariate t, (r, n)."""
    static, mixed, sliding = _inverse_noise(f, repeat)
    distance = static * left[:, 0] ** 2 + 2 * mixed * left[:, 0] * left[:, 1] + sliding * left[:, 1] ** 2
    return np.asarray((f.noise.tail + 2.0) / (f.noise.tail + distance))


def _precision(f: ModelFit, repeat: FloatArray, weight: FloatArray) -> FloatArray:
    return np.stack([entry * weight for entry in _inverse_noise(f, repeat)], axis=1)


def _prior(f: ModelFit, specimen: FloatArray, p: int) -> FloatArray:
    """Precision of the columns of the model, (r, p + q): next to none for law and mechanisms."""
    s = f.setup
    sd = np.where(s.group >= 0, specimen[:, np.maximum(s.group, 0)], s.fixed_sd)
    return np.concatenate([np.full((len(specimen), p), 1e-12), 1.0 / sd**2], axis=1)


def _weighted(precision: FloatArray, columns: FloatArray) -> FloatArray:
    """Columns (2, n, k) times the precision of every replicate, (r, 2, n, k)."""
    static, mixed, sliding = (precision[:, i, :, None] for i in range(3))
    return np.stack([static * columns[0] + mixed * columns[1], mixed * columns[0] + sliding * columns[1]], axis=1)


def _normal(along: FloatArray, precision: FloatArray, prior: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Weighted columns (r, p, 2n) and the normal matrices (r, p, p)."""
    r, k = len(precision), along.shape[2]
    weighted = np.ascontiguousarray(_weighted(precision, along).reshape(r, -1, k).transpose(0, 2, 1))
    normal = (weighted.reshape(r * k, -1) @ along.reshape(-1, k)).reshape(r, k, k)
    normal[:, np.arange(k), np.arange(k)] += prior
    return weighted, normal


def _solve(
    along: FloatArray, precision: FloatArray, residual: FloatArray, prior: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Inverse normal matrices (r, p, p) and solutions (r, p), the diagonal scaled to one."""
    weighted, normal = _normal(along, precision, prior)
    scale = 1.0 / np.sqrt(np.diagonal(normal, axis1=1, axis2=2))
    both = scale[:, :, None] * scale[:, None, :]
    inverse = np.linalg.inv(normal * both + ROUNDING * np.eye(along.shape[2])) * both
    right = np.einsum("rpm,rm->rp", weighted, residual.reshape(len(residual), -1))
    return inverse, np.einsum("rpq,rq->rp", inverse, right)


def _repeat(f: ModelFit, weight: FloatArray, left: FloatArray, blurred: FloatArray, p: int) -> FloatArray:
    """Covariance of the repeats, (r, 2, 2), one step of expectation-maximisation."""
    n = f.setup.observations.n
    total = np.einsum("rn,ran,rbn->rab", weight, left, left, optimize=True) + blurred
    size, worth = REPEAT_PRIOR
    reading = np.diag(np.mean(f.setup.observations.reading**2, axis=0))
    repeat = (total + worth * size**2 * np.eye(2)) / (n - p / 2 + worth) - reading
    values, vectors = np.linalg.eigh(0.5 * (repeat + repeat.transpose(0, 2, 1)))
    return np.asarray((vectors * np.maximum(values, SMALLEST_SD**2)[:, None, :]) @ vectors.transpose(0, 2, 1))


def _specimen(group: NDArray[np.int64], variance: FloatArray) -> FloatArray:
    """Standard deviation of the specimen gains per regime, (r, 2)."""
    size, worth = SPECIMEN_PRIOR
    regimes = [group == regime for regime in (0, 1)]
    found = [(variance[:, g].sum(axis=1) + worth * size**2) / (g.sum() + worth) for g in regimes]
    return np.sqrt(np.stack(found, axis=1))


def scores(fitted: Replicates, looks: Columns) -> tuple[FloatArray, list[FloatArray]]:
    """Score test of every look beyond the model's own columns.

    Returns chi-squared values (r, looks) and the coefficients of each look's columns, (r, d) each.
    """
    r, columns = len(fitted.precision), looks.columns.reshape(-1, looks.columns.shape[2])
    weighted, normal = _normal(fitted.along, fitted.precision, fitted.prior)
    k = weighted.shape[1]
    scale = 1.0 / np.sqrt(np.diagonal(normal, axis1=1, axis2=2) + 1e-300)
    root = np.linalg.cholesky(normal * scale[:, :, None] * scale[:, None, :] + ROUNDING * np.eye(k))
    clear = np.linalg.inv(root) * scale[:, None, :]
    crossed = clear @ (weighted.reshape(r * k, -1) @ columns).reshape(r, k, -1)
    own = clear @ np.einsum("rpm,rm->rp", weighted, fitted.residual.reshape(r, -1))[:, :, None]
    pull = _weighted_residual(fitted) @ columns - (crossed.transpose(0, 2, 1) @ own)[:, :, 0]
    whole = fitted.precision.reshape(r, -1) @ looks.products.reshape(-1, looks.products.shape[2])
    chi2, coefficients = np.zeros((r, len(looks.spans))), []
    for i, (span, pair) in enumerate(zip(looks.spans, looks.pairs, strict=True)):
        coefficients.append(_solution(pull[:, span], whole[:, pair], crossed[:, :, span]))
        chi2[:, i] = np.sum(pull[:, span] * coefficients[-1], axis=1)
    return chi2, coefficients


def _weighted_residual(fitted: Replicates) -> FloatArray:
    static, mixed, sliding = (fitted.precision[:, i] for i in range(3))
    first, second = fitted.residual[:, 0], fitted.residual[:, 1]
    both = np.stack([static * first + mixed * second, mixed * first + sliding * second], axis=1)
    return np.asarray(both.reshape(len(both), -1))


def _solution(pull: FloatArray, whole: FloatArray, crossed: FloatArray) -> FloatArray:
    """Coefficients of one look (r, d) from its scores (r, d), its raw information (r, d d) and its share
    (r, p, d) of the model's columns; zero where the model takes a single column up."""
    r, d = pull.shape
    if d == 1:
        left = whole - np.sum(crossed**2, axis=1)
        return np.asarray(np.where(left > TAKEN_UP * whole, pull / np.maximum(left, 1e-300), 0.0))
    whole = whole.reshape(r, d, d)
    floor = ROUNDING * (np.diagonal(whole, axis1=1, axis2=2) + 1e-12)
    information = whole - crossed.transpose(0, 2, 1) @ crossed + floor[:, :, None] * np.eye(d)
    return np.asarray(np.linalg.solve(information, pull[:, :, None])[:, :, 0])
