"""Score tests of many contrasts of ln T on top of a fitted model, in many replicates at once.

What one specimen alone shows needs the products with that specimen and with the border of the model. Two such courses
on different specimens that add up need no products of their own: the specimens meet in the border alone. A product of
columns is that of :mod:`tribo.diagnostics.normal_equations`: static, mixed and sliding entries.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from tribo.diagnostics.fit import ModelFit
from tribo.diagnostics.model import EVERY, MOST_PAIRS, Acting, EffectCourse, added, start_changes
from tribo.diagnostics.normal_equations import ROUNDING, BlockCholesky, Sides, block_cholesky
from tribo.diagnostics.observations import Observations
from tribo.diagnostics.replicates import OF_SEVERAL, SIZE_STEPS, Replicates, as_measured
from tribo.display import displayed
from tribo.records import FloatArray

AS_FITTED = 1  # of the steps of the sizes, the first
TAKEN_UP = 1e-6  # share of a column's information below which nothing of it is left to see
SEEN = 1e-3  # share of a mechanism's effect that must be left once all else is free
Index = NDArray[np.int64]
Absorption = Literal["absorbed", "hidden"]


@displayed()
@dataclass(frozen=True)
class Terms:
    """The columns of all contrasts, made ready for many replicates.

    Contrasts at ``shared_at`` are of several specimens: their ``columns`` (n, 2, k), those of one contrast at one of
    ``spans``, and the ``products`` (3, n, m) of the pairs of columns of one contrast that some test shows both of; the
    pairs of each contrast are at ``pairs`` of the m, and fill its matrix at ``places``. Contrasts at ``single_at`` are
    of one specimen: ``single`` holds each specimen, its tests (t,), the columns (t, 2, k) that they alone show, and
    their products (3, t, k). Contrasts at ``pair_at`` are each the sum of two of the latter, ``pair_of`` (pairs, 2).
    ``about_one`` (contrasts,) is the precision with which the coefficient of a contrast is known to be one: zero where
    its size is free.
    """

    columns: FloatArray
    spans: tuple[slice, ...]
    products: FloatArray
    pairs: tuple[slice, ...]
    places: tuple[tuple[Index, Index], ...]
    shared_at: Index
    single: tuple[tuple[int, Index, FloatArray, FloatArray], ...]
    single_at: Index
    pair_of: Index
    pair_at: Index
    about_one: FloatArray

    @property
    def freedom(self) -> Index:
        """Of every contrast, (contrasts,)."""
        freedom = np.ones(len(self.about_one), np.int64)
        freedom[self.shared_at] = [span.stop - span.start for span in self.spans]
        return freedom


def terms_in(stacked: FloatArray, spans: Sequence[slice], about_one: FloatArray | None = None) -> Terms:
    """The terms of contrasts whose columns (n, 2, k) are written out, those of each at one of ``spans``."""
    about_one = np.zeros(len(spans)) if about_one is None else about_one
    none = np.zeros(0, np.int64)
    shared = stacked, tuple(spans), *_shared_products(stacked, spans)
    return Terms(*shared, np.arange(len(spans)), (), none, np.zeros((0, 2), np.int64), none, about_one)


def terms_of(contrasts: Sequence[tuple[EffectCourse, ...]], about_one: FloatArray, n: int) -> Terms:
    """The terms of contrasts at ``n`` tests, given by their courses: one each, or two that add up.

    Two courses of one specimen each, both of them contrasts of their own, are not written out.
    """
    one = [k for k, courses in enumerate(contrasts) if len(courses) == 1 and courses[0].freedom == 1]
    single = [k for k in one if contrasts[k][0].specimen != EVERY]
    single.sort(key=lambda k: contrasts[k][0].specimen)
    place = {id(contrasts[k][0]): i for i, k in enumerate(single)}
    pairs = [k for k, courses in enumerate(contrasts) if len(courses) == 2 and all(id(c) in place for c in courses)]
    pair_of = [[place[id(c)] for c in contrasts[k]] for k in pairs]
    done = {*single, *pairs}
    shared = [k for k in range(len(contrasts)) if k not in done]
    ends = np.cumsum([contrasts[k][0].freedom for k in shared], dtype=np.int64)
    spans = [slice(int(e) - contrasts[k][0].freedom, int(e)) for e, k in zip(ends, shared, strict=True)]
    stacked = np.concatenate([np.zeros((n, 2, 0)), *(added(contrasts[k]) for k in shared)], axis=2)
    specimens: dict[int, list[EffectCourse]] = {}
    for k in single:
        specimens.setdefault(contrasts[k][0].specimen, []).append(contrasts[k][0])
    terms = []
    for specimen, courses in specimens.items():
        columns = np.concatenate([c.values for c in courses], axis=2)
        each = np.arange(columns.shape[2])
        terms.append((specimen, courses[0].tests, columns, _products(columns, each, each)))
    return Terms(
        stacked, tuple(spans), *_shared_products(stacked, spans), np.array(shared, np.int64), tuple(terms),
        np.array(single, np.int64), np.array(pair_of, np.int64).reshape(-1, 2), np.array(pairs, np.int64),
        about_one,
    )  # fmt: skip


def _shared_products(
    columns: FloatArray, spans: Sequence[slice]
) -> tuple[FloatArray, tuple[slice, ...], tuple[tuple[Index, Index], ...]]:
    """Products of the columns of each contrast, and where they are: ``products``, ``pairs`` and ``places`` of Terms."""
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
    return _products(columns, *sides), tuple(pairs), tuple(places)


def _products(columns: FloatArray, first: Index, second: Index) -> FloatArray:
    """Static, mixed and sliding products of columns (n, 2, k), (3, n, m)."""
    static, sliding = columns[:, 0], columns[:, 1]
    products = np.empty((3, len(columns), len(first)))
    np.multiply(static[:, first], static[:, second], out=products[0])
    np.multiply(static[:, first], sliding[:, second], out=products[1])
    products[1] += sliding[:, first] * static[:, second]
    np.multiply(sliding[:, first], sliding[:, second], out=products[2])
    return products


@displayed()
@dataclass(frozen=True)
class TermProducts:
    """Products of terms with the model, whatever its random sizes are.

    With its columns: ``own`` (r, S, 4, k), or (r, 4, k) of terms that have a specimen of their own, and ``border``
    (r, m, k); with the residual, ``score`` (r, k); with each other, ``information`` (r, m).
    """

    own: FloatArray
    border: FloatArray
    score: FloatArray
    information: FloatArray


def _term_products(fitted: Replicates, terms: Terms) -> tuple[TermProducts, list[TermProducts]]:
    """Of the shared terms, and of those of each specimen."""
    static, mixed, sliding = (fitted.precision[:, i] for i in range(3))
    first, second = fitted.residual[:, 0], fitted.residual[:, 1]
    residual = np.stack([static * first + mixed * second, mixed * first + sliding * second], axis=2)  # weighted
    r = len(residual)
    n, _, k = terms.columns.shape
    score = residual.reshape(r, 2 * n) @ terms.columns.reshape(2 * n, k)
    information = fitted.precision.reshape(r, 3 * n) @ terms.products.reshape(3 * n, terms.products.shape[2])
    each = []
    for _, tests, columns, squares in terms.single:
        t, k = len(tests), columns.shape[2]
        each.append(
            TermProducts(
                fitted.weighted.own_times(tests, columns),
                fitted.weighted.border_times(tests, columns),
                residual[:, tests].reshape(r, 2 * t) @ columns.reshape(2 * t, k),
                fitted.precision[:, :, tests].reshape(r, 3 * t) @ squares.reshape(3 * t, k),
            )
        )
    return TermProducts(*fitted.weighted.times(terms.columns), score, information), each


def scores(fitted: Replicates, terms: Terms, steps: int = len(SIZE_STEPS)) -> tuple[FloatArray, list[FloatArray]]:
    """Score test of every contrast beyond the model's own columns.

    A contrast that is present as a whole or absent is tested at its known size: its chi-squared value is twice the log
    likelihood ratio of a coefficient about one against zero.

    The scores are taken at several sizes of the random effects, the first ``steps`` of SIZE_STEPS from the fitted
    ones; each pays what it loses of the likelihood of the model without the contrast. Returns the largest
    chi-squared values (r, contrasts) and the coefficients of each contrast, (r, d) each, at the first sizes.
    """
    products, right = _term_products(fitted, terms), fitted.weighted.with_residual(fitted.residual)
    best: FloatArray = np.zeros(0)
    first: list[FloatArray] = []
    evidence = []
    for k in range(steps):
        roots, likelihood = _at_step(fitted, right, k)
        chi2, coefficients = _scores_at(terms, products, roots)
        evidence.append(likelihood)
        chi2 = chi2 + 2.0 * likelihood[:, None]
        if k == OF_SEVERAL:
            chi2[:, np.setdiff1d(np.arange(chi2.shape[1]), terms.shared_at)] = -np.inf
        best, first = (chi2, coefficients) if k == 0 else (np.maximum(best, chi2), first)
    return np.maximum(best - 2.0 * np.max(evidence, axis=0)[:, None], 0.0), first


def informations(fitted: Replicates, terms: Terms) -> tuple[FloatArray, FloatArray]:
    """Information (r, contrasts) and score (r, contrasts) of contrasts of one column beyond the model, at the fitted
    sizes; both zero where the model takes the column up."""
    roots, _ = _at_step(fitted, fitted.weighted.with_residual(fitted.residual), 0)
    score, left, whole = _one_column(terms, _term_products(fitted, terms), roots)[0]
    seen = left > TAKEN_UP * whole
    return np.where(seen, left, 0.0), np.where(seen, score, 0.0)


def _at_step(fitted: Replicates, right: Sides, index: int) -> tuple[BlockCholesky, FloatArray]:
    """The normal matrix at one of SIZE_STEPS, and the log likelihood (r,) of the model without contrasts."""
    columns = fitted.weighted.columns
    prior = columns.prior(fitted.of_effects * np.exp(-2.0 * np.append(SIZE_STEPS[index], 0.0))[fitted.group])
    roots = block_cholesky(fitted.normal.with_prior(*columns.sides(prior)), right)
    squares = sum(np.sum(side**2, axis=tuple(range(1, side.ndim))) for side in roots.right)
    likelihood = 0.5 * np.log(prior).sum(axis=1) - roots.log_root + 0.5 * squares + fitted.log_priors[index]
    return roots, np.asarray(likelihood)


def _scores_at(
    terms: Terms, products: tuple[TermProducts, list[TermProducts]], roots: BlockCholesky
) -> tuple[FloatArray, list[FloatArray]]:
    """Chi-squared values and coefficients of all contrasts."""
    (score, left, whole), taken, shared_score = _one_column(terms, products, roots)
    seen = left > TAKEN_UP * whole
    toward_one = score + terms.about_one
    alone = np.where(seen, toward_one / np.maximum(left + terms.about_one, 1e-300), 0.0)
    chi2 = np.where(seen, alone * toward_one - terms.about_one, 0.0)
    coefficients = list(alone.T[:, :, None])
    for k, span, pair, place in zip(terms.shared_at, terms.spans, terms.pairs, terms.places, strict=True):
        d = span.stop - span.start
        if d > 1:
            own = np.zeros((len(score), d, d))
            own[:, place[0], place[1]] = products[0].information[:, pair]
            crossed, pull = taken[:, :, span], shared_score[:, span]
            floor = ROUNDING * (np.diagonal(own, axis1=1, axis2=2) + 1e-12)
            information = own - crossed.transpose(0, 2, 1) @ crossed + floor[:, :, None] * np.eye(d)
            coefficients[k] = np.asarray(np.linalg.solve(information, pull[:, :, None])[:, :, 0])
            chi2[:, k] = np.sum(pull * coefficients[k], axis=1)
    return chi2, coefficients


def _one_column(
    terms: Terms, products: tuple[TermProducts, list[TermProducts]], roots: BlockCholesky
) -> tuple[tuple[FloatArray, FloatArray, FloatArray], FloatArray, FloatArray]:
    """Of the first column of every contrast: the score beyond the model and the information left and whole,
    (r, contrasts). And of the shared terms: what the model takes of them, (r, 4 S + m, k), and their scores, (r, k)."""
    taken, shared_score = _shared_beyond(products[0], roots)
    pairs = terms.pairs
    first = [span.start for span in terms.spans]
    squares = np.sum(taken[:, :, first] ** 2, axis=1)
    shown = np.array([pair.stop > pair.start for pair in pairs], bool)  # a column of zeros has no products
    score, left, whole = (np.zeros((len(shared_score), len(terms.about_one))) for _ in range(3))
    whole[:, terms.shared_at[shown]] = products[0].information[:, [p.start for p in pairs if p.stop > p.start]]
    left[:, terms.shared_at] = whole[:, terms.shared_at] - squares
    score[:, terms.shared_at] = shared_score[:, first]
    if terms.single:
        each, borders = [], []
        for (specimen, *_), product in zip(terms.single, products[1], strict=True):
            own = roots.own[:, specimen] @ product.own
            border = roots.border_of(product.border, roots.across[:, specimen].transpose(0, 2, 1) @ own)
            of_own = np.einsum("rak,ra->rk", own, roots.right[0][:, specimen])
            beyond = product.score - of_own - np.einsum("rmk,rm->rk", border, roots.right[1])
            rest = product.information - np.sum(own**2, axis=1) - np.sum(border**2, axis=1)
            each.append((beyond, rest, product.information))
            borders.append(border)
        one = [np.concatenate(parts, axis=1) for parts in zip(*each, strict=True)]
        i, j = terms.pair_of.T
        for values, single in zip((score, left, whole), one, strict=True):
            values[:, terms.single_at] = single
            values[:, terms.pair_at] = single[:, i] + single[:, j]
        if len(i):
            left[:, terms.pair_at] -= 2.0 * _in_common(np.concatenate(borders, axis=2), i, j)
    return (score, left, whole), taken, shared_score


def _shared_beyond(product: TermProducts, roots: BlockCholesky) -> tuple[FloatArray, FloatArray]:
    """What the model's own columns have in common with shared terms, (r, 4 S + m, k), and the scores beyond them."""
    own = roots.own @ product.own
    r, specimens, each, k = own.shape
    flat = own.reshape(r, each * specimens, k)
    taken = roots.across.reshape(r, each * specimens, roots.across.shape[3]).transpose(0, 2, 1) @ flat
    crossed = np.concatenate([flat, roots.border_of(product.border, taken)], axis=1)
    right = np.concatenate([roots.right[0].reshape(r, each * specimens), roots.right[1]], axis=1)
    return crossed, product.score - np.einsum("rpk,rp->rk", crossed, right, optimize=True)


