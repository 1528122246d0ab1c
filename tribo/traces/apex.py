"""The apex of a static peak: shapes fitted in closed form, below the resolution of the samples."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from tribo.records import FloatArray
from tribo.traces.noise import mean

FEWEST_SAMPLES = 4
_FEWEST_FOR_PARABOLA = 8
_POSITIONS = np.linspace(0.0, 1.0, 9)  # of the apex between two samples
_FALL_TIMES = np.append(np.geomspace(0.1, 2.0, 8), math.inf)  # as shares of the time looked at
_MORE_FALL_TIMES = np.append(np.geomspace(0.1, 2.0, 24), math.inf)
_MANY = 200  # samples from which on a fit tells the finer series apart
_CLOSEST = 2  # samples on either side of a top that tell a parabola
_FITS = 1.5  # misfit per degree of freedom up to which a parabola fits


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
        return Apex(float(time_s[peak]), reach, mean(f), noise / math.sqrt(t.size), math.inf, "rounded")
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
