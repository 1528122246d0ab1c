"""The mixed model of a campaign: the flat law, the shares of each pattern, mechanisms on top, and the random effects.

ln T of test i in regime r = ln law + pattern error + specimen gain + specimen slope x ln p + repeat noise (bivariate
t over the two regimes of one pull). All sizes are estimated from the campaign: gains and slopes of the specimens,
factors on the error that the predictor states for its patterns, and repeats that may differ by sample and by force.
What one specimen alone shows is kept without the tests of the others.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tribo.diagnostics.observations import BENT, Observations, along_specimens, sessions, walks
from tribo.diagnostics.predictor import Predictor
from tribo.display import displayed
from tribo.mechanisms import MECHANISMS
from tribo.mechanisms.record import Base, Conditions, Forces, Mechanism
from tribo.records import FloatArray

# Gain, slope with the load and drift along its pulls, alike in both regimes and apart; the bend of its drift, alike.
OF_A_SPECIMEN = 7


N_LAW = 4  # mu static, tau0 static (kPa), mu sliding, tau0 sliding (kPa)
ADHESION = [1, 3]
FLOOR_N = 1e-6
WITHIN_MEASURED = 3.0  # standard uncertainties: one measurement in 400 lies further off
LAW_SCALE = np.array([1.0, 5.0, 1.0, 5.0])
LAW_BOUNDS = (np.array([0.01, -200.0, 0.01, -200.0]), np.array([100.0, 1000.0, 100.0, 1000.0]))
# Groups of random effects that share one size, each in the mean of both regimes and in their difference: gain and
# slope of the specimens, the drift of each along its pulls, the sessions, the series. The patterns have three: what
# their errors have in common in both regimes, and what each regime has of its own.
GAIN, SLOPE, PATTERN, SPECIMEN_DRIFT, SESSION, DRIFT = 0, 2, 4, 7, 9, 11
OF_PATTERNS = (PATTERN, PATTERN + 1, PATTERN + 2)
WITHIN = 1.5  # times the stated error of the model: the range for which docs/blind.md counts false alarms
COMMON_SHARE = 0.25  # of the smaller variance of an offset: what is expected to be common to both regimes
ALIKE_IN_BOTH, APART = np.array([1.0, 1.0]) / np.sqrt(2.0), np.array([1.0, -1.0]) / np.sqrt(2.0)
FIXED = -1  # the group of effects whose size is not estimated
EVERY = -1  # in place of a specimen: all tests
RECORDED = ("speed_m_s", "hold_s", "temperature_C", "humidity_pct", "specimen_run", "elapsed_s")
DEGREES = 3  # of the polynomials along what a mechanism follows, by which its formula may be off
MOST_PAIRS = 2000  # courses of two specimens that are written out at all


@displayed()
@dataclass(frozen=True)
class Acting:
    """A mechanism that takes part in a model, with its choice (which specimen, which column).

    ``measured`` is its amplitude with its standard uncertainty, where that was measured directly.
    """

    mechanism: Mechanism
    choice: str = ""
    measured: tuple[float, float] | None = None

    @property
    def name(self) -> str:
        """The name in a verdict: ``covariate:operator``."""
        return self.mechanism.called(self.choice)

    @property
    def start(self) -> FloatArray:
        """The parameters from which a fit starts, at the mechanism's full amplitude."""
        return self.mechanism.start()

    def measured_evidence(self, amplitude: float) -> float:
        """Log likelihood by which a direct measurement favours this amplitude over none."""
        if self.measured is None:
            return 0.0
        value, uncertainty = self.measured
        zero = self.mechanism.amplitude.zero
        return 0.5 * (((zero - value) / uncertainty) ** 2 - ((amplitude - value) / uncertainty) ** 2)


