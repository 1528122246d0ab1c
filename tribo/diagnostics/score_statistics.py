"""Score tests of many courses of ln T on top of a fitted model, in many replicates at once.

What one specimen alone shows needs the products with that specimen and with the border of the model. Two such courses
on different specimens that add up need no products of their own: the specimens meet in the border alone.

The effects of all candidates at their start values, on top of a fitted model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribo.diagnostics.fit import ModelFit
from tribo.diagnostics.model import EVERY, MOST_PAIRS, Acting, Course, StartChanges, added, start_changes
from tribo.diagnostics.normal_equations import ROUNDING, Normal, Sides
from tribo.diagnostics.replicates import as_measured
from tribo.diagnostics.scatter import SIZE_STEPS, Replicates
from tribo.display import displayed
from tribo.records import FloatArray

AS_FITTED = 1  # of the steps of the sizes, the first
TAKEN_UP = 1e-6  # share of a column's information below which nothing of it is left to see
Index = NDArray[np.int64]


@displayed()
@dataclass(frozen=True)
class Wide:
    """Columns (n, 2, k) of several specimens, each contrast at one of ``spans``, and the products its information
    needs.

    ``products`` (3, n, m) are the static, mixed and sliding products of the pairs of columns of one contrast that some
    test shows both of; those of each contrast are at ``pairs`` of the m, and fill its matrix at ``places``.
    """

    columns: FloatArray
    spans: tuple[slice, ...]
    products: FloatArray
    pairs: tuple[slice, ...]
    places: tuple[tuple[Index, Index], ...]


@displayed()
@dataclass(frozen=True)
class Local:
    """Single columns (t, 2, k) that the ``tests`` (t,) of one ``specimen`` alone show, and their products (3, t, k)."""

    specimen: int
    tests: Index
    columns: FloatArray
    products: FloatArray


@displayed()
@dataclass(frozen=True)
class Columns:
    """All contrasts, made ready for many replicates: those at ``wide_at`` of several specimens, those at ``local_at``
    of one, and those at ``pair_at``, each the sum of two local ones, ``pair_of`` (pairs, 2). ``whole`` (contrasts,) is
    the precision with which the coefficient of a contrast is known to be one: zero where its size is free.
    """

    wide: Wide
    wide_at: Index
    local: tuple[Local, ...]
    local_at: Index
    pair_of: Index
    pair_at: Index
    whole: FloatArray

    @property
    def freedom(self) -> Index:
        """Of every contrast, (contrasts,)."""
        found = np.ones(len(self.whole), np.int64)
        found[self.wide_at] = [span.stop - span.start for span in self.wide.spans]
        return found


def columns_in(stacked: FloatArray, spans: Sequence[slice], whole: FloatArray | None = None) -> Columns:
    """Columns (n, 2, k) made ready, those of each contrast at one of ``spans``; ``whole`` (contrasts,) as in
    :class:`Columns`, free by default."""
    whole = np.zeros(len(spans)) if whole is None else whole
    none = np.zeros(0, np.int64)
    return Columns(_wide(stacked, spans), np.arange(len(spans)), (), none, np.zeros((0, 2), np.int64), none, whole)


def columns_of(contrasts: Sequence[tuple[Course, ...]], whole: FloatArray, n: int) -> Columns:
    """The courses of all contrasts at ``n`` tests, made ready: one course each, or two that add up.

    Two courses of one specimen each, both of them contrasts of their own, are not written out.
    """
    alone = [k for k, courses in enumerate(contrasts) if len(courses) == 1 and _is_local(courses[0])]
    alone.sort(key=lambda k: contrasts[k][0].specimen)
    place = {id(contrasts[k][0]): i for i, k in enumerate(alone)}
    pairs = [k for k, courses in enumerate(contrasts) if len(courses) == 2 and all(id(c) in place for c in courses)]
    of = [[place[id(c)] for c in contrasts[k]] for k in pairs]
    rest = {*alone, *pairs}
    wide = [k for k in range(len(contrasts)) if k not in rest]
    ends = np.cumsum([contrasts[k][0].freedom for k in wide], dtype=np.int64)
    spans = [slice(int(e) - contrasts[k][0].freedom, int(e)) for e, k in zip(ends, wide, strict=True)]
    stacked = np.concatenate([np.zeros((n, 2, 0)), *(added(contrasts[k]) for k in wide)], axis=2)
    return Columns(
        _wide(stacked, spans), np.array(wide, np.int64), _locals([contrasts[k][0] for k in alone]),
        np.array(alone, np.int64), np.array(of, np.int64).reshape(-1, 2), np.array(pairs, np.int64), whole,
    )  # fmt: skip


def _is_local(course: Course) -> bool:
    return course.specimen != EVERY and course.freedom == 1


def _locals(courses: Sequence[Course]) -> tuple[Local, ...]:
    """Courses sorted by specimen, those of each put together."""
    specimens: dict[int, list[Course]] = {}
    for c in courses:
        specimens.setdefault(c.specimen, []).append(c)
    found = []
    for specimen, here in specimens.items():
        columns = np.concatenate([c.values for c in here], axis=2)
        each = np.arange(columns.shape[2])
        found.append(Local(specimen, here[0].tests, columns, _products(columns, each, each)))
    return tuple(found)


def _wide(columns: FloatArray, spans: Sequence[slice]) -> Wide:
    shown = np.any(columns != 0.0, axis=1).astype(np.float32)
    places: list[tuple[Index, Index]] = []
    for span in spans:
        first, second = np.nonzero(shown[:, span].T @ shown[:, span])
        places.append((first.astype(np.int64), second.astype(np.int64)))
    ends = np.cumsum([len(rows) for rows, _ in places], dtype=np.int64)
    pairs = [slice(int(end) - len(rows), int(end)) for end, (rows, _) in zip(ends, places, strict=True)]
    sides = [
        np.concatenate([np.zeros(0, np.int64), *(p[i] + span.start for p, span in zip(places, spans, strict=True))])
        for i in (0, 1)
    ]
    return Wide(columns, tuple(spans), _products(columns, *sides), tuple(pairs), tuple(places))


def _products(columns: FloatArray, first: Index, second: Index) -> FloatArray:
    """Static, mixed and sliding products of columns (n, 2, k), (3, n, m)."""
    static, sliding = columns[:, 0], columns[:, 1]
    found = np.empty((3, len(columns), len(first)))
    np.multiply(static[:, first], static[:, second], out=found[0])
    np.multiply(static[:, first], sliding[:, second], out=found[1])
    found[1] += sliding[:, first] * static[:, second]
    np.multiply(sliding[:, first], sliding[:, second], out=found[2])
    return found


@displayed()
@dataclass(frozen=True)
class Crossed:
    """Products of the contrasts with specimens and border, whatever the random sizes are: ``crossed`` with wide columns
    (r, S, 4, k) and (r, m, k), or with local ones, each with its own specimen, (r, 4, k) and (r, m, k); with the
    residual, ``pull`` (r, k); with each other, ``whole`` (r, m)."""

    crossed: Sides
    pull: FloatArray
    whole: FloatArray


@displayed()
@dataclass(frozen=True)
class Cleared:
    """A normal matrix by its roots: ``own`` (r, S, 4, 4) and ``border`` (r, m, m) clear columns of it, ``across``
    (r, S, 4, m) is what clearing the specimens leaves of the border, ``right`` are the right sides, cleared."""

    own: FloatArray
    border: FloatArray
    across: FloatArray
    right: Sides
    log_root: FloatArray

    def border_of(self, crossed: FloatArray, taken: FloatArray) -> FloatArray:
        """Products of the border (r, m, k), less what the specimens have ``taken`` of it, cleared."""
        return self.border @ (crossed - taken)


def cleared(normal: Normal, right: Sides) -> Cleared:
    """The roots of a normal matrix with its prior; ``log_root`` (r,) is the logarithm of their determinant."""
    own_root = np.linalg.cholesky(normal.own)
    own = np.linalg.inv(own_root)
    across = own @ normal.across
    r, specimens, _, m = across.shape
    flat = across.reshape(r, 4 * specimens, m)
    scale = 1.0 / np.sqrt(np.diagonal(normal.border, axis1=1, axis2=2) + 1e-300)
    schur = (normal.border - flat.transpose(0, 2, 1) @ flat) * scale[:, :, None] * scale[:, None, :]
    root = np.linalg.cholesky(schur)
    border = np.linalg.inv(root) * scale[:, None, :]
    own_right = (own @ right[0][..., None])[..., 0]
    border_right = np.einsum("rkm,rm->rk", border, right[1] - np.einsum("rsam,rsa->rm", across, own_right))
    log_root = np.log(np.diagonal(own_root, axis1=2, axis2=3)).sum(axis=(1, 2))
    log_root = log_root + np.log(np.diagonal(root, axis1=1, axis2=2) / scale).sum(axis=1)
    return Cleared(own, border, across, (own_right, border_right), log_root)


def scores(fitted: Replicates, contrasts: Columns, steps: int = len(SIZE_STEPS)) -> tuple[FloatArray, list[FloatArray]]:
    """Score test of every contrast beyond the model's own columns.

    A contrast that is present as a whole or absent is tested at its known size: its chi-squared value is twice the log
    likelihood ratio of a coefficient about one against zero.

    The scores are taken at several sizes of the random effects, the first ``steps`` of SIZE_STEPS from the fitted
    ones; each pays what it loses of the likelihood of the model without the contrast. Returns the largest
    chi-squared values (r, contrasts) and the coefficients of each contrast, (r, d) each, at the first sizes.
    """
    wide, local, right = _wide_products(fitted, contrasts.wide), _local_products(fitted, contrasts), _right(fitted)
    best: FloatArray = np.zeros(0)
    first: list[FloatArray] = []
    evidence = []
    for k in range(steps):
        at, likelihood = _at_step(fitted, right, k)
        singles = _singles(contrasts, local, at)
        chi2, coefficients = _scores_at(contrasts, wide, singles, at)
        evidence.append(likelihood)
        chi2 = chi2 + 2.0 * likelihood[:, None]
        best, first = (chi2, coefficients) if k == 0 else (np.maximum(best, chi2), first)
    return np.maximum(best - 2.0 * np.max(evidence, axis=0)[:, None], 0.0), first


def informations(fitted: Replicates, contrasts: Columns) -> tuple[FloatArray, FloatArray]:
    """Information (r, contrasts) and score (r, contrasts) of contrasts of one column beyond the model, at the fitted
    sizes; both zero where the model takes the column up."""
    at, _ = _at_step(fitted, _right(fitted), 0)
    wide, local = _wide_products(fitted, contrasts.wide), _local_products(fitted, contrasts)
    crossed, pull = _wide_cleared(wide, at)
    left, score, whole = (np.zeros((len(pull), len(contrasts.whole))) for _ in range(3))
    shown = np.array([pair.stop > pair.start for pair in contrasts.wide.pairs], bool)  # zeros have no products
    whole[:, contrasts.wide_at[shown]] = wide.whole
    left[:, contrasts.wide_at] = whole[:, contrasts.wide_at] - np.sum(crossed**2, axis=1)
    score[:, contrasts.wide_at] = pull
    for positions, single in _singles(contrasts, local, at):
        left[:, positions], score[:, positions], whole[:, positions] = single.left, single.pull, single.whole
    seen = left > TAKEN_UP * whole
    return np.where(seen, left, 0.0), np.where(seen, score, 0.0)


def _right(fitted: Replicates) -> Sides:
    return fitted.weighted.with_residual(fitted.residual)


def _at_step(fitted: Replicates, right: Sides, index: int) -> tuple[Cleared, FloatArray]:
    """The normal matrix at one of SIZE_STEPS, and the log likelihood (r,) of the model without contrasts."""
    columns = fitted.weighted.columns
    precision = fitted.sizes.precision * np.exp(-2.0 * np.append(SIZE_STEPS[index], 0.0))[fitted.group]
    prior = np.concatenate([np.full((len(precision), columns.parameters), 1e-12), precision], axis=1)
    found = cleared(fitted.normal.with_prior(*columns.sides(prior)), right)
    squares = sum(np.sum(side**2, axis=tuple(range(1, side.ndim))) for side in found.right)
    likelihood = 0.5 * np.log(prior).sum(axis=1) - found.log_root + 0.5 * squares + fitted.log_priors[index]
    return found, np.asarray(likelihood)


def _wide_products(fitted: Replicates, wide: Wide) -> Crossed:
    r, (n, _, k) = len(fitted.precision), wide.columns.shape
    pull = _weighted_residual(fitted).reshape(r, 2 * n) @ wide.columns.reshape(2 * n, k)
    whole = fitted.precision.reshape(r, 3 * n) @ wide.products.reshape(3 * n, wide.products.shape[2])
    return Crossed(fitted.weighted.times(wide.columns), pull, whole)


def _local_products(fitted: Replicates, contrasts: Columns) -> list[Crossed]:
    """Specimen by specimen."""
    residual, found = _weighted_residual(fitted), []
    for here in contrasts.local:
        r, t, k = len(residual), len(here.tests), here.columns.shape[2]
        own = fitted.weighted.own_times(here.tests, here.columns)
        border = fitted.weighted.border_times(here.tests, here.columns)
        pull = residual[:, here.tests].reshape(r, 2 * t) @ here.columns.reshape(2 * t, k)
        whole = fitted.precision[:, :, here.tests].reshape(r, 3 * t) @ here.products.reshape(3 * t, k)
        found.append(Crossed((own, border), pull, whole))
    return found


def _weighted_residual(fitted: Replicates) -> FloatArray:
    """The residual times the precision of every test, (r, n, 2)."""
    static, mixed, sliding = (fitted.precision[:, i] for i in range(3))
    first, second = fitted.residual[:, 0], fitted.residual[:, 1]
    return np.stack([static * first + mixed * second, mixed * first + sliding * second], axis=2)


@displayed()
@dataclass(frozen=True)
class Single:
    """Scores of contrasts of one column each, (r, k): the score beyond the model, the information left and whole."""

    pull: FloatArray
    left: FloatArray
    whole: FloatArray

    def solved(self, about_one: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Chi-squared values and coefficients, (r, k) each; ``about_one`` (k,) as ``whole`` in :class:`Columns`."""
        seen = self.left > TAKEN_UP * self.whole
        toward_one = self.pull + about_one
        alone = np.where(seen, toward_one / np.maximum(self.left + about_one, 1e-300), 0.0)
        return np.where(seen, alone * toward_one - about_one, 0.0), alone


