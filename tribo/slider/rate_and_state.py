"""Sliding under rate-and-state friction: without inertia by a compiled Runge-Kutta method, else by scipy's Radau.

The variables are q = ln(v / v0) and phi_i = ln(v0 theta_i / Dc_i). Without inertia the spring carries friction,
k (X - x) = N mu, and q follows from mu and phi: this is what rock friction experiments solve. The run begins in steady
sliding at the first speed of the drive.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from tribo.errors import Problem, SimulationError
from tribo.records import FloatArray
from tribo.slider.contact_laws import StateContact, steady_friction
from tribo.slider.motion import Drive, SliderMachine
from tribo.springblock.engines.jit import compiled

TOLERANCE = 1e-11  # relative and absolute, of friction coefficient and logarithms
_MOST_STEPS = 200_000_000
_MOST_LOST = 60  # steps refused in a row after which the motion counts as impossible to follow


def friction_path(
    machine: SliderMachine, contact: StateContact, drive: Drive, times_s: FloatArray, by_scipy: bool = False
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Friction coefficient, speed and position of the slider, shape (n,), and states theta in s, shape (states, n).

    Raises
    ------
    SimulationError
        A drive that stands still at the start, a sinusoid on it, damping or a gap without mass, or no convergence.
    """
    v0 = float(drive.speed_m_s(0.0))
    if not v0 > 0.0:
        what = "a rate-and-state slider begins in steady sliding: the first speed of the drive must be positive"
        raise SimulationError(Problem("wrong_drive", what, column="drive", found=f"{v0:g} m/s"))
    b, Dc = np.array(contact.b), np.array(contact.Dc_m)
    q0 = np.log(v0 / contact.v0_m_s)
    mu0 = float(steady_friction(contact, v0))
    start = np.array([mu0, *(-q0 for _ in b)])
    if machine.mass_kg > 0.0:
        return _with_inertia(machine, contact, drive, times_s, start)
    if by_scipy:
        solved = _by_scipy(machine, contact, drive, times_s, start)
    else:
        solved = np.empty((1 + b.size, times_s.size))
        speeds, knots = np.array(drive.speeds_m_s), np.array(drive.knots_s)
        stiffness = machine.stiffness_N_per_m / contact.normal_load_N
        parameters = np.array([contact.mu0, contact.v0_m_s, contact.a, stiffness])
        rules = (contact.ageing, TOLERANCE, _MOST_STEPS, WEIGHTS)
        if not integrated(start, times_s, knots, speeds, parameters, b, Dc, *rules, solved):
            what = "without inertia the slider becomes infinitely fast: the machine is too soft for steady sliding"
            raise SimulationError(Problem("not_integrated", what, column="mass_kg", found="0", allowed="above 0"))
    mu, phi = solved[0], solved[1:]
    speed = contact.v0_m_s * np.exp((mu - contact.mu0 - b @ phi) / contact.a)
    position = drive.position_m(times_s) - mu * contact.normal_load_N / machine.stiffness_N_per_m
    return mu, speed, position, np.exp(phi) * Dc[:, None] / contact.v0_m_s


WEIGHTS = np.zeros((8, 7))
"""The pair of Dormand and Prince (J. Comput. Appl. Math. 6 (1980) 19) of orders 5 and 4: the weights of its seven
stages, the last that of the result, and in the eighth row those of the error."""
WEIGHTS[1, :1] = [1 / 5]
WEIGHTS[2, :2] = [3 / 40, 9 / 40]
WEIGHTS[3, :3] = [44 / 45, -56 / 15, 32 / 9]
WEIGHTS[4, :4] = [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729]
WEIGHTS[5, :5] = [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656]
WEIGHTS[6, :6] = [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84]
WEIGHTS[7] = [71 / 57600, 0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40]


