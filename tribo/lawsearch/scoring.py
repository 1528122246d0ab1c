"""Scores of all laws of a campaign at once: what each would gain in log likelihood, at a given noise."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tribo.diagnostics.fit import ModelFit, whitened
from tribo.diagnostics.model import Setup, log_forces
from tribo.diagnostics.normal_equations import block_cholesky
from tribo.diagnostics.replicates import Replicates
from tribo.diagnostics.score_statistics import TAKEN_UP, scores, terms_in
from tribo.lawsearch.grammar import (
    ADHESION_TERM,
    LOAD_TERM,
    Shape,
    WrittenLaw,
    corrects_a_pattern,
    scopes_of,
    shapes_of,
)
from tribo.mechanisms.record import Conditions
from tribo.records import REGIMES, FloatArray

COLUMNS_AT_ONCE = 500
Index = NDArray[np.int64]
# How scopes act, sample by sample: its tests (t,), and of each scope the share (scopes, b) of a few common courses
# (b, t, 2). Within a sample scopes differ by regime and by the term of T alone, so that few courses make up all.
Acts = tuple[tuple[Index, FloatArray, FloatArray], ...]


class Courses:
    """The courses of many shapes over the tests of a campaign, those that do not vary left out.

    Attributes
    ----------
    shapes : tuple of k tuples of Shape
    cost : array (k,)
        What the choice of each costs in log likelihood.
    first : array (n, k)
        Their courses; of waves the first of two columns.
    second : array (n, w)
        The second columns of those at ``two`` (w,).
    """

    def __init__(self, priced: Sequence[tuple[tuple[Shape, ...], float]], c: Conditions) -> None:
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
        none = np.zeros((len(c.sample), 0))
        self.shapes, self.cost, self.two = tuple(shapes), np.array(cost), np.array(two, int)
        self.first = np.column_stack(first) if first else none
        self.second = np.column_stack(second) if second else none

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


def terms_of(model: ModelFit) -> dict[str, FloatArray]:
    """Share of the load term and of the adhesion term in the modelled T, (n, 2) each."""
    s = model.setup
    base = s.base(model.law)
    load = s.observations.conditions.normal_load_N
    adhesion = np.exp(log_forces(base.forces(np.zeros_like(load))) - log_forces(base.forces(load)))
    return {LOAD_TERM: 1.0 - adhesion, ADHESION_TERM: adhesion}


def effects_of(scopes: Sequence[WrittenLaw], c: Conditions, terms: Mapping[str, FloatArray]) -> FloatArray:
    """By how much laws of these scopes change ln T of every test and regime where their course is one, (scopes, n, 2);
    ``terms`` as of :func:`terms_of`."""
    found = []
    for scope in scopes:
        on_term = terms.get(scope.acts_on, np.ones((len(c.sample), 2)))
        in_regime = np.array([scope.regime != REGIMES[1], scope.regime != REGIMES[0]])
        found.append(on_term * in_regime * scope.weight(c)[:, None])
    return np.stack(found)


def acts_of(effects: FloatArray, s: Setup) -> Acts:
    """The same effects sample by sample. A specimen belongs to one part."""
    c, specimen = s.observations.conditions, s.specimen
    first = [int(tests[0]) if len(tests) else 0 for tests in s.tests_of]
    sample = c.sample[first][specimen]
    parts = []
    for name in np.unique(sample):
        tests = np.flatnonzero(sample == name)
        share, size, courses = np.linalg.svd(effects[:, tests].reshape(len(effects), -1), full_matrices=False)
        kept = size > 1e-10 * size[0]
        kept[0] = True  # also where no scope acts on this sample
        parts.append((tests, share[:, kept] * size[kept], courses[kept].reshape(-1, len(tests), 2)))
    return tuple(parts)


class Projection:
    """A campaign linear about a fit, ready to score columns beyond the model's own.

    Parameters
    ----------
    model : ModelFit
        With the noise and weights at which columns are scored.
    residual : array (r, n, 2)
        ln T less the model, of the campaign itself or of campaigns with the same noise.

    Attributes
    ----------
    own : array (2n, 4)
    border : array (2n, m)
        Columns whose products with a whitened column are what the model absorbs: of the specimens, each for its own
        tests, and those that tests share.
    right, left : array (2n, r)
        The whitened residual, and what the model does not absorb of it.
    """

    def __init__(self, model: ModelFit, residual: FloatArray) -> None:
        self.factor = model.factor * np.sqrt(model.weight)[:, None, None]
        self.n = len(model.residual)
        self.specimen = model.setup.specimen
        absorbed = block_cholesky(model.normal, model.right)
        specimen = np.tile(self.specimen, 2)
        white = whitened(self.factor, model.columns.own)
        self.own = (absorbed.own[0, specimen] @ white[:, :, None])[:, :, 0]
        taken = (self.own[:, None] @ absorbed.across[0, specimen])[:, 0]
        self.border = (whitened(self.factor, model.columns.border) - taken) @ absorbed.border[0].T
        self.right = whitened(self.factor, residual.transpose(1, 2, 0))
        self.left = self.right - self._taken(self.right)

    def _taken(self, white: FloatArray) -> FloatArray:
        """What the model absorbs of whitened columns, (2n, k)."""
        specimen = np.tile(self.specimen, 2)
        own = np.zeros((int(self.specimen.max()) + 1, self.own.shape[1], white.shape[1]))
        np.add.at(own, specimen, self.own[:, :, None] * white[:, None])
        return np.einsum("na,nak->nk", self.own, own[specimen]) + self.border @ (self.border.T @ white)

    def gains(self, courses: Courses, acts: Acts) -> FloatArray:
        """Log likelihood gained by each course in each scope at its best amplitude, (r, scopes, k); the second
        amplitude of a wave costs one unit."""
        return np.concatenate([found for _, found in self.gains_in_parts(courses, acts)], axis=2)

    def gains_in_parts(self, courses: Courses, acts: Acts) -> Iterator[tuple[slice, FloatArray]]:
        """The same in parts, so that not all gains of many campaigns are held at once: which courses, and their
        gains."""
        for start in range(0, courses.first.shape[1], COLUMNS_AT_ONCE):
            part = slice(start, start + COLUMNS_AT_ONCE)
            own, pull = self.products(courses.first[:, part], acts)
            found = 0.5 * pull**2 / own
            waves = np.flatnonzero((courses.two >= part.start) & (courses.two < part.stop))
            if len(waves):
                two = courses.two[waves] - start
                both = courses.first[:, courses.two[waves]] + courses.second[:, waves]
                own1, pull1 = own[:, two], pull[:, :, two]
                own2, pull2 = self.products(courses.second[:, waves], acts)
                with np.errstate(invalid="ignore"):
                    mixed = 0.5 * (self.products(both, acts)[0] - own1 - own2)
                    determinant = own1 * own2 - mixed**2
                    together = 0.5 * (own2 * pull1**2 - 2 * mixed * pull1 * pull2 + own1 * pull2**2) / determinant
                single = np.maximum(0.5 * pull1**2 / own1, 0.5 * pull2**2 / own2)
                good = np.isfinite(determinant) & (determinant > 1e-6 * np.abs(own1 * own2))
                found[:, :, two] = np.where(good, together, single) - 1.0
            yield part, found

    def products(self, columns: FloatArray, acts: Acts) -> tuple[FloatArray, FloatArray]:
        """Information (scopes, k), inf where nothing is left, and pull (r, scopes, k) of columns (n, k)."""
        starts = range(0, columns.shape[1], COLUMNS_AT_ONCE)
        parts = [self._products(columns[:, k : k + COLUMNS_AT_ONCE], acts) for k in starts]
        whole, own, pull = (np.concatenate(each, axis=-1) for each in zip(*parts, strict=True))
        return np.where(own > TAKEN_UP * whole + 1e-12, own, np.inf), pull

    def _products(self, columns: FloatArray, acts: Acts) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Information before (scopes, k) and after what the model absorbs, and pull, (r, scopes, k)."""
        shared = np.concatenate([self.border, self.left], axis=1)
        m, k, scopes = self.border.shape[1], columns.shape[1], len(acts[0][1])
        whole, own = np.zeros((scopes, k)), np.zeros((scopes, k))
        rows = []
        for tests, share, courses in acts:
            factor, here = self.factor[tests], columns[tests]
            static = factor[:, 0, 0] * courses[:, :, 0]
            sliding = factor[:, 1, 0] * courses[:, :, 0] + factor[:, 1, 1] * courses[:, :, 1]
            white = np.stack([static, sliding], axis=1)  # (b, 2, t)
            square = np.einsum("bit,cit->bct", white, white).reshape(-1, len(tests)) @ here**2
            taken = self._taken_by_specimens(tests, white, here)
            twice = (share[:, :, None] * share[:, None]).reshape(scopes, -1)
            whole += twice @ square
            own += twice @ (square - taken)
            both = shared.reshape(2, self.n, -1)[:, tests]
            beside = np.einsum("bit,itm->bmt", white, both).reshape(-1, len(tests)) @ here
            rows.append(beside.reshape(len(white), -1))
        shares = np.concatenate([share for _, share, _ in acts], axis=1)
        found = (shares @ np.concatenate(rows)).reshape(scopes, -1, k)
        own -= np.einsum("gmk,gmk->gk", found[:, :m], found[:, :m])
        return whole, own, found[:, m:].transpose(1, 0, 2)

    def _taken_by_specimens(self, tests: Index, white: FloatArray, columns: FloatArray) -> FloatArray:
        """Products of what the specimens of a sample absorb of columns (t, k) times each two of its courses,
        (b b, k)."""
        own, found = self.own.reshape(2, self.n, -1)[:, tests], 0.0
        b, k = len(white), columns.shape[1]
        for specimen in np.unique(self.specimen[tests]):
            here = np.flatnonzero(self.specimen[tests] == specimen)
            rows = np.einsum("bit,ita->bat", white[:, :, here], own[:, here]).reshape(own.shape[2] * b, -1)
            taken = (rows @ columns[here]).reshape(b, own.shape[2], k)
            found = found + np.einsum("bak,cak->bck", taken, taken)
        return np.asarray(found).reshape(b * b, k)

    def joint_gain(self, columns: FloatArray) -> float:
        """Log likelihood gained by columns (n, 2, k) together at their best amplitudes."""
        white = whitened(self.factor, columns)
        pull, own = self.left[:, 0] @ white, white.T @ (white - self._taken(white))
        return float(0.5 * pull @ np.linalg.lstsq(own, pull, rcond=1e-9)[0])


