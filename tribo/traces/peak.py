"""Search for the static peak: its range and resolution, from the loading line to the apex."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tribo.records import FloatArray
from tribo.traces.apex import FEWEST_SAMPLES, Apex, rounded_apex, sharp_apex, with_shape_left_open
from tribo.traces.noise import condense

_DROP = 5.0  # a fall by this many times the noise ends the search for the first maximum
_DROP_SHARE = 0.015  # or by this share of the force reached, whichever is more
_FLAT_SHARE = 0.05  # the climb has ended where its pace is below this share of the loading line's
_MOST_PAIRS = 8  # pairs of neighbours between which an apex is looked for; else samples are averaged together first
_MOST_SAMPLES = 200  # on either side of the apex
_FEWEST_FOR_PARABOLA = 8
_CLEARLY_ROUNDED = 0.6  # a rounded top is taken where its misfit is below this share of that of a sharp apex


@dataclass(frozen=True)
class Search:
    """Samples in which an apex is looked for: the rise starts at ``start``, the apex lies between ``low`` and ``high``,
    the fall ends at ``end``."""

    start: int
    low: int
    high: int
    end: int


def first_maximum(smooth: FloatArray, start: int, depart: int, width: int, rise_per_sample: float, noise: float) -> int:
    """Index of the first maximum after ``start``: the highest force before it falls, or before it stops climbing.

    It has fallen once it lies ``_DROP`` times the noise and ``_DROP_SHARE`` of the force below the highest so far; it
    has stopped climbing once, after the departure from the loading line, the pace over ``width`` samples is below
    ``_FLAT_SHARE`` of the loading line's.
    """
    after = smooth[start:]
    highest = np.maximum.accumulate(after)
    fallen = highest - after > np.maximum(_DROP * noise, _DROP_SHARE * (highest - smooth[: start + 1].min()))
    end = int(np.argmax(fallen)) if fallen.any() else after.size - 1
    pace = (smooth[depart + width :] - smooth[depart:-width]) / width if depart + width < smooth.size else np.empty(0)
    slow = pace < _FLAT_SHARE * rise_per_sample
    if slow.any():
        end = min(end, max(depart + int(np.argmax(slow)) + width - start, 1))
    return start + int(np.argmax(after[: end + 1]))


def fall_length(smooth: FloatArray, peak: int, level: float, shortest: int, longest: int) -> int:
    """Samples after ``peak`` until 80 % of the way down to ``level`` is gone, within the given bounds."""
    target = level + 0.2 * (smooth[peak] - level)
    down = smooth[peak : peak + longest + 1] <= target
    length = int(np.argmax(down)) if down.any() else longest
    return max(min(length, longest, smooth.size - 1 - peak), min(shortest, smooth.size - 1 - peak))


def find_apex(
    time_s: FloatArray, force: FloatArray, smooth: FloatArray, rise_start: int, depart: int, lag: int, peak: int,
    level: float, noise: float,
) -> Apex:  # fmt: skip
    """The static peak of a pull: a sharp apex where the shape is one, else the top of a rounded one.

    ``depart`` is the first sample below the loading line, at most ``lag`` samples after the line ended, ``peak`` the
    first maximum of the smoothed force, ``level`` the force it falls to. The apex is looked for where the loading line
    ends and, if that fits badly, at the maximum.
    """
    climb = max(depart - rise_start, 2 * FEWEST_SAMPLES)
    length = fall_length(smooth, peak, level, 2 * FEWEST_SAMPLES, max(climb, 3 * FEWEST_SAMPLES))
    low, high = min(depart, peak + 1) - lag, min(depart, peak + 1) + 2
    candidates = [_resolved(time_s, force, Search(max(low - climb, 0), low, high, high + length), noise)]
    if not (candidates[0] and candidates[0].fits) and not low <= peak < high:
        around = Search(max(peak - climb, 0), peak - 2, peak + 2, peak + length)
        candidates.append(_resolved(time_s, force, around, noise))
    sharp = min((a for a in candidates if a), key=lambda a: a.chi2_red, default=None)
    half = max(length // 2, 2)
    if sharp and sharp.fits:
        return with_shape_left_open(sharp, time_s, force, peak, half, noise)
    rounded = rounded_apex(time_s, force, peak, half, noise)
    if sharp and rounded.chi2_red > _CLEARLY_ROUNDED * sharp.chi2_red:
        return with_shape_left_open(sharp, time_s, force, peak, half, noise)
    return rounded


def _resolved(time_s: FloatArray, force: FloatArray, search: Search, noise: float) -> Apex | None:
    """Sharp apex within the search: on averaged samples where there are many, then finer while that tells more."""
    factor = _factor(search)
    apex = _condensed(time_s, force, search, factor, noise)
    while apex and factor > 1:
        finer = _closer(time_s, apex, search, factor)
        if _factor(finer) > factor // 2:
            break
        factor = _factor(finer)
        closer = _condensed(time_s, force, finer, factor, noise)
        if closer is None or closer.u_N > apex.u_N:
            break
        apex, search = closer, finer
    return apex


def _factor(search: Search) -> int:
    """Samples to average so that the pairs searched and the samples fitted stay few."""
    longest = max(search.low - search.start, search.end - search.high)
    return max(1, math.ceil((search.high - search.low) / _MOST_PAIRS), longest // _MOST_SAMPLES)


def _closer(time_s: FloatArray, apex: Apex, search: Search, factor: int) -> Search:
    """The search narrowed to three standard uncertainties in time (a condensed sample at the least) about an apex."""
    low, high = np.searchsorted(time_s, (apex.time_s - 3.0 * apex.time_u_s, apex.time_s + 3.0 * apex.time_u_s))
    low, high = int(low) - factor, int(high) + factor
    finest = max(1, (high - low) // _MOST_PAIRS)
    return Search(
        max(search.start, low - _MOST_SAMPLES * finest // 2),
        low,
        high,
        min(search.end, high + _MOST_SAMPLES * finest // 2),
    )


def _condensed(time_s: FloatArray, force: FloatArray, search: Search, factor: int, noise: float) -> Apex | None:
    """Sharp apex of the samples of a search, averaged by ``factor``."""
    t = condense(time_s[search.start : search.end + 1], factor)
    f = condense(force[search.start : search.end + 1], factor)
    low = (search.low - search.start) // factor
    high = (search.high - search.start) // factor + 1
    noise = noise / math.sqrt(factor)
    apex = sharp_apex(t, f, low, high, noise)
    if apex is None or apex.fits or not (skipped := _smooth_from(t, f, low, noise)):
        return apex
    return sharp_apex(t[skipped:], f[skipped:], low - skipped, high - skipped, noise)


def _smooth_from(t: FloatArray, f: FloatArray, end: int, noise: float) -> int:
    """First sample of the longest stretch up to the apex that a parabola fits: all, half or a quarter of the rise."""
    first = 0
    for share in (1.0, 0.5, 0.25):
        first = round(end * (1.0 - share))
        if end - first <= _FEWEST_FOR_PARABOLA:
            return max(min(first, end - FEWEST_SAMPLES), 0)
        if _parabola_misfit(t[first:end], f[first:end]) < 2.0 * noise**2 * (end - first):
            break
    return first


def _parabola_misfit(t: FloatArray, f: FloatArray) -> float:
    """Sum of squared departures from the least-squares parabola."""
    x = (t - t[0]) / (t[-1] - t[0])
    basis = np.stack((np.ones_like(x), x, x * x))
    c = np.linalg.solve(basis @ basis.T, basis @ f)
    away = f - c @ basis
    return float(away @ away)