@displayed()
@dataclass(frozen=True)
class Setup:
    """What every model of one campaign shares: shares, the design of the random effects, what the repeats depend on.

    ``specimen`` (n,) is the number of the specimen of every test, below ``specimens``, and ``own`` (n, 2, 7) are the
    columns of its random effects, without the zeros of all specimens that a test was not made on; ``shared`` (n, 2, c)
    are those that tests of several specimens show. A vector of all q effects holds those of the specimens one after the
    other, then the shared ones. The standard deviation of effect j is ``unit[j]`` times the size of its ``group[j]``
    (GAIN and so on, plus one for the difference of the regimes; of patterns, plus one for static and two for sliding
    friction alone), or ``unit[j]`` itself where the group is FIXED. ``scatter`` (n, k) holds what the repeats may
    depend on: the sample, and the logarithm of the force. ``first_law`` (4,) is a first guess of the flat law.
    """

    observations: Observations
    predictor: Predictor
    shares: FloatArray
    specimen: NDArray[np.int64]
    specimens: int
    own: FloatArray
    shared: FloatArray
    unit: FloatArray
    group: NDArray[np.int64]
    log_pressure: FloatArray
    scatter: FloatArray
    first_law: FloatArray

    @property
    def of_specimens(self) -> int:
        """How many random effects belong to specimens; the shared ones follow."""
        return OF_A_SPECIMEN * self.specimens

    @property
    def of_patterns(self) -> NDArray[np.bool_]:
        """The random effects that are errors of the model about patterns, (q,)."""
        return np.isin(self.group, OF_PATTERNS)

    @property
    def n_effects(self) -> int:
        """How many random effects there are."""
        return self.of_specimens + int(self.shared.shape[2])

    @cached_property
    def tests_of(self) -> tuple[NDArray[np.int64], ...]:
        """The tests of every specimen, as indices."""
        order = np.argsort(self.specimen, kind="stable")
        ends = np.cumsum(np.bincount(self.specimen, minlength=self.specimens))
        return tuple(np.split(order, ends[:-1]))

    @property
    def dense(self) -> FloatArray:
        """The whole design of the random effects, (n, 2, q)."""
        columns = np.zeros((*self.own.shape[:2], self.specimens, OF_A_SPECIMEN))
        columns[np.arange(len(self.own)), :, self.specimen] = self.own
        return np.concatenate([columns.reshape(*self.own.shape[:2], -1), self.shared], axis=2)

    def on_tests(self, effects: FloatArray) -> FloatArray:
        """What random effects (..., q) add to ln T of every test, (..., n, 2)."""
        own = effects[..., : self.of_specimens].reshape(*effects.shape[:-1], self.specimens, OF_A_SPECIMEN)
        n, regimes, c = self.shared.shape
        of_shared = effects[..., self.of_specimens :] @ self.shared.reshape(n * regimes, c).T
        of_own = np.einsum("nrk,...nk->...nr", self.own, own[..., self.specimen, :])
        return np.asarray(of_own + of_shared.reshape(of_own.shape))

    def summed(self, weight: FloatArray) -> FloatArray:
        """The columns of all random effects (q,), regimes added with ``weight`` (2,) and tests added up."""
        own = np.zeros((self.specimens, OF_A_SPECIMEN))
        np.add.at(own, self.specimen, np.einsum("nrk,r->nk", self.own, weight))
        return np.concatenate([own.ravel(), np.einsum("nrk,r->k", self.shared, weight)])

    def take(self, keep: np.ndarray) -> Setup:
        """The same for the tests picked by a mask or by indices."""
        return replace(
            self, observations=self.observations.take(keep), shares=self.shares[keep], specimen=self.specimen[keep],
            own=self.own[keep], shared=self.shared[keep], log_pressure=self.log_pressure[keep],
            scatter=self.scatter[keep],
        )  # fmt: skip

    def with_effects(self, columns: FloatArray, sd: FloatArray, group: int = FIXED) -> Setup:
        """The same with further random effects along ``columns`` (n, 2, d), of the standard deviations ``sd`` (d,), in
        units of the size of a ``group`` if one is given."""
        return replace(
            self, shared=np.concatenate([self.shared, columns], axis=2), unit=np.concatenate([self.unit, sd]),
            group=np.concatenate([self.group, np.full(len(sd), group)]),
        )  # fmt: skip

    def base(self, law: FloatArray) -> Base:
        """The baseline of every test for the flat law ``law`` = (mu, tau0 kPa) static, then sliding."""
        area = self.observations.conditions.nominal_area_m2
        flat = (law[0], law[1] * 1e3 * area, law[2], law[3] * 1e3 * area)
        s = self.shares
        by_sample = {
            name: (v[0] * flat[0], v[1] * flat[1], v[2] * flat[2], v[3] * flat[3])
            for name, v in self.predictor.shares.items()
        }
        return Base(
            s[:, 0] * flat[0], s[:, 1] * flat[1], s[:, 2] * flat[2], s[:, 3] * flat[3],
            by_sample=by_sample, flat=self.observations.flat,
        )  # fmt: skip