@compiled
def integrated(
    start: FloatArray, times_s: FloatArray, knots_s: FloatArray, speeds_m_s: FloatArray, parameters: FloatArray,
    b: FloatArray, Dc_m: FloatArray, ageing: bool, tolerance: float, most_steps: int, weights: FloatArray,
    out: FloatArray,
) -> bool:  # fmt: skip
    """Friction coefficient and ln(v0 theta / Dc) at the given times, without inertia; False if it cannot be followed.

    Steps end at every time that is asked for and at every knot of the drive. ``parameters`` are mu0, v0, a and
    stiffness over load. The motion cannot be followed where a step vanishes or more than ``most_steps`` are needed.
    """
    n = start.size
    y, trial = start.copy(), np.empty(n)
    k = np.empty((7, n))
    mu0, v0, a, stiffness = parameters[0], parameters[1], parameters[2], parameters[3]
    t, piece, place, step, steps, lost = 0.0, 0, 0, 0.0, 0, 0
    fresh = True
    while place < times_s.size:
        if times_s[place] <= t:
            for i in range(n):
                out[i, place] = y[i]
            place += 1
            continue
        while piece + 1 < knots_s.size and knots_s[piece + 1] <= t:
            piece += 1
            fresh = True
        goal = times_s[place]
        if piece + 1 < knots_s.size and knots_s[piece + 1] < goal:
            goal = knots_s[piece + 1]
        speed = speeds_m_s[piece]
        if fresh:
            step, fresh = min(goal - t, 1e-3 * Dc_m[0] / max(abs(speed), 1e-3 * v0)), False
        h = min(step, goal - t)
        whole = h == goal - t
        for stage in range(7):
            for i in range(n):
                trial[i] = y[i]
                for earlier in range(stage):
                    trial[i] += h * weights[stage, earlier] * k[earlier, i]
            q = trial[0] - mu0
            for i in range(1, n):
                q -= b[i - 1] * trial[i]
            q /= a
            pace = np.exp(q)
            k[stage, 0] = stiffness * (speed - v0 * pace)
            for i in range(1, n):
                if ageing:
                    k[stage, i] = v0 / Dc_m[i - 1] * (np.exp(-trial[i]) - pace)
                else:
                    k[stage, i] = -v0 / Dc_m[i - 1] * pace * (q + trial[i])
        error = 0.0
        for i in range(n):
            local = 0.0
            for stage in range(7):
                local += h * weights[7, stage] * k[stage, i]
            size = tolerance * (1.0 if i else 0.1)  # friction itself is of the order of a tenth
            share = abs(local) / size
            if not share <= error:  # so that NaN is kept: max() would drop it
                error = share
        if not error <= 1.0:
            lost += 1
            steps += 1
            step = h * (0.5 if not np.isfinite(error) else max(0.2, 0.9 * error**-0.2))
            if lost > _MOST_LOST or steps > most_steps or t + step == t:
                return False
            continue
        lost = 0
        steps += 1
        for i in range(n):
            y[i] = trial[i]
        t = goal if whole else t + h
        grown = h * min(5.0, 0.9 * max(error, 1e-10) ** -0.2)
        step = max(step, grown) if whole else grown
    return True


def _rates(contact: StateContact) -> tuple[Any, Any, Any]:
    """The rates of the states from q and phi, and the arrays b and Dc; what both methods of scipy share."""
    b, Dc, v0 = np.array(contact.b), np.array(contact.Dc_m), contact.v0_m_s

    def states(q: Any, phi: Any) -> Any:
        if contact.ageing:
            return v0 / Dc * (np.exp(-phi) - np.exp(q))
        return -v0 / Dc * np.exp(q) * (q + phi)

    return states, b, Dc


