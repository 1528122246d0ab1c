"""The frozen records of exports and of what is read from a pull, in SI units; names end in the unit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tribo.display import displayed
from tribo.errors import Problem

FloatArray = NDArray[np.float64]


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

    Arrays share one length n >= 1. ``columns`` holds further quantities by SI name ("normal_force_N"),
    ``metadata`` the file's own header untouched, ``flags`` doubts of the reader. ``first_row`` is the line of the
    file, counted from 1, with the first data point.
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


@displayed(lambda p: f"{p.name}, {p.start_s:.4g} to {p.end_s:.4g} s")
@dataclass(frozen=True)
class Phase:
    """A part of a record by what the rig did, from ``start_s`` to ``end_s`` on the clock of the trace."""

    name: str
    start_s: float
    end_s: float


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


@displayed(lambda p: f"{p.test_id}, static {p.static_N:.4g} N, sliding {p.sliding_N:.4g} N")
@dataclass(frozen=True)
class Pull:
    """Static peak and mean sliding force of one trace, by a named rule. Times as recorded in the trace.

    ``*_u_N`` are standard uncertainties (k = 1) of the reading within the trace. ``zero_N`` was subtracted
    from every force. ``window_s`` is the sliding window (start, end). NaN where a trace does not determine a value.
    ``first_maximum_N``, ``highest_N`` and ``first_drop_N`` are three readings of the static peak: where they differ,
    ``static_u_N`` includes the difference.
    """

    test_id: str
    rule: str
    static_N: float
    static_u_N: float
    sliding_N: float
    sliding_u_N: float
    zero_N: float
    zero_u_N: float
    onset_s: float
    peak_s: float
    window_s: tuple[float, float]
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
