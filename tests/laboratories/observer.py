"""How clearly a change would show to an observer who knows the covariance of nuisance, specimens and repeats.

Generalised least squares of the change's own course, beside the free law of every sample: the strength is the expected
z of its amplitude. The covariance is that of many draws of the same specimens and nuisance, known to be zero between
specimens and between days where these are drawn apart.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import cho_solve

from .campaign import LaboratoryBench, both
from .laboratory import Laboratory, day_of
from .nuisance import DAYS, DAYS_APART, DRIFT, Nuisance, course_of
from .odd_shapes import TOGETHER, of_samples, one_specimen, pattern_deviations, repeat_sds

DRAWS = 1000
READING = {"zero": 0.001, "rise": 0.05}  # N, and ln of the stiffness: what one pull leaves open
FOUND = 4.5  # strength from which the observer finds a change


class Observer:
    """The observer of one campaign's design.

    Parameters
    ----------
    bench : LaboratoryBench
        Before anything is hidden in it.
    laboratory : Laboratory
        How specimens and repeats scatter.
    nuisance : sequence of Nuisance
        Their kinds, forms and sizes.
    patterns_known : bool
        Whether the law of every sample is free (False), or the law of the flat sample alone, the patterns being known
        up to deviations of known covariance.
    """

    def __init__(
        self, bench: LaboratoryBench, laboratory: Laboratory, nuisance: Sequence[Nuisance] = (),
        patterns_known: bool = False, draws: int = DRAWS,
    ) -> None:  # fmt: skip
        tests, rng = bench.tests, np.random.default_rng(len(bench.tests))
        n = len(tests)
        specimen = np.tile(tests["specimen"].to_numpy(str), 2)
        day, regime = np.tile(day_of(tests), 2), np.repeat([0, 1], n)
        sd = repeat_sds(laboratory, tests).T.ravel()
        repeats = np.diag(sd**2)
        half = np.arange(n)
        repeats[half, half + n] = repeats[half + n, half] = TOGETHER * sd[:n] * sd[n:]
        covariance = repeats.copy()
        loads, at = np.unique(bench.column("N"), return_inverse=True)
        of_one = _products([one_specimen(laboratory, rng)(np.log(loads)) for _ in range(draws)])
        place = np.concatenate([at, at + len(loads)])
        covariance += of_one[np.ix_(place, place)] * (specimen[:, None] == specimen)
        for one in nuisance:
            own = _products([course_of(one, tests, rng) for _ in range(draws)])
            if one.kind in (DAYS, DAYS_APART):
                own *= day[:, None] == day
            if one.kind == DAYS_APART:
                own *= regime[:, None] == regime
            if one.kind not in (DAYS, DAYS_APART, DRIFT):
                own *= specimen[:, None] == specimen
            covariance += own
        if patterns_known:
            names, which = np.unique(bench.column("sample").astype(str), return_inverse=True)
            pairs = [(str(name), float(load)) for name in names for load in loads]
            samples, load = [name for name, _ in pairs], np.array([load for _, load in pairs])
            of_pairs = _products(
                [of_samples(pattern_deviations(laboratory, rng), samples, load) for _ in range(draws)]
            )
            place = np.concatenate([which * len(loads) + at, which * len(loads) + at + len(pairs)])
            covariance += of_pairs[np.ix_(place, place)]
        self.repeats, self.others, self.tails = repeats, covariance - repeats, laboratory.tails
        self.cholesky = np.linalg.cholesky(covariance)
        self.free = _free_laws(bench, patterns_known)
        self.solved = cho_solve((self.cholesky, True), self.free)

    def strength(self, change: np.ndarray) -> float:
        """The expected z of a change (n, 2) of ln T."""
        d = change.T.ravel()
        own = cho_solve((self.cholesky, True), d)
        absorbed = np.linalg.lstsq(self.free.T @ self.solved, self.free.T @ own, rcond=None)[0]
        return float(np.sqrt(max(d @ own - (self.free.T @ own) @ absorbed, 0.0)))


def seen_in_traces(bench: LaboratoryBench, plain: LaboratoryBench) -> float:
    """Strength of what shows in the zero and in the rise of the recorded curves, which no nuisance touches."""
    zero = np.sum(((bench.zero - plain.zero) / READING["zero"]) ** 2)
    stiffer = np.log(bench.stiffness_N_per_mm / plain.stiffness_N_per_mm)
    return float(np.sqrt(zero + np.sum(((stiffer - stiffer.mean()) / READING["rise"]) ** 2)))


def _products(draws: list[np.ndarray]) -> np.ndarray:
    """Mean product of every pair of numbers, static before sliding, over the draws."""
    rows = np.array([d.T.ravel() for d in draws])
    return np.asarray(rows.T @ rows / len(rows))


def _free_laws(bench: LaboratoryBench, patterns_known: bool) -> np.ndarray:
    """What coefficient and adhesion of each law change in ln T: of every sample, or the one of the flat sample."""
    names = np.where(patterns_known, "F", bench.column("sample").astype(str))
    load, force = bench.column("N"), both(bench)
    columns = []
    for regime in (0, 1):
        for name in np.unique(names):
            here = names == name
            for part in (load, np.ones_like(load)):
                column = np.zeros(2 * len(load))
                column[regime * len(load) : (regime + 1) * len(load)] = here * part / force[:, regime]
                columns.append(column / np.abs(column).max())
    return np.array(columns).T
