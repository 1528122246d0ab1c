"""The signal of a trace, checked before friction is determined: faults, spikes, noise.

Before it what all steps use of samples: their noise, smoother forms, a line through them, a mean with its uncertainty.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from tribo.errors import Problem, TraceError
from tribo.records import MEDIAN_TO_SD, FloatArray, Trace

BLOCKS = 16  # blocks a window is cut into; enough for a variogram, few enough to be longer than the correlation
_SLOPE_U = 0.35  # standard uncertainty of a variogram's slope over BLOCKS blocks, as a share of level over mean lag
_DEGREES = (1, 3, 5, 7, 9)  # of the polynomial that takes off the drift of a level: the first that leaves none
_SLOWEST = 3  # coefficients after it in which drift that is left
_STANDS_OUT = 2.3  # by this many times the variance of all
_COSINES = 8  # coefficients after it that tell the noise of its mean
_FEWEST_OF_LEVEL = 12  # samples from which on a mean has an interval
_MEANS_OF_LEVEL = 600  # of a long level: thirty for each half wave of the fastest coefficient
_FAR = 8  # samples over which noise has forgotten itself for the most part
_FEWEST_OF_NOISE = 60  # samples that tell of it
_MOST_ALIKE = 0.9  # correlation of neighbours up to which noise is told from the course of a force
NORMAL_95 = 1.96
MINIMUM_SAMPLES = 20
SPIKE_OVER_NOISE = 8.0
SPIKE_OVER_NEIGHBOURS = 3.0
SPIKE_RETURN = 0.5
SPIKE_WIDTHS = (1, 2, 3)
_NEIGHBOURS = 4
_MOST_LISTED = 20
_MOST_IMPULSES = 20  # more of them belong to the signal, as slips or as its own noise, where they stay within its range
_CHANCE_OF_FLAT_TOP = 1e-4
_SHORTEST_FLAT_TOP = 4
_SHORTEST_STANDSTILL = 20
_NO_NOISE = 1e-4  # noise over range below which a trace was never measured, and may stand still
_AT_ZERO = 0.2  # share of the range below which a force may stand still: nothing pulls
_SMOOTHED = 2000  # samples averaged before levels are searched: none up to this many, then this part of the trace
_WRAP_SHARE = 0.4  # of the range of a record, by which a recorder that exceeds its range jumps at least
_COARSE_STEP = 0.03  # of the range of a record, below which the step of a recorder is no matter
_MOST_BLOCKS = 1000  # of a long record, whose noise they tell as well
_REPEATED_BLOCK = 24  # samples of noise that are not twice the same by chance
_COARSE = 0.5  # share of equal neighbours from which on a resolution is too coarse to tell clipping


def sample_noise(values: FloatArray) -> float:
    """Standard deviation of the sample-to-sample noise, blind to levels, slopes and single jumps.

    Median of the absolute second differences, scaled for white normal noise (factor sqrt 6). Where more than
    half of them vanish (a coarse resolution), their root mean square. NaN for fewer than three samples.
    """
    if values.size < 3:
        return math.nan
    second = np.abs(values[2:] - 2.0 * values[1:-1] + values[:-2])
    typical = MEDIAN_TO_SD * float(np.median(second))
    if typical <= 0.0:
        typical = math.sqrt(float(second @ second) / second.size)
    return typical / math.sqrt(6.0)


def correlated_noise(values: FloatArray, counts: NDArray[np.bool_]) -> tuple[float, float]:
    """Standard deviation of noise that may be correlated over a few samples, and the correlation of neighbours.

    Medians of the second differences over one sample and over eight, where ``counts`` (n,) holds at their middles: as
    :func:`sample_noise`, they are blind to levels and slopes. 0 of fewer than sixty of them.
    """
    counts = counts[_FAR:-_FAR]
    if np.count_nonzero(counts) < _FEWEST_OF_NOISE:
        return 0.0, 0.0
    middle = values[_FAR:-_FAR]
    near = values[_FAR + 1 : values.size - _FAR + 1] - 2.0 * middle + values[_FAR - 1 : -_FAR - 1]
    far = values[2 * _FAR :] - 2.0 * middle + values[: -2 * _FAR]
    near_N, far_N = (MEDIAN_TO_SD * float(np.median(np.abs(second[counts]))) for second in (near, far))
    alike = np.linspace(0.0, _MOST_ALIKE, 91)
    over_far = 6.0 - 8.0 * alike**_FAR + 2.0 * alike ** (2 * _FAR)
    best = int(np.argmin(np.abs((6.0 - 8.0 * alike + 2.0 * alike**2) / over_far * far_N**2 - near_N**2)))
    return far_N / math.sqrt(float(over_far[best])), float(alike[best])


def noise_of(force: FloatArray) -> float:
    """Sample noise, or a small fraction of the range if the trace has none, so that it can be a denominator."""
    return max(sample_noise(force), 1e-6 * float(np.ptp(force)))


def line(time_s: FloatArray, force_N: FloatArray) -> tuple[float, float, float]:
    """Least-squares line as (slope, mean time, mean force); slope 0 where all times are equal."""
    t = float(time_s.mean())
    away = time_s - t
    spread = float(away @ away)
    return (float(away @ force_N) / spread if spread > 0 else 0.0), t, float(force_N.mean())


def condense(values: FloatArray, factor: int) -> FloatArray:
    """Means of ``factor`` consecutive samples; a remainder is left out."""
    if factor <= 1:
        return values
    count = values.size // factor
    return np.asarray(np.add.reduce(values[: count * factor].reshape(count, factor), axis=1) / factor)


def median_of_three(values: FloatArray) -> FloatArray:
    """Median of every sample and its two neighbours, the ends as beside them: takes out what lasts one sample."""
    low, high = np.minimum(values[:-1], values[1:]), np.maximum(values[:-1], values[1:])
    middle = np.maximum(np.minimum(high[:-1], values[2:]), low[:-1])
    return np.concatenate((middle[:1], middle, middle[-1:]))


def runs_of(mask: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Starts and ends (exclusive) of the runs of samples in which a mask holds."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], mask, [False]))))
    return edges[::2], edges[1::2]


def running_mean(values: FloatArray, width: int) -> FloatArray:
    """Centred mean over ``width`` samples (made odd), shorter at the ends; same length as ``values``."""
    half = width // 2
    if half == 0:
        return values
    total = np.concatenate(([0.0], np.cumsum(values)))
    found, width, n = np.empty(values.size), 2 * half + 1, values.size
    if n > width:  # without arrays of indices, which are larger than a long record
        np.subtract(total[width:], total[:-width], out=found[half : n - half])
        found[half : n - half] /= width
    edges = np.arange(n) if n <= width else np.concatenate((np.arange(half), np.arange(n - half, n)))
    low, high = np.maximum(edges - half, 0), np.minimum(edges + half + 1, n)
    found[edges] = (total[high] - total[low]) / (high - low)
    return found


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


def wander(values: FloatArray, duration_s: float) -> tuple[float, float, float]:
    """Split the departures of ``values`` (spread evenly over ``duration_s``) into stationary noise and a slow walk.

    Returns the standard uncertainty of the mean from correlated but stationary noise, the variance that a random walk
    gathers per second (unit of the signal squared, per second), and the noise of a single sample.

    The mean squared difference of block means h blocks apart is 2 s^2 + q (h - 1/3) t_block for noise of
    block variance s^2 on top of a random walk of variance rate q (the 1/3 is what averaging within blocks
    takes off). A straight line through the variogram at lags of 1 to a quarter of the blocks gives both. With
    so few blocks the slope is uncertain: the rate returned is half-way between the expectation of the slope and a walk
    that explains all the variance not due to white noise, so that it is never zero by chance.
    """
    noise = sample_noise(values)
    means = condense(values, max(1, values.size // BLOCKS))  # of BLOCKS blocks; fewer where there are fewer samples
    count = means.size
    if count < 4:
        spread = float(values.std(ddof=1)) / math.sqrt(values.size) if values.size > 1 else math.nan
        return spread, 0.0, noise
    later, earlier, to_level, to_slope, centre = _variogram_line(count)
    squares = (means[later] - means[earlier]) ** 2
    level, slope = float(to_level @ squares), float(to_slope @ squares)
    white = noise**2 * count / values.size
    most = max(level - 2.0 * white, 0.0) / centre
    slope = (_mean_within(slope, _SLOPE_U * level / centre, most) + most) / 2.0
    stationary = max(level - slope * centre, 2.0 * white) / 2.0
    rate = slope * count / duration_s if duration_s > 0 else 0.0
    return math.sqrt(stationary / count), rate, noise


@lru_cache(maxsize=BLOCKS * 2)
def _variogram_line(count: int) -> tuple[NDArray[np.int64], NDArray[np.int64], FloatArray, FloatArray, float]:
    """Pairs of blocks (later, earlier), weights of their squared differences for level and slope, and the mean lag.

    A weighted straight line over lags of 1 to a quarter of ``count`` blocks; long lags overlap and count less.
    """
    earlier, later = np.triu_indices(count, 1)
    lags = np.arange(1, max(2, count // 4) + 1)
    near = later - earlier <= lags[-1]
    earlier, later = earlier[near], later[near]
    weights = (count - lags) / lags
    weights = weights / weights.sum()
    x = lags - 1.0 / 3.0
    centre = float(weights @ x)
    away = weights * (x - centre)
    lag = later - earlier
    level, slope = weights / (count - lags), away / (away @ x) / (count - lags)
    return later, earlier, level[lag - 1], slope[lag - 1], centre


def _mean_within(estimate: float, u: float, most: float) -> float:
    """Mean of a normal distribution (estimate, u) cut off below 0 and above ``most``."""
    if most <= 0.0 or u <= 0.0:
        return 0.0
    low, high = -estimate / u, (most - estimate) / u
    mass = 0.5 * (math.erf(high / math.sqrt(2.0)) - math.erf(low / math.sqrt(2.0)))
    if mass < 1e-6:
        return min(max(estimate, 0.0), most)
    density = (math.exp(-low * low / 2.0) - math.exp(-high * high / 2.0)) / math.sqrt(2.0 * math.pi)
    return estimate + u * density / mass


def mean_of_level(values: FloatArray) -> tuple[float, float, float]:
    """Mean of a level and its 95 % interval under correlated noise and slow drift; an infinite one of too few samples.

    Noise and drift are told apart by the cosine coefficients of the level (Phillips 2005, Econometric Theory 21, 116;
    Mueller 2007, J. Econometrics 141, 1331), which split it by how slowly it changes. A low polynomial takes off the
    slowest, which is drift of the level and no noise; the next ones give the variance of the mean, correlation counted,
    with as many degrees of freedom. The interval is of the mean over these samples: how far a level drifts within them
    is no uncertainty of it.
    """
    mean = float(values.mean())
    if values.size < _FEWEST_OF_LEVEL:
        return mean, -math.inf, math.inf
    means = condense(values, values.size // _MEANS_OF_LEVEL)
    n = means.size
    powers = _polynomials(n)
    for degree in _DEGREES:
        rest = means - (means @ powers[:, : degree + 1]) @ powers[:, : degree + 1].T
        variance, dof = variance_of_slow(rest, degree + 1, _COSINES)
        slowest, _ = variance_of_slow(rest, degree + 1, _SLOWEST)
        if slowest < _STANDS_OUT * variance or n < 4 * (degree + dof):
            break
    half = of_student(dof) * math.sqrt(variance / n)
    return mean, mean - half, mean + half


def variance_of_slow(
    rest: FloatArray, first: int, count: int, fitted: FloatArray | None = None
) -> tuple[float, int]:
    """Variance of slow noise per sample by ``count`` cosine coefficients from ``first`` on of residuals, and their
    number, which is smaller where samples are few.

    ``fitted`` (n, parameters) is what was fitted: its share of these coefficients is no longer in the residuals.
    """
    cosines = min(count, rest.size // 4)
    basis = _cosines(rest.size, first, cosines)
    lost = 0.0 if fitted is None else float(((basis @ np.linalg.qr(fitted)[0]) ** 2).sum())
    return float(((basis @ rest) ** 2).sum()) / max(cosines - lost, 1.0), max(cosines - math.ceil(lost), 1)


@lru_cache(maxsize=64)
def _polynomials(n: int) -> FloatArray:
    """Orthonormal polynomials of the degrees 0, 1, 2, ... in the columns of (n, 10)."""
    along = np.linspace(-1.0, 1.0, n)
    return np.asarray(np.linalg.qr(np.polynomial.legendre.legvander(along, max(_DEGREES)))[0])


@lru_cache(maxsize=64)
def _cosines(n: int, first: int, count: int) -> FloatArray:
    index = np.arange(first, first + count)
    return np.asarray(np.cos(np.pi * np.outer(index, (np.arange(n) + 0.5) / n)) * math.sqrt(2.0 / n))


@lru_cache(maxsize=1024)
def of_student(dof: int) -> float:
    """Half width of a 95 % interval in standard uncertainties."""
    from scipy.special import stdtrit

    return float(stdtrit(dof, 0.975))


def steady(time_s: FloatArray, force: FloatArray) -> tuple[float, float, float, float]:
    """Mean force over a window (N), its standard uncertainty from noise, correlation counted, the drift (N/s) and the
    sample noise (N).

    The uncertainty is that whose 1.96-fold is the half width of the 95 % interval of :func:`mean_of_level`.
    """
    mean, low, high = mean_of_level(force)
    mean_u = (high - low) / 2.0 / NORMAL_95
    if not math.isfinite(mean_u):
        mean_u = float(force.std(ddof=1)) / math.sqrt(force.size) if force.size > 1 else math.nan
    return mean, mean_u, line(time_s, force)[0], sample_noise(force)


@dataclass(frozen=True)
class Signal:
    """Force against time that can be read; arrays (n,) share the trace's samples.

    No two samples share a time, and the force is free of impulses, which ``problems`` list; where there are many within
    the range of the force, they belong to the signal and stay in it (``impulsive``). ``calm_N`` is the force
    without what lasts one sample, ``smooth_N`` that smoothed, ``noise_N`` the noise of a sample. ``recorder_fault``
    says how the recorder failed, if it did. ``displacement_m`` is None where the trace has none.
    """

    time_s: FloatArray
    force_N: FloatArray
    calm_N: FloatArray
    smooth_N: FloatArray
    displacement_m: FloatArray | None
    noise_N: float
    recorder_fault: Problem | None
    problems: tuple[Problem, ...]
    file: str
    impulsive: bool = False


def signal_of(trace: Trace) -> Signal:
    """The signal of a trace, not yet counted from any zero.

    Raises
    ------
    TraceError
        ``too_short``, ``nan_gap``, ``time_goes_back``, ``time_stands_still``.
    """
    if faults := unreadable(trace):
        raise TraceError(faults)
    time = apart_in_time(np.asarray(trace.time_s, float))
    raw = np.asarray(trace.force_N, float)
    noise = noise_of(raw)
    spikes = impulse_spikes(raw, noise)
    if impulsive := belong_to_signal(raw, spikes):
        spikes = np.zeros(raw.size, bool)
    problems = spike_problems(trace, spikes)
    force = without_spikes(raw, spikes)
    fault = recorder_fault(trace, force)
    noise = min(noise, noise_of(force)) if problems else noise
    calm = median_of_three(force)
    smooth = running_mean(calm, max(1, force.size // _SMOOTHED))
    displacement = None if trace.displacement_m is None else np.asarray(trace.displacement_m, float)
    return Signal(time, force, calm, smooth, displacement, noise, fault, problems, trace.file, impulsive)


def unreadable(trace: Trace) -> list[Problem]:
    """Faults that leave no signal to read: too few samples, gaps, numbers that are none, time running back."""
    n = trace.force_N.size
    if n < MINIMUM_SAMPLES:
        what = f"a pull of {n} data points is too short"
        return [Problem("too_short", what, trace.file, found=str(n), allowed=f"{MINIMUM_SAMPLES} data points or more")]
    problems = []
    for name, values in (("time", trace.time_s), ("force", trace.force_N)):
        if not np.isfinite(values).all():
            finite = np.isfinite(values)
            at = int(np.argmin(finite))
            what = f"{int(n - finite.sum())} values of the {name} are missing"
            problems.append(Problem("nan_gap", what, trace.file, trace.first_row + at, name))
    back = np.diff(trace.time_s) < 0
    if back.any():
        at = int(np.argmax(back)) + 1
        found = f"{trace.time_s[at]:g} s after {trace.time_s[at - 1]:g} s"
        problems.append(
            Problem("time_goes_back", "the time decreases", trace.file, trace.first_row + at, "time", found)
        )
    if not problems and trace.time_s[0] == trace.time_s[-1]:
        problems.append(Problem("time_stands_still", "all times are the same", trace.file or None, column="time"))
    return problems


def apart_in_time(time_s: FloatArray) -> FloatArray:
    """Times with samples that share a stamp spread evenly up to the next, the last ones at the pace of the record."""
    new = np.concatenate(([True], np.diff(time_s) > 0))
    if new.all():
        return time_s
    index = np.append(np.flatnonzero(new), time_s.size)
    pace = (time_s[-1] - time_s[0]) / max(index[-2], 1)
    stamps = np.append(time_s[new], time_s[-1] + pace * (index[-1] - index[-2]))
    return np.asarray(np.interp(np.arange(time_s.size), index, stamps))


def impulse_spikes(force: FloatArray, noise: float) -> NDArray[np.bool_]:
    """Mask (n,) of impulses of one to three samples: out and back by far more than noise and than the samples around.

    Samples belong to an impulse if the step out of them takes back the step into them to within half, and the smaller
    of the two exceeds ``SPIKE_OVER_NOISE`` times the noise and ``SPIKE_OVER_NEIGHBOURS`` times the largest step within
    ``_NEIGHBOURS`` samples on either side. The apex of a pull and stick-slip have like steps beside them, and a peak
    seen by one sample does not fall back to where it came from.
    """
    steps = np.diff(force)
    size = np.abs(steps)
    mask = np.zeros(force.size, bool)
    large = np.flatnonzero(size > SPIKE_OVER_NOISE * noise)
    both_ways = large.size > 0 and float(steps[large].min()) < 0 < float(steps[large].max())
    for width in SPIKE_WIDTHS if both_ways else ():
        first = large[: np.searchsorted(large, steps.size - width)]
        lower = np.minimum(size[first], size[first + width])
        back = np.abs(steps[first] + steps[first + width]) < SPIKE_RETURN * lower
        back &= lower > SPIKE_OVER_NOISE * noise
        first, lower = first[back], lower[back]
        if first.size:
            beside = np.concatenate((np.arange(-_NEIGHBOURS, 0), width + np.arange(1, _NEIGHBOURS + 1)))
            index = first[:, None] + beside
            inside = (index >= 0) & (index < size.size)
            largest = np.where(inside, size[np.clip(index, 0, size.size - 1)], 0.0).max(axis=1)
            apart = first[lower > SPIKE_OVER_NEIGHBOURS * largest]
            mask[(apart[:, None] + 1 + np.arange(width)).ravel()] = True
    inner = force[1:-1]
    low, high = float(inner.min()), float(inner.max())
    for end in (0, -1):  # nothing shows whether the force came back: only what lies far beyond all else counts
        mask[end] = not low - (high - low) < force[end] < high + (high - low)
    return mask


def spike_problems(trace: Trace, spikes: NDArray[np.bool_]) -> tuple[Problem, ...]:
    """One Problem of kind ``spike`` a spiked sample, with its row and value; the last of many counts the rest."""
    at = np.flatnonzero(spikes)
    problems = [
        Problem(
            "spike",
            f"a spike at {trace.time_s[k]:.6g} s; this data point is left out",
            trace.file or None,
            trace.first_row + int(k),
            "force",
            f"{trace.force_N[k]:.6g} N",
        )
        for k in at[:_MOST_LISTED]
    ]
    if at.size > _MOST_LISTED:
        what = f"{at.size - _MOST_LISTED} more spikes; these data points are left out"
        problems.append(Problem("spike", what, trace.file or None, trace.first_row + int(at[_MOST_LISTED]), "force"))
    return tuple(problems)


def belong_to_signal(force: FloatArray, spikes: NDArray[np.bool_]) -> bool:
    """Whether impulses are slips or noise of the contact: many, and most no larger than the force itself varies.

    Friction cannot jump by more than its own range; a fault of the cable or the recorder can.
    """
    if np.count_nonzero(spikes) <= _MOST_IMPULSES:
        return False
    rest = without_spikes(force, spikes)
    low, high = np.quantile(rest, (0.01, 0.99))
    return bool(np.median(np.abs(force - rest)[spikes]) < high - low)


def without_spikes(force: FloatArray, spikes: NDArray[np.bool_]) -> FloatArray:
    """The force with spiked samples replaced by a straight line between their neighbours."""
    if not spikes.any():
        return force
    index = np.arange(force.size)
    return np.interp(index, index[~spikes], force[~spikes])


def recorder_fault(trace: Trace, force: FloatArray) -> Problem | None:
    """How the recorder failed, if it did: beyond its range, saturated at the largest force, or stuck at one value.

    ``force`` (n,) is that of the trace with impulses taken out; the other two show in the force as recorded.
    """
    raw = np.asarray(trace.force_N, float)
    if wrap := wrapped(raw):
        first, samples, range_N, beyond_N = wrap
        jumps = f"the force jumps down by {range_N:.4g} N where it is largest, and back, for {samples} data points"
        what = f"{jumps}: the range of the recorder was exceeded and it counted on from its other end"
        found = f"{raw[first]:.6g} N after {raw[first - 1]:.6g} N; the peak is {beyond_N:.3g} N above the range"
        return Problem("wrapped", what, trace.file or None, trace.first_row + first, "force", found)
    if clipped := flat_top(force):
        kind, (first, run) = "saturated", clipped
        stays = f"the force stays at its largest value for {run} data points"
        what = f"{stays}: the load cell or the recorder was saturated"
    elif still := standstill(raw):
        kind, (first, run) = "stuck", still
        what = f"the force keeps the same value for {run} data points: the sensor or the recorder stopped working"
    else:
        return None
    found = f"{trace.force_N[first]:.6g} N"
    return Problem(kind, what, trace.file or None, trace.first_row + first, "force", found)


def flat_top(force: FloatArray) -> tuple[int, int] | None:
    """(first index, length) of a run of equal samples at the largest force that chance does not give, or None.

    Chance is the share of equal neighbours elsewhere in the trace: a coarse resolution repeats values
    everywhere, clipping only at the top.
    """
    largest = float(force.max())
    top = force >= largest - 1e-9 * (largest - float(force.min()))
    if np.count_nonzero(top) < _SHORTEST_FLAT_TOP:
        return None
    starts, ends = runs_of(top)
    longest = int(np.argmax(ends - starts))
    start, run = int(starts[longest]), int(ends[longest] - starts[longest])
    if run < _SHORTEST_FLAT_TOP:
        return None
    pairs = force[1:] == force[:-1]
    inside = top[1:] & top[:-1]
    return (start, run) if _beyond_chance(run, pairs[~inside], force.size) else None


def _beyond_chance(run: int, pairs_elsewhere: NDArray[np.bool_], samples: int) -> bool:
    """Whether chance hardly gives a run of equal samples, by the share of equal neighbours elsewhere."""
    share = (int(pairs_elsewhere.sum()) + 1.0) / (max(pairs_elsewhere.size, 1) + 2.0)
    return share <= _COARSE and (run - 1) * math.log(share) + math.log(samples) <= math.log(_CHANCE_OF_FLAT_TOP)


def standstill(force: FloatArray) -> tuple[int, int] | None:
    """(first index, length) of the longest run of equal samples while something pulls, if chance does not give it.

    A signal that is noisy elsewhere and then repeats one value to the last digit was not measured there. Runs near the
    lowest force of a trace are left alone (a zero band), and so are traces without noise.
    """
    equal = force[1:] == force[:-1]
    if np.count_nonzero(equal) < _SHORTEST_STANDSTILL:
        return None
    starts, ends = runs_of(equal)
    low, span = float(force.min()), float(np.ptp(force))
    lengths = np.where(force[starts] - low > _AT_ZERO * span, ends - starts, 0)
    longest = int(np.argmax(lengths))
    start, run = int(starts[longest]), int(lengths[longest]) + 1
    if run < _SHORTEST_STANDSTILL:
        return None
    elsewhere = np.concatenate((force[:start], force[start + run :]))
    pairs = np.concatenate((equal[:start], equal[start + run - 1 :]))
    if elsewhere.size < MINIMUM_SAMPLES or not _beyond_chance(run, pairs, force.size):
        return None
    return None if sample_noise(elsewhere) < _NO_NOISE * span else (start, run)


def wrapped(force: FloatArray) -> tuple[int, int, float, float] | None:
    """Where a force beyond the range of the recorder goes on from its other end (16 bit: -32768 follows 32767).

    Returns the first sample there, the number of such samples, the range (N) and by how much (N) the force exceeds the
    largest value that the range holds; None where there is no such part. Moved up by the range, every such part goes on
    above the largest force beside it: a dropout does not.
    """
    span, noise = float(np.ptp(force)), noise_of(force)
    steps = np.diff(force)
    large = np.flatnonzero(np.abs(steps) > max(_WRAP_SHARE * span, SPIKE_OVER_NOISE * noise))
    if large.size < 2 or large.size > force.size // 4 or steps[large[0]] > 0:
        return None
    down, up = large[::2], large[1::2]
    if large.size % 2 or (steps[down] > 0).any() or (steps[up] < 0).any():
        return None
    beyond = np.zeros(force.size, bool)
    for first, last in zip(down, up, strict=True):
        beyond[first + 1 : last + 1] = True
    if np.count_nonzero(beyond) <= max(SPIKE_WIDTHS):  # an impulse, which is left out
        return None
    small = np.abs(steps[~np.isin(np.arange(steps.size), large)])
    usual = max(float(small.max()), 4.0 * noise)  # between two samples
    top = float(force[~beyond].max())
    range_N = float(np.median(np.abs(steps[large]))) + usual / 2.0
    sizes = np.abs(steps[large])
    edges = np.concatenate((force[down], force[up + 1]))
    restored = force[beyond] + float(sizes.max())
    if np.ptp(sizes) > 2.0 * usual or (edges < top - 2.0 * usual).any() or 3.0 * usual > range_N:
        return None
    if restored.min() < top - usual or restored.mean() <= top:
        return None
    return int(down[0]) + 1, int(beyond.sum()), range_N, float(restored.max()) - top


def odd_signal(trace: Trace) -> list[Problem]:
    """Doubts of a force that was read although its samples look like no measurement, each with its size in newtons.

    ``clipped``: the largest samples vary less than noise elsewhere allows. ``toggles``: for a while the sensor gave the
    same value and its neighbours only. ``coarse``: the steps of the recorder are larger than the noise and not small
    against the force. ``repeated_samples``: a stretch of samples is there twice, or every sample.
    """
    force = np.asarray(trace.force_N, float)
    noise = _block_noise(force)
    typical, large = (float(value) for value in np.quantile(noise, (0.5, 0.8)))
    found = [_clipped(force, typical) or _toggling(force, large), _coarse(force), _repeated(force, typical)]
    file = trace.file or None
    return [
        Problem(kind, what, file, trace.first_row + at, "force", size)
        for kind, what, at, size in filter(None, found)
    ]  # fmt: skip


Oddness = tuple[str, str, int, str]  # kind, sentence, sample, what was found


def _resolution(force: FloatArray) -> float:
    """The smallest difference between two values of a record; 0 where all are one."""
    steps = np.diff(np.unique(force))
    steps = steps[steps > 1e-9 * float(np.ptp(force))] if steps.size else steps
    return float(steps.min()) if steps.size else 0.0


def _block_noise(force: FloatArray) -> FloatArray:
    """Noise of a sample in each block of a record (blocks,), each as :func:`sample_noise` tells it; 0 of few samples.

    A quantile of it is not that of a still stretch, nor of a slip.
    """
    blocks = max(1, min(force.size // 16, _MOST_BLOCKS))
    size, larger = divmod(force.size, blocks)
    if size < MINIMUM_SAMPLES // 2:
        return np.zeros(1)
    at = larger * (size + 1)
    found = []
    for part in (force[:at].reshape(larger, size + 1), force[at:].reshape(blocks - larger, size)):
        second = np.abs(part[:, 2:] - 2.0 * part[:, 1:-1] + part[:, :-2])
        typical = MEDIAN_TO_SD * np.median(second, axis=1)
        found.append(np.where(typical > 0.0, typical, np.sqrt((second**2).mean(axis=1))) / math.sqrt(6.0))
    return np.concatenate(found)


def _narrowest(
    force: FloatArray, noise: float, resolution: float, lengths: Sequence[int], above: float
) -> tuple[int, int] | None:
    """First sample and length of the stretch above a level that is narrower than normal noise ever makes it, or None.

    The range of L normal samples is r or less with a chance of about L (r / (sqrt(2 pi) s))^(L - 1) for small r.
    """
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    best: tuple[float, int, int] | None = None
    for length in (n for n in lengths if n < force.size // 2):
        origin = -(length // 2) + (1 - length % 2)
        low = minimum_filter1d(force, length, origin=origin)[: force.size - length + 1]
        width = maximum_filter1d(force, length, origin=origin)[: low.size] - low
        width = np.where(low >= above, width, np.inf)
        at = int(np.argmin(width))
        share = (float(width[at]) + resolution) / (math.sqrt(2.0 * math.pi) * noise)
        if not share < 0.5:
            continue
        log_chance = math.log(length * force.size) + (length - 1) * math.log(share)
        if log_chance <= math.log(_CHANCE_OF_FLAT_TOP) and (best is None or log_chance < best[0]):
            best = log_chance, at, length
    return None if best is None else best[1:]


def _clipped(force: FloatArray, noise: float) -> Oddness | None:
    resolution = _resolution(force)
    if not noise > 2.0 * resolution:
        return None
    top = float(force.max())
    found = _narrowest(force, noise, resolution, (8, 10, 14, 20, 30, 50), top - 2.0 * noise)
    if found is None:
        return None
    at, length = found
    before = force[max(at - length, 0) : at]
    rise = (float(np.median(force[at : at + length])) - float(before[: max(before.size // 4, 1)].mean())) if at else 0.0
    if rise < 5.0 * noise:  # a level, not the top of a rise
        return None
    width = float(np.ptp(force[at : at + length]))
    steady = f"the largest force varies by {width:.3g} N over {length} data points, and noise alone by more"
    what = f"{steady}: the load cell or the recorder may have been saturated"
    size = f"{top:.6g} N; the peak may be up to {rise * 0.5:.2g} N higher"
    return "clipped", what, at, size


def _toggling(force: FloatArray, noise: float) -> Oddness | None:
    resolution = _resolution(force)
    if not noise > 2.0 * resolution:
        return None
    above = float(force.min()) + _AT_ZERO * float(np.ptp(force))
    found = _narrowest(force, noise, resolution, (20, 30, 50, 100, 200), above)
    if found is None:
        return None
    at, length = found
    part = force[at : at + length]
    if np.unique(part).size > 3 or standstill(force):
        return None
    width = float(np.ptp(part))
    what = f"the force keeps within {width:.3g} N for {length} data points, with noise of {noise:.2g} N elsewhere"
    return "toggles", f"{what}: the sensor may have stopped working", at, f"{part[0]:.6g} N"


def _coarse(force: FloatArray) -> Oddness | None:
    step, span = _resolution(force), float(np.ptp(force))
    equal = float(np.mean(force[1:] == force[:-1])) if force.size > 1 else 0.0
    if not (step > _COARSE_STEP * span and equal > _COARSE):
        return None
    what = f"the force was recorded in steps of {step:.3g} N, which are larger than its noise"
    return "coarse", what, 0, f"friction forces are uncertain by up to {step / 2:.2g} N"


def _repeated(force: FloatArray, noise: float) -> Oddness | None:
    if force.size < 4 * _REPEATED_BLOCK or not noise > 2.0 * _resolution(force):
        return None
    pairs = force[1:] == force[:-1]
    if max(pairs[::2].mean(), pairs[1::2].mean()) > 0.9 and min(pairs[::2].mean(), pairs[1::2].mean()) < _COARSE:
        what = "every data point is there twice: the uncertainties of means are too small by a third"
        return "repeated_samples", what, 0, f"noise {noise:.2g} N"
    windows = np.lib.stride_tricks.sliding_window_view(force, _REPEATED_BLOCK)[:: 1 if force.size < 200_000 else 7]
    varied = np.flatnonzero(np.ptp(windows, axis=1) > noise)
    places: dict[bytes, int] = {}
    kept = 1 if force.size < 20_000 else 16  # of a long record every 16th place is kept, and all are looked up
    for at in varied.tolist():
        block = windows[at].tobytes()
        first = places.get(block, at)
        if at % kept == 0:
            places.setdefault(block, at)
        if first != at:
            what = f"{_REPEATED_BLOCK} data points or more are those of an earlier part of the record, digit by digit"
            return "repeated_samples", what, at, f"{force[at]:.6g} N, as {at - first} data points before"
    return None
