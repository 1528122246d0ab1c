"""The static peak of a pull: shapes fitted in closed form about its first maximum, finer than its samples.

Where the first maximum, the highest force and the force before the first drop differ, the uncertainty of the peak holds
the difference; no peak lies above what its samples and their noise allow.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from tribo.errors import Problem
from tribo.records import FloatArray
from tribo.traces.loading import Loading, Rise, Zero
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
DROP = 0.05  # share of the highest force so far by which the force falls in a first drop
_PEAKED = 3.0  # a peak stands above the later force by this many times the noise
_CLEARLY = 0.02  # readings differ where it is by this share of the force,
_BEYOND_U = 3.0  # and by this many times the uncertainty of the first maximum
_RESOLVED = 3  # samples of the middle half of a rise from which on a corner between two samples is told
_STEPS = 2.0  # steps between samples by which a corner on a resolved rise may lie above them
_SAME = 5  # samples within which two maxima are the same one
_FEWEST_READ = 16  # samples from which on the highest force and the first drop are read, and around a peak its noise
_LATER = 0.25  # share of a record at its end that tells the level a peak stands above
_HIGH = 0.3  # share of the largest force below which a fall is none of the peak
_NOISE_AT_TOP = 3.0  # largest excess of the noise over a top sample that is allowed
_CLEARLY_ROUNDED = 0.6  # a rounded top is taken where its misfit is below this share of that of a sharp apex


Search = tuple[int, int, int, int]  # first sample of the rise, two between which the apex lies, last of the fall
Side = tuple[FloatArray, FloatArray, FloatArray]  # force at the apex by one side: value, variance / noise^2, misfit


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


def find_apex(loading: Loading) -> Apex:
    """The static peak of a pull: a sharp apex where the shape is one, else the top of a rounded one.

    The apex is looked for where the loading line ends and, if that fits badly, at the first maximum.
    """
    held = slice(loading.end)
    time_s, force, smooth = loading.signal.time_s[held], loading.signal.force_N[held], loading.signal.smooth_N[held]
    depart, peak, noise = loading.depart, loading.top, loading.signal.noise_N
    long = max(depart - loading.rise.first, 2 * FEWEST_SAMPLES)
    # the fall lasts until 80 % of the way down is gone, within bounds
    shortest, longest, left = 2 * FEWEST_SAMPLES, max(long, 3 * FEWEST_SAMPLES), smooth.size - 1 - peak
    down = smooth[peak : peak + longest + 1] <= loading.level_N + 0.2 * (smooth[peak] - loading.level_N)
    length = max(min(int(np.argmax(down)) if down.any() else longest, longest, left), min(shortest, left))
    low, high = min(depart, peak + 1) - loading.lag, min(depart, peak + 1) + 2
    candidates = [_resolved(time_s, force, (max(low - long, 0), low, high, high + length), noise)]
    if not (candidates[0] and candidates[0].fits) and not low <= peak < high:
        around = (max(peak - long, 0), peak - 2, peak + 2, peak + length)
        candidates.append(_resolved(time_s, force, around, noise))
    sharp = min((a for a in candidates if a), key=lambda a: a.chi2_red, default=None)
    half = max(length // 2, 2)
    rounded = rounded_apex(time_s, force, peak, half, noise)
    if sharp and (sharp.fits or rounded.chi2_red > _CLEARLY_ROUNDED * sharp.chi2_red):
        return _with_rough_rise(with_shape_left_open(sharp, time_s, force, peak, half, noise), loading)
    return _with_rough_rise(rounded, loading)


def _with_rough_rise(apex: Apex, loading: Loading) -> Apex:
    """An apex whose uncertainty is that of noise as the rise shows it, correlated and as large as it is at the peak.

    The fit counts noise that is alike all along and not correlated.
    """
    counted = loading.signal.noise_N * math.sqrt(max(apex.chi2_red, 1.0))
    if not (math.isfinite(counted) and counted > 0):
        return apex
    share = (apex.u_N / counted) ** 2  # of the variance of a sample that the fit leaves
    left = min(share * loading.correlated, max(share, 1.0))
    return replace(apex, u_N=max(apex.u_N, loading.rough_N * math.sqrt(left)))


def with_peak_near(loading: Loading, peak_s: float) -> Loading:
    """The loading of a pull whose static peak a person saw: it is looked for within two samples of that time."""
    time = loading.signal.time_s
    top = min(max(int(np.searchsorted(time, peak_s)), FEWEST_SAMPLES), time.size - FEWEST_SAMPLES - 1)
    return replace(loading, depart=top, lag=2, top=top, end=max(loading.end, top + FEWEST_SAMPLES))


def _resolved(time_s: FloatArray, force: FloatArray, search: Search, noise: float) -> Apex | None:
    """Sharp apex within the search: on averaged samples where there are many, then finer while that tells more.

    The next search reaches three standard uncertainties in time (an averaged sample at the least) about the apex.
    """
    best: Apex | None = None
    factor = _samples_to_average(search)
    while True:
        start, low, high, end = search
        t, f = condense(time_s[start : end + 1], factor), condense(force[start : end + 1], factor)
        first, last, averaged = (low - start) // factor, (high - start) // factor + 1, noise / math.sqrt(factor)
        apex = sharp_apex(t, f, first, last, averaged)
        if apex is not None and not apex.fits and (skipped := _smooth_from(t, f, first, averaged)):
            apex = sharp_apex(t[skipped:], f[skipped:], first - skipped, last - skipped, averaged)
        if best is not None and (apex is None or apex.u_N > best.u_N):
            return best
        best = apex
        if best is None or factor == 1:
            return best
        around_s = (best.time_s - 3.0 * best.time_u_s, best.time_s + 3.0 * best.time_u_s)
        low, high = (int(k) + side * factor for k, side in zip(np.searchsorted(time_s, around_s), (-1, 1), strict=True))
        reach = _MOST_SAMPLES * max(1, (high - low) // _MOST_PAIRS) // 2
        search = (max(start, low - reach), low, high, min(end, high + reach))
        if _samples_to_average(search) > factor // 2:
            return best
        factor = _samples_to_average(search)


def _samples_to_average(search: Search) -> int:
    """Samples to average so that the pairs searched and the samples fitted stay few."""
    start, low, high, end = search
    return max(1, math.ceil((high - low) / _MOST_PAIRS), max(low - start, end - high) // _MOST_SAMPLES)


def _smooth_from(t: FloatArray, f: FloatArray, end: int, noise: float) -> int:
    """First sample of the longest stretch up to the apex that a parabola fits: all, half or a quarter of the rise."""
    first = 0
    for share in (1.0, 0.5, 0.25):
        first = round(end * (1.0 - share))
        if end - first <= _FEWEST_FOR_PARABOLA:
            return max(min(first, end - FEWEST_SAMPLES), 0)
        x = (t[first:end] - t[first]) / (t[end - 1] - t[first])
        basis = np.stack((np.ones_like(x), x, x * x))
        away = f[first:end] - np.linalg.solve(basis @ basis.T, basis @ f[first:end]) @ basis
        if float(away @ away) < 2.0 * noise**2 * (end - first):
            break
    return first


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
    t: FloatArray, force: FloatArray, at: FloatArray, rise: Side, fall: Side, noise: float, origin: float
) -> Apex | None:
    """Mean and spread of the apex over all positions and falls, each by its likelihood (see :func:`sharp_apex`)."""
    (rise_N, rise_variance, rise_misfit), (fall_N, fall_variance, fall_misfit) = rise, fall
    both = rise_variance + fall_variance
    apart = rise_N - fall_N
    misfit = rise_misfit + fall_misfit
    meeting = misfit + apart**2 / both
    best = float(meeting.min())
    if not math.isfinite(best):
        return None
    chi2_red = best / noise**2 / max(t.size - 6, 1)
    scale = noise**2 * max(chi2_red, 1.0)
    possible = np.maximum(rise_N - float(force[-3:].mean()), noise)
    occam = np.minimum(np.sqrt(2.0 * math.pi * scale * both) / possible, 1.0)
    occam[-1] = 0.0  # without a fall there is no drop to begin it
    sudden = np.where(apart > 0, occam * np.exp((best - misfit) / (2.0 * scale)), 0.0).sum(axis=0)  # (J, S)
    smooth = np.exp((best - meeting) / (2.0 * scale))
    total = float(smooth.sum() + sudden.sum())
    met = (rise_N * fall_variance + fall_N * rise_variance) / both
    height = (np.vdot(smooth, met) + np.vdot(sudden, rise_N)) / total
    variance = (
        np.vdot(smooth, scale * rise_variance * fall_variance / both + (met - height) ** 2)
        + np.vdot(sudden, scale * rise_variance + (rise_N - height) ** 2)
    ) / total
    weight = smooth.sum(axis=0) + sudden
    when = float(np.vdot(weight, at)) / total
    when_u = math.sqrt(float(np.vdot(weight, (at - when) ** 2)) / total)
    return Apex(when + origin, when_u, float(height), math.sqrt(variance), chi2_red, "sharp")


def _rise_side(t: FloatArray, f: FloatArray, before: FloatArray, at: FloatArray) -> Side:
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
    return value, ((basis @ inverse) * basis).sum(axis=-1), misfit[:, None]


def _fall_side(t: FloatArray, f: FloatArray, after: FloatArray, at: FloatArray, shares: FloatArray) -> Side:
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
    return value, (1.0 / n)[:, None] + away * away / spread[:, :, None], misfit[:, :, None]


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


def _parabola_top(time_s: FloatArray, force: FloatArray, peak: int, half: int, noise: float) -> Apex:
    low, high = max(peak - half, 0), min(peak + half, force.size - 1)
    t, f = time_s[low : high + 1] - time_s[peak], force[low : high + 1]
    reach = max(-float(t[0]), float(t[-1]))
    if t.size < FEWEST_SAMPLES or reach <= 0:
        return Apex(float(time_s[peak]), reach, float(f.mean()), noise / math.sqrt(t.size), math.inf, "rounded")
    x = t / reach
    basis = np.array((np.ones_like(x), x, x * x))
    try:
        inverse = np.linalg.inv(basis @ basis.T)
    except np.linalg.LinAlgError:  # samples share their times
        inverse = np.linalg.pinv(basis @ basis.T)
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


@dataclass(frozen=True)
class Motion:
    """A pull in motion; arrays (n,) share the trace's samples, ``force_N`` is zeroed and free of impulses.

    ``sliding`` is the range of indices after the static peak and before any unloading; ``travel_m`` the distance since
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
    noise_N: float
    problems: tuple[Problem, ...]
    rough_N: float = 0.0  # noise of a sample at the peak where the rise shows more


