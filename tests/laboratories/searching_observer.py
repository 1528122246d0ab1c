"""An observer who knows the covariance of a campaign and has to search: for columns, samples, regimes, term and course.

Courses are splines of three resolutions, surfaces and stairs of two columns, and values of names. Each is fitted by
generalised least squares beside the free law of every sample; as the covariance is known, what it gains follows
chi-square, and the smallest chance is multiplied by the number of all that was tried (Bonferroni). Lots are not tried:
they are sets of specimens, some of which lie far out.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from typing import NamedTuple

import numpy as np
from scipy.interpolate import BSpline
from scipy.linalg import qr, solve_triangular
from scipy.stats import chi2, rankdata

from .campaign import LaboratoryBench, both
from .observer import Observer
from .odd_shapes import HEAVY

NUMBERS = ("temperature_C", "humidity_pct", "film_um", "speed_mm_s", "hold_s", "wear_um", "run_order")
NAMES = ("operator", "recipe")
ALONE = (4, 8, 16)  # B-splines along one column
OF_A_SURFACE = 4  # along each of two
STAIRS = 3  # steps along each of two


class Found(NamedTuple):
    """The least likely of all that was tried: its columns, and its chance where nothing is hidden."""

    columns: tuple[str, ...]
    chance: float


def search(observer: Observer, bare: LaboratoryBench, made: LaboratoryBench) -> Found:
    """What an observer finds in a campaign.

    Parameters
    ----------
    observer : Observer
        Of the design, with the law of every sample free.
    bare, made : LaboratoryBench
        Before anything is hidden and scatters, and as it was measured.
    """
    deviation = (np.log(both(made)) - np.log(both(bare))).T.ravel()
    lower = _cholesky(observer, deviation)
    free = qr(solve_triangular(lower, observer.free, lower=True), mode="economic")[0]

    def cleared(columns: np.ndarray) -> np.ndarray:
        white = solve_triangular(lower, columns, lower=True)
        return np.asarray(white - free @ (free.T @ white))

    measured = cleared(deviation[:, None])[:, 0]
    sample = bare.column("sample").astype(str)
    chosen, shares = _sets(np.unique(sample)), _shares_of_terms(bare)
    parts = (sample == np.unique(sample)[:, None]).astype(float)
    tried, least = 0, Found((), 0.0)
    for columns, course in _courses(bare):
        m = course.shape[1]
        for share in shares:
            blocks = [
                np.vstack([(own * share[:, k])[:, None] * course * (k == regime) for k in (0, 1)])
                for own in parts for regime in (0, 1)
            ]  # fmt: skip
            white = cleared(np.hstack(blocks))
            gram = (white.T @ white).reshape(len(blocks), m, len(blocks), m)
            score = (white.T @ measured).reshape(len(blocks), m)
            information = np.einsum("ha,hb,aibj->hij", chosen, chosen, gram, optimize=True)
            scores = chosen @ score
            ridge = (1e-8 * np.trace(information, axis1=1, axis2=2) / m + 1e-12)[:, None, None] * np.eye(m)
            gains = np.einsum("hi,hi->h", scores, np.linalg.solve(information + ridge, scores[..., None])[..., 0])
            tried += len(gains)
            log_chance = float(chi2.logsf(gains.max(), m))
            if log_chance < least.chance:
                least = Found(columns, log_chance)
    return Found(least.columns, float(min(np.exp(least.chance) * tried, 1.0)))


def _cholesky(observer: Observer, deviation: np.ndarray) -> np.ndarray:
    """Of the covariance of ln T, static before sliding. Where repeats have heavy tails, pulls that lie far out count
    less: their scale is estimated by expectation-maximisation with nothing hidden."""
    if observer.tails == "normal":
        return observer.cholesky
    n = len(deviation) // 2
    scale = (HEAVY - 2) / HEAVY * observer.repeats
    pulls = np.arange(n)[:, None] + np.array([0, n])
    block = pulls[:, :, None], pulls[:, None, :]
    inverse, repeats = np.linalg.inv(scale[block]), scale
    for _ in range(5):
        lower = np.linalg.cholesky(repeats + observer.others)
        through = solve_triangular(lower, np.column_stack([repeats, deviation, observer.free]), lower=True)
        free = qr(through[:, 2 * n + 1 :], mode="economic")[0]
        through = through[:, : 2 * n + 1] - free @ (free.T @ through[:, : 2 * n + 1])
        own, known = through[:, : 2 * n].T @ through[:, 2 * n], through[:, : 2 * n].T @ through[:, : 2 * n]
        squares = own[pulls][:, :, None] * own[pulls][:, None, :] + (repeats - known)[block]
        weight = (HEAVY + 2) / (HEAVY + np.sum(inverse * squares, axis=(1, 2)))
        root = np.tile(np.sqrt(weight), 2)
        repeats = scale / np.outer(root, root)
    return np.linalg.cholesky(repeats + observer.others)


def _sets(names: np.ndarray) -> np.ndarray:
    """Sets of samples and of regimes, (h, 2 s) of 0 and 1, a sample's static friction before its sliding one: every
    sample, pair of samples and all but one, in one regime or in both."""
    sizes = {1, min(2, len(names)), max(len(names) - 1, 1), len(names)}
    sets = [np.isin(np.arange(len(names)), some) for k in sizes for some in combinations(range(len(names)), k)]
    return np.array([np.kron(some, regimes) for some in sets for regimes in ((1, 1), (1, 0), (0, 1))], float)


def _shares_of_terms(bench: LaboratoryBench) -> list[np.ndarray]:
    """By how much ln T of every test (n, 2) follows the logarithm of itself, of its friction term and its adhesion."""
    adhesive = np.clip(bench.adhesion_N() / both(bench), 0, 1)
    return [np.ones_like(adhesive), 1 - adhesive, adhesive]


def _courses(bench: LaboratoryBench) -> Iterator[tuple[tuple[str, ...], np.ndarray]]:
    """Columns, and the courses (n, m) along them that are tried; a constant is not among them."""
    numbers = [name for name in NUMBERS if np.ptp(bench.column(name)) > 0]
    along = {name: (rankdata(bench.column(name)) - 0.5) / len(bench.tests) for name in numbers}
    for name, u in along.items():
        for m in ALONE:
            yield (name,), _splines(u, m)[:, 1:]
    for name in NAMES:
        values = bench.column(name).astype(str)
        yield (name,), (values[:, None] == np.unique(values)[1:]).astype(float)
    for pair in combinations((name for name in numbers if name != "run_order"), 2):
        for each in ([_splines(along[name], OF_A_SURFACE) for name in pair], [_stairs(along[name]) for name in pair]):
            surface = np.einsum("ni,nj->nij", *each).reshape(len(bench.tests), -1)[:, 1:]
            yield pair, surface


def _splines(u: np.ndarray, m: int) -> np.ndarray:
    """Cubic B-splines with even knots on 0 to 1, (n, m)."""
    inner = np.linspace(0, 1, m - 2)
    return np.asarray(BSpline.design_matrix(u, np.concatenate([[0] * 3, inner, [1] * 3]), 3).toarray())


def _stairs(u: np.ndarray) -> np.ndarray:
    """Equal steps on 0 to 1, (n, STAIRS)."""
    return (np.minimum((STAIRS * u).astype(int), STAIRS - 1)[:, None] == np.arange(STAIRS)).astype(float)
