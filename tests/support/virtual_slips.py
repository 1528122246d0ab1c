"""Virtual records of known laws for the exam of laws read from traces; nothing of tribo.slider or tribo.tracelaws.

Slips: a fixed-step Runge-Kutta integration of a slider that is pulled through a spring and a damper, whose static
friction is drawn anew for every slip. Strokes: relaxation in small steps. Steps of speed: scipy's odeint on friction
and the state variable theta. A ladder of speeds: stretches of steady sliding. Noise is autoregressive of
order one on top of white noise.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import odeint


def coloured(rng: np.random.Generator, n: int, size: float, memory: float = 0.6) -> np.ndarray:
    """Noise of standard deviation ``size``: half of its variance white, half with a memory from sample to sample."""
    from scipy.signal import lfilter

    slow = lfilter([math.sqrt(1 - memory**2)], [1.0, -memory], rng.standard_normal(n + 200))[200:]
    return size * math.sqrt(0.5) * (slow + rng.standard_normal(n))


def slips(
    rng: np.random.Generator, *, mass_kg: float, stiffness: float, damping: float, load_N: float, speed_m_s: float,
    mu_s: float, mu_d: float, b: float = 0.0, t0_s: float = 1e-3, scatter: float = 0.0, duration_s: float,
    rate_Hz: float, noise_N: float = 0.0,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Time and force; static friction is mu_s + b ln(1 + t / t0) after a time t at rest, with normal scatter."""
    natural = math.sqrt(stiffness / mass_kg)
    dt = min(0.005 / natural, 0.2 / rate_Hz)
    per_sample = math.ceil(1.0 / rate_Hz / dt)
    dt = 1.0 / rate_Hz / per_sample
    n = int(duration_s * rate_Hz)
    force = np.empty(n)
    x, v, t, stuck, rested = 0.0, 0.0, 0.0, True, 0.0
    level = (mu_s + scatter * rng.standard_normal()) * load_N
    sliding = mu_d * load_N

    def pull(t: float, x: float, v: float) -> float:
        return stiffness * (speed_m_s * t - x) + damping * (speed_m_s - v)

    for i in range(n):
        force[i] = pull(t, x, v)
        if stuck:  # the force is linear in time: the step in which the threshold is passed is searched alone
            for _ in range(per_sample):
                t += dt
                rested += dt
                if pull(t, x, 0.0) > level + b * load_N * math.log1p(rested / t0_s):
                    stuck = False
                    break
            else:
                continue
            left = per_sample - _ - 1
        else:
            left = per_sample
        for step in range(left):
            a1 = (pull(t, x, v) - sliding) / mass_kg
            a2 = (pull(t + dt / 2, x + dt / 2 * v, v + dt / 2 * a1) - sliding) / mass_kg
            a3 = (pull(t + dt / 2, x + dt / 2 * v + dt**2 / 4 * a1, v + dt / 2 * a2) - sliding) / mass_kg
            a4 = (pull(t + dt, x + dt * v + dt**2 / 2 * a2, v + dt * a3) - sliding) / mass_kg
            x += dt * v + dt**2 / 6 * (a1 + a2 + a3)
            v += dt / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
            t += dt
            if v < 0.0:
                v, stuck, rested = 0.0, True, 0.0
                level = (mu_s + scatter * rng.standard_normal()) * load_N
                t += dt * (left - step - 1)
                rested += dt * (left - step - 1)
                break
    return np.arange(n) / rate_Hz, force + coloured(rng, n, noise_N)


def velocity_step(
    rng: np.random.Generator, *, ageing: bool, a: float, b: float, Dc_m: float, stiffness_per_m: float, mu0: float,
    speeds_m_s: tuple[float, float], step_s: float, duration_s: float, rate_Hz: float, noise: float, drift_per_m: float,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Time and friction coefficient through one step of speed."""
    v1, v2 = speeds_m_s

    def rates(y: list[float], t: float, pace: float) -> list[float]:
        mu, theta = y
        v = v1 * math.exp((mu - mu0 - b * math.log(v1 * theta / Dc_m)) / a)
        share = v * theta / Dc_m
        return [stiffness_per_m * (pace - v), 1.0 - share if ageing else -share * math.log(share)]

    time = np.arange(int(duration_s * rate_Hz)) / rate_Hz
    after = time[time >= step_s]
    solved = odeint(rates, [mu0, Dc_m / v1], np.concatenate([[step_s], after]), args=(v2,), rtol=1e-10, atol=1e-10)
    friction = np.concatenate([np.full((time < step_s).sum(), mu0), solved[1:, 0]])
    place = np.where(time < step_s, v1 * time, v1 * step_s + v2 * (time - step_s))
    return time, friction + drift_per_m * place + coloured(rng, time.size, noise)


def strokes(
    rng: np.random.Generator, *, forward_N: float, backward_N: float, stiffness: float, backlash_m: float,
    amplitude_m: float, frequency_Hz: float, cycles: int, rate_Hz: float, noise_N: float,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Displacement and force of a slider without mass behind a gap, under a sinusoid that grows over its first cycle.

    In small steps of time, half of what the spring carries beyond friction relaxes in each.
    """
    steps = 40
    n = round(cycles / frequency_Hz * rate_Hz)
    dt = 1.0 / rate_Hz / steps
    time = np.arange(n * steps) * dt
    drive = amplitude_m * np.minimum(time * frequency_Hz, 1.0) * np.sin(2 * math.pi * frequency_Hz * time)
    force, x, half = np.empty(n * steps), 0.0, 0.5 * backlash_m
    for i, X in enumerate(drive.tolist()):
        u = X - x
        pull = stiffness * (u - half if u > half else u + half if u < -half else 0.0)
        force[i] = pull
        limit = forward_N if pull > 0 else backward_N
        if abs(pull) > limit:
            x += math.copysign(0.5 * (abs(pull) - limit) / stiffness, pull)
    return drive[::steps], force[::steps] + coloured(rng, n, noise_N)


def ladder(
    rng: np.random.Generator, speeds_m_s: np.ndarray, friction: np.ndarray, *, scatter: float, noise: float,
    stretch_s: float = 20.0, rate_Hz: float = 10.0,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Time and friction of a record that goes through speeds one after another, each friction met after a second.

    Every stretch lies off its friction by a normal ``scatter`` of its own.
    """
    n = round(stretch_s * rate_Hz)
    levels = friction + scatter * rng.standard_normal(len(speeds_m_s))
    before = np.concatenate([levels[:1], levels[:-1]])
    fade = np.exp(-np.arange(n) / rate_Hz)
    mu = (levels[:, None] + (before - levels)[:, None] * fade).ravel()
    return np.arange(mu.size) / rate_Hz, mu + coloured(rng, mu.size, noise)