def _in_common(border: FloatArray, i: Index, j: Index) -> FloatArray:
    """Inner products (r, pairs) of the columns ``i`` and ``j`` of what is left in the border, (r, m, k)."""
    used, place = np.unique(np.concatenate([i, j]), return_inverse=True)
    first, second = place[: len(i)], place[len(i) :]
    products = np.empty((len(border), len(i)))
    for r, columns in enumerate(border[:, :, used]):
        products[r] = (columns.T @ columns)[first, second]
    return products


@displayed()
@dataclass(frozen=True)
class StartEffects:
    """The effects of all candidates at their start values, made once for a fitted ``model``.

    ``courses`` are those of the candidates ``acting`` (:func:`tribo.diagnostics.model.start_changes`), both (k,).
    ``length`` (k,) is the strength with which each would show beside the model's own columns, as a standard normal
    deviate, ``pull`` (k,) its score there and ``size`` (k,) its peak-to-peak effect in ln T beyond the law, where it
    was computed. ``absorbed`` holds the mechanisms of which almost nothing is left at every size that a fit would start
    from: "absorbed" where the calibration on the flat sample takes up their effect, "hidden" where the errors of the
    model for the patterns, or of specimens, days and drift, take up what the calibration leaves.
    """

    model: ModelFit
    acting: Sequence[Acting]
    courses: Sequence[tuple[EffectCourse, ...]]
    length: FloatArray
    pull: FloatArray
    size: FloatArray
    absorbed: Mapping[str, Absorption]


