"""How the drive of a rig moves, by the channel that tells it, and the levels at which speed and load stand.

Some stops only the force tells of: bodies that slide make it rough, bodies that stand leave it smooth. At a stop the
force falls and is smooth. A spring that is drawn tight while its slider sticks is smooth as well, but climbs all the
time; a lull of a rough force stays at the level of the slide.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tribo.records import FloatArray, Trace
from tribo.traces.signal import (
    MINIMUM_SAMPLES,
    condense,
    line,
    median_of_three,
    running_mean,
    runs_of,
    sample_noise,
    turning_points,
)

Mask = NDArray[np.bool_]
Range = tuple[int, int]

FEWEST_AT_REST = 5
_PROPORTIONAL = 0.8  # share of the variance of a load that follows the pull where it changes because of it
_OF_FRICTION = 0.3  # share of what a load changes for a newton of pull where friction is in proportion to it
_AT_REST = 0.05  # share of the lowest level of the speed below which the drive stands still
_BINS = 10  # of the speed in a decade, where its levels are looked for
_OCCUPIED = 0.01  # share of the samples in one bin from which on a speed is a level and not passed through
_CALM = 0.02  # share of the usual speed up to which its noise is left as it is
_MOST_CALMED = 9  # samples over which a channel with little noise is averaged at the most
_TURNED = 0.1  # share of the usual speed from which on a speed of the other sign is motion the other way
_ABOVE_NOISE = 4.0  # a speed of this many times its noise at rest is motion
_ONE_WAY = 0.5  # net over total displacement from which on a displacement channel shows the travel
_MOVES = 20.0  # a displacement that moves spans this many times its noise
_OF_STROKE = 0.3  # share of its span by which a position goes back where the drive turns round
_WINDOWS = (400, 100, 25)  # samples over those of the windows in which steps are looked for
_TRIED = 20  # starts and ends of a ramp that are tried to either side
_TAIL = 0.05  # share of the values at either end that a level draws in
_QUIET = 0.25  # share of its usual range over five samples within which a force stands still
_PULLED = 0.9  # share of the fall to a quiet end above which the drive still pulls
_QUIET_SHARE = 0.03  # share of a record that a quiet end lasts at the least
_STEP = 0.08  # share of the lower level by which two levels of speed or load differ
_OF_NOISE = 6.0  # and this many times the noise of the difference
_QUARTER = 0.25  # share of the way between two levels at which a passage is placed
_SHORTEST = 0.02  # share of a motion that a level lasts at the least
_SETS_OUT = 0.1  # share of the longest motion of a piece below which another one only sets out on the next stroke
_BEFORE_BEND = 100  # samples of either level that tell where a displacement bends
_KEPT = 0.9  # share of the load of a stroke that a second motion carries if it belongs to it


@dataclass(frozen=True)
class DriveMotion:
    """The motion of the drive: ``pace`` (n,) in the unit of its ``channel`` per second, signed where that tells.

    ``moving`` (n,) says where it moves; ``turns`` are the samples at which it changes its direction. The pace is a mean
    over ``width`` samples.
    """

    pace: FloatArray
    moving: Mask
    channel: str
    turns: tuple[int, ...] = ()
    width: int = 1


def drive_of(trace: Trace) -> DriveMotion | None:
    """The motion of the drive by a recorded speed or rotation, else by a displacement that moves; None without one."""
    for quantity, channel in (("speed_m_s", "speed"), ("rotation_rev_per_s", "rotation speed")):
        speed = trace.columns.get(quantity)
        if speed is not None and np.isfinite(speed).all() and np.any(speed):
            return _by_speed(np.asarray(speed, float), channel)
    x = trace.displacement_m
    if x is None or not np.isfinite(x).all() or x.size < 4 * FEWEST_AT_REST:
        return None
    return _one_way(trace.time_s, x) or _to_and_fro(trace.time_s, x)


def _by_speed(speed: FloatArray, channel: str) -> DriveMotion:
    calm = median_of_three(speed)
    top = float(np.percentile(np.abs(calm), 95)) or float(np.abs(speed).max())
    blocks = np.array_split(speed, min(20, max(speed.size // MINIMUM_SAMPLES, 1)))
    noise = min(sample_noise(block) for block in blocks) if speed.size >= 3 * len(blocks) else 0.0
    usual = sample_noise(speed)
    width = 1
    if usual > 0:  # a noisy tachometer: the mean over so many samples is calm
        calms = (usual / (_CALM * top)) ** 2
        width = int(min(max(calms, min(speed.size // 400, _MOST_CALMED)), max(speed.size // 50, 1))) | 1
    pace = running_mean(calm, width)
    least = _slowest(np.abs(pace), top)
    least = max(least, min(_ABOVE_NOISE * noise / math.sqrt(width), 0.5 * top))
    moving = np.abs(pace) > least
    for a, b in zip(*runs_of(moving), strict=True):  # what noise lifts above the least speed for a moment
        if b - a < FEWEST_AT_REST and np.abs(pace[a:b]).max() < _ABOVE_NOISE * least:
            moving[a:b] = False
    for a, b in zip(*runs_of(~moving), strict=True):  # the mean passes zero where the drive turns round
        if 0 < a < b < moving.size and b - a <= max(width // 4, 1) < width:
            moving[a:b] = True
    if width > 1:
        moving = _narrowed(moving, round(width // 2 * (1.0 - 2.0 * min(least / top, 0.5))))
    side = np.sign(pace) * (np.abs(pace) > max(least, _TURNED * top))
    decided = np.flatnonzero(side)
    turned = np.flatnonzero(np.diff(side[decided]))
    turns = tuple(int(decided[k] + decided[k + 1] + 1) // 2 for k in turned)
    return DriveMotion(pace, moving, channel, turns, width)


def at_rest_below(speed: FloatArray) -> float:
    """Speed below which the drive stands still, by a recorded speed without its sign (see :func:`drive_of`)."""
    calm = median_of_three(speed)
    return _slowest(calm, float(np.percentile(calm, 95)) or float(calm.max()))


def _slowest(pace: FloatArray, top: float) -> float:
    """Speed below which the drive stands still: a small share of the lowest level at which it runs for some time.

    Levels of a ladder may lie far apart; each is less than twenty times the next lower one.
    """
    least = _AT_REST * top
    if not top > 0:
        return 0.0
    bins = np.floor(_BINS * np.log10(np.maximum(pace, 1e-9 * top) / top)).astype(int)
    while True:
        levels = np.bincount(bins[pace > least] + 9 * _BINS + 1)
        occupied = np.flatnonzero(levels >= max(_OCCUPIED * pace.size, 2 * FEWEST_AT_REST))
        lower = _AT_REST * top * 10.0 ** ((int(occupied[0]) - 9 * _BINS - 1) / _BINS) if occupied.size else least
        if lower >= least * 0.9:
            return least
        least = lower


def _narrowed(mask: Mask, by: int) -> Mask:
    """A mask whose runs are shorter by so many samples at either end, but not at the ends of the record."""
    found = np.zeros(mask.size, bool)
    for a, b in zip(*runs_of(mask), strict=True):
        less = min(by, int(b - a - 1) // 2)
        found[a + (less if a else 0) : b - (less if b < mask.size else 0)] = True
    return found


def _one_way(time_s: FloatArray, x: FloatArray) -> DriveMotion | None:
    """The drive by a displacement that goes one way."""
    width = max(FEWEST_AT_REST, x.size // 500)
    smooth = running_mean(x, width)
    path = float(np.abs(np.diff(smooth[::width])).sum())
    if path <= 0 or abs(float(smooth[-1] - smooth[0])) < _ONE_WAY * path:
        return None
    pace = _pace(time_s, smooth, width)
    moving = np.abs(pace) > _AT_REST * float(np.percentile(np.abs(pace), 75))
    return DriveMotion(
        pace, _narrowed(moving, width - 1), "displacement", (), 2 * width
    )  # motion is felt so many samples around it


def _pace(time_s: FloatArray, x: FloatArray, width: int) -> FloatArray:
    """Slope of a displacement over ``width`` samples to either side."""
    ahead, behind = np.minimum(np.arange(x.size) + width, x.size - 1), np.maximum(np.arange(x.size) - width, 0)
    return np.asarray((x[ahead] - x[behind]) / np.maximum(time_s[ahead] - time_s[behind], 1e-300))


def _to_and_fro(time_s: FloatArray, x: FloatArray) -> DriveMotion | None:
    """The drive by a displacement that goes to and fro, with its turns."""
    noise, span = sample_noise(x), float(np.ptp(x))
    if span <= _MOVES * noise or span <= 0:
        return None
    peaks, troughs = turning_points(x, _OF_STROKE * span)
    ends = np.sort(np.concatenate((peaks, troughs)))
    if ends.size == 0:
        return None
    path = float(np.abs(np.diff(x[ends])).sum()) if ends.size > 1 else span
    between = max(int(ends[-1] - ends[0]), 1) if ends.size > 1 else x.size
    width = int(np.clip(math.ceil(_MOVES * noise / (path / between)), 1, max(between // max(ends.size, 1) // 10, 1)))
    pace = _pace(time_s, running_mean(x, 2 * width + 1) if width > 1 else x, width)
    size = np.abs(pace)
    moving = size > _AT_REST * float(np.percentile(size, 75))
    side = np.sign(pace) * moving
    turns = []
    still = np.flatnonzero(~moving)
    for end in ends:  # the drive turns half-way through its dwell at the end of a stroke
        if moving[end] and still.size:  # noise may place the furthest position just outside of the dwell
            nearest = int(still[np.argmin(np.abs(still - end))])
            end = nearest if abs(nearest - end) <= 4 * width else end
        before, after = np.flatnonzero(moving[:end]), np.flatnonzero(moving[end:])
        if before.size and after.size:
            turns.append((int(before[-1]) + 1 + end + int(after[0])) // 2)
    return DriveMotion(pace, side != 0, "position", tuple(turns), 2 * width)


def speed_level_m_s(trace: Trace) -> float:
    """The level of the recorded speed while the drive moves, without its sign, else that of a displacement one way.

    NaN where neither was recorded. Neither noise nor a few ticks of a coarse tachometer move it.
    """
    speed, drive = trace.columns.get("speed_m_s"), drive_of(trace)
    if drive is None or not drive.moving.any():
        return math.nan
    if drive.channel == "displacement":
        return abs(level_of(drive.pace[drive.moving]))
    if speed is None or drive.channel != "speed":
        return math.nan
    return level_of(np.sign(drive.pace[drive.moving]) * speed[drive.moving])


def rotation_level_rev_per_s(trace: Trace) -> float:
    """The level of the recorded rotation while the drive moves, without its sign; NaN where it was not recorded."""
    drive = drive_of(trace)
    if drive is None or drive.channel != "rotation speed" or not drive.moving.any():
        return math.nan
    return level_of(np.sign(drive.pace[drive.moving]) * trace.columns["rotation_rev_per_s"][drive.moving])


def level_of(values: FloatArray) -> float:
    """Mean of some values, the outermost twentieths drawn in to the next ones; NaN where a value is."""
    if not np.isfinite(values).all():
        return math.nan
    low, high = np.quantile(values, (_TAIL, 1.0 - _TAIL))
    return float(np.clip(values, low, high).mean())


def drive_stops(moving: Mask, contact: Range) -> tuple[list[Range], int, list[Range]]:
    """Stops of the drive while the bodies touch, where motion ends for good, and all ranges at rest."""
    rests = [(int(a), int(b)) for a, b in zip(*runs_of(~moving), strict=True) if b - a >= FEWEST_AT_REST]
    if not moving.any():
        return [], contact[1], []
    first, last = int(np.argmax(moving)), int(np.flatnonzero(moving)[-1])
    stops = [(a, b) for a, b in rests if max(first, contact[0]) < a and b < min(last, contact[1])]
    after = moving.size - last - 1
    return stops, min(contact[1], last + 1) if after >= FEWEST_AT_REST else contact[1], rests


def stroke_end(piece: Trace) -> int | None:
    """The sample at which the drive of one stroke stops; the size where it does not, None where no channel tells.

    What moves the other way after it, or hardly, is the next stroke; what moves unloaded is the way to the end.
    """
    drive, samples = drive_of(piece), piece.time_s.size
    if drive is None or not drive.moving.any():
        return None
    starts, ends = runs_of(drive.moving)
    ways = [float(drive.pace[a:b].sum()) for a, b in zip(starts, ends, strict=True)]
    load = piece.columns.get("normal_force_N")
    loads = [1.0 if load is None else abs(float(np.median(load[a:b]))) for a, b in zip(starts, ends, strict=True)]
    last = int(np.argmax(np.abs(ways)))
    for k in range(last + 1, ends.size):
        on = ways[k] * ways[last] > 0 and ends[k] - starts[k] >= _SETS_OUT * (ends - starts).max()
        last = k if on and loads[k] >= _KEPT * loads[last] else last
    end = int(ends[last])
    return end if samples - end >= FEWEST_AT_REST else samples


def quiet_end(force_N: FloatArray) -> int:
    """Index from which a force stands still until the record ends, as after a stop of the drive; the size without one.

    Sliding makes a force rough. Where its range over five samples falls below a quarter of what it is while sliding,
    and stays there, nothing slides.
    """
    n = force_N.size
    if n < 4 * MINIMUM_SAMPLES:
        return n
    windows = np.lib.stride_tricks.sliding_window_view(force_N, FEWEST_AT_REST)
    rough = windows.max(axis=1) - windows.min(axis=1)
    usual = float(np.median(rough[: n // 2]))
    loud = np.flatnonzero(rough > _QUIET * usual)
    end = int(loud[-1]) + FEWEST_AT_REST if loud.size else n
    if usual <= 0 or n - end < max(2 * FEWEST_AT_REST, _QUIET_SHARE * n):
        return n
    rests, slides = float(np.median(force_N[end:])), float(np.median(force_N[n // 4 : end - (end - n // 4) // 4]))
    if abs(slides - rests) <= usual:
        return end
    pulled = np.flatnonzero((force_N[:end] - rests) / (slides - rests) > _PULLED)  # before the force relaxes
    return int(pulled[-1]) + 1 if pulled.size else end


def levels_of(values: FloatArray) -> list[tuple[int, int, float]]:
    """(start, end, median) of every steady level of a channel, in order; none where it has not even one.

    Means before and after every sample are compared over windows from a four-hundredth to a twenty-fifth of the
    samples. Levels differ by 8 % of the lower one and by six times the noise of such a difference; each lasts at least
    2 % of the samples and drifts by less than two levels differ.
    """
    n = values.size
    shortest = max(MINIMUM_SAMPLES, int(_SHORTEST * n))
    if n < shortest:
        return []
    changing = np.zeros(n, bool)
    total = np.concatenate(([0.0], np.cumsum(values)))
    single = sample_noise(values)
    for width in sorted({max(FEWEST_AT_REST, n // share) for share in _WINDOWS}):
        if 2 * width >= n:
            continue
        means = (total[width:] - total[:-width]) / width
        before, after = means[: n - 2 * width + 1], means[width:]
        jump = np.abs(after - before)
        noise = max(single * math.sqrt(2.0 / width), float(np.median(jump)))
        least = np.maximum(_STEP * np.minimum(np.abs(before), np.abs(after)), _OF_NOISE * noise)
        above = jump > least
        del least  # a long record is not held once more
        for a, b in zip(*runs_of(above), strict=True):
            first, last = int(a) + width, int(b) + width  # the middles of the windows
            if changing[max(first - width, 0) : last + width].any():
                continue  # a narrower window has placed it
            if last - first <= 2 * width:  # sharp for this window
                first = last = first + int(np.argmax(jump[a:b]))
            changing[first : last + 1] = True
    stretches = [(int(a), int(b)) for a, b in zip(*runs_of(~changing), strict=True) if b - a >= shortest]
    levels: list[tuple[int, int, float]] = []
    for a, b in stretches:
        part = values[a:b]
        mean, edge = float(np.median(part)), max((b - a) // 5, 1)
        drift = abs(float(np.median(part[-edge:]) - np.median(part[:edge])))
        if drift > max(_STEP * abs(mean), _OF_NOISE * single / math.sqrt(edge)):
            continue
        if levels and abs(mean - levels[-1][2]) <= _STEP * min(abs(mean), abs(levels[-1][2])):
            levels[-1] = (levels[-1][0], b, float(np.median(values[levels[-1][0] : b])))
        else:
            levels.append((a, b, mean))
    return levels


def load_as_set(load: FloatArray, force: FloatArray) -> FloatArray:
    """The amount of a recorded normal load (n,) without what follows the pull (n,): a wire that rises takes load off,
    and a load cell may answer to the pull.

    A load that was changed takes the friction with it: by about as large a share, and never the other way.
    """
    amount, pull = np.abs(load), force - force.mean()
    away = amount - amount.mean()
    product, spread = float(away @ pull), float(pull @ pull)
    if product**2 <= _PROPORTIONAL * spread * float(away @ away):
        return amount
    if product > _OF_FRICTION * spread * float(amount.mean()) / max(float(np.median(np.abs(force))), 1e-300):
        return amount
    return np.asarray(amount - product / spread * pull)


def level_cuts(values: FloatArray) -> list[Range]:
    """(end of a level, start of the next) wherever a channel goes from one steady level to another."""
    levels = levels_of(values)
    calm = median_of_three(values) if len(levels) > 1 else values
    return [_passage(calm, one, other) for one, other in pairwise(levels)]


def speed_cuts(trace: Trace, drive: DriveMotion, span: Range) -> list[Range]:
    """(end of a level, start of the next) of the speed of a drive within a range of samples; both are one at a step.

    The slope of a displacement is felt over many samples; the displacement itself says where it bends.
    """
    first, last = span
    cuts = [(first + a, first + b) for a, b in level_cuts(np.abs(drive.pace[first:last]))]
    if drive.channel != "displacement" or trace.displacement_m is None:
        return [_drawn_in(cut, drive.width) for cut in cuts]
    starts, ends = [first, *(b for _, b in cuts)], [*(a for a, _ in cuts), last]
    return [
        _bend(trace.time_s, trace.displacement_m, cut, (max(start, cut[0] - _BEFORE_BEND), end), drive.width)
        for cut, start, end in zip(cuts, starts, ends[1:], strict=False)
    ]


def _drawn_in(cut: Range, width: int) -> Range:
    """A passage from one level to the next without what a mean over so many samples adds to it."""
    first, last = cut
    lasts = math.sqrt(max((last - first) ** 2 - width**2, 0.0))  # the squares of the lengths of ramps and means add up
    middle, half = (first + last) / 2.0, max(lasts, 1.0) / 2.0
    start = int(middle - half)
    return cut if width <= 1 else (start, max(int(middle + half), start + 1))


def _bend(time_s: FloatArray, x: FloatArray, cut: Range, span: Range, width: int) -> Range:
    """The samples between two speeds by the lines through a displacement before and after them.

    The lines meet in the middle of an even ramp; there the displacement lies off them by an eighth of what the speed
    changes by times the duration of the ramp.
    """
    before, after = slice(span[0], cut[0] - width), slice(cut[1] + width, min(span[1], cut[1] + width + _BEFORE_BEND))
    if min(before.stop - before.start, after.stop - after.start) < MINIMUM_SAMPLES:
        return _drawn_in(cut, width)
    (old, t0, x0), (new, t1, x1) = (line(time_s[part], x[part]) for part in (before, after))
    if old == new:
        return _drawn_in(cut, width)
    bends_s = (x1 - x0 + old * t0 - new * t1) / (old - new)
    at = int(np.searchsorted(time_s, bends_s))
    if not cut[0] - width <= at <= cut[1] + width:
        return _drawn_in(cut, width)
    near = slice(at - 1, at + 2)
    lines = x0 + old * (time_s[near] - t0), x1 + new * (time_s[near] - t1)
    away = x[near] - (np.maximum(*lines) if new > old else np.minimum(*lines))
    half_s = max(4.0 * float(np.mean(away)) / (new - old), 0.0)
    sample_s = float(time_s[at + 1] - time_s[at - 1]) / 2.0  # so that what happens at once is not lost to the old level
    start, end = np.searchsorted(time_s, (bends_s - half_s - sample_s / 2.0, bends_s + half_s))
    return int(start), max(int(end), int(start))


def _passage(values: FloatArray, one: tuple[int, int, float], other: tuple[int, int, float]) -> Range:
    """The samples between two levels (start, end, median), by a line through the middle half of the way."""
    first = max(one[1] - (one[1] - one[0]) // 4, one[0])
    last = min(other[0] + (other[1] - other[0]) // 4, other[1])
    share = (values[first:last] - one[2]) / (other[2] - one[2])
    middle = int(np.argmax(share > 0.5))
    leaves, arrives = np.flatnonzero(share[:middle] < _QUARTER), np.flatnonzero(share[middle:] > 1.0 - _QUARTER)
    left = int(leaves[-1]) + 1 if leaves.size else 0
    there = middle + int(arrives[0]) if arrives.size else last - first
    if there - left < FEWEST_AT_REST // 2:
        return first + left, first + max(there, left + 1)
    start, end = _ramp(share, left, there)
    return first + start, min(first + end, other[1])


def _ramp(share: FloatArray, left: int, there: int) -> Range:
    """Start and end of the ramp from 0 to 1 that lies nearest a passage, its middle half from ``left`` to ``there``."""
    n, reach = share.size, max(2 * FEWEST_AT_REST, there - left)
    step = max(1, reach // _TRIED)
    starts = np.unique(np.clip(np.arange(left - reach, left + reach + 1, step), 0, n - 1))
    ends = np.unique(np.clip(np.arange(there - reach, there + reach + 1, step), 1, n))
    total = np.concatenate(([0.0], np.cumsum(share)))
    moment = np.concatenate(([0.0], np.cumsum(share * np.arange(n))))
    s, e = starts[:, None], ends[None, :]
    length = np.maximum(e - s, 1)
    along = (moment[e] - moment[s] - s * (total[e] - total[s])) / length
    ramp = (length - 1.0) * (2.0 * length - 1.0) / (6.0 * length) - 2.0 * along
    misfit = np.where(e > s, ramp - 2.0 * (total[n] - total[e]) + (n - e), np.inf)
    best = np.unravel_index(int(np.argmin(misfit)), misfit.shape)
    return int(starts[best[0]]), int(ends[best[1]])


_WIDTH = 21  # samples over which roughness is told at the least
_CONTRAST = 1.6  # ratio of the roughness while sliding to that at rest, at the least
_CLEAR = 2.2  # and where it tells by itself
_RISES = 4.0  # times the usual size of what is left of a force without its running mean, beyond which it is no noise
_FEWEST = 0.01  # share of the samples that are rough, and smooth
_SHORTEST_STOP = 0.004  # share of a record that a stop lasts at the least
_BELOW = 1.0  # times the scatter of a slide by which the force of a stop lies below it,
_FAR_BELOW = 3.0  # and where the contrast is poor
_LEVEL = 1.5  # and up to which a force is still at the level of the slide
_LOUD = 4.0  # times the scatter at rest by which a sample does not go on as those after it
_AHEAD = 5  # samples of each of the two means that say how a force goes on
_SURELY = 0.35  # share of the way from the roughness at rest to that of a slide below which a part stands still
_SETTLES = 0.25  # share of its whole fall by which a force still changes in the last third of a stop
_GAP = 4  # widths that a fall of the force at rest is felt at the most
_STOP_IN_WIDTHS = 8  # widths of a stop that tell when it began
_FALLS_FIRST = 0.25  # share of its fall by which a force has fallen between two samples of which one began its stop
_BEFORE_STOP = 12  # widths before a stop that tell the level of the slide
_DWELLS = 0.4  # share of its rise that a stop dwells before the force climbs
_MOST_TRIED = 2000  # samples of a stroke among which its stop is looked for
_COARSELY = 150  # and at first
_FEWEST_RELAXED = 8  # of them that a stop lasts at the least,
_SHORTEST_RELAXED = 0.03  # and this share of the stroke
_LIKELIER = 20.0  # by twice the logarithm of the likelihood a stop is likelier than one line
_QUIETER = 1.4  # times as rough as at rest is a force that slides
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
    least = max(int(_SHORTEST_STOP * n), width)
    below = _BELOW if slide > _CLEAR * rest else _FAR_BELOW
    slid, stops, end, calm = 0, [], n, 0
    for a, b in zip(*runs_of(smooth), strict=True):
        if b - a < least or not (~smooth[:a]).any() or float(np.median(rough[a:b])) > quiet:
            continue
        before = force[max(slid, a - _BEFORE_STOP * width) : max(a - width // 2, slid + 1)]
        if before.size < FEWEST_AT_REST:
            continue
        calm += 1
        level, scatter = float(np.median(before)), max(float(before.std()), slide)
        stop = _stop(force, int(a), int(b), width, level - _LEVEL * scatter, rest)
        restart = _restart(force, stop, min(int(b) + 2 * width, n), rest)
        stop = began_by(force, slid, stop, min(restart, stop + _STOP_IN_WIDTHS * width))
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


def relaxes_from(force_N: FloatArray, *, clearly: bool = False) -> int:
    """The sample from which on the force of one stroke relaxes, as its drive stands still; its size if it does not.

    Before it the force follows a line and is rough, after it an exponential and is smooth: the two that are likeliest
    together, each with a scatter of its own. Noise that is correlated counts as so many fewer samples. ``clearly`` asks
    that it is rough from sample to sample.
    """
    factor = max(force_N.size // _MOST_TRIED, 1)
    if force_N.size < 8 * _FEWEST_RELAXED:
        return force_N.size
    values = condense(force_N * (np.sign(float(np.median(force_N))) or 1.0), factor)
    least = max(_FEWEST_RELAXED, int(_SHORTEST_RELAXED * values.size))
    if values.size < 8 * least:
        return force_N.size
    skip = values.size // 4
    rest = values[skip : values.size - least // 2]  # the last samples may turn already
    if clearly and not sample_noise(rest[:-least]) > _CONTRAST * sample_noise(rest[-least:]):
        return force_N.size
    rest = rest - float(rest.mean())
    few = max(rest.size // _COARSELY, 1)
    taus = np.geomspace(2.0, 2.0 * rest.size, 20)
    _, at, *_, tau = _parted_at(condense(rest, few), range(2 * least // few, (rest.size - least) // few), taus / few)
    at, tau = at * few, tau * few
    for nearer, reach in ((1.5, 2 * few), (1.1, few), (1.01, few)):
        near = range(max(at - reach, 2 * least), min(at + reach + 1, rest.size - least))
        unlikely, at, slide, still, tau = _parted_at(rest, near, tau * np.geomspace(1.0 / nearer, nearer, 16))
    if at == rest.size:
        return force_N.size
    along = np.arange(rest.size, dtype=float)
    whole, away = (
        rest[:end]
        - np.polynomial.polynomial.polyval(along[:end], np.polynomial.polynomial.polyfit(along[:end], rest[:end], 1))
        for end in (rest.size, at)
    )
    alike = float(np.clip(away[1:] @ away[:-1] / max(float(away @ away), 1e-300), 0.0, 0.95))
    gain = rest.size * math.log(max(float(whole @ whole) / rest.size, 1e-300)) - unlikely
    falls = float(rest[max(at - at // 4, 0) : at].mean() - rest[-max((rest.size - at) // 3, 1) :].mean())
    found = gain * (1.0 - alike) / (1.0 + alike) > _LIKELIER and slide > _QUIETER * still and falls > _BELOW * slide
    if clearly:  # a force with steps is far from its line and not rough
        found = found and sample_noise(rest[:at]) > _CONTRAST * sample_noise(rest[at:])
    return (skip + at) * factor if found else force_N.size


def began_by(force_N: FloatArray, slid: int, stop: int, end: int) -> int:
    """The sample at which a stop began that was seen at ``stop``, by the force from ``slid`` on and up to ``end``.

    From there on the force falls; what is still at the level of the slide is none of a stop.
    """
    early = max(slid, stop - 2 * (end - stop))
    began = early + relaxes_from(force_N[early:end])
    if not early < began < stop:
        return stop
    parts = np.split(force_N[early : min(2 * stop - began, end)], (began - early, stop - early))
    before, between, after = (float(np.median(part)) for part in parts)
    return began if before - between > _FALLS_FIRST * (before - after) else stop


def _parted_at(rest: FloatArray, starts: range, taus: FloatArray) -> tuple[float, int, float, float, float]:
    """Where a force goes over from a line to an exponential: minus twice the logarithm of the likelihood, the sample,
    both scatters, and the time constant in samples; the size of the force as the sample where none was tried."""
    floor = (1e-5 * float(np.ptp(rest))) ** 2 + 1e-300
    along = np.arange(rest.size, dtype=float)
    t, y, tt, ty, yy = (np.cumsum(v) for v in (along, rest, along**2, along * rest, rest**2))
    at = np.array(starts)
    if at.size == 0:
        return math.inf, rest.size, 0.0, 0.0, 1.0
    k, n, left = at - 1, at.astype(float), (rest.size - at).astype(float)
    spread = tt[k] / n - (t[k] / n) ** 2
    bend = np.where(spread > 0, (ty[k] / n - t[k] * y[k] / n**2) ** 2 / np.where(spread > 0, spread, 1.0), 0.0)
    rough = np.maximum(yy[k] / n - (y[k] / n) ** 2 - bend, floor)
    decay = np.exp(-along[: int(left[0])] / taus[:, None])
    after = np.lib.stride_tricks.sliding_window_view(np.append(rest, np.zeros(decay.shape[1])), decay.shape[1])[at]
    lasts = (rest.size - at) - 1
    of_decay, squares = (np.cumsum(v, axis=1)[:, lasts] for v in (decay, decay**2))
    mean = (y[-1] - y[k]) / left
    away = yy[-1] - yy[k] - left * mean**2
    along_decay = decay @ after.T - of_decay * mean
    unlike = away - along_decay**2 / np.maximum(squares - of_decay**2 / left, 1e-300)
    smooth = np.maximum(unlike.min(axis=0) / left, floor)
    unlikely = n * np.log(rough) + left * np.log(smooth)
    best = int(np.argmin(unlikely))
    tau = float(taus[int(np.argmin(unlike[:, best]))])
    return float(unlikely[best]), int(at[best]), math.sqrt(rough[best]), math.sqrt(smooth[best]), tau


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
    slid = max(a - _BEFORE_STOP * width, 0)
    total = np.concatenate(([0.0], np.cumsum(force)))
    index = np.arange(first, min(middle, force.size - 2 * _AHEAD - 1))
    near = (total[index + 1 + _AHEAD] - total[index + 1]) / _AHEAD
    far = (total[index + 1 + 2 * _AHEAD] - total[index + 1 + _AHEAD]) / _AHEAD
    onward = near + (near - far) * (_AHEAD + 1) / (2.0 * _AHEAD)
    loud = np.flatnonzero(np.abs(force[index] - onward) > _LOUD * rest)
    high = np.flatnonzero(force[slid:middle] >= slides_above)
    ends = [begin + int(found[-1]) + 1 for begin, found in ((first, loud), (slid, high)) if found.size]
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
