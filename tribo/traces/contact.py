"""Before motion: the zero of the force, the onset of the pull and the slope of its rise."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tribo.records import FloatArray
from tribo.traces.noise import mean, median, running_mean, wander

_LOW, _HIGH = 0.25, 0.75  # share of the first half-way level between which the slope of the rise is taken
_DETECTABLE = 12.0  # a pull rises by at least this many times the sample noise
_FEWEST_FOR_ZERO = 5
_TOES = (0.1, 0.03, 0.01)  # share of the rise left out before the loading line meets the zero
_CLIMBING = 0.3  # share of the loading line's pace above which a force before contact is no zero
_SUBSTANTIAL = (
    0.3  # share of the range of a trace that a climb reaches at least to be the pull and not a touch before it
)
_CLEAR_FALL = 0.1  # share of its height that a force loses in a clear fall


@dataclass(frozen=True)
class Zero:
    """Force before contact: mean, standard uncertainty, middle of the time it was seen, variance rate of its wander."""

    force_N: float
    u_N: float
    time_s: float
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


def line(time_s: FloatArray, force_N: FloatArray) -> tuple[float, float, float]:
    """Least-squares line as (slope, mean time, mean force); slope 0 where all times are equal."""
    t = mean(time_s)
    f = mean(force_N)
    away = time_s - t
    spread = float(away @ away)
    return (float(away @ force_N) / spread if spread > 0 else 0.0), t, f


def smoothing_width(samples: int) -> int:
    """Samples averaged before levels are searched: none up to 2000 samples, then a two-thousandth of the trace."""
    return max(1, samples // 2000)


def starting_level(smooth: FloatArray) -> float:
    """Force a trace begins at: the median of its first five samples or of its first fiftieth, whichever is lower."""
    first = median(smooth[:_FEWEST_FOR_ZERO])
    return min(first, median(smooth[: smooth.size // 50])) if smooth.size >= 50 * _FEWEST_FOR_ZERO else first


def first_rise(time_s: FloatArray, smooth: FloatArray, start: float, noise: float) -> Rise | None:
    """The first climb through a quarter to three quarters of the first maximum-like level, or None without one.

    That level is the highest force before the first clear fall; where the force climbs on without one, what it reaches
    when it leaves the pace of the first climb. ``start`` is the force the trace begins at.
    """
    full = float(smooth.max()) - start
    if full < _DETECTABLE * noise:
        return None
    full = _first_height(smooth - start, full, noise)
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


def _first_height(height: FloatArray, full: float, noise: float) -> float:
    """Highest force before the first clear fall from a substantial height; ``full`` if it never falls."""
    highest = np.maximum.accumulate(height)
    fallen = (highest > _SUBSTANTIAL * full) & (
        highest - height > np.maximum(_CLEAR_FALL * highest, _DETECTABLE * noise)
    )
    return float(highest[np.argmax(fallen)]) if fallen.any() else full


def departure(time_s: FloatArray, smooth: FloatArray, rise: Rise, margin: float) -> int:
    """Index of the first sample after the rise that lies more than ``margin`` below the loading line; else the last."""
    lag = rise.at(time_s[rise.last :]) - smooth[rise.last :]
    beyond = lag > margin
    return rise.last + (int(np.argmax(beyond)) if beyond.any() else beyond.size - 1)


def zero_before(time_s: FloatArray, force: FloatArray, rise: Rise, noise: float) -> Zero:
    """Zero from the samples before contact: their mean without outliers and its uncertainty, correlation counted.

    The zero phase ends a tenth of the rise before the loading line comes down to its level, so that a rounded toe does
    not enter; a thirtieth or a hundredth where less comes before. With fewer than five samples, or if the force climbs
    all the way, no zero is seen: it is taken as 0, and may lie anywhere between 0 and the force the record starts at.
    """
    level = median(force[: max(_FEWEST_FOR_ZERO, rise.first // 4)])
    contact = rise.reaches(level)
    climb = float(time_s[rise.last]) - contact
    lasts = (int(np.searchsorted(time_s, contact - toe * climb)) for toe in _TOES)
    last = next((n for n in lasts if n >= _FEWEST_FOR_ZERO), 0)
    slope, middle, level = line(time_s[:last], force[:last]) if last else (math.inf, 0.0, 0.0)
    by_noise = 3.0 * noise * math.sqrt(12.0 / last) / max(time_s[last - 1] - time_s[0], 1e-300) if last else 0.0
    if abs(slope) > _CLIMBING * rise.rate + by_noise:
        return Zero(0.0, abs(float(force[0])) / math.sqrt(3.0), float(time_s[0]), seen=False)
    away = np.abs(force[:last] - level)
    kept = force[:last][away <= 4.0 * max(noise, math.sqrt(float(away @ away) / last))]
    slow = wander(kept, float(time_s[last - 1] - time_s[0]))
    return Zero(mean(kept), max(slow.mean_u, noise / math.sqrt(last)), middle, slow.rate)


def smoothed(force: FloatArray) -> FloatArray:
    """Force averaged over :func:`smoothing_width` samples."""
    return running_mean(force, smoothing_width(force.size))
