"""The zero of the force and of the load of a record: chosen by a user, or the level before contact."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tribo.errors import Problem, TraceError
from tribo.records import FloatArray, Trace
from tribo.traces.phases import Course, Range
from tribo.traces.signal import Signal, wander
from tribo.traces.sliding import settled
from tribo.zeroing import ZeroChoice

_FEWEST = 5
_CERTAIN = 5.0  # two levels agree where they differ by less than this many times their joint uncertainty
_UNPULLED = 0.3  # share of the largest force below which a force at a stop tells of the zero


@dataclass(frozen=True)
class Level:
    """A zero that was read or chosen: force, standard uncertainty, and how it came about. ``drifts`` where it moved."""

    force_N: float
    u_N: float
    rule: str
    drifts: bool = False


def chosen_zero(choice: ZeroChoice, time_s: FloatArray, values: FloatArray, course: Course, file: str) -> Level | None:
    """The zero of a channel (n,) by a choice; None where the choice leaves it to the force before the rise.

    Raises
    ------
    TraceError
        The record has no part in which the zero could be read as chosen.
    """
    if choice.kind == "none":
        return Level(0.0, 0.0, "none")
    if choice.kind == "value":
        return Level(choice.value_N, 0.0, str(choice))
    if choice.kind == "interval":
        first, last = np.searchsorted(time_s, choice.interval_s)
        span = f"{time_s[0]:.6g} to {time_s[-1]:.6g} s"
        return _level(time_s, values, (int(first), int(last)), str(choice), _none_there("interval", file, span))
    if choice.kind == "at rest":
        ranges = rest_ranges(course, values)
        problem = _none_there("rest", file, '"before contact", "none", a number, or [from, to] in seconds')
        return _level(time_s, values, ranges[-1] if ranges else (0, 0), "at rest", problem)
    if course.touches_later:
        problem = _none_there("part before contact", file, "")
        return _level(time_s, values, (0, course.contact[0]), "before contact", problem)
    return None


def _none_there(what: str, file: str, allowed: str) -> Problem:
    said = f"the zero cannot be read: the record has no {what} of {_FEWEST} data points or more"
    return Problem("no_zero_there", said, file or None, column="zero", allowed=allowed or None)


def _level(time_s: FloatArray, values: FloatArray, span: Range, rule: str, problem: Problem) -> Level:
    """Mean over the settled part of a range; what it drifts there is in the uncertainty."""
    first, last = span
    if last - first < _FEWEST:
        raise TraceError(problem)
    if rule == "at rest":
        first += settled(values[first:last])
    part = values[first:last]
    slow = wander(part, float(time_s[last - 1] - time_s[first]))
    edges = max(part.size // 5, 1)
    drift = abs(float(np.median(part[-edges:]) - np.median(part[:edges])))
    u = max(slow.mean_u, slow.noise / math.sqrt(part.size)) if part.size > 2 else 0.0
    drifts = drift > _CERTAIN * max(u, 1e-300)
    return Level(float(part.mean()), math.hypot(u, drift / math.sqrt(12.0) if drifts else 0.0), rule, drifts)


def rest_ranges(course: Course, values: FloatArray) -> list[Range]:
    """Ranges in which nothing pulls: rest of the drive, parts without contact, and stops at which the force fell."""
    top = float(np.percentile(np.abs(values), 95))
    unpulled = [(a, b) for a, b in course.stops if float(np.median(np.abs(values[a:b]))) < _UNPULLED * top]
    rests = [(a, b) for a, b in course.rests if (a, b) not in course.stops]
    return sorted({*rests, *unpulled})


def disagreement_N(course: Course, signal: Signal, zero_N: float, u_N: float) -> float:
    """Size of the difference between a zero and the level of a stop at which nothing pulled; 0 where they agree."""
    found = 0.0
    top = float(np.percentile(np.abs(signal.force_N - zero_N), 95))
    for first, last in course.stops:
        part = signal.calm_N[first:last]
        level = float(np.median(part)) if part.size >= _FEWEST else math.nan
        if abs(level - zero_N) < _UNPULLED * top and abs(level - zero_N) > _CERTAIN * max(u_N, signal.noise_N):
            found = max(found, abs(level - zero_N))
    return found


def load_level(trace: Trace, choice: ZeroChoice, course: Course, window: Range) -> tuple[float, float]:
    """Mean normal load over a range of samples, its zero taken off, and its standard uncertainty; NaN without one."""
    load = trace.columns.get("normal_force_N")
    if load is None or window[1] - window[0] < _FEWEST:
        return math.nan, math.nan
    zero = chosen_zero(choice, trace.time_s, load, course, trace.file)
    part = load[window[0] : window[1]] - (zero.force_N if zero else 0.0)
    slow = wander(part, float(trace.time_s[window[1] - 1] - trace.time_s[window[0]]))
    return abs(float(part.mean())), math.hypot(slow.mean_u, zero.u_N if zero else 0.0)