def in_motion(loading: Loading, apex: Apex, speed_m_s: float | None = None) -> Motion:
    """A pull once it moves: how far it has come, always counted forward, and between which samples it slides."""
    signal, onset_s, x = loading.signal, loading.onset_s, loading.signal.displacement_m
    travel = None if speed_m_s is None else np.asarray(speed_m_s * (signal.time_s - onset_s))
    if x is not None:
        away = x - float(np.interp(onset_s, signal.time_s, x))
        travel = np.asarray(np.where(away[-1] < 0, -1.0, 1.0) * away)
    first = int(np.searchsorted(signal.time_s, apex.time_s, side="right"))
    return Motion(
        signal.time_s, signal.force_N, signal.smooth_N, travel, loading.zero, loading.rise, onset_s, apex,
        (first, loading.end), signal.noise_N, signal.problems, loading.rough_N,
    )  # fmt: skip


def static_readings(motion: Motion, end: int) -> tuple[float, float, float]:
    """First maximum, highest force and force before the first drop up to the sample ``end``, in N above zero.

    The drive stops there, or the record ends. NaN where there is none.
    """
    onset = int(np.searchsorted(motion.time_s, motion.onset_s))
    force = motion.smooth_N[onset:end]
    first = motion.apex.force_N
    if force.size < _FEWEST_READ:
        return first, math.nan, math.nan
    at = int(np.searchsorted(motion.time_s, motion.apex.time_s)) - onset

    def one_of(index: int) -> float:
        """The first maximum where a maximum is the same one or lies below it, else its own force."""
        own = float(force[index])
        return first if abs(index - at) <= _SAME or (index > at and own < first) else own

    later = float(np.median(force[-max(int(_LATER * force.size), 1) :]))
    top = int(np.argmax(force))
    highest = one_of(top) if float(force[top]) - later > _PEAKED * motion.noise_N else math.nan
    so_far = np.maximum.accumulate(force)
    fallen = so_far - force > np.maximum(DROP * so_far, _PEAKED * motion.noise_N)
    fallen &= so_far > _HIGH * float(force.max())
    drop = one_of(int(np.argmax(force[: int(np.argmax(fallen)) + 1]))) if fallen.any() else math.nan
    return first, highest, drop


