"""Stick-slip as a result: peaks, troughs, drop, period, loading slope and share of time stuck; the regime named.

Stick-slip cycle by cycle: force at the end of each stick and each slip, and the loading rate.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from tribo.display import displayed
from tribo.errors import Problem, TraceError
from tribo.records import FloatArray, Oscillation, Trace
from tribo.traces.phases import turning_points
from tribo.traces.signal import condense, line, noise_of, sample_noise

SMALLEST_DROP = 0.1  # share of the range of the force over ten cycles from which on a fall counts as a slip
_FIRST_LOOK = 0.05  # share of the range of the whole record, for a first count of the cycles
_CYCLES_ABOUT = 10
_NOISE = 8.0  # and this many times the noise of the averaged force
_FEWEST = 5  # cycles from which on there is a regime
_PER_CYCLE = 40  # averages per cycle, enough for its shape
_MEDIAN_SAMPLES = 5  # width of the median filter; impulses of up to two samples do not count as cycles
_LOADING = (0.4, 0.95)  # share of the time of a loading between which its slope is taken: a slip rings down before it
_STICKS = 0.66  # share of a cycle in which the force rises, from which on the slider sticks; a free swing has half
_FELT = 0.03  # share of the mean force below which a swing leaves the sliding steady
_IRREGULAR = 1.2  # spread of the cycle times over their mean above which they are irregular
_OF_LOADING = 0.5  # share of the loading slope above which the slider counts as stuck
_MEDIAN_U = 1.2533  # standard uncertainty of a median over that of a mean, normal distribution
_MAD = 1.4826
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
    time, force = fine = _calm(time_s, force_N)
    least = _smallest_drop(force) if smallest_drop_N is None else smallest_drop_N
    peaks, troughs = turning_points(force, least)
    if peaks.size > _FEWEST:
        factor = int(np.median(np.diff(peaks))) // _PER_CYCLE
        if factor > 1:
            time, force = condense(time, factor), condense(force, factor)
            peaks, troughs = turning_points(force, least)
    if peaks.size <= _FEWEST:
        return Oscillation("steady" if _is_steady(force_N) else "irregular", int(max(peaks.size - 1, 0)))
    troughs = np.array([a + int(np.argmin(force[a:b])) for a, b in pairwise(peaks)])
    found = _measured(time, force, peaks, troughs, (drive_N_per_s, free_period_s))
    stuck = _stuck(*fine, np.searchsorted(fine[0], time[peaks]), found.loading_N_per_s)
    if not (drive_N_per_s > 0 or free_period_s > 0):
        found = replace(found, regime=_without_rig(found.regime, np.diff(time[peaks]), float(stuck.mean())))
    return replace(found, stuck_share=float(stuck.mean()), stuck_share_u=float(stuck.std(ddof=1) / stuck.size**0.5))


def _smallest_drop(force: FloatArray) -> float:
    """The least fall that counts as a slip, by the range of the force over ten cycles and by its noise."""
    felt = _NOISE * noise_of(force)
    peaks, _ = turning_points(force, max(_FIRST_LOOK * _range(force), felt))
    if peaks.size < 2 * _CYCLES_ABOUT:
        return max(_FIRST_LOOK * _range(force), felt)
    about = peaks[::_CYCLES_ABOUT]
    return max(SMALLEST_DROP * float(np.median([_range(force[a:b]) for a, b in pairwise(about)])), felt)


def _range(force: FloatArray) -> float:
    low, high = np.percentile(force, (1.0, 99.0))
    return float(high - low)


def _calm(time_s: FloatArray, force_N: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The force with impulses of one or two samples taken out by a median, which leaves slips as they are."""
    from scipy.ndimage import median_filter

    return time_s, np.asarray(median_filter(force_N, _MEDIAN_SAMPLES, mode="nearest"), float)