def _singles(contrasts: Columns, local: Sequence[Crossed], at: Cleared) -> list[tuple[Index, Single]]:
    """Local contrasts and their pairs, each with the positions of its contrasts."""
    if not local:
        return []
    each, borders = [], []
    for here, found in zip(contrasts.local, local, strict=True):
        own = at.own[:, here.specimen] @ found.crossed[0]
        border = at.border_of(found.crossed[1], at.across[:, here.specimen].transpose(0, 2, 1) @ own)
        taken = np.einsum("rak,ra->rk", own, at.right[0][:, here.specimen])
        pull = found.pull - taken - np.einsum("rmk,rm->rk", border, at.right[1])
        left = found.whole - np.sum(own**2, axis=1) - np.sum(border**2, axis=1)
        each.append((pull, left, found.whole))
        borders.append(border)
    pull, left, whole = (np.concatenate(parts, axis=1) for parts in zip(*each, strict=True))
    singles = [(contrasts.local_at, Single(pull, left, whole))]
    if len(contrasts.pair_of):
        i, j = contrasts.pair_of.T
        shared = _in_common(np.concatenate(borders, axis=2), i, j)
        both = Single(pull[:, i] + pull[:, j], left[:, i] + left[:, j] - 2.0 * shared, whole[:, i] + whole[:, j])
        singles.append((contrasts.pair_at, both))
    return singles


