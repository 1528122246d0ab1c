"""What samples say: their noise, smoother forms of them, a line through them, a mean with its uncertainty."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from tribo.records import FloatArray

BLOCKS = 16  # blocks a window is cut into; enough for a variogram, few enough to be longer than the correlation
_SLOPE_U = 0.35  # standard uncertainty of a variogram's slope over BLOCKS blocks, as a share of level over mean lag
_MEDIAN_TO_SD = 1.4826  # of a normal distribution


def sample_noise(values: FloatArray) -> float:
    """Standard deviation of the sample-to-sample noise, blind to levels, slopes and single jumps.

    Median of the absolute second differences, scaled for white normal noise (factor sqrt 6). Where more than
    half of them vanish (a coarse resolution), their root mean square. NaN for fewer than three samples.
    """
    if values.size < 3:
        return math.nan
    second = np.abs(values[2:] - 2.0 * values[1:-1] + values[:-2])
    typical = _MEDIAN_TO_SD * float(np.median(second))
    if typical <= 0.0:
        typical = math.sqrt(float(second @ second) / second.size)
    return typical / math.sqrt(6.0)


def noise_of(force: FloatArray) -> float:
    """Sample noise, or a small fraction of the range if the trace has none, so that it can be a denominator."""
    return max(sample_noise(force), 1e-6 * float(np.ptp(force)))


def line(time_s: FloatArray, force_N: FloatArray) -> tuple[float, float, float]:
    """Least-squares line as (slope, mean time, mean force); slope 0 where all times are equal."""
    t = float(time_s.mean())
    away = time_s - t
    spread = float(away @ away)
    return (float(away @ force_N) / spread if spread > 0 else 0.0), t, float(force_N.mean())


def block_means(values: FloatArray, blocks: int = BLOCKS) -> FloatArray:
    """Means of ``blocks`` consecutive equal blocks (fewer where there are fewer samples); a remainder is left out."""
    length = max(1, values.size // blocks)
    count = values.size // length
    return np.asarray(np.add.reduce(values[: count * length].reshape(count, length), axis=1) / length)


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


def running_mean(values: FloatArray, width: int) -> FloatArray:
    """Centred mean over ``width`` samples (made odd), shorter at the ends; same length as ``values``."""
    half = width // 2
    if half == 0:
        return values
    total = np.concatenate(([0.0], np.cumsum(values)))
    index = np.arange(values.size)
    low = np.maximum(index - half, 0)
    high = np.minimum(index + half + 1, values.size)
    return np.asarray((total[high] - total[low]) / (high - low))


@dataclass(frozen=True)
class Wander:
    """Deviations of a steady signal from its mean.

    ``mean_u`` is the standard uncertainty of the mean from correlated but stationary noise, ``rate`` the
    variance a random walk gathers per second (unit of the signal squared, per second), ``noise`` that of
    single samples.
    """

    mean_u: float
    rate: float
    noise: float


def wander(values: FloatArray, duration_s: float) -> Wander:
    """Split the departures of ``values`` (spread evenly over ``duration_s``) into stationary noise and a slow walk.

    The mean squared difference of block means h blocks apart is 2 s^2 + q (h - 1/3) t_block for noise of
    block variance s^2 on top of a random walk of variance rate q (the 1/3 is what averaging within blocks
    takes off). A straight line through the variogram at lags of 1 to a quarter of the blocks gives both. With
    so few blocks the slope is uncertain: the rate returned is half-way between the expectation of the slope and a walk
    that explains all the variance not due to white noise, so that it is never zero by chance.
    """
    noise = sample_noise(values)
    means = block_means(values)
    count = means.size
    if count < 4:
        spread = float(values.std(ddof=1)) / math.sqrt(values.size) if values.size > 1 else math.nan
        return Wander(spread, 0.0, noise)
    variogram = _variogram_line(count)
    squares = (means[variogram.later] - means[variogram.earlier]) ** 2
    level, slope = float(variogram.level @ squares), float(variogram.slope @ squares)
    white = noise**2 * count / values.size
    most = max(level - 2.0 * white, 0.0) / variogram.centre
    slope = (_mean_within(slope, _SLOPE_U * level / variogram.centre, most) + most) / 2.0
    stationary = max(level - slope * variogram.centre, 2.0 * white) / 2.0
    rate = slope * count / duration_s if duration_s > 0 else 0.0
    return Wander(math.sqrt(stationary / count), rate, noise)


@dataclass(frozen=True)
class _VariogramLine:
    """Weights that turn squared differences of block means into the level and slope of their variogram."""

    later: NDArray[np.int64]
    earlier: NDArray[np.int64]
    level: FloatArray
    slope: FloatArray
    centre: float


@lru_cache(maxsize=BLOCKS * 2)
def _variogram_line(count: int) -> _VariogramLine:
    """Weighted straight line over lags of 1 to a quarter of ``count`` blocks; long lags overlap and count less."""
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
    return _VariogramLine(
        later,
        earlier,
        (weights / (count - lags))[lag - 1],
        (away / (away @ x) / (count - lags))[lag - 1],
        centre,
    )


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


@dataclass(frozen=True)
class Steady:
    """Mean force over a window: standard uncertainty of the mean from short-lived noise, drift and sample noise."""

    mean_N: float
    u_N: float
    drift_N_per_s: float
    noise_N: float


def steady(time_s: FloatArray, force: FloatArray) -> Steady:
    """Mean over a window of samples with the uncertainty that their correlation leaves."""
    slow = wander(force, float(time_s[-1] - time_s[0]))
    return Steady(float(force.mean()), slow.mean_u, line(time_s, force)[0], slow.noise)
