"""Laws of no known form: the curve of one column and the surface of two that a campaign speaks for most.

A surface is a Gaussian process over two columns, a course of each and what they do together (an analysis of variance in
functions: Durrande, Ginsbourger and Roustant, J. Multivariate Anal. 115, 57, 2013), or a product of two curves or a
tree of steps, which have far fewer numbers. What a campaign says for one is its marginal likelihood, averaged over
sizes, short lengths and long ones, less what the choice of the columns and of the scope costs; what chance gives the
best of all is seen in campaigns that the model makes itself.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import combinations

import numpy as np
from scipy.special import logsumexp

from tribo.diagnostics.fit import ModelFit
from tribo.lawsearch.free_curves import (
    SIZES,
    Trees,
    at_knots,
    curve_of,
    each_with_each,
    kernels,
    knots_of,
    likeliest_products,
)
from tribo.lawsearch.grammar import ALIKE, ALL, OF_SERIES, UNITS, WrittenLaw, scopes_of
from tribo.lawsearch.scoring import Projection, effects_of, terms_of
from tribo.mechanisms.record import Conditions
from tribo.records import FloatArray

MOST_COLUMNS = 12  # of which every two may have a surface; the columns with a meaning of their own come first
NOISES = np.array([1.0, 0.85, 0.7, 0.55, 0.4, 0.25, 0.15])  # variance that a law leaves where it acts, of that before
DIRECTIONS = {1: 24, 2: 6}  # principal courses of each column of a curve, and of a surface
LOOKED_INTO = 12  # surfaces of a campaign that are weighed as products of two curves and as trees as well
FEW_NOISES, FEW_SIZES = NOISES[::2], SIZES[1::2]  # of products and trees
OF_FEW = np.tile(FEW_SIZES, len(FEW_NOISES)), np.repeat(FEW_NOISES, len(FEW_SIZES))  # every size at every noise
KEPT = 100  # surfaces whose trees are kept in memory
OUTLIER = 0.3  # weight of a test about five standard deviations off, beyond which it counts no more
WHOLLY = 1e-6  # of the variance of a number, what is left at most where the model absorbs it
LEAST = 0.1  # of the square that is expected, in proportion to which a law leaves noise


class FreeSearch:
    """All curves and surfaces of a campaign, each in every scope of a list, ready to be scored.

    Parameters
    ----------
    model : ModelFit
        The fitted campaign.
    scopes : sequence of WrittenLaw
        What they act on, in which regime and where.
    cost : array (scopes,)
        What the choice of each costs in log likelihood.
    columns : sequence of tuples of str
        The column of each curve, the two of each surface.
    """

    def __init__(
        self, model: ModelFit, scopes: Sequence[WrittenLaw], cost: FloatArray, columns: Sequence[tuple[str, ...]]
    ) -> None:
        c = model.setup.observations.conditions
        self.model = model = without_outliers(model)
        self.scopes, self.columns = tuple(scopes), tuple(columns)
        names = {name for each in columns for name in each}
        beside = max(len(names) - 1, 1)
        self.cost = np.array([np.log(beside) if len(each) > 1 else 0.0 for each in columns])[:, None] + cost
        self.courses, self.sides = _principal_courses(c, columns)
        shapes = {name: knots_of(name, c) for each in columns if len(each) > 1 for name in each}
        self.at = {name: at_knots((shape,), c) for name, shape in shapes.items() if shape is not None}
        self.trees: dict[tuple[int, int], Trees] = {}
        self.projected = Projection(self.model, model.residual[None])
        effects = effects_of(scopes, c, terms_of(model))
        factor = self.projected.factor
        # of every scope, what multiplies a course in the whitened rows, static and sliding (scopes, 2, n)
        rows = np.stack(
            [factor[:, 0, 0] * effects[:, :, 0],
             factor[:, 1, 0] * effects[:, :, 0] + factor[:, 1, 1] * effects[:, :, 1]], axis=1,
        )  # fmt: skip
        # the direction of both numbers of a test in which a law moves them, and by how much a course does (scopes, n)
        self.size = np.linalg.norm(rows, axis=1)
        self.moved = self.size > 0.0
        self.towards = rows / np.where(self.moved, self.size, 1.0)[:, None]
        p = self.projected
        # expected square of what the model does not absorb of both numbers of every test, (n,)
        self.not_absorbed = (1.0 - np.sum(p.own**2, axis=1) - np.sum(p.border**2, axis=1)).reshape(2, -1).sum(axis=0)
        self.absorbed = [self._absorbed(g) for g in range(len(scopes))]
        self.left_along = [_whitening(absorbed) for absorbed in self.absorbed]
        self.spectra = [self._spectra(g) for g in range(len(scopes))]

    def _absorbed(self, g: int) -> FloatArray:
        """Of the tests that a scope moves, along the direction in which it does, the columns (k, tests) of what the
        model absorbs."""
        p, n = self.projected, self.projected.n
        border = np.einsum("in,inm->mn", self.towards[g], p.border.reshape(2, n, -1))
        specimens = int(p.specimen.max()) + 1
        own = np.zeros((specimens, p.own.shape[1], n))
        own[p.specimen, :, np.arange(n)] = np.einsum("in,ina->na", self.towards[g], p.own.reshape(2, n, -1))
        return np.concatenate([border, own.reshape(-1, n)])[:, self.moved[g]]

    def _information(self, g: int, courses: FloatArray) -> FloatArray:
        """That of courses (n, k) in one scope, (k, k)."""
        here = (self.size[g][:, None] * courses)[self.moved[g]]
        taken = self.absorbed[g] @ here
        return np.asarray(here.T @ here - taken.T @ taken)

    def _spectra(self, g: int) -> list[list[tuple[FloatArray, FloatArray]]]:
        """Of each curve and surface in one scope, of short lengths and of long ones, the information along its
        principal directions (k,), and these directions (k, k) in its courses."""

        def along_directions(course: FloatArray) -> tuple[FloatArray, FloatArray]:
            along, directions = np.linalg.eigh(self._information(g, course))
            return np.maximum(along, 0.0), directions

        return [[along_directions(course) for course in courses] for courses in self.courses]

    def _trees(self, f: int, g: int) -> Trees:
        """All trees of a surface in one scope."""
        if (f, g) not in self.trees:
            one, other = (self.at[name] for name in self.columns[f])
            sides = one.shape[1], other.shape[1]
            if len(self.trees) == KEPT:
                self.trees.pop(next(iter(self.trees)))
            self.trees[f, g] = Trees(self._information(g, each_with_each(one, other)).reshape(*sides, *sides))
        return self.trees[f, g]

    @cached_property
    def measured(self) -> FloatArray:
        """The evidence of every curve and surface in the campaign itself, (columns, scopes)."""
        return np.asarray(self.evidence(self.model.residual[None])[0])

    def evidence(self, residual: FloatArray) -> FloatArray:
        """Log marginal likelihood of every curve and surface over none, less what its choice costs, for residuals
        (r, n, 2) of ln T, (r, columns, scopes).

        What a law explains is not noise: each is judged at the noise that it leaves, in proportion to what the model
        leaves unabsorbed on the samples where it acts. It leaves less of both numbers of a test, or less only in the
        direction in which it acts: what is found is the mean over both.
        """
        projected = Projection(self.model, residual)
        left = projected.left.reshape(2, projected.n, -1)
        beyond = np.maximum(self.moved @ np.sum(left**2, axis=0) / (self.moved @ self.not_absorbed)[:, None], LEAST)
        ratio = np.empty(beyond.shape)
        found = np.empty((left.shape[2], len(self.columns), len(self.scopes)))
        for g, spectra in enumerate(self.spectra):
            along = np.einsum("in,inr->nr", self.towards[g], left)
            mean = np.mean((self.left_along[g] @ along[self.moved[g]]) ** 2, axis=0)
            ratio[g] = np.maximum(mean, LEAST) / beyond[g]
            pull, price = self.size[g][:, None] * along, _price_of_noise(NOISES, ratio[g], self._numbers(g))
            for f, (courses, short_and_long) in enumerate(zip(self.courses, spectra, strict=True)):
                each = [
                    _evidence(along, (directions.T @ (course.T @ pull)) ** 2 / beyond[g], price)
                    for course, (along, directions) in zip(courses, short_and_long, strict=True)
                ]
                found[:, f, g] = np.logaddexp.reduce(each) - np.log(len(each))
        found -= self.cost
        surfaces = [f for f, each in enumerate(self.columns) if len(each) > 1]
        if surfaces:
            self._look_into(found, surfaces, left, beyond, ratio)
        return found

    def _numbers(self, g: int) -> tuple[float, float]:
        """How many numbers tell of the noise that a law leaves: both of all tests that it moves, and one of each."""
        return 2.0 * float(self.moved[g].sum()), float(len(self.left_along[g]))

    def _look_into(
        self, found: FloatArray, surfaces: Sequence[int], left: FloatArray, beyond: FloatArray, ratio: FloatArray
    ) -> None:
        """Of each campaign, average the evidence ``found`` of its likeliest surfaces with that of a product of two
        curves and that of a tree; the other surfaces are taken to say nothing of either.

        Every two columns come with their likeliest scope first, so that none is left out for another one's scopes.
        """
        order = np.argsort(-found[:, surfaces], axis=2)[:, :, :LOOKED_INTO]
        value = np.take_along_axis(found[:, surfaces], order, axis=2)
        rank = np.broadcast_to(np.arange(order.shape[2]), order.shape[1:])
        found[:, surfaces] -= np.log(3.0)
        for r in range(len(found)):
            first = np.lexsort((-value[r].ravel(), rank.ravel()))[:LOOKED_INTO]
            for s, g in zip(first // order.shape[2], order[r].ravel()[first], strict=True):
                f = surfaces[s]
                along = np.einsum("in,in->n", self.towards[g], left[:, :, r])
                pull = self.size[g] * along / np.sqrt(beyond[g, r])
                price = _price_of_noise(FEW_NOISES, ratio[g, [r]], self._numbers(int(g)))
                products = [
                    _evidence_of_product(course.T @ pull, along, directions, self.sides[f], price)
                    for course, (along, directions) in zip(self.courses[f], self.spectra[g][f], strict=True)
                ]
                product = np.logaddexp.reduce(products) - np.log(len(products))
                one, other = (self.at[name] for name in self.columns[f])
                tree = _evidence_of_tree(self._trees(f, int(g)), one.T @ (pull[:, None] * other), price)
                further = np.logaddexp(product, tree) - np.log(3.0) - self.cost[f, g]
                found[r, f, g] = np.logaddexp(found[r, f, g], further)


def _whitening(absorbed: FloatArray) -> FloatArray:
    """What makes of the numbers of tests, of which the model absorbs the columns (k, tests), as many independent ones
    of a variance of one as are left, (left, tests)."""
    variance, directions = np.linalg.eigh(np.eye(absorbed.shape[1]) - absorbed.T @ absorbed)
    kept = variance > WHOLLY
    return np.asarray((directions[:, kept] / np.sqrt(variance[kept])).T)


def without_outliers(model: ModelFit) -> ModelFit:
    """The same model with every test counting alike, those that lie far off moved towards it.

    Without a law, the tests where it does most lie far off too: they count in full up to ``OUTLIER``. Campaigns that
    the model makes itself draw from these tests, so that chance has no more outliers than the campaign.
    """
    near = np.minimum(model.weight / OUTLIER, 1.0)
    residual = model.residual - (1.0 - near)[:, None] * model.left
    return replace(model, weight=np.ones(len(near)), residual=residual)


def _price_of_noise(noises: FloatArray, ratio: FloatArray, numbers: tuple[float, float]) -> FloatArray:
    """What it costs in log likelihood that a law leaves so much noise, (2, noises, r): in both numbers of the tests,
    and in one of each, whose noise without the law is ``ratio`` (r,) of that of both."""
    share = np.stack([np.ones(len(ratio)), ratio])[:, None, :] / noises[:, None]
    return np.asarray(0.5 * np.array(numbers)[:, None, None] * (share - 1.0 - np.log(share)))


def _evidence(along: FloatArray, pulls: FloatArray, price: FloatArray) -> FloatArray:
    """Log marginal likelihood (r,) from the information along (k,) and the squared pulls (k, r), with the ``price``
    (2, noises, r) of noise: averaged over sizes, at the likeliest noise."""
    noise = np.repeat(NOISES, len(SIZES))
    variance = np.tile(SIZES**2, len(NOISES))
    informed = 1.0 + (variance / noise)[:, None] * along  # (noises sizes, k)
    explained = (variance / noise**2)[:, None] / informed @ pulls
    each = 0.5 * (explained - np.sum(np.log(informed), axis=1)[:, None])
    return _at_likeliest_noise(each.reshape(len(NOISES), len(SIZES), -1), price)


def _at_likeliest_noise(each: FloatArray, price: FloatArray) -> FloatArray:
    """Of log likelihoods (noises, sizes, r) the mean over sizes at the likeliest noise, (r,)."""
    best = each.max(axis=1, keepdims=True)
    mean = best[:, 0] + np.log(np.mean(np.exp(each - best), axis=1))
    return np.asarray(np.logaddexp.reduce((mean - price).max(axis=1)) - np.log(len(price)))


def _evidence_of_product(
    pull: FloatArray, along: FloatArray, directions: FloatArray, sides: tuple[int, ...], price: FloatArray
) -> float:
    """The same for a product of two curves of ``sides`` courses each, of the pulls (k,) of the courses of a surface and
    the information along its principal directions."""
    k = math.prod(sides)
    information, pulls = np.zeros((k, k)), np.zeros(k)
    information[1:, 1:], pulls[1:] = (directions * along) @ directions.T, pull
    told = likeliest_products(information.reshape(*sides, *sides), pulls.reshape(sides), *OF_FEW).evidence
    return float(_at_likeliest_noise(told.reshape(len(FEW_NOISES), -1, 1), price)[0])


def _evidence_of_tree(trees: Trees, pull: FloatArray, price: FloatArray) -> float:
    """The same for a tree, averaged over all ``trees``, of the pulls (n, m) of the knots."""
    each = trees.evidence(trees.pulls(pull), *OF_FEW)
    told = logsumexp(each, axis=0) - np.log(len(each))
    return float(_at_likeliest_noise(told.reshape(len(FEW_NOISES), -1, 1), price)[0])


def _principal_courses(
    c: Conditions, columns: Sequence[tuple[str, ...]]
) -> tuple[list[list[FloatArray]], list[tuple[int, ...]]]:
    """The principal courses over the tests (n, k) of each curve and surface, of short lengths and of long ones, each of
    a standard deviation of one in the process that it comes from; and how many each of its columns has with a constant,
    fewer where it has few values."""
    of_column: dict[tuple[str, int], list[FloatArray]] = {}
    for name, alone in {(name, len(each)) for each in columns for name in each}:
        shape = (curve_of(name, c) if alone == 1 else None) or knots_of(name, c)
        assert shape is not None
        at = at_knots((shape,), c)
        for covariances in np.split(np.array(kernels(shape)), 2):
            variance, directions = np.linalg.eigh(np.mean(covariances, axis=0))
            course = at @ (directions * np.sqrt(np.maximum(variance, 0.0)))
            of_column.setdefault((name, alone), []).append(course[:, ::-1][:, : DIRECTIONS[alone]])
    found, sides = [], []
    for each in columns:
        own = [of_column[name, len(each)] for name in each]
        found.append([_together(courses) for courses in zip(*own, strict=True)])
        sides.append(tuple(1 + short.shape[1] for short, _ in own))
    return found, sides


def _together(courses: Sequence[FloatArray]) -> FloatArray:
    """The courses (n, k) of one column, or those of two with their products."""
    if len(courses) == 1:
        return courses[0]
    one, other = (np.column_stack([np.ones(len(course)), course]) for course in courses)
    return each_with_each(one, other)[:, 1:]


def free_columns(c: Conditions, without: Collection[str] = ()) -> list[tuple[str, ...]]:
    """The columns of numbers that a curve may follow, and every two of which a surface may."""
    names = [
        name for name in (*UNITS, *c.columns)
        if name not in OF_SERIES and name not in without and knots_of(name, c) is not None
    ][:MOST_COLUMNS]  # fmt: skip
    pairs = [pair for pair in combinations(names, 2) if not any(set(pair) <= alike for alike in ALIKE)]
    return [*((name,) for name in names), *pairs]


def free_scopes(c: Conditions, few: Collection[WrittenLaw] | None = None) -> tuple[list[WrittenLaw], FloatArray]:
    """What curves and surfaces act on, and where, with what the choice of each costs: T or a term of it, on all samples
    or on any set of them. With ``few``, on all, on each one and where these laws act."""
    scopes, cost = scopes_of(c)
    own = {replace(law, shapes=()) for law in few or ()}
    wheres = (ALL, "sample") if few is None else (ALL, "sample ")
    kept = [k for k, s in enumerate(scopes) if s.where.startswith(wheres) or s in own]
    return [scopes[k] for k in kept], cost[kept]


def certain_pair(search: FreeSearch, by: float) -> tuple[str, ...] | None:
    """The two columns of the likeliest surface; None where those of another one come as close as ``by`` in net log
    likelihood, so that the campaign does not say which column is the second."""
    best = search.measured.max(axis=1)
    ranked = sorted(
        ((float(e), each) for e, each in zip(best, search.columns, strict=True) if len(each) > 1), reverse=True
    )
    return None if len(ranked) > 1 and ranked[1][0] > ranked[0][0] - by else ranked[0][1]


def likeliest(search: FreeSearch, *numbers: int) -> list[tuple[float, tuple[str, ...], WrittenLaw]]:
    """For each of the ``numbers`` of columns, the likeliest curve (one) or surface (two): its net log likelihood, its
    columns and its scope; minus infinity where there is none."""
    every, found = search.measured, []
    for number in numbers:
        own = np.where(np.array([len(each) == number for each in search.columns])[:, None], every, -np.inf)
        f, g = np.unravel_index(int(np.argmax(own)), own.shape)
        found.append((float(own[f, g]), search.columns[f], search.scopes[g]))
    return found
