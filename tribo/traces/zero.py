"""The zero of the force and of the load of a record: stated by a user, the level before contact, or by its strokes."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tribo.errors import Problem, TraceError
from tribo.records import FloatArray, Trace
from tribo.traces.loading import Zero, first_rise, starting_level, zero_before
from tribo.traces.phases import Course, Range, course_of
from tribo.traces.signal import Signal, signal_of, steady, wander
from tribo.traces.sliding import transient_end
from tribo.zeroing import ZeroChoice

BEFORE_CONTACT = "before contact"
_FEWEST = 5
_CERTAIN = 5.0  # two levels agree where they differ by less than this many times their joint uncertainty
_UNLOADED = 0.05  # share of the largest load of an export below which a piece of it carries none
_UNPULLED = 0.3  # share of the largest force below which a force at a stop tells of the zero


def chosen_zero(choice: ZeroChoice, time_s: FloatArray, values: FloatArray, course: Course, file: str) -> Zero | None:
    """The zero of a channel (n,) by a choice; None where the choice leaves it to the force before the rise.

    At rest is the last range in which nothing pulls: rest of the drive, a part without contact, or a stop at which the
    force fell.

    Raises
    ------
    TraceError
        The record has no part in which the zero could be read as chosen.
    """
    if choice.kind == "none":
        return Zero(0.0, 0.0, "none")
    if choice.kind == "value":
        return Zero(choice.value_N, 0.0, str(choice))
    if choice.kind == "interval":
        first, last = np.searchsorted(time_s, choice.interval_s)
        span = f"{time_s[0]:.6g} to {time_s[-1]:.6g} s"
        return _level(time_s, values, (int(first), int(last)), str(choice), _none_there("interval", file, span))
    if choice.kind == "at rest":
        top = float(np.percentile(np.abs(values), 95))
        unpulled = [(a, b) for a, b in course.stops if float(np.median(np.abs(values[a:b]))) < _UNPULLED * top]
        ranges = sorted({*(r for r in course.rests if r not in course.stops), *unpulled})
        problem = _none_there("rest", file, '"before contact", "none", a number, or [from, to] in seconds')
        return _level(time_s, values, ranges[-1] if ranges else (0, 0), "at rest", problem)
    if course.begins_before_contact:
        problem = _none_there("part before contact", file)
        return _level(time_s, values, (0, course.contact[0]), BEFORE_CONTACT, problem)
    return None


def stated_zeros(table: Trace, force: ZeroChoice, load: ZeroChoice) -> tuple[Zero | None, Zero | None]:
    """The zeros of force and load that were stated for the pieces of a table, read on its clock; None where none was.

    Raises
    ------
    TraceError
        The table has no part in which a zero could be read as stated.
    """
    values = table.columns.get("normal_force_N")
    of_load = load.kind != "default" and values is not None
    if force.kind == "default" and not of_load:
        return None, None
    signal = signal_of(table)
    course = course_of(table, signal)
    load_zero = chosen_zero(load, table.time_s, values, course, table.file) if of_load and values is not None else None
    if force.kind == "default":
        return None, load_zero
    zero = chosen_zero(force, signal.time_s, signal.force_N, course, table.file)
    if zero is None:  # before contact, which no channel tells from the rest: before the first rise
        rise = first_rise(signal, starting_level(signal.smooth_N))
        zero = zero_before(signal, rise) if rise else Zero(0.0, 0.0, seen=False)
        if not zero.seen:
            raise TraceError(_none_there("part before contact", table.file))
        zero = Zero(zero.force_N, zero.u_N, BEFORE_CONTACT)
    return zero, load_zero


def zero_at_first(piece: Trace, contact: str) -> Zero | None:
    """The zero that a record begins with, at rest before the rise of its first piece; None where that slides."""
    try:
        course = course_of(piece, signal_of(piece), contact)
        if course.starts_sliding:
            return None
        return stated_zeros(piece, ZeroChoice("before contact"), ZeroChoice())[0]
    except TraceError:
        return None


def _none_there(what: str, file: str, allowed: str = "") -> Problem:
    said = f"the zero cannot be read: the record has no {what} of {_FEWEST} data points or more"
    return Problem("no_zero_there", said, file or None, column="zero", allowed=allowed or None)


def _level(time_s: FloatArray, values: FloatArray, span: Range, rule: str, problem: Problem) -> Zero:
    """Mean over the settled part of a range; what it drifts there is in the uncertainty."""
    first, last = span
    if last - first < _FEWEST:
        raise TraceError(problem)
    if rule == "at rest":
        first += transient_end(values[first:last])
    part = values[first:last]
    mean_u, _, noise = wander(part, float(time_s[last - 1] - time_s[first]))
    edges = max(part.size // 5, 1)
    drift = abs(float(np.median(part[-edges:]) - np.median(part[:edges])))
    u = max(mean_u, noise / math.sqrt(part.size)) if part.size > 2 else 0.0
    drifts = drift > _CERTAIN * max(u, 1e-300)
    return Zero(float(part.mean()), math.hypot(u, drift / math.sqrt(12.0) if drifts else 0.0), rule, drifts)


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


def load_level(trace: Trace, zero: Zero | None, window: Range) -> tuple[float, float]:
    """Mean normal load over a range of samples, its zero taken off, and its standard uncertainty; NaN without one."""
    load = trace.columns.get("normal_force_N")
    if load is None or window[1] - window[0] < _FEWEST:
        return math.nan, math.nan
    part = load[window[0] : window[1]] - (zero.force_N if zero else 0.0)
    mean_u, _, _ = wander(part, float(trace.time_s[window[1] - 1] - trace.time_s[window[0]]))
    return abs(float(part.mean())), math.hypot(mean_u, zero.u_N if zero else 0.0)


def load_of(trace: Trace) -> tuple[float, float]:
    """Mean normal load of a piece (N, taken as positive) and its standard uncertainty; NaN where none was recorded."""
    load = trace.columns.get("normal_force_N")
    if load is None:
        return math.nan, math.nan
    mean_N, u_N, _, _ = steady(trace.time_s, np.abs(load) if float(np.median(load)) > 0 else -load)
    return mean_N, u_N


def carry_load(pieces: Sequence[Trace]) -> list[bool]:
    """Which pieces of an export carry a load for half of their time; all of them where none was recorded."""
    loads = np.nan_to_num(np.abs([load_of(piece)[0] for piece in pieces]))
    recorded = [piece.columns.get("normal_force_N") for piece in pieces]
    if all(load is not None and np.isfinite(load).all() for load in recorded):
        usual = np.array([float(np.median(load)) for load in recorded if load is not None])
        side = np.sign(usual[np.argmax(np.abs(usual))])  # a load cell may show less than nothing before contact
        loads = np.minimum(loads, side * usual)
    return [bool(load >= _UNLOADED * loads.max()) for load in loads]
