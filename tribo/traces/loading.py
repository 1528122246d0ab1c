"""How a pull is loaded: the zero of the force, the loading line, and the first maximum at which it ends."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from tribo.errors import Problem, TraceError
from tribo.records import FloatArray
from tribo.traces.signal import Signal, correlated_noise, line, running_mean, sample_noise, wander

_LOW, _HIGH = 0.25, 0.75  # share of the first half-way level between which the slope of the rise is taken
_DETECTABLE = 12.0  # a pull rises by at least this many times the sample noise
_FEWEST_FOR_ZERO = 5
_TOES = (0.1, 0.03, 0.01)  # share of the rise left out before the loading line meets the zero
_CLIMBING = 0.3  # share of the loading line's pace above which a force before contact is no zero
_SUBSTANTIAL = 0.3  # share of the range of a trace that a climb reaches to be the pull and not a touch before it
_CLEAR_FALL = 0.1  # share of its height that a force loses in a clear fall
_RISE_OVER_SMOOTHING = 80  # samples of the rise per two samples of smoothing
_DROP = 5.0  # a fall by this many times the noise ends the search for the first maximum
_DROP_SHARE = 0.015  # or by this share of the force reached, whichever is more
_FLAT_SHARE = 0.05  # the climb has ended where its pace is below this share of the loading line's
_FEWEST_OF_RISE = 8  # samples of a rise from which on it tells of its own noise
_CORRELATED = 0.3  # correlation of neighbours from which on noise is not white,
_ROUGHER = 1.5  # and times the noise at rest above which a rise is rougher: chance gives less
_UNLOADED = 0.5  # share of the sliding level below which a trace's tail is taken as unloading
_BACK_AT_LEVEL = 0.9


@dataclass(frozen=True)
class Zero:
    """Zero of a force or load: its value, standard uncertainty and rule; ``drifts`` where it moved while it was read.

    One that was seen before contact also has the middle of the time it was seen and the variance rate of its wander.
    """

    force_N: float
    u_N: float
    rule: str = ""
    drifts: bool = False
    time_s: float = math.nan
    wander_rate: float = 0.0
    seen: bool = True


@dataclass(frozen=True)
class Rise:
    """The loading line: ``rate`` in N/s through (time, force), and the indices it was fitted between."""

    rate: float
    time_s: float
    force_N: float
    first: int
    last: int

    def at(self, time_s: FloatArray) -> FloatArray:
        return self.force_N + self.rate * (time_s - self.time_s)

    def reaches(self, force_N: float) -> float:
        """Time at which the loading line passes ``force_N``."""
        return self.time_s + (force_N - self.force_N) / self.rate


@dataclass(frozen=True)
class Loading:
    """A pull as far as its first maximum; forces of ``signal`` are counted from ``zero``, ``smooth_N`` suits the rise.

    ``depart`` is the index of the first sample below the loading line, at most ``lag`` samples after the line ended,
    ``top`` that of the first maximum of the smoothed force, ``end`` that at which a tail of unloading begins.
    ``rough_N`` is the noise of a sample at the first maximum as the rise shows it, correlation included, and
    ``correlated`` the number of samples that one independent sample stands for.
    """

    signal: Signal
    zero: Zero
    rise: Rise
    depart: int
    lag: int
    top: int
    end: int
    rough_N: float = 0.0
    correlated: float = 1.0

    @property
    def onset_s(self) -> float:
        """Time at which the loading line leaves zero."""
        return max(self.rise.reaches(0.0), float(self.signal.time_s[0]))

    @property
    def level_N(self) -> float:
        """Force to which the pull falls after its first maximum."""
        return float(np.median(self.signal.smooth_N[(self.top + self.end) // 2 : self.end]))


def loading_of(signal: Signal, zero: Zero | None = None) -> Loading:
    """Follow a pull up to its first maximum, above a ``zero`` that is known, else above the force before the rise.

    Raises
    ------
    TraceError
        Kinds ``sign_flipped``, ``stopped_before_peak``, ``saturated``, ``stuck``.
    """
    start = starting_level(signal.smooth_N)
    rise = first_rise(signal, start)
    if faults := _no_pull(signal, start, rise):
        raise TraceError([*faults, *signal.problems])
    assert rise is not None
    if signal.recorder_fault:
        raise TraceError([signal.recorder_fault, *signal.problems])
    known = replace(zero, time_s=float(signal.time_s[0])) if zero else zero_before(signal, rise)
    force, calm = signal.force_N - known.force_N, signal.calm_N - known.force_N
    width = 1 + 2 * ((rise.last - rise.first) // _RISE_OVER_SMOOTHING)
    zeroed = replace(signal, force_N=force, calm_N=calm, smooth_N=running_mean(calm, width))
    rise = replace(rise, force_N=rise.force_N - known.force_N)
    # the climb along the loading line and beyond it
    time, smooth, noise = zeroed.time_s, zeroed.smooth_N, signal.noise_N / math.sqrt(width)
    margin = max(5.0 * noise, 0.02 * float(smooth[rise.last]))
    depart = departure(time, smooth, rise, margin)
    per_sample = rise.rate * (float(time[rise.last] - time[rise.first]) / max(rise.last - rise.first, 1))
    rough, correlated = _roughness(force, rise, depart, float(smooth[depart]))
    top = first_maximum(smooth, rise, depart, per_sample, max(noise, rough * math.sqrt(min(correlated / width, 1.0))))
    end = _before_unloading(smooth, top)
    if end - top < 3 and end == smooth.size:
        raise TraceError([*_no_pull(zeroed, 0.0, None), *signal.problems])
    reach = min(margin / per_sample, smooth.size) if per_sample > 0 else 0
    return Loading(zeroed, known, rise, depart, math.ceil(reach) + 2, top, end, rough, correlated)


def _no_pull(signal: Signal, start: float, rise: Rise | None) -> list[Problem]:
    """Why no rise was found, if none was: the force went the other way, or the record ends before the peak."""
    smooth, file = signal.smooth_N, signal.file or None
    down, up = start - float(smooth.min()), float(smooth.max()) - start
    if down > 3.0 * up and down > _DETECTABLE * signal.noise_N:
        what = "the force acts against the pull direction; its sign may be reversed"
        return [Problem("sign_flipped", what, file, None, "force", f"{smooth.min():.6g} N")]
    if rise is None:
        what = "the record ends before the static peak"
        end = f"{signal.time_s[-1]:.6g} s, {smooth[-1]:.6g} N"
        return [Problem("stopped_before_peak", what, file, None, "force", end)]
    return []


def starting_level(smooth: FloatArray) -> float:
    """Force a trace begins at: the median of its first five samples or of its first fiftieth, whichever is lower."""
    first = float(np.median(smooth[:_FEWEST_FOR_ZERO]))
    longer = smooth[: smooth.size // 50]
    return min(first, float(np.median(longer))) if longer.size >= _FEWEST_FOR_ZERO else first


def first_rise(signal: Signal, start: float) -> Rise | None:
    """The first climb through a quarter to three quarters of the first maximum-like level, or None without one.

    That level is the highest force before the first clear fall; where the force climbs on without one, what it reaches
    when it leaves the pace of the first loading. ``start`` is the force the trace begins at.
    """
    time_s, smooth, noise = signal.time_s, signal.smooth_N, signal.noise_N
    full = float(smooth.max()) - start
    if full < _DETECTABLE * noise:
        return None
    height = smooth - start
    highest = np.maximum.accumulate(height)
    clear_fall = np.maximum(_CLEAR_FALL * highest, _DETECTABLE * noise)
    fallen = (highest > _SUBSTANTIAL * full) & (highest - height > clear_fall)
    full = float(highest[np.argmax(fallen)]) if fallen.any() else full  # before the first clear fall
    for _ in range(2):
        high = int(np.argmax(smooth >= start + _HIGH * full))
        below = np.flatnonzero(smooth[:high] <= start + _LOW * full)
        low = int(below[-1]) + 1 if below.size else 0
        low, high = (low, high) if high > low else (max(low - 1, 0), max(high, low, 1))
        slope, t, f = line(time_s[low : high + 1], smooth[low : high + 1])
        if slope <= 0:
            return None
        rise = Rise(slope, t, f, low, high)
        reached = float(smooth[: departure(time_s, smooth, rise, 0.1 * full) + 1].max()) - start
        if reached > _HIGH * full:
            break
        full = reached
    return rise


def departure(time_s: FloatArray, smooth: FloatArray, rise: Rise, margin: float) -> int:
    """Index of the first sample after the rise that lies more than ``margin`` below the loading line; else the last."""
    lag = rise.at(time_s[rise.last :]) - smooth[rise.last :]
    beyond = lag > margin
    return rise.last + (int(np.argmax(beyond)) if beyond.any() else beyond.size - 1)


def first_maximum(smooth: FloatArray, rise: Rise, depart: int, per_sample: float, noise: float) -> int:
    """Index of the first maximum after the rise: the highest force before it falls, or before it stops climbing.

    It has fallen once it lies ``_DROP`` times the noise and ``_DROP_SHARE`` of the force below the highest so far; it
    has stopped climbing once, after the departure from the loading line, the pace over half the samples of the rise is
    below ``_FLAT_SHARE`` of ``per_sample``, that of the loading line.
    """
    start, width = rise.last, max(3, (rise.last - rise.first) // 2)
    after = smooth[start:]
    highest = np.maximum.accumulate(after)
    fallen = highest - after > np.maximum(_DROP * noise, _DROP_SHARE * (highest - smooth[: start + 1].min()))
    end = int(np.argmax(fallen)) if fallen.any() else after.size - 1
    pace = (smooth[depart + width :] - smooth[depart:-width]) / width if depart + width < smooth.size else np.empty(0)
    slow = pace < _FLAT_SHARE * per_sample
    if slow.any():
        end = min(end, max(depart + int(np.argmax(slow)) + width - start, 1))
    return start + int(np.argmax(after[: end + 1]))


def _roughness(force: FloatArray, rise: Rise, depart: int, peak_N: float) -> tuple[float, float]:
    """Noise of a sample of a force at its peak, and how many samples one independent sample stands for.

    How far noise is correlated is told by second differences of the slide over one sample and over several; how large
    it is by those of the rise, over one sample. What the noise at rest leaves of it is noise of the contact, which
    grows with the force. No noise where it is white and as large as at rest, or too few samples tell.
    """
    rising, sliding = force[rise.first : depart + 1], force[depart:]
    if rising.size < _FEWEST_OF_RISE or not peak_N > 0:
        return 0.0, 1.0
    kept = correlated_noise(sliding, sliding > peak_N / 2.0)[1]
    kept = kept if kept > _CORRELATED else 0.0
    onset, rises = max(rise.first - (rise.last - rise.first), 0), sample_noise(rising)
    at_rest = sample_noise(force[:onset]) if onset >= _FEWEST_OF_RISE else rises
    if rises > _ROUGHER * at_rest:
        rises = math.hypot(at_rest, math.sqrt(max(rises**2 - at_rest**2, 0.0)) * peak_N / float(rising.mean()))
    elif not kept:
        return 0.0, 1.0  # noise as the fit of a peak counts it
    return rises * math.sqrt(3.0 / (3.0 - 4.0 * kept + kept**2)), (1.0 + kept) / (1.0 - kept)


def _before_unloading(smooth: FloatArray, top: int) -> int:
    """End (exclusive) of the part after the top in which the force holds its level, a tail of unloading left out."""
    level = float(np.median(smooth[top:]))
    if level <= 0 or float(smooth[-3:].max()) >= _UNLOADED * level:
        return int(smooth.size)
    held = np.flatnonzero(smooth[top:] >= _UNLOADED * level)
    at_level = np.flatnonzero(smooth[top : top + held[-1] + 1] >= _BACK_AT_LEVEL * level)
    return top + int(at_level[-1]) + 1


def zero_before(signal: Signal, rise: Rise) -> Zero:
    """Zero from the samples before contact: their mean without outliers and its uncertainty, correlation counted.

    The zero phase ends a tenth of the rise before the loading line comes down to its level, so that a rounded toe does
    not enter; a thirtieth or a hundredth where less comes before. With fewer than five samples, or if the force climbs
    all the way, no zero is seen: it is taken as 0, and may lie anywhere between 0 and the force the record starts at.
    """
    time_s, force, noise = signal.time_s, signal.force_N, signal.noise_N
    level = float(np.median(force[: max(_FEWEST_FOR_ZERO, rise.first // 4)]))
    contact = rise.reaches(level)
    climb_s = float(time_s[rise.last]) - contact
    lasts = (int(np.searchsorted(time_s, contact - toe * climb_s)) for toe in _TOES)
    last = next((n for n in lasts if n >= _FEWEST_FOR_ZERO), 0)
    slope, middle, level = line(time_s[:last], force[:last]) if last else (math.inf, 0.0, 0.0)
    by_noise = 3.0 * noise * math.sqrt(12.0 / last) / max(time_s[last - 1] - time_s[0], 1e-300) if last else 0.0
    if abs(slope) > _CLIMBING * rise.rate + by_noise:
        return Zero(0.0, abs(float(force[0])) / math.sqrt(3.0), time_s=float(time_s[0]), seen=False)
    away = np.abs(force[:last] - level)
    kept = force[:last][away <= 4.0 * max(noise, math.sqrt(float(away @ away) / last))]
    mean_u, rate, _ = wander(kept, float(time_s[last - 1] - time_s[0]))
    return Zero(float(kept.mean()), max(mean_u, noise / math.sqrt(last)), time_s=middle, wander_rate=rate)
