"""Stops of a drive that only the force tells of: bodies that slide make it rough, bodies that stand leave it smooth.

At a stop the force falls and is smooth. A spring that is drawn tight while its slider sticks is smooth as well, but
climbs all the time; a lull of a rough force stays at the level of the slide.
"""

from __future__ import annotations

import math

import numpy as np

from tribo.records import FloatArray
from tribo.traces.drive import FEWEST_AT_REST, Range
from tribo.traces.signal import running_mean, runs_of

_WIDTH = 21  # samples over which roughness is told at the least
_CONTRAST = 1.6  # ratio of the roughness while sliding to that at rest, at the least
_CLEAR = 2.2  # and where it tells by itself
_RISES = 4.0  # times the usual size of what is left of a force without its running mean, beyond which it is no noise
_FEWEST = 0.01  # share of the samples that are rough, and smooth
_SHORTEST = 0.004  # share of a record that a stop lasts at the least
_BELOW = 1.0  # times the scatter of a slide by which the force of a stop lies below it,
_FAR_BELOW = 3.0  # and where the contrast is poor
_LEVEL = 1.5  # and up to which a force is still at the level of the slide
_LOUD = 4.0  # times the scatter at rest by which a sample does not go on as those after it
_AHEAD = 5  # samples of each of the two means that say how a force goes on
_SURELY = 0.35  # share of the way from the roughness at rest to that of a slide below which a part stands still
_SETTLES = 0.25  # share of its whole fall by which a force still changes in the last third of a stop
_GAP = 4  # widths that a fall of the force at rest is felt at the most
_DWELLS = 0.4  # share of its rise that a stop dwells before the force climbs
_CLIMBS = 6.0  # times its scatter by which a force climbs at a restart
_MOST = 60


