"""How strongly each look is followed, and how strongly by chance: the maximum over all looks, simulated."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, ndtri

from tribo.diagnose.search.looks import Look, all_looks
from tribo.diagnose.statistics.chance import as_measured, drawn_residuals, refit
from tribo.diagnose.statistics.fit import fit
from tribo.diagnose.statistics.linearisation import ModelFit
from tribo.diagnose.statistics.model import start_changes, with_form_error
from tribo.diagnose.statistics.scatter import ROUNDING, SIZE_STEPS, Replicates
from tribo.display import displayed
from tribo.records import FloatArray

Progress = Callable[[str, int, int], None]
AT_ONCE = 20  # replicates, between two looks at whether they suffice
FEWEST = 40
FORM = 0.12  # by how much of its own effect a law may be wrong in form, sample by sample
AS_FITTED = 1  # of the steps of the sizes, the first
TAKEN_UP = 1e-6  # share of a column's information below which nothing of it is left to see


@displayed()
@dataclass(frozen=True)
class Screen:
    """Strength of every look as a standard normal deviate, and what chance gives.

    ``p`` (looks,) is the adjusted p value of each. ``chance`` (replicates,) is the strongest look in each simulated
    campaign of the fitted model, ``chance_library`` the strongest of the mechanisms alone. ``size`` (looks,) is the
    peak-to-peak effect in ln T that the calibration does not absorb, ``coefficients`` those of each look's columns.
    """

    looks: tuple[Look, ...]
    strength: FloatArray
    size: FloatArray
    coefficients: tuple[FloatArray, ...]
    chance: FloatArray
    chance_library: FloatArray
    p: FloatArray

    def p_adjusted(self, strength: float | None = None) -> float:
        """Chance that some look is at least this strong (default: the strongest) with nothing hidden."""
        value = float(self.strength.max()) if strength is None else strength
        return share_beyond(self.chance, value)

    def p_library(self, strength: float) -> float:
        """Chance that some mechanism is at least this strong with nothing hidden."""
        return share_beyond(self.chance_library, strength)


def share_beyond(chance: FloatArray, value: float) -> float:
    """Share of replicates (r,) at or above a value, beyond the last one by a fitted Gumbel tail; NaN without any."""
    if not len(chance):
        return float("nan")
    counted = (1 + np.sum(chance >= value)) / (1 + len(chance))
    if counted > 5.0 / len(chance):
        return float(counted)
    scale = max(float(np.std(chance)) * np.sqrt(6) / np.pi, 1e-3)
    above_mode = (value - float(np.mean(chance))) / scale + np.euler_gamma
    fitted = float(-np.expm1(-np.exp(-above_mode)))
    return min(float(counted), max(fitted, 1e-12))


def screen(
    f: ModelFit,
    looks: Sequence[Look],
    *,
    replicates: int,
    rng: np.random.Generator,
    progress: Progress | None = None,
) -> Screen:
    """Look at a fitted model in every way, then do the same with up to ``replicates`` campaigns it makes itself.

    Replicates end once the strongest look is clearly within chance, or clearly beyond it.
    """
    ready = columns_of(looks)
    strengths, found = strengths_of(as_measured(f), ready)
    strength, coefficients = strengths[0], [c[0] for c in found]
    shapes = [look.columns @ c for look, c in zip(looks, coefficients, strict=True)]
    size = np.ptp(f.linear.beyond_law(np.stack(shapes, axis=2)), axis=(0, 1))
    library = np.array([look.kind == "mechanism" for look in looks])
    chance = np.zeros((0, 2))
    while len(chance) < replicates:
        drawn = drawn_residuals(f, rng, min(AT_ONCE, replicates - len(chance)))
        made = refit(f, drawn)
        strengths, _ = strengths_of(made, ready)
        chance = np.concatenate([chance, _strongest(strengths, library)])
        if progress is not None:
            progress("diagnose", len(chance), replicates)
        if decided(chance[:, 0], float(strength.max())):
            break
    p = np.array([share_beyond(chance[:, 0], float(value)) for value in strength])
    return Screen(tuple(looks), strength, size, tuple(coefficients), chance[:, 0], chance[:, 1], p)


def screen_left(
    model: ModelFit, *, replicates: int, rng: np.random.Generator, progress: Progress | None = None
) -> Screen:
    """What is left after a model, its laws allowed to be wrong in form by a share of their own effect."""
    wider = with_form_error(model.setup, model.law, model.acting, model.values, FORM)
    widened = fit(wider, model.acting, start=model, iterations=10)
    looks = all_looks(wider, start_changes(wider, widened.law))
    return screen(widened, looks, replicates=replicates, rng=rng, progress=progress)


def _strongest(strengths: FloatArray, library: NDArray[np.bool_]) -> FloatArray:
    """The strongest look of every replicate, and the strongest of the library's alone, (r, 2)."""
    alone = strengths[:, library].max(axis=1) if library.any() else np.full(len(strengths), -np.inf)
    return np.column_stack([strengths.max(axis=1), alone])