def left_open_N(readings: tuple[float, float, float], chosen: Apex) -> float:
    """Standard uncertainty that the difference of three readings leaves (GUM type B), 0 where they agree."""
    widest = max((abs(x - chosen.force_N) for x in readings if math.isfinite(x)), default=0.0)
    clear = widest > max(_CLEARLY * abs(chosen.force_N), _BEYOND_U * math.hypot(chosen.u_N, chosen.shape_u_N))
    return widest / math.sqrt(3.0) if clear else 0.0


def within_samples(motion: Motion, apex: Apex) -> Apex:
    """A peak no higher than its samples and their noise allow; what is cut off stays in the uncertainty.

    Where samples resolve the rise, a corner between two of them may lie above both by what the force rises in between.
    """
    around = np.abs(motion.time_s - apex.time_s)
    near_it = motion.force_N[np.argsort(around, kind="stable")[:_FEWEST_READ]]
    step_s = float(np.median(np.diff(motion.time_s)))
    between = _STEPS * motion.rise.rate * step_s if motion.rise.last - motion.rise.first >= _RESOLVED else 0.0
    highest = float(near_it.max())
    if not apex.force_N > highest + _NOISE_AT_TOP * motion.noise_N + between:
        return apex
    missed = max(apex.force_N - highest, motion.rise.rate * step_s / 2.0)
    u_N = math.hypot(max(motion.noise_N, motion.rough_N), missed / math.sqrt(3.0))
    return Apex(apex.time_s, apex.time_u_s, highest, u_N, apex.chi2_red, "highest sample")
