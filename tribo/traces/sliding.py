"""Steady sliding: when the force has stabilised, its mean, its drift and its stick-slip."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tribo.records import FloatArray
from tribo.traces.contact import line
from tribo.traces.noise import condense, mean, wander

_BATCH = 5
_MOST_BATCHES = 2000
_LATEST = 0.5  # at most this share of the record after the peak is taken as unsettled
_BEYOND_NOISE = 1.5  # stick-slip swings further from its line than noise does in so many samples, by this many times it
_FEWEST_CYCLES = 3
_REGULAR = 0.4  # largest spread of the cycle times over their mean that still counts as stick-slip


@dataclass(frozen=True)
class Steady:
    """Mean force over a window: standard uncertainty of the mean from short-lived noise, drift and sample noise."""

    mean_N: float
    u_N: float
    drift_N_per_s: float
    noise_N: float


def settled(force: FloatArray) -> int:
    """Index from which a force that relaxes towards a steady level has stabilised.

    The marginal standard error rule on batches of five (MSER-5, White 1997, Simulation 69): leave out the
    first d samples so that the squared standard error of the mean of the rest, sum (f - mean)^2 / (n - d)^2,
    is smallest; d at most half the record. It trades the bias of a transient against the loss of samples and
    has no threshold.
    """
    batch = max(_BATCH, force.size // _MOST_BATCHES)
    means = condense(force, batch) if force.size >= 4 * batch else force
    step = batch if force.size >= 4 * batch else 1
    means = means - mean(means)
    n = np.arange(means.size, 0, -1)
    total = np.cumsum(means[::-1])[::-1]
    squares = np.cumsum((means * means)[::-1])[::-1]
    error = (squares - total**2 / n) / n**2
    latest = max(1, int(means.size * _LATEST) + 1)
    return int(np.argmin(error[:latest])) * step


def steady(time_s: FloatArray, force: FloatArray) -> Steady:
    """Mean over a window of samples with the uncertainty that their correlation leaves."""
    slow = wander(force, float(time_s[-1] - time_s[0]))
    return Steady(mean(force), slow.mean_u, line(time_s, force)[0], slow.noise)


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
