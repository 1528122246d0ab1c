"""The model of a campaign: the flat law, the shares of each pattern, mechanisms on top, and the noise.

ln T of test i in regime r = ln law + sample error + specimen gain + repeat noise (bivariate t over the two
regimes of one pull). Samples err by a known size (the simulation's own error), specimens and repeats by sizes
estimated from the campaign.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from tribo.diagnose.statistics.observations import Observations
from tribo.diagnose.statistics.predictor import Predictor
from tribo.mechanisms.covariate import column_of
from tribo.mechanisms.record import Base, Forces, Mechanism
from tribo.records import FloatArray

N_LAW = 4  # mu static, tau0 static (kPa), mu sliding, tau0 sliding (kPa)
FLOOR_N = 1e-6


@dataclass(frozen=True)
class Acting:
    """A mechanism that takes part in a model, with its choice (which specimen, which column)."""

    mechanism: Mechanism
    choice: str = ""

    @property
    def name(self) -> str:
        """The name a verdict uses: ``covariate:operator`` for a covariate."""
        if self.mechanism.name == "covariate":
            return f"covariate:{column_of(self.choice)}"
        return self.mechanism.name


@dataclass(frozen=True)
class Setup:
    """What every model of one campaign shares: shares, random-effect design, groups.

    ``random`` has shape (n, 2, q); ``fixed_sd`` (q,) is NaN where the size is estimated, ``group`` (q,) is 0
    and 1 for specimen gains in the static and sliding regime, -1 otherwise.
    """

    observations: Observations
    predictor: Predictor
    shares: FloatArray
    random: FloatArray
    fixed_sd: FloatArray
    group: NDArray[np.int64]
    log_pressure: FloatArray

    def take(self, keep: NDArray[np.bool_]) -> Setup:
        """The same for the tests that ``keep`` (n,) marks."""
        return replace(
            self, observations=self.observations.take(keep), shares=self.shares[keep], random=self.random[keep],
            log_pressure=self.log_pressure[keep],
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
    """Random effects: per specimen and regime a gain; per pattern and regime an offset, a slope, a curve."""
    o, c = observations, observations.conditions
    log_p = np.log(c.pressure_Pa)
    log_p = log_p - log_p.mean()
    columns, sizes, groups = [], [], []
    for specimen in np.unique(c.specimen):
        for regime in (0, 1):
            columns.append(_column(c.specimen == specimen, regime))
            sizes.append(np.nan)
            groups.append(regime)
    for sample in np.unique(c.sample):
        for regime in (0, 1):
            known = (predictor.offset, predictor.slope, predictor.curve)
            offset, slope, curve = (error[sample][regime] for error in known)
            shapes = ((offset, np.ones(o.n)), (slope, log_p), (curve, log_p**2 - np.mean(log_p**2)))
            for size, shape in shapes if offset > 0 else ():
                columns.append(_column((c.sample == sample) * shape, regime))
                sizes.append(size)
                groups.append(-1)
    return Setup(
        o, predictor, predictor.table(c.sample),
        np.stack(columns, axis=2), np.array(sizes), np.array(groups), log_p,
    )  # fmt: skip


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
    """Sizes of the random parts, standard deviations of ln T: repeats (2, 2) covariance, specimen gains (2,).

    ``tail`` is the number of degrees of freedom of the t distribution of the repeats.
    """

    repeat: FloatArray
    specimen: FloatArray
    tail: float = 8.0


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