def _in_common(border: FloatArray, i: Index, j: Index) -> FloatArray:
    """Inner products (r, pairs) of the columns ``i`` and ``j`` of what is left in the border, (r, m, k)."""
    used, place = np.unique(np.concatenate([i, j]), return_inverse=True)
    first, second = place[: len(i)], place[len(i) :]
    found = np.empty((len(border), len(i)))
    for r, columns in enumerate(border[:, :, used]):
        found[r] = (columns.T @ columns)[first, second]
    return found


def _wide_cleared(wide: Crossed, at: Cleared) -> tuple[FloatArray, FloatArray]:
    """What the model's own columns have in common with wide ones, (r, 4 S + m, k), and the scores beyond them."""
    own = at.own @ wide.crossed[0]
    r, specimens, _, k = own.shape
    flat = own.reshape(r, 4 * specimens, k)
    taken = at.across.reshape(r, 4 * specimens, at.across.shape[3]).transpose(0, 2, 1) @ flat
    crossed = np.concatenate([flat, at.border_of(wide.crossed[1], taken)], axis=1)
    right = np.concatenate([at.right[0].reshape(r, 4 * specimens), at.right[1]], axis=1)
    return crossed, wide.pull - np.einsum("rpk,rp->rk", crossed, right, optimize=True)


