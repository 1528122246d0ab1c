"""The phases of a record, by its channels and its force, and where a record of several pulls is cut.

:func:`course_of` tells when the bodies touch, when the drive moves, stops and goes on; :func:`split_pulls` cuts a
record at reversals of the force and at steps of load or speed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tribo.records import FloatArray, Trace
from tribo.traces.loading import starting_level
from tribo.traces.signal import (
    MINIMUM_SAMPLES,
    Signal,
    line,
    median_of_three,
    noise_of,
    running_mean,
    runs_of,
    sample_noise,
    wander,
)

Mask = NDArray[np.bool_]
Range = tuple[int, int]

_FLAT_START = 0.02  # share of a record that shows the load before contact, if there is such a part
_LEVEL = 0.1  # share of the swing of a load within which it counts as level, and above which the bodies touch
_UNLOADED = 0.2  # an unloaded level lies below this share of the load later on
_AT_REST = 0.05  # share of the usual speed below which the drive stands still
_ONE_WAY = 0.5  # net over total displacement from which on a displacement channel shows the travel
_FEWEST_AT_REST = 5
_FALLEN = 0.5  # share of the sliding force below which a force has fallen, where nothing but the force tells of a stop
_AT_BOTTOM = 0.35  # share of the depth of a fall near its lowest force, in which a stop spends most of its time
_SHORTEST_STOP = 0.005  # share of a record that a stop lasts at least, where nothing but the force tells of it
_MOST_STOPS = 50
_RESOLVED = 4  # samples of the middle half of a rise from which on its slope is told
_AS_STEEP = 0.4  # a restart is at least this share as steep as the first rise
_SLOW_FALL = 3.0  # a force relaxes while the drive stands still for at least this many times the time of the next rise
_DWELLS = 0.05  # share of the samples of a fall that lie at a level at which the force dwells
_RESTART = 0.05  # share of the force by which it rises at a restart
_RETURNS = 0.02  # share of the later part of a record that lies below the force it begins with if it began in motion
_UNPULLED = 0.3  # share of the usual force below which a record begins with nothing pulled
_NEAR = 0.1  # share of its swing below the lowest later force from which on a record begins at rest
_FELT = 12.0  # a friction force is at least this many times the noise
_REVERSED = 0.25  # share of its swing by which a force passes the middle before its direction counts as reversed
_OF_SPAN = 0.2  # a step is at least this share of the span of its channel,
_OF_LEVEL = 0.05  # this share of its level,
_OF_NOISE = 6.0  # and this many times the noise of the difference
_FRAGMENT = 0.2  # share of the median piece below which a piece is what a cut left over
_MIDDLE = (0.3, 0.7)  # share of a stroke in which its force is taken to tell its direction and zero


@dataclass(frozen=True)
class Course:
    """How a record runs, as indices of its samples.

    ``contact`` is the range in which the bodies touch, ``stops`` the (stop, restart) of the drive within it, ``end``
    where the drive stops for good or contact ends. ``rests`` are the ranges in which nothing pulls: the drive stands
    still, or the bodies are apart. ``starts_sliding`` says that the record has no start from rest.
    """

    contact: Range
    end: int
    stops: tuple[Range, ...]
    rests: tuple[Range, ...]
    starts_sliding: bool

    @property
    def begins_before_contact(self) -> bool:
        """Whether the record begins before contact, by its load."""
        return self.contact[0] > 0

    @property
    def pieces(self) -> tuple[Range, ...]:
        """The ranges of motion: from contact or a stop to the next stop or the end."""
        starts = (self.contact[0], *(stop for stop, _ in self.stops))
        ends = (*(stop for stop, _ in self.stops), self.end)
        return tuple(zip(starts, ends, strict=True))


def course_of(trace: Trace, signal: Signal) -> Course:
    """The course of a record by its load, its speed or displacement, and its force."""
    samples = signal.time_s.size
    contact = _contact(trace.columns.get("normal_force_N"), samples)
    moving = _moving(trace)
    begins_at_rest = moving is None or not moving[: _FEWEST_AT_REST * 2].all()
    rests: list[Range] = []
    if moving is None:
        stops, end = force_stops(signal, contact, in_motion=_returns(signal, contact)), contact[1]
    else:
        stops, end, rests = _drive_stops(moving, contact)
    rests += [(a, b) for a, b in ((0, contact[0]), (contact[1], samples)) if b - a >= _FEWEST_AT_REST]
    first_end = stops[0][0] if stops else end
    in_motion = contact[0] > 0 and moving is not None and bool(moving[max(contact[0] - 2, 0) : contact[0] + 2].all())
    at_once = in_motion or (not begins_at_rest and contact[0] == 0 and _returns(signal, (contact[0], first_end)))
    at_once = at_once or (moving is None and _returns(signal, (contact[0], first_end)))
    return Course(contact, end, tuple(stops), tuple(sorted(rests)), at_once)


def _contact(load: FloatArray | None, samples: int) -> Range:
    """Range in which the bodies touch, by a load that is level and low before it; else the whole record."""
    whole = (0, samples)
    first = max(int(samples * _FLAT_START), _FEWEST_AT_REST)
    if load is None or first * 4 > samples or not np.isfinite(load).all():
        return whole
    low, high = np.percentile(load, (5.0, 95.0))
    load = median_of_three(load if abs(high) >= abs(low) else -load)
    before, high = float(np.median(load[:first])), float(np.percentile(load, 95))
    swing = high - before
    if before > _UNLOADED * high or float(np.ptp(np.percentile(load[:first], (5.0, 95.0)))) > _LEVEL * swing:
        return whole
    touching = np.flatnonzero(running_mean(load, _FEWEST_AT_REST) > before + _LEVEL * swing)
    if touching.size == 0:
        return whole
    end = int(touching[-1]) + 1
    return int(touching[0]), end if samples - end >= _FEWEST_AT_REST else samples


def _moving(trace: Trace) -> Mask | None:
    """Where the drive moves, by a recorded speed or rotation, else by a displacement that goes one way; else None."""
    speed = trace.columns.get("speed_m_s", trace.columns.get("rotation_rev_per_s"))
    if speed is not None and np.isfinite(speed).all() and np.any(speed):
        pace = np.abs(median_of_three(speed))
        return pace > _AT_REST * float(np.percentile(pace, 95))
    x = trace.displacement_m
    if x is None or not np.isfinite(x).all() or x.size < 4 * _FEWEST_AT_REST:
        return None
    width = max(_FEWEST_AT_REST, x.size // 500)
    smooth = running_mean(x, width)
    path = float(np.abs(np.diff(smooth[::width])).sum())
    if path <= 0 or abs(float(smooth[-1] - smooth[0])) < _ONE_WAY * path:
        return None
    ahead, behind = np.minimum(np.arange(x.size) + width, x.size - 1), np.maximum(np.arange(x.size) - width, 0)
    spent = np.maximum(trace.time_s[ahead] - trace.time_s[behind], 1e-300)
    pace = np.abs(smooth[ahead] - smooth[behind]) / spent
    return np.asarray(pace > _AT_REST * float(np.percentile(pace, 75)))


def _drive_stops(moving: Mask, contact: Range) -> tuple[list[Range], int, list[Range]]:
    """Stops of the drive while the bodies touch, where motion ends for good, and all ranges at rest."""
    rests = [(int(a), int(b)) for a, b in zip(*runs_of(~moving), strict=True) if b - a >= _FEWEST_AT_REST]
    if not moving.any():
        return [], contact[1], []
    first, last = int(np.argmax(moving)), int(np.flatnonzero(moving)[-1])
    stops = [(a, b) for a, b in rests if max(first, contact[0]) < a and b < min(last, contact[1])]
    after = moving.size - last - 1
    return stops, min(contact[1], last + 1) if after >= _FEWEST_AT_REST else contact[1], rests


def force_stops(signal: Signal, contact: Range, *, in_motion: bool) -> list[Range]:
    """Stops that only the force shows: it falls and stays low, or relaxes slowly, and then rises as at a start.

    A slip is none of them: after it the force rises for most of the time. A record that begins ``in_motion`` shows no
    first rise to compare with; only a fall to a low level is a stop there.
    """
    first, last = contact
    force = signal.smooth_N[first:last]
    height = force if in_motion else force - starting_level(force)
    if height.size < 20 * _FEWEST_AT_REST or float(height.max()) < _FELT * signal.noise_N:
        return []
    top = float(np.percentile(height, 90))
    dips = [
        (int(a), int(b)) for a, b in zip(*runs_of(height < _FALLEN * top), strict=True) if a > 0 and b < height.size
    ]
    stops = [stop for dip in dips if (stop := _stop_in(height, dip))]
    if not stops and not in_motion:
        stops = _relaxations(signal.time_s[first:last], height, top, signal.noise_N)
    return [(first + a, first + b) for a, b in stops] if len(stops) <= _MOST_STOPS else []


def _stop_in(height: FloatArray, dip: Range) -> Range | None:
    """A dip of the force as a stop, up to its rise, if the force spends most of the dip near its bottom; else None."""
    inside = height[dip[0] : dip[1]]
    edge, bottom = float(max(inside[0], inside[-1])), float(np.percentile(inside, 5))
    near = np.flatnonzero(inside <= bottom + _AT_BOTTOM * (edge - bottom))
    if inside.size < max(2 * _FEWEST_AT_REST, _SHORTEST_STOP * height.size) or near.size <= inside.size / 2:
        return None
    low = np.flatnonzero(inside <= bottom + _AT_BOTTOM / 2 * (edge - bottom))
    return dip[0], dip[0] + int(low[-1]) + 1


def _relaxations(time_s: FloatArray, height: FloatArray, top: float, noise: float) -> list[Range]:
    """Slow falls of the force, each followed by a rise about as steep as the first one."""
    turns = turning_points(height, max(_RESTART * top, _FELT * noise))
    peaks, troughs = turns
    if peaks.size < 2 or troughs.size == 0:
        return []
    first_pace, resolved = _pace(time_s, height, 0, int(peaks[0]))
    if not resolved:
        return []
    found = []
    for peak, trough, after in zip(peaks, troughs, peaks[1:], strict=False):
        rise_s, fall_s = float(time_s[after] - time_s[trough]), float(time_s[trough] - time_s[peak])
        pace, resolved = _pace(time_s, height, int(trough), int(after))
        if resolved and pace > _AS_STEEP * first_pace and fall_s > _SLOW_FALL * rise_s:
            found.append((_relaxes_from(height, int(peak), int(trough), noise), int(trough)))
    return found


def _pace(time_s: FloatArray, height: FloatArray, start: int, end: int) -> tuple[float, bool]:
    """Slope of the middle half of a rise, and whether samples resolve it."""
    low = height[start] + 0.25 * (height[end] - height[start])
    high = height[start] + 0.75 * (height[end] - height[start])
    part = height[start : end + 1]
    a = start + int(np.flatnonzero(part <= low)[-1]) if (part <= low).any() else start
    b = start + int(np.argmax(part >= high))
    return (line(time_s[a : b + 1], height[a : b + 1])[0] if b > a else float("inf")), b - a >= _RESOLVED


def _relaxes_from(height: FloatArray, peak: int, trough: int, noise: float) -> int:
    """Index at which the slide after a peak ends and the force relaxes: the last at the highest level it dwells at."""
    fall = running_mean(height[peak:trough], _FEWEST_AT_REST)
    width = max(3.0 * noise, 0.005 * float(np.ptp(fall)), 1e-300)
    bins = np.floor((fall - fall.min()) / width).astype(int)
    share = np.bincount(bins) / bins.size
    dwells = np.flatnonzero(share > _DWELLS)
    if dwells.size == 0:
        return max(trough - 1, peak + 1)
    level = float(np.median(fall[bins == dwells[-1]]))
    return peak + int(np.flatnonzero(fall >= level - width)[-1]) + 1


def turning_points(force: FloatArray, least: float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Indices of the maxima and minima between which a force goes back and forth by at least ``least``.

    The first turning point is a maximum; equal heights count once, unlike prominences of ties.
    """
    peaks: list[int] = []
    troughs: list[int] = []
    extreme, at, rising = -np.inf, 0, True
    values = force.tolist()
    for k, value in enumerate(values):
        if rising:
            if value > extreme:
                extreme, at = value, k
            elif extreme - value >= least:
                peaks.append(at)
                extreme, at, rising = value, k, False
        elif value < extreme:
            extreme, at = value, k
        elif value - extreme >= least:
            troughs.append(at)
            extreme, at, rising = value, k, True
    return np.array(peaks, int), np.array(troughs, int)


