"""Coulomb friction, its growth at rest, and the machine from the slips of a record: maximum likelihood over slips."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from scipy.ndimage import median_filter
from scipy.optimize import least_squares, minimize
from scipy.stats import t as student

from tribo.records import FloatArray, TraceLaw, TraceLawParameter
from tribo.traces.signal import sample_noise, turning_points

LAWS = ("coulomb", "ageing")
_SMALLEST_DROP = 0.25  # share of the range between the 2nd and 98th percentile from which on a fall counts as a slip
_NOISE = 8.0  # and this many times the noise of a sample
FEWEST_SLIPS = 8
_FEWEST_IN_SLIP = 8  # samples between peak and trough from which on the slip itself is fitted
_LOADING = (0.3, 0.95)  # share of the time of a loading between which its slope is taken
_OUTLIER = 5.0  # median deviations from the median beyond which a slip does not count
_MAD = 1.4826
_CLEAR = 2.0  # standard errors by which a law must predict slips left out better


def fit_slips(
    time_s: FloatArray, force_N: FloatArray, law: str, normal_load_N: float, speed_m_s: float
) -> TraceLaw | None:
    """Friction law and machine from the slips of a record of stick-slip at constant speed; None with too few slips.

    Between slips the force rises at k v. Within a slip it follows the damped oscillation of a slider under Coulomb
    friction; each slip gives its own static and sliding friction, mass and damping. Over the slips each is normal, with
    a correlation from one slip to the next that is estimated; the intervals are those of its mean. Under "ageing" the
    static friction of a slip is mu_s + b ln(time stuck / 1 s) with normal scatter. The time stuck is itself a result of
    static friction, so the likelihood is that of the times stuck given the troughs before them.

    Parameters
    ----------
    time_s, force_N
        The record, shape (n,), in s and N.
    law : "coulomb" or "ageing"
        The law.
    normal_load_N, speed_m_s
        Normal load and speed of the drive.

    Returns
    -------
    TraceLaw
        mu_s, mu_d, stiffness_N_per_m, mass_kg, damping_N_s_per_m (and b) with 95 % intervals. Where the record has too
        few samples in a slip, mass and damping cannot be told, and sliding friction lies between the trough (a slip
        that is stopped by damping) and the middle of peak and trough (one without).
    """
    found = _slips(np.asarray(time_s, float), np.asarray(force_N, float))
    if found is None:
        return None
    peak, trough, slope, stuck, before, shapes = found
    stiffness = _mean("stiffness_N_per_m", slope / speed_m_s, "N/m")
    rows = [stiffness]
    if shapes.shape[0] >= FEWEST_SLIPS:
        static, sliding, omega, gamma = shapes.T
        mass = slope[: omega.size].mean() / speed_m_s / omega**2
        rows += [_mean("mu_d", sliding / normal_load_N, "1"), _mean("mass_kg", mass, "kg")]
        rows.append(_mean("damping_N_s_per_m", 2.0 * gamma * mass, "N s/m"))
        held = _mean("mu_s", static / normal_load_N, "1")
    else:
        middle = _mean("mu_d", 0.5 * (peak + trough) / normal_load_N, "1")
        lowest = _mean("mu_d", trough / normal_load_N, "1")
        rows.append(TraceLawParameter("mu_d", middle.value, lowest.low, middle.high, "1", False))
        for name, unit in (("mass_kg", "kg"), ("damping_N_s_per_m", "N s/m")):
            rows.append(TraceLawParameter(name, math.nan, 0.0, math.inf, unit, False))
        held = _mean("mu_s", peak / normal_load_N, "1")
    scores = _scores(before, slope, stuck, law)
    if law == "ageing":
        rows = [*_ageing(before, slope, stuck, normal_load_N, peak.mean() - trough.mean()), *rows]
    else:
        rows = [held, *rows]
    return TraceLaw(law, tuple(rows), float(scores.sum()), peak.size, "slips", tuple(scores))


def _slips(
    time: FloatArray, force: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, FloatArray] | None:
    """Of every slip: peak, trough, loading slope before it, time stuck, force at which it was stuck first, and of those
    with enough samples static and sliding force, frequency and damping rate of the slip."""
    calm = np.asarray(median_filter(force, 3, mode="nearest"), float)
    low, high = np.percentile(calm, [2.0, 98.0])
    least = max(_SMALLEST_DROP * (high - low), _NOISE * sample_noise(force))
    peaks, troughs = turning_points(calm, least)
    pairs = [(p, int(troughs[troughs > p][0])) for p in peaks if (troughs > p).any()]
    if len(pairs) <= FEWEST_SLIPS:
        return None
    kept, shapes = [], []
    for (_, start), (p, q) in pairwise(pairs):
        if p - start < 5:
            continue
        t, f = time[start:p], force[start:p]
        inside = slice(int(_LOADING[0] * t.size), max(int(_LOADING[1] * t.size), int(_LOADING[0] * t.size) + 3))
        if t[inside].size < 3:
            continue
        pace, level = np.polyfit(t[inside] - t[0], f[inside], 1)
        if not pace > 0:
            continue
        kept.append((p, q, start, pace, level))
    if len(kept) < FEWEST_SLIPS:
        return None
    pace = float(np.median([row[3] for row in kept]))
    for p, q, start, _, _ in kept:
        if q - p >= _FEWEST_IN_SLIP:
            shape = _shape(time, force, p, q, start, pace)
            if shape is not None:
                shapes.append(shape)
    resolved = len(shapes) >= max(FEWEST_SLIPS, len(kept) // 2)
    tops, ends = (np.array([row[k] for row in kept]) for k in range(2))
    peak = calm[tops]
    level = np.array([row[4] for row in kept])  # the line of the loading, at the trough before it
    stuck = (peak - level) / pace
    good = stuck > 0
    slopes = np.array([row[3] for row in kept])
    shaped = np.array(shapes) if resolved else np.zeros((0, 4))
    return peak[good], calm[ends][good], slopes[good], stuck[good], level[good], shaped


def _shape(
    time: FloatArray, force: FloatArray, p: int, q: int, start: int, pace: float
) -> FloatArray | None:
    """Static and sliding force, frequency and damping rate of one slip, by least squares about it.

    Noise shifts the estimates of one slip, and does so in all slips alike. How far is found by a second fit, to the
    first one with its residuals in reversed order, and taken off (Efron and Tibshirani, An Introduction to the
    Bootstrap, 1993, chapter 10).
    """
    width = q - p
    a, b = max(p - max(2 * width, 20), start + (p - start) // 3), min(q + width // 2, time.size)
    t, f = time[a:b] - time[p], force[a:b]
    duration, size = float(time[q] - time[p]), max(float(force[p] - force[q]), 1e-300)
    turn = math.pi / duration
    begin = np.array([0.0, force[p], 0.5 * (force[p] + force[q]), turn, 0.1 * turn])
    scale = np.array([duration, size, size, turn, turn])
    low = np.array([-duration, -np.inf, -np.inf, 0.2 * turn, -0.5 * turn])
    high = np.array([duration, np.inf, np.inf, 5.0 * turn, 2.0 * turn])

    def fitted(f: FloatArray, begin: FloatArray) -> FloatArray:
        def residuals(x: FloatArray) -> FloatArray:
            return (slip_force(t, x[0], x[1], x[2], x[3], x[4], pace) - f) / size

        return np.asarray(least_squares(residuals, begin, x_scale=scale, bounds=(low, high), max_nfev=60).x)

    first = fitted(f, begin)
    if not first[1] > first[2] or np.isclose(first[3:], [low[3], high[4]], rtol=1e-6).any():
        return None
    model = slip_force(t, first[0], first[1], first[2], first[3], first[4], pace)
    x = 2.0 * first - fitted(model + (f - model)[::-1], np.clip(first, low + 1e-9 * scale, high - 1e-9 * scale))
    return np.array([x[1], x[2], math.sqrt(x[3] ** 2 + x[4] ** 2), x[4]])


def slip_force(
    t: FloatArray, start_s: float, static_N: float, sliding_N: float, omega: float, gamma: float, pace_N_per_s: float
) -> FloatArray:
    """Force on a slider that is loaded at a pace, slips once under Coulomb friction and sticks again, in closed form.

    ``omega`` is the damped frequency, ``gamma`` the damping rate. Its mass times its acceleration is F - sliding_N, a
    damped oscillation. It begins at static_N - sliding_N; there its slope is that of loading less what the damper loses
    as the slider starts. It ends where its integral, the momentum of the slider, is zero again.
    """
    excess, s = static_N - sliding_N, np.asarray(t, float) - start_s
    sine = (pace_N_per_s - gamma * excess) / omega

    def swing(u: FloatArray | float) -> FloatArray:
        after = np.asarray(u)
        return np.exp(-gamma * after) * (excess * np.cos(omega * after) + sine * np.sin(omega * after))

    def momentum(u: FloatArray) -> FloatArray:
        fade, c, d = np.exp(-gamma * u), np.cos(omega * u), np.sin(omega * u)
        return excess * (fade * (omega * d - gamma * c) + gamma) - sine * (fade * (gamma * d + omega * c) - omega)

    grid = np.linspace(0.5 * math.pi / omega, 2.0 * math.pi / omega, 400)
    left = momentum(grid)
    gone = np.flatnonzero(left <= 0.0)
    if gone.size and gone[0] > 0:
        i = int(gone[0])
        stop = float(grid[i - 1] + left[i - 1] / (left[i - 1] - left[i]) * (grid[i] - grid[i - 1]))
    else:
        stop = float(grid[-1])
    last = float(swing(stop))
    sliding = sliding_N + swing(np.clip(s, 0.0, stop))
    return np.where(
        s < 0.0, static_N + pace_N_per_s * s,
        np.where(s < stop, sliding, sliding_N + last + pace_N_per_s * (s - stop)),
    )  # fmt: skip


def _mean(name: str, values: FloatArray, unit: str) -> TraceLawParameter:
    """Mean over slips with its 95 % interval, for normal values correlated from one to the next."""
    middle = float(np.median(values))
    width = _MAD * float(np.median(np.abs(values - middle)))
    kept = values[np.abs(values - middle) <= _OUTLIER * width] if width > 0 else values
    n, centred = kept.size, kept - kept.mean()
    power = float(centred @ centred)
    rho = max(0.0, float(centred[1:] @ centred[:-1]) / power + 1.0 / n) if power > 0 else 0.0  # less its bias
    effective = max(n * (1.0 - min(rho, 0.95)) / (1.0 + min(rho, 0.95)), 2.0)
    half = float(student.ppf(0.975, max(effective - 1.0, 1.0)) * kept.std(ddof=1) / math.sqrt(effective))
    value = float(kept.mean())
    return TraceLawParameter(name, value, value - half, value + half, unit, bool(half < abs(value)))


def _cost(p: FloatArray, before: FloatArray, slope: FloatArray, stuck: FloatArray) -> FloatArray:
    """Minus the log density of every time stuck: the force reached then is static friction, with normal scatter.

    With F = before + slope h and F_s = A + B ln h the scatter is F - F_s, and its change with h is slope - B / h.
    """
    A, B, log_sd = p
    scatter = before + slope * stuck - A - B * np.log(stuck)
    change = np.abs(slope - B / stuck)
    return 0.5 * (scatter * np.exp(-log_sd)) ** 2 + log_sd - np.log(np.maximum(change, 1e-300))


def _fit_static(
    before: FloatArray, slope: FloatArray, stuck: FloatArray, growing: bool
) -> tuple[FloatArray, FloatArray]:
    """A, B and the logarithm of the scatter of greatest likelihood, and their covariance."""
    peak = before + slope * stuck
    start = np.array([peak.mean(), 0.0, math.log(max(peak.std(), 1e-12))])

    def total(p: FloatArray) -> float:
        return float(_cost(np.array([p[0], p[1] if growing else 0.0, p[-1]]), before, slope, stuck).sum())

    first = start if growing else start[[0, 2]]
    size = np.array([peak.std(), peak.std(), 1.0]) if growing else np.array([peak.std(), 1.0])
    size = np.maximum(size, 1e-12)
    best = minimize(lambda u: total(first + size * u), np.zeros(first.size), method="Nelder-Mead",
                    options={"xatol": 1e-6, "fatol": 1e-8, "maxiter": 4000, "maxfev": 4000})  # fmt: skip
    n = first.size
    hessian, step = np.empty((n, n)), 1e-3

    def at(*moves: tuple[int, float]) -> float:
        u = best.x.copy()
        for i, d in moves:
            u[i] += d
        return total(first + size * u)

    for i in range(n):
        for j in range(n):
            even = at((i, step), (j, step)) + at((i, -step), (j, -step))
            hessian[i, j] = (even - at((i, step), (j, -step)) - at((i, -step), (j, step))) / (4 * step**2)
    covariance = np.linalg.pinv(hessian) * np.outer(size, size)
    found = first + size * best.x
    return (found if growing else np.array([found[0], 0.0, found[1]])), np.asarray(covariance, float)


def _ageing(
    before: FloatArray, slope: FloatArray, stuck: FloatArray, normal_load_N: float, drop_N: float
) -> list[TraceLawParameter]:
    """mu_s after 1 s at rest, and b per e-fold of the time at rest."""
    p, covariance = _fit_static(before, slope, stuck, True)
    factor = float(student.ppf(0.975, max(stuck.size - 3, 1)))
    half = factor * np.sqrt(np.maximum(np.diag(covariance)[:2], 0.0))
    told = bool(half[1] < 0.5 * drop_N)
    value, half = p[:2] / normal_load_N, half / normal_load_N
    return [
        TraceLawParameter(name, float(value[k]), float(value[k] - half[k]), float(value[k] + half[k]), "1", told)
        for k, name in enumerate(("mu_s_after_1_s", "b"))
    ]


def _scores(before: FloatArray, slope: FloatArray, stuck: FloatArray, law: str) -> FloatArray:
    """Log density of every slip by a fit without the fifth of the slips, following each other, that it stands in."""
    n = stuck.size
    fold = np.arange(n) * 5 // n
    scores = np.empty(n)
    for k in range(5):
        out = fold == k
        p, _ = _fit_static(before[~out], slope[~out], stuck[~out], law == "ageing")
        scores[out] = -_cost(p, before[out], slope[out], stuck[out])
    return scores


def clearly_better(one: TraceLaw, other: TraceLaw) -> bool:
    """Whether a law predicts slips left out better than another, by twice the standard error of the difference."""
    gain = np.array(one.scores) - np.array(other.scores)
    return bool(gain.mean() > _CLEAR * gain.std(ddof=1) / math.sqrt(gain.size))
