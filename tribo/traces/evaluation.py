"""From a trace to a pull: the one road by which a measurement becomes static and sliding friction.

:func:`evaluate` cuts a record into its phases first, by its channels and its force, and then reads every stretch of
motion: the first one for the forces of the pull, each one after a stop of the drive for a static force of its own. A
whole record, a stroke or another piece cut from a record (:func:`pieces_of`), a window moved by hand and forces that
were evaluated elsewhere are inputs to it. Nothing else makes a :class:`~tribo.records.Pull`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import compress
from typing import Any, Literal

import numpy as np

from tribo.display import displayed
from tribo.errors import Problem, TraceError
from tribo.records import STANDARD_GRAVITY, FloatArray, Phase, Pull, Restart, Slip, SlipChange, Test, Trace
from tribo.traces.cuts import directions_of, piece_of, reversals, split_pulls
from tribo.traces.drive import FEWEST_AT_REST, drive_of, speed_level_m_s
from tribo.traces.events import changed_by_hand, slips_of
from tribo.traces.loading import Zero, loading_of, starting_level
from tribo.traces.peak import (
    Apex,
    Motion,
    find_apex,
    in_motion,
    left_open_N,
    static_readings,
    with_peak_near,
    within_samples,
)
from tribo.traces.phases import Course, as_stated, course_of, course_of_piece, phases_of
from tribo.traces.rules import DEFAULT_RULE, Rule, named_rule
from tribo.traces.signal import Signal, line, median_of_three, odd_signal, signal_of, steady
from tribo.traces.sliding import (
    Sliding,
    oscillation_of,
    slides_on_closed_track,
    sliding_over,
    transient_end,
    window_between,
)
from tribo.traces.zero import (
    BEFORE_CONTACT,
    carry_load,
    chosen_zero,
    disagreement_N,
    load_level,
    stated_zeros,
    zero_at_first,
)
from tribo.zeroing import ZeroChoice

GIVEN = "given"  # the rule of forces that were evaluated elsewhere
_LEFT_OUT = 0.1  # share at the start of a record that slides from its first sample, left out as not yet settled
_FEWEST = 20
_FEWEST_BY_HAND = 10
_WITH_LOAD = 0.6  # correlation of force and load from which on the force follows the load
_AS_LOAD = 0.25  # share of the relative change of the force that the load changes by at the least, if that follows it
_SETTLED = 0.05  # share of its mean by which a force may change while it slides and still count as settled
_LEAD_IN = 0.75  # share of a stop after which the piece that holds its restart begins
_GAP = 3.0
_LONGEST_STRETCH_M = 0.5  # the softest springs of sleds stretch by a tenth of a metre before the peak
_STRETCH_M = 5e-3  # a sled, a pin or its spring gives way by less before it slides; a disc goes further in a second
_NO_PEAK = {"stopped_before_peak", "sign_flipped", "spike"}  # problems of a piece that only slides
_UNPULLED = 0.3  # share of its later force below which a piece begins with nothing pulled
_OF_STATIC = (
    "static_N", "static_u_N", "onset_s", "peak_s", "rise_N_per_s", "rise_stiffness_N_per_m", "first_maximum_N",
    "highest_N", "first_drop_N",
)  # what a pull without a static force does not have  # fmt: skip
_MOTION = {"rise", "slip", "running-in", "steady sliding", "stroke"}  # phases in which the force may slip
_OFF_LOAD = 0.02  # share by which the recorded load may differ from that of the test
_GONE = 0.05  # share of the static peak below which no sliding force is left
_OFF_SPEED = 0.2  # share by which the travel while sliding may differ from the speed of the test times the time


@displayed()
@dataclass(frozen=True)
class PullOptions:
    """How a trace is read.

    Parameters
    ----------
    rule : str
        An entry of ``RULES``.
    parameters : Mapping[str, float], optional
        Replace those of the rule: ``length_m``, ``skip_m``, ``share``, ``start_s``.
    test : Test, optional
        The test that the trace belongs to: its id, speed, load and stiffness, and the zeros stated for it.
    zero, load_zero : Zero, optional
        Zero of the force and of the load where they are known otherwise than from this trace, such as from the strokes
        beside it. They stand before those of ``test``.
    begins : {"", "step", "reversal"}
        How a piece begins that was cut from a record: at a step of load or speed, or where the pull changes direction.
        Empty for a whole record, whose channels and force tell.
    contact : str
        The contact that campaign.toml states.
    turned : bool
        Whether the sign of the force was changed, so that friction is positive.
    peak_s, window_s : float and (float, float), optional
        A static peak and a sliding window chosen by hand, on the clock of the trace.
    phases : tuple of Phase
        Phases stated by hand: the end of a rise is a static peak, steady sliding the window of the sliding force, a
        rest the zero. A record for which sliding from its beginning is stated, and no rise, has no static force.
    slips : tuple of SlipChange
        Slips removed, added or moved by hand.
    """

    rule: str = DEFAULT_RULE
    parameters: Mapping[str, float] | None = None
    test: Test | None = None
    zero: Zero | None = None
    load_zero: Zero | None = None
    begins: Literal["", "step", "reversal"] = ""
    contact: str = ""
    turned: bool = False
    peak_s: float | None = None
    window_s: tuple[float, float] | None = None
    phases: tuple[Phase, ...] = ()
    slips: tuple[SlipChange, ...] = ()


WHOLE = PullOptions()


def evaluate(trace: Trace | None, options: PullOptions = WHOLE) -> Pull:
    """Static and sliding friction of one trace, whatever it begins and ends with.

    The channels of a record tell when the bodies touch, when the drive moves, stops and goes on
    (:mod:`tribo.traces.phases`). A record that starts from rest gives a static peak and a sliding mean; one that slides
    from its first sample only the mean; each restart after a stop a static force of its own, with the time the drive
    stood still. The zero is the one that is known or stated, else the level before contact; a level read while sliding
    is never subtracted. Where two levels without load differ, the difference is part of every uncertainty.

    Parameters
    ----------
    trace : Trace, optional
        Force (n,) against time (n,) with n >= 20. None for a test whose forces were evaluated elsewhere.
    options : PullOptions
        Rule, test, zeros, and what was chosen by hand.

    Returns
    -------
    Pull
        Forces in N above the zero with standard uncertainties (k = 1); NaN where the trace does not determine one.

    Raises
    ------
    TraceError
        The rule is unknown, a zero cannot be read as stated, or the trace holds no friction force; all problems.
    """
    rule = named_rule(options.rule, options.parameters)
    if trace is None:
        assert options.test is not None
        assert options.test.evaluated is not None
        forces: Mapping[str, Any] = options.test.evaluated
        without = () if "static_N" in forces else ("no_static",)
        return Pull(options.test.test_id, GIVEN, flags=("evaluated_elsewhere", *without), **forces)
    test = options.test or Test(trace.name, trace.file, "", math.nan, "")
    if test.speed_m_s is None and "speed_m_s" in trace.columns:
        speed = speed_level_m_s(trace)
        test = replace(test, speed_m_s=speed if speed > 0 else None)
    options = _with_phases(replace(options, rule=rule.name, test=test))
    test = options.test or test
    zero, load_zero, load = options.zero, options.load_zero, trace.columns.get("normal_force_N")
    try:
        signal = signal_of(trace)
        if options.begins:
            course = course_of_piece(trace, signal, starts_sliding=options.begins == "step" and _slides_on(trace))
        else:
            course = course_of(trace, signal, options.contact)
            zero = zero or chosen_zero(test.zero, signal.time_s, signal.force_N, course, trace.file)
            if zero is None and test.zero.kind == "before contact":  # as stated, whatever the force looks like
                course = replace(course, starts_sliding=False)
        course = as_stated(course, signal, options.phases)
        pull = _first_motion(trace, signal, course, zero, options, rule)
        if zero and zero.drifts:
            pull = replace(pull, flags=(*pull.flags, "zero_uncertain"))
        if course.stops:
            pull = _with_restarts(pull, trace, signal, course, rule, options)
        if options.window_s is not None and "window_by_hand" not in pull.flags:
            pull = _over(pull, signal, *options.window_s)
        if zero is None or zero.rule == BEFORE_CONTACT:
            pull = _with_doubt_of_zero(pull, signal, course)
        window = course.contact[0], min(course.contact[1], max(course.end, course.contact[0] + 1))
        if not options.begins and math.isfinite(pull.window_s[0]):
            first, last = np.searchsorted(trace.time_s, pull.window_s)
            window = int(first), int(last)
        if load is not None and not options.begins:
            load_zero = load_zero or chosen_zero(test.load_zero, trace.time_s, load, course, trace.file)
        load_N, load_u_N = load_level(trace, load_zero, window)
        pull = _with_oscillation(replace(pull, recorded_load_N=load_N, recorded_load_u_N=load_u_N), trace, signal, test)
    except TraceError as fault:
        raise TraceError([p.at(file=trace.file or None, test_id=test.test_id) for p in fault.problems]) from None
    doubts = _doubts(trace, pull, test, one_speed=options.begins != "reversal")
    flags = [*trace.flags, *(doubt.kind for doubt in doubts), *pull.flags]
    flags += ["impulsive"] if signal.impulsive else []
    flags += ["phases_by_hand"] if options.phases else []
    if options.turned or options.begins == "reversal":
        flags.append("backward" if options.turned else "forward")
    pull = replace(
        pull, test_id=test.test_id, flags=tuple(dict.fromkeys(flags)),
        phases=_phases(trace, pull, signal, course, options),
        problems=tuple(p.at(file=trace.file or None, test_id=test.test_id) for p in (*doubts, *pull.problems)),
    )  # fmt: skip
    pull = replace(pull, slips=_slips(pull, signal, test, options.slips))
    if "no_time" in trace.flags:  # path stands for time, so nothing can be counted per second
        pull = replace(pull, rise_N_per_s=math.nan, stick_slip_period_s=math.nan, drift_N_per_s=math.nan, slips=())
    return pull


def unread(test_id: str) -> Pull:
    """The pull of a test from which no force could be read."""
    return Pull(test_id, "")


def _with_phases(options: PullOptions) -> PullOptions:
    """Options whose peak, window and zero are those of the phases stated by hand, unless they are given otherwise."""
    for phase in options.phases:
        if phase.name == "rise" and options.peak_s is None:
            options = replace(options, peak_s=phase.end_s)
        elif phase.name == "steady sliding" and options.window_s is None:
            options = replace(options, window_s=(phase.start_s, phase.end_s))
        elif phase.name == "rest" and options.test is not None and options.zero is None:
            rest = ZeroChoice("interval", interval_s=(phase.start_s, phase.end_s))
            options = replace(options, test=replace(options.test, zero=rest))
    return options


def pieces_of(tables: Trace | Sequence[Trace], options: PullOptions = WHOLE) -> dict[str, tuple[Trace, PullOptions]]:
    """The pulls of a record, or of several tables of one, by address: "2/3" is the third pull of the second table.

    Each is turned so that friction is positive, and comes with the options for :func:`evaluate`. Strokes in both
    directions share a zero, determined from their asymmetry where ``options.test`` states none. A piece that slides on
    after a step of load or speed counts from the zero that its record begins with. A zero that is stated is read on the
    clock of the table. A record of one pull is read as a whole.

    Parameters
    ----------
    tables : Trace or sequence of Trace
        A record, or the tables of an export.
    options : PullOptions
        Rule and test of all pulls.

    Raises
    ------
    TraceError
        A zero cannot be read as stated.
    """
    tables = [tables] if isinstance(tables, Trace) else list(tables)
    test = options.test or Test("", "", "", math.nan, "")
    cut: dict[str, tuple[Trace, Zero | None, Zero | None]] = {}
    before: dict[str, Zero | None] = {}  # the zero that a record begins with, for what slides on later
    for t, table in enumerate(tables, 1):
        zero, load_zero = stated_zeros(table, test.zero, test.load_zero)
        zero, load_zero = options.zero or zero, options.load_zero or load_zero
        pieces = {f"{t}/{k}": piece for k, piece in enumerate(split_pulls(table), 1)}
        cut |= {address: (piece, zero, load_zero) for address, piece in pieces.items()}
        if zero is None and len(pieces) > 1:
            before |= dict.fromkeys(list(pieces)[1:], zero_at_first(pieces[f"{t}/1"], options.contact))
    if not cut:
        raise TraceError(Problem("no_strokes", "no strokes are given"))
    offsets = [zero.force_N if zero else 0.0 for _, zero, _ in cut.values()]
    signs, shared = directions_of([piece for piece, _, _ in cut.values()], offsets)
    whole = len(cut) == 1 and next(iter(cut.values()))[0] is tables[0]  # nothing was cut off
    found = {}
    for sign, (address, (piece, zero, load_zero)) in zip(signs, cut.items(), strict=True):
        if whole and test.zero.kind != "value" and options.zero is None:
            zero = None  # it is read from the whole record as from any other
        elif zero is None and shared is not None:
            zero = Zero(*shared, "strokes in both directions")
        elif zero is None and shared is None and address in before and _slides_on(piece):
            zero = before[address]
        found[address] = (
            piece if sign > 0 else replace(piece, force_N=-piece.force_N),
            replace(
                options, zero=zero and replace(zero, force_N=sign * zero.force_N),
                load_zero=options.load_zero if whole else load_zero, turned=sign < 0,
                begins="reversal" if shared else "" if whole or address.endswith("/1") else "step",
            ),
        )  # fmt: skip
    return found


def read_pulls(
    tables: Trace | Sequence[Trace],
    *,
    rule: str = "middle_share",
    test: Test | None = None,
    parameters: Mapping[str, float] | None = None,
) -> tuple[Pull, ...]:
    """Read every pull of one record, or of several tables of one (see :func:`pieces_of`).

    A piece without load is no pull. One that slides from its first sample, after a step of load or speed, has no static
    peak: its ``static_N`` is NaN and it is flagged ``no_static``. ``test_id`` of a pull is the name of its piece,
    ``recorded_load_N`` its load.

    Parameters
    ----------
    tables : Trace or sequence of Trace
        A record, or the tables of an export.
    rule, parameters
        As in :class:`PullOptions`.
    test : Test, optional
        States speed, stiffness and zeros of all pulls.

    Returns
    -------
    tuple of Pull

    Raises
    ------
    TraceError
        A piece cannot be read; every problem of every piece is listed.
    """
    pulls: list[Pull] = []
    problems: list[Problem] = []
    pieces = list(pieces_of(tables, PullOptions(rule, parameters, test)).values())
    loaded = carry_load([piece for piece, _ in pieces])
    for piece, options in compress(pieces, loaded):
        own = replace(options, test=replace(test, test_id=piece.name) if test else None)
        try:
            pulls.append(evaluate(piece, own))
        except TraceError as fault:
            problems += fault.problems
    if problems:
        raise TraceError(problems)
    return tuple(pulls)


def _slides_on(piece: Trace) -> bool:
    """Whether a piece that begins at a step goes on sliding: its drive moves and its force has not fallen."""
    drive = drive_of(piece)
    if drive is not None and not drive.turns and not drive.moving[: 2 * FEWEST_AT_REST].any():
        return False
    force = median_of_three(piece.force_N)
    return starting_level(force) > _UNPULLED * float(np.median(force[force.size // 4 :]))


def _first_motion(
    trace: Trace, signal: Signal, course: Course, zero: Zero | None, options: PullOptions, rule: Rule
) -> Pull:
    """The first stretch of motion of a record: from rest to its peak and sliding, or sliding from its first sample."""
    samples = signal.time_s.size
    start, end = course.pieces[0]
    sliding = course.starts_sliding and options.peak_s is None
    if sliding and end - start >= min(_FEWEST, samples):
        return _sliding(signal, (start, end), zero, options)
    piece = signal
    beyond = options.peak_s is not None and not signal.time_s[start] <= options.peak_s <= signal.time_s[end - 1]
    if not sliding and not beyond and (start, end) != (0, samples) and end >= _FEWEST:
        piece = signal_of(piece_of(trace, 0 if zero is None else start, end, trace.name))
    window_s = options.window_s
    if window_s is not None and not piece.time_s[0] <= window_s[0] < window_s[1] <= piece.time_s[-1]:
        window_s = None
    try:
        pull = _from_rest(piece, zero, rule, options.test, options.peak_s, window_s)
        if not options.begins and options.peak_s is None:
            pull = _with_first_static(pull, trace, options)
        return _without_static(pull) if _slid_unseen(trace, pull, options.test) else pull
    except TraceError as fault:
        kinds = {p.kind for p in fault.problems}
        if not (options.begins or (options.window_s and options.peak_s is None)) or not kinds <= _NO_PEAK:
            raise
    return _sliding(signal, (start, end), zero, options)


def _with_first_static(pull: Pull, trace: Trace, options: PullOptions) -> Pull:
    """A pull whose static force is read before the first step of load or speed, where its record has several levels."""
    first = trace if reversals(trace.force_N) else split_pulls(trace)[0]
    if not pull.peak_s > first.time_s[-1]:
        return pull
    try:
        start = evaluate(first, replace(options, begins="", window_s=None, phases=()))
    except TraceError:
        return _without_static(pull)
    return replace(pull, **{name: getattr(start, name) for name in _OF_STATIC})


def _slid_unseen(trace: Trace, pull: Pull, test: Test | None) -> bool:
    """Whether the bodies slid before the first maximum: no rig and no spring gives way by as much as the drive went.

    Where fewer than four samples resolve the rise, the way from one of them to the next counts.
    """
    time, speed = trace.time_s, trace.columns.get("speed_m_s")
    first, at = (min(int(k), time.size - 1) for k in np.searchsorted(time, (pull.onset_s, pull.peak_s)))
    between_samples = "peak_between_samples" in pull.flags
    if between_samples:
        first = at - 1
    first, last = max(first, 0), min(at + int(between_samples), time.size - 1)
    if speed is not None:
        way = np.abs(speed[first : last + 1])
        travel = float(
            way.max() * (time[at] - time[max(at - 1, 0)])
            if between_samples
            else way[:-1] @ np.diff(time[first : last + 1])
        )
    elif test is not None and test.speed_m_s:
        travel = test.speed_m_s * float(
            time[at] - time[max(at - 1, 0)] if between_samples else time[last] - time[first]
        )
    else:
        return False
    return travel > (_STRETCH_M if between_samples else _LONGEST_STRETCH_M)


def with_static_peak(pull: Pull, peak_s: float, static_N: float, static_u_N: float) -> Pull:
    """A pull with another static peak than that of its rule."""
    return replace(pull, peak_s=peak_s, static_N=static_N, static_u_N=static_u_N)


def _without_static(pull: Pull) -> Pull:
    """A pull whose first maximum is none of a start from rest."""
    flags = [flag for flag in pull.flags if not flag.startswith("peak_") and flag not in ("rounded_peak", "no_drop")]
    return replace(pull, **dict.fromkeys(_OF_STATIC, math.nan), flags=("no_static", *flags))  # type: ignore[arg-type]


def _from_rest(
    signal: Signal,
    zero: Zero | None,
    rule: Rule,
    test: Test | None,
    peak_s: float | None = None,
    window_s: tuple[float, float] | None = None,
) -> Pull:
    """Static peak and sliding mean of a pull; each uncertainty holds a slow wander since the zero was read."""
    loading = loading_of(signal, zero)
    if peak_s is not None:
        loading = with_peak_near(loading, peak_s)
    static = find_apex(loading)
    motion = in_motion(loading, static, test.speed_m_s if test else None)
    readings = static.force_N, math.nan, math.nan
    if peak_s is None:
        motion = replace(motion, apex=within_samples(motion, static))
        static = within_samples(motion, rule.static(motion, rule.parameters))
        readings = static_readings(motion, loading.end)
    window = rule.sliding(motion, rule.parameters) if window_s is None else window_between(motion.time_s, *window_s)
    sliding = sliding_over(motion, window)
    level = motion.zero
    static_wander = level.wander_rate * max(static.time_s - level.time_s, 0.0)
    since_zero_s = sliding.window_s[0] - level.time_s + (sliding.window_s[1] - sliding.window_s[0]) / 3.0
    open_N = left_open_N(readings, static)
    stiffness = math.nan
    if motion.travel_m is not None:
        rising = slice(motion.rise.first, motion.rise.last + 1)
        pace = line(motion.time_s[rising], motion.travel_m[rising])[0]
        stiffness = motion.rise.rate / pace if pace > 0 else math.nan
    return Pull(
        test_id="",
        rule=rule.name,
        static_N=static.force_N,
        static_u_N=math.sqrt(static.u_N**2 + static.shape_u_N**2 + level.u_N**2 + static_wander + open_N**2),
        sliding_N=sliding.mean_N,
        sliding_u_N=math.sqrt(sliding.u_N**2 + level.u_N**2 + sliding.wander_rate * max(since_zero_s, 0.0)),
        zero_N=level.force_N,
        zero_u_N=level.u_N,
        zero_rule=zero.rule if zero else BEFORE_CONTACT,
        onset_s=motion.onset_s,
        peak_s=static.time_s,
        window_s=sliding.window_s,
        rise_N_per_s=motion.rise.rate,
        rise_stiffness_N_per_m=stiffness,
        stick_slip_amplitude_N=sliding.swing_N,
        stick_slip_period_s=sliding.period_s,
        noise_N=sliding.noise_N if sliding.enough else motion.noise_N,
        drift_N_per_s=sliding.drift_N_per_s,
        flags=_flags(motion, static, sliding, rule, peak_ambiguous=open_N > 0, peak_by_hand=peak_s is not None,
                     window_by_hand=window_s is not None),
        problems=motion.problems,
        first_maximum_N=readings[0],
        highest_N=readings[1],
        first_drop_N=readings[2],
    )  # fmt: skip


def _flags(motion: Motion, static: Apex, sliding: Sliding, rule: Rule, **more: bool) -> tuple[str, ...]:
    enough, travel = sliding.enough, motion.travel_m
    start, end = sliding.window
    asked = rule.parameters.get("length_m", 0.0)
    raised = {
        "no_zero_phase": not motion.zero.seen,
        "spike": bool(motion.problems),
        "gap_at_peak": _gap_at(motion.time_s, static.time_s),
        "rounded_peak": static.shape == "rounded",
        "peak_between_samples": static.shape == "highest sample",
        "no_drop": enough and static.force_N - sliding.mean_N < 3.0 * math.hypot(static.u_N, sliding.u_N),
        "no_sliding": not enough,
        "window_short": enough and travel is not None and bool(travel[end - 1] - travel[start] < 0.9 * asked),
        "stick_slip": not math.isnan(sliding.period_s),
        **more,
    }
    return tuple(name for name, is_raised in raised.items() if is_raised)


def _gap_at(time_s: FloatArray, at_s: float) -> bool:
    """Whether the samples on either side of a time lie further apart than ``_GAP`` mean steps of the record."""
    after = min(max(int(np.searchsorted(time_s, at_s)), 1), time_s.size - 1)
    return float(time_s[after] - time_s[after - 1]) > _GAP * float(time_s[-1] - time_s[0]) / (time_s.size - 1)


def _sliding(signal: Signal, span: tuple[int, int], zero: Zero | None, options: PullOptions) -> Pull:
    """Sliding friction of a range that slides from its first sample; its static friction is NaN.

    The start of a record is left out as running-in; a piece was sliding before it began.

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
    start, speed = first + transient_end(force), options.test.speed_m_s if options.test else None
    if not options.begins:
        start = max(start, first + int(_LEFT_OUT * force.size))
        if speed and slides_on_closed_track(speed * signal.time_s, span):
            start = first + force.size // 2
    level = zero or Zero(0.0, math.nan, "none")
    mean_N, mean_u_N, drift, noise = steady(signal.time_s[start:last], signal.force_N[start:last])
    if mean_N - level.force_N < 0:
        what = "the force acts against the pull direction; its sign may be reversed"
        raise TraceError(Problem("sign_flipped", what, column="force", found=f"{mean_N - level.force_N:.6g} N"))
    flags = ("no_static",) if zero else ("no_static", "no_zero_phase")
    return Pull(
        test_id="", rule=options.rule, sliding_N=mean_N - level.force_N,
        sliding_u_N=math.hypot(mean_u_N, level.u_N if math.isfinite(level.u_N) else 0.0),
        zero_N=level.force_N, zero_u_N=level.u_N, zero_rule=level.rule,
        window_s=(float(signal.time_s[start]), float(signal.time_s[last - 1])), noise_N=noise,
        drift_N_per_s=drift, flags=(*flags, "spike") if signal.problems else flags,
        problems=signal.problems,
    )  # fmt: skip


