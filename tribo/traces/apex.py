"""The static peak: where and how high, below the resolution of the samples and not lifted by their noise."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tribo.records import FloatArray
from tribo.traces.contact import Rise
from tribo.traces.statistics import condense, mean

_DROP = 5.0  # a fall by this many times the noise ends the search for the first maximum
_DROP_SHARE = 0.015  # or by this share of the force reached, whichever is more
_FLAT_SHARE = 0.05  # the climb has ended where its pace is below this share of the loading line's
_MOST_SAMPLES = 48  # on either side of the apex; more are averaged together first
_FEWEST_SAMPLES = 4
_FEWEST_FOR_PARABOLA = 8
_POSITIONS = np.linspace(0.0, 1.0, 9)  # of the apex between two samples
_FALL_TIMES = np.append(np.geomspace(0.1, 2.0, 8), math.inf)  # as shares of the time looked at
_PAIRS_BEFORE, _PAIRS_AFTER = (
    4,
    3,
)  # pairs of neighbours about the presumed apex between which it is looked for
_LARGEST_POWER = 100.0  # of e; only samples that take no part would reach it
_ROUNDED = 4.0  # misfit per degree of freedom above which a shape is not a sharp apex


@dataclass(frozen=True)
class Apex:
    """A peak: time, force and standard uncertainty; ``chi2_red`` of the shape fitted and which shape that was."""

    time_s: float
    force_N: float
    u_N: float
    chi2_red: float
    shape: str


def first_maximum(smooth: FloatArray, start: int, depart: int, width: int, rise_per_sample: float, noise: float) -> int:
    """Index of the first maximum after ``start``: the highest force before it falls, or before it stops climbing.

    It has fallen once it lies ``_DROP`` times the noise and ``_DROP_SHARE`` of the force below the highest so
    far; it has stopped climbing once, after the departure from the loading line, the pace over ``width``
    samples is below ``_FLAT_SHARE`` of the loading line's.
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


@dataclass(frozen=True)
class _Side:
    """What the samples on one side say of the force at the apex: value, variance over noise^2, misfit of the fit."""

    value: FloatArray
    variance: FloatArray
    misfit: FloatArray


def sharp_apex(time_s: FloatArray, force: FloatArray, centre: int, noise: float) -> Apex | None:
    """Apex of a smooth rise that turns into a fall, anywhere between the samples around ``centre``.

    For every pair of neighbours the apex may lie between, a parabola is fitted to the samples before and a
    level plus an exponential to those after, for a series of fall times and for no fall at all. Rise and fall
    meet at the apex, or the fall begins with a sudden drop; the latter has a free parameter more and is
    weighed by its Occam factor (width of what the samples allow over width of what was possible beforehand:
    any drop down to the last samples). Every position, fall time and kind of fall counts with its likelihood,
    so the uncertainty holds what the shape leaves open. Closed form, no iteration. None if too few samples
    stand on a side.
    """
    t = time_s - time_s[centre]
    pairs = np.arange(centre - _PAIRS_BEFORE, centre + _PAIRS_AFTER)
    pairs = pairs[(pairs >= _FEWEST_SAMPLES - 1) & (pairs < t.size - _FEWEST_SAMPLES)]
    if pairs.size == 0:
        return None
    at = t[pairs, None] + _POSITIONS * (t[pairs + 1] - t[pairs])[:, None]  # (J, S)
    before = np.arange(t.size) <= pairs[:, None]  # (J, n)
    rise = _rise_side(t, force, before.astype(float), at)  # arrays (J, S)
    fall = _fall_side(t, force, (~before).astype(float), at)  # arrays (K, J, S)
    return _weigh(t, force, at, rise, fall, noise, float(time_s[centre]))


def _weigh(
    t: FloatArray, force: FloatArray, at: FloatArray, rise: _Side, fall: _Side, noise: float, origin: float
) -> Apex | None:
    """Mean and spread of the apex over all positions and falls, each by its likelihood (see :func:`sharp_apex`)."""
    both = rise.variance + fall.variance
    apart = rise.value - fall.value
    misfit = rise.misfit + fall.misfit
    meeting = misfit + apart**2 / both
    best = float(meeting.min())
    if not math.isfinite(best):
        return None
    chi2_red = best / noise**2 / max(t.size - 6, 1)
    scale = noise**2 * max(chi2_red, 1.0)
    possible = np.maximum(rise.value - mean(force[-3:]), noise)
    occam = np.minimum(np.sqrt(2.0 * math.pi * scale * both) / possible, 1.0)
    occam[-1] = 0.0  # without a fall there is no drop to begin it
    sudden = np.where(apart > 0, occam * np.exp((best - misfit) / (2.0 * scale)), 0.0).sum(axis=0)  # (J, S)
    smooth = np.exp((best - meeting) / (2.0 * scale))
    total = float(smooth.sum() + sudden.sum())
    met = (rise.value * fall.variance + fall.value * rise.variance) / both
    height = (np.vdot(smooth, met) + np.vdot(sudden, rise.value)) / total
    variance = (
        np.vdot(smooth, scale * rise.variance * fall.variance / both + (met - height) ** 2)
        + np.vdot(sudden, scale * rise.variance + (rise.value - height) ** 2)
    ) / total
    when = np.vdot(smooth.sum(axis=0) + sudden, at) / total
    return Apex(float(when) + origin, float(height), math.sqrt(variance), chi2_red, "sharp")


