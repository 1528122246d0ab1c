"""Three readings of the static peak of a pull, and what their difference adds to its uncertainty."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tribo.records import FloatArray
from tribo.traces.peak import Apex
from tribo.traces.sliding import Motion

DROP = 0.05  # share of the highest force so far by which the force falls in a first drop
_PEAKED = 3.0  # a peak stands above the later force by this many times the noise
_CLEARLY = 0.02  # readings differ where it is by this share of the force,
_BEYOND_U = 3.0  # and by this many times the uncertainty of the first maximum
_RESOLVED = 3  # samples of the middle half of a rise from which on a corner between two samples is told
_STEPS = 2.0  # steps between samples by which a corner on a resolved rise may lie above them
_SAME = 5  # samples within which two maxima are the same one
_FEWEST = 16
_LATER = 0.25  # share of a record at its end that tells the level a peak stands above
_HIGH = 0.3  # share of the largest force below which a fall is none of the peak
_NOISE_AT_TOP = 3.0  # largest excess of the noise over a top sample that is allowed


@dataclass(frozen=True)
class StaticReadings:
    """First maximum, highest force and force before the first drop, in N above zero; NaN where there is none."""

    first_N: float
    highest_N: float
    drop_N: float

    def open_N(self, chosen: Apex) -> float:
        """Standard uncertainty that their difference leaves (GUM type B), 0 where they agree with the chosen one."""
        away = [abs(x - chosen.force_N) for x in (self.first_N, self.highest_N, self.drop_N) if math.isfinite(x)]
        widest = max(away, default=0.0)
        clear = widest > max(_CLEARLY * abs(chosen.force_N), _BEYOND_U * math.hypot(chosen.u_N, chosen.shape_u_N))
        return widest / math.sqrt(3.0) if clear else 0.0


def static_readings(motion: Motion, span_end: int) -> StaticReadings:
    """The three readings of a pull up to the sample ``span_end``, at which the drive stops or the record ends."""
    onset = int(np.searchsorted(motion.time_s, motion.onset_s))
    force = motion.smooth_N[onset:span_end]
    first = motion.apex.force_N
    if force.size < _FEWEST:
        return StaticReadings(first, math.nan, math.nan)
    at = int(np.searchsorted(motion.time_s, motion.apex.time_s)) - onset
    later = float(np.median(force[-max(int(_LATER * force.size), 1) :]))
    top = int(np.argmax(force))
    peaked = float(force[top]) - later > _PEAKED * motion.noise_N
    highest = _one_of(first, at, float(force[top]), top) if peaked else math.nan
    drop = _before_drop(force, motion.noise_N)
    return StaticReadings(first, highest, math.nan if drop is None else _one_of(first, at, float(force[drop]), drop))


def _one_of(first_N: float, at: int, force_N: float, index: int) -> float:
    """The first maximum where a maximum is the same one or lies below it, else its own force."""
    return first_N if abs(index - at) <= _SAME or (index > at and force_N < first_N) else force_N


def _before_drop(force: FloatArray, noise: float) -> int | None:
    """Index of the highest force before it first falls by the share ``DROP``; None where it never does."""
    highest = np.maximum.accumulate(force)
    fallen = (highest - force > np.maximum(DROP * highest, _PEAKED * noise)) & (highest > _HIGH * float(force.max()))
    return int(np.argmax(force[: int(np.argmax(fallen)) + 1])) if fallen.any() else None


def within_samples(motion: Motion, apex: Apex) -> Apex:
    """A peak no higher than its samples and their noise allow; what is cut off stays in the uncertainty.

    Where samples resolve the rise, a corner between two of them may lie above both by what the force rises in between.
    """
    around = np.abs(motion.time_s - apex.time_s)
    near = motion.force_N[np.argsort(around, kind="stable")[:_FEWEST]]
    step_s = float(np.median(np.diff(motion.time_s)))
    between = _STEPS * motion.rise.rate * step_s if motion.rise.last - motion.rise.first >= _RESOLVED else 0.0
    highest = float(near.max())
    most = highest + _NOISE_AT_TOP * motion.noise_N + between
    if not apex.force_N > most:
        return apex
    missed = max(apex.force_N - highest, motion.rise.rate * step_s / 2.0)
    return Apex(
        apex.time_s, apex.time_u_s, highest, math.hypot(motion.noise_N, missed / math.sqrt(3.0)), apex.chi2_red,
        "highest sample",
    )  # fmt: skip
