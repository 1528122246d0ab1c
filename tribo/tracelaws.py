"""Friction laws and machines read from whole traces: from slips, steps of speed, strokes to and fro, and speeds.

Which records of a campaign hold a law beyond mu and tau0, slips under Coulomb friction or its growth at rest (maximum
likelihood over slips), rate and state from steps of speed (least squares of whitened residuals), friction with backlash
from a drive that goes to and fro (least squares, with strokes as the evidence), and means of several stretches or
records: friction over speed, static friction over the time at rest.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import groupby, pairwise
from typing import Any

import numpy as np
from scipy.linalg import solve_toeplitz
from scipy.optimize import least_squares, minimize
from scipy.stats import norm, t as student

from tribo.records import (
    MEDIAN_TO_SD,
    FloatArray,
    Ingested,
    Phase,
    Pull,
    Slip,
    Test,
    Trace,
    TraceLaw,
    TraceLawParameter,
)
from tribo.slider.motion import Drive, speed_steps
from tribo.slider.rate_and_state import WEIGHTS, integrated
from tribo.traces.events import slips_of
from tribo.traces.signal import median_of_three

SLIP_LAWS = ("coulomb", "ageing")
FEWEST_SLIPS = 8
_FEWEST_IN_SLIP = 8  # samples between peak and trough from which on the slip itself is fitted
_LOADING = (0.3, 0.95)  # share of the time of a loading between which its slope is taken
_OUTLIER = 5.0  # median deviations from the median beyond which a slip does not count
_CLEAR = 2.0  # standard errors by which a law must predict slips left out better
_LIKELIER = 3.0  # log likelihood by which one of two laws must be better: a ratio of 20 to 1


def fit_slips(
    time_s: FloatArray, force_N: FloatArray, laws: Sequence[str], normal_load_N: float, speed_m_s: float,
    slips: Sequence[Slip] | None = None,
) -> list[TraceLaw]:  # fmt: skip
    """Friction laws and machine from the slips of a record of stick-slip at constant speed; none with too few slips.

    Between slips the force rises at k v. Within a slip it follows the damped oscillation of a slider under Coulomb
    friction; each slip gives its own static and sliding friction, mass and damping. Over the slips each is normal, with
    a correlation from one slip to the next that is estimated; the intervals are those of its mean. Under "ageing" the
    static friction of a slip is mu_s + b ln(time stuck / 1 s) with normal scatter. The time stuck is itself a result of
    static friction, so the likelihood is that of the times stuck given the troughs before them.

    Parameters
    ----------
    time_s, force_N
        The record, shape (n,), in s and N.
    laws : sequence of "coulomb" and "ageing"
        The laws; each slip is fitted once for all of them.
    normal_load_N, speed_m_s
        Normal load and speed of the drive.
    slips
        The slips of the record, as in ``Pull.slips``; by default those that :func:`tribo.traces.slips_of` finds.

    Returns
    -------
    list of TraceLaw
        Of every law mu_s, mu_d, stiffness_N_per_m, mass_kg, damping_N_s_per_m (and b) with 95 % intervals. Where the
        record has too few samples in a slip, mass and damping cannot be told, and sliding friction lies between the
        trough (a slip that is stopped by damping) and the middle of peak and trough (one without).
    """
    time, force = np.asarray(time_s, float), np.asarray(force_N, float)
    found = _of_every_slip(time, force, slips_of(time, force, speed_m_s=speed_m_s) if slips is None else slips)
    if found is None:
        return []
    peak, trough, slope, stuck, before, shapes = found
    rows = [_mean("stiffness_N_per_m", slope / speed_m_s, "N/m")]
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
    made = []
    for law in laws:
        grown = law == "ageing"
        static = _ageing(before, slope, stuck, normal_load_N, peak.mean() - trough.mean()) if grown else [held]
        scores = _scores(before, slope, stuck, law)
        made.append(TraceLaw(law, (*static, *rows), float(scores.sum()), peak.size, "slips", tuple(scores)))
    return made


def _of_every_slip(
    time: FloatArray, force: FloatArray, slips: Sequence[Slip]
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, FloatArray] | None:
    """Of every slip: peak, trough, loading slope before it, time stuck, force at which it was stuck first, and of those
    with enough samples static and sliding force, frequency and damping rate of the slip."""
    calm = median_of_three(force)
    if len(slips) <= FEWEST_SLIPS:
        return None
    fails, ends = (np.searchsorted(time, [getattr(slip, name) for slip in slips]) for name in ("fail_s", "end_s"))
    tops, troughs, begin = [], [], int(fails[0])
    for end, following in zip(ends, [*fails[1:], ends[-1]], strict=True):
        tops.append(begin + int(np.argmax(calm[begin : end + 1])))
        begin = tops[-1] + int(np.argmin(calm[tops[-1] : following + 1]))
        troughs.append(begin)
    kept, shapes = [], []
    for (_, start), (p, q) in pairwise(zip(tops, troughs, strict=True)):
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
    peak, trough = (calm[[row[k] for row in kept]] for k in range(2))
    level = np.array([row[4] for row in kept])  # the line of the loading, at the trough before it
    stuck = (peak - level) / pace
    good = stuck > 0
    slopes = np.array([row[3] for row in kept])
    shaped = np.array(shapes) if resolved else np.zeros((0, 4))
    return peak[good], trough[good], slopes[good], stuck[good], level[good], shaped


def _shape(
    time: FloatArray, force: FloatArray, p: int, q: int, start: int, pace: float
) -> FloatArray | None:
    """Static and sliding force, frequency and damping rate of one slip, by least squares about it; None if it has none.

    Noise shifts the estimates of one slip, and does so in all slips alike. How far is found by a second fit, to the
    first one with its residuals in reversed order, and taken off (Efron and Tibshirani, An Introduction to the
    Bootstrap, 1993, chapter 10).
    """
    if not force[p] > force[q]:  # a fall of the calmed force alone
        return None
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
    width = MEDIAN_TO_SD * float(np.median(np.abs(values - middle)))
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
    """Whether a law predicts what was left out better than another: by twice the standard error, and by 20 to 1.

    Where little was left out, the standard error is uncertain itself: it is the same chance by the t distribution.
    """
    gain = np.array(one.scores) - np.array(other.scores)
    clear = float(student.isf(norm.sf(_CLEAR), gain.size - 1))
    return bool(gain.sum() > max(clear * gain.std(ddof=1) * math.sqrt(gain.size), _LIKELIER))


Filter = Callable[[FloatArray], FloatArray]
STEP_LAWS = ("dieterich", "ruina")
_TOLERANCE = 1e-9  # of the integration; noise of records is a thousand times larger at the least
_MOST_LAGS = 8  # order of the autoregressive noise, chosen up to here by the Akaike criterion
_ROUNDS = 3  # of fit, noise, fit
_AFTER, _BEFORE = 30.0, 15.0  # characteristic slips that are kept of a record after the last and before the first step
_FEWEST = 40  # samples of a stretch
_FROM_DIRECT = (0.05, 0.2, 0.8)  # starts: characteristic slip as a share of the slip after the step, in steps of four
_STIFFEST = 5.0  # logarithm of the largest stiffness over its start: far beyond, a machine is rigid and steps tiny
_MOST_STEPS = 100  # of the integration for each sample: no friction that a record can show needs more
_UNTOLD_SD = math.log(10.0) / (2 * 1.96)  # of a logarithm: the 95 % interval is a factor of ten wide
_UNRESOLVED = 10.0  # answers of the machine, a / (k v) each, or characteristic slips from one sample to the next


def fit_steps(
    time_s: FloatArray, friction: FloatArray, laws: Sequence[str], drive: Drive, stiffness_per_m: float = math.nan
) -> list[TraceLaw]:
    """Rate and state, and the machine, from a record of friction under steps of speed.

    The slider has no inertia. The model is friction of the law under the drive, with a steady drift per slip. Noise is
    autoregressive; its order and coefficients follow from the residuals, and the fit is repeated on whitened residuals.
    Intervals are those of the curvature of the likelihood (Laplace) in a, b and the logarithms of Dc and stiffness.

    Parameters
    ----------
    time_s, friction
        Evenly sampled record, shape (n,); friction is force over normal load.
    laws : sequence of "dieterich" and "ruina"
        Ageing or slip law, with one state. All are fitted to one stretch of the record: their likelihoods can be
        compared.
    drive
        Speeds of the drive; time counts from the first sample.
    stiffness_per_m
        Stiffness of the machine over the normal load in 1/m, where it is known; else it is fitted.

    Returns
    -------
    list of TraceLaw
        Of every law mu0 at the first speed, a, b, a - b, Dc_m and stiffness_per_m with 95 % intervals. A parameter
        whose interval is wider than a factor of ten (a - b: wider than a itself) cannot be told.
    """
    time, mu = time_s - time_s[0], friction
    starts = {law: _best_of_starts(time, mu, drive, law, stiffness_per_m) for law in laws}
    near = _near_steps(time, mu, drive, math.exp(max(start[4] for start in starts.values())))
    return [_fit_near(*near, law, stiffness_per_m, start) for law, start in starts.items()]


def _fit_near(
    time: FloatArray, mu: FloatArray, drive: Drive, law: str, stiffness_per_m: float, first: FloatArray
) -> TraceLaw:
    """The fit of one law to one stretch."""
    best, jacobian, whitened = _fitted(time, mu, drive, law, stiffness_per_m, first)
    n, free = whitened.size, best.size
    variance = float(whitened @ whitened) / (n - free)
    # Jeffreys: a singular curvature means a parameter without effect, whose interval is then infinite
    values, vectors = np.linalg.eigh(jacobian.T @ jacobian)
    kept = np.maximum(values, 1e-14 * values.max())
    covariance = variance * (vectors / kept) @ vectors.T
    spread = np.sqrt(np.diag(covariance))
    factor = float(student.ppf(0.975, n - free))
    rows = [_linear("mu0", best[0], factor * spread[0], True)]
    told_a, told_b = spread[2] < abs(best[2]), spread[3] < max(abs(best[3]), abs(best[2]))
    rows += [_linear("a", best[2], factor * spread[2], told_a), _linear("b", best[3], factor * spread[3], told_b)]
    difference = math.sqrt(covariance[2, 2] + covariance[3, 3] - 2 * covariance[2, 3])
    rows.append(_linear("a_minus_b", best[2] - best[3], factor * difference, difference < abs(best[2])))
    names = [("Dc_m", "m")] + ([("stiffness_per_m", "1/m")] if free > 5 else [])
    for k, (name, unit) in enumerate(names, 4):
        reach = min(factor * spread[k], 50.0)
        value = math.exp(best[k])
        low, high = value * math.exp(-reach), value * math.exp(reach)
        rows.append(TraceLawParameter(name, value, low, high, unit, bool(spread[k] < _UNTOLD_SD)))
    return TraceLaw(law, tuple(rows), white_likelihood(whitened, time.size), n, "steps of speed")


def white_likelihood(whitened: FloatArray, samples: int) -> float:
    """Log likelihood of a record of so many samples by its whitened residuals, without what two laws share.

    Filters of two laws differ in length. If each counted its own samples, one sample more would weigh as much as many
    better ones.
    """
    return -0.5 * samples * math.log(float(whitened @ whitened) / whitened.size)


def _linear(name: str, value: float, half: float, told: bool) -> TraceLawParameter:
    return TraceLawParameter(name, float(value), float(value - half), float(value + half), "1", bool(told))


def _near_steps(
    time: FloatArray, mu: FloatArray, drive: Drive, slip_m: float
) -> tuple[FloatArray, FloatArray, Drive]:
    """The stretch about the steps: far from them a record tells of its drift, which need not be steady."""
    knots, speeds = drive.knots_s, drive.speeds_m_s
    start = max(knots[1] - _BEFORE * slip_m / speeds[0], 0.0) if len(knots) > 1 else 0.0
    end = knots[-1] + _AFTER * slip_m / speeds[-1]
    inside = (time >= start) & (time <= end)
    before = int((inside & (time < knots[1])).sum()) if len(knots) > 1 else _FEWEST
    if before < _FEWEST or int(inside.sum()) - before < _FEWEST:
        return time, mu, drive
    first = float(time[inside][0])
    moved = Drive(drive.label, (0.0, *(k - first for k in knots[1:])), speeds)
    return time[inside] - first, mu[inside], moved


def _model(time: FloatArray, drive: Drive, law: str, stiffness_per_m: float) -> Filter:
    """Friction at the times by mu0, drift, a, b, ln Dc and, where it is not known, ln stiffness; NaN if impossible.

    A machine that answers many times between two samples is rigid to the record, and a state that is renewed as often
    is always a steady one. Stiffer machines and shorter slips are followed as these: nothing in the record tells them
    apart, and the steps of the integration would be as short as they are.
    """
    knots, speeds = np.array(drive.knots_s), np.array(drive.speeds_m_s)
    v0 = float(speeds[0])
    between_samples_m = float(speeds[speeds > 0].min() * np.median(np.diff(time)))
    place = drive.position_m(time)
    place = (place - place.mean()) / np.ptp(place)
    out = np.empty((2, time.size))

    def friction(p: FloatArray) -> FloatArray:
        Dc = np.exp(p[4:5]).clip(between_samples_m / _UNRESOLVED)
        stiffness = min(stiffness_per_m if p.size < 6 else math.exp(p[5]), _UNRESOLVED * p[2] / between_samples_m)
        parameters = np.array([p[0], v0, p[2], stiffness])
        possible = p[2] > 0.0 and integrated(
            np.array([p[0], 0.0]), time, knots, speeds, parameters, p[3:4], Dc, law == "dieterich",
            _TOLERANCE, _MOST_STEPS * time.size, WEIGHTS, out,
        )  # fmt: skip
        return out[0] + p[1] * place if possible else np.full(time.size, np.nan)

    return friction


def _best_of_starts(
    time: FloatArray, mu: FloatArray, drive: Drive, law: str, stiffness_per_m: float
) -> FloatArray:
    """A fit under white noise of every tenth to hundredth sample, the best of several characteristic slips."""
    knots, speeds = np.array(drive.knots_s), np.array(drive.speeds_m_s)
    step = float(np.log(speeds[1] / speeds[0])) if speeds.size > 1 else 1.0
    before = mu[time < knots[1]] if knots.size > 1 else mu[:1]
    after = mu[time >= knots[-1]]
    change = float(np.median(after[after.size // 2 :]) - np.median(before)) / step
    slip = float(np.ptp(drive.position_m(time[time >= knots[-1]])))
    direct = max(abs(change), 0.02 * float(np.median(before)))
    thin = slice(None, None, max(1, time.size // 1500))
    found = []
    for share in _FROM_DIRECT:
        Dc = share * slip / 10.0
        start = np.array([float(np.median(before)), 0.0, direct, direct - change, math.log(Dc)])
        if math.isnan(stiffness_per_m):
            start = np.append(start, math.log(max(10.0 * abs(direct - change), direct) / Dc))
        fitted = _least(_model(time[thin], drive, law, stiffness_per_m), mu[thin], start, lambda r: r)
        found.append((float(fitted.cost), fitted.x))
    return min(found, key=lambda item: item[0])[1]


def _least(
    model: Filter, mu: FloatArray, start: FloatArray, white: Filter
) -> Any:
    """scipy's least squares of whitened residuals; parameters that are impossible are far away."""
    size = 100.0 * float(np.ptp(mu))

    def residuals(p: FloatArray) -> FloatArray:
        return white(np.nan_to_num(model(p) - mu, nan=size))

    direct = max(start[2], 1e-4)
    scale = np.concatenate([[1.0, 0.05, direct, max(abs(start[3]), direct)], np.ones(start.size - 4)])
    low = np.array([-np.inf, -np.inf, 1e-6, -np.inf, start[4] - 8.0, -np.inf])[: start.size]
    high = np.array([np.inf, np.inf, np.inf, np.inf, start[4] + 8.0, np.inf])[: start.size]
    if start.size > 5:
        low[5], high[5] = start[5] - _STIFFEST, start[5] + _STIFFEST
    return least_squares(residuals, start, x_scale=scale, bounds=(low, high), max_nfev=60, diff_step=1e-5)


