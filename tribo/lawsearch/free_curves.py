"""Laws as curves and surfaces: how friction follows one column or two with no formula in mind, by a Gaussian process,
with its band.

A curve is held at knots along the column. It is uncertain by what the campaign leaves open, averaged over how large,
how smooth and how fast it may be (Rasmussen and Williams, Gaussian Processes for Machine Learning, 2006, chapters 2 and
5). A surface may be a product of two curves; what a campaign says for that follows from Laplace's approximation
(Tierney and Kadane, J. Am. Stat. Assoc. 81, 82, 1986). Or it may be a tree of four leaves, each of one value (Chipman,
George and McCulloch, J. Am. Stat. Assoc. 93, 935, 1998), which jumps somewhere between two knots. The band of a formula
is that of the curve of its column: the formula was chosen among many once the data had been seen, the curve was not.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy.special import logsumexp, softmax

from tribo.diagnostics.contrasts import FORM
from tribo.diagnostics.fit import ModelFit, fit
from tribo.diagnostics.gaps import enough_recorded
from tribo.diagnostics.inference import gain_on_groups
from tribo.lawsearch.grammar import (
    MOST_VALUES,
    PRESSURES,
    TIMES,
    UNITS,
    Shape,
    WrittenLaw,
    column_values,
    logarithmic,
    recorded_values,
)
from tribo.mechanisms.record import Conditions
from tribo.records import FloatArray

KNOTS = 25
ALONG = 13  # knots of a surface along each column
LENGTHS = (0.07, 0.15, 0.3, 0.6)  # over which a curve changes, in shares of the range of the column
SIZES = np.geomspace(0.005, 0.5, 9)  # standard deviation of a curve, in ln T
TREES = 15  # the likeliest ones, of which a surface is told
STARTS, TURNS, TINY = 2, 8, 1e-9  # of the fit of a product of two curves: from where, how often each, a length above 0
FLAT_BELOW = 1e-7  # of the largest variance of a curve along its principal directions, below which one is left out
FOLDS = 5  # of whole specimens that are left out
AS_GOOD = 1.0  # standard errors by which tests left out may favour a curve over the formula that stays


def curve_of(column: str, c: Conditions) -> Shape | None:
    """The curve of a column of numbers, zero everywhere, with its knots: evenly spaced, or in the logarithm where the
    column spans much; None where it has few values, or where the flat law, days or drift follow it: a curve of time is
    what the drift of the series is."""
    if column in PRESSURES | TIMES:
        return None
    x = recorded_values(c, column)
    if len(np.unique(x)) <= MOST_VALUES:
        return None
    low, high = float(x.min()), float(x.max())
    spaced = np.geomspace if logarithmic(low, high) else np.linspace
    places = tuple(float(p) for p in spaced(low, high, KNOTS))
    return Shape("curve", column, low, high, values=(low, *places[1:-1], high), heights=(0.0,) * KNOTS)


def knots_of(column: str, c: Conditions) -> Shape | None:
    """The knots of a surface along a column of numbers: its values where it has few, else evenly spaced, or in the
    logarithm where the column spans much; None where a column does not vary, or where the flat law follows it."""
    if column in PRESSURES or not (column in UNITS or np.isfinite(column_values(c, column)).any()):
        return None
    x = recorded_values(c, column)
    values = np.unique(x)
    if len(values) < 2 or not enough_recorded(len(x), len(c.sample)):
        return None
    low, high = float(values[0]), float(values[-1])
    spaced = np.geomspace if logarithmic(low, high) else np.linspace
    places = values if len(values) <= ALONG else spaced(low, high, ALONG)
    return Shape("surface", column, low, high, values=(low, *(float(p) for p in places[1:-1]), high))


def kernels(shape: Shape) -> list[FloatArray]:
    """Covariances between the knots of a column, smooth and rough, for each of the lengths."""
    at = np.array(shape.values, float)
    place = np.log(at) if logarithmic(shape.low, shape.high) else at
    place = (place - place[0]) / (place[-1] - place[0])
    apart = np.abs(place[:, None] - place)
    found = []
    for length in LENGTHS:
        near = apart / length
        found += [np.exp(-0.5 * near**2), (1.0 + np.sqrt(3.0) * near) * np.exp(-np.sqrt(3.0) * near)]
    return found


@dataclass(frozen=True)
class FreeCurve:
    """A curve in one scope of laws, known from a campaign.

    ``columns`` (n, 2, knots) of ln T are those of the curve at each knot; ``heights`` (knots,) are what the campaign
    tells of ln T there, where the law acts fully, about a mean of zero over its tests, with their ``covariance``.
    ``prior`` (knots, r) spans the curves that are likely, and ``evidence`` is the log of the marginal likelihood over
    none. ``between`` (n,) is the variance of the course of every test that lies between two knots where the surface may
    jump: the place of a jump is not known closer than the knots on either side.
    """

    law: WrittenLaw
    columns: FloatArray
    heights: FloatArray
    covariance: FloatArray
    prior: FloatArray
    evidence: float
    between: FloatArray


def at_knots(shapes: Sequence[Shape], c: Conditions) -> FloatArray:
    """The courses (n, knots) that a curve or a surface is made of, each one at its knot and zero at the others."""
    first, *second = (replace(shape, kind="surface", heights=()).of(c) for shape in shapes)
    for other in second:
        first = each_with_each(first, other)
    return first


def each_with_each(first: FloatArray, second: FloatArray) -> FloatArray:
    """The products of every course (n, k) with every other one (n, m), (n, k m)."""
    return np.asarray((first[:, :, None] * second[:, None, :]).reshape(len(first), -1))


def likely(shapes: Sequence[Shape]) -> list[FloatArray]:
    """Covariances between the knots of a curve or a surface, of a standard deviation of one along each column."""
    if len(shapes) == 1:
        return kernels(shapes[0])
    return [np.asarray(np.kron(1.0 + one, 1.0 + other) - 1.0, float) for one, other in _both_kernels(shapes)]


def _both_kernels(shapes: Sequence[Shape]) -> list[tuple[FloatArray, FloatArray]]:
    """Of a surface, the covariances along each column, both smooth or both rough, of each two lengths."""
    one, other = (kernels(shape) for shape in shapes)
    return [pair for k in (0, 1) for pair in product(one[2 + k :: 2], other[2 + k :: 2])]


def fitted_curve(without: ModelFit, scope: tuple[WrittenLaw, FloatArray], informed: float) -> FreeCurve:
    """The curve or surface that a campaign tells of, ``without`` being its fit without the law.

    Parameters
    ----------
    without : ModelFit
        With the noise at which it is told, and the residual.
    scope : (WrittenLaw, array (n, 2))
        The law, with the shape of :func:`curve_of` or two of :func:`knots_of`, and by how much it changes ln T of
        every test.
    informed : float
        Of the information in the weighted normal equations, what a pull really tells.
    """
    law, effects = scope
    c = without.setup.observations.conditions
    interpolated = at_knots(law.shapes, c)
    acts = np.abs(law.weight(c))
    courses = interpolated - acts @ interpolated / acts.sum()
    columns = courses[:, None, :] * effects[:, :, None]
    rows, residual = without.cleared(columns)
    information, pull = rows.T @ rows, rows.T @ residual
    sizes = SIZES if len(law.shapes) == 1 else SIZES[2::2]
    roots = [size * root for root in map(_root, likely(law.shapes)) for size in sizes]
    found = [_member(information, pull, root, informed) for root in roots]
    span = np.average([root @ root.T for root in roots], axis=0, weights=softmax([m.evidence for m in found]))
    evidence = _mean_evidence(found)
    if len(law.shapes) > 1:
        kinds = (
            found, _members_of_products(law.shapes, information, pull, informed),
            _members_of_trees(law.shapes, information, pull, informed),
        )  # fmt: skip
        evidence = float(logsumexp([_mean_evidence(kind) for kind in kinds]) - np.log(len(kinds)))
        found = [replace(m, evidence=m.evidence - np.log(len(kind))) for kind in kinds for m in kind]
    share = softmax([m.evidence for m in found])
    heights = np.average([m.heights for m in found], axis=0, weights=share)
    spread = [m.covariance + np.outer(m.heights - heights, m.heights - heights) for m in found]
    covariance = np.average(spread, axis=0, weights=share)
    between = np.zeros(len(c.sample))
    for m, weight in zip(found, share, strict=True):
        if m.jumps:
            between += weight * on_either_side(interpolated, m.heights)
    return FreeCurve(law, columns, heights, covariance, _root(span), evidence, between)


def on_either_side(interpolated: FloatArray, heights: FloatArray) -> FloatArray:
    """The variance (n,) of courses ``interpolated`` (n, knots) between ``heights`` (knots,) that jump somewhere between
    two knots: a test there is on either side of the jump, with the weights of the interpolation as chances."""
    return np.maximum(interpolated @ heights**2 - (interpolated @ heights) ** 2, 0.0)


@dataclass(frozen=True)
class _Member:
    """Curves or surfaces of one size and length: log marginal likelihood, heights (knots,) and their covariance, and
    whether they jump between two knots."""

    evidence: float
    heights: FloatArray
    covariance: FloatArray
    jumps: bool = False


def _mean_evidence(members: Sequence[_Member]) -> float:
    return float(logsumexp([m.evidence for m in members]) - np.log(len(members)))


def _root(covariance: FloatArray) -> FloatArray:
    """What spans a covariance, (k, r), its flat directions left out."""
    variance, directions = np.linalg.eigh(covariance)
    kept = variance > FLAT_BELOW * variance[-1]
    return np.asarray(directions[:, kept] * np.sqrt(variance[kept]))


def _members_of_products(
    shapes: Sequence[Shape], information: FloatArray, pull: FloatArray, informed: float
) -> list[_Member]:
    """Products of a curve of each column, all of the same lengths and sizes as the surfaces."""
    one, other = (len(shape.values) for shape in shapes)
    by_knots, pulls, sizes = information.reshape(one, other, one, other), pull.reshape(one, other), SIZES[2::2]
    found = []
    for kernels_of_both in _both_kernels(shapes):
        a, b = (_root(1.0 + kernel) for kernel in kernels_of_both)
        own = np.einsum("ijkl,ia,jb,kc,ld->abcd", by_knots, a, b, a, b, optimize=True)
        p = likeliest_products(own, a.T @ pulls @ b, sizes)
        for size, evidence, u, v, curvature in zip(sizes, p.evidence, p.first, p.second, p.curvature, strict=True):
            first, second = a @ u, b @ v
            root = size * np.concatenate(
                [(a[:, None, :] * second[:, None]).reshape(one * other, -1),
                 (first[:, None, None] * b).reshape(one * other, -1)], axis=1,
            )  # fmt: skip
            told = np.eye(len(curvature)) + informed * (curvature - np.eye(len(curvature)))
            covariance = root @ np.linalg.inv(told) @ root.T
            found.append(_Member(float(evidence), size * np.outer(first, second).ravel(), covariance))
    return found


def _members_of_trees(
    shapes: Sequence[Shape], information: FloatArray, pull: FloatArray, informed: float
) -> list[_Member]:
    """The likeliest trees, each with a surface beside it by which it may be wrong in form; together they count as much
    as all trees."""
    sides = tuple(len(shape.values) for shape in shapes)
    trees, sizes = Trees(information.reshape(*sides, *sides)), SIZES[2::2]
    every = trees.evidence(trees.pulls(pull.reshape(sides)), sizes)
    wrong = FORM * _root(np.mean(likely(shapes), axis=0))
    found, plain = [], []
    for k in np.argsort(-every.max(axis=1))[:TREES]:
        for size, evidence in zip(sizes, every[k], strict=True):
            root = size * np.concatenate([trees.leaves(int(k)), wrong], axis=1)
            found.append(_member(information, pull, root, informed))
            plain.append(evidence)
    lost = float(logsumexp(every) - np.log(every.size) - logsumexp(plain) + np.log(len(plain)))
    return [replace(m, evidence=m.evidence + lost, jumps=True) for m in found]


class Trees:
    """All trees over the knots of a surface: one column is split once, and either side of it once in the other column.

    Parameters
    ----------
    information : array (n, m, n, m)
        Of the n knots of one column with the m of the other.

    Attributes
    ----------
    at : array (trees, 4)
        Which column is split first and at which of its knots, and at which ones the other column is on either side.
    along, directions : arrays (trees, 4), (trees, 4, 4)
        Information of the four leaves along their principal directions.
    """

    def __init__(self, information: FloatArray) -> None:
        self.sides = information.shape[:2]
        at, found = [], []
        for first, whole in enumerate((information, information.transpose(1, 0, 3, 2))):
            one, other = (_either_side(k) for k in whole.shape[:2])
            of_sides = np.einsum("sajkl,sbk->sabjl", np.einsum("sai,ijkl->sajkl", one, whole), one)
            of_leaves = np.einsum("sabtcl,udl->sabtcud", np.einsum("sabjl,tcj->sabtcl", of_sides, other), other)
            s, *split = (x.ravel() for x in np.indices((len(one), len(other), len(other))))
            own = np.empty((len(s), 2, 2, 2, 2))
            for a, b in product((0, 1), repeat=2):
                own[:, a, :, b] = of_leaves[s, a, b, split[a], :, split[b]]
            at.append(np.column_stack([np.full(len(s), first), s + 1, split[0] + 1, split[1] + 1]))
            found.append(own.reshape(-1, 4, 4))
        self.at = np.concatenate(at)
        along, self.directions = np.linalg.eigh(np.concatenate(found))
        self.along = np.maximum(along, 0.0)

    def pulls(self, pull: FloatArray) -> FloatArray:
        """Those of the leaves of every tree along their principal directions, (trees, 4), from those of the knots
        (n, m)."""
        found = []
        for first, towards in enumerate((pull, pull.T)):
            one, other = (_either_side(k) for k in towards.shape)
            of_leaves = np.einsum("saj,tcj->satc", one @ towards, other)
            s, *split = self.at[self.at[:, 0] == first, 1:].T - 1
            found.append(np.stack([of_leaves[s, a, split[a]] for a in (0, 1)], axis=1).reshape(-1, 4))
        return np.asarray((np.concatenate(found)[:, None] @ self.directions)[:, 0])

    def evidence(self, pulls: FloatArray, size: FloatArray, noise: FloatArray | float = 1.0) -> FloatArray:
        """Log marginal likelihood over none, (trees, b), for sizes (b,) of the leaves in ln T and noises (b,)."""
        by_noise, drawn = np.broadcast_to(size**2 / noise, size.shape), np.broadcast_to(size**2 / noise**2, size.shape)
        informed = 1.0 + by_noise * self.along[:, :, None]
        explained = np.sum(pulls[:, :, None] ** 2 / informed, axis=1) * drawn
        return np.asarray(0.5 * (explained - np.log(np.prod(informed, axis=1))))

    def leaves(self, k: int) -> FloatArray:
        """The four leaves of one tree over the knots, (n m, 4)."""
        first, place, *places = self.at[k]
        one, other = np.indices(self.sides)[:: 1 if first == 0 else -1]
        side = (one >= place).astype(int)
        return np.eye(4)[2 * side + (other >= np.array(places)[side])].reshape(-1, 4)


def _either_side(knots: int) -> FloatArray:
    """Of every split between knots those before it and those after it, (splits, 2, knots)."""
    before = np.tri(knots)[:-1]
    return np.stack([before, 1.0 - before], axis=1)


@dataclass(frozen=True)
class Products:
    """The likeliest products of two curves, (b,) of them for as many sizes and noises.

    Their ``evidence`` (b,) is the log marginal likelihood over none, by Laplace's approximation; ``first`` (b, n) and
    ``second`` (b, m) are the amplitudes of both curves, ``curvature`` (b, n + m, n + m) that of the log posterior.
    """

    evidence: FloatArray
    first: FloatArray
    second: FloatArray
    curvature: FloatArray


def likeliest_products(
    information: FloatArray, pull: FloatArray, size: FloatArray, noise: FloatArray | float = 1.0
) -> Products:
    """Products of two curves, each one amplitudes of a standard deviation of one times its courses: fewer numbers than
    those of a surface.

    One curve after the other is fitted with the other one held, from the two likeliest pairs on.

    Parameters
    ----------
    information : array (n, m, n, m)
        Of the products of n courses of one column with m of the other.
    pull : array (n, m)
    size : array (b,)
        Standard deviation of the product, in ln T.
    noise : array (b,) or float
        Variance of the noise, of that at which the information holds.
    """
    n, m = pull.shape
    of_first = information.transpose(0, 2, 1, 3).reshape(n * n, m * m)

    def within(one: FloatArray, other: FloatArray) -> FloatArray:
        squares = (other[:, :, None] * other[:, None]).reshape(len(other), -1)
        k = math.isqrt(len(one))
        return np.asarray(np.eye(k) + inform * (squares @ one.T).reshape(-1, k, k))

    def fitted(one: FloatArray, towards: FloatArray, other: FloatArray) -> FloatArray:
        right = draw * (other @ towards.T)[:, :, None]
        return np.asarray(np.linalg.solve(within(one, other), right)[:, :, 0])

    # from several second curves on, each at every size
    starts = np.sqrt(m) * np.linalg.svd(pull)[2][: min(n, m, STARTS)]
    second = np.repeat(starts, len(size), axis=0)
    inform, draw = (np.tile(x, len(starts))[:, None, None] for x in (size**2 / noise, size / noise))
    for _ in range(TURNS):
        first = fitted(of_first, pull, second)
        second = fitted(of_first.T, pull.T, first)
        # of the same product, the likeliest amplitudes are of one length
        one, other = (np.linalg.norm(x, axis=1, keepdims=True) + TINY for x in (first, second))
        first, second = first * np.sqrt(other / one), second * np.sqrt(one / other)
    both = first[:, :, None] * second[:, None, :]
    own, other = within(of_first, second), within(of_first.T, first)
    crossed = np.einsum("bkl,imkl->bim", both, information) + np.einsum("bkj,ijkm->bim", both, information)
    crossed = inform * crossed - draw * pull
    curvature = np.block([[own, crossed], [crossed.transpose(0, 2, 1), other]])
    steepness, directions = np.linalg.eigh(curvature)
    steepness = np.maximum(steepness, 1.0)  # that of the prior alone
    curvature = (directions * steepness[:, None]) @ directions.transpose(0, 2, 1)
    gained = draw[:, 0, 0] * np.sum(both * pull, axis=(1, 2))
    lost = np.einsum("bi,bij,bj->b", first, own, first) + np.sum(second**2, axis=1) + np.sum(np.log(steepness), axis=1)
    evidence = gained - 0.5 * lost
    best = evidence.reshape(len(starts), -1).argmax(axis=0) * len(size) + np.arange(len(size))
    return Products(evidence[best], first[best], second[best], curvature[best])


def _member(information: FloatArray, pull: FloatArray, root: FloatArray, informed: float) -> _Member:
    """Curves spanned by ``root`` (knots, r)."""
    own, towards = root.T @ information @ root, root.T @ pull
    within = np.eye(len(own)) + own
    evidence = 0.5 * float(towards @ np.linalg.solve(within, towards)) - 0.5 * float(np.linalg.slogdet(within)[1])
    posterior = root @ np.linalg.inv(np.eye(len(own)) + informed * own) @ root.T
    return _Member(evidence, posterior @ (informed * pull), posterior)


def better_left_out(model: ModelFit, with_formula: ModelFit, curve: FreeCurve, least: float = AS_GOOD) -> bool:
    """Whether a curve predicts tests that were left out better than a formula does, by more than the ``least`` number
    of standard errors of the difference; whole specimens are left out, or tests where there are few.

    ``model`` is the campaign without the law.
    """
    along = curve.columns @ curve.prior
    wider = model.setup.with_effects(along, np.ones(along.shape[2]))
    free = fit(wider, model.acting, start=replace(model, noise=with_formula.noise))
    specimen = model.setup.specimen
    fold = (specimen if model.setup.specimens > 2 else np.arange(len(specimen))) % FOLDS
    gained, se = gain_on_groups(with_formula, free, fold)
    return bool(gained > least * se)
