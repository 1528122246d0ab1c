"""A campaign of a virtual laboratory: what is hidden acts first, then specimens, nuisance and chance.

All draws follow from one seed, each kind from a stream of its own, so that the same seed with nothing hidden is the
campaign to compare with.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
from blind.bench import Bench

from .laboratory import Laboratory, table
from .nuisance import Nuisance, course_of, realised
from .odd_shapes import Course, of_samples, pattern_deviations, repeat_deviations, specimen_deviations

Hide = Callable[["LaboratoryBench", np.random.Generator], dict[str, Any]]
TABLE, LAW, PATTERNS, HIDDEN, SPECIMENS, NUISANCE, REPEATS = range(2, 9)  # streams of random numbers


@dataclass
class LaboratoryBench(Bench):
    """A bench whose patterns deviate from the engine by courses of any shape in the load."""

    deviations: Mapping[str, Course] = field(default_factory=dict)

    def forces(self, load: np.ndarray, samples: list[str]) -> np.ndarray:
        return super().forces(load, samples) * np.exp(of_samples(self.deviations, samples, load))


@dataclass(frozen=True)
class Made:
    """A finished campaign: its bench, the hidden ``change`` of ln T (n, 2), each nuisance (n, 2), and the truth."""

    bench: LaboratoryBench
    laboratory: Laboratory
    change: np.ndarray
    nuisance: Mapping[str, np.ndarray]
    truth: Mapping[str, Any]


def stream(seed: int, number: int) -> np.random.Generator:
    return np.random.default_rng([seed, number])


def bare_bench(seed: int, laboratory: Laboratory) -> LaboratoryBench:
    """The forces of flat law and patterns alone, before anything scatters."""
    law = stream(seed, LAW)
    flat = (law.uniform(4, 5.5), law.uniform(18, 28), law.uniform(2.5, 3.5), law.uniform(9, 13))
    tests = table(laboratory, stream(seed, TABLE))
    return LaboratoryBench(tests, flat, {}, deviations=pattern_deviations(laboratory, stream(seed, PATTERNS)))


def make(
    seed: int, laboratory: Laboratory, nuisance: Sequence[Nuisance] = (), hide: Hide | None = None
) -> Made:
    """A campaign with this nuisance and with what ``hide`` does to its bench; ``hide`` returns the truth about it."""
    bench = bare_bench(seed, laboratory)
    before = np.log(both(bench))
    hidden = {} if hide is None else hide(bench, stream(seed, HIDDEN))
    change = np.log(both(bench)) - before
    rng = stream(seed, NUISANCE)
    courses = {one.kind: course_of(one, bench.tests, rng) for one in nuisance}
    scatter = specimen_deviations(laboratory, bench.tests, stream(seed, SPECIMENS))
    scatter = scatter + repeat_deviations(laboratory, bench.tests, stream(seed, REPEATS))
    multiply(bench, scatter + sum(courses.values(), np.zeros_like(change)))
    truth = {**hidden, "nuisance": realised(courses), "forms": {one.kind: one.form for one in nuisance}}
    return Made(bench, laboratory, change, courses, truth)


def both(bench: Bench) -> np.ndarray:
    """Static and sliding forces, (n, 2)."""
    return np.column_stack([bench.static, bench.sliding])


def multiply(bench: Bench, log_gain: np.ndarray) -> None:
    bench.static, bench.sliding = (both(bench) * np.exp(log_gain)).T


def rms_percent(change: np.ndarray, tests: pd.DataFrame, regimes: tuple[int, ...] = (0, 1)) -> float:
    """Root mean square of a change of ln T where it acts, in percent."""
    own = change[:, list(regimes)]
    here = (own != 0).any(axis=1)
    return round(100 * float(np.sqrt(np.mean(own[here] ** 2))), 4) if here.any() else 0.0
