"""The model of a campaign: the flat law, the shares of each pattern, mechanisms on top, and the noise.

ln T of test i in regime r = ln law + pattern error + specimen gain + specimen slope x ln p + repeat noise (bivariate
t over the two regimes of one pull). All sizes are estimated from the campaign: gains and slopes of the specimens, one
factor on the error that the predictor states for its patterns, and repeats that may differ by sample and by force.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from tribo.diagnose.statistics.observations import Observations
from tribo.diagnose.statistics.predictor import Predictor
from tribo.mechanisms.record import Base, Forces, Mechanism
from tribo.records import FloatArray

N_LAW = 4  # mu static, tau0 static (kPa), mu sliding, tau0 sliding (kPa)
FLOOR_N = 1e-6
# Groups of random effects that share one size: gain and slope of the specimens, each in the mean of both regimes and
# in their difference, which a specimen shares to an unknown degree; the patterns.
GAIN, SLOPE, PATTERN = 0, 2, 4
ALIKE_IN_BOTH, APART = np.array([1.0, 1.0]) / np.sqrt(2.0), np.array([1.0, -1.0]) / np.sqrt(2.0)
FIXED = -1  # the group of effects whose size is not estimated


@dataclass(frozen=True)
class Acting:
    """A mechanism that takes part in a model, with its choice (which specimen, which column)."""

    mechanism: Mechanism
    choice: str = ""

    @property
    def name(self) -> str:
        """The name in a verdict: ``covariate:operator``."""
        return self.mechanism.called(self.choice)


@dataclass(frozen=True)
class Setup:
    """What every model of one campaign shares: shares, random-effect design, groups.

    ``random`` has shape (n, 2, q). The standard deviation of effect j is ``unit[j]`` times the size of its ``group[j]``
    (GAIN and SLOPE, plus one for the difference of the regimes; PATTERN), or ``unit[j]`` itself where the group is
    FIXED. ``scatter`` (n, k) holds what the repeats may depend on: the sample, and the logarithm of the force.
    """

    observations: Observations
    predictor: Predictor
    shares: FloatArray
    random: FloatArray
    unit: FloatArray
    group: NDArray[np.int64]
    log_pressure: FloatArray
    scatter: FloatArray

    def take(self, keep: NDArray[np.bool_]) -> Setup:
        """The same for the tests that ``keep`` (n,) marks."""
        return replace(
            self, observations=self.observations.take(keep), shares=self.shares[keep], random=self.random[keep],
            log_pressure=self.log_pressure[keep], scatter=self.scatter[keep],
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
    """Random effects in both regimes: gain and slope of a specimen; offset, slope and curve of a pattern."""
    o, c = observations, observations.conditions
    log_p = np.log(c.pressure_Pa)
    log_p = log_p - log_p.mean()
    columns, units, groups = [], [], []
    for specimen in np.unique(c.specimen):
        for k, regimes in enumerate((ALIKE_IN_BOTH, APART)):
            for group, shape in ((GAIN, np.ones(o.n)), (SLOPE, log_p)):
                columns.append(((c.specimen == specimen) * shape)[:, None] * regimes)
                units.append(1.0)
                groups.append(group + k)
    for sample in np.unique(c.sample):
        for regime in (0, 1):
            known = (predictor.offset, predictor.slope, predictor.curve)
            offset, slope, curve = (error[sample][regime] for error in known)
            shapes = ((offset, np.ones(o.n)), (slope, log_p), (curve, log_p**2 - np.mean(log_p**2)))
            for size, shape in shapes if offset > 0 else ():
                columns.append(_column((c.sample == sample) * shape, regime))
                units.append(size)
                groups.append(PATTERN)
    bare = Setup(
        o, predictor, predictor.table(c.sample),
        np.stack(columns, axis=2), np.array(units), np.array(groups), log_p, np.zeros((o.n, 0)),
    )  # fmt: skip
    return replace(bare, scatter=_scatter(bare))


def _scatter(s: Setup) -> FloatArray:
    """One column per sample, and the logarithm of the expected force about its mean."""
    c = s.observations.conditions
    log_force = predict(s, first_law(s), (), ()).mean(axis=1)
    return np.column_stack([*((c.sample == name) * 1.0 for name in np.unique(c.sample)), log_force - log_force.mean()])


def first_law(s: Setup) -> FloatArray:
    """A robust first guess of the flat law, one regime after the other."""
    c, law = s.observations.conditions, []
    for regime in (0, 1):
        force = np.exp(s.observations.log_force[:, regime])
        columns = [s.shares[:, 2 * regime] * c.normal_load_N, s.shares[:, 2 * regime + 1] * c.nominal_area_m2 * 1e3]
        design = np.column_stack(columns) / force[:, None]
        weight = np.ones(len(force))
        for _ in range(8):
            root = np.sqrt(weight)
            found = np.linalg.lstsq(design * root[:, None], root, rcond=None)[0]
            weight = 1.0 / (1.0 + ((design @ found - 1.0) / 0.15) ** 2)
        law += [max(float(found[0]), 0.05), float(found[1])]
    return np.array(law)


def _column(values: FloatArray | NDArray[np.bool_], regime: int) -> FloatArray:
    column = np.zeros((len(values), 2))
    column[:, regime] = values
    return column


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
        total += log_forces(a.mechanism.law(v, base, conditions, a.choice)) - before
    return total


@dataclass(frozen=True)
class Noise:
    """Sizes of the random parts, standard deviations of ln T: repeats (2, 2) covariance; specimen gains (2,) and
    slopes (2,) per e-fold of load, along the mean of static and sliding friction and along their difference.

    ``pattern`` is the factor on the error that the predictor states for its patterns. The standard deviation of the
    repeats of a test is multiplied by exp(``scatter`` @ setup.scatter). ``tail`` is the number of degrees of freedom of
    the t distribution of the repeats.
    """

    repeat: FloatArray
    specimen: FloatArray
    slope: FloatArray = field(default_factory=lambda: np.array([0.02, 0.02]))
    pattern: float = 1.0
    scatter: FloatArray | None = None
    tail: float = 8.0

    @property
    def sizes(self) -> FloatArray:
        """Of every group of random effects, (5,)."""
        return np.array([*self.specimen, *self.slope, self.pattern])

    def with_sizes(self, sizes: FloatArray) -> Noise:
        return replace(
            self, specimen=sizes[GAIN:SLOPE], slope=sizes[SLOPE:PATTERN], pattern=float(sizes[PATTERN])
        )

    def per_test(self, s: Setup) -> FloatArray:
        """Covariance of the repeats of every test, (n, 2, 2)."""
        if self.scatter is None:
            return np.repeat(self.repeat[None], s.observations.n, axis=0)
        return np.asarray(self.repeat * np.exp(2.0 * s.scatter @ self.scatter)[:, None, None])


@dataclass(frozen=True)
class ModelFit:
    """A fitted model. ``residual`` (n, 2) is ln T measured minus the law without random effects.

    ``score`` is the log of the marginal likelihood (Laplace), ``covariance`` that of law, mechanism
    parameters and random effects together, ``effects`` (q,) the predicted random effects, ``weight`` (n,) how
    much each test counts.
    """

    setup: Setup
    acting: tuple[Acting, ...]
    law: FloatArray
    values: tuple[FloatArray, ...]
    noise: Noise
    effects: FloatArray
    residual: FloatArray
    weight: FloatArray
    score: float
    covariance: FloatArray = field(repr=False)

    @property
    def predicted(self) -> FloatArray:
        return self.setup.observations.log_force - self.residual