def _fitted(
    time: FloatArray, mu: FloatArray, drive: Drive, law: str, stiffness_per_m: float, start: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Best values, and slopes and residuals whitened by the noise that the residuals show."""
    model = _model(time, drive, law, stiffness_per_m)
    white: Filter = lambda r: r  # noqa: E731
    fitted = None
    for _ in range(_ROUNDS):
        fitted = _least(model, mu, start, white)
        start = fitted.x
        white = whitening(mu - model(start))
    fitted = _least(model, mu, start, white)
    return fitted.x, np.asarray(fitted.jac), np.asarray(fitted.fun)


def whitening(residuals: FloatArray) -> Filter:
    """A filter that makes noise like these residuals white: autoregressive, of an order by the Akaike criterion."""
    r = residuals - residuals.mean()
    n = r.size
    covariances = np.array([float(r[: n - k] @ r[k:]) / n for k in range(_MOST_LAGS + 1)])
    best, score = np.zeros(0), n * math.log(covariances[0])
    for order in range(1, _MOST_LAGS + 1):
        weights = solve_toeplitz(covariances[:order], covariances[1 : order + 1])
        left = covariances[0] - float(weights @ covariances[1 : order + 1])
        if left > 0 and n * math.log(left) + 2 * order < score:
            best, score = weights, n * math.log(left) + 2 * order
    kernel = np.concatenate([[1.0], -best])
    return lambda x: np.convolve(x, kernel, mode="valid") if kernel.size > 1 else x


_STEADY = "steady sliding"
_SMALLEST_STEP = math.log(1.3)  # change of the logarithm of the speed from which on it is a step


def trace_laws_of(ingested: Ingested, law: str = "auto") -> tuple[TraceLaw, ...]:
    """Laws fitted to the records of a campaign that show stick-slip or steps of speed, in the order of its tests.

    Parameters
    ----------
    ingested
        The campaign with its traces.
    law
        "auto", or the name of one law. Under "auto" the ageing law is chosen over Coulomb's where it predicts slips
        left out clearly better (by twice the standard error, and by 20 to 1), the ageing law of Dieterich or the slip
        law of Ruina where its likelihood is 20 times that of the other; of a drive that goes to and fro, a law of
        ``DRIVEN_LAWS`` where none clearly predicts strokes left out better; of seven stretches at five speeds or more
        (of a record, or of the records of one sample at one load), a law of ``SPEED_LAWS`` in the same way; of five
        records of stick-slip with four times at rest, at one load of a sample, again Coulomb's law or that of ageing.
        Laws that are tied are all given.
    """
    tests = {test.test_id: test for test in ingested.campaign.tests}
    found: list[TraceLaw] = []
    stretches: dict[str, list[tuple[float, float]]] = {}
    rests: dict[str, list[tuple[float, float]]] = {}
    for name, pieces in groupby(ingested.traces.items(), key=lambda item: _record_of(item[0])):
        traces = list(pieces)
        test, pull = tests.get(traces[0][0]), ingested.pulls.get(traces[0][0])
        if test is None or pull is None or not test.normal_load_N > 0:
            continue
        fitted = [
            *_of_slips(traces, ingested, tests, law),
            *_of_steps(traces, ingested, tests, law),
            *_of_strokes(traces, law),
        ]
        found += [replace(one, test_id=one.test_id or name) for one in fitted]
        steady = [
            (phase.speed_m_s, phase.force_N / test.normal_load_N)
            for test_id, _ in traces for phase in ingested.pulls[test_id].phases if phase.name == _STEADY
        ] if all(test_id in ingested.pulls for test_id, _ in traces) else []  # fmt: skip
        by_speed = list(_of_means(fit_speeds, SPEED_LAWS, steady, name, law))
        found += by_speed
        speed = test.speed_m_s or ingested.campaign.pull_speed_m_s or math.nan
        where = f"{test.sample}, {test.normal_load_N:g} N"
        if not by_speed:
            whole = steady or [(speed, pull.sliding_N / test.normal_load_N)]
            stretches.setdefault(where, []).extend(whole)
        for slips in (_in_stick_slip(ingested.pulls.get(test_id)) for test_id, _ in traces):
            if len(slips) >= FEWEST_SLIPS:
                rests.setdefault(where, []).append(at_rest(slips, test.normal_load_N))
    for name, means in stretches.items():
        found += _of_means(fit_speeds, SPEED_LAWS, means, name, law)
    for name, means in rests.items():
        found += _of_means(fit_rests, SLIP_LAWS, means, name, law)
    return tuple(found)


def _record_of(test_id: str) -> str:
    """The record that a test was cut from: levels of one record are named ID#1/1, ID#1/2 and so on."""
    head, _, level = test_id.rpartition("/")
    return head if "#" in head and level.isdigit() else test_id


def _joined(traces: Sequence[Trace]) -> Trace:
    """The pieces of a record as one trace, in order of time."""
    if len(traces) == 1:
        return traces[0]
    order = sorted(traces, key=lambda trace: float(trace.time_s[0]))
    time = np.concatenate([trace.time_s for trace in order])
    keep = np.concatenate([[True], np.diff(time) > 0])
    place = [trace.displacement_m for trace in order if trace.displacement_m is not None]
    return replace(
        order[0], time_s=time[keep], force_N=np.concatenate([trace.force_N for trace in order])[keep],
        displacement_m=np.concatenate(place)[keep] if len(place) == len(order) else None, columns={},
    )  # fmt: skip


def _of_slips(
    traces: Iterable[tuple[str, Trace]], ingested: Ingested, tests: dict[str, Test], law: str
) -> Iterable[TraceLaw]:
    """Coulomb friction or its growth at rest, of every piece with stick-slip."""
    for test_id, trace in traces:
        pull, test = ingested.pulls.get(test_id), tests[test_id]
        speed = test.speed_m_s or ingested.campaign.pull_speed_m_s
        slips = _in_stick_slip(pull)
        if not slips or pull is None or speed is None or not speed > 0 or law not in ("auto", *SLIP_LAWS):
            continue
        inside = trace.time_s >= pull.window_s[0]
        record = trace.time_s[inside], np.abs(trace.force_N[inside] - pull.zero_N)
        wanted = SLIP_LAWS if law == "auto" else (law,)
        fitted = fit_slips(*record, wanted, test.normal_load_N, speed, slips)
        yield from unbeaten([replace(one, test_id=test_id) for one in fitted])


def _in_stick_slip(pull: Pull | None) -> list[Slip]:
    """The slips of a pull that sticks and slips, after its first loading."""
    if pull is None or pull.oscillation is None or pull.oscillation.regime != "stick-slip":
        return []
    return [slip for slip in pull.slips if slip.fail_s > max(pull.window_s[0], slip.start_s)]


def at_rest(slips: Sequence[Slip], normal_load_N: float) -> tuple[float, float]:
    """Geometric mean time stuck in s, and mean static friction over normal load, of slips."""
    stuck = np.log([slip.fail_s - slip.start_s for slip in slips])
    return math.exp(stuck.mean()), float(np.mean([slip.peak_N for slip in slips])) / normal_load_N


def unbeaten(fitted: Sequence[TraceLaw]) -> list[TraceLaw]:
    """Those that no other law clearly beats on what was left out of the fits."""
    return [law for law in fitted if not any(clearly_better(other, law) for other in fitted)]


def chosen_step_laws(fitted: Sequence[TraceLaw]) -> list[TraceLaw]:
    """Those whose likelihood is not 20 times below that of the best."""
    best = max(one.log_likelihood for one in fitted)
    return [one for one in fitted if one.log_likelihood > best - _LIKELIER]


def _of_steps(
    traces: Sequence[tuple[str, Trace]], ingested: Ingested, tests: dict[str, Test], law: str
) -> Iterable[TraceLaw]:
    """Rate and state of a record with steps of speed, whose pieces are joined."""
    if law not in ("auto", *STEP_LAWS) or len(set(_ways([trace for _, trace in traces]))) > 1:
        return
    test, pulls = tests[traces[0][0]], [ingested.pulls[name] for name, _ in traces if name in ingested.pulls]
    trace, pull = _joined([trace for _, trace in traces]), pulls[0]
    phases = sorted((phase for pull in pulls for phase in pull.phases), key=lambda phase: phase.start_s)
    steps = _drive_of(trace, phases)
    if steps is None:
        return
    start, end, drive = steps
    inside = (trace.time_s >= start) & (trace.time_s <= end)
    friction = np.abs(trace.force_N[inside] - pull.zero_N) / test.normal_load_N
    known = test.stiffness_N_per_m / test.normal_load_N if test.stiffness_N_per_m else math.nan
    wanted = STEP_LAWS if law == "auto" else (law,)
    fitted = fit_steps(trace.time_s[inside], friction, wanted, drive, known)
    yield from chosen_step_laws(fitted)


def _of_strokes(traces: Sequence[tuple[str, Trace]], law: str) -> Iterable[TraceLaw]:
    """A slider that is driven to and fro, of a record with strokes in both directions, which are joined."""
    wanted = [name for name in DRIVEN_LAWS if law in ("auto", name)]
    strokes = [trace for _, trace in traces]
    ways = _ways(strokes)
    if not wanted or len(strokes) < _FEWEST_STROKES or set(ways) != {-1.0, 1.0}:
        return
    # the force of a stroke is positive against its motion: as recorded, it has the sign of the way
    record = _joined([replace(trace, force_N=way * trace.force_N) for way, trace in zip(ways, strokes, strict=True)])
    if record.displacement_m is not None:
        fitted = [fit_driven(record.displacement_m, record.force_N, name) for name in wanted]
        yield from unbeaten([one for one in fitted if one is not None])


def _ways(traces: Sequence[Trace]) -> list[float]:
    """Direction of each piece by its displacement, 1 or -1; 0 where none was recorded."""
    places = [trace.displacement_m for trace in traces]
    return [0.0 if place is None else float(np.sign(place[-1] - place[0])) for place in places]


def _drive_of(trace: Trace, phases: Sequence[Phase]) -> tuple[float, float, Drive] | None:
    """From when to when a record slides through steps of speed, and its drive from then on; None without a step.

    A step is where the lines of displacement of both stretches meet, or the end of the first stretch.
    """
    steady = [p for p in phases if p.name == _STEADY and p.speed_m_s > 0]
    changes = [(a, b) for a, b in pairwise(steady) if abs(math.log(b.speed_m_s / a.speed_m_s)) > _SMALLEST_STEP]
    if not changes:
        return None
    chosen = [changes[0][0], *(b for a, b in changes)]
    start, end = chosen[0].start_s, chosen[-1].end_s
    knots, speeds = [0.0], [_line(trace, chosen[0])[0]]
    for a, b in pairwise(chosen):
        (v, x), (w, y) = _line(trace, a), _line(trace, b)
        meet = (x - y) / (w - v) if trace.displacement_m is not None and w != v else a.end_s
        knots.append(float(np.clip(meet, a.start_s, b.end_s)) - start)
        speeds.append(w)
    return start, end, speed_steps(knots, speeds)


def _line(trace: Trace, phase: Phase) -> tuple[float, float]:
    """Speed of a stretch and where its line of displacement meets time zero; 0 where no displacement was recorded."""
    inside = (trace.time_s >= phase.start_s) & (trace.time_s <= phase.end_s)
    if trace.displacement_m is None or inside.sum() < 3:
        return phase.speed_m_s, 0.0
    slope, at_zero = np.polyfit(trace.time_s[inside], trace.displacement_m[inside], 1)
    sign = math.copysign(1.0, slope)
    return float(abs(slope)), float(sign * at_zero)


_PLAIN = ("sliding_N", "stiffness_N_per_m", "zero_N")
_PLAY = ("sliding_N", "stiffness_N_per_m", "backlash_m", "zero_N")
_WAYS = ("forward_N", "backward_N", "stiffness_N_per_m", "backlash_m", "zero_N")
DRIVEN_LAWS: dict[str, tuple[str, ...]] = {
    "driven": _PLAIN,
    "driven_backlash": _PLAY,
    "driven_directions": _WAYS,
    "driven_springy_backlash": (*_WAYS, "gap_stiffness_N_per_m"),
}
"""Parameters of a slider that is driven to and fro, by law; each law has the one before it in it."""
_FEWEST_STROKES = 6
_TURN = 0.02  # share of the range of the displacement by which a drive has to go back before a stroke ends
_MOST_SAMPLES = 3000  # of a record in a fit: neighbours tell the same
_WAY_TO_SLIDE = (0.02, 0.06, 0.18)  # starts: way of the drive until the slider slides, as a share of its range


def driven_force(displacement_m: FloatArray, values: Mapping[str, float]) -> FloatArray:
    """Force on a slider without inertia that a drive moves to and fro through a spring with backlash.

    The slider rests until the force reaches ``forward_N`` or ``-backward_N`` (or ``sliding_N`` both ways), and then
    follows the drive at that force. Within the backlash the spring has the stiffness ``gap_stiffness_N_per_m``, beyond
    it ``stiffness_N_per_m``. It is the limit of :func:`tribo.simulate_slider` for a slow drive or a light slider.

    Parameters
    ----------
    displacement_m
        Displacement of the drive, shape (n,), in m; counted from the first sample, where the spring is slack.
    values : mapping
        Parameters by name: those of a law in ``tribo.tracelaws.DRIVEN_LAWS``. What is not named is 0; ``start_m`` is
        how far the slider is from the drive at the first sample.

    Returns
    -------
    array, shape (n,)
        Force in N, with the zero of the load cell ``zero_N`` added.

    Examples
    --------
    >>> from tribo.tracelaws import driven_force
    >>> values = {"sliding_N": 10.0, "stiffness_N_per_m": 1e4, "backlash_m": 1e-3}
    >>> driven_force([0.0, 0.0005, 0.001, 0.002, 0.0015, 0.0005, -0.0005], values).round(3).tolist()
    [0.0, 0.0, 5.0, 10.0, 5.0, 0.0, -5.0]
    """
    place = np.asarray(displacement_m, float)
    place = place - place[0]
    k, half, soft = (values.get(name, 0.0) for name in ("stiffness_N_per_m", "backlash_m", "gap_stiffness_N_per_m"))
    half *= 0.5

    def stretch(force_N: float) -> float:
        return force_N / soft if force_N < soft * half else half + (force_N - soft * half) / k

    ahead = stretch(values.get("forward_N", values.get("sliding_N", 0.0)))
    behind = stretch(values.get("backward_N", values.get("sliding_N", 0.0)))
    x, slider = values.get("start_m", 0.0), []
    for X in place.tolist():
        x = min(max(x, X - ahead), X + behind)
        slider.append(x)
    u = place - np.array(slider)
    inside = np.clip(u, -half, half)
    return np.asarray(k * (u - inside) + soft * inside + values.get("zero_N", 0.0))


def fit_driven(displacement_m: FloatArray, force_N: FloatArray, law: str = "driven_backlash") -> TraceLaw | None:
    """Friction, stiffness and backlash of a slider that is driven to and fro; None with fewer than six strokes.

    Least squares of the force. What the law lacks is alike from sample to sample, so the intervals take each stroke as
    one piece of evidence (Liang and Zeger, Biometrika 73 (1986) 13).

    Parameters
    ----------
    displacement_m, force_N
        The record, shape (n,), in m and N; both with the sign that they were recorded with.
    law : str
        Name in ``tribo.tracelaws.DRIVEN_LAWS``.

    Returns
    -------
    TraceLaw
        The parameters of :func:`driven_force` with 95 % intervals. ``log_likelihood`` and ``scores`` are those of
        strokes left out of the fit, each as one sample.

    Examples
    --------
    >>> import numpy as np
    >>> from tribo.tracelaws import driven_force, fit_driven
    >>> drive = 0.02 * np.sin(np.linspace(0.0, 25.0, 2000))
    >>> force = driven_force(drive, {"sliding_N": 10.0, "stiffness_N_per_m": 1e4, "backlash_m": 3e-3})
    >>> law = fit_driven(drive, force + 0.1 * np.random.default_rng(0).standard_normal(2000))
    >>> round(law["sliding_N"].value, 1), round(1e3 * law["backlash_m"].value, 1)
    (10.0, 3.0)
    """
    place, force = np.asarray(displacement_m, float), np.asarray(force_N, float)
    stroke = _strokes(place)
    if stroke[-1] + 1 < _FEWEST_STROKES:
        return None
    thin = slice(None, None, -(-place.size // _MOST_SAMPLES))
    place, force, stroke = place[thin], force[thin], stroke[thin]
    best, jacobian, residuals = _driven_fit(place, force, law, np.ones(place.size, bool))
    count = int(stroke[-1]) + 1
    size = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)  # newtons beside metres: else the small ones are lost
    jacobian = jacobian / size
    bread = np.linalg.pinv(jacobian.T @ jacobian)
    parts = np.array([jacobian[stroke == k].T @ residuals[stroke == k] for k in range(count)])
    covariance = bread @ (parts.T @ parts) @ bread * count / (count - 1)
    half = float(student.ppf(0.975, count - 1)) * np.sqrt(np.maximum(np.diag(covariance), 0.0)) / size
    scores = np.empty(count)
    fold = np.arange(count) * 5 // count
    for k in range(5):
        out = fold[stroke] == k
        left = _driven_residuals(place, force, law, _driven_fit(place, force, law, ~out, best)[0])
        for one in np.flatnonzero(fold == k):
            scores[one] = -0.5 * math.log(max(float(np.mean(left[stroke == one] ** 2)), 1e-300))
    rows = tuple(
        TraceLawParameter(
            name, float(v), float(v - h), float(v + h), "m" if name.endswith("_m") and "per" not in name else
            "N/m" if "per" in name else "N", bool(h < abs(v) or name in ("zero_N", "start_m")),
        )
        for name, v, h in zip((*DRIVEN_LAWS[law], "start_m"), best, half, strict=True)
    )  # fmt: skip
    return TraceLaw(law, rows, float(scores.sum()), count, "strokes", tuple(scores))


def _strokes(place: FloatArray) -> np.ndarray:
    """The number of the stroke that every sample is in: a stroke ends where the drive turns."""
    least = _TURN * float(np.ptp(place))
    ends, extreme, sense = [], 0, 0
    for i, X in enumerate(place.tolist()):
        ahead = (X - place[extreme]) * (sense or 1)
        if sense == 0 and abs(X - place[0]) > least:
            sense, extreme = (-1 if place[0] > X else 1), i
        elif ahead > 0 and sense:
            extreme = i
        elif -ahead > least and sense:
            ends.append(extreme)
            sense, extreme = -sense, i
    return np.searchsorted(np.array(ends), np.arange(place.size), side="left")


def _driven_residuals(place: FloatArray, force: FloatArray, law: str, p: FloatArray) -> FloatArray:
    return driven_force(place, dict(zip((*DRIVEN_LAWS[law], "start_m"), p.tolist(), strict=True))) - force


def _driven_fit(
    place: FloatArray, force: FloatArray, law: str, used: Any, start: FloatArray | None = None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Best values, the last of them where the slider starts, with slopes and residuals of the samples that are used."""
    low, high = (float(q) for q in np.quantile(force, [0.1, 0.9]))
    size, way = 0.5 * (high - low), float(np.ptp(place))
    names = (*DRIVEN_LAWS[law], "start_m")
    least = {"zero_N": low, "start_m": -way}
    most = {"zero_N": high, "start_m": way}
    bounds = np.array([[least.get(n, 0.0), most.get(n, math.inf)] for n in names]).T
    unit = {"backlash_m": 0.1 * way, "start_m": 0.1 * way, "stiffness_N_per_m": size / (0.1 * way)}
    unit["gap_stiffness_N_per_m"] = 0.1 * unit["stiffness_N_per_m"]
    scale = np.array([unit.get(n, size) for n in names])
    starts = [start] if start is not None else []
    for share in _WAY_TO_SLIDE if start is None else ():
        first = {"stiffness_N_per_m": size / (share * way), "backlash_m": 0.5 * share * way, "start_m": 0.0,
                 "gap_stiffness_N_per_m": 0.05 * size / (share * way), "zero_N": 0.5 * (low + high)}  # fmt: skip
        starts.append(np.array([first.get(n, size) for n in names]))
    found = [
        least_squares(
            lambda p: _driven_residuals(place, force, law, p)[used] / size, one, x_scale=scale,
            bounds=bounds, diff_step=1e-4, max_nfev=40,
        )
        for one in starts
    ]  # fmt: skip
    best = min(found, key=lambda fitted: float(fitted.cost))
    return np.asarray(best.x), np.asarray(best.jac), np.asarray(best.fun)


_PARAMETERS = {
    "constant": (("mu_d", "1"),),
    "viscous": (("mu_d", "1"), ("viscous_s_per_m", "s/m")),
    "logarithmic": (("mu_at_1_m_s", "1"), ("per_e_fold", "1")),
    "stribeck": (("mu_d", "1"), ("mu_s", "1"), ("viscous_s_per_m", "s/m"), ("v_s_m_s", "m/s")),
    "coulomb": (("mu_s", "1"),),
    "ageing": (("mu_s_after_1_s", "1"), ("b", "1")),
}
SPEED_LAWS = ("constant", "viscous", "logarithmic", "stribeck")
_FEWEST_SPEEDS, _FEWEST_STRETCHES = 5, 7
_FEWEST_RESTS, _FEWEST_RECORDS = 4, 5  # times at rest that differ, and records of stick-slip
_SAME = 0.05  # of the logarithm: speeds or times closer than this are one, left out together
_PLACES, _REACH = 160, (0.1, 3.0)  # values of v_s tried, from a tenth of the lowest speed to thrice the highest
_DRAWS = 4000  # of the parameters, for their intervals


def fit_speeds(speed_m_s: FloatArray, friction: FloatArray, law: str = "stribeck") -> TraceLaw | None:
    """Friction over speed from stretches of steady sliding, one value a stretch; None with too few of them.

    "constant" is mu_d, "viscous" mu_d + e v, "logarithmic" a line in ln v, and "stribeck" mu_d + (mu_s - mu_d)
    exp(-v / v_s) + e v, the law of the slider with exponent 1. Least squares over stretches, all alike, for the scatter
    from stretch to stretch is larger than what one of them tells of its mean. For a given v_s the law is linear; v_s
    and its interval follow from the likelihood of each, and the others' intervals are averaged over it.

    Parameters
    ----------
    speed_m_s, friction
        Speed and friction force over normal load of every stretch, shape (n,). At least seven stretches at five speeds.
    law : str
        Name in ``tribo.tracelaws.SPEED_LAWS``.

    Returns
    -------
    TraceLaw
        With 95 % intervals; ``viscous_s_per_m`` is the viscous friction e over the normal load. ``scores`` are log
        densities of the stretches of each speed by a fit without that speed. Where v_s is not known within a factor
        of ten, or static minus sliding friction may be zero, the law cannot be told.

    Examples
    --------
    >>> import numpy as np
    >>> from tribo.tracelaws import fit_speeds
    >>> v = np.geomspace(1e-5, 1e-2, 12)
    >>> mu = 0.3 + 0.1 * np.exp(-v / 2e-4) + 2.0 * v + 1e-3 * np.random.default_rng(0).standard_normal(12)
    >>> law = fit_speeds(v, mu)
    >>> round(law["mu_s"].value, 2), round(1e4 * law["v_s_m_s"].value, 1)
    (0.4, 2.0)
    """
    v, mu = np.asarray(speed_m_s, float), np.asarray(friction, float)
    group = _alike(v)
    enough = v.size >= _FEWEST_STRETCHES and group.max() + 1 >= _FEWEST_SPEEDS
    return _fit_over(v, mu, group, law, "speeds") if enough else None


def fit_rests(hold_s: FloatArray, friction: FloatArray, law: str = "ageing") -> TraceLaw | None:
    """Static friction over the time at rest from records of stick-slip, one value a record; None with too few of them.

    "coulomb" is mu_s, "ageing" mu_s + b ln(t / 1 s). A stronger contact is stuck for longer, so that the slips of one
    record seem to show growth; means over all slips of a record do not.

    Parameters
    ----------
    hold_s, friction
        Geometric mean time stuck in s, and mean static friction force over normal load, of every record, shape (n,). At
        least five records with four times that differ.
    law : "coulomb" or "ageing"
        The law.

    Returns
    -------
    TraceLaw
        With 95 % intervals; ``scores`` are log densities of the records of each time at rest by a fit without it.

    Examples
    --------
    >>> import numpy as np
    >>> from tribo.tracelaws import fit_rests
    >>> t = np.array([0.1, 0.3, 1.0, 3.0, 10.0])
    >>> law = fit_rests(t, 0.4 + 0.01 * np.log(t) + 1e-4 * np.array([1, -1, 0, 1, -1]))
    >>> round(law["b"].value, 3), law["b"].told
    (0.01, True)
    """
    t, mu = np.asarray(hold_s, float), np.asarray(friction, float)
    group = _alike(t)
    enough = t.size >= _FEWEST_RECORDS and group.max() + 1 >= _FEWEST_RESTS
    return _fit_over(t, mu, group, law, "rests") if enough else None


def _alike(values: FloatArray) -> np.ndarray:
    """The number of the group of nearly equal values that each is in, from the lowest on."""
    order = np.argsort(values)
    group = np.zeros(values.size, int)
    group[order[1:]] = np.cumsum(np.diff(np.log(values[order])) > _SAME)
    return group


def _fit_over(v: FloatArray, mu: FloatArray, group: np.ndarray, law: str, evidence: str) -> TraceLaw:
    """Least squares of friction over speed or time at rest, with groups left out for the scores."""
    made, weights, values = _over(v, mu, law)
    best = int(np.argmax(weights))
    rng = np.random.default_rng(0)
    free = v.size - made[0][0].size - (law == "stribeck")
    chosen = rng.choice(values.size, _DRAWS, p=weights)
    heavy = np.sqrt(free / rng.chisquare(free, _DRAWS))[:, None]
    centres = np.array([made[k][0] for k in chosen])
    linear = centres + heavy * np.array([made[k][2] @ rng.standard_normal(centres.shape[1]) for k in chosen])
    centre = made[best][0].copy()
    if law == "stribeck":
        told = bool(np.quantile(linear[:, 1], 0.025) > 0.0 or np.quantile(linear[:, 1], 0.975) < 0.0)
        linear[:, 1] += linear[:, 0]
        centre = np.append(centre, values[best])
        centre[1] += centre[0]
        linear = np.column_stack([linear, values[chosen]])
    low, high = np.quantile(linear, [0.025, 0.975], axis=0)
    rows = []
    for k, (name, unit) in enumerate(_PARAMETERS[law]):
        known = told and high[-1] < 10.0 * low[-1] if law == "stribeck" else high[k] - low[k] < 2.0 * abs(centre[k])
        rows.append(TraceLawParameter(name, float(centre[k]), float(low[k]), float(high[k]), unit, bool(known)))
    scores = np.empty(v.size)
    for one in range(int(group.max()) + 1):
        out = group == one
        parts, likely, places = _over(v[~out], mu[~out], law)
        k = int(np.argmax(likely))
        beta, scale, root = parts[k]
        X = _columns(v[out], law, places[k])
        freedom = int((~out).sum()) - beta.size - (law == "stribeck")
        spread = np.sqrt(scale**2 + ((X @ root) ** 2).sum(axis=1))
        scores[out] = student.logpdf((mu[out] - X @ beta) / spread, freedom) - np.log(spread)
    return TraceLaw(law, tuple(rows), float(scores.sum()), v.size, evidence, tuple(scores))


def _columns(v: FloatArray, law: str, v_s: float) -> FloatArray:
    one = np.ones_like(v)
    if law == "stribeck":
        return np.column_stack([one, np.exp(-v / v_s), v])
    line = {"viscous": v, "logarithmic": np.log(v), "ageing": np.log(v)}
    return np.column_stack([one, line[law]] if law in line else [one])


def _over(
    v: FloatArray, mu: FloatArray, law: str
) -> tuple[list[tuple[FloatArray, float, FloatArray]], FloatArray, FloatArray]:
    """Linear fits (values, scatter, root of their covariance) for every v_s, the weight of each, and the v_s."""
    stribeck = law == "stribeck"
    places = np.geomspace(_REACH[0] * v.min(), _REACH[1] * v.max(), _PLACES) if stribeck else np.ones(1)
    made, squares = [], np.empty(places.size)
    for k, v_s in enumerate(places):
        X = _columns(v, law, v_s)
        size = np.maximum(np.linalg.norm(X, axis=0), 1e-300)
        values, vectors = np.linalg.eigh((X / size).T @ (X / size))
        root = vectors / np.sqrt(np.maximum(values, 1e-12)) / size[:, None]
        beta = root @ root.T @ X.T @ mu
        squares[k] = max(float(np.sum((mu - X @ beta) ** 2)), 1e-300)
        scale = math.sqrt(squares[k] / (v.size - X.shape[1] - stribeck))
        made.append((beta, scale, scale * root))
    weights = (squares / squares.min()) ** (-0.5 * (v.size - made[0][0].size))
    return made, weights / weights.sum(), places


def _of_means(
    fit: Callable[[FloatArray, FloatArray, str], TraceLaw | None], laws: Sequence[str],
    means: Sequence[tuple[float, float]], name: str, law: str,
) -> Iterable[TraceLaw]:  # fmt: skip
    """Laws of friction over speed or time at rest, means of a record or of the records of one sample and load."""
    at, friction = np.array([pair for pair in means if pair[0] > 0 and math.isfinite(pair[1])]).reshape(-1, 2).T
    fitted = [fit(at, friction, one) for one in laws if law in ("auto", one)]
    yield from unbeaten([replace(one, test_id=name) for one in fitted if one is not None])
