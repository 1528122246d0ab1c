"""Rate and state from steps of speed: maximum likelihood on the trace, under correlated noise."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.linalg import solve_toeplitz
from scipy.optimize import least_squares
from scipy.stats import t as student

from tribo.records import FloatArray, TraceLaw, TraceLawParameter
from tribo.slider.motion import Drive
from tribo.slider.rate_and_state import WEIGHTS, integrated

Filter = Callable[[FloatArray], FloatArray]
LAWS = ("dieterich", "ruina")
_TOLERANCE = 1e-9  # of the integration; noise of records is a thousand times larger at the least
_MOST_LAGS = 8  # order of the autoregressive noise, chosen up to here by the Akaike criterion
_ROUNDS = 3  # of fit, noise, fit
_AFTER, _BEFORE = 30.0, 15.0  # characteristic slips that are kept of a record after the last and before the first step
_FEWEST = 40  # samples of a stretch
_FROM_DIRECT = (0.05, 0.2, 0.8)  # starts: characteristic slip as a share of the slip after the step, in steps of four
_STIFFEST = 5.0  # logarithm of the largest stiffness over its start: far beyond, a machine is rigid and steps tiny
_UNTOLD_SD = math.log(10.0) / (2 * 1.96)  # of a logarithm: the 95 % interval is a factor of ten wide


def fit_steps(
    time_s: FloatArray, friction: FloatArray, drive: Drive, law: str, stiffness_per_m: float = math.nan
) -> TraceLaw:
    """Rate and state, and the machine, from a record of friction under steps of speed.

    The slider has no inertia. The model is friction of the law under the drive, with a steady drift per slip. Noise is
    autoregressive; its order and coefficients follow from the residuals, and the fit is repeated on whitened residuals.
    Intervals are those of the curvature of the likelihood (Laplace) in a, b and the logarithms of Dc and stiffness.

    Parameters
    ----------
    time_s, friction
        Evenly sampled record, shape (n,); friction is force over normal load.
    drive
        Speeds of the drive; time counts from the first sample.
    law : "dieterich" or "ruina"
        Ageing or slip law, with one state.
    stiffness_per_m
        Stiffness of the machine over the normal load in 1/m, where it is known; else it is fitted.

    Returns
    -------
    TraceLaw
        mu0 at the first speed, a, b, a - b, Dc_m and stiffness_per_m with 95 % intervals. A parameter whose interval is
        wider than a factor of ten (a - b: wider than a itself) cannot be told.
    """
    return fit_laws(time_s, friction, drive, (law,), stiffness_per_m)[0]


def fit_laws(
    time_s: FloatArray, friction: FloatArray, drive: Drive, laws: Sequence[str], stiffness_per_m: float = math.nan
) -> list[TraceLaw]:
    """As :func:`fit_steps` for several laws, on one stretch of the record: their likelihoods can be compared."""
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
    log_likelihood = -0.5 * n * math.log(float(whitened @ whitened) / n)
    return TraceLaw(law, tuple(rows), log_likelihood, n, "steps of speed")


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
    """Friction at the times by mu0, drift, a, b, ln Dc and, where it is not known, ln stiffness; NaN if impossible."""
    knots, speeds = np.array(drive.knots_s), np.array(drive.speeds_m_s)
    v0 = float(speeds[0])
    place = drive.position_m(time)
    place = (place - place.mean()) / np.ptp(place)
    out = np.empty((2, time.size))

    def friction(p: FloatArray) -> FloatArray:
        stiffness = stiffness_per_m if p.size < 6 else math.exp(p[5])
        parameters = np.array([p[0], v0, p[2], stiffness])
        possible = p[2] > 0.0 and integrated(
            np.array([p[0], 0.0]), time, knots, speeds, parameters, p[3:4], np.exp(p[4:5]), law == "dieterich",
            _TOLERANCE, WEIGHTS, out,
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
