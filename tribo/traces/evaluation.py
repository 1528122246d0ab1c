"""From a trace to a pull: static and sliding friction by a named rule, with within-trace uncertainties.

Friction forces of a record of any shape: started from rest or in motion, with stops of the drive or none.

All pulls of a record that contains several: reciprocating strokes, steps of load or speed.

Tests whose forces were evaluated elsewhere: they have no trace, and their forces are taken as they stand.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tribo.errors import Problem, TraceError
from tribo.records import STANDARD_GRAVITY, FloatArray, Oscillation, Phase, Pull, Restart, Test, Trace
from tribo.traces.loading import climb_of, starting_level
from tribo.traces.oscillation import oscillation_of
from tribo.traces.peak import Apex, find_apex, near
from tribo.traces.phases import Course, Range, Strokes, course_of, orient_strokes, piece_of, split_pulls
from tribo.traces.rules import RULES, Rule
from tribo.traces.signal import Signal, line, median_of_three, signal_of, steady, unreadable
from tribo.traces.sliding import (
    Motion,
    Sliding,
    in_motion,
    settled,
    slides_on_closed_track,
    sliding_over,
    window_between,
)
from tribo.traces.static_readings import StaticReadings, static_readings, within_samples
from tribo.traces.zero import Level, chosen_zero, disagreement_N, load_level
from tribo.user_text import did_you_mean

_GAP = 3.0


def read_pull(
    trace: Trace,
    *,
    rule: str = "seed",
    test: Test | None = None,
    parameters: Mapping[str, float] | None = None,
    zero: tuple[float, float] | None = None,
    peak_s: float | None = None,
    window_s: tuple[float, float] | None = None,
) -> Pull:
    """Determine static and sliding friction from one trace.

    ``rule`` names an entry of ``RULES``; ``parameters`` replace its own (``length_m``, ``skip_m``,
    ``share``, ``start_s``). ``test`` gives the pull its id and, where the trace has no displacement, its speed.
    ``zero`` is the zero of the force with its standard uncertainty (N) where it is known otherwise than from the
    force before contact, such as from the asymmetry of strokes. ``peak_s`` and ``window_s``, on the clock of the
    trace, are a static peak and a sliding window chosen by hand: the peak is then searched for within two data points
    of ``peak_s``, and the flags state what was chosen by hand.

    The standard uncertainties include the scatter of the signal (with its correlation), that of the zero, and the drift
    of the signal since the zero was measured, estimated from the drift while sliding. That of the static peak also
    includes the difference between a sharp peak and a rounded one that the data do not exclude.

    Raises
    ------
    TraceError
        The rule is unknown, or the trace holds no readable pull; every problem found is listed.
    """
    asked = Asked(named_rule(rule, parameters), test.speed_m_s if test else None, zero, peak_s, window_s)
    test_id, file = (test.test_id if test else None), trace.file or None
    try:
        pull = pull_of(signal_of(trace), asked)
    except TraceError as fault:
        raise TraceError([p.at(file=file, test_id=test_id) for p in fault.problems]) from None
    return replace(
        pull,
        test_id=test_id or trace.name,
        problems=tuple(p.at(file=file, test_id=test_id) for p in pull.problems),
    )


@dataclass(frozen=True)
class Asked:
    """How a pull is to be read: its rule, its speed, and what is known otherwise or was chosen by hand."""

    rule: Rule
    speed_m_s: float | None = None
    zero: tuple[float, float] | None = None
    peak_s: float | None = None
    window_s: tuple[float, float] | None = None


def pull_of(signal: Signal, asked: Asked) -> Pull:
    """The pull of a signal, without a name (see :func:`read_pull`)."""
    rule, peak_s, window_s = asked.rule, asked.peak_s, asked.window_s
    climb = climb_of(signal, asked.zero)
    climb = climb if peak_s is None else near(climb, peak_s)
    apex = find_apex(climb)
    motion = in_motion(climb, apex, asked.speed_m_s)
    if peak_s is None:
        motion = replace(motion, apex=within_samples(motion, apex))
    static = within_samples(motion, rule.static(motion, rule.parameters)) if peak_s is None else apex
    window = rule.sliding(motion, rule.parameters) if window_s is None else window_between(motion, *window_s)
    sliding = sliding_over(motion, window)
    readings = StaticReadings(static.force_N, math.nan, math.nan) if peak_s else static_readings(motion, climb.end)
    pull = _reduce(motion, static, sliding, rule, readings)
    by_hand = {"peak_by_hand": peak_s is not None, "window_by_hand": window_s is not None}
    flags = (*pull.flags, *(flag for flag, raised in by_hand.items() if raised))
    return replace(pull, problems=motion.problems, flags=flags)


def named_rule(name: str, parameters: Mapping[str, float] | None) -> Rule:
    if name not in RULES:
        hint = "; ".join(filter(None, (", ".join(RULES), did_you_mean(name, RULES))))
        raise TraceError(Problem("unknown_rule", "unknown rule", found=name, allowed=hint))
    rule = RULES[name]
    if not parameters:
        return rule
    if unknown := sorted(set(parameters) - set(rule.parameters)):
        allowed = ", ".join(rule.parameters) or "none"
        raise TraceError(Problem("unknown_parameter", f"not in rule {name}", found=", ".join(unknown), allowed=allowed))
    return replace(rule, parameters={**rule.parameters, **parameters})


def _reduce(motion: Motion, static: Apex, sliding: Sliding, rule: Rule, readings: StaticReadings) -> Pull:
    """The numbers of a pull; every uncertainty holds what a slow wander may have done since the zero was seen."""
    zero, mean, window_s = motion.zero, sliding.mean, sliding.window_s
    static_wander = zero.wander_rate * max(static.time_s - zero.time_s, 0.0)
    open_N = readings.open_N(static)
    since_zero_s = window_s[0] - zero.time_s + (window_s[1] - window_s[0]) / 3.0
    return Pull(
        test_id="",
        rule=rule.name,
        static_N=static.force_N,
        static_u_N=math.sqrt(static.u_N**2 + static.shape_u_N**2 + zero.u_N**2 + static_wander + open_N**2),
        sliding_N=mean.mean_N,
        sliding_u_N=math.sqrt(mean.u_N**2 + zero.u_N**2 + sliding.wander_rate * max(since_zero_s, 0.0)),
        zero_N=zero.force_N,
        zero_u_N=zero.u_N,
        onset_s=motion.onset_s,
        peak_s=static.time_s,
        window_s=window_s,
        rise_N_per_s=motion.rise.rate,
        rise_stiffness_N_per_m=_rise_stiffness(motion),
        stick_slip_amplitude_N=sliding.swing_N,
        stick_slip_period_s=sliding.period_s,
        noise_N=mean.noise_N if sliding.enough else motion.noise_N,
        drift_N_per_s=mean.drift_N_per_s,
        flags=(*_flags(motion, static, sliding, rule), *(("peak_ambiguous",) if open_N else ())),
        first_maximum_N=readings.first_N,
        highest_N=readings.highest_N,
        first_drop_N=readings.drop_N,
    )


def _rise_stiffness(motion: Motion) -> float:
    """Slope of force against travel over the loading line (N/m); NaN where no travel is known."""
    if motion.travel_m is None:
        return math.nan
    rising = slice(motion.rise.first, motion.rise.last + 1)
    slope = line(motion.time_s[rising], motion.travel_m[rising])[0]
    return motion.rise.rate / slope if slope > 0 else math.nan


def _gap_at(motion: Motion, time_s: float) -> bool:
    """Whether the samples on either side of a time lie further apart than ``_GAP`` mean steps of the record."""
    time = motion.time_s
    after = min(max(int(np.searchsorted(time, time_s)), 1), time.size - 1)
    return float(time[after] - time[after - 1]) > _GAP * float(time[-1] - time[0]) / (time.size - 1)


def _flags(motion: Motion, static: Apex, sliding: Sliding, rule: Rule) -> tuple[str, ...]:
    enough, mean, travel = sliding.enough, sliding.mean, motion.travel_m
    start, end = sliding.window
    asked = rule.parameters.get("length_m", 0.0)
    raised = {
        "no_zero_phase": not motion.zero.seen,
        "spike": bool(motion.problems),
        "gap_at_peak": _gap_at(motion, static.time_s),
        "rounded_peak": static.shape == "rounded",
        "peak_between_samples": static.shape == "highest sample",
        "no_drop": enough and static.force_N - mean.mean_N < 3.0 * math.hypot(static.u_N, mean.u_N),
        "no_sliding": not enough,
        "window_short": enough and travel is not None and bool(travel[end - 1] - travel[start] < 0.9 * asked),
        "stick_slip": not math.isnan(sliding.period_s),
    }
    return tuple(name for name, is_raised in raised.items() if is_raised)


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

    Its channels tell when the bodies touch, when the drive moves, stops and goes on (:mod:`tribo.traces.phases`). A
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


_NO_PEAK = {"stopped_before_peak", "sign_flipped", "spike"}
_CLIMB_OVER_SWING = 5.0


def read_pulls(
    traces: Trace | Sequence[Trace],
    *,
    rule: str = "middle_share",
    test: Test | None = None,
    parameters: Mapping[str, float] | None = None,
) -> tuple[Pull, ...]:
    """Read every pull of one record, or of several blocks of one (each split by :func:`split_pulls`).

    Strokes in both directions share a zero, determined from their asymmetry. A piece that slides from its first sample,
    after a step of load or speed, has no static peak: its ``static_N`` is NaN and it is flagged ``no_static``.
    ``test_id`` of a pull is the name of its piece. With :func:`load_of` the pieces give friction against load.

    Raises
    ------
    TraceError
        A piece cannot be read; every problem of every piece is listed.
    """
    pulls: list[Pull] = []
    problems: list[Problem] = []
    for pull in read_pieces(pieces_of(traces), rule=rule, test=test, parameters=parameters):
        if isinstance(pull, TraceError):
            problems += pull.problems
        else:
            pulls.append(pull)
    if problems:
        raise TraceError(problems)
    return tuple(pulls)


def read_pieces(
    strokes: Strokes,
    *,
    rule: str = "middle_share",
    test: Test | None = None,
    parameters: Mapping[str, float] | None = None,
) -> Iterator[Pull | TraceError]:
    """What each piece gives, in order: its pull (see :func:`read_pulls`), or why it cannot be read."""
    zero = None if math.isnan(strokes.zero_N) else (0.0, strokes.zero_u_N)
    for piece, direction in zip(strokes.traces, strokes.directions, strict=True):
        try:
            pull = _read_piece(piece, rule, test, parameters, zero)
        except TraceError as fault:
            yield fault
            continue
        offset = pull.zero_N if zero is None else strokes.zero_N
        flags = (*pull.flags, "forward" if direction > 0 else "backward") if zero or direction < 0 else pull.flags
        yield replace(pull, test_id=piece.name, zero_N=offset, flags=flags)


def pieces_of(traces: Trace | Sequence[Trace]) -> Strokes:
    """The pieces of a record in order, turned to one sign, with the zero that strokes of both directions share."""
    blocks = [traces] if isinstance(traces, Trace) else list(traces)
    return orient_strokes([piece for block in blocks for piece in split_pulls(block)])


def _read_piece(
    piece: Trace, rule: str, test: Test | None, parameters: Mapping[str, float] | None, zero: tuple[float, float] | None
) -> Pull:
    if zero is None and not unreadable(piece) and _slides_at_once(piece):
        return read_sliding(piece, zero=zero, rule=rule)
    try:
        return read_pull(piece, rule=rule, test=test, parameters=parameters, zero=zero)
    except TraceError as fault:
        if not {p.kind for p in fault.problems} <= _NO_PEAK:
            raise
    return read_sliding(piece, zero=zero, rule=rule)


def _slides_at_once(piece: Trace) -> bool:
    """Whether a piece begins near the force it keeps: above half its maximum, and climbing little for its swing."""
    force = median_of_three(piece.force_N)
    start, top = starting_level(force), float(force.max())
    return start > 0.5 * top and top - start < _CLIMB_OVER_SWING * float(force[force.size // 2 :].std())


def read_sliding(trace: Trace, *, zero: tuple[float, float] | None = None, rule: str = "seed") -> Pull:
    """Sliding friction of a trace that slides from its first sample: the mean once the force has stabilised.

    Static friction, onset and peak are NaN, flagged ``no_static``; without a ``zero`` (force, standard uncertainty)
    none is taken out, flagged ``no_zero_phase``.

    Raises
    ------
    TraceError
        ``too_short``, ``nan_gap``, ``time_goes_back``, ``time_stands_still``.
    """
    signal = signal_of(trace)
    start = settled(signal.force_N)
    window = steady(trace.time_s[start:], signal.force_N[start:])
    offset, offset_u = zero or (0.0, 0.0)
    flags = ("no_static",) if zero else ("no_static", "no_zero_phase")
    nan = math.nan
    return Pull(
        test_id=trace.name, rule=rule, static_N=nan, static_u_N=nan, sliding_N=window.mean_N - offset,
        sliding_u_N=math.hypot(window.u_N, offset_u), zero_N=offset, zero_u_N=offset_u if zero else nan, onset_s=nan,
        peak_s=nan, window_s=(float(trace.time_s[start]), float(trace.time_s[-1])), noise_N=window.noise_N,
        drift_N_per_s=window.drift_N_per_s, flags=(*flags, "spike") if signal.problems else flags,
        problems=signal.problems,
    )  # fmt: skip


def load_of(trace: Trace) -> tuple[float, float]:
    """Mean normal load of a piece (N, taken as positive) and its standard uncertainty; NaN where none was recorded."""
    load = trace.columns.get("normal_force_N")
    if load is None:
        return math.nan, math.nan
    level = steady(trace.time_s, np.abs(load) if float(np.median(load)) > 0 else -load)
    return level.mean_N, level.u_N


def sampling_clip_N(rise_N_per_s: float, rate_Hz: float) -> float:
    """Limit (GUM type B) of how far the largest data point lies below a sharp peak on average: k v / (2 f_s).

    ``rise_N_per_s`` is k v, the slope of the loading line, ``rate_Hz`` the sampling rate f_s. The apex fitted by
    :func:`read_pull` lies between the data points; this limit applies if the fit fails.
    """
    return rise_N_per_s / (2.0 * rate_Hz)


def sampling_rate_Hz(trace: Trace) -> float:
    """Median number of samples per second; NaN with fewer than two."""
    if trace.time_s.size < 2:
        return math.nan
    return float(1.0 / np.median(np.diff(trace.time_s)))


RULE = "given"
FLAG = "evaluated_elsewhere"


def evaluated_pull(test: Test) -> Pull | None:
    """The forces of a row of tests.csv without an export as a pull; None for a test with an export."""
    forces = test.evaluated
    if forces is None:
        return None
    nothing = math.nan
    return Pull(
        test_id=test.test_id,
        rule=RULE,
        static_N=forces.static_N,
        static_u_N=forces.static_u_N,
        sliding_N=forces.sliding_N,
        sliding_u_N=forces.sliding_u_N,
        zero_N=0.0,
        zero_u_N=0.0,
        onset_s=nothing,
        peak_s=nothing,
        window_s=(nothing, nothing),
        flags=(FLAG, "no_static") if math.isnan(forces.static_N) else (FLAG,),
    )
