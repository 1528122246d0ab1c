"""What follows from the columns and from what was stated: time, force from a torque, sign and gain.

The one place where a recorded force is changed; everything after it sees the corrected one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tribo.errors import Problem
from tribo.readers.core.assign import Assignment, Column
from tribo.readers.core.checks import Finding
from tribo.records import Correction, FloatArray

NO_TIME = "no_time"
_PATH_FOR_TIME_M_S = 1e-3  # 1 mm of path counts as 1 s where neither time nor speed is known

Arrays = dict[str, FloatArray]


def complete(
    arrays: Arrays, assignment: Assignment, correction: Correction, file: str
) -> tuple[Arrays, Assignment, tuple[Finding, ...]]:
    """Arrays that hold time and friction force, the columns they came from, and a doubt where time is missing."""
    columns = list(assignment.columns)
    findings: list[Finding] = []
    if "friction force" not in arrays:
        column = next(c for c in columns if c.quantity == "torque")
        arrays = {**arrays, "friction force": arrays["torque"] / (correction.lever_arm_m or 1.0)}
        reason = f"torque over the lever arm of {(correction.lever_arm_m or 0.0) * 1e3:g} mm, as given"
        columns.append(Column("friction force", -1, column.label, 1.0, 0.0, reason))
    if "rotation speed" in arrays and "speed" not in arrays and correction.lever_arm_m is not None:
        arrays = {**arrays, "speed": 2.0 * np.pi * correction.lever_arm_m * arrays["rotation speed"]}
        columns.append(_speed_of_turns(columns, correction.lever_arm_m))
    factor = correction.sign * correction.gain
    if factor != 1.0:
        arrays = {**arrays, "friction force": arrays["friction force"] * factor}
        columns = [_scaled(c, correction) if c.quantity == "friction force" else c for c in columns]
    if "time" not in arrays:
        time, column = _time(arrays, correction)
        arrays = {**arrays, "time": time}
        columns.append(column)
        if correction.sampling_rate_Hz is None and correction.speed_m_s is None:
            findings.append(Finding(NO_TIME, _no_time(file)))
    return arrays, replace(assignment, columns=tuple(columns)), tuple(findings)


def _speed_of_turns(columns: Sequence[Column], lever_arm_m: float) -> Column:
    turns = next(c for c in columns if c.quantity == "rotation speed")
    reason = f"rotation speed times 2 pi times the lever arm of {lever_arm_m * 1e3:g} mm, as given"
    return Column("speed", -1, turns.label, 1.0, 0.0, reason)


def _scaled(column: Column, correction: Correction) -> Column:
    said = [f"gain {correction.gain:g}"] if correction.gain != 1.0 else []
    said += ["sign reversed"] if correction.sign < 0 else []
    return replace(column, reason=f"{column.reason}; {', '.join(said)}, as given")


def _time(arrays: Arrays, correction: Correction) -> tuple[FloatArray, Column]:
    if correction.sampling_rate_Hz is not None:
        n = arrays["friction force"].size
        reason = f"row number over the sampling rate of {correction.sampling_rate_Hz:g} Hz, as given"
        return np.arange(n) / correction.sampling_rate_Hz, Column("time", -1, "sampling rate", 1.0, 0.0, reason)
    path = np.abs(np.diff(arrays["displacement"], prepend=arrays["displacement"][:1])).cumsum()
    speed = correction.speed_m_s or _PATH_FOR_TIME_M_S
    reason = f"path over the speed of {speed * 1e3:g} mm/s" + (", as given" if correction.speed_m_s else "")
    return path / speed, Column("time", -1, "path", 1.0, 0.0, reason)


def _no_time(file: str) -> Problem:
    what = (
        "neither time nor speed is known: the path stands for the time, 1 mm for 1 s; forces and their dependence on "
        "the path hold, while durations, rates, periods and drift per second are not determined"
    )
    return Problem(NO_TIME, what, file, allowed="speed_mm_s, sampling_rate_Hz, or a column of the time")