def standstills(force_N: FloatArray) -> tuple[list[Range], int] | None:
    """(stop, restart) of every stop of the drive within a force, and where it stops for good; None if nothing tells.

    The force begins at rest or while it slides; a first smooth part is no stop.
    """
    n = force_N.size
    width = max(_WIDTH, min(n // 400, 61)) | 1
    if n < 4 * width:
        return None
    force = force_N * (np.sign(float(np.median(force_N))) or 1.0)
    away = np.abs(force - running_mean(force, width))
    top = _RISES * float(np.median(away[away >= np.median(away)]))  # a rise or a slip is more than rough
    rough = np.log(np.maximum(running_mean(np.minimum(away, top), width), 1e-6 * max(top, 1e-300)))
    parted = _parted(rough)
    if parted is None:
        return None
    threshold, quiet, rest, slide = parted
    smooth = rough < threshold
    for a, b in zip(*runs_of(~smooth), strict=True):  # what is felt of a fall of the force at rest
        if 0 < a < b < n and b - a <= _GAP * width:
            before, after = force[max(a - width, 0) : a], force[b : b + 2 * width]
            smooth[a:b] |= float(np.median(after)) <= float(np.median(before)) + _LOUD * rest
    least = max(int(_SHORTEST * n), width)
    below = _BELOW if slide > _CLEAR * rest else _FAR_BELOW
    slid, stops, end, calm = 0, [], n, 0
    for a, b in zip(*runs_of(smooth), strict=True):
        if b - a < least or not (~smooth[:a]).any() or float(np.median(rough[a:b])) > quiet:
            continue
        before = force[max(slid, a - 12 * width) : max(a - width // 2, slid + 1)]
        if before.size < FEWEST_AT_REST:
            continue
        calm += 1
        level, scatter = float(np.median(before)), max(float(before.std()), slide)
        stop = _stop(force, int(a), int(b), width, level - _LEVEL * scatter, rest)
        restart = _restart(force, stop, min(int(b) + 2 * width, n), rest)
        if restart - stop < max(least // 2, 1) or float(np.median(force[stop:restart])) > level - below * scatter:
            continue
        if b == n:
            end = stop
        elif not _comes_to_rest(force[stop:restart], level, rest):
            continue
        elif restart - stop > _DWELLS * (b - restart):
            stops.append((stop, restart))
            slid = int(b)
    found = len(stops) + int(end < n)  # a force that swings is calm now and then
    return (stops, end) if 0 < found <= _MOST and 2 * found >= calm else None


def _comes_to_rest(force: FloatArray, level: float, rest: float) -> bool:
    """Whether a force changes less and less after a stop; one that swings changes most half-way."""
    _, middle, late = (float(np.median(part)) for part in np.array_split(force, 3))
    return abs(late - middle) <= _SETTLES * max(level - late, 0.0) + rest and abs(late - middle) <= abs(middle - level)


def _parted(rough: FloatArray) -> tuple[float, float, float, float] | None:
    """Logarithms of the roughness that parts rest from sliding (Otsu 1979) and that is surely of rest, and both
    scatters; None if they do not part."""
    counts, edges = np.histogram(rough, 64)
    middles = (edges[:-1] + edges[1:]) / 2.0
    below = np.cumsum(counts)
    above = below[-1] - below
    sums = np.cumsum(counts * middles)
    inside = (below >= _FEWEST * rough.size) & (above >= _FEWEST * rough.size)
    if not inside.any():
        return None
    low, high = sums / np.maximum(below, 1), (sums[-1] - sums) / np.maximum(above, 1)
    between = np.where(inside, below * above * (high - low) ** 2, -1.0)
    best = int(np.argmax(between))
    rest, slide = rough[rough < edges[best + 1]], rough[rough >= edges[best + 1]]
    if rest.size == 0 or slide.size == 0:
        return None
    one, other = float(np.median(rest)), float(np.median(slide))
    if other - one < math.log(_CONTRAST):
        return None
    to_scatter = math.sqrt(math.pi / 2.0)
    return (one + other) / 2.0, one + _SURELY * (other - one), to_scatter * math.exp(one), to_scatter * math.exp(other)


def _stop(force: FloatArray, a: int, b: int, width: int, slides_above: float, rest: float) -> int:
    """The sample at which a smooth part begins: after the last one at the level of the slide, or that does not go on as
    the samples after it, whichever is earlier."""
    first, middle = max(a - 2 * width, 0), (a + b) // 2
    total = np.concatenate(([0.0], np.cumsum(force)))
    index = np.arange(first, min(middle, force.size - 2 * _AHEAD - 1))
    near = (total[index + 1 + _AHEAD] - total[index + 1]) / _AHEAD
    far = (total[index + 1 + 2 * _AHEAD] - total[index + 1 + _AHEAD]) / _AHEAD
    onward = near + (near - far) * (_AHEAD + 1) / (2.0 * _AHEAD)
    loud = np.flatnonzero(np.abs(force[index] - onward) > _LOUD * rest)
    high = np.flatnonzero(force[first:middle] >= slides_above)
    ends = [first + int(found[-1]) + 1 for found in (loud, high) if found.size]
    return _where_it_relaxes(force, min(ends, default=a), b, width, rest)


def _where_it_relaxes(force: FloatArray, late: int, b: int, width: int, rest: float) -> int:
    """The sample from which on a force goes as the exponential that it relaxes by later on."""
    part = force[late : min(late + 4 * width, b)]
    first = max(late - width, 0)
    if part.size < 2 * FEWEST_AT_REST or late <= first:
        return late
    along = np.arange(part.size, dtype=float)
    found = []
    for tau in np.geomspace(2.0, 8.0 * width, 16):
        decay = np.exp(-along / tau)
        slope = float((decay - decay.mean()) @ part) / max(float(((decay - decay.mean()) ** 2).sum()), 1e-300)
        level = float(part.mean()) - slope * float(decay.mean())
        found.append((float(((part - level - slope * decay) ** 2).sum()), tau, level, slope))
    squares, tau, level, slope = min(found)
    onward = level + slope * np.exp((late - np.arange(first, late)) / tau)
    scatter = max(rest, math.sqrt(squares / part.size))
    off = np.flatnonzero(np.abs(force[first:late] - onward) > _LOUD * scatter)
    return first + int(off[-1]) + 1 if off.size else late


def _restart(force: FloatArray, stop: int, last: int, rest: float) -> int:
    """The sample at which the force begins to climb away from the level of a stop; the last where it does not."""
    part = force[stop:last]
    calm = running_mean(part, FEWEST_AT_REST)
    lowest = int(np.argmin(calm))
    climb = float(part[lowest:].max()) - float(calm[lowest])
    if climb < _CLIMBS * rest or part.size < 2 * FEWEST_AT_REST:
        return last
    a = lowest + int(np.argmax(calm[lowest:] > calm[lowest] + 0.25 * climb))
    b = max(lowest + int(np.argmax(calm[lowest:] > calm[lowest] + 0.75 * climb)), a + 1)
    pace = float(calm[min(b, calm.size - 1)] - calm[a]) / (b - a)
    began = a - (float(calm[a]) - float(np.median(part[max(lowest - 10, 0) : lowest + 1]))) / pace if pace > 0 else a
    return stop + int(np.clip(round(began), 0, a))
