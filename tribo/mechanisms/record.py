"""What a mechanism is: its law, and everything that only it knows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from tribo.display import displayed
from tribo.mechanisms.choosing import NO_CHOICE, Choosing, OnTest, no_choice
from tribo.mechanisms.conditions import (
    REFERENCE_HOLD_S,
    REFERENCE_PRESSURE_PA,
    REFERENCE_SPEED_M_S,
    Base,
    Conditions,
    Forces,
    StringArray,
    Values,
)
from tribo.mechanisms.direct_estimates import DirectMeasurement, TraceEvidence, Variation
from tribo.mechanisms.in_table import WEIGHED, BenchTest, InTable, Readings
from tribo.mechanisms.placement import BY_LAW, Contact, Placement
from tribo.records import FloatArray

Kind = Literal["interface", "pattern", "instrument", "bulk", "environment", "bookkeeping", "any"]
Law = Callable[[Values, Base, Conditions, str], Forces]
Rise = Callable[[Values, FloatArray, Conditions], FloatArray]


ALONG_RECORDS = "course along a record"
STROKES_APART = "offset between directions"


@displayed()
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


@displayed()
@dataclass(frozen=True)
class Mechanism:
    """One reason why a measured campaign may differ from the baseline model.

    Parameters
    ----------
    name, plain, meaning, kind
        The name in a verdict; what it is called in a sentence (without one, the name with spaces); what that means, as
        a clause; what it belongs to.
    formula, law, parameters
        ``parameters[0]`` is the amplitude: at its ``zero`` the law returns the baseline to the bit.
    sign
        Sign of the change of T for a positive amplitude: +1, -1, or 0 where both occur.
    regimes
        "static", "sliding" or, where only the slope of the rise changes, "rise".
    needs
        Arrays of :class:`Conditions` that must vary for it to show.
    choices, choosing
        What it needs besides numbers (which specimen, which pattern), and what that means.
    enters, shows, confused_with, separates, silenced_by
        Where it acts in the model; its signs; what gives similar signs; how to distinguish them; extra measurements
        that remove or settle it. All in words.
    removed_by
        How to pull so that it does not act; empty where no such pull is known.
    quick_error
        Relative error of T by which the law may differ from the spring-block model with the mechanism in it, at the
        start amplitude.
    rise
        The slope of the rise, N/m, where the mechanism changes it.
    placement
        Where it acts in the spring-block model; by default every contact block follows the law.
    evidence, measurement, variation
        What the traces show of it; how its amplitude is measured; what to vary where a design held it fixed.
    untested
        Why a campaign says nothing about it, where neither the forces nor the traces do.
    in_table
        What it means for a published table of mu and tau0.
    without_model
        What shows it in a diagnosis without the spring-block model: recorded columns that friction follows,
        :data:`ALONG_RECORDS` or :data:`STROKES_APART`.
    any_column
        Whether it follows whatever recorded column is chosen, by no law of its own.
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
    removed_by: str = ""
    needs: tuple[str, ...] = ()
    quick_error: float = 0.03
    rise: Rise | None = None
    choices: Callable[[Base, Conditions], tuple[str, ...]] = no_choice
    plain: str = ""
    meaning: str = ""
    choosing: Choosing = NO_CHOICE
    placement: Placement = BY_LAW
    evidence: TraceEvidence | None = None
    measurement: DirectMeasurement | None = None
    variation: Variation | None = None
    untested: str = ""
    in_table: InTable = WEIGHED
    without_model: tuple[str, ...] = ()
    any_column: bool = False

    @property
    def amplitude(self) -> Parameter:
        return self.parameters[0]

    @property
    def in_words(self) -> str:
        """What it is called in a sentence."""
        return self.plain or self.name.replace("_", " ")

    @property
    def changes_forces(self) -> bool:
        """Whether static or sliding friction shows it."""
        return self.regimes != ("rise",)

    def called(self, choice: str = "") -> str:
        """The name in a verdict: ``covariate:operator``."""
        label = self.choosing.label(choice) if choice else ""
        return f"{self.name}:{label}" if label else self.name

    def column(self, choice: str = "") -> str:
        """The recorded column or columns that it follows."""
        return self.choosing.column or self.choosing.label(choice) or choice or ", ".join(self.needs)

    def on_test(self, values: Values, choice: str, conditions: Conditions, test: int) -> OnTest | None:
        """How it acts on one test; None where the choice does not concern that test."""
        return self.choosing.on_test(values, choice, conditions, test)

    def zero(self) -> Values:
        """Parameter values at which the mechanism is absent."""
        return np.array([self.amplitude.zero, *(p.zero if p.amplitude else p.start for p in self.parameters[1:])])

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


__all__ = [
    "ALONG_RECORDS",
    "REFERENCE_HOLD_S",
    "REFERENCE_PRESSURE_PA",
    "REFERENCE_SPEED_M_S",
    "STROKES_APART",
    "Base",
    "BenchTest",
    "Choosing",
    "Conditions",
    "Contact",
    "DirectMeasurement",
    "Forces",
    "InTable",
    "Kind",
    "Mechanism",
    "OnTest",
    "Parameter",
    "Placement",
    "Readings",
    "StringArray",
    "TraceEvidence",
    "Values",
    "Variation",
    "amplitude",
    "no_choice",
]  # fmt: skip