def _returns(signal: Signal, span: Range) -> bool:
    """Whether a record begins at a force that it comes back to, or falls from: it then slides from its first sample."""
    force = signal.smooth_N[span[0] : span[1]]
    if force.size < 4 * _FEWEST_AT_REST:
        return False
    begin = signal.force_N[span[0] : span[0] + _FEWEST_AT_REST]
    start = min(float(np.median(begin)), float(np.median(begin[:3])), key=abs)
    later = force[force.size // 4 :]
    if np.median(later) < 0:
        later, start = -later, -start
    high = np.flatnonzero(later > _FALLEN * float(np.median(later)))
    later = later[: int(high[-1]) + 1] if high.size else later  # without a tail in which the force has fallen for good
    felt = float(np.median(later)) > _FELT * max(signal.noise_N, noise_of(later))
    low, high = np.quantile(later, (_RETURNS, 1.0 - _RETURNS))
    in_range = start >= low - _NEAR * (high - low) - 2.0 * signal.noise_N
    return bool(felt and in_range and start > _UNPULLED * float(np.median(later)))


def split_pulls(trace: Trace) -> tuple[Trace, ...]:
    """Split a record where a new pull begins: at a reversal of the force, a step of the load, a step of the speed.

    Load and speed are taken from ``columns`` ("normal_force_N", "speed_m_s"). The transition from one steady load or
    speed to the next belongs to no pull. A start from rest is not a step: the data before it give the zero. A record
    without any of these is returned unchanged. Pieces are named ``name/1``, ``name/2``; those under twenty samples or
    a fifth of the median are left out.
    """
    cuts = [(k, k) for k in reversals(trace.force_N)]
    if (load := trace.columns.get("normal_force_N")) is not None:
        cuts += steps(load)
    if (speed := trace.columns.get("speed_m_s")) is not None:
        moving = np.abs(speed)
        rest = _AT_REST * float(moving.max())
        cuts += [(a, b) for a, b in steps(moving) if moving[max(a - 1, 0)] > rest]
    if not cuts:
        return (trace,)
    stretches = [(a, b) for a, b in between(cuts, trace.time_s.size) if b - a >= MINIMUM_SAMPLES]
    if speed is not None:
        stretches = [(a, b) for a, b in stretches if (moving[a:b] > rest).any()] or stretches
    shortest = _FRAGMENT * float(np.median([b - a for a, b in stretches])) if stretches else 0.0
    kept = [(a, b) for a, b in stretches if b - a >= shortest] or [(0, trace.time_s.size)]
    return tuple(piece_of(trace, a, b, f"{trace.name}/{k}") for k, (a, b) in enumerate(kept, start=1))


def piece_of(trace: Trace, start: int, end: int, name: str) -> Trace:
    """The samples ``start`` to ``end`` of a trace as a trace of their own."""
    part = slice(start, end)
    return replace(
        trace,
        name=name,
        time_s=trace.time_s[part],
        force_N=trace.force_N[part],
        displacement_m=None if trace.displacement_m is None else trace.displacement_m[part],
        columns={quantity: values[part] for quantity, values in trace.columns.items()},
        first_row=trace.first_row + start,
    )


def reversals(force_N: FloatArray) -> list[int]:
    """Indices at which the pull changes direction: the force passes from one side of its middle to the other.

    The middle lies half-way between the 5th and 95th percentile; it counts as passed once the force is a quarter of
    their distance beyond it. A force that has only one sign, or hardly leaves zero on the other side, is not reversed.
    """
    if -float(force_N.min()) < _REVERSED * float(np.median(force_N)):
        return []  # as below, without the percentiles, which take longer
    low, high = np.percentile(force_N, (5.0, 95.0))
    if min(high, -low) < _REVERSED * max(high, -low):
        return []
    middle, swing = (high + low) / 2.0, (high - low) / 2.0
    calm = median_of_three(force_N)
    side = np.where(calm > middle + _REVERSED * swing, 1, np.where(calm < middle - _REVERSED * swing, -1, 0))
    decided = np.flatnonzero(side)
    changed = np.flatnonzero(np.diff(side[decided]))
    before, after = decided[changed], decided[changed + 1]
    return [
        int(a) + 1 + int(np.argmin(np.abs(force_N[a + 1 : b + 1] - middle))) for a, b in zip(before, after, strict=True)
    ]


def steps(values: FloatArray) -> list[tuple[int, int]]:
    """(end of the old level, start of the new one) wherever a channel steps or ramps from one level to another.

    The means before and after every sample are compared, over a hundredth of the record (five samples at the least) for
    sharp steps, then between those over a twenty-fifth for slow ramps. A step is at least 20 % of the channel's span,
    5 % of its level, and six times the noise of such a difference and what is typical of it.
    """
    n = values.size
    found: list[tuple[int, int]] = []
    for width, sharp in ((max(5, n // 100), True), (max(5, n // 25), False)):
        span = float(np.ptp(np.percentile(running_mean(values, width), (1.0, 99.0)))) if n else 0.0
        least = max(_OF_SPAN * span, _OF_LEVEL * float(np.abs(values).max(initial=0.0)))
        found += [
            (start + a, start + b)
            for start, end in between(found, n)
            for a, b in _steps_over(values[start:end], width, least, sharp)
        ]
    return sorted(found)


def between(passages: Sequence[tuple[int, int]], samples: int) -> list[tuple[int, int]]:
    """What passages leave of a record, as (start, end) of every stretch."""
    ordered = sorted(passages)
    return list(zip([0, *(b for _, b in ordered)], [*(a for a, _ in ordered), samples], strict=True))


def _steps_over(values: FloatArray, width: int, least: float, sharp: bool) -> list[tuple[int, int]]:
    """Steps of one stretch as means over ``width`` samples show them; a ``sharp`` one is a cut, a ramp is left out.

    The means before and after each sample are compared; at the ends the first and last mean are repeated.
    """
    if values.size < 4 * width:
        return []
    total = np.concatenate(([0.0], np.cumsum(values)))
    means = (total[width:] - total[:-width]) / width
    index = np.arange(values.size)
    before, after = means[np.clip(index - width, 0, means.size - 1)], means[np.clip(index, 0, means.size - 1)]
    jump = np.abs(after - before)
    noise = max(sample_noise(values) * math.sqrt(2.0 / width), float(np.median(jump)))
    found = []
    for a, b in (map(int, run) for run in zip(*runs_of(jump > max(least, _OF_NOISE * noise)), strict=True)):
        steepest = a + int(np.argmax(jump[a:b]))
        found.append((steepest, steepest) if sharp and b - a <= 2 * width else (a, b))
    return found


def directions_of(
    pieces: Sequence[Trace], zeros_N: Sequence[float]
) -> tuple[tuple[int, ...], tuple[float, float] | None]:
    """The direction of each piece, 1 or -1, and the zero (N, standard uncertainty) that strokes both ways share.

    The force of a piece is its mean over the middle (30 to 70 %) above a zero that is known, else above none. Strokes
    go both ways where these forces have both signs; the direction is then the side of their midpoint. Friction is
    assumed equal in both directions, so the zero is half the sum of the means of the two; its uncertainty comes from
    their scatter, or from within strokes. None where all pieces go one way.
    """
    middles = []
    for piece in pieces:
        start, end = (int(share * piece.force_N.size) for share in _MIDDLE)
        middles.append(piece.force_N[start : max(end, start + 1)])
    forces = np.array([float(f.mean()) for f in middles]) - np.array(zeros_N)
    if not forces.min() < 0 < forces.max():
        return tuple(-1 if force < 0 else 1 for force in forces), None
    u = np.array([wander(f, 1.0)[0] for f in middles])
    side = np.where(forces >= (forces.max() + forces.min()) / 2.0, 1, -1)
    means, us = [], []
    for sign in (1, -1):
        mine = side == sign
        count = int(mine.sum())
        means.append(float(forces[mine].mean()))
        scatter = float(forces[mine].std(ddof=1)) / math.sqrt(count) if count > 1 else 0.0
        us.append(max(scatter, float(np.sqrt((u[mine] ** 2).sum())) / count))
    return tuple(int(s) for s in side), (sum(means) / 2.0, math.hypot(*us) / 2.0)