def _over(pull: Pull, signal: Signal, start_s: float, end_s: float) -> Pull:
    """A pull with its sliding mean over a window chosen by hand that no rise comes before within its stretch.

    Raises
    ------
    TraceError
        ``window_short``: fewer than ten data points lie in it.
    """
    first, end = window_between(signal.time_s, start_s, end_s)
    if end - first < _FEWEST_BY_HAND:
        what, allowed = "too few data points in this window", f"{_FEWEST_BY_HAND} data points or more"
        raise TraceError(Problem("window_short", what, found=f"{end - first} data points", allowed=allowed))
    mean_N, mean_u_N, drift, noise = steady(signal.time_s[first:end], signal.force_N[first:end])
    zero_u = pull.zero_u_N if math.isfinite(pull.zero_u_N) else 0.0
    return replace(
        pull, sliding_N=mean_N - pull.zero_N, sliding_u_N=math.hypot(mean_u_N, zero_u),
        window_s=(float(signal.time_s[first]), float(signal.time_s[end - 1])), noise_N=noise,
        drift_N_per_s=drift, flags=(*pull.flags, "window_by_hand"),
    )  # fmt: skip


def _with_restarts(first: Pull, trace: Trace, signal: Signal, course: Course, rule: Rule, options: PullOptions) -> Pull:
    """A pull with the restarts of its record.

    Where its force has not settled before the first stop, the sliding mean is that of the steadiest slide.
    """
    zero = Zero(first.zero_N, first.zero_u_N if math.isfinite(first.zero_u_N) else 0.0, first.zero_rule)
    restarts, slides = [], [first]
    for (stop, restart), (_, end) in zip(course.stops, course.pieces[1:], strict=True):
        begin = stop + int(_LEAD_IN * (restart - stop))
        try:
            pull = _from_rest(signal_of(piece_of(trace, begin, end, trace.name)), zero, rule, options.test)
        except TraceError:
            continue  # a last piece too short for a peak
        stop_s, hold_s = float(signal.time_s[stop]), float(signal.time_s[restart] - signal.time_s[stop])
        restarts.append(
            Restart(hold_s, stop_s, pull.peak_s, pull.static_N, pull.static_u_N, pull.sliding_N, pull.sliding_u_N)
        )
        slides.append(pull)

    def changed(pull: Pull) -> float:
        """How far the force drifts over the sliding window."""
        return abs(pull.drift_N_per_s) * (pull.window_s[1] - pull.window_s[0])

    def unsteadiness(pull: Pull) -> float:
        """What the mean of a sliding window leaves open, its drift included; infinite where there is none."""
        known = math.isfinite(pull.sliding_u_N + changed(pull))
        return math.hypot(pull.sliding_u_N, changed(pull) / math.sqrt(12.0)) if known else math.inf

    has_settled = first.sliding_N and changed(first) / abs(first.sliding_N) < _SETTLED
    best = first if has_settled or options.window_s is not None else min(slides, key=unsteadiness)
    return replace(
        first, restarts=tuple(restarts), sliding_N=best.sliding_N, sliding_u_N=best.sliding_u_N,
        window_s=best.window_s, drift_N_per_s=best.drift_N_per_s, flags=(*first.flags, "restarts"),
    )  # fmt: skip


