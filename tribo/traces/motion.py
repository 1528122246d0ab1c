"""One pull laid out for the rules: zeroed force, onset, static peak, and the part in which it slides."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from tribo.errors import Problem, TraceError
from tribo.records import FloatArray, Trace
from tribo.traces import quality
from tribo.traces.apex import FEWEST_SAMPLES, Apex
from tribo.traces.contact import Rise, Zero, departure, first_rise, smoothed, starting_level, zero_before
from tribo.traces.noise import median, median_of_three, running_mean
from tribo.traces.peak import find_apex, first_maximum
from tribo.traces.quality import noise_of

_DETECTABLE = 12.0  # times the noise
_FEWEST_SLIDING = 10
_RISE_OVER_SMOOTHING = 80  # samples of the rise per two samples of smoothing
_UNLOADED = 0.5  # share of the sliding level below which a trace's tail is taken as unloading
_BACK_AT_LEVEL = 0.9


@dataclass(frozen=True)
class Motion:
    """A pull in motion; arrays (n,) share the trace's samples, ``force_N`` is zeroed and free of impulses.

    ``sliding`` is the range of indices after the static peak and before any unloading, ``fallen`` the first
    of them at which the force has come down to its median over that range; ``travel_m`` the distance since
    the onset, where the trace or the test's speed tells it.
    """

    time_s: FloatArray
    force_N: FloatArray
    smooth_N: FloatArray
    travel_m: FloatArray | None
    zero: Zero
    rise: Rise
    onset_s: float
    apex: Apex
    sliding: tuple[int, int]
    fallen: int
    noise_N: float
    problems: tuple[Problem, ...]


def lay_out(trace: Trace, speed_m_s: float | None = None, zero: tuple[float, float] | None = None) -> Motion:
    """Find the phases of a pull. ``zero`` (force, standard uncertainty), where known, replaces that before contact.

    Raises
    ------
    TraceError
        Kinds ``too_short``, ``nan_gap``, ``time_goes_back``, ``sign_flipped``, ``stopped_before_peak``,
        ``saturated``, ``stuck``.
    """
    if faults := quality.unreadable(trace):
        raise TraceError(faults)
    time = quality.apart_in_time(np.asarray(trace.time_s, float))
    raw = np.asarray(trace.force_N, float)
    noise = noise_of(raw)
    spikes = quality.impulse_spikes(raw, noise)
    problems = quality.spike_problems(trace, spikes)
    force = quality.without_spikes(raw, spikes)
    noise = min(noise, noise_of(force)) if problems else noise
    calm = median_of_three(force)
    smooth = smoothed(calm)
    start = starting_level(smooth)
    rise = first_rise(time, smooth, start, noise)
    if faults := _no_pull(trace, smooth, start, rise, noise):
        raise TraceError([*faults, *problems])
    assert rise is not None
    if clipped := quality.flat_top(force):
        raise TraceError([_saturated(trace, clipped), *problems])
    if still := quality.standstill(raw):
        raise TraceError([_stuck(trace, still), *problems])
    known = Zero(*zero, time_s=float(time[0])) if zero else zero_before(time, force, rise, noise)
    return _with_peak(trace, time, force - known.force_N, calm - known.force_N, rise, known, noise, speed_m_s, problems)


def _no_pull(trace: Trace, smooth: FloatArray, start: float, rise: Rise | None, noise: float) -> list[Problem]:
    """Why no rise was found, if none was: the force went the other way, or the record ends before the peak."""
    down, up = start - float(smooth.min()), float(smooth.max()) - start
    if down > 3.0 * up and down > _DETECTABLE * noise:
        what = "the force acts against the pull direction; its sign may be reversed"
        return [Problem("sign_flipped", what, trace.file or None, None, "force", f"{smooth.min():.6g} N")]
    if rise is None:
        what = "the record ends before the static peak"
        end = f"{trace.time_s[-1]:.6g} s, {smooth[-1]:.6g} N"
        return [Problem("stopped_before_peak", what, trace.file or None, None, "force", end)]
    return []


def _saturated(trace: Trace, clipped: tuple[int, int]) -> Problem:
    first, run = clipped
    what = f"the force stays at its largest value for {run} data points: the load cell or the recorder was saturated"
    row = quality.file_row(trace, first)
    return Problem("saturated", what, trace.file or None, row, "force", f"{trace.force_N[first]:.6g} N")


def _stuck(trace: Trace, still: tuple[int, int]) -> Problem:
    first, run = still
    what = f"the force keeps the same value for {run} data points: the sensor or the recorder stopped working"
    row = quality.file_row(trace, first)
    return Problem("stuck", what, trace.file or None, row, "force", f"{trace.force_N[first]:.6g} N")


def _with_peak(
    trace: Trace, time: FloatArray, force: FloatArray, calm: FloatArray, rise: Rise, zero: Zero, noise:
    float, speed_m_s: float | None, problems: tuple[Problem, ...],
) -> Motion:  # fmt: skip
    rise = Rise(rise.rate, rise.time_s, rise.force_N - zero.force_N, rise.first, rise.last)
    width = 1 + 2 * ((rise.last - rise.first) // _RISE_OVER_SMOOTHING)
    smooth = running_mean(calm, width)
    local = noise / math.sqrt(width)
    reached = float(smooth[rise.last])
    margin = max(5.0 * local, 0.02 * reached)
    depart = departure(time, smooth, rise, margin)
    step = float(time[rise.last] - time[rise.first]) / max(rise.last - rise.first, 1)
    pause = max(3, (rise.last - rise.first) // 2)
    lag = math.ceil(margin / (rise.rate * step)) + 2
    peak = first_maximum(smooth, rise.last, depart, pause, rise.rate * step, local)
    end = _before_unloading(smooth, peak)
    if end - peak < 3 and end == force.size:
        raise TraceError([*_no_pull(trace, smooth, 0.0, None, noise), *problems])
    level = median(smooth[(peak + end) // 2 : end])
    apex = find_apex(time[:end], force[:end], smooth[:end], rise.first, depart, lag, peak, level, noise)
    onset = max(rise.reaches(0.0), float(time[0]))
    first = int(np.searchsorted(time, apex.time_s, side="right"))
    travel = _travel(trace, time, onset, speed_m_s)
    fallen = _fallen(smooth, first, end)
    return Motion(time, force, smooth, travel, zero, rise, onset, apex, (first, end), fallen, noise, problems)


def with_peak_at(motion: Motion, peak_s: float) -> Motion:
    """The same pull with its static peak looked for within two samples of a given time, and sliding after it."""
    last = motion.time_s.size - FEWEST_SAMPLES - 1
    peak = min(max(int(np.searchsorted(motion.time_s, peak_s)), FEWEST_SAMPLES), last)
    end = max(motion.sliding[1], peak + FEWEST_SAMPLES)
    time, force, smooth = motion.time_s[:end], motion.force_N[:end], motion.smooth_N[:end]
    level = median(smooth[(peak + end) // 2 :])
    apex = find_apex(time, force, smooth, motion.rise.first, peak, 2, peak, level, motion.noise_N)
    first = int(np.searchsorted(time, apex.time_s, side="right"))
    return replace(motion, apex=apex, sliding=(first, end), fallen=_fallen(smooth, first, end))


def _fallen(smooth: FloatArray, first: int, end: int) -> int:
    """First index of the range at which the force is down to the median of the range; ``end`` of an empty range."""
    if end <= first:
        return end
    return first + int(np.argmax(smooth[first:end] <= median(smooth[first:end])))


def _before_unloading(smooth: FloatArray, peak: int) -> int:
    """End (exclusive) of the part after the peak in which the force holds its level, a tail of unloading left out."""
    level = median(smooth[peak:])
    if level <= 0 or float(smooth[-3:].max()) >= _UNLOADED * level:
        return int(smooth.size)
    held = np.flatnonzero(smooth[peak:] >= _UNLOADED * level)
    at_level = np.flatnonzero(smooth[peak : peak + held[-1] + 1] >= _BACK_AT_LEVEL * level)
    return peak + int(at_level[-1]) + 1


def _travel(trace: Trace, time: FloatArray, onset_s: float, speed_m_s: float | None) -> FloatArray | None:
    """Distance travelled since the onset, always counted forward; from the speed where no displacement was recorded."""
    if trace.displacement_m is not None:
        x = np.asarray(trace.displacement_m, float)
        away = x - float(np.interp(onset_s, time, x))
        return np.asarray(np.where(away[-1] < 0, -1.0, 1.0) * away)
    return None if speed_m_s is None else np.asarray(speed_m_s * (time - onset_s))