def _is_steady(force_N: FloatArray) -> bool:
    """Whether a force without cycles keeps its level to within its noise, its trend and a tenth of itself."""
    noise, level = sample_noise(force_N), abs(float(np.median(force_N)))
    spread = _MAD * float(np.median(np.abs(force_N - np.median(force_N))))
    return spread < max(5.0 * noise, 0.1 * level)


def _measured(
    time: FloatArray, force: FloatArray, peaks: np.ndarray, troughs: np.ndarray, rig: tuple[float, float]
) -> Oscillation:
    periods = np.diff(time[peaks])
    slopes = np.array([_slope(time, force, a, b) for a, b in zip(troughs, peaks[1:], strict=True)])
    spent = time[peaks[1:]] - time[troughs]
    rising = float(spent.sum() / periods.sum())
    loading, loading_u = _weighted(slopes, spent)
    peak, trough, drop = (_median(v) for v in (force[peaks], force[troughs], force[peaks[:-1]] - force[troughs]))
    period = _median(periods)
    swing = drop[0] / max(abs(float(force.mean())), 1e-300)
    scatter = float(periods.std() / periods.mean())
    return Oscillation(
        _regime(swing, rising, scatter, period[0], loading, rig), int(periods.size), *peak, *trough, *drop, *period,
        loading, loading_u,
    )  # fmt: skip


def _regime(
    swing: float, rising: float, scatter: float, period_s: float, loading: float, rig: tuple[float, float]
) -> str:
    """Name of the regime; ``swing`` is the drop over the mean, ``rising`` the share of time with a rising force."""
    drive, free_s = rig
    if swing < _FELT:
        return "steady"
    if scatter > _IRREGULAR:
        return "irregular"
    if math.isfinite(drive) and drive > 0:  # a slider that sticks is loaded at the rate of the drive
        return "stick-slip" if loading > _AS_DRIVEN * drive and rising > 0.5 else "inertial oscillation"
    if math.isfinite(free_s) and period_s < _FREE * free_s:
        return "inertial oscillation"
    return "stick-slip" if rising > _STICKS else "inertial oscillation"


def _without_rig(regime: str, periods: FloatArray, stuck: float) -> str:
    """The regime where neither drive nor free period is known: waves that do not repeat are no oscillation, and a
    slider that sticks does so for most of the time."""
    scatter = float(periods.std() / periods.mean())
    wave = regime == "inertial oscillation" and scatter > _REPEATS
    return "irregular" if wave or (regime == "stick-slip" and stuck < _OF_TIME) else regime


def _slope(time: FloatArray, force: FloatArray, trough: int, peak: int) -> float:
    """Slope of a loading, without its beginning and its very end."""
    first, last = (trough + round(share * (peak - trough)) for share in _LOADING)
    return line(time[first : last + 1], force[first : last + 1])[0] if last > first else math.nan


def _weighted(slopes: FloatArray, spent: FloatArray) -> tuple[float, float]:
    """Mean of the slopes weighted by the time spent, and its standard uncertainty."""
    known = np.isfinite(slopes)
    if not known.any():
        return math.nan, math.nan
    values, weights = slopes[known], spent[known] / spent[known].sum()
    mean = float(weights @ values)
    return mean, math.sqrt(float(weights**2 @ (values - mean) ** 2))