def setup(observations: Observations, predictor: Predictor) -> Setup:
    """Random effects in both regimes: gain, slope and drift of a specimen; offset, slope and curve of a pattern; the
    gain of a session; the drift of the series.

    The error about a pattern is a factor common to both regimes, and an offset, a slope and a curve of each regime; the
    campaign tells the size of all three parts. The measured patterns of the paper are off from the model by alike
    factors in both (correlation 0.84 to 0.97 over 3 to 25 kPa); readings and meshes of the model itself often move them
    apart.
    """
    o, c = observations, observations.conditions
    log_p = np.log(c.pressure_Pa)
    log_p = log_p - log_p.mean()
    names, specimen = np.unique(c.specimen, return_inverse=True)
    along, bend = along_specimens(c)
    shapes = [(np.ones(o.n), GAIN), (log_p, SLOPE), (along, SPECIMEN_DRIFT)]
    kinds = [(shape[:, None] * r, group + k) for k, r in enumerate((ALIKE_IN_BOTH, APART)) for shape, group in shapes]
    kinds.append((BENT * bend[:, None] * ALIKE_IN_BOTH, SPECIMEN_DRIFT))
    own = np.stack([column for column, _ in kinds], axis=2)
    columns: list[FloatArray] = []
    units, groups = [1.0] * (len(kinds) * len(names)), [group for _, group in kinds] * len(names)
    for sample in np.unique(c.sample):
        error = predictor.error[sample]
        if min(error.offset) <= 0.0:
            continue
        both = COMMON_SHARE * min(error.offset) ** 2
        offset, slope, curve = (np.square(sizes) for sizes in (error.offset, error.slope, error.curve))
        level, bent = np.ones(o.n), log_p**2 - np.mean(log_p**2)
        parts = [(level, (1.0, 1.0), both, PATTERN)]
        for k, regimes in enumerate(((1.0, 0.0), (0.0, 1.0))):
            for shape, variance in ((level, offset[k] - both), (log_p, slope[k]), (bent, curve[k])):
                parts.append((shape, regimes, variance, OF_PATTERNS[1 + k]))
        for shape, regimes, variance, group in parts:
            columns.append(((c.sample == sample) * shape)[:, None] * np.array(regimes))
            units.append(float(np.sqrt(variance)))
            groups.append(group)
    for course, unit, group in (*((s, 1.0, SESSION) for s in sessions(c)), *((s, u, DRIFT) for s, u in walks(c))):
        for k, regimes in enumerate((ALIKE_IN_BOTH, APART)):
            columns.append(course[:, None] * regimes)
            units.append(unit)
            groups.append(group + k)
    shared = np.stack(columns, axis=2) if columns else np.zeros((o.n, 2, 0))
    bare = Setup(
        o, predictor, predictor.table(c.sample), specimen, len(names), own, shared, np.array(units), np.array(groups),
        log_p, np.zeros((o.n, 0)), np.zeros(N_LAW),
    )  # fmt: skip
    law = _first_law(bare)
    force = predict(bare, law, (), ()).mean(axis=1)
    scatter = [*((c.sample == name) * 1.0 for name in np.unique(c.sample)), force - force.mean()]
    return replace(bare, first_law=law, scatter=np.column_stack(scatter))


@displayed()
@dataclass(frozen=True)
class EffectCourse:
    """Columns of ln T, ``values`` (t, 2, d) on the ``tests`` (t,) of one ``specimen``, by its number, or of EVERY one;
    zero on the others of ``n`` tests."""

    n: int
    specimen: int
    tests: NDArray[np.int64]
    values: FloatArray

    @property
    def columns(self) -> FloatArray:
        """On all tests, (n, 2, d)."""
        if self.specimen == EVERY:
            return self.values
        columns = np.zeros((self.n, *self.values.shape[1:]))
        columns[self.tests] = self.values
        return columns

    @property
    def freedom(self) -> int:
        return int(self.values.shape[2])

    @property
    def shows(self) -> bool:
        """Whether it is finite, and a change for some test."""
        values = self.values
        return bool(values.size and np.isfinite(values).all() and (np.ptp(values) > 0 or len(values) < self.n))


def course(columns: FloatArray, s: Setup) -> EffectCourse:
    """The course of columns (n, 2, d)."""
    changed = s.specimen[np.any(columns != 0.0, axis=(1, 2))]
    n = len(columns)
    if len(changed) and (changed == changed[0]).all():
        specimen = int(changed[0])
        tests = s.tests_of[specimen]
        return EffectCourse(n, specimen, tests, columns[tests])
    return EffectCourse(n, EVERY, np.arange(n), columns)