def _by_scipy(
    machine: SliderMachine, contact: StateContact, drive: Drive, times_s: FloatArray, start: FloatArray
) -> FloatArray:
    """The readable twin of :func:`integrated`, without inertia, piece by piece of the drive."""
    states, b, _ = _rates(contact)
    stiffness = machine.stiffness_N_per_m / contact.normal_load_N

    def rates(t: float, y: FloatArray, speed: float) -> FloatArray:
        q = (y[0] - contact.mu0 - b @ y[1:]) / contact.a
        return np.concatenate([[stiffness * (speed - contact.v0_m_s * np.exp(q))], states(q, y[1:])])

    options = {"method": "LSODA", "rtol": TOLERANCE, "atol": TOLERANCE}
    return _piecewise(rates, drive, times_s, start, options)


def _with_inertia(
    machine: SliderMachine, contact: StateContact, drive: Drive, times_s: FloatArray, start: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """m v' = k (X - x) + c (V - v) - N mu, in the variables stretch X - x, q and phi; stiff wherever v is small."""
    states, b, Dc = _rates(contact)
    N, v0, m, c = contact.normal_load_N, contact.v0_m_s, machine.mass_kg, machine.damping_N_s_per_m
    half = 0.5 * machine.backlash_m

    def rates(t: float, y: FloatArray, speed: float) -> FloatArray:
        v = v0 * np.exp(y[1])
        mu = contact.mu0 + contact.a * y[1] + b @ y[2:]
        force = machine.spring_N(y[0]) + c * (speed - v) - N * mu
        return np.concatenate([[speed - v, force / (m * v)], states(y[1], y[2:])])

    def slopes(t: float, y: FloatArray, speed: float) -> FloatArray:
        v, phi = v0 * np.exp(y[1]), y[2:]
        found = np.zeros((y.size, y.size))
        found[0, 1] = -v
        found[1, 0] = machine.stiffness_N_per_m * (abs(y[0]) > half) / (m * v)
        found[1, 1] = -rates(t, y, speed)[1] - (c + N * contact.a / v) / m
        found[1, 2:] = -N * b / (m * v)
        pace = v0 / Dc * np.exp(y[1])
        found[2:, 1] = -pace if contact.ageing else -pace * (1.0 + y[1] + phi)
        found[2:, 2:] = np.diag(-v0 / Dc * np.exp(-phi) if contact.ageing else -pace)
        return found

    stretch = start[0] * N / machine.stiffness_N_per_m + half
    first = np.array([stretch, -start[1], *start[1:]])
    atol = np.array([1e-10 * stretch, *np.full(first.size - 1, 1e-9)])
    y = _piecewise(rates, drive, times_s, first, {"method": "Radau", "jac": slopes, "rtol": 1e-9, "atol": atol})
    mu = contact.mu0 + contact.a * y[1] + b @ y[2:]
    return mu, v0 * np.exp(y[1]), drive.position_m(times_s) - y[0], np.exp(y[2:]) * Dc[:, None] / v0


def _piecewise(
    rates: Any, drive: Drive, times_s: FloatArray, start: FloatArray, options: dict[str, Any]
) -> FloatArray:
    """scipy's integrator from knot to knot of the drive: no step of it crosses a jump of the speed."""
    from scipy.integrate import solve_ivp

    out = np.empty((start.size, times_s.size))
    ends = np.append(np.array(drive.knots_s[1:]), np.inf)
    state, done = start, 0
    for begin, stop, speed in zip(drive.knots_s, ends, drive.speeds_m_s, strict=True):
        last = min(float(stop), float(times_s[-1]))
        filled = int(np.searchsorted(times_s, last, side="right" if last < stop else "left"))
        asked = times_s[done:filled]
        asked = asked if asked.size and asked[-1] == last else np.append(asked, last)
        solved = solve_ivp(rates, (begin, last), state, t_eval=asked, args=(speed,), **options)
        if not solved.success:
            raise SimulationError(Problem("not_integrated", f"the motion cannot be integrated: {solved.message}"))
        out[:, done:filled], state, done = solved.y[:, : filled - done], solved.y[:, -1], filled
        if last < stop:
            break
    return out
