"""What a mechanism is: its law, what it needs to choose, where it acts in the model, what shows it besides the forces.

From the parts to the whole: :class:`Choosing` (a specimen, a pattern, a column), :class:`Placement` in the
spring-block model (which :mod:`tribo.mechanisms_in_model` carries out), evidence in traces and direct measurements, the
meaning for a published table that prints neither pulls nor conditions, and :class:`Mechanism` with its parameters.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from tribo.display import displayed
from tribo.mechanisms.conditions import (
    REFERENCE_HOLD_S as REFERENCE_HOLD_S,
    REFERENCE_PRESSURE_PA as REFERENCE_PRESSURE_PA,
    REFERENCE_SPEED_M_S as REFERENCE_SPEED_M_S,
    Base,
    Conditions,
    Forces,
    StringArray as StringArray,
    Values,
)
from tribo.records import FloatArray

OnTest = tuple[Values, str]
"""How a mechanism acts on one test: its values there, and the sample that takes the place of the labelled one."""


def no_choice(base: Base, conditions: Conditions) -> tuple[str, ...]:
    """A mechanism without variants."""
    return ("",)


def same_on_every_test(values: Values, choice: str, conditions: Conditions, test: int) -> OnTest | None:
    """The values of the campaign."""
    return values, ""


def nothing_to_choose(conditions: Conditions) -> str:
    """In one run there is no choice."""
    return ""


def unnamed(choice: str) -> str:
    """A verdict calls the mechanism by its name alone."""
    return ""


def one_part(choice: str) -> tuple[str, ...]:
    """A choice stands for itself."""
    return (choice,)


def no_remedy(choice: str) -> str:
    """What settles the mechanism does not depend on the choice."""
    return ""


@displayed()
@dataclass(frozen=True)
class Choosing:
    """What the choices of a mechanism mean.

    Parameters
    ----------
    label
        What a verdict appends to the name, as in ``covariate:operator``.
    column
        The recorded column that the mechanism follows; empty: the choice itself, or the columns it needs.
    level
        The one name of a column of several that a choice concerns; empty: the whole column.
    on_test
        How it acts on the test of an index; None where the choice does not concern that test.
    in_one_run
        The choice in a single run of the simulator.
    held_out
        What cross-validation leaves out. "samples": whole samples, or specimens where there are fewer than four
        samples. "loads": whole loads, for a choice that cannot be learned from other samples or specimens.
    parts
        The choices whose changes of ln T, each on tests of its own, add up to that of a choice; the choice itself by
        default.
    all_or_nothing_sd
        Standard deviation of the amplitude around its start value, where the effect is present as a whole or absent.
    remedy
        The sentence that says what to do about a choice: "Weigh the 50 g weight."
    """

    label: Callable[[str], str] = unnamed
    column: str = ""
    level: Callable[[str], str] = unnamed
    on_test: Callable[[Values, str, Conditions, int], OnTest | None] = same_on_every_test
    in_one_run: Callable[[Conditions], str] = nothing_to_choose
    held_out: Literal["samples", "loads"] = "samples"
    parts: Callable[[str], tuple[str, ...]] = one_part
    all_or_nothing_sd: float | None = None
    remedy: Callable[[str], str] = no_remedy


NO_CHOICE = Choosing()


Gains = Callable[[Values, tuple[float, float], float], tuple[float, float]]
Profile = Callable[[Values, float, FloatArray], tuple[FloatArray, FloatArray]]


@displayed()
@dataclass(frozen=True)
class Placement:
    """What a mechanism changes in the model; a field that is not given changes nothing. Gains are 1 at zero amplitude.

    Parameters
    ----------
    by_law
        Every contact block follows the law of the mechanism, with the pressure and the area of the contact.
    thresholds, load
        Gains of the thresholds, and of the normal force, of every block, (static, sliding), given T/N of the sample so
        far, static and sliding, and the static traction of its contact, Pa.
    springs
        Gain of the elastic modulus.
    floors
        Share of the cavity floors that touch down.
    rims
        Static adhesion per rim length, N/m, and the share of it left while sliding; it acts on blocks beside a cavity.
    along
        Normal force and adhesion of every block over their mean, given T/N and the place of the block along the
        pull, from -1/2 (trailing edge) to 1/2, both (n,).
    chain
        Arguments of :func:`tribo.mechanisms_in_model.measured`, given the recorded conditions.
        Where several mechanisms set the same field, their values add.
    other_sample
        The sample is another one, named in brackets behind the mechanism; the amplitude moves ln T towards it.
    own_friction
        ``load``, ``thresholds`` or ``along`` depend on the friction that they change: runs are repeated until the
        friction stays the same.
    """

    by_law: bool = False
    thresholds: Gains | None = None
    load: Gains | None = None
    springs: Callable[[Values, Conditions], float] | None = None
    floors: Callable[[Values, Conditions], float] | None = None
    rims: Callable[[Values], tuple[float, float]] | None = None
    along: Profile | None = None
    chain: Callable[[Values, Mapping[str, float]], Mapping[str, float]] | None = None
    other_sample: bool = False
    own_friction: bool = False

    @property
    def on_single_blocks(self) -> bool:
        """Whether the position of a block matters."""
        return any(part is not None for part in (self.floors, self.rims, self.along))


BY_LAW = Placement(by_law=True)


Quantity = Literal["zero", "zero drift", "rise", "each pull"]
Marks = Mapping[str, FloatArray]
"""Of every test, (n,): its features by name, ``static_N``, ``clip_N`` and ``stated_stiffness_N_per_m``, as far as a
test of the campaign has them; NaN where others have."""


@displayed()
@dataclass(frozen=True)
class TraceEvidence:
    """A quantity of the traces that equals the amplitude of a mechanism.

    Parameters
    ----------
    quantity
        "zero": force before contact, N. "zero drift": its slope in time, N/h. "rise": relative change of the slope
        of the rise per e-fold of the pull speed. "each pull": what ``of_each`` reads.
    covariate
        The recorded column that it follows, empty where it is constant.
    source
        Where the value was read, as a clause of a sentence.
    observable
        What a misfit of it is called, by :data:`tribo.vocabulary.OBSERVABLES`.
    absent
        The sentence where the evidence is not certain, with ``{value}`` and ``{percent}``.
    corrected
        Where the effect does not act on the forces as they were read: the sentence that says so, with ``{found}`` (the
        amplitude with its uncertainty) and ``{percent}``.
    contains
        Mechanisms whose evidence this one includes.
    reads, of_each, change, least
        The marks that it needs; the amplitude by every pull, (n,), NaN where it shows none; the change of what it acts
        on at that amplitude, as a share, (n,); the share below which it does not matter.
    """

    quantity: Quantity
    covariate: str
    source: str
    observable: str
    absent: str = ""
    corrected: str = ""
    contains: tuple[str, ...] = ()
    reads: tuple[str, ...] = ()
    of_each: Callable[[Marks], FloatArray] | None = None
    change: Callable[[Marks, FloatArray], FloatArray] | None = None
    least: float = 0.0


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


Finding = Callable[[Sequence[float], Sequence[float], Callable[[], float], float], str]


@displayed()
@dataclass(frozen=True)
class InTable:
    """A mechanism in the diagnosis of a published table.

    Parameters
    ----------
    missing
        What the table does not print and the mechanism needs; such a mechanism is not weighed.
    barred
        Why it is not weighed although its law could change the table.
    guess
        The explanation proposed by the authors that it stands for.
    finding
        What the table says about that explanation, in sentences. It is given, of all readings of the table that are
        possible for a line fit, the log likelihoods earned and the amplitudes; a function for the largest amplitude
        within 95 % in the first of them; and the static traction of the flat sample at 10 kPa, Pa.
    next_test, separates, design
        The test at the bench that would decide what the table leaves open, in words; the mechanisms it separates; its
        conditions. Empty without one.
    """

    missing: str = ""
    barred: str = ""
    guess: str = ""
    finding: Finding | None = None
    next_test: str = ""
    separates: tuple[str, ...] = ()
    design: Mapping[str, Any] = field(default_factory=dict)


WEIGHED = InTable()


Kind = Literal["interface", "pattern", "instrument", "bulk", "environment", "bookkeeping", "any"]
Law = Callable[[Values, Base, Conditions, str], Forces]
Rise = Callable[[Values, FloatArray, Conditions], FloatArray]


ALONG_RECORDS = "course along a record"
STROKES_APART = "offset between directions"


@displayed()
@dataclass(frozen=True)
class MechanismParameter:
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
    parameters: tuple[MechanismParameter, ...]
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
    def amplitude(self) -> MechanismParameter:
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

    def zero(self) -> Values:
        """MechanismParameter values at which the mechanism is absent."""
        return np.array([self.amplitude.zero, *(p.zero if p.amplitude else p.start for p in self.parameters[1:])])

    def start(self) -> Values:
        """MechanismParameter values from which a fit starts: a clear effect."""
        return np.array([p.start for p in self.parameters])

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        return np.array([p.low for p in self.parameters]), np.array([p.high for p in self.parameters])

    def applies(self, conditions: Conditions) -> bool:
        """Whether every column it needs is recorded and takes more than one value."""
        return all(_varies(getattr(conditions, name)) for name in self.needs)


def amplitude(
    name: str, unit: str, low: float, high: float, start: float, text: str, tries: tuple[float, ...] = ()
) -> MechanismParameter:
    """The first parameter of a mechanism, absent at zero."""
    return MechanismParameter(name, unit, low, high, start, text, amplitude=True, tries=tries)


def _varies(values: FloatArray) -> bool:
    finite = values[np.isfinite(values)]
    return finite.size == values.size and bool(np.ptp(finite) > 1e-9 * max(1.0, np.abs(finite).max()))
