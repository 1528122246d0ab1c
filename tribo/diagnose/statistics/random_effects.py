"""The random effects of a campaign: four of each specimen, which its tests alone show, and those that tests share."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tribo.display import displayed
from tribo.records import FloatArray

OF_A_SPECIMEN = 4  # gain and slope, alike in both regimes and apart


@displayed()
@dataclass(frozen=True)
class RandomEffects:
    """The design of the random effects, without the zeros of all specimens that a test was not made on.

    ``specimen`` (n,) is the number of the specimen of every test, below ``specimens``, and ``own`` (n, 2, 4) are the
    columns of its effects; ``shared`` (n, 2, c) are those that tests of several specimens show. A vector of all effects
    (q,) holds those of the specimens one after the other, then the shared ones.
    """

    specimen: NDArray[np.int64]
    specimens: int
    own: FloatArray
    shared: FloatArray

    @property
    def of_specimens(self) -> int:
        """How many effects belong to specimens; the shared ones follow."""
        return OF_A_SPECIMEN * self.specimens

    @property
    def count(self) -> int:
        return self.of_specimens + int(self.shared.shape[2])

    @cached_property
    def tests_of(self) -> tuple[NDArray[np.int64], ...]:
        """The tests of every specimen, as indices."""
        order = np.argsort(self.specimen, kind="stable")
        ends = np.cumsum(np.bincount(self.specimen, minlength=self.specimens))
        return tuple(np.split(order, ends[:-1]))

    @property
    def dense(self) -> FloatArray:
        """The whole design, (n, 2, q)."""
        columns = np.zeros((*self.own.shape[:2], self.specimens, OF_A_SPECIMEN))
        columns[np.arange(len(self.own)), :, self.specimen] = self.own
        return np.concatenate([columns.reshape(*self.own.shape[:2], -1), self.shared], axis=2)

    def parts(self, effects: FloatArray) -> tuple[FloatArray, FloatArray]:
        """A vector of effects (..., q) as those of the specimens (..., specimens, 4) and the shared ones (..., c)."""
        own = effects[..., : self.of_specimens].reshape(*effects.shape[:-1], self.specimens, OF_A_SPECIMEN)
        return own, effects[..., self.of_specimens :]

    def on_tests(self, effects: FloatArray) -> FloatArray:
        """What effects (..., q) add to ln T of every test, (..., n, 2)."""
        own, shared = self.parts(effects)
        n, regimes, c = self.shared.shape
        of_shared = shared @ self.shared.reshape(n * regimes, c).T
        of_own = np.einsum("nrk,...nk->...nr", self.own, own[..., self.specimen, :])
        return np.asarray(of_own + of_shared.reshape(of_own.shape))

    def summed(self, weight: FloatArray) -> FloatArray:
        """The columns of all effects (q,), regimes added with ``weight`` (2,) and tests added up."""
        own = np.zeros((self.specimens, OF_A_SPECIMEN))
        np.add.at(own, self.specimen, np.einsum("nrk,r->nk", self.own, weight))
        return np.concatenate([own.ravel(), np.einsum("nrk,r->k", self.shared, weight)])

    def take(self, keep: np.ndarray) -> RandomEffects:
        """The same for the tests picked by a mask or by indices."""
        return replace(self, specimen=self.specimen[keep], own=self.own[keep], shared=self.shared[keep])

    def with_shared(self, columns: FloatArray) -> RandomEffects:
        """The same with further effects along ``columns`` (n, 2, d)."""
        return replace(self, shared=np.concatenate([self.shared, columns], axis=2))
