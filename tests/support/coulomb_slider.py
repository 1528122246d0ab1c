"""Records of a slider on a spring with Coulomb friction, in closed form, and what there is to read from them; pulls
from rest whose rise, peak and decay are known.

A slider of mass m sticks up to the static friction F_s and slides against F_d. With w = sqrt(k/m), D = F_s - F_d and a
drive at v the spring force while it slides is F_d + D cos(w t) + (k v / w) sin(w t): from its highest to its lowest
value it takes half a free period and falls by 2 sqrt(D^2 + (k v / w)^2). A creep before the slip is added at will.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True)
class Slider:
    """A rig with its noise: forces in N, ``noise`` and ``impulse`` as shares of the mean force."""

    stiffness_N_per_m: float = 168.0
    speed_m_s: float = 42e-6
    mass_kg: float = 0.0307
    sliding_N: float = 0.08
    excess_N: float = 0.012  # mean of static over sliding friction
    scatter: float = 0.15  # standard deviation of it from slip to slip, as a share
    creep_m: float = 0.0  # mean creep before a slip
    rate_Hz: float = 2000.0
    duration_s: float = 80.0
    noise: float = 0.01
    correlation: float = 0.6  # of neighbouring samples
    impulse: float = 0.05
    impulses: float = 0.01  # share of the samples


def record(rig: Slider, seed: int) -> tuple[np.ndarray, np.ndarray, dict[str, np.ndarray]]:
    """Time, force and, by name, what is true of each slip within the record."""
    rng = np.random.default_rng(seed)
    k, v = rig.stiffness_N_per_m, rig.speed_m_s
    w, load = math.sqrt(k / rig.mass_kg), k * v
    time = np.arange(0.0, rig.duration_s, 1.0 / rig.rate_Hz)
    force = np.empty(time.size)
    truth: dict[str, list[float]] = {name: [] for name in NAMES}
    start, low, end_of_last, last_peak = 0.0, rig.sliding_N - rig.excess_N * rng.uniform(0.2, 1.0), math.nan, math.nan
    while start < rig.duration_s:
        excess = rig.excess_N * max(1.0 + rig.scatter * rng.standard_normal(), 0.3)
        creep = rig.creep_m * rng.uniform(0.7, 1.3)
        stick = (rig.sliding_N + excess + k * creep - low) / load  # creep lets go of as much of the drive's way
        slips = start + stick
        stuck = (time >= start) & (time < slips)
        share = (time[stuck] - start) / stick
        force[stuck] = low + load * (time[stuck] - start) - k * creep * crept(share)
        turn = math.atan(load / (w * excess))  # from the start of the slip to the highest force, times w
        lasts = (math.pi + 2.0 * turn) / w
        slides = (time >= slips) & (time < slips + lasts)
        angle = w * (time[slides] - slips)
        force[slides] = rig.sliding_N + excess * np.cos(angle) + load / w * np.sin(angle)
        peak_s, half = slips + turn / w, math.hypot(excess, load / w)
        found = {
            "start_s": end_of_last, "fail_s": peak_s, "end_s": peak_s + math.pi / w, "drop_N": 2.0 * half,
            "peak_N": rig.sliding_N + half, "trough_N": rig.sliding_N - half, "stiffness_N_per_m": k,
            "slip_m": 2.0 * half / k + v * math.pi / w, "duration_s": math.pi / w,
            "peak_velocity_m_s": v + half * w / k,
            "precursory_slip_m": creep, "recurrence_s": peak_s - last_peak, "hold_s": peak_s - end_of_last,
        }  # fmt: skip
        if found["end_s"] < rig.duration_s:
            for name, value in found.items():
                truth[name].append(value)
        end_of_last, last_peak = found["end_s"], peak_s
        start, low = slips + lasts, rig.sliding_N - excess
    mean = float(force.mean())
    return time, force + noise_of_rigs(rig, mean, time.size, rng), {name: np.array(v) for name, v in truth.items()}


def crept(share: np.ndarray) -> np.ndarray:
    """How much of the creep has happened after a share of the stick: all of it in the last third."""
    return np.clip((share - 2.0 / 3.0) * 3.0, 0.0, 1.0) ** 2


def noise_of_rigs(rig: Slider, mean_N: float, samples: int, rng: np.random.Generator) -> np.ndarray:
    """Correlated noise (autoregressive of order one) and impulses of one sample, mostly of either sign."""
    from scipy.signal import lfilter

    r = rig.correlation
    white = rng.standard_normal(samples + 200) * math.sqrt(1.0 - r**2)
    noise = rig.noise * np.asarray(lfilter([1.0], [1.0, -r], white))[200:]
    hit = rng.random(samples) < rig.impulses
    return mean_N * (noise + hit * rig.impulse * rng.standard_normal(samples) * 2.0)


NAMES = (
    "start_s", "fail_s", "end_s", "drop_N", "peak_N", "trough_N", "stiffness_N_per_m", "slip_m", "duration_s",
    "peak_velocity_m_s", "precursory_slip_m", "recurrence_s", "hold_s",
)  # fmt: skip


def random_rig(rng: np.random.Generator, quick: bool = False) -> Slider:
    """A rig of any size: two to three orders of speed and stiffness, noise as on the rigs of the real campaigns."""
    sliding = 10.0 ** rng.uniform(-1.5, 1.5)
    excess = sliding * rng.uniform(0.12, 0.35)
    stiffness = 10.0 ** rng.uniform(2.0, 4.5)
    period_s = 10.0 ** rng.uniform(-0.5, 1.0)
    speed = 2.0 * excess / (stiffness * period_s)
    per_cycle = 10.0 ** rng.uniform(1.7, 2.3 if quick else 3.2)
    slip_share = 10.0 ** rng.uniform(-2.3, -0.9)  # of the cycle
    w = math.pi / (slip_share * period_s)
    cycles = int(rng.integers(25, 80))
    swing = 2.0 * excess / sliding
    noise = min(10.0 ** rng.uniform(-2.0, math.log10(0.04)), swing / 8.0)
    return Slider(
        stiffness, speed, stiffness / w**2, sliding, excess, rng.uniform(0.05, 0.25),
        rng.uniform(0.0, 0.1) * excess / stiffness * rng.integers(0, 2), per_cycle / period_s, cycles * period_s,
        noise, rng.uniform(0.3, 0.9), rng.uniform(0.03, 0.08), rng.choice([0.0, 0.01]),
    )  # fmt: skip


@dataclass(frozen=True)
class FromRest:
    """A pull from rest in closed form: a rise that bends, drops on its way, a peak, an exponential decay to a level."""

    static_N: float = 2.0
    sliding_N: float = 1.3
    stiffness_N_per_m: float = 2000.0
    bend: float = 0.1  # share of its first slope that the rise loses on its way to the peak
    drops: int = 0
    decay_m: float = 4e-4
    speed_m_s: float = 1e-3
    rate_Hz: float = 200.0
    rest_s: float = 2.0
    slides_m: float = 0.02
    noise: float = 0.02  # of the sliding force, and so much of the force at any time
    correlation: float = 0.6


def pull_from_rest(rig: FromRest, seed: int) -> tuple[np.ndarray, np.ndarray, dict[str, float]]:
    """Time, force and what is true of the features."""
    rng = np.random.default_rng(seed)
    k, v, top, drop = rig.stiffness_N_per_m, rig.speed_m_s, rig.static_N, rig.static_N - rig.sliding_N
    curve = rig.bend * (2.0 - rig.bend) * k**2 / (4.0 * top)  # the slope at the peak is k (1 - bend)

    def way_to(force: float) -> float:
        """Way at which the rise k x - c x^2 reaches a force."""
        return 2.0 * force / (k + math.sqrt(k**2 - 4.0 * curve * force))

    peak_m = way_to(top)
    time = np.arange(0.0, rig.rest_s + (peak_m + rig.slides_m) / v, 1.0 / rig.rate_Hz)
    way = v * (time - rig.rest_s)
    rise = k * np.clip(way, 0.0, peak_m) - curve * np.clip(way, 0.0, peak_m) ** 2
    for at in np.linspace(0.25, 0.85, rig.drops):  # each is regained within a twentieth of the rise
        past = (way / peak_m - at) / 0.05
        rise = rise - 0.15 * top * np.where((past >= 0.0) & (past < 1.0), 1.0 - past, 0.0)
    force = np.where(way <= peak_m, rise, rig.sliding_N + drop * np.exp(-np.maximum(way - peak_m, 0.0) / rig.decay_m))

    def chord(low: float, high: float) -> float:
        return (high - low) * top / (way_to(high * top) - way_to(low * top))

    true = {
        "rise_stiffness_N_per_m": chord(0.2, 0.6), "rise_bend": chord(0.6, 0.9) / chord(0.2, 0.6) - 1.0,
        "precursor_drops": float(rig.drops), "static_drop_N": drop, "decay_length_um": 1e6 * rig.decay_m,
        "peak_width_um": 1e6 * (peak_m - way_to(top - 0.1 * drop) + rig.decay_m * math.log(1.0 / 0.9)),
    }  # fmt: skip
    noisy = Slider(noise=1.0, correlation=rig.correlation, impulses=0.0)
    return time, force + rig.noise * force * noise_of_rigs(noisy, 1.0, time.size, rng), true


def random_pull(rng: np.random.Generator) -> FromRest:
    """A pull of any size and rate, with the noise of real rigs."""
    sliding = 10.0 ** rng.uniform(-1.0, 1.5)
    static = sliding * rng.uniform(1.3, 2.2)
    stiffness, speed = 10.0 ** rng.uniform(2.5, 4.5), 10.0 ** rng.uniform(-4.0, -2.0)
    rise_s = static / stiffness / speed
    rise_samples = 10.0 ** rng.uniform(2.0, 3.0)
    decay_m = static / stiffness * 10.0 ** rng.uniform(-0.8, 0.3)
    drops = int(rng.integers(1, 4)) if rng.random() < 0.25 else 0
    noise = 0.01 if drops else 10.0 ** rng.uniform(-2.0, math.log10(0.04))
    return FromRest(
        static, sliding, stiffness, rng.uniform(0.0, 0.3), drops, decay_m,
        speed, rise_samples / rise_s, rise_s * rng.uniform(0.3, 1.0), 20.0 * decay_m + 2.0 * static / stiffness,
        noise, rng.uniform(0.3, 0.9),
    )  # fmt: skip


def population(rig: Slider, seed: int) -> dict[str, float]:
    """The median of each number over many more slips of the same rig than a record has."""
    many = replace(rig, duration_s=40.0 * rig.duration_s, rate_Hz=4.0 / rig.duration_s, noise=0.0, impulses=0.0)
    return {name: float(np.nanmedian(values)) for name, values in record(many, seed)[2].items()}


def scores(found_s: np.ndarray, true_s: np.ndarray) -> tuple[float, list[tuple[int, int]]]:
    """F1 of the times found for those that are true, within a fifth of the usual time between them, and the pairs."""
    near = 0.2 * float(np.median(np.diff(true_s)))
    free = set(range(found_s.size))
    pairs = []
    for k, at in enumerate(true_s):
        j = min(free, key=lambda j: abs(found_s[j] - at), default=None)
        if j is not None and abs(found_s[j] - at) < near:
            free.discard(j)
            pairs.append((k, j))
    return 2.0 * len(pairs) / max(found_s.size + true_s.size, 1), pairs