def _stuck(time: FloatArray, force: FloatArray, peaks: np.ndarray, loading: float) -> FloatArray:
    """Share of each cycle in which the force rises at half the loading slope or more: the slider is stuck."""
    from scipy.ndimage import uniform_filter1d

    width = max(3, int(np.median(np.diff(peaks))) // _PER_CYCLE)
    pace = uniform_filter1d(np.gradient(force, time), width)
    return np.array([(pace[a:b] > _OF_LOADING * loading).mean() for a, b in pairwise(peaks)])


def _median(values: FloatArray) -> tuple[float, float]:
    middle = float(np.median(values))
    spread = _MAD * float(np.median(np.abs(values - middle)))
    return middle, _MEDIAN_U * spread / math.sqrt(values.size)


_FEWEST_PEAKS = 3
_PER_PERIOD = 50  # averages per cycle, enough for its shape and free of impulses
_LOADING_SHARE = (0.5, 0.95)  # share of a loading in which its slope is taken: after the slip has rung down and crept
_SPIKE_SAMPLES = 5  # width of the median filter; impulses of up to two samples are taken out


@displayed()
@dataclass(frozen=True)
class StickSlip:
    """Stick-slip cycles: K sticks that end at ``peak_s`` with ``peak_N``, and K - 1 slips and loadings between them.

    ``trough_N`` is the lowest force between two peaks, ``loading_N_per_s`` the slope of the loading that follows it.
    For a spring of stiffness k pulled at speed v while the slider sticks it is k v.
    """

    peak_s: FloatArray
    peak_N: FloatArray
    trough_s: FloatArray
    trough_N: FloatArray
    loading_N_per_s: FloatArray

    @property
    def period_s(self) -> float:
        """Median time from one peak to the next."""
        return float(np.median(np.diff(self.peak_s)))

    @property
    def drop_N(self) -> float:
        """Median force lost in a slip."""
        return float(np.median(self.peak_N[:-1] - self.trough_N))

    @property
    def mean_loading_N_per_s(self) -> float:
        """Loading slope averaged over the time spent loading."""
        spent = self.peak_s[1:] - self.trough_s
        known = np.isfinite(self.loading_N_per_s)
        return float(np.average(self.loading_N_per_s[known], weights=spent[known]))


def stick_slip_cycles(trace: Trace, *, smallest_drop: float = 0.05) -> StickSlip:
    """Find every stick and slip of a trace.

    A peak is a stick if the force falls after it by at least ``smallest_drop`` times the range of the force (from its
    1st to its 99th percentile). Spikes are removed by a median filter; a first search gives the length of a cycle,
    the second works on averages over a fiftieth of it.

    Raises
    ------
    TraceError
        ``no_stick_slip``: fewer than three such peaks.
    """
    low, high = np.percentile(trace.force_N, (1.0, 99.0))
    drop = smallest_drop * float(high - low)
    time, force = trace.time_s, _without_impulses(trace.force_N)
    peaks = _peaks(force, drop)
    if peaks.size >= _FEWEST_PEAKS:
        average = int(np.diff(peaks).mean()) // _PER_PERIOD
        time, force = condense(time, average), _without_impulses(condense(trace.force_N, average))
        peaks = _peaks(force, drop)
    if peaks.size < _FEWEST_PEAKS:
        what = f"the force shows fewer than {_FEWEST_PEAKS} stick-slip cycles with a force drop of {drop:.3g} N or more"
        raise TraceError(Problem("no_stick_slip", what, trace.file or None, found=str(peaks.size)))
    troughs = np.array([a + int(np.argmin(force[a:b])) for a, b in pairwise(peaks)])
    slopes = [_loading_slope(time, force, a, b) for a, b in zip(troughs, peaks[1:], strict=True)]
    return StickSlip(time[peaks], force[peaks], time[troughs], force[troughs], np.array(slopes))


def _without_impulses(force: FloatArray) -> FloatArray:
    from scipy.ndimage import median_filter

    return np.asarray(median_filter(force, _SPIKE_SAMPLES, mode="nearest"))


def _peaks(force: FloatArray, drop: float) -> FloatArray:
    from scipy.signal import find_peaks

    return np.asarray(find_peaks(force, prominence=drop)[0])


def _loading_slope(time_s: FloatArray, force: FloatArray, trough: int, peak: int) -> float:
    start, end = (trough + round(share * (peak - trough)) for share in _LOADING_SHARE)
    return line(time_s[start : end + 1], force[start : end + 1])[0] if end > start else float("nan")