def _with_doubt_of_zero(pull: Pull, signal: Signal, course: Course) -> Pull:
    """A pull whose uncertainties hold the difference between its zero and a level at a stop at which nothing pulled."""
    u = pull.zero_u_N if math.isfinite(pull.zero_u_N) else 0.0
    away = disagreement_N(course, signal, pull.zero_N, u) / math.sqrt(3.0)
    if not away:
        return pull
    restarts = tuple(
        replace(r, static_u_N=math.hypot(r.static_u_N, away), sliding_u_N=math.hypot(r.sliding_u_N, away))
        for r in pull.restarts
    )
    return replace(
        pull, static_u_N=math.hypot(pull.static_u_N, away), sliding_u_N=math.hypot(pull.sliding_u_N, away),
        zero_u_N=math.hypot(u, away), restarts=restarts, flags=(*pull.flags, "zero_uncertain"),
    )  # fmt: skip


def spring_of(test: Test, load_N: float) -> dict[str, float]:
    """k v in N/s and the free period of the slider on its spring in s; NaN where not known."""
    load = test.normal_load_N if math.isfinite(test.normal_load_N) else load_N
    mass, k, v = load / STANDARD_GRAVITY, test.stiffness_N_per_m or math.nan, test.speed_m_s or math.nan
    return {"drive_N_per_s": k * v, "free_period_s": 2.0 * math.pi * math.sqrt(mass / k) if k > 0 else math.nan}