def decided(chance: FloatArray, strongest: float) -> bool:
    """Whether further replicates could not change the decision at one percent: a sequential Monte Carlo test.

    Ten replicates as strong say "within chance" (Besag and Clifford 1991); ten standard deviations beyond
    their mean say the opposite.
    """
    if len(chance) < FEWEST:
        return False
    beyond = strongest > float(np.mean(chance) + 10.0 * np.std(chance))
    return bool(np.sum(chance >= strongest) >= 10 or beyond)


def strengths_of(fitted: Replicates, looks: Columns) -> tuple[FloatArray, list[FloatArray]]:
    """Strength of every look as a standard normal deviate, (r, looks), and the coefficients of each, (r, d)."""
    chi2, coefficients = scores(fitted, looks)
    return deviate(chi2, np.array([span.stop - span.start for span in looks.spans])), coefficients


def deviate(chi2: FloatArray, freedom: FloatArray) -> FloatArray:
    """The standard normal deviates as rare, two-sided, as chi-squared values; beyond 1e-14 by asymptotics."""
    chi2 = np.maximum(chi2, 0.0)
    p = chdtrc(freedom, chi2)
    far = np.sqrt(chi2) - 0.5 * np.sqrt(np.maximum(freedom - 1.0, 0.0))
    near = np.maximum(-ndtri(np.maximum(0.5 * p, 1e-300)), 0.0)
    return np.where(freedom == 1, np.sqrt(chi2), np.where(p > 1e-14, near, far))


@displayed()
@dataclass(frozen=True)
class Columns:
    """The columns of all looks, (2, n, k) regime by regime, and the products that their informations need.

    Each look spans ``spans`` of the k; ``products`` (3, n, m) are the static, mixed and sliding products of every
    pair of columns of one look, those of each look at ``pairs`` of the m. ``whole`` (looks,) is the precision with
    which the coefficient of a look is known to be one: zero where its size is free.
    """

    columns: FloatArray
    spans: tuple[slice, ...]
    products: FloatArray
    pairs: tuple[slice, ...]
    whole: FloatArray


def columns_of(looks: Sequence[Look]) -> Columns:
    """The columns of all looks, made ready for many replicates."""
    stacked = np.concatenate([look.columns for look in looks], axis=2)
    ends = np.cumsum([look.freedom for look in looks])
    spans = [slice(int(e - look.freedom), int(e)) for e, look in zip(ends, looks, strict=True)]
    return columns_in(stacked, spans, np.array([look.wholeness for look in looks]))


def columns_in(stacked: FloatArray, spans: Sequence[slice], whole: FloatArray | None = None) -> Columns:
    """Columns (n, 2, k) made ready for many replicates, those of each look at one of ``spans``; ``whole`` (looks,) as
    in :class:`Columns`, free by default."""
    columns = np.ascontiguousarray(stacked.transpose(1, 0, 2))
    index = [np.arange(span.start, span.stop) for span in spans]
    first = np.concatenate([np.repeat(i, len(i)) for i in index])
    second = np.concatenate([np.tile(i, len(i)) for i in index])
    ends = np.cumsum([len(i) ** 2 for i in index])
    pairs = [slice(int(end) - len(i) ** 2, int(end)) for end, i in zip(ends, index, strict=True)]
    whole = np.zeros(len(pairs)) if whole is None else whole
    return Columns(columns, tuple(spans), _products(columns, first, second), tuple(pairs), whole)


def _products(columns: FloatArray, first: NDArray[np.int64], second: NDArray[np.int64]) -> FloatArray:
    static, sliding = columns
    mixed = static[:, first] * sliding[:, second] + sliding[:, first] * static[:, second]
    return np.stack([static[:, first] * static[:, second], mixed, sliding[:, first] * sliding[:, second]])


@displayed()
@dataclass(frozen=True)
class Products:
    """Products of the model's columns, the looks and the residual of every replicate, whatever the random sizes are."""

    right: FloatArray  # (r, p)
    crossed: FloatArray  # (r, p, k)
    pull: FloatArray  # (r, k)
    whole: FloatArray  # (r, m)


