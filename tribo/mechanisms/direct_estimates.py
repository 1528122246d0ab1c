"""Evidence of a mechanism besides the friction forces: in the traces, by a measurement, by varying a condition."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from tribo.display import displayed

Quantity = Literal["zero", "zero drift", "rise"]


@displayed()
@dataclass(frozen=True)
class TraceEvidence:
    """A quantity of the traces that equals the amplitude of a mechanism.

    Parameters
    ----------
    quantity
        "zero": force before contact, N. "zero drift": its slope in time, N/h. "rise": relative change of the slope
        of the rise per e-fold of the pull speed.
    covariate
        The recorded column that it follows, empty where it is constant.
    source
        Where the value was read, as a clause of a sentence.
    absent
        The sentence where the evidence is not certain, with ``{value}`` and ``{percent}``.
    corrected
        Whether the effect was subtracted from every force, so that it cannot explain the friction forces.
    contains
        Mechanisms whose evidence this one includes.
    """

    quantity: Quantity
    covariate: str
    source: str
    absent: str = ""
    corrected: bool = False
    contains: tuple[str, ...] = ()


@displayed()
@dataclass(frozen=True)
class DirectMeasurement:
    """A measurement of the amplitude, with a standard uncertainty in the unit of the amplitude, and its duration."""

    text: str
    uncertainty: float
    hours: float


@displayed()
@dataclass(frozen=True)
class Variation:
    """A condition to vary so that a mechanism could show: in words, its column in tests.csv, and values."""

    text: str
    column: str
    values: tuple[float, ...]
