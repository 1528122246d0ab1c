"""Stick-slip cycle by cycle: force at the end of each stick and each slip, and the loading rate."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from tribo.display import displayed
from tribo.errors import Problem, TraceError
from tribo.records import FloatArray, Trace
from tribo.traces.noise import condense, line

_FEWEST = 3
_PER_CYCLE = 50  # averages per cycle, enough for its shape and free of impulses
_LOADING = (0.5, 0.95)  # share of a loading in which its slope is taken: after the slip has rung down and crept
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
    if peaks.size >= _FEWEST:
        average = int(np.diff(peaks).mean()) // _PER_CYCLE
        time, force = condense(time, average), _without_impulses(condense(trace.force_N, average))
        peaks = _peaks(force, drop)
    if peaks.size < _FEWEST:
        what = f"the force shows fewer than {_FEWEST} stick-slip cycles with a force drop of {drop:.3g} N or more"
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
    start, end = (trough + round(share * (peak - trough)) for share in _LOADING)
    return line(time_s[start : end + 1], force[start : end + 1])[0] if end > start else float("nan")