def added(courses: Iterable[EffectCourse]) -> FloatArray:
    """The columns (n, 2, d) that courses add up to."""
    first, *others = courses
    total = first.columns
    for other in others:
        total = total + other.columns
    return total


def _first_law(s: Setup) -> FloatArray:
    """A robust first guess of the flat law, one regime after the other."""
    c, law = s.observations.conditions, []
    for regime in (0, 1):
        force = np.exp(s.observations.log_force[:, regime])
        columns = [s.shares[:, 2 * regime] * c.normal_load_N, s.shares[:, 2 * regime + 1] * c.nominal_area_m2 * 1e3]
        design = np.column_stack(columns) / force[:, None]
        weight = np.ones(len(force))
        for _ in range(8):
            root = np.sqrt(weight)
            mu, tau0 = fitted = np.linalg.lstsq(design * root[:, None], root, rcond=None)[0]
            weight = 1.0 / (1.0 + ((design @ fitted - 1.0) / 0.15) ** 2)
        law += [max(float(mu), 0.05), float(tau0)]
    return np.array(law)


def log_forces(forces: Forces) -> FloatArray:
    """ln T, shape (n, 2), of forces kept above a micronewton."""
    both = np.column_stack([forces.static_N, forces.sliding_N])
    return np.log(np.maximum(both, FLOOR_N))


def predict(s: Setup, law: FloatArray, acting: Sequence[Acting], values: Sequence[FloatArray]) -> FloatArray:
    """ln T of every test, shape (n, 2). Several mechanisms add their changes of ln T."""
    conditions = s.observations.conditions
    base = s.base(law)
    before = log_forces(base.forces(conditions.normal_load_N))
    total = before.copy()
    for a, v in zip(acting, values, strict=True):
        total += _change(a, v, base, conditions)
    return total


def effect_of(s: Setup, law: FloatArray, acting: Acting, values: FloatArray) -> FloatArray:
    """Change of ln T by one mechanism on top of the flat law, (n, 2)."""
    return _change(acting, values, s.base(law), s.observations.conditions)


def _change(acting: Acting, values: FloatArray, base: Base, conditions: Conditions) -> FloatArray:
    """Change of ln T by one mechanism, none for tests for which it was removed, (n, 2)."""
    after = acting.mechanism.law(values, base, conditions, acting.choice)
    change = log_forces(after) - log_forces(base.forces(conditions.normal_load_N))
    return change * conditions.present(acting.mechanism.name)[:, None]


def with_form_error(
    s: Setup, law: FloatArray, acting: Sequence[Acting], values: Sequence[FloatArray], share: float
) -> Setup:
    """Further random effects that let each mechanism's effect be off by a ``share`` of itself: on all samples in both
    regimes by a smooth course along what it follows, and per sample and regime in size and slope."""
    c = s.observations.conditions
    columns = []
    for a, v in zip(acting, values, strict=True):
        change = effect_of(s, law, a, v)
        columns += [change * course[:, None] for course in along_what_it_follows(a, c).T]
        for shape in (np.ones(s.observations.n), s.log_pressure):
            for sample in np.unique(c.sample):
                here = (c.sample == sample) * shape
                for regime in (0, 1):
                    column = np.zeros_like(change)
                    column[:, regime] = change[:, regime] * here
                    if np.abs(column).max() > 1e-6:
                        columns.append(column)
    return s.with_effects(np.stack(columns, axis=2), np.full(len(columns), share)) if columns else s


def along_what_it_follows(acting: Acting, c: Conditions) -> FloatArray:
    """Smooth courses (n, DEGREES) along the column that a mechanism follows, or the load where it follows no single
    one, together of a mean square of one over its range; (n, 0) where the column does not vary.

    A column of positive numbers counts by its logarithm, a test without a value lies at the mean.
    """
    needs = acting.mechanism.needs
    x = c.recorded(needs[0]) if len(needs) == 1 and needs[0] in RECORDED else c.normal_load_N
    x = np.where(np.isfinite(x), x, np.nanmean(x))
    x = np.log(x) if x.min() > 0.0 else x
    if np.ptp(x) == 0.0:
        return np.zeros((len(x), 0))
    courses = np.polynomial.legendre.legvander(2.0 * (x - x.min()) / np.ptp(x) - 1.0, DEGREES)[:, 1:]
    return np.asarray(courses * np.sqrt((2.0 * np.arange(1, DEGREES + 1) + 1.0) / DEGREES))


