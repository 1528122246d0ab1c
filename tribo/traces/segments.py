"""Records of several pulls: strokes in both directions, steps of load or speed; split and brought to one sign."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tribo.display import displayed
from tribo.errors import Problem, TraceError
from tribo.records import FloatArray, Trace
from tribo.traces.noise import median_of_three, running_mean, sample_noise, wander
from tribo.traces.signal import MINIMUM_SAMPLES

_REVERSED = 0.25  # share of its swing by which a force passes the middle before its direction counts as reversed
_OF_SPAN = 0.2  # a step is at least this share of the span of its channel,
_OF_LEVEL = 0.05  # this share of its level,
_OF_NOISE = 6.0  # and this many times the noise of the difference
_AT_REST = 0.05  # share of the largest speed below which nothing moves
_FRAGMENT = 0.2  # share of the median piece below which a piece is what a cut left over
_MIDDLE = (0.3, 0.7)  # share of a stroke in which its force is taken to tell its direction and zero


@displayed()
@dataclass(frozen=True)
class Strokes:
    """Strokes with a common zero: each trace has positive friction and its zero subtracted.

    ``zero_N`` is the offset determined from their asymmetry: half the sum of the force in the two directions, with its
    standard uncertainty; NaN where all strokes have the same direction; then nothing is subtracted.
    ``directions`` are +1 and -1, the sign of the recorded force.
    """

    traces: tuple[Trace, ...]
    directions: tuple[int, ...]
    zero_N: float
    zero_u_N: float


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
    """Steps of one stretch as means over ``width`` samples show them; a ``sharp`` one is a cut, a ramp is left out."""
    if values.size < 4 * width:
        return []
    before, after = _means_beside(values, width)
    jump = np.abs(after - before)
    noise = max(sample_noise(values) * math.sqrt(2.0 / width), float(np.median(jump)))
    over = np.concatenate(([False], jump > max(least, _OF_NOISE * noise), [False]))
    edges = np.flatnonzero(np.diff(over))
    passages = [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    return [_cut(jump, a, b) if sharp and b - a <= 2 * width else (a, b) for a, b in passages]


def _means_beside(values: FloatArray, width: int) -> tuple[FloatArray, FloatArray]:
    """Means of the ``width`` samples before and from each sample on; the ends repeat the first and last mean."""
    total = np.concatenate(([0.0], np.cumsum(values)))
    means = (total[width:] - total[:-width]) / width
    index = np.arange(values.size)
    return means[np.clip(index - width, 0, means.size - 1)], means[np.clip(index, 0, means.size - 1)]


def _cut(jump: FloatArray, start: int, end: int) -> tuple[int, int]:
    """A passage of no length where the step is steepest."""
    at = start + int(np.argmax(jump[start:end]))
    return at, at


def orient_strokes(strokes: Sequence[Trace]) -> Strokes:
    """Convert strokes in both directions to pulls of one sign and subtract their common zero.

    The force of a stroke is its mean over the middle (30 to 70 %); its direction is the side of the midpoint
    of all strokes on which it lies. Friction is assumed equal in both directions, so the zero is half the sum.

    Raises
    ------
    TraceError
        ``no_strokes``: nothing is given.
    """
    if not strokes:
        raise TraceError(Problem("no_strokes", "no strokes are given"))
    middles = [_middle(stroke) for stroke in strokes]
    forces = np.array([float(f.mean()) for f in middles])
    u = np.array([wander(f, 1.0).mean_u for f in middles])
    both = bool(forces.min() < 0 < forces.max())
    side = np.where(forces >= (forces.max() + forces.min()) / 2.0, 1, -1) if both else np.sign(forces).astype(int)
    zero, zero_u = _asymmetry(forces, u, side) if both else (math.nan, math.nan)
    offset = zero if both else 0.0
    turned = tuple(
        replace(stroke, force_N=sign * (stroke.force_N - offset)) for stroke, sign in zip(strokes, side, strict=True)
    )
    return Strokes(turned, tuple(int(s) for s in side), zero, zero_u)


def _middle(stroke: Trace) -> FloatArray:
    start, end = (int(share * stroke.force_N.size) for share in _MIDDLE)
    return stroke.force_N[start : max(end, start + 1)]


def _asymmetry(forces: FloatArray, u: FloatArray, side: FloatArray) -> tuple[float, float]:
    """Half the sum of the mean force of the two directions; its uncertainty from their scatter, or within strokes."""
    means, us = [], []
    for sign in (1, -1):
        mine = side == sign
        count = int(mine.sum())
        means.append(float(forces[mine].mean()))
        scatter = float(forces[mine].std(ddof=1)) / math.sqrt(count) if count > 1 else 0.0
        us.append(max(scatter, float(np.sqrt((u[mine] ** 2).sum())) / count))
    return sum(means) / 2.0, math.hypot(*us) / 2.0
