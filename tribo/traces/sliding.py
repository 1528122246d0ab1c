"""The part of a pull in which it slides: its range, when the force has stabilised, its mean and its stick-slip.

Stick-slip is a result: peaks, troughs, drop, period, loading slope and share of time stuck, and the regime named.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from tribo.records import CLOSED_TRACK_M, MEDIAN_TO_SD, FloatArray, Oscillation
from tribo.traces.peak import Motion
from tribo.traces.signal import condense, line, noise_of, sample_noise, steady, turning_points, wander

SMALLEST_DROP = 0.1  # share of the range of the force over ten cycles from which on a fall counts as a slip
_FIRST_LOOK = 0.05  # share of the range of the whole record, for a first count of the cycles
_CYCLES_ABOUT = 10
_NOISE = 8.0  # and this many times the noise of the averaged force
_FEWEST_OF_REGIME = 5  # cycles from which on there is a regime
_PER_CYCLE = 40  # averages per cycle, enough for its shape
_MEDIAN_SAMPLES = 5  # width of the median filter; impulses of up to two samples do not count as cycles
_LOADING = (0.4, 0.95)  # share of the time of a loading between which its slope is taken: a slip rings down before it
_STICKS = 0.66  # share of a cycle in which the force rises, from which on the slider sticks; a free swing has half
_FELT = 0.03  # share of the mean force below which a swing leaves the sliding steady
_IRREGULAR = 1.2  # spread of the cycle times over their mean above which they are irregular
_OF_LOADING = 0.5  # share of the loading slope above which the slider counts as stuck
MOST_REGAINED = 2.0  # times k v by which a force rises at the most: a slider swings back no faster than it is pulled
_POSSIBLE = 0.9  # share of the cycles that the drive must be able to supply
_MOST_TRIES, _NEXT_TRY = 12, 1.5  # falls that count are made larger by this factor until it can
_MEDIAN_U = 1.2533  # standard uncertainty of a median over that of a mean, normal distribution
_REPEATS = 0.4  # largest spread of the cycle times over their mean of an oscillation that repeats
_OF_TIME = 0.5  # share of the time that a slider which sticks is stuck
_FREE = 1.3  # a period up to this many free periods is that of an inertial oscillation
_AS_DRIVEN = 0.85  # share of k v that the loading slope reaches where the slider sticks


def oscillation_of(
    time_s: FloatArray,
    force_N: FloatArray,
    *,
    smallest_drop_N: float | None = None,
    drive_N_per_s: float = math.nan,
    free_period_s: float = math.nan,
) -> Oscillation:
    """The cycles of a sliding force, found between turning points, and the regime they make.

    A fall counts from ``smallest_drop_N`` on (default: a tenth of the range of the force over ten cycles, eight times
    its noise at the least; slow waves of the force do not count). A cycle that rises for most of its time is
    stick-slip, one that rises for half of it an inertial oscillation. ``drive_N_per_s`` is k v, where stiffness and
    speed are known: a slider that sticks is loaded at this rate. ``free_period_s`` is 2 pi sqrt(m/k).
    """
    from scipy.ndimage import uniform_filter1d

    calm, time, force, peaks, _ = cycles_of(time_s, force_N, smallest_drop_N, drive_N_per_s)
    supplied = _supplied(time, force, peaks, drive_N_per_s, sample_noise(calm))
    if peaks.size <= _FEWEST_OF_REGIME:
        spread = MEDIAN_TO_SD * float(np.median(np.abs(force_N - np.median(force_N))))
        keeps_level = spread < max(5.0 * sample_noise(force_N), 0.1 * abs(float(np.median(force_N))))
        return Oscillation("steady" if keeps_level else "irregular", int(supplied.sum()))
    troughs = _troughs(force, peaks)
    periods, spent = np.diff(time[peaks]), time[peaks[1:]] - time[troughs]
    loading, loading_u = _loading(time, force, troughs, peaks[1:], spent)
    peak, trough, drop = (
        _median(v) for v in (force[peaks], force[troughs], (force[peaks[:-1]] - force[troughs])[supplied])
    )
    fine = np.searchsorted(time_s, time[peaks])
    pace = uniform_filter1d(np.gradient(calm, time_s), max(3, int(np.median(np.diff(fine))) // _PER_CYCLE))
    stuck = np.array([(pace[a:b] > _OF_LOADING * loading).mean() for a, b in pairwise(fine)])
    swing, rising = drop[0] / max(abs(float(force.mean())), 1e-300), float(spent.sum() / periods.sum())
    scatter = float(periods.std() / periods.mean())
    period = _median(periods)
    regime = _regime(swing, rising, scatter, period[0], loading, drive_N_per_s, free_period_s)
    if not (drive_N_per_s > 0 or free_period_s > 0):
        # waves that do not repeat are no oscillation, and a slider that sticks does so for most of the time
        wave = regime == "inertial oscillation" and scatter > _REPEATS
        regime = "irregular" if wave or (regime == "stick-slip" and float(stuck.mean()) < _OF_TIME) else regime
    return Oscillation(
        regime, int(supplied.sum()), *peak, *trough, *drop, *period, loading, loading_u,
        float(stuck.mean()), float(stuck.std(ddof=1) / stuck.size**0.5),
    )  # fmt: skip


def cycles_of(
    time_s: FloatArray, force_N: FloatArray, smallest_drop_N: float | None, drive_N_per_s: float
) -> tuple[FloatArray, FloatArray, FloatArray, np.ndarray, float]:
    """The turning points of a force: its calm form, time and force averaged to what a cycle needs, the indices of the
    peaks in those, and the least fall that counted.

    Where the drive cannot supply what most cycles regain, noise was counted, and larger falls are asked for.
    """
    from scipy.ndimage import median_filter

    # impulses of one or two samples are taken out by a median, which leaves slips as they are
    calm = np.asarray(median_filter(force_N, _MEDIAN_SAMPLES, mode="nearest"), float)
    least = _smallest_drop(calm) if smallest_drop_N is None else smallest_drop_N
    time, force, peaks = _cycles(time_s, calm, least)
    noise = sample_noise(calm)
    for _ in range(_MOST_TRIES):
        supplied = _supplied(time, force, peaks, drive_N_per_s, noise)
        if supplied.size == 0 or supplied.mean() >= _POSSIBLE:
            break
        least *= _NEXT_TRY
        time, force, peaks = _cycles(time_s, calm, least)
    return calm, time, force, peaks, least


def _cycles(time_s: FloatArray, calm: FloatArray, least: float) -> tuple[FloatArray, FloatArray, np.ndarray]:
    """Time and force, averaged to as many samples as a cycle needs, and the indices of the peaks in them."""
    peaks, _ = turning_points(calm, least)
    factor = int(np.median(np.diff(peaks))) // _PER_CYCLE if peaks.size > _FEWEST_OF_REGIME else 1
    if factor <= 1:
        return time_s, calm, peaks
    time, force = condense(time_s, factor), condense(calm, factor)
    return time, force, turning_points(force, least)[0]


def _troughs(force: FloatArray, peaks: np.ndarray) -> np.ndarray:
    return np.array([a + int(np.argmin(force[a:b])) for a, b in pairwise(peaks)], int)


def _supplied(time: FloatArray, force: FloatArray, peaks: np.ndarray, drive_N_per_s: float, noise: float) -> np.ndarray:
    """Which cycles regain no more force than the spring of the drive can give back; all where k v is not known.

    The spring is stretched by the drive at k v, and by a slider that swings back about as fast again.
    """
    if peaks.size < 2 or not drive_N_per_s > 0:
        return np.ones(max(peaks.size - 1, 0), bool)
    troughs = _troughs(force, peaks)
    regained, spent = force[peaks[1:]] - force[troughs], time[peaks[1:]] - time[troughs]
    return np.asarray(regained < MOST_REGAINED * drive_N_per_s * spent + 3.0 * noise)


def _smallest_drop(force: FloatArray) -> float:
    """The least fall that counts as a slip, by the range of the force over ten cycles and by its noise."""

    def spread(part: FloatArray) -> float:
        low, high = np.percentile(part, (1.0, 99.0))
        return float(high - low)

    felt = _NOISE * noise_of(force)
    first_look = max(_FIRST_LOOK * spread(force), felt)
    peaks, _ = turning_points(force, first_look)
    if peaks.size < 2 * _CYCLES_ABOUT:
        return first_look
    about = peaks[::_CYCLES_ABOUT]
    return max(SMALLEST_DROP * float(np.median([spread(force[a:b]) for a, b in pairwise(about)])), felt)


def _regime(
    swing: float, rising: float, scatter: float, period_s: float, loading: float, drive: float, free_s: float
) -> str:
    """Name of the regime; ``swing`` is the drop over the mean, ``rising`` the share of time with a rising force."""
    if swing < _FELT:
        return "steady"
    if scatter > _IRREGULAR:
        return "irregular"
    if math.isfinite(drive) and drive > 0:  # a slider that sticks is loaded at the rate of the drive
        return "stick-slip" if loading > _AS_DRIVEN * drive and rising > 0.5 else "inertial oscillation"
    if math.isfinite(free_s) and period_s < _FREE * free_s:
        return "inertial oscillation"
    return "stick-slip" if rising > _STICKS else "inertial oscillation"


def _loading(
    time: FloatArray, force: FloatArray, troughs: np.ndarray, peaks: np.ndarray, spent: FloatArray
) -> tuple[float, float]:
    """Mean slope of the loadings without their beginnings and very ends, by the time spent; standard uncertainty."""
    slopes = []
    for trough, peak in zip(troughs, peaks, strict=True):
        first, last = (trough + round(share * (peak - trough)) for share in _LOADING)
        slopes.append(line(time[first : last + 1], force[first : last + 1])[0] if last > first else math.nan)
    known = np.isfinite(slopes)
    if not known.any():
        return math.nan, math.nan
    values, weights = np.array(slopes)[known], spent[known] / spent[known].sum()
    mean = float(weights @ values)
    return mean, math.sqrt(float(weights**2 @ (values - mean) ** 2))


def _median(values: FloatArray) -> tuple[float, float]:
    """The median and its standard uncertainty."""
    middle = float(np.median(values))
    spread = MEDIAN_TO_SD * float(np.median(np.abs(values - middle)))
    return middle, _MEDIAN_U * spread / math.sqrt(values.size)


Window = tuple[int, int]

_FEWEST = 10  # samples from which on a mean is taken
_BATCH = 5
_MOST_BATCHES = 2000
_LATEST = 0.5  # at most this share of the record after the peak is taken as unsettled
_BEYOND_NOISE = 1.5  # stick-slip swings further from its line than noise does in so many samples, by this many times it
_FEWEST_CYCLES = 3
_REGULAR = 0.4  # largest spread of the cycle times over their mean that still counts as stick-slip


@dataclass(frozen=True)
class Sliding:
    """What a pull says of sliding. NaN where fewer than ten samples, or no stick-slip, leave a number out.

    Mean, drift and sample noise are of the ``window`` of samples that a rule or a person chose; ``u_N`` is the standard
    uncertainty of the mean. The whole record after the fall gives the stick-slip, and ``wander_rate``, the variance
    that a slow walk of the force gathers per second.
    """

    mean_N: float
    u_N: float
    drift_N_per_s: float
    noise_N: float
    window: Window
    window_s: tuple[float, float]
    swing_N: float
    period_s: float
    wander_rate: float

    @property
    def enough(self) -> bool:
        """Whether there were samples enough for a mean."""
        return not math.isnan(self.window_s[0])


def window_between(time_s: FloatArray, start_s: float, end_s: float) -> Window:
    """The range of samples from one time to another, both included."""
    first, end = np.searchsorted(time_s, (start_s, end_s))
    return int(first), int(end) + int(end < time_s.size and time_s[end] == end_s)


def sliding_over(motion: Motion, window: Window) -> Sliding:
    """What a pull says of sliding: the mean over a window, and what the whole record after the fall tells."""
    start, end = window
    time, force = motion.time_s, motion.force_N
    fallen, last = fallen_range(motion)
    after_s, after_N = time[fallen:last], force[fallen:last]
    swing, period, rate = math.nan, math.nan, 0.0
    if long := last - fallen >= _FEWEST:
        swing, period = stick_slip(after_s, after_N, motion.noise_N)
    if end - start < _FEWEST:
        return Sliding(math.nan, math.nan, math.nan, math.nan, window, (math.nan, math.nan), swing, period, rate)
    if long:  # the window was chosen for its steadiness, so it alone would tell too little wander
        rate = wander(after_N, float(after_s[-1] - after_s[0]))[1]
    mean = steady(time[start:end], force[start:end])
    return Sliding(*mean, window, (float(time[start]), float(time[end - 1])), swing, period, rate)


def fallen_range(motion: Motion) -> Window:
    """The sliding range from where the force has come down to its median over that range; nothing of an empty range."""
    first, end = motion.sliding
    if end <= first:
        return end, end
    smooth = motion.smooth_N[first:end]
    return first + int(np.argmax(smooth <= np.median(smooth))), end


def slides_on_closed_track(travel_m: FloatArray | None, sliding: Window) -> bool:
    """Whether a slide is so long that it runs over its own track, as on a disc or a ring."""
    first, end = sliding
    return travel_m is not None and end - first > 1 and abs(float(travel_m[end - 1] - travel_m[first])) > CLOSED_TRACK_M


def transient_end(force: FloatArray) -> int:
    """Index from which a force that relaxes towards a steady level has stabilised.

    The marginal standard error rule on batches of five (MSER-5, White 1997, Simulation 69): leave out the
    first d samples so that the squared standard error of the mean of the rest, sum (f - mean)^2 / (n - d)^2,
    is smallest; d at most half the record. It trades the bias of a transient against the loss of samples and
    has no threshold.
    """
    if force.size == 0:
        return 0
    batch = max(_BATCH, force.size // _MOST_BATCHES)
    means = condense(force, batch) if force.size >= 4 * batch else force
    step = batch if force.size >= 4 * batch else 1
    means = means - means.mean()
    n = np.arange(means.size, 0, -1)
    total = np.cumsum(means[::-1])[::-1]
    squares = np.cumsum((means * means)[::-1])[::-1]
    error = (squares - total**2 / n) / n**2
    latest = max(1, int(means.size * _LATEST) + 1)
    return int(np.argmin(error[:latest])) * step


def stick_slip(time_s: FloatArray, force: FloatArray, noise: float) -> tuple[float, float]:
    """(peak-to-peak amplitude N, period s) of stick-slip: medians over its cycles, NaN where none stands out.

    The force about its straight line is followed through a band that noise does not leave (a
    Schmitt trigger); a cycle runs from one upward passage to the next. Fewer than three cycles, or cycle
    times that scatter, are no stick-slip.
    """
    none = (math.nan, math.nan)
    band = noise * (math.sqrt(2.0 * math.log(force.size)) + _BEYOND_NOISE)  # noise alone reaches about the root
    if float(np.ptp(force)) < 2.0 * band:
        return none
    slope, t0, f0 = line(time_s, force)
    about = force - f0 - slope * (time_s - t0)
    state = np.where(about > band, 1, np.where(about < -band, -1, 0))
    outside = np.flatnonzero(state)
    if outside.size < 2 * _FEWEST_CYCLES:
        return none
    turns = outside[1:][np.diff(state[outside]) > 0]
    if turns.size <= _FEWEST_CYCLES:
        return none
    periods = np.diff(time_s[turns])
    if periods.std() > _REGULAR * periods.mean():
        return none
    highs = np.maximum.reduceat(about, turns)[:-1]
    lows = np.minimum.reduceat(about, turns)[:-1]
    return float(np.median(highs - lows)), float(np.median(periods))
