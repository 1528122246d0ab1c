"""Friction forces of a record of any shape: started from rest or in motion, with stops of the drive or none."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tribo.errors import Problem, TraceError
from tribo.records import STANDARD_GRAVITY, FloatArray, Oscillation, Phase, Pull, Restart, Test, Trace
from tribo.traces.course import Course, Range, course_of
from tribo.traces.noise import steady
from tribo.traces.oscillation import oscillation_of
from tribo.traces.pull import Asked, named_rule, pull_of
from tribo.traces.rules import Rule
from tribo.traces.segments import piece_of
from tribo.traces.signal import Signal, signal_of
from tribo.traces.sliding import settled, slides_on_closed_track
from tribo.traces.zero import Level, chosen_zero, disagreement_N, load_level

_LEFT_OUT = 0.1  # share at the start of a record that slides from its first sample, left out as not yet settled
_FEWEST = 20
_WITH_LOAD = 0.6  # correlation of force and load from which on the force follows the load
_SETTLED = 0.05  # share of its mean by which a force may change while it slides and still count as settled
_LEAD_IN = 0.75  # share of a stop after which the piece that holds its restart begins


@dataclass(frozen=True)
class Reading:
    """How a record is to be read: the rule, and the test it belongs to with its zero, speed and stiffness."""

    rule: Rule
    test: Test

    def asked(self, zero: Level | None) -> Asked:
        return Asked(self.rule, self.test.speed_m_s, (zero.force_N, zero.u_N) if zero else None)

    def drive(self, load_N: float) -> dict[str, float]:
        """k v in N/s and the free period of the slider on its spring in s; NaN where not known."""
        load = self.test.normal_load_N if math.isfinite(self.test.normal_load_N) else load_N
        mass, k, v = load / STANDARD_GRAVITY, self.test.stiffness_N_per_m or math.nan, self.test.speed_m_s or math.nan
        return {"drive_N_per_s": k * v, "free_period_s": 2.0 * math.pi * math.sqrt(mass / k) if k > 0 else math.nan}


def read_record(
    trace: Trace,
    *,
    rule: str = "seed",
    test: Test | None = None,
    parameters: Mapping[str, float] | None = None,
) -> Pull:
    """Friction forces of one record, whatever it begins and ends with.

    Its channels tell when the bodies touch, when the drive moves, stops and goes on (:mod:`tribo.traces.course`). A
    record that starts from rest gives a static peak and a sliding mean (:func:`read_pull`); one that slides from its
    first sample only the mean; each restart after a stop a static force of its own, with the time the drive stood
    still. The zero is the one ``test`` chooses, else the level before contact; a level read while sliding is never
    subtracted. Where two levels without load differ, the difference is part of every uncertainty.

    Raises
    ------
    TraceError
        The rule is unknown, the zero cannot be read as chosen, or the trace holds no friction force; all problems.
    """
    test = test or Test(trace.name, trace.file, "", math.nan, "")
    reading = Reading(named_rule(rule, parameters), test)
    try:
        signal = signal_of(trace)
        course = course_of(trace, signal)
        zero = chosen_zero(test.zero, signal.time_s, signal.force_N, course, trace.file)
        pull = _read(trace, signal, course, zero, reading)
        pull = _with_load(pull, trace, course, test)
        pull = _with_oscillation(pull, trace, signal, reading)
    except TraceError as fault:
        raise TraceError([p.at(file=trace.file or None, test_id=test.test_id) for p in fault.problems]) from None
    problems = tuple(p.at(file=trace.file or None, test_id=test.test_id) for p in pull.problems)
    flags = (*pull.flags, "impulsive") if signal.impulsive else pull.flags
    return replace(pull, test_id=test.test_id, problems=problems, flags=flags, phases=phases_of(pull, signal, course))


def _read(trace: Trace, signal: Signal, course: Course, zero: Level | None, reading: Reading) -> Pull:
    whole = (0, signal.time_s.size)
    pieces = course.pieces
    if course.slides_at_once and pieces[0][1] - pieces[0][0] >= min(_FEWEST, signal.time_s.size):
        first = _sliding_from(signal, pieces[0], zero, reading)
    elif course.slides_at_once or pieces[0] == whole or pieces[0][1] < _FEWEST:
        first = pull_of(signal, reading.asked(zero))
    else:
        start = 0 if zero is None else course.contact[0]
        first = pull_of(signal_of(piece_of(trace, start, pieces[0][1], trace.name)), reading.asked(zero))
    rule = zero.rule if zero else "none" if course.slides_at_once else "before contact"
    first = replace(first, zero_rule=rule)
    if zero and zero.drifts:
        first = replace(first, flags=(*first.flags, "zero_uncertain"))
    if course.stops:
        first = _with_restarts(first, trace, signal, course, reading)
    return first if zero and zero.rule != "before contact" else _with_doubt_of_zero(first, signal, course)


def _sliding_from(signal: Signal, span: Range, zero: Level | None, reading: Reading) -> Pull:
    """Sliding friction of a range that slides from its first sample; its static friction is NaN.

    Raises
    ------
    TraceError
        ``too_short``, ``sign_flipped``; ``stuck`` or ``saturated`` where the recorder failed.
    """
    first, last = span
    if signal.recorder_fault is not None:
        raise TraceError([signal.recorder_fault, *signal.problems])
    if last - first < _FEWEST:
        what = f"only {last - first} data points of sliding"
        raise TraceError(Problem("too_short", what, allowed=f"{_FEWEST} data points or more"))
    force = signal.force_N[first:last]
    start = first + max(settled(force), int(_LEFT_OUT * force.size))
    if reading.test.speed_m_s and slides_on_closed_track(reading.test.speed_m_s * signal.time_s, span):
        start = first + force.size // 2
    level = zero or Level(0.0, math.nan, "none")
    mean = steady(signal.time_s[start:last], signal.force_N[start:last])
    if mean.mean_N - level.force_N < 0:
        what = "the force acts against the pull direction; its sign may be reversed"
        raise TraceError(Problem("sign_flipped", what, column="force", found=f"{mean.mean_N - level.force_N:.6g} N"))
    known_u = level.u_N if math.isfinite(level.u_N) else 0.0
    flags = ("no_static",) if zero else ("no_static", "no_zero_phase")
    nan = math.nan
    return Pull(
        test_id="", rule=reading.rule.name, static_N=nan, static_u_N=nan, sliding_N=mean.mean_N - level.force_N,
        sliding_u_N=math.hypot(mean.u_N, known_u), zero_N=level.force_N, zero_u_N=level.u_N, onset_s=nan, peak_s=nan,
        window_s=(float(signal.time_s[start]), float(signal.time_s[last - 1])), noise_N=mean.noise_N,
        drift_N_per_s=mean.drift_N_per_s, flags=(*flags, "spike") if signal.problems else flags,
        problems=signal.problems,
    )  # fmt: skip


def _with_restarts(first: Pull, trace: Trace, signal: Signal, course: Course, reading: Reading) -> Pull:
    """A pull with the restarts of its record.

    Where its force has not settled before the first stop, the sliding mean is that of the steadiest slide.
    """
    zero = Level(first.zero_N, first.zero_u_N if math.isfinite(first.zero_u_N) else 0.0, first.zero_rule)
    found, slides = [], [first]
    ends = [b for _, b in course.pieces[1:]]
    for (stop, restart), end in zip(course.stops, ends, strict=True):
        begin = stop + int(_LEAD_IN * (restart - stop))
        try:
            pull = pull_of(signal_of(piece_of(trace, begin, end, trace.name)), reading.asked(zero))
        except TraceError:
            continue  # a last piece too short for a peak
        stop_s, hold_s = float(signal.time_s[stop]), float(signal.time_s[restart] - signal.time_s[stop])
        found.append(
            Restart(hold_s, stop_s, pull.peak_s, pull.static_N, pull.static_u_N, pull.sliding_N, pull.sliding_u_N)
        )
        slides.append(pull)
    best = first if _drift_share(first) < _SETTLED else min(slides, key=_unsteadiness)
    return replace(
        first, restarts=tuple(found), sliding_N=best.sliding_N, sliding_u_N=best.sliding_u_N, window_s=best.window_s,
        drift_N_per_s=best.drift_N_per_s, flags=tuple(dict.fromkeys((*first.flags, "restarts"))),
    )  # fmt: skip


def _drift_share(pull: Pull) -> float:
    """Change of the force over its sliding window as a share of its mean; infinite where there is none."""
    changed = abs(pull.drift_N_per_s) * (pull.window_s[1] - pull.window_s[0])
    return changed / abs(pull.sliding_N) if math.isfinite(changed) and pull.sliding_N else math.inf


def _unsteadiness(pull: Pull) -> float:
    """What the mean of a sliding window leaves open, its drift included; infinite where there is none."""
    drift = abs(pull.drift_N_per_s) * (pull.window_s[1] - pull.window_s[0]) / math.sqrt(12.0)
    return math.hypot(pull.sliding_u_N, drift) if math.isfinite(pull.sliding_u_N + drift) else math.inf


def _with_doubt_of_zero(pull: Pull, signal: Signal, course: Course) -> Pull:
    """A pull whose uncertainties hold the difference between its zero and a level at a stop at which nothing pulled."""
    u = pull.zero_u_N if math.isfinite(pull.zero_u_N) else 0.0
    away = disagreement_N(course, signal, pull.zero_N, u) / math.sqrt(3.0)
    if not away:
        return pull

    def wider(u_N: float) -> float:
        return math.hypot(u_N, away)

    restarts = tuple(
        replace(r, static_u_N=wider(r.static_u_N), sliding_u_N=wider(r.sliding_u_N)) for r in pull.restarts
    )
    return replace(
        pull, static_u_N=wider(pull.static_u_N), sliding_u_N=wider(pull.sliding_u_N), zero_u_N=wider(u),
        restarts=restarts, flags=(*pull.flags, "zero_uncertain"),
    )  # fmt: skip


def _with_load(pull: Pull, trace: Trace, course: Course, test: Test) -> Pull:
    window = np.searchsorted(trace.time_s, pull.window_s) if math.isfinite(pull.window_s[0]) else course.contact
    load, u = load_level(trace, test.load_zero, course, (int(window[0]), int(window[1])))
    return replace(pull, recorded_load_N=load, recorded_load_u_N=u)


def _with_oscillation(pull: Pull, trace: Trace, signal: Signal, reading: Reading) -> Pull:
    """A pull with the cycles of its sliding force, over the window its mean is taken from."""
    first, last = np.searchsorted(signal.time_s, pull.window_s) if math.isfinite(pull.window_s[0]) else (0, 0)
    if last - first < _FEWEST:
        return pull
    time, force = signal.time_s[first : last + 1], signal.force_N[first : last + 1] - pull.zero_N
    found: Oscillation = oscillation_of(time, force, **reading.drive(pull.recorded_load_N))
    load = trace.columns.get("normal_force_N")
    if load is not None and found.cycles and _follows(force, load[first : last + 1]):
        return replace(pull, oscillation=replace(found, regime="steady"), flags=(*pull.flags, "follows_load"))
    if math.isfinite(pull.static_N) or found.regime in ("steady", "irregular"):
        return replace(pull, oscillation=found)
    flags = (*pull.flags, "stick_slip") if found.regime == "stick-slip" else pull.flags
    return replace(
        pull, oscillation=found, stick_slip_amplitude_N=found.drop_N, stick_slip_period_s=found.period_s, flags=flags
    )


def _follows(force: FloatArray, load: FloatArray) -> bool:
    """Whether the force goes up and down with the recorded load, as on a disc that runs out of true."""
    if not np.isfinite(load).all() or np.ptp(load) == 0 or np.ptp(force) == 0:
        return False
    return abs(float(np.corrcoef(force, load)[0, 1])) > _WITH_LOAD


def phases_of(pull: Pull, signal: Signal, course: Course) -> tuple[Phase, ...]:
    """The phases of a record in their order: what was picked, in the terms of the report."""
    time, last = signal.time_s, signal.time_s.size - 1
    begin, end = float(time[course.contact[0]]), float(time[min(course.end, last)])
    stops = [(float(time[a]), float(time[b])) for a, b in course.stops]
    found = [Phase("approach", float(time[0]), begin)] if course.touches_later else []
    if course.touches_later:
        found.append(Phase("contact", begin, begin))
    until = stops[0][0] if stops else end
    if math.isfinite(pull.peak_s):
        found += [Phase("rest", begin, pull.onset_s)] if pull.onset_s > begin else []
        slides = [w for w in (pull.window_s[0],) if pull.peak_s < w < until]
        found += [Phase("rise", pull.onset_s, pull.peak_s), Phase("slip", pull.peak_s, slides[0] if slides else until)]
        begin = slides[0] if slides else until
    if begin < until:
        found.append(Phase(_sliding_name(pull), begin, until))
    found += _after_stops(stops, pull.restarts, end)
    if course.end <= last:
        rest = float(time[min(course.contact[1], last)])
        found += [Phase("rest", end, rest)] if rest > end else []
        found += [Phase("lift-off", rest, float(time[-1]))] if rest < time[-1] else []
    return tuple(found)


def _sliding_name(pull: Pull) -> str:
    regime = pull.oscillation.regime if pull.oscillation else "steady"
    return "steady sliding" if regime == "steady" else f"sliding ({regime})"


def _after_stops(stops: Sequence[tuple[float, float]], restarts: Sequence[Restart], end_s: float) -> list[Phase]:
    found = []
    peaks = {restart.stop_s: restart.peak_s for restart in restarts}
    nexts = [*(stop for stop, _ in stops[1:]), end_s][: len(stops)]
    for (stop, restart), until in zip(stops, nexts, strict=True):
        peak = peaks.get(stop, restart)
        found += [Phase("hold", stop, restart), Phase("reactivation", restart, peak), Phase("sliding", peak, until)]
    return found