def scores(fitted: Replicates, looks: Columns, steps: int = len(SIZE_STEPS)) -> tuple[FloatArray, list[FloatArray]]:
    """Score test of every look beyond the model's own columns.

    A look that is present as a whole or absent is tested at its known size: its chi-squared value is twice the log
    likelihood ratio of a coefficient about one against zero.

    The scores are taken at several sizes of the random effects, the first ``steps`` of SIZE_STEPS from the fitted
    ones; each pays what it loses of the likelihood of the model without the look. Returns the largest
    chi-squared values (r, looks) and the coefficients of each look, (r, d) each, at the first sizes.
    """
    found = _products_of(fitted, looks)
    each = [_scores_at(fitted, looks, found, k) for k in range(steps)]
    evidence = np.stack([e for _, _, e in each])
    chi2 = np.stack([c for c, _, _ in each]) + 2.0 * (evidence - evidence.max(axis=0))[:, :, None]
    return np.maximum(chi2.max(axis=0), 0.0), each[0][1]


def _products_of(fitted: Replicates, looks: Columns) -> Products:
    r, columns = len(fitted.precision), looks.columns.reshape(-1, looks.columns.shape[2])
    k = fitted.weighted.shape[1]
    return Products(
        right=np.einsum("rpm,rm->rp", fitted.weighted, fitted.residual.reshape(r, -1)),
        crossed=(fitted.weighted.reshape(r * k, -1) @ columns).reshape(r, k, -1),
        pull=_weighted_residual(fitted) @ columns,
        whole=fitted.precision.reshape(r, -1) @ looks.products.reshape(-1, looks.products.shape[2]),
    )


def _scores_at(
    fitted: Replicates, looks: Columns, found: Products, index: int
) -> tuple[FloatArray, list[FloatArray], FloatArray]:
    """Chi-squared values, coefficients, and the log likelihood (r,) of the model without the looks, at one step."""
    step = SIZE_STEPS[index]
    k = found.right.shape[1]
    prior = fitted.prior * np.exp(-2.0 * np.append(step, 0.0))[fitted.group]
    normal = fitted.normal.copy()
    normal[:, np.arange(k), np.arange(k)] += prior
    scale = 1.0 / np.sqrt(np.diagonal(normal, axis1=1, axis2=2) + 1e-300)
    root = np.linalg.cholesky(normal * scale[:, :, None] * scale[:, None, :] + ROUNDING * np.eye(k))
    clear = np.linalg.inv(root) * scale[:, None, :]
    crossed = clear @ found.crossed
    own = (clear @ found.right[:, :, None])[:, :, 0]
    pull = found.pull - np.einsum("rpk,rp->rk", crossed, own)
    chi2, coefficients = _solved(looks, pull, found.whole, crossed)
    curvature = np.log(np.diagonal(root, axis1=1, axis2=2) / scale).sum(axis=1)
    evidence = 0.5 * np.log(prior).sum(axis=1) - curvature + 0.5 * np.sum(own**2, axis=1) + fitted.log_priors[index]
    return chi2, coefficients, evidence


def _weighted_residual(fitted: Replicates) -> FloatArray:
    static, mixed, sliding = (fitted.precision[:, i] for i in range(3))
    first, second = fitted.residual[:, 0], fitted.residual[:, 1]
    both = np.stack([static * first + mixed * second, mixed * first + sliding * second], axis=1)
    return np.asarray(both.reshape(len(both), -1))


def _solved(
    looks: Columns, pull: FloatArray, whole: FloatArray, crossed: FloatArray
) -> tuple[FloatArray, list[FloatArray]]:
    """Chi-squared values (r, looks) and coefficients of each look, (r, d): those of one column all at once."""
    first = [span.start for span in looks.spans]
    left = whole[:, [pair.start for pair in looks.pairs]] - np.sum(crossed**2, axis=1)[:, first]
    seen = left > TAKEN_UP * whole[:, [pair.start for pair in looks.pairs]]
    toward_one = pull[:, first] + looks.whole
    alone = np.where(seen, toward_one / np.maximum(left + looks.whole, 1e-300), 0.0)
    chi2 = np.where(seen, alone * toward_one - looks.whole, 0.0)
    coefficients = list(alone.T[:, :, None])
    for i, (span, pair) in enumerate(zip(looks.spans, looks.pairs, strict=True)):
        if span.stop > span.start + 1:
            coefficients[i] = _solution(pull[:, span], whole[:, pair], crossed[:, :, span])
            chi2[:, i] = np.sum(pull[:, span] * coefficients[i], axis=1)
    return chi2, coefficients


def _solution(pull: FloatArray, whole: FloatArray, crossed: FloatArray) -> FloatArray:
    """Coefficients of one look (r, d) from its scores (r, d), its raw information (r, d d) and its share (r, p, d) of
    the model's columns."""
    r, d = pull.shape
    whole = whole.reshape(r, d, d)
    floor = ROUNDING * (np.diagonal(whole, axis1=1, axis2=2) + 1e-12)
    information = whole - crossed.transpose(0, 2, 1) @ crossed + floor[:, :, None] * np.eye(d)
    return np.asarray(np.linalg.solve(information, pull[:, :, None])[:, :, 0])
