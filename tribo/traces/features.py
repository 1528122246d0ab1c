"""Features of a trace beyond two forces: each defined once, here, with its uncertainty.

The features of a pull from rest are read from lines and a decay fitted to its parts; their uncertainties count the
correlation of what the fit leaves. Those of stick-slip are medians over the slips of :mod:`tribo.traces.events`, with
the distribution-free interval of a median, widened where neighbouring slips are alike.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from tribo.records import MEDIAN_TO_SD, Feature, FloatArray, Pull, Slip, Trace
from tribo.traces.drive import speed_level_m_s
from tribo.traces.evaluation import with_static_peak
from tribo.traces.signal import (
    condense,
    line,
    median_of_three,
    running_mean,
    sample_noise,
    signal_of,
    turning_points,
)

FEATURES = {
    "rise_stiffness_N_per_m": "slope of the rise from rest between 20 and 60 % of the static peak, against the way of "
    "the drive",
    "rise_bend": "slope between 60 and 90 % of the static peak over that between 20 and 60 %, less 1",
    "precursor_drops": "falls of the force before the static peak by 2 % of it, and by more than its noise",
    "peak_width_um": "way of the drive between the points of rise and decay a tenth of the static drop below the peak",
    "static_drop_N": "force at which the line of the rise (75 to 97 %) meets the decay after the peak, less the mean "
    "sliding force; where no decay is seen, static peak less mean",
    "decay_length_um": "way of the drive in which the force after the static peak comes down to 1/e above its later "
    "level",
    "stick_peak_N": "force before a slip, median",
    "stick_trough_N": "force after a slip, median",
    "drop_N": "force lost in a slip, median",
    "period_s": "time from one failure to the next, median",
    "hold_s": "time from the end of a slip to the next failure, median",
    "loading_stiffness_N_per_m": "slope of the loadings between slips against the way of the drive, median",
    "slip_um": "way of the slider in a slip, median",
    "slip_duration_s": "time of a slip, median",
    "peak_velocity_mm_s": "highest velocity of the slider in a slip, median",
    "creep_um": "creep before a slip, median",
    "drift_N_per_s": "slope of the sliding force over its window",
    "roughness": "standard deviation of the sliding force over its mean",
    "main_frequency_Hz": "frequency of the highest peak of the spectrum of the sliding force",
    "main_share": "share of the variance of the sliding force within 20 % of that frequency",
    "load_lost_per_pull": "fall of the recorded normal load for each newton of the pull, from rest to the end of the "
    "slide",
    "missed_peak_N": "what the highest data point of a sharp peak misses on average: half of r d / (r + d), r the "
    "larger of the two steps before it and d the fall over the two steps after it",
    "force_kept_at_turn": "force from which the unloading goes on after the drive has turned back, over that before it",
}
_LOWER, _UPPER = (0.2, 0.6), (0.6, 0.9)  # shares of the static peak between which the slopes of the rise are read
_WIDTH_AT = 0.1  # share of the static drop below the peak at which its width is taken
_DROP = 0.02  # share of the static peak that a precursor loses
_OVER_NOISE = 6.0
_BELOW_PEAK = (0.75, 0.97)  # shares of the static peak between which the line of the rise that meets it is fitted
_FEWEST, _FEWEST_SLIPS = 8, 4
_BEYOND_MIDDLE = 0.575  # share of a loading from the middle of where its slope is read to its end
_DECAYS = 6.0  # decay lengths after the peak over which the decay is fitted
_BLOCKS = 16
_CONVERGED = 1e-13  # relative: every processor comes to the same printed digits
_NEAR = 0.2  # share of the main frequency within which variance belongs to it
_NORMAL = 1.959964
_LOADED = 0.5  # share of the load while sliding below which a body is not yet loaded at rest
_BEFORE_TURN = 0.02  # share of the way slid over which the force before a turn is taken
_UNLOADING = (0.2, 0.6)  # shares of the force before a turn between which the line of the unloading is read


def features_of(trace: Trace, pull: Pull, speed_m_s: float | None = None) -> dict[str, Feature]:
    """The features of one record by name, as far as it shows them.

    Parameters
    ----------
    trace : Trace
        The record, measured or simulated.
    pull : Pull
        What :func:`tribo.read_pull` reads of it: zero, static peak, sliding window and slips.
    speed_m_s : float, optional
        Speed of the drive in m/s; by default that of the recorded displacement, and without one lengths are left out.

    Returns
    -------
    dict of str to Feature
        Names are those of ``tribo.traces.features.FEATURES``.

    Examples
    --------
    >>> import tribo
    >>> from tribo.traces import features_of
    >>> trace = tribo.read_export(tribo.data_dir() / "example" / "raw" / "T001.csv")
    >>> found = features_of(trace, tribo.read_pull(trace), speed_m_s=0.2e-3)
    >>> print(f"{found['static_drop_N'].value:.2f} ± {found['static_drop_N'].u:.2f} N")
    1.04 ± 0.01 N
    """
    signal = signal_of(trace)
    time, force = signal.time_s, signal.force_N - pull.zero_N
    if speed_m_s is None:
        speed_m_s = speed_level_m_s(trace)
    speed = speed_m_s if speed_m_s and speed_m_s > 0 else math.nan
    found: dict[str, Feature] = {}
    with suppress(ZeroDivisionError):  # of a recorder that stands still, to the bit, such features do not exist
        if math.isfinite(pull.static_N) and pull.onset_s < pull.peak_s:
            pull = _with_highest(time, force, pull)
            tau = _correlation_while_sliding(time, force, pull)
            found |= _of_rise(time, force, pull, speed, tau) | _of_decay(time, force, pull, speed, tau)
            found |= _of_machine(trace, time, force, pull)
    with suppress(ZeroDivisionError):
        found |= _of_slips(pull.slips) | _of_sliding(time, force, pull)
    return {name: found[name] for name in FEATURES if name in found and math.isfinite(found[name].value)}


def _normal(value: float, u: float, count: int) -> Feature:
    return Feature(value, u, value - _NORMAL * u, value + _NORMAL * u, count)


def _correlation_time(away: FloatArray) -> float:
    """Samples that count as one, by the autocorrelation up to where it has died out; at least 1."""
    n = away.size
    spread = float(away @ away)
    if n < 4 or not spread > 0:
        return 1.0
    total = 1.0
    for lag in range(1, max(2, n // 8)):
        r = float(away[lag:] @ away[:-lag]) / spread
        if r < 0.05:
            break
        total += 2.0 * r
    first = min(max(float(away[1:] @ away[:-1]) / spread, 0.0), 0.98)
    total = max(total, (1.0 + first) / (1.0 - first))
    return total * n / max(n - 2.0 * total, 1.0)  # a line takes a part of slow noise with it


def _correlation_while_sliding(time: FloatArray, force: FloatArray, pull: Pull) -> float:
    """Samples that count as one in the sliding window, which has more of them than a rise; 1 where there is none."""
    if not math.isfinite(pull.window_s[0]) or pull.slips[1:]:
        return 1.0
    first, last = np.searchsorted(time, pull.window_s)
    at, part = time[first : last + 1], force[first : last + 1]
    if part.size < 4 * _BLOCKS:
        return 1.0
    slope, middle, mean = line(at, part)
    return _correlation_time(part - mean - slope * (at - middle))


def _slope(x: FloatArray, force: FloatArray, tau: float = 1.0) -> tuple[float, float]:
    """Slope of a line and its standard uncertainty, the correlation of what it leaves counted."""
    slope, middle, mean = line(x, force)
    away = force - mean - slope * (x - middle)
    spread = float((x - middle) @ (x - middle))
    tau = max(_correlation_time(away), tau)
    return slope, math.sqrt(float(away @ away) / max(x.size - 2.0, 1.0) * tau / spread) if spread > 0 else math.nan


def _with_highest(time: FloatArray, force: FloatArray, pull: Pull) -> Pull:
    """A pull whose static peak is the highest force before it slides, where its rule has stopped at a precursor."""
    begin, end = pull.onset_s, pull.window_s[0] if math.isfinite(pull.window_s[0]) else float(time[-1])
    first, last = (int(k) for k in np.searchsorted(time, (begin, end)))
    if last - first < _FEWEST:
        return pull
    smooth = _smoothed_rise(force[first:last], pull, time[first:last])
    k = int(np.argmax(smooth))
    if smooth[k] - pull.static_N < max(_DROP * pull.static_N, 4.0 * sample_noise(force)):
        return pull
    return with_static_peak(pull, float(time[first + k]), float(smooth[k]), sample_noise(force))


def _smoothed_rise(force: FloatArray, pull: Pull, time: FloatArray) -> FloatArray:
    """Force without impulses, as means over a fiftieth of the rise."""
    width = int(np.searchsorted(time, pull.peak_s) // 50)
    return running_mean(median_of_three(force), width)


def _course(at: FloatArray, rise: FloatArray, top_N: float) -> FloatArray:
    """A parabola through a rise, by which its parts are cut: noise has no say in where."""
    inside = (rise > 0.1 * top_N) & (rise < 0.95 * top_N)
    if np.count_nonzero(inside) < _FEWEST:
        return rise
    middle = float(at.mean())
    return np.asarray(np.polyval(np.polyfit(at[inside] - middle, rise[inside], 2), at - middle))


def _of_rise(time: FloatArray, force: FloatArray, pull: Pull, speed: float, tau: float) -> dict[str, Feature]:
    """Slopes of the rise between shares of the static peak, and the falls on the way to it."""
    first, top = (int(k) for k in np.searchsorted(time, (pull.onset_s, pull.peak_s)))
    at, rise = time[first : top + 1], force[first : top + 1]
    if rise.size < _FEWEST:
        return {}
    smooth = _smoothed_rise(rise, pull, at)
    course = _course(at, smooth, pull.static_N)
    slopes, found = [], {}
    for low, high in (_LOWER, _UPPER):
        a, b = (int(np.argmax(course >= share * pull.static_N)) for share in (low, high))
        slopes.append((*_slope(at[a:b], rise[a:b], tau), b - a) if b - a >= _FEWEST else (math.nan, math.nan, 0))
    (slope, u, count), (upper, upper_u, more) = slopes
    found["rise_stiffness_N_per_m"] = _normal(slope / speed, u / speed, count)
    ratio = upper / slope
    found["rise_bend"] = _normal(ratio - 1.0, abs(ratio) * math.hypot(upper_u / upper, u / slope), count + more)
    away = np.abs(smooth - running_mean(smooth, max(smooth.size // 12, 3)))[
        smooth.size // 2 :
    ]  # near the peak, where it is
    noise = MEDIAN_TO_SD * float(np.median(away))
    least = max(_DROP * pull.static_N, _OVER_NOISE * noise)
    falls = turning_points(np.append(smooth, smooth[-1] - 2.0 * least), least)[0]  # the peak itself is the last one
    found["precursor_drops"] = Feature(float(falls.size - 1), 0.0, math.nan, math.nan, rise.size)
    return found


def _of_decay(time: FloatArray, force: FloatArray, pull: Pull, speed: float, tau: float) -> dict[str, Feature]:
    """Static drop, length of the decay after the peak and width of the peak."""
    drop, drop_u = pull.static_N - pull.sliding_N, math.hypot(pull.static_u_N, pull.sliding_u_N)
    found = {"static_drop_N": _normal(drop, drop_u, 2)}
    first, top = (int(k) for k in np.searchsorted(time, (pull.onset_s, pull.peak_s)))
    after, fall = time[top:] - pull.peak_s, force[top:]
    if not drop > 5.0 * sample_noise(force) or fall.size < 2 * _FEWEST:
        return found
    fallen = int(np.argmax(_smoothed_rise(fall, pull, time) - pull.sliding_N <= drop / math.e))
    if fallen < 3:
        return found
    length_s = float(after[fallen])
    for _ in range(3):
        last = int(np.searchsorted(after, _DECAYS * length_s))
        fitted = _decay_fit(after[2:last], fall[2:last], length_s, tau)
        if fitted is None:
            return found
        length_s, length_u, start, start_u, level = fitted
    found["decay_length_um"] = _normal(1e6 * speed * length_s, 1e6 * speed * length_u, last)
    rise, at = force[first:top], time[first:top] - pull.peak_s
    course = _course(at, _smoothed_rise(rise, pull, time), pull.static_N) if rise.size > _FEWEST else rise
    near = (course > _BELOW_PEAK[0] * pull.static_N) & (course < _BELOW_PEAK[1] * pull.static_N)
    if np.count_nonzero(near) < _FEWEST or not start > level:
        return found
    slope, middle, mean = line(at[near], rise[near])
    away, reach = rise[near] - mean - slope * (at[near] - middle), at[near] - middle
    stretched = float(away @ away) / (near.sum() - 2) * max(_correlation_time(away), tau)
    when = 0.0
    for _ in range(20):  # where the line of the rise meets the decay
        down = level + (start - level) * math.exp(min(-when / length_s, 5.0))
        when -= (mean + slope * (when - middle) - down) / (slope + (down - level) / length_s)
    top_N, down_slope = mean + slope * (when - middle), -(down - level) / length_s
    up_u = math.sqrt(stretched * (1.0 / near.sum() + (when - middle) ** 2 / float(reach @ reach)))
    top_u = math.hypot(slope * start_u, down_slope * up_u) / (slope - down_slope)
    if not abs(when) < length_s or not top_N > pull.sliding_N:
        return found
    drop = top_N - pull.sliding_N
    found["static_drop_N"] = _normal(drop, math.hypot(top_u, pull.sliding_u_N), int(near.sum()) + last)
    below = top_N - _WIDTH_AT * drop
    if below > level:
        bent = np.gradient(course)
        slope *= float(bent[-1] / bent[near].mean())  # the rise may bend between there and the peak
        if not slope > 0:
            return found  # steps of the recorder: it stands still before the peak
        rising, slope_u = _WIDTH_AT * drop / slope, math.sqrt(stretched / float(reach @ reach))
        width = rising + length_s * math.log((top_N - level) / (below - level))
        u = math.hypot(rising * slope_u / slope, rising * top_u / drop, (width - rising) * length_u / length_s)
        found["peak_width_um"] = _normal(1e6 * speed * width, 1e6 * speed * u, int(near.sum()) + last)
    return found


def _decay_fit(
    after: FloatArray, fall: FloatArray, length_s: float, tau: float
) -> tuple[float, float, float, float, float] | None:
    """Length of an exponential decay (s), its force at the start and the level, the first two with uncertainties."""
    from scipy.optimize import least_squares

    def decay(t: FloatArray, length: float, start: float, level: float) -> FloatArray:
        return np.asarray(level + (start - level) * np.exp(-t / abs(length)))

    def slopes_of(values: FloatArray) -> FloatArray:
        length, start, level = values
        left = np.exp(-after / abs(length))
        longer = math.copysign(1.0, length) * (start - level) * left * after / length**2
        return np.column_stack([longer, left, 1.0 - left])

    if after.size < _FEWEST:
        return None
    guess = length_s, float(fall[0]), float(np.median(fall[-max(fall.size // 4, 1) :]))
    try:
        solved = least_squares(
            lambda values: decay(after, *values) - fall, guess, slopes_of, method="lm", max_nfev=200,
            ftol=_CONVERGED, xtol=_CONVERGED, gtol=_CONVERGED,
        )  # fmt: skip
    except ValueError:
        return None
    if not solved.success:
        return None
    best = solved.x
    away, slopes = fall - decay(after, *best), slopes_of(best)
    inverse = np.linalg.pinv(slopes.T @ slopes)  # noise differs along the decay: the covariance of White (1980)
    covariance = inverse @ (slopes.T * away**2) @ slopes @ inverse * after.size / (after.size - 3.0)
    variance = np.diag(covariance) * max(_correlation_time(away), tau)
    if not (variance > 0.0).all():
        return None  # no decay: its length is without bound, and rounding decides
    u = np.sqrt(variance)
    return abs(float(best[0])), float(u[0]), float(best[1]), float(u[1]), float(best[2])


def _of_machine(trace: Trace, time: FloatArray, force: FloatArray, pull: Pull) -> dict[str, Feature]:
    """What machine and recorder leave in a pull: a load that falls with it, a missed peak, a turn of the drive."""
    end_s = pull.window_s[1] if math.isfinite(pull.window_s[1]) else float(time[-1])
    first, last = (int(k) for k in np.searchsorted(time, (pull.onset_s, end_s)))
    found = {}
    if last - first >= _FEWEST:
        top = first + int(np.argmax(force[first:last]))
        before, after = force[max(top - 2, 0) : top + 1], force[top : top + 3]
        if before.size == after.size == 3 and (up := float(np.diff(before).max())) > 0:
            down = float(after[0] - after.min())
            missed = 0.5 * up * down / (up + down)
            noise = sample_noise(force) * math.hypot(down**2, up**2) / (up + down) ** 2
            found["missed_peak_N"] = _normal(missed, math.hypot(noise, missed / math.sqrt(3.0)), 5)
    load = trace.columns.get("normal_force_N")
    rest = int(np.searchsorted(time, 2.0 * pull.onset_s - pull.peak_s))  # as long as the rise
    if load is not None and last - rest >= 2 * _FEWEST and np.ptp(load) > 0:
        carried = np.abs(np.interp(time[rest:last], trace.time_s, load))
        if carried[: first - rest + 1].min() > _LOADED * float(np.median(carried)):
            slope, u = _slope(force[rest:last], carried)
            found["load_lost_per_pull"] = _normal(-slope, u, last - rest)
    if trace.displacement_m is not None:
        found |= _of_turn(np.interp(time, trace.time_s, trace.displacement_m), force, last)
    return found


def _of_turn(drive_m: FloatArray, force: FloatArray, last: int) -> dict[str, Feature]:
    """How much of the force is left where the line of the unloading begins; nothing where the drive does not turn."""
    forward = drive_m if drive_m[last - 1] >= drive_m[0] else -drive_m
    turn = int(np.argmax(forward))
    back = forward[turn] - forward[turn:]
    slid = (forward > forward[turn] - _BEFORE_TURN * (forward[turn] - forward[0])) & (np.arange(forward.size) <= turn)
    before = float(np.median(force[slid]))
    below = np.flatnonzero(force[turn:] < _UNLOADING[0] * before)
    end = int(below[0]) if below.size else back.size
    inside = np.flatnonzero(force[turn : turn + end] < _UNLOADING[1] * before)
    if before <= 0 or inside.size < _FEWEST or not below.size:
        return {}
    way, unloading = back[inside[0] : end], force[turn + inside[0] : turn + end]
    slope, slope_u = _slope(way, unloading)
    kept, reach = (float(unloading.mean()) - slope * float(way.mean())) / before, math.hypot(way.mean(), way.std())
    return {"force_kept_at_turn": _normal(kept, slope_u * reach / before, int(way.size))}


def _of_slips(slips: Sequence[Slip]) -> dict[str, Feature]:
    """Medians over the slips of stick-slip; the fall from the static peak of a pull from rest is none of them."""
    later = [s for s in slips if math.isfinite(s.recurrence_s)]
    if len(later) < _FEWEST_SLIPS:
        return {}
    columns = {
        "stick_peak_N": [s.peak_N for s in later], "stick_trough_N": [s.trough_N for s in later],
        "drop_N": [s.drop_N for s in later], "period_s": [s.recurrence_s for s in later],
        "hold_s": [s.hold_s for s in later], "loading_stiffness_N_per_m": [s.stiffness_N_per_m for s in later],
        "slip_um": [1e6 * s.slip_m for s in later], "slip_duration_s": [s.duration_s for s in later],
        "peak_velocity_mm_s": [1e3 * s.peak_velocity_m_s for s in later],
        "creep_um": [1e6 * s.precursory_slip_m for s in later],
    }  # fmt: skip
    found = {name: median_with_interval(np.array(values)) for name, values in columns.items()}
    stiffness = found["loading_stiffness_N_per_m"]
    shared = 1e6 * found["drop_N"].value * stiffness.u / stiffness.value**2  # the slope is that of all loadings
    for name, share in (("creep_um", _BEYOND_MIDDLE), ("slip_um", 1.0)):
        one = found[name]
        wider = math.hypot(one.u, share * shared) / one.u if one.u > 0 else 1.0
        low, high = (one.value + wider * (end - one.value) for end in (one.low, one.high))
        found[name] = replace(one, u=wider * one.u, low=low, high=high)
    return found


def median_with_interval(values: FloatArray) -> Feature:
    """The median and its distribution-free 95 % interval, between order statistics (Hettmansperger and Sheather, 1986,
    Statistics & Probability Letters 4), widened where values that follow each other are alike."""
    from scipy.stats import binom

    in_order = values[np.isfinite(values)]
    ranked, n = np.sort(in_order), in_order.size
    if n < _FEWEST_SLIPS:
        return Feature(math.nan, math.nan, math.nan, math.nan, n)
    middle = float(np.median(ranked))
    k = max(int(binom.ppf(0.025, n, 0.5)), 1)
    wide, narrow = (1.0 - 2.0 * float(binom.cdf(j - 1, n, 0.5)) for j in (k, k + 1))
    share = min(max((wide - 0.95) / (wide - narrow), 0.0), 1.0) if wide > narrow else 0.0
    step = (n - k) * share / (k + (n - 2 * k) * share)  # from the k-th towards the next order statistic
    low = (1.0 - step) * ranked[k - 1] + step * ranked[k]
    high = (1.0 - step) * ranked[n - k] + step * ranked[n - k - 1]
    ranks = np.argsort(np.argsort(in_order)) - (n - 1.0) / 2.0
    alike = float(ranks[1:] @ ranks[:-1]) / float(ranks @ ranks)
    alike += (1.0 + 4.0 * alike) / n  # what the estimate is short of (Kendall, 1954, Biometrika 41)
    stretch = math.sqrt(max(1.0 + 2.0 * alike, 1.0))
    low, high = (middle + stretch * (float(end) - middle) for end in (low, high))
    return Feature(middle, (high - low) / (2.0 * _NORMAL), low, high, n)


def _of_sliding(time: FloatArray, force: FloatArray, pull: Pull) -> dict[str, Feature]:
    """Drift, roughness and spectrum of the force over the sliding window."""
    from scipy.signal import welch
    from scipy.special import gammaincinv, stdtrit

    if not math.isfinite(pull.window_s[0]):
        return {}
    first, last = np.searchsorted(time, pull.window_s)
    at, part = time[first : last + 1], force[first : last + 1]
    if part.size < 4 * _BLOCKS:
        return {}
    inside = [s for s in pull.slips[1:-1] if at[0] <= s.fail_s <= at[-1]]  # the first and last lack a line beside them
    found = {}
    if len(inside) > _FEWEST_SLIPS:  # the middles of slips do not depend on how high each of them began
        x, y = (np.array(v) for v in zip(*((s.fail_s + s.end_s, s.peak_N + s.trough_N) for s in inside), strict=True))
        x, y = x / 2.0, y / 2.0
    else:
        x, y = (condense(v, part.size // _BLOCKS) for v in (at, part))
    if x.size > 3:
        slope, middle, mean = line(x, y)
        away, reach = y - mean - slope * (x - middle), x - middle
        u = math.sqrt(float(away @ away) / (x.size - 2) / float(reach @ reach))
        half = float(stdtrit(x.size - 2, 0.975)) * u
        found["drift_N_per_s"] = Feature(slope, u, slope - half, slope + half, int(x.size))
    slope, middle, mean = line(at, part)
    away = part - mean - slope * (at - middle)
    if not np.ptp(part):
        return found  # a force that stands still, to the bit, has neither roughness nor a frequency
    if mean:
        rough, free = float(away.std()) / abs(mean), max(part.size / _correlation_time(away), 2.0)
        low, high = (rough * math.sqrt(free / (2.0 * float(gammaincinv(free / 2.0, p)))) for p in (0.975, 0.025))
        found["roughness"] = Feature(rough, (high - low) / (2.0 * _NORMAL), low, high, part.size)
    pace = float(at[-1] - at[0]) / (at.size - 1)
    even = np.interp(at[0] + pace * np.arange(at.size), at, away)
    frequency, power = welch(even, 1.0 / pace, nperseg=min(even.size, max(256, even.size // 4)))
    main = float(frequency[1 + int(np.argmax(power[1:]))])
    bin_Hz = float(frequency[1])
    found["main_frequency_Hz"] = Feature(
        main, bin_Hz / math.sqrt(12.0), main - bin_Hz / 2, main + bin_Hz / 2, part.size
    )
    near = np.abs(frequency - main) <= max(_NEAR * main, bin_Hz)
    found["main_share"] = Feature(float(power[near].sum() / power.sum()), math.nan, math.nan, math.nan, part.size)
    return found
