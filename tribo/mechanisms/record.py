"""What a mechanism is, and what its law is given: the baseline and the conditions of every test."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tribo.records import FloatArray

Kind = Literal["interface", "pattern", "instrument", "bulk", "environment", "bookkeeping", "any"]
StringArray = NDArray[np.str_]
REFERENCE_SPEED_M_S = 2e-4  # the pull speed of the paper
REFERENCE_HOLD_S = 1.0
REFERENCE_PRESSURE_PA = 1e4


@dataclass(frozen=True)
class Forces:
    """Static and sliding friction force of every test, N, shape (n,)."""

    static_N: FloatArray
    sliding_N: FloatArray


@dataclass(frozen=True)
class Base:
    """The baseline law of every test, T = mu N + tau0 A, as arrays of shape (n,).

    ``by_sample`` holds the same four numbers (static mu, static tau0 A, sliding mu, sliding tau0 A) for each
    sample of the campaign: what a test would follow if its specimen were another sample; ``flat`` names the
    flat sample among them.
    """

    static_mu: FloatArray
    static_adhesion_N: FloatArray
    sliding_mu: FloatArray
    sliding_adhesion_N: FloatArray
    by_sample: Mapping[str, tuple[float, float, float, float]] = field(default_factory=dict)
    flat: str = "F"

    def forces(self, normal_load_N: FloatArray) -> Forces:
        """Both forces under a normal load of shape (n,)."""
        return Forces(
            self.static_mu * normal_load_N + self.static_adhesion_N,
            self.sliding_mu * normal_load_N + self.sliding_adhesion_N,
        )

    def as_sample(self, sample: str) -> Base:
        """The same tests, had they all been made on ``sample``."""
        filled = [np.full_like(self.static_mu, value) for value in self.by_sample[sample]]
        return replace(
            self,
            static_mu=filled[0],
            static_adhesion_N=filled[1],
            sliding_mu=filled[2],
            sliding_adhesion_N=filled[3],
        )


@dataclass(frozen=True)
class Conditions:
    """What is recorded about every test, arrays of shape (n,); NaN where a column is not recorded.

    ``rim_per_m`` is rim length per nominal area, ``cavity_width_m`` the smaller cavity size (0 on a flat
    sample), ``elongation`` ln(long/short) of the cavity, positive when pulled along its long side and
    negative across it, ``specimen_run`` counts the pulls of a specimen from 1, ``elapsed_s`` the time since
    the first pull, ``clip_N`` = k v / (2 f_s), the mean loss of a peak between two samples of the recorder.
    ``columns`` holds every further recorded column as text.
    """

    normal_load_N: FloatArray
    nominal_area_m2: float
    area_fraction: FloatArray
    rim_per_m: FloatArray
    cavity_width_m: FloatArray
    elongation: FloatArray
    sample: StringArray
    specimen: StringArray
    speed_m_s: FloatArray
    hold_s: FloatArray
    specimen_run: FloatArray
    run_order: FloatArray
    elapsed_s: FloatArray
    temperature_C: FloatArray
    humidity_pct: FloatArray
    clip_N: FloatArray
    columns: Mapping[str, StringArray] = field(default_factory=dict)

    @property
    def pressure_Pa(self) -> FloatArray:
        """Nominal pressure p = N / A."""
        return self.normal_load_N / self.nominal_area_m2

    @property
    def contact_pressure_Pa(self) -> FloatArray:
        """Pressure on the contact area, p / AF."""
        return self.pressure_Pa / self.area_fraction


Values = FloatArray  # the parameters of one mechanism, in the order of its record
Law = Callable[[Values, Base, Conditions, str], Forces]
Rise = Callable[[Values, FloatArray, Conditions], FloatArray]


@dataclass(frozen=True)
class Parameter:
    """One number of a mechanism. ``zero`` is where the mechanism is absent (amplitudes only)."""

    name: str
    unit: str
    low: float
    high: float
    start: float
    text: str
    zero: float = 0.0
    amplitude: bool = False
    tries: tuple[float, ...] = ()  # further values a fit starts from


def no_choice(base: Base, conditions: Conditions) -> tuple[str, ...]:
    """A mechanism without variants."""
    return ("",)


@dataclass(frozen=True)
class Mechanism:
    """One thing that can part a measured campaign from the baseline.

    ``parameters[0]`` is the amplitude: at its ``zero`` the law returns the baseline to the bit. ``sign`` is
    the sign of the change of T for a positive amplitude: +1, -1, or 0 where both occur. ``needs`` names the
    arrays of :class:`Conditions` that must vary for it to show. ``choices`` lists what a bookkeeping or
    geometry cause has to be told besides numbers (which specimen, which pattern); one empty choice otherwise.
    ``silenced_by`` names the extra measurement that would remove or settle it. ``quick_error`` is the relative error
    of T by which the law may part from the spring-block model with the mechanism in it, at the start amplitude.
    """

    name: str
    kind: Kind
    formula: str
    parameters: tuple[Parameter, ...]
    law: Law
    sign: Literal[-1, 0, 1]
    regimes: tuple[str, ...]
    enters: str
    shows: str
    confused_with: str
    separates: str
    silenced_by: tuple[str, ...] = ()
    needs: tuple[str, ...] = ()
    quick_error: float = 0.03
    rise: Rise | None = None  # what becomes of the slope of the rise, N/m, where the mechanism shows there
    choices: Callable[[Base, Conditions], tuple[str, ...]] = no_choice

    @property
    def amplitude(self) -> Parameter:
        return self.parameters[0]

    def zero(self) -> Values:
        """Parameter values at which the mechanism is absent."""
        return np.array([self.amplitude.zero, *(p.start for p in self.parameters[1:])])

    def start(self) -> Values:
        """Parameter values from which a fit starts: a clear effect."""
        return np.array([p.start for p in self.parameters])

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        return np.array([p.low for p in self.parameters]), np.array([p.high for p in self.parameters])

    def applies(self, conditions: Conditions) -> bool:
        """Whether every column it needs is recorded and takes more than one value."""
        return all(_varies(getattr(conditions, name)) for name in self.needs)


def amplitude(
    name: str, unit: str, low: float, high: float, start: float, text: str, tries: tuple[float, ...] = ()
) -> Parameter:
    """The first parameter of a mechanism, absent at zero."""
    return Parameter(name, unit, low, high, start, text, amplitude=True, tries=tries)


def _varies(values: FloatArray) -> bool:
    finite = values[np.isfinite(values)]
    return finite.size == values.size and bool(np.ptp(finite) > 1e-9 * max(1.0, np.abs(finite).max()))