def _with_oscillation(pull: Pull, trace: Trace, signal: Signal, test: Test) -> Pull:
    """A pull with the cycles of its sliding force, over the window its mean is taken from."""
    first, last = np.searchsorted(signal.time_s, pull.window_s) if math.isfinite(pull.window_s[0]) else (0, 0)
    if last - first < _FEWEST:
        return pull
    time, force = signal.time_s[first : last + 1], signal.force_N[first : last + 1] - pull.zero_N
    found = oscillation_of(time, force, **spring_of(test, pull.recorded_load_N))
    load = trace.columns.get("normal_force_N")
    if load is not None and found.cycles:
        load = load[first : last + 1]
        varies = np.isfinite(load).all() and np.ptp(force) > 0
        varies = varies and np.std(load) * abs(np.mean(force)) > _AS_LOAD * np.std(force) * abs(np.mean(load))
        if varies and abs(float(np.corrcoef(force, load)[0, 1])) > _WITH_LOAD:  # as on a disc that runs out of true
            return replace(pull, oscillation=replace(found, regime="steady"), flags=(*pull.flags, "follows_load"))
    if math.isfinite(pull.static_N) or found.regime in ("steady", "irregular"):
        return replace(pull, oscillation=found)
    flags = (*pull.flags, "stick_slip") if found.regime == "stick-slip" else pull.flags
    return replace(
        pull, oscillation=found, stick_slip_amplitude_N=found.drop_N, stick_slip_period_s=found.period_s, flags=flags
    )


