"""The part of a pull in which it slides: its range, when the force has stabilised, its mean and its stick-slip."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tribo.records import CLOSED_TRACK_M, FloatArray
from tribo.traces.peak import Motion
from tribo.traces.signal import condense, line, steady, wander

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
