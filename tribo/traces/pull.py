"""From a trace to a pull: static and sliding friction by a named rule, with within-trace uncertainties."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from tribo.errors import Problem, TraceError
from tribo.records import Pull, Test, Trace
from tribo.traces.apex import Apex
from tribo.traces.contact import line
from tribo.traces.motion import Motion, lay_out, with_peak_at
from tribo.traces.noise import wander
from tribo.traces.rules import RULES, Rule, Window
from tribo.traces.sliding import Steady, steady, stick_slip

_FEWEST_SLIDING = 10
_GAP = 3.0
_NO_STEADY = Steady(math.nan, math.nan, math.nan, math.nan)


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
    chosen = _rule(rule, parameters)
    test_id, file = (test.test_id if test else None), trace.file or None
    try:
        motion = lay_out(trace, test.speed_m_s if test else None, zero)
        motion = motion if peak_s is None else with_peak_at(motion, peak_s)
        static = chosen.static(motion, chosen.parameters) if peak_s is None else motion.apex
        window = chosen.sliding(motion, chosen.parameters) if window_s is None else _samples(motion, window_s)
    except TraceError as fault:
        raise TraceError([p.at(file=file, test_id=test_id) for p in fault.problems]) from None
    problems = tuple(p.at(file=file, test_id=test_id) for p in motion.problems)
    pull = _reduce(motion, static, window, chosen, test_id or trace.name, problems)
    by_hand = {"peak_by_hand": peak_s is not None, "window_by_hand": window_s is not None}
    return replace(pull, flags=(*pull.flags, *(flag for flag, raised in by_hand.items() if raised)))


def _samples(motion: Motion, window_s: tuple[float, float]) -> Window:
    """The range of samples within a window of time."""
    first, end = np.searchsorted(motion.time_s, window_s)
    return int(first), int(end) + int(end < motion.time_s.size and motion.time_s[end] == window_s[1])


def _rule(name: str, parameters: Mapping[str, float] | None) -> Rule:
    if name not in RULES:
        raise TraceError(Problem("unknown_rule", "unknown rule", found=name, allowed=", ".join(RULES)))
    rule = RULES[name]
    if not parameters:
        return rule
    if unknown := sorted(set(parameters) - set(rule.parameters)):
        allowed = ", ".join(rule.parameters) or "none"
        raise TraceError(Problem("unknown_parameter", f"not in rule {name}", found=", ".join(unknown), allowed=allowed))
    return replace(rule, parameters={**rule.parameters, **parameters})


def _reduce(motion: Motion, static: Apex, window: Window, rule: Rule, name: str, problems: tuple[Problem, ...]) -> Pull:
    start, end = window
    time, force = motion.time_s, motion.force_N
    enough = end - start >= _FEWEST_SLIDING
    sliding = steady(time[start:end], force[start:end]) if enough else _NO_STEADY
    times = (float(time[start]), float(time[end - 1])) if enough else (math.nan, math.nan)
    zero_u = motion.zero.u_N
    static_wander, sliding_wander = _wander(motion, static, times)
    swing, period = _stick_slip(motion)
    return Pull(
        test_id=name,
        rule=rule.name,
        static_N=static.force_N,
        static_u_N=math.sqrt(static.u_N**2 + static.shape_u_N**2 + zero_u**2 + static_wander),
        sliding_N=sliding.mean_N,
        sliding_u_N=math.sqrt(sliding.u_N**2 + zero_u**2 + sliding_wander),
        zero_N=motion.zero.force_N,
        zero_u_N=motion.zero.u_N,
        onset_s=motion.onset_s,
        peak_s=static.time_s,
        window_s=times,
        rise_N_per_s=motion.rise.rate,
        rise_stiffness_N_per_m=_rise_stiffness(motion),
        stick_slip_amplitude_N=swing,
        stick_slip_period_s=period,
        noise_N=sliding.noise_N if enough else motion.noise_N,
        drift_N_per_s=sliding.drift_N_per_s,
        flags=_flags(motion, static, sliding, window, rule, period),
        problems=problems,
    )


def _wander(motion: Motion, static: Apex, window_s: tuple[float, float]) -> tuple[float, float]:
    """Variances that a slow wander has gathered since the zero was seen: of static and of sliding.

    What the zero wanders may have moved the static peak; sliding friction wanders by itself as well, and the
    whole record after the fall tells how much (the window alone was chosen for its steadiness, so it would
    tell less).
    """
    since = motion.zero.time_s
    static_variance = motion.zero.wander_rate * max(static.time_s - since, 0.0)
    fallen, end = motion.fallen, motion.sliding[1]
    if end - fallen < _FEWEST_SLIDING or math.isnan(window_s[0]):
        return static_variance, 0.0
    rate = wander(motion.force_N[fallen:end], float(motion.time_s[end - 1] - motion.time_s[fallen])).rate
    return static_variance, rate * max(window_s[0] - since + (window_s[1] - window_s[0]) / 3.0, 0.0)


def _stick_slip(motion: Motion) -> tuple[float, float]:
    fallen, end = motion.fallen, motion.sliding[1]
    if end - fallen < _FEWEST_SLIDING:
        return math.nan, math.nan
    return stick_slip(motion.time_s[fallen:end], motion.force_N[fallen:end], motion.noise_N)


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


def _flags(motion: Motion, static: Apex, sliding: Steady, window: Window, rule: Rule, period: float) -> tuple[str, ...]:
    enough = not math.isnan(sliding.mean_N)
    asked = rule.parameters.get("length_m", 0.0)
    travel = motion.travel_m
    short = enough and travel is not None and travel[window[1] - 1] - travel[window[0]] < 0.9 * asked
    raised = {
        "no_zero_phase": not motion.zero.seen,
        "spike": bool(motion.problems),
        "gap_at_peak": _gap_at(motion, static.time_s),
        "rounded_peak": static.shape == "rounded",
        "no_drop": enough and static.force_N - sliding.mean_N < 3.0 * math.hypot(static.u_N, sliding.u_N),
        "no_sliding": not enough,
        "window_short": bool(short),
        "stick_slip": not math.isnan(period),
    }
    return tuple(name for name, is_raised in raised.items() if is_raised)
