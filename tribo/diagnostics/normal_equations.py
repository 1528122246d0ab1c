"""Normal equations of a model with random effects of specimens, by blocks.

A test shows the effects of its own specimen alone, so the normal matrix is one 4 x 4 block a specimen, bordered by the
columns that tests share: law, mechanisms, patterns. Eliminating the blocks leaves a matrix of the size of the border
(its Schur complement), so that the work grows with the number of specimens and not with its cube. All functions take a
batch of replicates, r; one campaign is a batch of one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribo.diagnostics.model import RandomEffects
from tribo.display import displayed
from tribo.records import FloatArray

ROUNDING = 1e-9  # of a diagonal of one: the ridge of normal matrices
Sides = tuple[FloatArray, FloatArray]  # of specimens (r, S, 4, ...) and of the border (r, m, ...)


@displayed()
@dataclass(frozen=True)
class ModelColumns:
    """The columns of a model: ``own`` (n, 2, 4) of the specimen of each test, ``border`` (n, 2, m) of all tests: those
    of ``parameters`` first, then of shared random effects. ``tests_of`` holds the tests of every specimen."""

    own: FloatArray
    border: FloatArray
    parameters: int
    tests_of: tuple[NDArray[np.int64], ...]

    def vector(self, own: FloatArray, border: FloatArray) -> FloatArray:
        """Values of specimens (r, S, 4) and of the border (r, m) in one order: parameters, specimens, shared."""
        p = self.parameters
        return np.concatenate([border[:, :p], own.reshape(len(own), -1), border[:, p:]], axis=1)

    def sides(self, values: FloatArray) -> Sides:
        """The reverse: (r, p + q) as those of specimens (r, S, 4) and of the border (r, m)."""
        p, q = self.parameters, 4 * len(self.tests_of)
        own = values[:, p : p + q].reshape(len(values), -1, 4)
        return own, np.concatenate([values[:, :p], values[:, p + q :]], axis=1)

    @property
    def in_order(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """The tests specimen by specimen, and the specimen of each."""
        sizes = [len(tests) for tests in self.tests_of]
        return np.concatenate(self.tests_of), np.repeat(np.arange(len(sizes)), sizes)

    def on_tests(self, own: FloatArray, border: FloatArray) -> FloatArray:
        """What coefficients of specimens (r, S, 4) and of the border (r, m) add to every test, (r, 2, n)."""
        found = np.tensordot(border, self.border, axes=(1, 2))
        for k, tests in enumerate(self.tests_of):
            found[:, tests] += np.tensordot(own[:, k], self.own[tests], axes=(1, 2))
        return np.asarray(found.transpose(0, 2, 1))


def model_columns(jacobian: FloatArray, effects: RandomEffects) -> ModelColumns:
    """The columns of law and mechanisms (n, 2, p) and of the random effects."""
    border = np.concatenate([jacobian, effects.shared], axis=2)
    return ModelColumns(effects.own, border, int(jacobian.shape[2]), effects.tests_of)


def weighted(precision: FloatArray, columns: FloatArray) -> FloatArray:
    """Columns (n, 2, k) times the precision (r, 3, n) of every test, (r, n, 2, k)."""
    static, mixed, sliding = (precision[:, i, :, None] for i in range(3))
    found = np.empty((len(precision), *columns.shape))
    np.multiply(static, columns[:, 0], out=found[:, :, 0])
    found[:, :, 0] += mixed * columns[:, 1]
    np.multiply(sliding, columns[:, 1], out=found[:, :, 1])
    found[:, :, 1] += mixed * columns[:, 0]
    return found


@displayed()
@dataclass(frozen=True)
class Weighted:
    """The columns of a model times the precision of every test: ``own`` (r, n, 2, 4) and ``border`` (r, n, 2, m)."""

    columns: ModelColumns
    own: FloatArray
    border: FloatArray

    def times(self, other: FloatArray) -> Sides:
        """Products with other columns (n, 2, k): (r, S, 4, k) and (r, m, k)."""
        blocks = [self.own_times(tests, other[tests]) for tests in self.columns.tests_of]
        return np.stack(blocks, axis=1), self.flat_border @ other.reshape(2 * len(other), other.shape[2])

    @property
    def flat_border(self) -> FloatArray:
        """The columns of the border, (r, m, 2n)."""
        r, n, _, m = self.border.shape
        return self.border.reshape(r, 2 * n, m).transpose(0, 2, 1)

    def own_times(self, tests: NDArray[np.int64], other: FloatArray) -> FloatArray:
        """Of one specimen, its tests given: products of its own columns with others (its tests, 2, k), (r, 4, k)."""
        r, k = len(self.own), other.shape[2]
        own = self.own[:, tests].reshape(r, 2 * len(tests), 4).transpose(0, 2, 1).reshape(4 * r, -1)
        return np.asarray((own @ other.reshape(2 * len(tests), k)).reshape(r, 4, k))

    def own_with(self, other: FloatArray) -> FloatArray:
        """The same of every specimen: with others (n, 2, k), (r, S, 4, k)."""
        if len(self.own) > 1:
            return np.stack([self.own_times(tests, other[tests]) for tests in self.columns.tests_of], axis=1)
        own = self.own[0]
        each = own[:, 0, :, None] * other[:, 0, None] + own[:, 1, :, None] * other[:, 1, None]
        order, specimen = self.columns.in_order
        found = np.zeros((1, len(self.columns.tests_of), *each.shape[1:]))
        there, first = np.unique(specimen, return_index=True)
        found[0, there] = np.add.reduceat(each[order], first)
        return found

    def border_times(self, tests: NDArray[np.int64], other: FloatArray) -> FloatArray:
        """The same of the border, (r, m, k)."""
        r, k = len(self.own), other.shape[2]
        border = self.border[:, tests].reshape(r, 2 * len(tests), self.border.shape[3])
        return np.asarray(border.transpose(0, 2, 1) @ other.reshape(2 * len(tests), k))

    def with_residual(self, residual: FloatArray) -> Sides:
        """Products with the residual (r, 2, n) of each replicate: (r, S, 4) and (r, m)."""
        by_test = residual.transpose(0, 2, 1)
        each = np.einsum("rnik,rni->rnk", self.own, by_test)
        own = np.stack([each[:, tests].sum(axis=1) for tests in self.columns.tests_of], axis=1)
        return own, (self.flat_border @ by_test.reshape(len(residual), -1, 1))[..., 0]


def weighted_columns(columns: ModelColumns, precision: FloatArray) -> Weighted:
    """The columns times the precision (r, 3, n) of every test."""
    return Weighted(columns, weighted(precision, columns.own), weighted(precision, columns.border))


@displayed()
@dataclass(frozen=True)
class Normal:
    """A normal matrix by blocks: ``own`` (r, S, 4, 4), ``across`` (r, S, 4, m) and ``border`` (r, m, m)."""

    own: FloatArray
    across: FloatArray
    border: FloatArray

    def with_prior(self, own: FloatArray, border: FloatArray) -> Normal:
        """Precisions (r, S, 4) and (r, m) added to the diagonal, and a ridge in proportion to it."""
        return Normal(_raised(self.own, own), self.across, _raised(self.border, border))

    def inverse(self) -> Inverse:
        own = np.asarray(np.linalg.inv(self.own), float)
        across, schur = self._eliminated(own)
        scale = self._scale
        both = scale[:, :, None] * scale[:, None, :]
        return Inverse(own, across, np.asarray(np.linalg.inv(schur * both) * both))

    def inverse_without(self, held: NDArray[np.bool_]) -> Inverse:
        """The inverse without the columns of the border that ``held`` (m,) marks: nothing there."""
        free = np.flatnonzero(~held)
        found = Normal(self.own, self.across[..., free], self.border[:, free][:, :, free]).inverse()
        border = np.zeros_like(self.border)
        border[:, free[:, None], free] = found.border
        across = np.zeros_like(self.across)
        across[..., free] = found.across
        return Inverse(found.own, across, border)

    def log_determinant(self) -> FloatArray:
        """Of the whole matrix, (r,)."""
        schur = self._eliminated(np.asarray(np.linalg.inv(self.own), float))[1]
        scale = self._scale
        scaled = np.linalg.slogdet(schur * scale[:, :, None] * scale[:, None, :])[1]
        return np.asarray(np.linalg.slogdet(self.own)[1].sum(axis=1) + scaled - 2.0 * np.log(scale).sum(axis=1))

    @property
    def _scale(self) -> FloatArray:
        return np.asarray(1.0 / np.sqrt(np.maximum(np.diagonal(self.border, axis1=1, axis2=2), 1e-300)))

    def _eliminated(self, own: FloatArray) -> tuple[FloatArray, FloatArray]:
        """What the blocks follow of the border, ``own`` being their inverses, and the border without them."""
        across = own @ self.across
        r, specimens, _, m = across.shape
        first, second = (side.reshape(r, 4 * specimens, m) for side in (self.across, across))
        return across, self.border - first.transpose(0, 2, 1) @ second


def _raised(matrix: FloatArray, prior: FloatArray) -> FloatArray:
    raised = matrix.copy()
    here = np.arange(matrix.shape[-1])
    raised[..., here, here] = (raised[..., here, here] + prior) * (1.0 + ROUNDING)
    return raised


def normal_of(found: Weighted) -> Normal:
    """The normal matrix of a model without the prior."""
    columns = found.columns
    own = found.own_with(np.concatenate([columns.own, columns.border], axis=2))
    n, _, m = columns.border.shape
    return Normal(own[..., :4], own[..., 4:], found.flat_border @ columns.border.reshape(2 * n, m))


@displayed()
@dataclass(frozen=True)
class Inverse:
    """The inverse of a normal matrix: ``own`` (r, S, 4, 4) of the blocks alone, ``across`` (r, S, 4, m) what a block
    follows of the border, and ``border`` (r, m, m), the covariance of the border."""

    own: FloatArray
    across: FloatArray
    border: FloatArray

    def solution(self, own: FloatArray, border: FloatArray) -> Sides:
        """Coefficients for right sides (r, S, 4) and (r, m)."""
        r, specimens, _, m = self.across.shape
        wide = self.across.reshape(r, 4 * specimens, m)
        right = border - (own.reshape(r, 1, -1) @ wide)[:, 0]
        shared = self.border @ right[..., None]
        alone = (self.own @ own[..., None])[..., 0]
        return alone - (wide @ shared).reshape(own.shape), shared[..., 0]

    @property
    def variances(self) -> Sides:
        """Of every coefficient, (r, S, 4) and (r, m)."""
        moved = np.sum((self.across @ self.border[:, None]) * self.across, axis=3)
        return np.diagonal(self.own, axis1=2, axis2=3) + moved, np.diagonal(self.border, axis1=1, axis2=2)

    def spread(self, columns: ModelColumns) -> FloatArray:
        """Variance of what the model predicts for every test: static, mixed and sliding entries, (r, 3, n)."""
        if len(self.own) == 1:
            return self._spread_of_one(columns)[None]
        found = np.empty((len(self.own), 3, len(columns.own)))
        for k, tests in enumerate(columns.tests_of):
            own = columns.own[tests].reshape(-1, 4)  # the two rows of every test one after another
            free = columns.border[tests].reshape(len(own), columns.border.shape[2]) - own @ self.across[:, k]
            moved, alone = free @ self.border, own @ self.own[:, k]
            for i, (a, b) in enumerate(((0, 0), (0, 1), (1, 1))):
                shared = np.einsum("rtm,rtm->rt", moved[:, a::2], free[:, b::2])
                found[:, i, tests] = shared + np.einsum("rta,ta->rt", alone[:, a::2], own[b::2])
        return found

    def _spread_of_one(self, columns: ModelColumns) -> FloatArray:
        """The same of a batch of one, all specimens at once, (3, n)."""
        order, specimen = columns.in_order
        own, found = columns.own[order], np.empty((3, len(order)))
        free = columns.border[order] - own @ self.across[0, specimen]
        moved = (free.reshape(-1, free.shape[2]) @ self.border[0]).reshape(free.shape)
        alone = own @ self.own[0, specimen]
        for i, (a, b) in enumerate(((0, 0), (0, 1), (1, 1))):
            shared = np.einsum("nm,nm->n", moved[:, a], free[:, b])
            found[i, order] = shared + np.einsum("nm,nm->n", alone[:, a], own[:, b])
        return found

    def between(self, columns: ModelColumns, specimen: NDArray[np.int64]) -> FloatArray:
        """Covariance of what the model predicts for all tests of ``columns``, of which ``specimen`` (n,) are the
        specimens, (2n, 2n), of a batch of one."""
        free = columns.border - columns.own @ self.across[0, specimen]
        flat = free.reshape(-1, free.shape[2])
        own = np.einsum("nra,nab,ksb->nrks", columns.own, self.own[0, specimen], columns.own, optimize=True)
        own = own * (specimen[:, None] == specimen)[:, None, :, None]
        return np.asarray(flat @ self.border[0] @ flat.T + own.reshape(len(flat), -1))

    def dense(self, columns: ModelColumns) -> FloatArray:
        """The whole matrices in the order of :meth:`ModelColumns.vector`, (r, p + q, p + q)."""
        r, specimens, _, m = self.across.shape
        wide = self.across.reshape(r, 4 * specimens, m)
        own = wide @ self.border @ wide.transpose(0, 2, 1)
        for k in range(specimens):
            own[:, 4 * k : 4 * k + 4, 4 * k : 4 * k + 4] += self.own[:, k]
        side = -wide @ self.border
        whole = np.block([[own, side], [side.transpose(0, 2, 1), self.border]])
        numbers = np.arange(whole.shape[1], dtype=float)[None]
        own, shared = numbers[:, : 4 * specimens].reshape(1, -1, 4), numbers[:, 4 * specimens :]
        order = columns.vector(own, shared)[0].astype(int)
        return np.asarray(whole[:, order][:, :, order])