def _slips(pull: Pull, signal: Signal, test: Test, by_hand: Sequence[SlipChange]) -> tuple[Slip, ...]:
    """The slips of every motion of a record, each read with the speed of its phases, then what a person changed."""
    held, stiffness = test.hold_s, test.stiffness_N_per_m or math.nan
    motions: list[list[Phase]] = []
    joined = False
    for phase in pull.phases:
        if phase.name == "hold":
            held = phase.end_s - phase.start_s
        if phase.name in _MOTION:
            if not joined or phase.name in ("rise", "stroke"):
                motions.append([])
            motions[-1].append(phase)
        joined = phase.name in _MOTION and phase.name != "stroke"
    if "follows_load" in pull.flags:
        motions = []
    found: list[Slip] = []
    for motion in motions:
        first, last = np.searchsorted(signal.time_s, (motion[0].start_s, motion[-1].end_s))
        time, force = signal.time_s[first : last + 1], signal.force_N[first : last + 1] - pull.zero_N
        if time.size < _FEWEST:
            continue
        from_rest = motion[0].name == "rise"
        speeds = [p.speed_m_s for p in motion if p.speed_m_s > 0]
        speed = test.speed_m_s or (float(np.median(speeds)) if speeds else math.nan)
        slips = slips_of(
            time, math.copysign(1.0, float(np.median(force))) * force, speed_m_s=speed, stiffness_N_per_m=stiffness,
            loading_N_per_s=pull.rise_N_per_s, from_rest=from_rest,
        )  # fmt: skip
        if from_rest and slips:
            slips = (_from_static_peak(slips[0], pull, held), *slips[1:])
        found += slips
    if by_hand:
        time, force = signal.time_s, signal.force_N - pull.zero_N
        speed = test.speed_m_s or math.nan
        return changed_by_hand(time, force, found, by_hand, speed, stiffness)
    return tuple(found)