def with_free_columns(s: Setup, columns: FloatArray, coefficients: FloatArray) -> Setup:
    """Further random effects along ``columns`` (n, 2, d), free to be about twice as large as ``coefficients`` (d,)."""
    freedom = np.maximum(2.0 * np.abs(coefficients), 0.5 * np.abs(coefficients).max())
    return s.with_effects(columns, freedom)


def candidates(s: Setup, law: FloatArray) -> list[Acting]:
    """Every mechanism and choice that could show in the friction forces of this design.

    An amplitude that was measured directly is kept within WITHIN_MEASURED of its standard uncertainties.
    """
    base, conditions, every = s.base(law), s.observations.conditions, s.observations.measured
    acting = []
    for m in MECHANISMS.values():
        if not m.changes_forces or not m.applies(conditions):
            continue
        for choice in map(str, m.choices(base, conditions)):
            measured = every.get(f"{m.name}:{choice}", every.get(m.name))
            if measured is None:
                acting.append(Acting(m, choice))
                continue
            first, (value, uncertainty) = m.amplitude, measured
            reach = WITHIN_MEASURED * uncertainty
            low, high = np.clip([value - reach, value + reach], first.low, first.high)
            amplitude = replace(first, low=float(low), high=float(high), tries=())
            bounded = replace(m, parameters=(amplitude, *m.parameters[1:]))
            acting.append(Acting(bounded, choice, measured))
    return acting


def start_changes(
    s: Setup, law: FloatArray
) -> tuple[list[Acting], list[tuple[EffectCourse, ...]], dict[str, FloatArray]]:
    """What every candidate changes on top of the flat law ``law`` before it is fitted, mechanisms of a model left out.

    Returns
    -------
    acting, courses, every_start
        The candidates (k,); the change of ln T by each at its start values (k,): one course, or two that add up, each
        that of another candidate; and the changes at all sizes that a fit would start from, (n, 2, sizes), of the
        mechanisms without a choice, by name.
    """
    acting = candidates(s, law)
    single: dict[tuple[str, str], EffectCourse] = {}
    every = {}
    for a in acting:
        if len(a.mechanism.choosing.parts(a.choice)) > 1:
            continue
        column = effect_of(s, law, a, a.start)
        single[a.mechanism.name, a.choice] = course(column[:, :, None], s)
        if not a.choice:
            further = [np.array([size, *a.start[1:]]) for size in a.mechanism.amplitude.tries]
            every[a.name] = np.stack([column, *(effect_of(s, law, a, v) for v in further)], axis=2)
    names = [(a.mechanism.name, a.mechanism.choosing.parts(a.choice)) for a in acting]
    return acting, [tuple(single[name, part] for part in parts) for name, parts in names], every


@displayed()
@dataclass(frozen=True)
class Target:
    """What is being fitted: a campaign, the mechanisms on top of the flat law, and their bounds."""

    setup: Setup
    acting: tuple[Acting, ...]

    @cached_property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        lows = [LAW_BOUNDS[0], *(a.mechanism.bounds()[0] for a in self.acting)]
        highs = [LAW_BOUNDS[1], *(a.mechanism.bounds()[1] for a in self.acting)]
        return np.concatenate(lows), np.concatenate(highs)

    @cached_property
    def scales(self) -> FloatArray:
        return np.concatenate([LAW_SCALE, *(np.abs(a.start) for a in self.acting)])

    def values(self, x: FloatArray) -> tuple[FloatArray, ...]:
        """The parameters of each mechanism, out of those of all."""
        ends = N_LAW + np.cumsum([len(a.mechanism.parameters) for a in self.acting])
        return tuple(np.split(x[N_LAW:], ends[:-1] - N_LAW)) if self.acting else ()

    def predict(self, x: FloatArray) -> FloatArray:
        """ln T of every test, (n, 2)."""
        return predict(self.setup, x[:N_LAW], self.acting, self.values(x))

    def residual(self, x: FloatArray) -> FloatArray:
        return self.setup.observations.log_force - self.predict(x)

    def jacobian(self, x: FloatArray, now: FloatArray) -> FloatArray:
        """Forward differences, (n, 2, p); at an upper bound the step goes down."""
        columns = []
        for k, scale in enumerate(self.scales):
            step = 1e-4 * max(scale, 1e-3 * abs(x[k]))
            step = -step if x[k] + step > self.bounds[1][k] else step
            moved = x.copy()
            moved[k] += step
            columns.append((self.predict(moved) - now) / step)
        return np.stack(columns, axis=2)