def start_effects(f: ModelFit) -> StartEffects:
    """The effects of all candidates on top of a fit; the size of pairs of specimens is infinite where there are very
    many of them."""
    acting, every_course, every_start = start_changes(f.setup, f.law)
    terms = terms_of(every_course, np.zeros(len(acting)), f.setup.observations.n)
    left, pull = (each[0] for each in informations(as_measured(f), terms))
    alone = np.array([len(courses) == 1 for courses in every_course])
    sized = alone if np.sum(~alone) > MOST_PAIRS else np.ones(len(alone), bool)
    size = np.full(len(sized), np.inf)
    size[sized] = f.size_beyond_law(added(every_course[k])[:, :, 0] for k in np.flatnonzero(sized))
    return StartEffects(f, acting, every_course, np.sqrt(left), pull, size, _absorbed(f, every_start))


def _absorbed(f: ModelFit, every_start: Mapping[str, FloatArray]) -> dict[str, Absorption]:
    found: dict[str, Absorption] = {}
    for name, columns in every_start.items():
        whole = np.sum(columns**2, axis=(0, 1))
        kept = np.sum(f.cleared(columns)[0] ** 2, axis=0) * np.mean(np.diag(f.noise.repeat))
        if columns.shape[2] and not np.any(kept >= SEEN * np.maximum(whole, 1e-30)):
            beside_law = np.sum(f.beyond_law(columns) ** 2, axis=(0, 1))
            found[name] = "hidden" if np.any(beside_law >= SEEN * np.maximum(whole, 1e-30)) else "absorbed"
    return found


