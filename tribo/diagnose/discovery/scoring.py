"""Scores of all laws of a campaign at once: what each would gain in log likelihood, at a given noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array, diags_array

from tribo.diagnose.discovery.grammar import Group
from tribo.diagnose.discovery.written_law import ADHESION_TERM, LOAD_TERM, Shape, WrittenLaw
from tribo.diagnose.statistics.linearisation import Linear, ModelFit, whitened
from tribo.diagnose.statistics.model import log_forces
from tribo.diagnose.statistics.scores import TAKEN_UP, cleared
from tribo.mechanisms.record import Conditions
from tribo.records import REGIMES, FloatArray


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


def acts_of(group: Group, c: Conditions, terms: Mapping[str, FloatArray]) -> FloatArray:
    """By how much a law of this group changes ln T of every test and regime where its course is one, (n, 2)."""
    acts = terms.get(group.acts_on, np.ones((len(c.sample), 2)))
    in_regime = np.array([group.regime != REGIMES[1], group.regime != REGIMES[0]])
    return np.asarray(acts * in_regime * group.law(()).weight(c)[:, None])


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
        self.own, self.border = self._bases(linear)
        right = whitened(self.factor, residual.transpose(1, 2, 0))
        absorbed = self.own.T @ (self.own @ right) + self.border.T @ (self.border @ right)
        self.left = (right - absorbed).T  # (r, 2n)

    def _bases(self, linear: Linear) -> tuple[csr_array, FloatArray]:
        """Rows whose products with a whitened column are what the model absorbs: of the specimens (4 S, 2n), each on
        its own tests, and of the columns that tests share (m, 2n)."""
        found = cleared(linear.normal, linear.right)
        specimen = np.tile(linear.random_effects.specimen, 2)
        white = whitened(self.factor, linear.columns.own)
        own = np.einsum("nab,nb->na", found.own[0, specimen], white)
        taken = np.einsum("na,nam->nm", own, found.across[0, specimen])
        border = found.border[0] @ (whitened(self.factor, linear.columns.border) - taken).T
        rows = 4 * specimen[:, None] + np.arange(4)
        tests = np.repeat(np.arange(2 * self.n), 4)
        shape = (4 * linear.random_effects.specimens, 2 * self.n)
        return csr_array((own.ravel(), (rows.ravel(), tests)), shape), border

    def gains(self, courses: Courses, acts: FloatArray) -> FloatArray:
        """Log likelihood gained by each course times ``acts`` (n, 2) at its best amplitude, (r, k)."""
        own, pull, _ = self.products(courses.first, acts)
        found = 0.5 * pull**2 / own
        if courses.second.shape[1]:
            found[:, courses.two] = self._of_waves(courses, acts)
        return found

    def products(self, course: FloatArray, acts: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Information (k,), inf where nothing is left, pull (r, k) and absorbed part (p + q, k) of columns."""
        static = self.factor[:, 0, 0] * acts[:, 0]
        sliding = self.factor[:, 1, 0] * acts[:, 0] + self.factor[:, 1, 1] * acts[:, 1]
        whole = (static**2 + sliding**2) @ course**2
        both = np.concatenate([static, sliding])
        own_rows = self.own @ diags_array(both)
        own_part = (own_rows[:, : self.n] + own_rows[:, self.n :]) @ course
        absorbed = np.concatenate([own_part, self._onto(self.border, static, sliding) @ course])
        own = whole - np.sum(absorbed**2, axis=0)
        pull = self._onto(self.left, static, sliding) @ course
        return np.where(own > TAKEN_UP * whole + 1e-12, own, np.inf), pull, absorbed

    def joint_gain(self, columns: FloatArray) -> float:
        """Log likelihood gained by columns (n, 2, k) together at their best amplitudes."""
        white = whitened(self.factor, columns)
        absorbed, pull = np.concatenate([self.own @ white, self.border @ white]), (self.left @ white)[0]
        own = white.T @ white - absorbed.T @ absorbed
        return float(0.5 * pull @ np.linalg.lstsq(own, pull, rcond=1e-9)[0])

    def _onto(self, rows: FloatArray, static: FloatArray, sliding: FloatArray) -> FloatArray:
        return np.asarray(rows[:, : self.n] * static + rows[:, self.n :] * sliding)

    def _of_waves(self, courses: Courses, acts: FloatArray) -> FloatArray:
        """Of shapes of two columns; the second amplitude costs one unit."""
        first, second = courses.first[:, courses.two], courses.second
        own1, pull1, absorbed1 = self.products(first, acts)
        own2, pull2, absorbed2 = self.products(second, acts)
        static = self.factor[:, 0, 0] * acts[:, 0]
        sliding = self.factor[:, 1, 0] * acts[:, 0] + self.factor[:, 1, 1] * acts[:, 1]
        mixed = (static**2 + sliding**2) @ (first * second) - np.sum(absorbed1 * absorbed2, axis=0)
        with np.errstate(invalid="ignore"):
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