def _rise_side(t: FloatArray, f: FloatArray, before: FloatArray, at: FloatArray) -> _Side:
    """Parabola (a line under eight samples) through the samples of each row of ``before`` (J, n), at times (J, S)."""
    terms = 3 if before[0].sum() >= _FEWEST_FOR_PARABOLA else 2
    reach = max(-float(t[0]), float(t[-1]))
    x, x_at = t / reach, at / reach
    square = x * x
    powers = np.array((np.ones_like(x), x, square, square * x, square * square))
    order = np.arange(terms)
    inverse = np.linalg.inv((before @ powers.T)[:, order[:, None] + order])
    right = before @ (powers[:terms] * f).T
    c = (inverse @ right[:, :, None])[:, :, 0]
    misfit = np.maximum(before @ (f * f) - (c * right).sum(axis=1), 0.0)
    basis = np.array((np.ones_like(x_at), x_at, x_at * x_at)[:terms]).transpose(1, 2, 0)
    value = (basis @ c[:, :, None])[:, :, 0]
    return _Side(value, ((basis @ inverse) * basis).sum(axis=-1), misfit[:, None])


def _fall_side(t: FloatArray, f: FloatArray, after: FloatArray, at: FloatArray) -> _Side:
    """Exponential falls through the samples of each row of ``after`` (J, n), one a fall time: arrays (K, J, S).

    The last fall time is infinite: a level. A fit that climbs instead of falling is given an infinite misfit.
    """
    fall_s = np.maximum(_FALL_TIMES * float(t[-1]), 0.3 * float(t[-1] - t[-2]))[:, None]
    u = np.exp(np.minimum((t[-1] - t) / fall_s, _LARGEST_POWER))  # (K, n), 1 at the last sample
    n, sf, sff = after.sum(axis=1), after @ f, after @ (f * f)
    su, suu, suf = u @ after.T, (u * u) @ after.T, (u * f) @ after.T  # (K, J)
    spread, joint = suu - su * su / n, suf - su * sf / n
    spread[-1], joint[-1] = 1.0, 0.0
    slope = joint / spread
    misfit = np.where(slope >= 0, np.maximum(sff - sf * sf / n - slope * joint, 0.0), np.inf)
    away = np.exp(np.minimum((t[-1] - at) / fall_s[:, :, None], _LARGEST_POWER)) - (su / n)[:, :, None]
    value = (sf / n)[:, None] + slope[:, :, None] * away
    return _Side(value, (1.0 / n)[:, None] + away * away / spread[:, :, None], misfit[:, :, None])


def rounded_apex(time_s: FloatArray, force: FloatArray, peak: int, half: int, noise: float) -> Apex:
    """Highest point of a parabola through the samples within ``half`` of ``peak``."""
    low, high = max(peak - half, 0), min(peak + half, force.size - 1)
    t = time_s[low : high + 1] - time_s[peak]
    f = force[low : high + 1]
    if t.size < _FEWEST_SAMPLES:
        return Apex(float(time_s[peak]), float(f.mean()), noise / math.sqrt(max(t.size, 1)), math.nan, "rounded")
    reach = float(np.abs(t).max()) or 1.0
    x = np.stack((np.ones_like(t), t / reach, (t / reach) ** 2), axis=1)
    inverse = np.linalg.pinv(x.T @ x)
    c = inverse @ (x.T @ f)
    misfit = f - x @ c
    chi2_red = float(misfit @ misfit) / max(t.size - 3, 1) / noise**2
    top = -c[1] / (2.0 * c[2]) if c[2] < 0 else math.inf
    if not t[0] / reach <= top <= t[-1] / reach:
        top = float(t[int(np.argmax(x @ c))] / reach)
    row = np.array([1.0, top, top * top])
    u = noise * math.sqrt(max(chi2_red, 1.0) * float(row @ inverse @ row))
    return Apex(float(time_s[peak] + top * reach), float(row @ c), u, chi2_red, "rounded")


def find_apex(
    time_s: FloatArray,
    force: FloatArray,
    smooth: FloatArray,
    rise: Rise,
    depart: int,
    peak: int,
    level: float,
    noise: float,
) -> Apex:
    """The static peak of a pull: a sharp apex where the shape is one, else the top of a rounded one.

    ``depart`` is the first sample below the loading line, ``peak`` the first maximum of the smoothed force,
    ``level`` the force it falls to. The apex is looked for where the loading line ends and, if that fits
    badly, at the maximum.
    """
    climb = max(depart - rise.first, 2 * _FEWEST_SAMPLES)
    length = fall_length(smooth, peak, level, 2 * _FEWEST_SAMPLES, max(climb, 3 * _FEWEST_SAMPLES))
    candidates = []
    for centre in dict.fromkeys((min(depart, peak + 1), peak)):
        first = max(centre - climb, 0)
        factor = max(1, length // _MOST_SAMPLES)
        last = min(centre + length, force.size - 1)
        ts, fs = condense(time_s[first : last + 1], factor), condense(force[first : last + 1], factor)
        middle = (centre - first) // factor
        skipped = _smooth_from(ts, fs, middle, noise / math.sqrt(factor))
        apex = sharp_apex(ts[skipped:], fs[skipped:], middle - skipped, noise / math.sqrt(factor))
        if apex is not None:
            candidates.append(apex)
            if apex.chi2_red < _ROUNDED:
                return apex
    candidates.append(rounded_apex(time_s, force, peak, max(length // 2, 2), noise))
    return min(candidates, key=lambda a: a.chi2_red if not math.isnan(a.chi2_red) else math.inf)


def _smooth_from(t: FloatArray, f: FloatArray, centre: int, noise: float) -> int:
    """First sample of the longest stretch up to the apex that a parabola fits: all, half or a quarter of the rise."""
    end = max(centre - 1, 0)
    first = 0
    for share in (1.0, 0.5, 0.25):
        first = round(end * (1.0 - share))
        if end - first <= _FEWEST_FOR_PARABOLA:
            return max(min(first, end - _FEWEST_SAMPLES), 0)
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
