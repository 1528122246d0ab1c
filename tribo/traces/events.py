"""Slips one by one: when each begins, fails and ends, how stiff its loading was, what it lost and how far it went.

The falls that :func:`tribo.traces.oscillation_of` counts say where slips are. Each is then read between two straight
lines, the force before it and the force after it, joined by half a swing: what a mass on a spring does that breaks
loose, and a shape of finite length that least squares fit to any fall. Forces at a single data point, which noise moves
to one side, are never read.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from tribo.records import FloatArray, Slip, SlipChange
from tribo.traces.signal import condense, line, median_of_three, sample_noise
from tribo.traces.sliding import MOST_REGAINED, cycles_of

_LOADING = (0.2, 0.65)  # share of a loading between which its stiffness is read: after the ringing, before the creep
_BESIDE = 0.2  # share of a loading, next to a slip, over which the line beside it is fitted,
_TIMES_FALL = 1.5  # and at least this many times the fall
_TIMES_SETTLING = 4.0  # times the fall over which the level is read to which a force settles
_FEWEST = 4  # points from which on a line of its own is fitted beside a slip; else it has the slope of the loadings
_MOST_POINTS = 250  # that the shape of one slip is fitted to
_MOST_STEPS = 12
_RESOLVED = 4.0  # samples of a fall from which on its duration and velocity are resolved
_MIDDLE = (0.2, 0.8)  # share of a fall between which its duration is first estimated
_OF_SWING = (math.acos(1.0 - 2.0 * _MIDDLE[1]) - math.acos(1.0 - 2.0 * _MIDDLE[0])) / math.pi
_CLEAR = 5.0  # a drop is at least this many times the noise of the loadings
_NEXT_TRY, _MOST_TRIES = 1.3, 8
_IMPULSE = 6.0  # times the noise by which an impulse stands out
_FAR = 7.0  # times the median distance from the median beyond which a slope is left out
_FEWEST_SLIPS = 2
_BY_CHANCE = 0.02  # probability at the most by which noise has as many loadings that regain steadily what was lost
_MANY, _REGULAR = 20, 0.25  # falls whose recurrence varies less than in noise alone (docs/results/events.md)
_VERY_CLEAR = 15.0  # times the noise that each of a few slips loses
_UNTOLD = 0.01  # share of a cycle above which a data point is too long to tell where an unresolved fall begins
_FEWEST_SAMPLES = 8
_SAME = 0.25  # share of a duration within which the range it was fitted over stays as it is
_NEARLY_STEP = 3.0  # samples of a fall below which its place is searched
_PLACES, _LENGTHS = np.arange(-1.5, 1.51, 0.5), np.array([0.5, 1.5, 3.0])
_FEWEST_BESIDE = 6  # samples beside a slip, at least


def slips_of(
    time_s: FloatArray,
    force_N: FloatArray,
    *,
    speed_m_s: float = math.nan,
    stiffness_N_per_m: float = math.nan,
    loading_N_per_s: float = math.nan,
    smallest_drop_N: float | None = None,
    from_rest: bool = False,
) -> tuple[Slip, ...]:
    """Every slip of a force that is recorded while the drive moves.

    No slip is counted that regains more force than the drive can supply in the time.

    Parameters
    ----------
    time_s, force_N : ndarray, shape (n,)
        Time in s and force in N.
    speed_m_s : float
        Speed of the drive in m/s; without it lengths and velocities are NaN.
    stiffness_N_per_m : float
        Stiffness between drive and slider in N/m as stated; without it the median of the loadings stands in.
    loading_N_per_s : float
        Rate at which the drive loads a slider that sticks, where it is known otherwise than from stiffness and speed.
    smallest_drop_N : float, optional
        Least fall of the force that counts; by default as in :func:`tribo.traces.oscillation_of`.
    from_rest : bool
        Whether the first sample is the onset of a pull from rest.

    Returns
    -------
    tuple of Slip
        In the order of time; NaN where a number is not resolved.

    Examples
    --------
    >>> import numpy as np
    >>> from tribo.traces import slips_of
    >>> time_s = np.arange(0.0, 30.0, 0.005)
    >>> phase = time_s % 1.5
    >>> force_N = 0.1 + np.where(phase < 1.4, phase / 1.4, (1.5 - phase) / 0.1) * 0.02
    >>> slips = slips_of(time_s, force_N, speed_m_s=1e-4)
    >>> len(slips), round(slips[3].recurrence_s, 3), round(1e6 * slips[3].slip_m)
    (20, 1.5, 150)
    """
    drive = stiffness_N_per_m * speed_m_s if stiffness_N_per_m * speed_m_s > 0 else loading_N_per_s
    if time_s.size < _FEWEST_SAMPLES:
        return ()
    least = smallest_drop_N
    for _ in range(_MOST_TRIES):
        _, time, force, peaks, counted = cycles_of(time_s, force_N, least, drive)
        spans = _spans(time, force, peaks, drive)
        noise = _noise_of_loadings(time, force, spans)
        if not spans or smallest_drop_N is not None or counted >= _CLEAR * noise:
            break
        least = max(_NEXT_TRY * counted, min(_CLEAR * noise, 2.0 * counted))
    slips: tuple[Slip, ...] = ()
    if len(spans) >= _FEWEST_SLIPS + int(from_rest):
        slips = read_between(time_s, force_N, spans, speed_m_s, stiffness_N_per_m, from_rest)
    if _are_slips(slips[int(from_rest) :], noise):
        return slips
    if not from_rest or not spans:
        return ()
    alone = [(*spans[0][:3], float(time_s[-1]))]  # the fall from the static peak to where the force settles
    return read_between(time_s, force_N, alone, speed_m_s, stiffness_N_per_m, from_rest)


Span = tuple[float, float, float, float]  # times of the trough before a slip, its peak, its trough, and the next peak


def read_between(
    time_s: FloatArray,
    force_N: FloatArray,
    spans: Sequence[Span],
    speed_m_s: float,
    stiffness_N_per_m: float,
    from_rest: bool,
) -> tuple[Slip, ...]:
    """The slips whose turning points are known, in the order of time; those without a fall are left out."""
    force = _without_impulses(force_N)
    loadings = [
        _line_between(time_s, force, a + _LOADING[0] * (b - a), a + _LOADING[1] * (b - a)) for a, b, _, _ in spans
    ]
    rate = _common_slope(loadings, np.array([b - a for a, b, _, _ in spans]))
    settles = from_rest and len(spans) == 1
    fits = [_fall(time_s, force, span, rate, settles) for span in spans]
    if not stiffness_N_per_m > 0:
        stiffness_N_per_m = rate / speed_m_s if speed_m_s > 0 else math.nan
    pace, usual = float(np.median(np.diff(time_s))), float(np.median([fit[1] for fit in fits if fit] or [math.nan]))
    cycle = float(np.median([b - a for a, b, _, _ in spans]))
    resolved = usual >= _RESOLVED * pace  # of the record: single ones that seem to be are those that noise drew out
    told = resolved or pace < _UNTOLD * cycle
    found: list[Slip] = []
    for (start, _, _, _), (slope, middle_s, middle_N, points), fit in zip(spans, loadings, fits, strict=True):
        if fit is None:
            continue
        fail, lasts, peak, trough = fit
        first = not found
        begin = start if first else found[-1].end_s
        own = from_rest and first  # the rise from rest may be steeper or softer than the loadings
        creep = middle_N + (slope if own else rate) * (fail - middle_s) - peak
        stiffness = slope / speed_m_s if own and speed_m_s > 0 else stiffness_N_per_m
        stiffness = stiffness if stiffness > 0 else math.nan  # a force that does not climb tells none
        drop, known = peak - trough, from_rest or not first
        found.append(Slip(
            begin if known else math.nan, fail, fail + lasts, slope / speed_m_s if speed_m_s > 0 else math.nan, points,
            peak, trough, drop / stiffness + speed_m_s * lasts if told else math.nan, lasts if resolved else math.nan,
            speed_m_s + math.pi * drop / (2.0 * lasts * stiffness) if resolved else math.nan,
            creep / stiffness if known else math.nan, math.nan if first else fail - found[-1].fail_s,
            fail - begin if told and not first else math.nan, slope,
        ))  # fmt: skip
    return tuple(found)


def changed_by_hand(
    time_s: FloatArray,
    force_N: FloatArray,
    slips: Sequence[Slip],
    changes: Sequence[SlipChange],
    speed_m_s: float,
    stiffness_N_per_m: float,
) -> tuple[Slip, ...]:
    """Slips with those a person removed, added or moved; what follows one of them begins where it ends."""
    gone = {number for number, _, _ in changes}
    kept = [s for k, s in enumerate(slips, start=1) if k not in gone]
    turns = sorted([(s.fail_s, s.end_s) for s in kept] + [(a, b) for _, a, b in changes if math.isfinite(a)])
    known = [s.stiffness_N_per_m for s in slips if math.isfinite(s.stiffness_N_per_m)]
    if not stiffness_N_per_m > 0 and known:
        stiffness_N_per_m = float(np.median(known))
    found = kept
    for _, fail, end in changes:
        if math.isfinite(fail):
            begin = max((b for a, b in turns if a < fail), default=float(time_s[0]))
            then = min((a for a, _ in turns if a > fail), default=float(time_s[-1]))
            read = read_between(time_s, force_N, [(begin, fail, end, then)], speed_m_s, stiffness_N_per_m, False)
            found = [*found, *(replace(slip, by_hand=True) for slip in read)]
    found = sorted(found, key=lambda slip: slip.fail_s)
    removed = {slips[number - 1].end_s for number in gone if number}
    for k, (before, slip) in enumerate(pairwise(found), start=1):
        if slip.by_hand or before.by_hand or slip.start_s in removed:
            begin, since = found[k - 1].end_s, slip.fail_s - before.fail_s
            found[k] = replace(slip, start_s=begin, recurrence_s=since, hold_s=slip.fail_s - begin)
    return tuple(found)


def _are_slips(found: Sequence[Slip], noise: float) -> bool:
    """Whether falls of a sliding force are slips and not its noise.

    Between slips the loading regains at one pace what was lost: its middle part tells of the whole. The highest and
    lowest values of correlated noise rise by half or double of what their middle tells about as often as not. Many
    falls at a regular pace are slips as well: noise has none.
    """
    if len(found) < _FEWEST_SLIPS:
        return False
    regained = np.array([b.peak_N - a.trough_N for a, b in pairwise(found)])
    told = np.array([b.loading_N_per_s * (b.fail_s - a.end_s) for a, b in pairwise(found)]) / regained
    steadily, count = int(np.count_nonzero((told > 0.5) & (told < 2.0))), told.size
    by_chance = sum(math.comb(count, k) for k in range(steadily, count + 1)) / 2**count
    recurrence = np.diff([s.fail_s for s in found])
    regular = count >= _MANY and recurrence.std() < _REGULAR * recurrence.mean()
    if by_chance <= _BY_CHANCE or regular:
        return True
    return steadily == count and min(s.drop_N for s in found) > _VERY_CLEAR * noise


def _spans(time: FloatArray, force: FloatArray, peaks: np.ndarray, drive_N_per_s: float) -> list[Span]:
    """Each slip between its turning points; what regains more force than the drive can supply is no slip.

    Such a swing back and forth is taken out: of the two peaks beside it the higher stays, of the two troughs the lower.
    """
    ends = [*peaks.tolist(), time.size][1:]
    turns: list[tuple[int, int]] = []
    supply = MOST_REGAINED * drive_N_per_s if drive_N_per_s > 0 else math.inf
    slack = 3.0 * sample_noise(force) if force.size > 2 else 0.0
    for peak, end in zip(peaks.tolist(), ends, strict=True):
        trough = peak + int(np.argmin(force[peak:end]))
        while turns and force[peak] - force[turns[-1][1]] > supply * (time[peak] - time[turns[-1][1]]) + slack:
            before, low = turns.pop()
            peak = before if force[before] > force[peak] else peak
            trough = low if force[low] < force[trough] else trough
        turns.append((peak, trough))
    spans, last = [], 0
    for k, (peak, trough) in enumerate(turns):
        after = turns[k + 1][0] if k + 1 < len(turns) else time.size - 1
        if peak - last > 1 or (k and peak > last):
            spans.append((float(time[last]), float(time[peak]), float(time[trough]), float(time[after])))
        last = trough
    return spans


def _noise_of_loadings(time: FloatArray, force: FloatArray, spans: list[Span]) -> float:
    """Standard deviation of the force about straight lines through the loadings; 0 where they have too few points."""
    total, count = 0.0, 0
    for start, peak, _, _ in spans:
        first, last = np.searchsorted(
            time, (start + _LOADING[0] * (peak - start), start + _LOADING[1] * (peak - start))
        )
        if last - first > _FEWEST:
            slope, middle_s, middle_N = line(time[first:last], force[first:last])
            away = force[first:last] - middle_N - slope * (time[first:last] - middle_s)
            total, count = total + float(away @ away), count + int(last - first) - 2
    return math.sqrt(total / count) if count else 0.0


def _without_impulses(force_N: FloatArray) -> FloatArray:
    """The force with each data point that stands out from both its neighbours by far more than noise put between them.

    A recorder too slow for its slips keeps their peaks, which a wider median would take off.
    """
    middle = median_of_three(force_N)
    away = np.abs(force_N - middle)
    return np.where(away > _IMPULSE * max(sample_noise(middle), float(away.mean())), middle, force_N)


def _line_between(
    time_s: FloatArray, force_N: FloatArray, begin_s: float, end_s: float
) -> tuple[float, float, float, int]:
    """Slope, middle time, middle force and number of points of a line over a range of time; NaN for fewer than two."""
    first, last = np.searchsorted(time_s, (begin_s, end_s))
    if last - first < 2:
        at = min(int(first), time_s.size - 1)
        return math.nan, float(time_s[at]), float(force_N[at]), 0
    return *line(time_s[first:last], force_N[first:last]), int(last - first)


def _common_slope(loadings: list[tuple[float, float, float, int]], times: FloatArray) -> float:
    """The slope that all loadings share, each weighted by what it tells of it; those far off are left out."""
    slopes, weights = np.array([found[0] for found in loadings]), times**2 * np.array([found[3] for found in loadings])
    good = np.isfinite(slopes) & (weights > 0)
    if not good.any():
        return math.nan
    middle = np.median(slopes[good])
    good &= np.abs(slopes - middle) <= _FAR * max(float(np.median(np.abs(slopes[good] - middle))), 1e-12 * abs(middle))
    return float(np.average(slopes[good], weights=weights[good]))


def _fall(
    time_s: FloatArray, force_N: FloatArray, span: Span, rate: float, settles: bool
) -> tuple[float, float, float, float] | None:
    """Failure (s), duration (s), force before and after (N) of a slip.

    The force is a line, half a swing down, and a line: least squares over the last part of the loading and the first
    of the next one, which is level where the force ``settles``. None where there is no fall to fit.
    """
    left_s, peak_s, trough_s, right_s = span
    pace = float(time_s[-1] - time_s[0]) / (time_s.size - 1)
    before, after = peak_s - left_s, right_s - trough_s
    a, b = np.searchsorted(
        time_s, (left_s + _LOADING[0] * before, min(right_s - _LOADING[0] * after, right_s) + pace / 2)
    )
    p, q = np.searchsorted(time_s, (peak_s, trough_s))
    if q <= p or b - a < _FEWEST:
        return None
    high, low = (float(np.median(force_N[max(k - 1, a) : k + 2])) for k in (p, q))
    part = force_N[p : q + 1]
    down = int(np.argmax(part <= low + (1.0 - _MIDDLE[1]) * (high - low)))
    still = np.flatnonzero(part[: down + 1] >= high - _MIDDLE[0] * (high - low))
    up = int(still[-1]) if still.size else 0
    lasts = max(float(time_s[p + down] - time_s[p + up]) / _OF_SWING, pace)
    fail = float(time_s[p + down] + time_s[p + up]) / 2.0 - lasts / 2.0
    best = None
    for _ in range(2):  # the second time over a range that fits the fall
        reach = max(_TIMES_FALL * lasts, _FEWEST_BESIDE * pace)
        beyond = _TIMES_SETTLING * lasts if settles else max(reach, _BESIDE * after)
        first, last = np.searchsorted(time_s, (fail - max(reach, _BESIDE * before), fail + lasts + beyond))
        first, last = max(int(first), int(a)), min(int(last) + 1, int(b))
        if last - first < _FEWEST:
            break
        factor = max(1, min((last - first) // _MOST_POINTS, int(lasts / pace) // 12))
        time, force = condense(time_s[first:last], factor), condense(force_N[first:last], factor)
        best = _half_swing(time, force, (fail, lasts), rate, pace, settles)
        if best is None:
            break
        changed = abs(best[1] - lasts)
        fail, lasts = best[:2]
        if changed < _SAME * lasts:
            break
    return None if best is None or best[2] <= best[3] else best


def _half_swing(
    time: FloatArray, force: FloatArray, start: tuple[float, float], rate: float, pace: float, settles: bool
) -> tuple[float, float, float, float] | None:
    """Failure, duration and the forces before and after that fit best, by Gauss-Newton with the lines solved for."""

    def around(fail: float, lasts: float) -> tuple[float, FloatArray, Callable[[], FloatArray]]:
        """Squares left over by the best lines, their forces, and what gives the step in failure and duration that
        lowers them."""
        share = (time - fail) / lasts
        inside = np.clip(share, 0.0, 1.0)
        fallen = 0.5 - 0.5 * np.cos(np.pi * inside)
        is_before, is_after = share < 0.0, share > 1.0
        before = np.where(is_before, time - fail, 0.0)
        after = np.where(is_after & (not settles), time - fail - lasts, 0.0)
        known = force
        columns = [1.0 - fallen, fallen]
        slopes = []
        for beside, points in ((before, is_before), (after, is_after)):
            if np.count_nonzero(points) >= _FEWEST and beside.any():
                slopes.append(len(columns))
                columns.append(beside)
            else:
                slopes.append(-1)
                known = known - rate * beside if math.isfinite(rate) else known
        basis = np.array(columns)
        normal = basis @ basis.T
        normal.flat[:: normal.shape[0] + 1] *= 1.0 + 1e-9
        level = np.asarray(np.linalg.solve(normal, basis @ known))
        away = known - level @ basis
        b, c = (level[k] if k >= 0 else rate if math.isfinite(rate) else 0.0 for k in slopes)
        c = 0.0 if settles else c

        def step() -> FloatArray:
            steepness = (level[1] - level[0]) * (0.5 * np.pi / lasts) * np.sin(np.pi * inside)
            by = np.array([-steepness - b * is_before - c * is_after, -steepness * inside - c * is_after])
            full = np.concatenate((basis, by))
            both = full @ full.T
            both.flat[:: both.shape[0] + 1] *= 1.0 + 1e-9
            return np.asarray(np.linalg.solve(both, full @ away)[-2:])

        return float(away @ away), level, step

    fail, lasts = start
    try:
        if lasts < _NEARLY_STEP * pace:  # its place among the samples is searched, for no slope leads there
            tried = [(fail + lasts / 2 - t / 2 + d, t) for d in _PLACES * pace for t in _LENGTHS * pace]
            fail, lasts = min(tried, key=lambda place: around(*place)[0])
        now, level, further = around(fail, lasts)
        for _ in range(_MOST_STEPS):
            step = np.clip(further(), -0.4 * lasts, 0.4 * lasts)
            for _ in range(4):
                there = fail + float(step[0]), max(lasts + float(step[1]), 0.25 * pace)
                then = around(*there)
                if then[0] < now:
                    break
                step = step / 3.0
            else:
                break
            gained, (fail, lasts), (now, level, further) = now - then[0], there, then
            if gained < 1e-4 * now:
                break
    except np.linalg.LinAlgError:
        return None
    return fail, lasts, float(level[0]), float(level[1])
