"""Scores of all laws of a campaign at once: what each would gain in log likelihood, at a given noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tribo.diagnostics.fit import Linear, ModelFit, whitened
from tribo.diagnostics.model import Setup, log_forces
from tribo.diagnostics.score_statistics import TAKEN_UP, cleared
from tribo.lawsearch.grammar import ADHESION_TERM, LOAD_TERM, Group, Shape, WrittenLaw
from tribo.mechanisms.record import Conditions
from tribo.records import REGIMES, FloatArray

AT_ONCE = 500  # columns
Index = NDArray[np.int64]


@dataclass(frozen=True)
class Courses:
    """The courses of many shapes over the tests of a campaign.

    ``first`` (n, k) are those of each of ``shapes`` (k,); ``second`` (n, w) are the further columns of those at ``two``
    (w,), which are waves. ``cost`` (k,) is what the choice of each costs in log likelihood.
    """

    shapes: tuple[tuple[Shape, ...], ...]
    cost: FloatArray
    first: FloatArray
    second: FloatArray
    two: FloatArray

    @cached_property
    def by_form(self) -> tuple[Index, Index, Index]:
        """The shapes form by form, (k,), in the order in which the forms appear; where each form begins, and how many
        shapes it has, (forms,)."""
        number: dict[object, int] = {}
        forms = [tuple((s.kind, s.column, s.level) for s in each) for each in self.shapes]
        codes = [number.setdefault(form, len(number)) for form in forms]
        count = np.bincount(codes, minlength=len(number))
        return np.argsort(codes, kind="stable"), np.cumsum(count) - count, count

    def column(self, k: int) -> FloatArray:
        """The course of one shape, (n, 1) or (n, 2)."""
        further = self.second[:, self.two == k]
        return np.column_stack([self.first[:, k], further])


def courses_of(priced: Sequence[tuple[tuple[Shape, ...], float]], c: Conditions) -> Courses:
    """The courses of shapes, those that do not vary left out."""
    of_shape: dict[Shape, FloatArray] = {}
    shapes: list[tuple[Shape, ...]] = []
    cost, first, second, two = [], [], [], []
    for shape, price in priced:
        course = np.ones((len(c.sample), 1))
        for s in shape:
            if s not in of_shape:
                of_shape[s] = s.of(c)
            course = course * of_shape[s]
        if np.ptp(course) < 1e-9:
            continue
        if course.shape[1] > 1:
            two.append(len(shapes))
            second.append(course[:, 1])
        shapes.append(shape)
        cost.append(price)
        first.append(course[:, 0])
    n = len(c.sample)
    return Courses(
        tuple(shapes), np.array(cost), np.column_stack(first) if first else np.zeros((n, 0)),
        np.column_stack(second) if second else np.zeros((n, 0)), np.array(two, int),
    )  # fmt: skip


def terms_of(model: ModelFit) -> dict[str, FloatArray]:
    """Share of the load term and of the adhesion term in the modelled T, (n, 2) each."""
    s = model.setup
    base = s.base(model.law)
    load = s.observations.conditions.normal_load_N
    adhesion = np.exp(log_forces(base.forces(np.zeros_like(load))) - log_forces(base.forces(load)))
    return {LOAD_TERM: 1.0 - adhesion, ADHESION_TERM: adhesion}


@dataclass(frozen=True)
class OnSample:
    """How groups of laws act on the ``tests`` (t,) of one sample: each is a ``share`` (groups, b) of a few common
    ``courses`` (b, t, 2)."""

    tests: Index
    share: FloatArray
    courses: FloatArray


@dataclass(frozen=True)
class Acts:
    """By how much every group of laws changes ln T of every test and regime where its course is one, sample by sample:
    within a sample the groups differ by regime and by the term of T alone, so that few courses make up all of them.

    A specimen belongs to one part.
    """

    parts: tuple[OnSample, ...]


def acts_of(groups: Sequence[Group], s: Setup, terms: Mapping[str, FloatArray]) -> Acts:
    """How these groups act; ``terms`` as of :func:`terms_of`."""
    c, specimen = s.observations.conditions, s.random_effects.specimen
    each = np.stack([acts_of_one(group, c, terms) for group in groups])
    first = [int(tests[0]) if len(tests) else 0 for tests in s.random_effects.tests_of]
    sample = c.sample[first][specimen]
    return Acts(tuple(_on_sample(np.flatnonzero(sample == name), each) for name in np.unique(sample)))


def acts_of_one(group: Group, c: Conditions, terms: Mapping[str, FloatArray]) -> FloatArray:
    """By how much laws of a group change ln T of every test and regime where their course is one, (n, 2)."""
    acts = terms.get(group.acts_on, np.ones((len(c.sample), 2)))
    in_regime = np.array([group.regime != REGIMES[1], group.regime != REGIMES[0]])
    return np.asarray(acts * in_regime * group.law(()).weight(c)[:, None])


def _on_sample(tests: Index, acts: FloatArray) -> OnSample:
    flat = acts[:, tests].reshape(len(acts), -1)
    share, size, courses = np.linalg.svd(flat, full_matrices=False)
    kept = size > 1e-10 * size[0]
    kept[0] = True  # also where no group acts on this sample
    return OnSample(tests, share[:, kept] * size[kept], courses[kept].reshape(-1, len(tests), 2))


class Projection:
    """A campaign linear about a fit, ready to score columns beyond the model's own.

    Parameters
    ----------
    linear : Linear
        The model with the noise and weights at which columns are scored.
    residual : array (r, n, 2)
        ln T less the model, of the campaign itself or of campaigns with the same noise.
    """

    def __init__(self, linear: Linear, residual: FloatArray) -> None:
        self.factor = linear.factor * np.sqrt(linear.weight)[:, None, None]
        self.n = len(linear.residual)
        self.specimen = linear.random_effects.specimen
        self.own, self.border = self._bases(linear)
        right = whitened(self.factor, residual.transpose(1, 2, 0))
        self.left = right - self._taken(right)  # (2n, r)

    def _bases(self, linear: Linear) -> tuple[FloatArray, FloatArray]:
        """Columns whose products with a whitened column are what the model absorbs: of the specimens (2n, 4), each for
        its own tests, and those that tests share (2n, m)."""
        found = cleared(linear.normal, linear.right)
        specimen = np.tile(self.specimen, 2)
        white = whitened(self.factor, linear.columns.own)
        own = (found.own[0, specimen] @ white[:, :, None])[:, :, 0]
        taken = (own[:, None] @ found.across[0, specimen])[:, 0]
        return own, (whitened(self.factor, linear.columns.border) - taken) @ found.border[0].T

    def _absorbed(self, white: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Products of whitened columns (2n, k) with those of the specimens (S, 4, k) and the shared ones (m, k)."""
        own = np.zeros((int(self.specimen.max()) + 1, 4, white.shape[1]))
        np.add.at(own, np.tile(self.specimen, 2), self.own[:, :, None] * white[:, None])
        return own, self.border.T @ white

    def _taken(self, white: FloatArray) -> FloatArray:
        """What the model absorbs of whitened columns, (2n, k)."""
        own, border = self._absorbed(white)
        return np.einsum("na,nak->nk", self.own, own[np.tile(self.specimen, 2)]) + self.border @ border

    def gains(self, courses: Courses, acts: Acts) -> FloatArray:
        """Log likelihood gained by each course in each group at its best amplitude, (r, groups, k)."""
        own, pull = self.products(courses.first, acts)
        found = 0.5 * pull**2 / own
        if len(courses.two):
            first = own[:, courses.two], pull[:, :, courses.two]
            found[:, :, courses.two] = self._of_waves(courses, first, acts)
        return found

    def products(self, columns: FloatArray, acts: Acts) -> tuple[FloatArray, FloatArray]:
        """Information (groups, k), inf where nothing is left, and pull (r, groups, k) of columns (n, k)."""
        parts = [self._some(columns[:, k : k + AT_ONCE], acts) for k in range(0, columns.shape[1], AT_ONCE)]
        whole, own, pull = (np.concatenate(each, axis=-1) for each in zip(*parts, strict=True))
        return np.where(own > TAKEN_UP * whole + 1e-12, own, np.inf), pull

    def _some(self, columns: FloatArray, acts: Acts) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Information before (groups, k) and after what the model absorbs, and pull, (r, groups, k)."""
        shared = np.concatenate([self.border, self.left], axis=1)
        m, k, groups = self.border.shape[1], columns.shape[1], len(acts.parts[0].share)
        whole, own = np.zeros((groups, k)), np.zeros((groups, k))
        rows = []
        for part in acts.parts:
            white, here = self._whitened(part), columns[part.tests]
            square = np.einsum("bit,cit->bct", white, white).reshape(-1, len(part.tests)) @ here**2
            taken = self._of_specimens(part, white, here)
            twice = (part.share[:, :, None] * part.share[:, None]).reshape(groups, -1)
            whole += twice @ square
            own += twice @ (square - taken)
            both = shared.reshape(2, self.n, -1)[:, part.tests]
            beside = np.einsum("bit,itm->bmt", white, both).reshape(-1, len(part.tests)) @ here
            rows.append(beside.reshape(len(white), -1))
        share = np.concatenate([part.share for part in acts.parts], axis=1)
        found = (share @ np.concatenate(rows)).reshape(groups, -1, k)
        own -= np.einsum("gmk,gmk->gk", found[:, :m], found[:, :m])
        return whole, own, found[:, m:].transpose(1, 0, 2)

    def _whitened(self, part: OnSample) -> FloatArray:
        """The common courses of a sample in units of the noise, (b, 2, t)."""
        factor, courses = self.factor[part.tests], part.courses
        static = factor[:, 0, 0] * courses[:, :, 0]
        return np.stack([static, factor[:, 1, 0] * courses[:, :, 0] + factor[:, 1, 1] * courses[:, :, 1]], axis=1)

    def _of_specimens(self, part: OnSample, white: FloatArray, columns: FloatArray) -> FloatArray:
        """Products of what the specimens of a sample absorb of columns (t, k) times each two of its courses,
        (b b, k)."""
        own, found = self.own.reshape(2, self.n, 4)[:, part.tests], 0.0
        b, k = len(white), columns.shape[1]
        for specimen in np.unique(self.specimen[part.tests]):
            here = np.flatnonzero(self.specimen[part.tests] == specimen)
            rows = np.einsum("bit,ita->bat", white[:, :, here], own[:, here]).reshape(4 * b, -1)
            taken = (rows @ columns[here]).reshape(b, 4, k)
            found = found + np.einsum("bak,cak->bck", taken, taken)
        return np.asarray(found).reshape(b * b, k)

    def joint_gain(self, columns: FloatArray) -> float:
        """Log likelihood gained by columns (n, 2, k) together at their best amplitudes."""
        white = whitened(self.factor, columns)
        pull, own = self.left[:, 0] @ white, white.T @ (white - self._taken(white))
        return float(0.5 * pull @ np.linalg.lstsq(own, pull, rcond=1e-9)[0])

    def _of_waves(self, courses: Courses, first: tuple[FloatArray, FloatArray], acts: Acts) -> FloatArray:
        """Of shapes of two columns; the second amplitude costs one unit."""
        (own1, pull1), (own2, pull2) = first, self.products(courses.second, acts)
        both, _ = self.products(courses.first[:, courses.two] + courses.second, acts)
        with np.errstate(invalid="ignore"):
            mixed = 0.5 * (both - own1 - own2)
            determinant = own1 * own2 - mixed**2
            found = 0.5 * (own2 * pull1**2 - 2 * mixed * pull1 * pull2 + own1 * pull2**2) / determinant
        single = np.maximum(0.5 * pull1**2 / own1, 0.5 * pull2**2 / own2)
        good = np.isfinite(determinant) & (determinant > 1e-6 * np.abs(own1 * own2))
        return np.where(good, found, single) - 1.0


@dataclass(frozen=True)
class Scored:
    """One law by its score: log likelihood gained, and what is left of it after paying for the choice."""

    law: WrittenLaw
    gain: float
    net: float
