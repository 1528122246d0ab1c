"""From a trace to a pull: static and sliding friction by a named rule, with within-trace uncertainties."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from tribo.errors import Problem, TraceError
from tribo.nearest import did_you_mean
from tribo.records import Pull, Test, Trace
from tribo.traces.apex import Apex, find_apex, near
from tribo.traces.loading import climb_of
from tribo.traces.noise import line
from tribo.traces.rules import RULES, Rule
from tribo.traces.signal import Signal, signal_of
from tribo.traces.sliding import Motion, Sliding, in_motion, sliding_over, window_between
from tribo.traces.static_readings import StaticReadings, static_readings, within_samples

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
