"""Columns along which ln T may change; where one specimen alone shows them, kept without the tests of the others."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from tribo.diagnose.statistics.random_effects import RandomEffects
from tribo.display import displayed
from tribo.records import FloatArray

EVERY = -1  # in place of a specimen: all tests
AT_ONCE = 100  # courses that are written out at the same time
MOST_PAIRS = 2000  # courses of two specimens that are written out at all


@displayed()
@dataclass(frozen=True)
class Course:
    """Columns of ln T, ``values`` (t, 2, d) on the ``tests`` (t,) of one ``specimen``, by its number, or of EVERY one;
    zero on the others of ``n`` tests."""

    n: int
    specimen: int
    tests: NDArray[np.int64]
    values: FloatArray

    @property
    def columns(self) -> FloatArray:
        """On all tests, (n, 2, d)."""
        if self.specimen == EVERY:
            return self.values
        found = np.zeros((self.n, *self.values.shape[1:]))
        found[self.tests] = self.values
        return found

    @property
    def freedom(self) -> int:
        return int(self.values.shape[2])

    @property
    def shows(self) -> bool:
        """Whether it is finite, and a change for some test."""
        values = self.values
        return bool(values.size and np.isfinite(values).all() and (np.ptp(values) > 0 or len(values) < self.n))


def course(columns: FloatArray, effects: RandomEffects) -> Course:
    """The course of columns (n, 2, d)."""
    changed = effects.specimen[np.any(columns != 0.0, axis=(1, 2))]
    n = len(columns)
    if len(changed) and (changed == changed[0]).all():
        specimen = int(changed[0])
        tests = effects.tests_of[specimen]
        return Course(n, specimen, tests, columns[tests])
    return Course(n, EVERY, np.arange(n), columns)


def added(courses: Iterable[Course]) -> FloatArray:
    """The columns (n, 2, d) that courses add up to."""
    first, *others = courses
    total = first.columns
    for other in others:
        total = total + other.columns
    return total


def in_batches(columns: Iterable[FloatArray]) -> Iterator[FloatArray]:
    """Columns (n, 2) put together, (n, 2, k), AT_ONCE at a time."""
    rest = iter(columns)
    while batch := list(islice(rest, AT_ONCE)):
        yield np.stack(batch, axis=2)
