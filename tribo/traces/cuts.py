"""Where a record of several pulls is cut: reversals of the force, steps of load or speed; directions of pieces."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from tribo.records import FloatArray, Trace
from tribo.traces.drive import DriveMotion, at_rest_below, drive_of, level_cuts, load_as_set, speed_cuts, stroke_end
from tribo.traces.signal import MINIMUM_SAMPLES, median_of_three, running_mean, runs_of, sample_noise, wander

_AT_REST = 0.05  # share of the usual speed below which the drive stands still
_REVERSED = 0.25  # share of its swing by which a force passes the middle before its direction counts as reversed
_OF_SPAN = 0.2  # a step is at least this share of the span of its channel,
_OF_LEVEL = 0.05  # this share of its level,
_OF_NOISE = 6.0  # and this many times the noise of the difference
_AT_REST_AS_ROUGH = 0.5  # share of the noise of the other direction below which a force shows a rest and no stroke
_FRAGMENT = 0.2  # share of the median piece below which a piece is what a cut left over
_CLEARLY_APART = 1.25  # ratio of two speeds that the slope of a displacement tells apart
_MIDDLE = (0.3, 0.7)  # share of a stroke in which its force is taken to tell its direction and zero
_DWELLS = 0.5  # share of its motion for which a drive stands still that dwells at the end of a stroke
_NO_STROKE = 0.5  # share of the usual force below which a piece tells nothing of the zero
_BEFORE_DWELL = (0.6, 1.0)  # the same, as shares of its motion, of one that dwells at its end


def split_pulls(trace: Trace) -> tuple[Trace, ...]:
    """Split a record where a new pull begins: at a reversal of the force, a step of the load, a step of the speed.

    Load and speed are taken from ``columns`` ("normal_force_N", "speed_m_s"). The transition from one steady load or
    speed to the next belongs to no pull. A start from rest is not a step: the data before it give the zero. A record
    without any of these is returned unchanged. Pieces are named ``name/1``, ``name/2``; those under twenty samples or
    a fifth of the median are left out.
    """
    cuts = [(k, k) for k in reversals(trace.force_N)]
    load = trace.columns.get("normal_force_N")
    speed = trace.columns.get("speed_m_s", trace.columns.get("rotation_rev_per_s"))
    find = steps if cuts else _steps_or_levels
    if load is not None and np.isfinite(load).all():
        cuts += find(load_as_set(load, trace.force_N))
    speed = speed if speed is not None and np.isfinite(speed).all() else None
    if speed is not None:
        moving = np.abs(speed)
        rest = min(_AT_REST * float(moving.max()), at_rest_below(moving))
        cuts += [(a, b) for a, b in find(moving) if moving[max(a - 1, 0)] > rest]
    drive = drive_of(trace) if speed is None and not cuts else None
    if drive is not None and drive.channel == "displacement":
        cuts += _speeds_by_displacement(trace, drive)
    if not cuts:
        return (trace,)
    stretches = [(a, b) for a, b in between(cuts, trace.time_s.size) if b - a >= MINIMUM_SAMPLES]
    if speed is not None:
        slid = [(a, b) for a, b in stretches if np.count_nonzero(moving[a:b] > rest) >= MINIMUM_SAMPLES]
        stretches = slid or stretches
    shortest = _FRAGMENT * float(np.median([b - a for a, b in stretches])) if stretches else 0.0
    kept = [(a, b) for a, b in stretches if b - a >= shortest] or [(0, trace.time_s.size)]
    return tuple(piece_of(trace, a, b, f"{trace.name}/{k}") for k, (a, b) in enumerate(kept, start=1))


def _steps_or_levels(values: FloatArray) -> list[tuple[int, int]]:
    """The steps of a channel; those between its levels where it has more levels than large steps, as in a ladder."""
    large, every = steps(values), level_cuts(np.abs(values))
    return every if len(every) > len(large) else large


def _speeds_by_displacement(trace: Trace, drive: DriveMotion) -> list[tuple[int, int]]:
    """The steps between two speeds that differ clearly, as the slope of a displacement is rough."""
    pace, moving = np.abs(drive.pace), drive.moving
    found = speed_cuts(trace, drive, (0, pace.size))
    moves = [b > a and float(moving[a:b].mean()) > 0.5 for a, b in between(found, pace.size)]
    cuts = [cut for cut, (one, other) in zip(found, pairwise(moves), strict=True) if one and other]
    ends = [0, *(k for cut in cuts for k in cut), pace.size]
    levels = [float(np.median(pace[a:b])) for a, b in zip(ends[::2], ends[1::2], strict=True)]
    apart = [max(one, other) > _CLEARLY_APART * min(one, other) for one, other in pairwise(levels)]
    return [cut for cut, clear in zip(cuts, apart, strict=True) if clear]


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
    their distance beyond it. A force that has only one sign, or hardly leaves zero on the other side, is not reversed;
    nor is one that stands still below, as before and after a slide.
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
    if changed.size == 2 and side[decided[0]] < 0:  # a rest below zero before and after a slide is no stroke
        low, high = (sample_noise(force_N[side == way]) for way in (-1, 1))
        if low < _AT_REST_AS_ROUGH * high:
            return []
    if changed.size == 1:  # nor is one before it alone, where nothing moves the force
        first, other = (force_N[side == way] for way in (side[decided[0]], -side[decided[0]]))
        scatter = float(np.ptp(np.percentile(first, (5.0, 95.0)))) / 3.29  # standard deviations between them
        if scatter < _AT_REST_AS_ROUGH * sample_noise(other):
            return []
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
        size, stop = piece.force_N.size, stroke_end(piece)
        if stop is not None and size - stop > _DWELLS * stop:  # the force has come to its level late in the motion
            start, end = (int(share * stop) for share in _BEFORE_DWELL)
        else:
            start, end = (int(share * size) for share in _MIDDLE)
        middles.append(piece.force_N[start : max(end, start + 1)])
    forces = np.array([float(f.mean()) for f in middles]) - np.array(zeros_N)
    if not forces.min() < 0 < forces.max():
        return tuple(-1 if force < 0 else 1 for force in forces), None
    u = np.array([wander(f, 1.0)[0] for f in middles])
    middle = (forces.max() + forces.min()) / 2.0
    side, apart = np.where(forces >= middle, 1, -1), np.abs(forces - middle)
    slides = apart > _NO_STROKE * np.median(apart)  # not while the load is put on or taken off
    means, us = [], []
    for sign in (1, -1):
        mine = (side == sign) & slides
        mine = mine if mine.any() else side == sign
        count = int(mine.sum())
        means.append(float(forces[mine].mean()))
        scatter = float(forces[mine].std(ddof=1)) / math.sqrt(count) if count > 1 else 0.0
        us.append(max(scatter, float(np.sqrt((u[mine] ** 2).sum())) / count))
    return tuple(int(s) for s in side), (sum(means) / 2.0, math.hypot(*us) / 2.0)
