"""The static peak of a pull: shapes fitted in closed form about its first maximum, finer than its samples."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from tribo.records import FloatArray
from tribo.traces.loading import Climb
from tribo.traces.signal import condense

FEWEST_SAMPLES = 4
_FEWEST_FOR_PARABOLA = 8
_POSITIONS = np.linspace(0.0, 1.0, 9)  # of the apex between two samples
_FALL_TIMES = np.append(np.geomspace(0.1, 2.0, 8), math.inf)  # as shares of the time looked at
_MORE_FALL_TIMES = np.append(np.geomspace(0.1, 2.0, 24), math.inf)
_MANY = 200  # samples from which on a fit tells the finer series apart
_CLOSEST = 2  # samples on either side of a top that tell a parabola
_FITS = 1.5  # misfit per degree of freedom up to which a parabola fits
_MOST_PAIRS = 8  # pairs of neighbours between which an apex is looked for; else samples are averaged together first
_MOST_SAMPLES = 200  # on either side of the apex
_CLEARLY_ROUNDED = 0.6  # a rounded top is taken where its misfit is below this share of that of a sharp apex


@dataclass(frozen=True)
class Apex:
    """A peak: time and force with standard uncertainties, misfit per degree of freedom and the shape fitted.

    ``shape_u_N`` is what the choice of the shape leaves open: a sharp apex may be the end of a line that no sample
    followed to its end.
    """

    time_s: float
    time_u_s: float
    force_N: float
    u_N: float
    chi2_red: float
    shape: str
    shape_u_N: float = 0.0

    @property
    def fits(self) -> bool:
        return self.chi2_red < _FITS


@dataclass(frozen=True)
class _Side:
    """What the samples on one side say of the force at the apex: value, variance over noise^2, misfit of the fit."""

    value: FloatArray
    variance: FloatArray
    misfit: FloatArray


@dataclass(frozen=True)
class Search:
    """Samples in which an apex is looked for: the rise starts at ``start``, the apex lies between ``low`` and ``high``,
    the fall ends at ``end``."""

    start: int
    low: int
    high: int
    end: int


def find_apex(climb: Climb) -> Apex:
    """The static peak of a pull: a sharp apex where the shape is one, else the top of a rounded one.

    The apex is looked for where the loading line ends and, if that fits badly, at the first maximum.
    """
    held = slice(climb.end)
    time_s, force, smooth = climb.signal.time_s[held], climb.signal.force_N[held], climb.signal.smooth_N[held]
    depart, peak, noise = climb.depart, climb.top, climb.signal.noise_N
    long = max(depart - climb.rise.first, 2 * FEWEST_SAMPLES)
    length = fall_length(smooth, peak, climb.level_N, 2 * FEWEST_SAMPLES, max(long, 3 * FEWEST_SAMPLES))
    low, high = min(depart, peak + 1) - climb.lag, min(depart, peak + 1) + 2
    candidates = [_resolved(time_s, force, Search(max(low - long, 0), low, high, high + length), noise)]
    if not (candidates[0] and candidates[0].fits) and not low <= peak < high:
        around = Search(max(peak - long, 0), peak - 2, peak + 2, peak + length)
        candidates.append(_resolved(time_s, force, around, noise))
    sharp = min((a for a in candidates if a), key=lambda a: a.chi2_red, default=None)
    half = max(length // 2, 2)
    if sharp and sharp.fits:
        return with_shape_left_open(sharp, time_s, force, peak, half, noise)
    rounded = rounded_apex(time_s, force, peak, half, noise)
    if sharp and rounded.chi2_red > _CLEARLY_ROUNDED * sharp.chi2_red:
        return with_shape_left_open(sharp, time_s, force, peak, half, noise)
    return rounded


def near(climb: Climb, peak_s: float) -> Climb:
    """The climb of a pull whose static peak a person saw: it is looked for within two samples of that time."""
    time = climb.signal.time_s
    top = min(max(int(np.searchsorted(time, peak_s)), FEWEST_SAMPLES), time.size - FEWEST_SAMPLES - 1)
    return replace(climb, depart=top, lag=2, top=top, end=max(climb.end, top + FEWEST_SAMPLES))


def fall_length(smooth: FloatArray, peak: int, level: float, shortest: int, longest: int) -> int:
    """Samples after ``peak`` until 80 % of the way down to ``level`` is gone, within the given bounds."""
    target = level + 0.2 * (smooth[peak] - level)
    down = smooth[peak : peak + longest + 1] <= target
    length = int(np.argmax(down)) if down.any() else longest
    return max(min(length, longest, smooth.size - 1 - peak), min(shortest, smooth.size - 1 - peak))


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


def sharp_apex(time_s: FloatArray, force: FloatArray, first: int, last: int, noise: float) -> Apex | None:
    """Apex of a smooth rise that turns into a fall, anywhere between samples ``first`` and ``last``.

    For every pair of neighbours the apex may lie between, a parabola is fitted to the samples before and a
    level plus an exponential to those after, for a series of fall times and for no fall at all. Rise and fall
    meet at the apex, or the fall begins with a sudden drop; the latter has a free parameter more and is
    weighed by its Occam factor (width of what the samples allow over width of what was possible beforehand:
    any drop down to the last samples). Every position, fall time and kind of fall counts with its likelihood,
    so the uncertainty holds what the shape leaves open. Closed form, no iteration. None if too few samples
    stand on a side.
    """
    pairs = np.arange(max(first, FEWEST_SAMPLES - 1), min(last, time_s.size - FEWEST_SAMPLES))
    if pairs.size == 0:
        return None
    origin = float(time_s[pairs[-1]])
    t = time_s - origin
    at = t[pairs, None] + _POSITIONS * (t[pairs + 1] - t[pairs])[:, None]  # (J, S)
    before = (np.arange(t.size) <= pairs[:, None]).astype(float)  # (J, n)
    rise_end, fall_start = int(pairs[-1]) + 1, int(pairs[0]) + 1
    rise = _rise_side(t[:rise_end], force[:rise_end], before[:, :rise_end], at)  # arrays (J, S)
    shares = _FALL_TIMES if t.size < _MANY else _MORE_FALL_TIMES
    fall = _fall_side(t[fall_start:], force[fall_start:], 1.0 - before[:, fall_start:], at, shares)  # arrays (K, J, S)
    return _weigh(t, force, at, rise, fall, noise, origin)


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
    possible = np.maximum(rise.value - float(force[-3:].mean()), noise)
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
    weight = smooth.sum(axis=0) + sudden
    when = float(np.vdot(weight, at)) / total
    when_u = math.sqrt(float(np.vdot(weight, (at - when) ** 2)) / total)
    return Apex(when + origin, when_u, float(height), math.sqrt(variance), chi2_red, "sharp")


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


def _fall_side(t: FloatArray, f: FloatArray, after: FloatArray, at: FloatArray, shares: FloatArray) -> _Side:
    """Exponential falls through the samples of each row of ``after`` (J, n), one a fall time: arrays (K, J, S).

    ``shares`` (K,) are the fall times as shares of the time looked at, the last infinite: a level. A fit that climbs
    instead of falling is given an infinite misfit.
    """
    fall_s = np.maximum(shares * float(t[-1]), 0.3 * float(t[-1] - t[-2]))[:, None]
    u = np.exp((t[-1] - t) / fall_s)  # (K, n), 1 at the last sample
    n, sf, sff = np.array((np.ones_like(f), f, f * f)) @ after.T  # (J,) each
    su, suu, suf = (np.concatenate((u, u * u, u * f)) @ after.T).reshape(3, len(shares), -1)  # (K, J) each
    spread, joint = suu - su * su / n, suf - su * sf / n
    spread[-1], joint[-1] = 1.0, 0.0
    slope = joint / spread
    misfit = np.where(slope >= 0, np.maximum(sff - sf * sf / n - slope * joint, 0.0), np.inf)
    away = np.exp((t[-1] - at) / fall_s[:, :, None]) - (su / n)[:, :, None]
    value = (sf / n)[:, None] + slope[:, :, None] * away
    return _Side(value, (1.0 / n)[:, None] + away * away / spread[:, :, None], misfit[:, :, None])


def rounded_apex(
    time_s: FloatArray, force: FloatArray, peak: int, half: int, noise: float, closest: int = FEWEST_SAMPLES
) -> Apex:
    """Top of a parabola through the samples within ``half`` of ``peak``, or closer until a parabola fits.

    Once ``half`` is ``closest`` or less it is not made smaller.
    """
    apex = _parabola_top(time_s, force, peak, half, noise)
    while not apex.fits and half > closest:
        half //= 2
        apex = _parabola_top(time_s, force, peak, half, noise)
    return apex


def with_shape_left_open(
    sharp: Apex, time_s: FloatArray, force: FloatArray, peak: int, half: int, noise: float
) -> Apex:
    """A sharp apex with the uncertainty that its sharpness adds (GUM type B).

    The top may be rounded over a few samples, or over as many as noise hides it in: then the highest force lies
    anywhere between the top of the widest parabola that fits and the apex of the sharp shape, a rectangular
    distribution with one end at the value given. Where a parabola fits over many samples its own uncertainty is added.
    """
    rounded = rounded_apex(time_s, force, peak, half, noise, _CLOSEST)
    step_s = float(time_s[min(peak + 1, time_s.size - 1)] - time_s[max(peak - 1, 0)]) / 2.0
    over_many = 2.0 * rounded.time_u_s > FEWEST_SAMPLES * step_s
    lower = sharp.force_N - rounded.force_N + (rounded.u_N if over_many else 0.0)
    return replace(sharp, shape_u_N=max(lower, 0.0) / math.sqrt(3.0))


def _inverse(matrix: FloatArray) -> FloatArray:
    """Inverse of a matrix of normal equations; where samples share their times, the pseudo-inverse."""
    try:
        return np.asarray(np.linalg.inv(matrix))
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.pinv(matrix))


def _parabola_top(time_s: FloatArray, force: FloatArray, peak: int, half: int, noise: float) -> Apex:
    low, high = max(peak - half, 0), min(peak + half, force.size - 1)
    t, f = time_s[low : high + 1] - time_s[peak], force[low : high + 1]
    reach = max(-float(t[0]), float(t[-1]))
    if t.size < FEWEST_SAMPLES or reach <= 0:
        return Apex(float(time_s[peak]), reach, float(f.mean()), noise / math.sqrt(t.size), math.inf, "rounded")
    x = t / reach
    basis = np.array((np.ones_like(x), x, x * x))
    inverse = _inverse(basis @ basis.T)
    c = inverse @ (basis @ f)
    fitted = c @ basis
    chi2_red = float((f - fitted) @ (f - fitted)) / max(t.size - 3, 1) / noise**2
    top = -c[1] / (2.0 * c[2]) if c[2] < 0 else math.inf
    if not x[0] <= top <= x[-1]:
        top = float(x[int(np.argmax(fitted))])
    row = np.array((1.0, top, top * top))
    variance = noise**2 * max(chi2_red, 1.0) * float(row @ inverse @ row)
    return Apex(
        float(time_s[peak] + top * reach), reach / 2.0, float(row @ c), math.sqrt(variance), chi2_red, "rounded"
    )