@displayed()
@dataclass(frozen=True)
class RecordedInPart:
    """A column with gaps.

    Parameters
    ----------
    column : str
        Its name.
    share : float
        Share of the tests for which it is recorded.
    p : float
        Chance that tests with and without a value differ in friction as they do, beyond all that the model explains,
        where gaps have nothing to do with friction; adjusted for the number of such columns.
    doubted : bool
        Whether this is beyond chance.
    """

    column: str
    share: float
    p: float
    doubted: bool


def gaps_in(o: Observations) -> dict[str, np.ndarray]:
    """The tests (n,) without a value, of every column that is recorded for some of them."""
    c = o.conditions
    numbers = {
        "run_order": c.run_order, "specimen_run": c.specimen_run, "started_at": c.elapsed_s,
        "temperature_C": c.recorded("temperature_C"), "humidity_pct": c.recorded("humidity_pct"),
        "speed_mm_s": c.recorded("speed_m_s"), "hold_s": c.recorded("hold_s"),
    }  # fmt: skip
    missing = {name: ~np.isfinite(values) for name, values in numbers.items()}
    missing |= {name: c.not_recorded(name) for name in c.columns}
    return {name: gaps for name, gaps in missing.items() if gaps.any() and not gaps.all()}


def recorded_in_part(model: ModelFit, level: float) -> tuple[RecordedInPart, ...]:
    """Every column with gaps, and whether friction differs with them beyond the model: a score test of one step in
    static and one in sliding friction."""
    gaps = gaps_in(model.setup.observations)
    different = len({tuple(missing.tolist()) for missing in gaps.values()})
    found = []
    for column, missing in gaps.items():
        p = min(_p_of_step(model, missing * 1.0) * different, 1.0)
        found.append(RecordedInPart(column, float(1.0 - missing.mean()), p, p < level))
    return tuple(found)


def _p_of_step(model: ModelFit, step: FloatArray) -> float:
    left, residual = model.cleared(step[:, None, None] * np.eye(2))
    pull, information = left.T @ residual, left.T @ left
    size = float(pull @ np.linalg.lstsq(information, pull, rcond=1e-6)[0])
    return float(chi2.sf(max(size, 0.0), 2))
