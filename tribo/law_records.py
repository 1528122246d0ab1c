"""The frozen records of fitted laws, simulated runs and their comparison, in SI units; names end in the unit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from tribo.display import displayed
from tribo.trace_records import FloatArray

Regime = Literal["static", "sliding"]
REGIMES: tuple[Regime, ...] = ("static", "sliding")
NO_AREA_M2 = 1.0  # stands for a nominal area that is not known: tau0 A in newton is then tau0 itself


@displayed(lambda fit: f"{fit.sample}, {fit.regime}: {fit.in_numbers()}")
@dataclass(frozen=True)
class LawFit:
    """A friction law fitted to one sample in one regime, with the full covariance of its parameters.

    ``values`` and ``covariance`` follow ``parameters`` (for T = mu N + tau0 A: mu, tau0_Pa). ``dof`` are the
    degrees of freedom of the t interval (specimens minus one where specimens were combined).
    """

    sample: str
    regime: Regime
    law: str
    parameters: tuple[str, ...]
    values: FloatArray
    covariance: FloatArray
    dof: float
    n_specimens: int
    n_tests: int
    method: str
    chi2_red: float
    nominal_area_m2: float
    specimens: Mapping[str, FloatArray] = field(default_factory=dict)  # specimen -> its own values
    notes: tuple[str, ...] = ()

    @property
    def has_area(self) -> bool:
        """Whether a nominal area is known; without one, tau0_Pa stands for T0 in newton."""
        return self.nominal_area_m2 != NO_AREA_M2

    def value(self, parameter: str) -> float:
        return float(self.values[self.parameters.index(parameter)])

    def standard_uncertainty(self, parameter: str) -> float:
        k = self.parameters.index(parameter)
        return float(np.sqrt(self.covariance[k, k]))

    def in_numbers(self) -> str:
        """Every parameter with its standard uncertainty, in a line."""
        found = ((name, self.value(name), self.standard_uncertainty(name)) for name in self.parameters)
        return ", ".join(f"{name} = {value:.4g} ± {u:.2g}" for name, value, u in found)

    def interval(self, parameter: str, level: float = 0.95) -> tuple[float, float]:
        """Two-sided t interval at ``level``."""
        from scipy.special import stdtrit  # quantile of t, without the start of scipy.stats

        half = float(stdtrit(self.dof, 0.5 + level / 2)) * self.standard_uncertainty(parameter)
        return self.value(parameter) - half, self.value(parameter) + half

    def force_N(self, normal_load_N: float | FloatArray) -> FloatArray:
        """T = mu N + tau0 A of the fitted law, N in newton (any shape)."""
        n = np.asarray(normal_load_N, float)
        return np.asarray(self.value("mu") * n + self.value("tau0_Pa") * self.nominal_area_m2)

    def force_u_N(self, normal_load_N: float | FloatArray) -> FloatArray:
        """Standard uncertainty of :meth:`force_N`, from the full covariance."""
        n = np.asarray(normal_load_N, float)
        a = self.nominal_area_m2
        c = self.covariance
        return np.asarray(np.sqrt(c[0, 0] * n**2 + 2 * c[0, 1] * n * a + c[1, 1] * a**2))


@displayed(lambda fit: f"{fit.sample}, {fit.regime}: {fit.in_numbers()}")
@dataclass(frozen=True)
class CombinedFit(LawFit):
    """A fitted law with its combined uncertainty (GUM): ``covariance`` is ``type_a`` plus what all pulls share.

    ``type_a`` is the covariance of the mean over specimens and ``dof`` its degrees of freedom; what all pulls share
    (type B: gain, zero, load, area, angle) counts as known. ``largest`` holds, for mu, tau0_Pa and T, the component
    with the largest share of the variance and that share in percent.
    """

    type_a: FloatArray = field(default_factory=lambda: np.zeros((2, 2)))
    largest: Mapping[str, tuple[str, float]] = field(default_factory=dict)

    def effective_dof(self, by: FloatArray) -> float:
        """Degrees of freedom of a combination ``by`` (2,) of both parameters, by Welch and Satterthwaite (GUM, G.4)."""
        type_a = float(by @ self.type_a @ by)
        return self.dof * (float(by @ self.covariance @ by) / type_a) ** 2 if type_a > 0 else float("inf")

    def interval(self, parameter: str, level: float = 0.95) -> tuple[float, float]:
        """Two-sided t interval at ``level`` of the combined uncertainty."""
        from scipy.special import stdtrit

        k = self.parameters.index(parameter)
        factor = float(stdtrit(self.effective_dof(np.eye(2)[k]), 0.5 + level / 2))
        half = factor * self.standard_uncertainty(parameter)
        return self.value(parameter) - half, self.value(parameter) + half


@displayed(lambda r: f"{r.sample} at {r.pressure_Pa / 1e3:.4g} kPa, seed {r.seed}")
@dataclass(frozen=True)
class Run:
    """One run of the spring-block model: force of the slider along the pull, with static and sliding friction.

    ``static_friction`` and ``sliding_friction`` are T/N (dimensionless), ``window_s`` the sliding window,
    ``parameters`` every input with its unit in the name, ``moving`` the number of moving blocks.
    """

    sample: str
    pressure_Pa: float
    angle_deg: float
    seed: int
    time_s: FloatArray
    force_N: FloatArray
    moving: NDArray[np.int64]
    normal_load_N: float
    static_friction: float
    sliding_friction: float
    peak_s: float
    window_s: tuple[float, float]
    engine: str
    parameters: Mapping[str, Any] = field(default_factory=dict)


@displayed(lambda r: f"{r.sample}, {r.regime}, {r.normal_load_N:.4g} N")
@dataclass(frozen=True)
class ComparisonRow:
    """Measured and simulated friction force of one sample at one load, with standard uncertainties."""

    sample: str
    regime: Regime
    normal_load_N: float
    measured_N: float
    measured_u_N: float
    simulated_N: float
    simulated_u_N: float


@displayed(lambda c: c.campaign_title)
@dataclass(frozen=True)
class Comparison:
    """Comparison of experiment and model: fits of both, and the forces at each measured load."""

    campaign_title: str
    nominal_area_m2: float
    area_fractions: Mapping[str, float]
    measured: tuple[LawFit, ...]
    simulated: tuple[LawFit, ...]
    rows: tuple[ComparisonRow, ...]
    calibration: Mapping[str, float] = field(default_factory=dict)
    flat: str = "F"