def _scores_at(
    contrasts: Columns, wide: Crossed, singles: Sequence[tuple[Index, Single]], at: Cleared
) -> tuple[FloatArray, list[FloatArray]]:
    """Chi-squared values and coefficients of all contrasts."""
    crossed, pull = _wide_cleared(wide, at)
    r, count = len(pull), len(contrasts.whole)
    chi2 = np.zeros((r, count))
    coefficients: list[FloatArray] = [np.zeros((r, 1))] * count
    first = [span.start for span in contrasts.wide.spans]
    whole = wide.whole[:, [pair.start for pair in contrasts.wide.pairs]]
    alone = Single(pull[:, first], whole - np.sum(crossed[:, :, first] ** 2, axis=1), whole)
    for positions, single in ((contrasts.wide_at, alone), *singles):
        chi2[:, positions], found = single.solved(contrasts.whole[positions])
        for position, column in zip(positions, found.T[:, :, None], strict=True):
            coefficients[position] = column
    for position, span, pair, place in zip(
        contrasts.wide_at, contrasts.wide.spans, contrasts.wide.pairs, contrasts.wide.places, strict=True
    ):
        if span.stop > span.start + 1:
            own = _filled(wide.whole[:, pair], place, span.stop - span.start)
            coefficients[position] = _solution(pull[:, span], own, crossed[:, :, span])
            chi2[:, position] = np.sum(pull[:, span] * coefficients[position], axis=1)
    return chi2, coefficients