class Grammar:
    """All laws of a campaign: every one of the scopes with every one of the courses.

    ``scope_cost`` (scopes,) is what the choice of each costs in log likelihood, ``effects`` (scopes, n, 2) how it acts.
    A law has an index: that of its scope times the number of courses, plus that of its course.

    Parameters
    ----------
    model : ModelFit
        The fitted campaign.
    without : collection of str
        Columns that are left out.
    shapes : list of (shapes, cost), optional
        These alone in place of all that the campaign allows.

    Attributes
    ----------
    without : collection of str
        Columns that are left out.
    """

    def __init__(
        self,
        model: ModelFit,
        without: Collection[str] = (),
        shapes: Sequence[tuple[tuple[Shape, ...], float]] | None = None,
    ) -> None:
        c, self.without = model.setup.observations.conditions, without
        self.courses = Courses(shapes_of(c, without) if shapes is None else shapes, c)
        self.scopes, self.scope_cost = scopes_of(c)
        self.effects = effects_of(self.scopes, c, terms_of(model))
        self.acts = acts_of(self.effects, model.setup)

    @property
    def size(self) -> int:
        return len(self.scopes) * len(self.courses.shapes)

    def best(self, projected: Projection, n: int) -> list[Index]:
        """The n laws that gain most less their cost in each campaign, in no order."""
        values, found = np.empty((0, 0)), np.empty((0, 0), np.int64)
        own = corrects_a_pattern(self.scopes, self.courses.shapes)
        for part, gains in projected.gains_in_parts(self.courses, self.acts):
            net = np.where(own[:, part], -np.inf, gains - self.courses.cost[part] - self.scope_cost[:, None])
            scope, shape = np.divmod(np.arange(net[0].size), net.shape[2])
            index = np.broadcast_to(scope * len(self.courses.shapes) + part.start + shape, (len(net), net[0].size))
            values = np.concatenate([values.reshape(len(net), -1), net.reshape(len(net), -1)], axis=1)
            found = np.concatenate([found.reshape(len(net), -1), index], axis=1)
            if values.shape[1] > n:
                kept = np.argpartition(-values, n - 1, axis=1)[:, :n]
                values, found = np.take_along_axis(values, kept, 1), np.take_along_axis(found, kept, 1)
        return list(found)

    def law(self, index: int) -> WrittenLaw:
        scope, shape = divmod(int(index), len(self.courses.shapes))
        return replace(self.scopes[scope], shapes=self.courses.shapes[shape])

    def cost(self, index: Index) -> FloatArray:
        scope, shape = np.divmod(index, len(self.courses.shapes))
        return np.asarray(self.courses.cost[shape] + self.scope_cost[scope])

    def gains(self, fitted: Replicates, index: Index) -> FloatArray:
        """Log likelihood that the laws at ``index`` gain at the noise of a campaign, (r, laws)."""
        columns, spans, at = [], [], 0
        for scope, shape in zip(*np.divmod(index, len(self.courses.shapes)), strict=True):
            column = self.courses.column(int(shape))[:, None, :] * self.effects[scope][:, :, None]
            columns.append(column)
            spans.append(slice(at, at + column.shape[2]))
            at += column.shape[2]
        freedom = np.array([span.stop - span.start for span in spans])
        return 0.5 * scores(fitted, terms_in(np.concatenate(columns, axis=2), spans))[0] - (freedom - 1.0)
