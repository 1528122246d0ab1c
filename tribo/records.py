"""The frozen records passed between stages, in SI units; names end in the unit.

Exports and pulls, the campaign and its study. Those of fitted laws, runs and their comparison are in :mod:`tribo.fits`;
all can be imported from here.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from tribo.display import displayed
from tribo.errors import CampaignError, Problem
from tribo.fits import PA_PER_KPA, REGIMES, Comparison, ComparisonRow, Fits, FloatArray, LawFit, Regime, Run
from tribo.zeroing import DEFAULT, ZeroChoice

if TYPE_CHECKING:
    import pandas as pd


@displayed()
@dataclass(frozen=True)
class ExportFormat:
    """How an export was read, in enough detail to read it again by hand."""

    family: str
    encoding: str
    delimiter: str
    decimal: str
    header_rows: int
    columns: Mapping[str, str]  # quantity -> "name [unit]" as the file spells it
    reasons: Mapping[str, str] = field(default_factory=dict)  # quantity -> why that column


@displayed(lambda t: f"{t.name}, {len(t.time_s)} points")
@dataclass(frozen=True)
class Trace:
    """Force against time of one export, in SI units, as recorded (never resampled).

    Parameters
    ----------
    name : str
        Name of the trace: the id of its test, or the name of its file.
    time_s, force_N : ndarray, shape (n,)
        Time in s and friction force in N, with n >= 1.
    displacement_m : ndarray, shape (n,), optional
        Displacement of the sled in m, where it was recorded.
    columns : mapping of str to ndarray, shape (n,)
        Further quantities by their name in SI units, such as "normal_force_N".
    metadata : mapping of str to str
        The header of the file as it is.
    source : ExportFormat, optional
        How the export was read.
    file : str
        The export.
    flags : tuple of str
        Doubts of the reader, each in a word.
    problems : tuple of Problem
        Doubts of the reader with their place.
    first_row : int
        Line of the file, counted from 1, that holds the first data point.

    Examples
    --------
    >>> trace = tribo.read_export(tribo.data_dir() / "example" / "raw" / "T001.csv")
    >>> print(trace.time_s.shape, f"{trace.time_s[-1]:.2f} s, at most {trace.force_N.max():.2f} N")
    (400,) 15.96 s, at most 2.18 N
    """

    name: str
    time_s: FloatArray
    force_N: FloatArray
    displacement_m: FloatArray | None = None
    columns: Mapping[str, FloatArray] = field(default_factory=dict)
    metadata: Mapping[str, str] = field(default_factory=dict)
    source: ExportFormat | None = None
    file: str = ""
    flags: tuple[str, ...] = ()
    problems: tuple[Problem, ...] = ()
    first_row: int = 1


PHASES = {
    "rest": "the bodies touch, or no load is recorded, and the drive stands still before it first moves",
    "approach": "before the bodies touch",
    "loading": "the normal load rises",
    "rise": "the force climbs from rest to its static peak",
    "slip": "the force falls from the static peak",
    "running-in": "the force drifts towards a steady level while the drive moves",
    "steady sliding": "the drive moves at one speed under one load",
    "stroke": "one way of a motion to and fro",
    "reversal": "from one stroke to the next",
    "hold": "the drive stands still between two motions",
    "step of speed": "from one speed to the next",
    "step of load": "from one load to the next",
    "end of the drive": "the drive has stopped for good, the bodies still touch",
    "unloading": "the normal load falls",
    "lift-off": "after the bodies came apart",
}


@displayed(lambda p: f"{p.name}, {p.start_s:.4g} to {p.end_s:.4g} s")
@dataclass(frozen=True)
class Phase:
    """A part of a record by what the rig did, from ``start_s`` to ``end_s`` on the clock of the trace.

    Parameters
    ----------
    name : str
        What the rig did: a name in ``PHASES``.
    start_s, end_s : float
        Start and end in s. The phases of a record follow each other without gaps.
    speed_m_s, normal_load_N : float
        Speed of the drive in m/s (without its sign; from the displacement where no speed was recorded) and normal load
        in N; NaN where they were not recorded.
    cycle : int
        Number of the cycle that a stroke belongs to, counted from 1; 0 for everything else.
    force_N, force_u_N : float
        Mean force in N and its standard uncertainty: above the zero of the pull, or as recorded where there is none.
    evidence : str
        The channel that tells of the beginning of the phase, and how.
    doubt : str
        What is doubtful about it.
    """

    name: str
    start_s: float
    end_s: float
    speed_m_s: float = float("nan")
    normal_load_N: float = float("nan")
    cycle: int = 0
    force_N: float = float("nan")
    force_u_N: float = float("nan")
    evidence: str = ""
    doubt: str = ""


Interval = tuple[float, float, float]  # a value, the lower and the upper end of its 95 % interval

READINGS_OF_A_RECORD = {
    "plateau": "sliding at one speed under one load",
    "step of speed": "from one speed to the next: the new steady state, the change at once and the total change",
    "step of load": "from one load to the next",
    "cycle": "two strokes in opposite directions",
    "running-in": "from the beginning of a slide to its steady level",
    "hold": "the static force of a restart after the drive stood still",
    "healing": "how the static force over that of sliding grows with the logarithm of the hold",
}


@displayed(lambda r: f"{r.name}, {r.start_s:.4g} to {r.end_s:.4g} s")
@dataclass(frozen=True)
class Reading:
    """One of several readings of a record, from ``start_s`` to ``end_s`` on its clock.

    Parameters
    ----------
    test_id : str
        The test, or the record whose strokes are tests of their own.
    name : str
        What was read: a name in ``READINGS_OF_A_RECORD``.
    start_s, end_s : float
        Start and end in s.
    speed_m_s, normal_load_N : float
        Speed in m/s and normal load in N, recorded or stated; NaN where neither is known.
    way : "", "up" or "down"
        Way of a ladder by which the level was reached.
    cycle : int
        Number of the cycle, counted from 1; 0 for everything else.
    hold_s : float
        Time in s that the drive stood still.
    state : "", "steady", "still drifts" or "cannot tell"
        Of running-in.
    values : mapping of str to Interval
        Each quantity by its name and unit, such as "force_N": value, lower and upper end of its 95 % interval.
    """

    test_id: str
    name: str
    start_s: float
    end_s: float
    speed_m_s: float = float("nan")
    normal_load_N: float = float("nan")
    way: str = ""
    cycle: int = 0
    hold_s: float = float("nan")
    state: str = ""
    values: Mapping[str, Interval] = field(default_factory=dict)


@displayed(lambda r: f"hold {r.hold_s:.4g} s, static {r.static_N:.4g} N")
@dataclass(frozen=True)
class Restart:
    """The static friction of one restart: the peak after the drive stood still for ``hold_s``."""

    hold_s: float
    stop_s: float
    peak_s: float
    static_N: float
    static_u_N: float
    sliding_N: float
    sliding_u_N: float


@displayed()
@dataclass(frozen=True)
class Oscillation:
    """How the force varies while sliding: its regime, and its cycles where it has any.

    ``regime`` is "steady", "stick-slip", "inertial oscillation" or "irregular". ``peak_N`` is the force at the end of a
    stick, ``trough_N`` that after the slip, ``drop_N`` the force lost, ``loading_N_per_s`` the slope while the force
    rises: medians over ``cycles`` with standard uncertainties ``*_u``. ``stuck_share`` is the share of time spent
    stuck. NaN where there are no cycles.
    """

    regime: str
    cycles: int = 0
    peak_N: float = float("nan")
    peak_u_N: float = float("nan")
    trough_N: float = float("nan")
    trough_u_N: float = float("nan")
    drop_N: float = float("nan")
    drop_u_N: float = float("nan")
    period_s: float = float("nan")
    period_u_s: float = float("nan")
    loading_N_per_s: float = float("nan")
    loading_u_N_per_s: float = float("nan")
    stuck_share: float = float("nan")
    stuck_share_u: float = float("nan")


@displayed(lambda f: f"{f.value:.4g} ± {f.u:.2g}")
@dataclass(frozen=True)
class Feature:
    """One number that describes a trace, in the unit that its name ends in; NaN where an end is not known.

    Parameters
    ----------
    value, u : float
        The number and its standard uncertainty.
    low, high : float
        Ends of its 95 % interval.
    count : int
        Number of slips or data points that it rests on.
    """

    value: float
    u: float
    low: float
    high: float
    count: int


SlipChange = tuple[int, float, float]  # number of a slip (0: added), times of its failure and end (NaN: removed)


@displayed(lambda s: f"slip at {s.fail_s:.6g} s, drop {s.drop_N:.4g} N")
@dataclass(frozen=True)
class Slip:
    """One slip of a record; times as recorded in the trace, NaN where a number is not resolved.

    Parameters
    ----------
    start_s, fail_s, end_s : float
        Times in s at which its loading begins (the end of the slip before, or the onset), at which the force is highest
        and at which it is lowest.
    stiffness_N_per_m, points : float and int
        Slope of its loading against the way of the drive in N/m, and the number of data points that it is read from.
    peak_N, trough_N : float
        Force before and after the slip in N.
    slip_m, duration_s, peak_velocity_m_s : float
        Way of the slider from peak to trough in m, its time in s and its highest velocity in m/s.
    precursory_slip_m : float
        Creep in m before the slip: what the force lacks from its loading line, over the stiffness.
    recurrence_s : float
        Time in s since the failure before.
    hold_s : float
        Time in s that the contact was at rest: from the end of the slip before, or the time that the drive stood still.
    loading_N_per_s : float
        The same slope against time in N/s.
    by_hand : bool
        Whether a person added or moved it.
    """

    start_s: float
    fail_s: float
    end_s: float
    stiffness_N_per_m: float
    points: int
    peak_N: float
    trough_N: float
    slip_m: float
    duration_s: float
    peak_velocity_m_s: float
    precursory_slip_m: float
    recurrence_s: float
    hold_s: float
    loading_N_per_s: float = float("nan")
    by_hand: bool = False

    @property
    def drop_N(self) -> float:
        """Force lost in N."""
        return self.peak_N - self.trough_N


@displayed(lambda p: f"{p.test_id}, static {p.static_N:.4g} N, sliding {p.sliding_N:.4g} N")
@dataclass(frozen=True)
class Pull:
    """Static peak and mean sliding force of one trace, by a named rule. Times as recorded in the trace.

    Uncertainties are standard uncertainties (k = 1) of the reading within the trace. NaN where a trace does not
    determine a value.

    Parameters
    ----------
    test_id : str
        Id of the test.
    rule : str
        Rule by which static and sliding friction were read, a name in ``tribo.traces.RULES``.
    static_N, static_u_N : float
        Static friction force in N, and its uncertainty.
    sliding_N, sliding_u_N : float
        Mean sliding friction force in N, and its uncertainty.
    zero_N, zero_u_N : float
        Zero in N that was subtracted from every force, and its uncertainty.
    onset_s, peak_s : float
        Times in s at which the force begins to rise and at which it has its static peak.
    window_s : tuple of float, shape (2,)
        Start and end of the sliding window in s.
    rise_N_per_s, rise_stiffness_N_per_m : float
        Slope of the force before the peak, against time in N/s and against the displacement in N/m.
    stick_slip_amplitude_N, stick_slip_period_s : float
        Amplitude in N and period in s of stick-slip.
    noise_N : float
        Standard deviation of the noise in N.
    drift_N_per_s : float
        Drift of the sliding force in N/s.
    flags : tuple of str
        What is doubtful about the pull, each in a word.
    problems : tuple of Problem
        What is doubtful about the pull, with its place.
    first_maximum_N, highest_N, first_drop_N : float
        Static friction in N read at the first maximum, at the highest point before sliding and before the first drop.
        Where they differ, ``static_u_N`` includes the difference.
    zero_rule : str
        Where the zero was taken, such as "before contact".
    recorded_load_N, recorded_load_u_N : float
        Mean of the recorded normal force in N, and its uncertainty.
    oscillation : Oscillation, optional
        How the force varies while sliding.
    restarts : tuple of Restart
        Static friction after every stop within the record.
    phases : tuple of Phase
        The parts of the record, in order of time.
    slips : tuple of Slip
        The slips of the record, in order of time.

    Examples
    --------
    >>> pull = tribo.read_pull(tribo.data_dir() / "example" / "raw" / "T001.csv")
    >>> print(f"{pull.static_N:.2f} N at {pull.peak_s:.2f} s, sliding {pull.sliding_N:.2f} N")
    2.22 N at 3.56 s, sliding 1.18 N
    """

    test_id: str
    rule: str
    static_N: float = float("nan")
    static_u_N: float = float("nan")
    sliding_N: float = float("nan")
    sliding_u_N: float = float("nan")
    zero_N: float = 0.0
    zero_u_N: float = 0.0
    onset_s: float = float("nan")
    peak_s: float = float("nan")
    window_s: tuple[float, float] = (float("nan"), float("nan"))
    rise_N_per_s: float = float("nan")
    rise_stiffness_N_per_m: float = float("nan")
    stick_slip_amplitude_N: float = float("nan")
    stick_slip_period_s: float = float("nan")
    noise_N: float = float("nan")
    drift_N_per_s: float = float("nan")
    flags: tuple[str, ...] = ()
    problems: tuple[Problem, ...] = ()
    first_maximum_N: float = float("nan")
    highest_N: float = float("nan")
    first_drop_N: float = float("nan")
    zero_rule: str = ""
    recorded_load_N: float = float("nan")
    recorded_load_u_N: float = float("nan")
    oscillation: Oscillation | None = None
    restarts: tuple[Restart, ...] = ()
    phases: tuple[Phase, ...] = ()
    slips: tuple[Slip, ...] = ()


STANDARD_GRAVITY = 9.80665  # m/s2, CGPM 1901
MEDIAN_TO_SD = 1.4826  # standard over median absolute deviation of a normal distribution
CLOSED_TRACK_M = 10.0  # a longer slide runs over its own track again and again; no sled has so long a track


def picture_mask(text: str) -> NDArray[np.bool_]:
    """The mask (height, width) in the picture of a pattern."""
    size, _, bits = text.partition(":")
    width, height = (int(n) for n in size.split("x"))
    packed = np.frombuffer(bytes.fromhex(bits), np.uint8)
    return np.unpackbits(packed, count=width * height).astype(bool).reshape(height, width)


@displayed(lambda p: f"{p.name}, {'flat' if p.is_flat else p.cavity}")
@dataclass(frozen=True)
class Pattern:
    """Geometry of one cavity pattern.

    Parameters
    ----------
    name : str
        Name of the pattern.
    cavity : str
        Shape of the cavities: "circle", "square", "rectangle", "ellipse", "ridge", "chevron", "random" or "mask";
        "none" for a flat sample.
    size_m : tuple of float, shape (2,), optional
        Size of a cavity in m along x and y; the diameter twice for a circle, the width twice for ridges along y, the
        width of an arm and the shift of its tip along x for a chevron, the mean lengths for a picture.
    pitch_m : tuple of float, shape (2,), optional
        Distance in m from one cavity to the next along x and y; the extent of a picture.
    staggered : bool
        Whether every other row is shifted by half a pitch in x.
    measured_area_fraction : float, optional
        Contact area over nominal area as measured, in place of that of the geometry.
    feature : "hole" or "pillar"
        Whether the shapes are cavities, or are what touches.
    lattice : "rows" or "hexagonal"
        Only for the name: a hexagonal lattice is one of staggered rows sqrt(3) / 2 apart.
    picture, pixel_m : str and float, optional
        Mask of "random" and "mask", and the side of its pixels in m.

    Examples
    --------
    >>> pattern = tribo.Pattern("B", "circle", size_m=(10e-6, 10e-6), pitch_m=(15e-6, 15e-6))
    >>> round(pattern.area_fraction, 3)
    0.651
    """

    name: str
    cavity: str = "none"
    size_m: tuple[float, float] | None = None
    pitch_m: tuple[float, float] | None = None
    staggered: bool = False
    measured_area_fraction: float | None = None
    feature: str = "hole"
    lattice: str = "rows"
    picture: str | None = None
    pixel_m: float | None = None

    @property
    def area_fraction(self) -> float:
        """Contact area fraction AF: contact area over nominal area, 1 for a flat sample."""
        if self.measured_area_fraction is not None:
            return self.measured_area_fraction
        if self.cavity == "none" or self.size_m is None or self.pitch_m is None:
            return 1.0
        if self.picture is not None:
            return float(picture_mask(self.picture).mean())
        share = np.pi / 4 if self.cavity in ("circle", "ellipse") else 1.0
        if self.cavity in ("ridge", "chevron"):
            covered = self.size_m[0] / self.pitch_m[0]
        else:
            covered = share * self.size_m[0] * self.size_m[1] / (self.pitch_m[0] * self.pitch_m[1])
        return float(covered if self.feature == "pillar" else 1.0 - covered)

    @property
    def is_drawn(self) -> bool:
        """Whether the model takes its shapes as they are, blocks at their edges by the share of them that touches."""
        own = self.cavity in ("ellipse", "ridge", "chevron", "random", "mask")
        return own or self.feature == "pillar" or self.lattice == "hexagonal"

    @property
    def too_wide_along(self) -> str:
        """The axes along which cavities that are made of whole blocks leave no wall: "", "x", "y" or "xy"."""
        if self.size_m is None or self.pitch_m is None or self.is_drawn:
            return ""
        return "".join(a for a, size, pitch in zip("xy", self.size_m, self.pitch_m, strict=True) if not size < pitch)

    @property
    def is_flat(self) -> bool:
        """Whether the sample has no cavities."""
        return self.cavity == "none"

    @property
    def rim_per_m(self) -> float:
        """Rim length of the cavities per nominal area, 1/m; 0 for a flat sample."""
        if self.cavity == "none" or self.size_m is None or self.pitch_m is None:
            return 0.0
        x, y = self.size_m
        rim = np.pi * x if self.cavity == "circle" else 2.0 * (x + y)
        return float(rim / (self.pitch_m[0] * self.pitch_m[1]))


@displayed()
@dataclass(frozen=True)
class Correction:
    """What a user states about the numbers of an export; applied once, at the end of reading.

    The friction force is multiplied by ``sign`` (1 or -1) and ``gain``; a torque becomes a force over ``lever_arm_m``.
    ``sampling_rate_Hz`` gives the time where the export has none, else ``speed_m_s`` does for a recorded path. A
    friction coefficient without a recorded load is multiplied by ``load_N``, a recorded stress by ``area_m2``.
    """

    sign: float = 1.0
    gain: float = 1.0
    lever_arm_m: float | None = None
    sampling_rate_Hz: float | None = None
    speed_m_s: float | None = None
    load_N: float | None = None
    area_m2: float | None = None


UNCORRECTED = Correction()


@displayed(lambda t: f"{t.test_id}, {t.sample}, {t.normal_load_N:.4g} N")
@dataclass(frozen=True)
class Test:
    """One row of tests.csv: one pull, its load and its covariates.

    ``correction`` is what was stated about the numbers of its export. Where it has none, ``evaluated`` holds its forces
    by their names in :class:`Pull`, such as "static_N" and "static_u_N".
    """

    __test__ = False  # not a pytest class

    test_id: str
    file: str
    sample: str
    normal_load_N: float
    specimen: str
    direction: str = ""
    speed_m_s: float | None = None
    hold_s: float | None = None
    repeat: int | None = None
    run_order: int | None = None
    specimen_run: int | None = None
    started_at: str = ""
    temperature_C: float | None = None
    humidity_pct: float | None = None
    operator: str = ""
    exclude: str = ""
    covariates: Mapping[str, str] = field(default_factory=dict)
    row: int | None = None
    correction: Correction = UNCORRECTED
    evaluated: Mapping[str, float] | None = None
    zero: ZeroChoice = DEFAULT
    load_zero: ZeroChoice = DEFAULT
    stiffness_N_per_m: float | None = None  # of the spring, wire or beam through which the slider is pulled
    load_from: str = ""  # column of tests.csv that gave the load; empty where the export did
    mass_kg: float | None = None  # put on the slider, as tests.csv states it


@displayed(lambda s: f"{s.test_id}: {s.reason}")
@dataclass(frozen=True)
class SetAside:
    """A test that is not used in the results, with the reason."""

    test_id: str
    reason: str
    problems: tuple[Problem, ...] = ()


@displayed(lambda d: f"{d.name}: {d.found}")
@dataclass(frozen=True)
class Doubt:
    """A number outside its broad physical bounds or far from those of equal tests, or a design that cannot give the
    number it is for.

    ``quantity`` is its name for programs, ``name`` that for people; ``found`` and ``plausible`` are texts with units,
    ``place`` is where to look, ``slip`` the question that may explain it, ``source`` where the bounds are from,
    ``material_class`` the class they hold for, and ``tests`` the tests in doubt where it is not about all of them.
    """

    quantity: str
    name: str
    found: str
    plausible: str
    place: str
    slip: str = ""
    source: str = ""
    material_class: str = ""
    tests: tuple[str, ...] = ()

    def __str__(self) -> str:
        return f"{self.without_slip()}. Likely slip: {self.slip}" if self.slip else self.without_slip()

    def without_slip(self) -> str:
        """The number, its bounds and its place as a sentence."""
        kind = f" ({self.material_class})" if self.material_class else ""
        return f"{self.name} is {self.found}; plausible{kind}: {self.plausible}; see {self.place}"


@displayed(lambda c: f"{c.title}, {len(c.tests)} tests of {len(c.samples)} samples")
@dataclass(frozen=True)
class Campaign:
    """A campaign as described by campaign.toml and tests.csv; the exports in raw/ are not read yet.

    Parameters
    ----------
    title : str
        Title of the campaign.
    root : Path
        Its folder.
    nominal_area_m2 : float or None
        Area of the face of a sample in m2, cavities included; None where it is not stated.
    tests : tuple of Test
        The usable rows of tests.csv.
    samples : mapping of str to Pattern
        Pattern of each sample by its name (``Sx`` is pattern S pulled along x).
    material, counterface : str
        The two materials in contact, as stated.
    slider_mass_kg : float
        Mass of the slider in kg without the weights put on it.
    slider_mass_stated : bool
        Whether campaign.toml states that mass, be it 0.
    pull_speed_m_s : float, optional
        Pull speed in m/s of tests that state none.
    set_aside : tuple of SetAside
        Rows with faults or with a reason in the column ``exclude``.
    problems : tuple of Problem
        Doubts about campaign.toml and tests.csv.
    columns : mapping of str to str or list of str
        Column of the exports by quantity, from [columns].
    columns_by_file : mapping of str to mapping
        The same for single files or patterns of names of files.
    instrument : mapping of str to float
        Standard uncertainties (k = 1) and properties of the rig from [instrument], in the unit that each name ends in.
    chosen_flat : str
        The flat sample that a user chose for the calibration of the model; :attr:`flat_sample` is the one in use.
    zero, load_zero : ZeroChoice
        Where the zeros of the force and of the recorded normal load come from, for tests that do not state it.
    contact : str
        As stated: sled, pin_on_disc, ball_on_disc, ring_shear, reciprocating or rotary.
    material_class : str
        As stated: elastomer, polymer, metal, ceramic, lubricated or granular.
    plausible : mapping of str to tuple of float, shape (2,)
        Stated bounds of a quantity, in the unit that its name ends in, in place of those of the material class.
    measured : mapping of str to tuple of float, shape (2,)
        Amplitude of a mechanism that was measured directly, and its standard uncertainty, in the unit of the mechanism.
    viscosity_Pa_s : float, optional
        Viscosity of the lubricant in Pa s, for Hersey numbers.
    inputs : mapping of str to str
        SHA-256 of every file that was read, by its path in the campaign.

    Examples
    --------
    >>> campaign = tribo.load_campaign(tribo.data_dir() / "example")
    >>> print(len(campaign.tests), campaign.flat_sample, f"{campaign.nominal_pressure_Pa(1.0):.0f} Pa")
    144 F 18182 Pa
    """

    title: str
    root: Path
    nominal_area_m2: float | None
    tests: tuple[Test, ...]
    samples: Mapping[str, Pattern]
    material: str = ""
    counterface: str = ""
    slider_mass_kg: float = 0.0
    pull_speed_m_s: float | None = None
    set_aside: tuple[SetAside, ...] = ()
    problems: tuple[Problem, ...] = ()
    columns: Mapping[str, str | list[str]] = field(default_factory=dict)
    columns_by_file: Mapping[str, Mapping[str, str | list[str]]] = field(default_factory=dict)
    instrument: Mapping[str, float] = field(default_factory=dict)
    chosen_flat: str = ""
    zero: ZeroChoice = DEFAULT
    load_zero: ZeroChoice = DEFAULT
    contact: str = ""
    material_class: str = ""
    plausible: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    measured: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    viscosity_Pa_s: float | None = None
    inputs: Mapping[str, str] = field(default_factory=dict, compare=False)
    slider_mass_stated: bool = True

    @property
    def has_area(self) -> bool:
        """Whether the nominal area is stated; without one the adhesion term is a force, T0 in newton."""
        return self.nominal_area_m2 is not None

    @property
    def area_m2(self) -> float:
        """The nominal area, for what cannot do without; a CampaignError where none is stated."""
        if self.nominal_area_m2 is None:
            what = "the nominal area is not stated, so there is no pressure"
            allowed = "nominal_area_mm2 in campaign.toml"
            raise CampaignError(Problem("no_area", what, file="campaign.toml", allowed=allowed))
        return self.nominal_area_m2

    @property
    def flat_samples(self) -> tuple[str, ...]:
        """Every measured sample without cavities, in alphabetical order."""
        measured = {test.sample for test in self.tests}
        return tuple(sorted(s for s in measured if s in self.samples and self.samples[s].is_flat))

    @property
    def flat_sample(self) -> str:
        """The sample that calibrates the model: the chosen one, else F, else the only flat one, else empty."""
        flat = self.flat_samples
        if self.chosen_flat or "F" in flat:
            return self.chosen_flat or "F"
        return flat[0] if len(flat) == 1 else ""

    def area_fraction(self, sample: str) -> float:
        """Contact area fraction of a sample."""
        return self.samples[sample].area_fraction

    def judged_load_N(self, pressure_Pa: float = 10e3) -> float:
        """The load of a pressure where it lies among the loads of the tests, else the middle of these."""
        loads = [test.normal_load_N for test in self.tests if math.isfinite(test.normal_load_N)]
        usual = pressure_Pa * self.area_m2 if self.has_area else math.nan
        return usual if loads and min(loads) <= usual <= max(loads) else float(np.median(loads or [math.nan]))

    def nominal_pressure_Pa(self, normal_load_N: float) -> float:
        """p = N / A with A the nominal area."""
        return normal_load_N / self.area_m2


@displayed(lambda o: f"{o.test_id}: {o.action}")
@dataclass(frozen=True)
class Override:
    """A decision made by hand about one test: exclude it, move its static peak or sliding window, state phases, or
    remove, add or move slips.

    Times as recorded in the trace; None where the automatic value is kept. ``automatic`` is the result without the
    decision, without any number where the test had been set aside; ``trace`` is None where the forces were evaluated
    elsewhere.
    """

    test_id: str
    action: Literal["exclude", "move", "phase", "event"]
    automatic: Pull
    trace: Trace | None = None
    reason: str = ""
    window_s: tuple[float, float] | None = None
    peak_s: float | None = None
    phases: tuple[Phase, ...] = ()
    slips: tuple[SlipChange, ...] = ()


@displayed(lambda i: f"{i.campaign.title}, {len(i.pulls)} pulls, {len(i.set_aside)} tests set aside")
@dataclass(frozen=True)
class Ingested:
    """A campaign with its exports read: one trace and one pull per usable test, the rest set aside.

    Parameters
    ----------
    campaign : Campaign
        The campaign; a row that names several pulls of an export has become one test per pull.
    traces : mapping of str to Trace
        Trace by the id of its test; none where forces were evaluated elsewhere.
    pulls : mapping of str to Pull
        Static and sliding friction by the id of the test.
    set_aside : tuple of SetAside
        Tests that are not used, with reasons.
    by_hand : mapping of str to Override
        Tests that have a trace, with a decision made by hand: an excluded one is also in ``set_aside``; a moved one has
        its new result in ``pulls``.
    features : mapping of str to mapping of str to Feature
        Features of the trace of each test, by their names in ``tribo.traces.features.FEATURES``.
    readings : tuple of Reading
        Plateaus, steps, cycles, running-in and holds of records that are more than one pull from rest.

    Examples
    --------
    >>> ingested = tribo.ingest(tribo.load_campaign(tribo.data_dir() / "example"))
    >>> len(ingested.pulls), len(ingested.set_aside), ingested.traces["T001"].file
    (144, 0, 'raw/T001.csv')
    """

    campaign: Campaign
    traces: Mapping[str, Trace]
    pulls: Mapping[str, Pull]
    set_aside: tuple[SetAside, ...]
    by_hand: Mapping[str, Override] = field(default_factory=dict)
    readings: tuple[Reading, ...] = ()
    features: Mapping[str, Mapping[str, Feature]] = field(default_factory=dict)

    @property
    def used_tests(self) -> tuple[Test, ...]:
        """The tests that have a pull, in the order of the campaign."""
        return tuple(test for test in self.campaign.tests if test.test_id in self.pulls)

    def typical(self, tests: Sequence[Test]) -> Test:
        """Of some usable tests that with the fewest flags, and among these the one whose static peak lies nearest their
        median; equally near ones, to nine digits, in the order of their ids, so that every processor chooses alike."""
        peaks = {t.test_id: self.pulls[t.test_id].static_N for t in tests}
        middle = float(np.median(list(peaks.values())))

        def order(test: Test) -> tuple[int, float, str]:
            away = abs(peaks[test.test_id] - middle) / abs(middle) if middle else abs(peaks[test.test_id])
            return len(self.pulls[test.test_id].flags), round(away, 9), test.test_id

        return min(tests, key=order)

    def doubts(self) -> tuple[SetAside, ...]:
        """Tests that were used although their row, export or pull is doubtful, for example because of a spike."""
        found = []
        for test_id, pull in self.pulls.items():
            trace = self.traces.get(test_id)  # none where the forces were evaluated elsewhere
            file, of_trace = (trace.file, trace.problems) if trace else ("", ())
            problems = tuple(
                replace(p, file=file or p.file, test_id=test_id) for p in dict.fromkeys((*of_trace, *pull.problems))
            )
            problems += tuple(note for note in self.campaign.problems if note.test_id == test_id)
            if problems:
                found.append(SetAside(test_id, "; ".join(map(str, problems)), problems))
        return tuple(found)

    def table(self) -> pd.DataFrame:
        """One row per usable test: its results, its conditions and the campaign's own columns.

        Returns
        -------
        DataFrame
            test_id, sample, specimen, normal_load_N, static_N, static_u_N, sliding_N, sliding_u_N (forces in N, zero
            subtracted, with standard uncertainties of the reading); then the conditions that any test states, such as
            speed_m_s and temperature_C; then every column of tests.csv that tribo does not know, as numbers where all
            its cells are.

        Examples
        --------
        >>> table = tribo.ingest(tribo.load_campaign(tribo.data_dir() / "example")).table()
        >>> len(table), table.columns[3]
        (144, 'normal_load_N')
        """
        import pandas as pd

        tests = self.used_tests
        named = ("test_id", "sample", "specimen", "normal_load_N")
        rows = [
            {name: getattr(test, name) for name in named}
            | {name: getattr(self.pulls[test.test_id], name) for name in READINGS}
            for test in tests
        ]
        table = pd.DataFrame(rows)
        more: dict[str, list[Any]] = {}
        for name in CONDITIONS:
            values = [getattr(test, name) for test in tests]
            if any(value not in (None, "") for value in values):
                more[name] = values
        for name in dict.fromkeys(name for test in tests for name in test.covariates):
            if name not in table and name not in more:
                cells = [test.covariates.get(name, "") for test in tests]
                filled = [cell for cell in cells if cell]
                plain = filled and all(map(_PLAIN_NUMBER.fullmatch, filled))
                more[name] = [float(cell) if cell else float("nan") for cell in cells] if plain else cells
        return pd.concat([table, pd.DataFrame(more, table.index)], axis=1) if more else table


READINGS = ("static_N", "static_u_N", "sliding_N", "sliding_u_N")
CONDITIONS = (
    "direction", "speed_m_s", "hold_s", "repeat", "run_order", "specimen_run", "started_at", "temperature_C",
    "humidity_pct", "operator",
)  # fmt: skip
_PLAIN_NUMBER = re.compile(r"-?(0|[1-9]\d*)(\.\d+)?([eE][-+]?\d{1,2})?")  # 001 is a name


@displayed(lambda p: f"{p.name} {p.value:.4g}")
@dataclass(frozen=True)
class TraceLawParameter:
    """One parameter of a law or machine that was read from a whole trace.

    Parameters
    ----------
    name : str
        Its name, with the unit at its end.
    value, low, high : float
        Best value and 95 % interval, in ``unit``.
    unit : str
        SI unit, "1" where it has none.
    told : bool
        Whether the record holds it; where not, it cannot be told and the interval says how far it is bound.
    """

    name: str
    value: float
    low: float
    high: float
    unit: str
    told: bool


@displayed(lambda law: f"{law.law}: " + ", ".join(f"{p.name} {p.value:.4g}" for p in law.parameters))
@dataclass(frozen=True)
class TraceLaw:
    """A friction law and the machine under it, read from one whole trace.

    Parameters
    ----------
    law : str
        Name of the law, as in :data:`tribo.slider.SLIDER_LAWS`, or in ``tribo.tracelaws``.
    parameters : tuple of TraceLawParameter
        Parameters of law and machine with intervals.
    log_likelihood : float
        Of slips, strokes, speeds and rests: log density of all of them, each by a fit without its part of the evidence.
        Of steps of speed: of the whole record, without the terms that two laws share.
    samples : int
        Slips, strokes, stretches, records or samples that count.
    evidence : str
        "slips", "strokes", "speeds", "rests" or "steps of speed".
    scores : tuple of float
        Log density of each slip, stroke, stretch or record left out of the fit; empty for steps of speed.
    test_id : str
        The test; of a law of several records, sample and load.
    """

    law: str
    parameters: tuple[TraceLawParameter, ...]
    log_likelihood: float
    samples: int
    evidence: str
    scores: tuple[float, ...] = ()
    test_id: str = ""

    def __getitem__(self, name: str) -> TraceLawParameter:
        return next(p for p in self.parameters if p.name == name)


@displayed(lambda s: f"{s.ingested.campaign.title}, {len(s.ingested.pulls)} pulls, {len(s.fits)} fits")
@dataclass(frozen=True)
class Study:
    """One campaign with the results of all stages. Its tables have the columns and units of the files of their names.

    Parameters
    ----------
    ingested : Ingested
        The campaign with its pulls.
    fits : Fits
        Measured law T = mu N + tau0 A of every sample and regime under the chosen weights, with its combined
        uncertainty, which is what the report states.
    other_fits : tuple of LawFit
        The same by the tests of each sample alone, under other weights or laws.
    comparison : Comparison, optional
        Measured and simulated force in N at each load.
    simulated : DataFrame, optional
        One row per run of the model: sample, pressure_Pa, normal_load_N (p times the nominal area of the campaign),
        angle_deg, seed, static_N, sliding_N.
    example_runs : tuple of Run
        One full force trace of the model per sample.
    recorded_runs : mapping of str to (Trace, Pull, mapping of str to Feature)
        By the id of a test beside it, the example run of its sample as the machine of the campaign would record it,
        with what the readers read of it.
    budget : DataFrame, optional
        Uncertainty budget of every fitted number, one row per component.
    power : tuple of str
        The differences that this campaign could detect, as sentences.
    outlying : tuple of str
        Outlying pulls and specimens, as sentences.
    differences : DataFrame, optional
        Differences between samples measured on the same specimens, one row per pair of samples, regime and number.
    laws : DataFrame, optional
        The candidate laws of every sample, compared by held-out loads.
    dependence : DataFrame, optional
        How T/N changes with each recorded variable.
    notes : tuple of str
        What was left out, and what a reader must know of the model runs, as sentences.
    doubts : tuple of Doubt
        Numbers outside their broad physical bounds, or far from those of equal tests.
    undiagnosed : str
        Why there is no diagnosis.
    trace_laws : tuple of TraceLaw
        Laws and machines read from whole traces, where they were asked for.

    Examples
    --------
    >>> study = tribo.study(tribo.load_campaign(tribo.data_dir() / "example"), until="fit")
    >>> len(study.fits), len(study.residuals())
    (12, 288)
    """

    ingested: Ingested
    fits: Fits = field(default_factory=Fits)
    other_fits: tuple[LawFit, ...] = ()
    comparison: Comparison | None = None
    simulated: pd.DataFrame | None = None
    example_runs: tuple[Run, ...] = ()
    recorded_runs: Mapping[str, tuple[Trace, Pull, Mapping[str, Feature]]] = field(default_factory=dict)
    budget: pd.DataFrame | None = None
    power: tuple[str, ...] = ()
    outlying: tuple[str, ...] = ()
    differences: pd.DataFrame | None = None
    laws: pd.DataFrame | None = None
    dependence: pd.DataFrame | None = None
    notes: tuple[str, ...] = ()
    doubts: tuple[Doubt, ...] = ()
    undiagnosed: str = ""
    trace_laws: tuple[TraceLaw, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "fits", Fits(self.fits))  # the record is frozen

    @property
    def combined(self) -> Fits:
        """The same as ``fits``, which hold the combined uncertainty."""
        return self.fits

    def residuals(self) -> pd.DataFrame:
        """Measured friction force of every test over that of the fitted law of its sample.

        Returns
        -------
        DataFrame
            One row per test and regime: the columns of ``ingested.table()`` without its forces, then regime, T_N
            (measured), fitted_N, residual_N = T_N - fitted_N, and residual_percent, 100 (T_N / fitted_N - 1).
            ``tribo.plot.residuals(study)`` draws them.

        Examples
        --------
        >>> study = tribo.study(tribo.load_campaign(tribo.data_dir() / "example"), until="fit")
        >>> study.residuals().groupby("regime")["residual_percent"].mean().abs().max() < 2
        True
        """
        import pandas as pd

        table = self.ingested.table()
        parts = []
        for fit in self.fits if len(table) else ():
            rows = table[(table["sample"] == fit.sample) & np.isfinite(table[f"{fit.regime}_N"])]
            force, fitted = rows[f"{fit.regime}_N"].to_numpy(float), fit.force_N(rows["normal_load_N"].to_numpy(float))
            found = {"regime": fit.regime, "T_N": force, "fitted_N": fitted, "residual_N": force - fitted}
            parts.append(
                rows.drop(columns=list(READINGS)).assign(**found, residual_percent=100.0 * (force / fitted - 1.0))
            )
        return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame()


Weights = Literal["relative", "ratio", "force", "repeats"]


@displayed()
@dataclass(frozen=True)
class StudyOptions:
    """Options of a study; each is recorded with the results.

    Parameters
    ----------
    rule : str
        How static and sliding friction are read from a trace, a name in ``tribo.traces.RULES``.
    weights : "relative", "ratio", "force" or "repeats"
        Which scatter is taken as constant over the loads; see :func:`tribo.fit`.
    zero, load_zero : str
        Zero of the force and of the recorded normal load, for tests without their own: "before contact", "at rest",
        "none", a number in N, or "[from, to]" in s.
    no_model : bool
        Leave the spring-block model out.
    flat : str
        The sample that calibrates the model; empty: F, or the only flat sample.
    runs : int
        Simulations per sample and load.
    seed : int
        Seed of all random numbers.
    jobs : int
        Processes at once; no result depends on it.
    laws : Path, optional
        Folder with laws of earlier campaigns.
    overrides : Path, optional
        Table of decisions made by hand about single pulls.
    kept : Path, optional
        Folder of finished simulations and diagnosis, used again by the next start.
    scheduler : str, optional
        Address of a dask scheduler that runs the simulations.
    trace_law : str, optional
        Law to read from whole traces, "auto" or a name in ``tribo.tracelaws``.

    Examples
    --------
    >>> options = tribo.StudyOptions(rule="astm_d1894", no_model=True)
    >>> study = tribo.study(tribo.load_campaign(tribo.data_dir() / "example"), options, until="ingest")
    >>> study.ingested.pulls["T001"].rule
    'astm_d1894'
    """

    rule: str = "first_peak"
    weights: Weights = "relative"
    zero: str = ""
    load_zero: str = ""
    no_model: bool = False
    flat: str = ""
    runs: int = 4
    seed: int = 0
    jobs: int = 2
    laws: Path | None = None
    overrides: Path | None = None
    kept: Path | None = None
    scheduler: str | None = None
    trace_law: str | None = None

    def as_words(self) -> dict[str, str]:
        """The options as text, for the provenance."""
        laws = {"laws": str(self.laws)} if self.laws is not None else {}
        zeros = {name: text for name, text in (("zero", self.zero), ("load_zero", self.load_zero)) if text}
        laws |= {"trace_law": self.trace_law} if self.trace_law else {}
        return {"rule": self.rule, "weights": self.weights, "flat": self.flat, "runs": str(self.runs), **zeros, **laws}


__all__ = [
    "CLOSED_TRACK_M",
    "PA_PER_KPA",
    "PHASES",
    "READINGS_OF_A_RECORD",
    "REGIMES",
    "STANDARD_GRAVITY",
    "UNCORRECTED",
    "Campaign",
    "Comparison",
    "ComparisonRow",
    "Correction",
    "Doubt",
    "ExportFormat",
    "Feature",
    "Fits",
    "FloatArray",
    "Ingested",
    "Interval",
    "LawFit",
    "Oscillation",
    "Override",
    "Pattern",
    "Phase",
    "Pull",
    "Reading",
    "Regime",
    "Restart",
    "Run",
    "SetAside",
    "Slip",
    "SlipChange",
    "Study",
    "StudyOptions",
    "Test",
    "Trace",
    "Weights",
]