def _filled(values: FloatArray, place: tuple[Index, Index], d: int) -> FloatArray:
    """Matrices (r, d, d) of the products that are there."""
    whole = np.zeros((len(values), d, d))
    whole[:, place[0], place[1]] = values
    return whole


def _solution(pull: FloatArray, whole: FloatArray, crossed: FloatArray) -> FloatArray:
    """Coefficients of one contrast (r, d) from its scores (r, d), its raw information (r, d, d) and its share (r, p, d)
    of the model's columns."""
    floor = ROUNDING * (np.diagonal(whole, axis1=1, axis2=2) + 1e-12)
    information = whole - crossed.transpose(0, 2, 1) @ crossed + floor[:, :, None] * np.eye(pull.shape[1])
    return np.asarray(np.linalg.solve(information, pull[:, :, None])[:, :, 0])


SEEN = 1e-3  # share of a mechanism's effect that must be left once the flat law is free


@displayed()
@dataclass(frozen=True)
class StartEffects:
    """The effects of all candidates at their start values, made once for a fitted ``model``.

    ``length`` (k,) is the strength with which each would show beside the model's own columns, as a standard normal
    deviate, ``pull`` (k,) its score there and ``size`` (k,) its peak-to-peak effect in ln T beyond the law, where it
    was computed. ``absorbed`` are the names of the mechanisms whose effect the calibration on the flat sample absorbs
    almost wholly, at every size that a fit would start from.
    """

    model: ModelFit
    changes: StartChanges
    length: FloatArray
    pull: FloatArray
    size: FloatArray
    absorbed: frozenset[str]

    @property
    def acting(self) -> tuple[Acting, ...]:
        return self.changes.acting


def start_effects(f: ModelFit) -> StartEffects:
    """The effects of all candidates on top of a fit."""
    changes = start_changes(f.setup, f.law)
    ready = columns_of(changes.courses, np.zeros(len(changes.courses)), f.setup.observations.n)
    left, pull = (found[0] for found in informations(as_measured(f), ready))
    return StartEffects(f, changes, np.sqrt(left), pull, _size(f, changes), _absorbed(f, changes))


def _size(f: ModelFit, changes: StartChanges) -> FloatArray:
    """Peak to peak of every candidate; infinite for pairs of specimens where there are very many of them."""
    alone = np.array([len(courses) == 1 for courses in changes.courses])
    sized = alone if np.sum(~alone) > MOST_PAIRS else np.ones(len(alone), bool)
    found = np.full(len(sized), np.inf)
    shown = (added(changes.courses[k])[:, :, 0] for k in np.flatnonzero(sized))
    found[sized] = f.linear.size_beyond_law(shown)
    return found


def _absorbed(f: ModelFit, changes: StartChanges) -> frozenset[str]:
    names = [name for name, columns in changes.every_start.items() for _ in range(columns.shape[2])]
    if not names:
        return frozenset()
    columns = np.concatenate(list(changes.every_start.values()), axis=2)
    kept = np.sum(f.linear.cleared(columns)[0] ** 2, axis=0)
    whole = np.sum(columns**2, axis=(0, 1)) / np.mean(np.diag(f.noise.repeat))
    seen = {name for name, k, w in zip(names, kept, whole, strict=True) if k >= SEEN * max(w, 1e-30)}
    return frozenset(set(names) - seen)