def _from_static_peak(slip: Slip, pull: Pull, hold_s: float | None) -> Slip:
    """The first slip of a motion from rest: it fails at the static peak that the rule has read."""
    peaks = [(pull.peak_s, pull.static_N, hold_s), *((r.peak_s, r.static_N, r.hold_s) for r in pull.restarts)]
    peak_s, static_N, hold_s = min(peaks, key=lambda peak: abs(peak[0] - slip.fail_s))
    hold_s = math.nan if hold_s is None else hold_s
    if not slip.start_s < peak_s < slip.end_s or not static_N > slip.trough_N:
        return replace(slip, hold_s=hold_s)
    way = slip.slip_m * (static_N - slip.trough_N) / slip.drop_N
    lasts = slip.end_s - peak_s if math.isfinite(slip.duration_s) else math.nan
    return replace(slip, fail_s=peak_s, peak_N=static_N, slip_m=way, duration_s=lasts, hold_s=hold_s)


def _doubts(trace: Trace, pull: Pull, test: Test, *, one_speed: bool) -> list[Problem]:
    """Where samples look like no measurement, or what was recorded while sliding does not match the test."""
    found = odd_signal(trace)
    if one_speed and trace.displacement_m is not None and test.speed_m_s and math.isfinite(pull.window_s[0]):
        start, end = np.minimum(np.searchsorted(trace.time_s, pull.window_s), len(trace.time_s) - 1)
        time_s = float(trace.time_s[end] - trace.time_s[start])
        travel_m = abs(float(trace.displacement_m[end] - trace.displacement_m[start]))
        if time_s > 0 and not abs(travel_m / time_s / test.speed_m_s - 1.0) < _OFF_SPEED:
            units = {60.0: "mm/min: divide by 60", 1e3: "um/s: divide by 1000", 1e-3: "m/s: multiply by 1000"}
            factor = test.speed_m_s * time_s / travel_m if travel_m > 0 else math.nan
            slips = [f"; does speed_mm_s hold {w}?" for f, w in units.items() if abs(factor / f - 1.0) < _OFF_SPEED]
            what = "the displacement does not match the speed of the test"
            allowed = f"{test.speed_m_s * 1e3:.4g} mm/s" + "".join(slips[:1])
            seen = f"{travel_m / time_s * 1e3:.4g} mm/s"
            found.append(Problem("off_speed", what, trace.file, None, "displacement", seen, allowed))
    recorded, given = pull.recorded_load_N, test.normal_load_N
    if math.isfinite(recorded) and given > 0 and not abs(recorded / given - 1.0) < _OFF_LOAD:
        what = "the normal load recorded while sliding differs from that of the test"
        allowed = f"about {given:.4g} N, which is used"
        found.append(Problem("off_load", what, trace.file, None, "normal force", f"{recorded:.4g} N", allowed))
    if abs(pull.sliding_N) < _GONE * pull.static_N:
        what = "no force is left after its peak: the specimen broke, the slider came off, or this is no friction test"
        seen = f"{pull.static_N:.4g} N, then {pull.sliding_N:.2g} N"
        allowed = 'a force that stays while the slider slides; else a reason under "exclude" in tests.csv'
        found.append(Problem("force_gone", what, trace.file, None, "force", seen, allowed))
    return found


def _phases(trace: Trace, pull: Pull, signal: Signal, course: Course, options: PullOptions) -> tuple[Phase, ...]:
    """The phases of a record, with the starts that were read from it and forces above its zero."""
    starts = None
    if math.isfinite(pull.peak_s) or course.starts_sliding:
        starts = [(pull.onset_s, pull.peak_s), *((r.stop_s + r.hold_s, r.peak_s) for r in pull.restarts)]
    found = phases_of(trace, signal=signal, course=course, starts_s=starts, stated=options.phases)
    return tuple(replace(phase, force_N=phase.force_N - pull.zero_N) for phase in found)
