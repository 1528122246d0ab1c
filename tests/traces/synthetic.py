"""Traces with a known answer, of several shapes, so that a rule tuned to one of them would show."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribo.records import Trace


@dataclass(frozen=True)
class Shape:
    """A pull made from its static and sliding friction; every time in seconds, every force in newton."""

    static_N: float = 2.0
    sliding_N: float = 1.2
    rate_Hz: float = 50.0
    zero_s: float = 2.0
    rise_s: float = 1.5
    sliding_s: float = 12.0
    fall_s: float = 0.15
    dome_s: float = 0.0  # a rounded top of this width instead of a corner
    swing_N: float = 0.0  # amplitude (half peak to peak) of steady stick-slip
    swing_s: float = 0.7
    noise_N: float = 0.0
    offset_N: float = 0.0
    speed_m_s: float = 2e-4

    def force(self, time_s: np.ndarray) -> np.ndarray:
        peak_s = self.zero_s + self.rise_s
        rise = self.static_N * (time_s - self.zero_s) / self.rise_s
        after = np.maximum(time_s - peak_s, 0.0)
        fall = self.sliding_N + (self.static_N - self.sliding_N) * np.exp(-after / self.fall_s)
        phase = np.maximum(after - 5 * self.fall_s, 0.0) / self.swing_s
        fall = fall + self.swing_N * (2.0 * (phase % 1.0) - 1.0) * (phase > 0)
        force = np.where(time_s < self.zero_s, 0.0, np.where(time_s < peak_s, rise, fall))
        if self.dome_s:
            reach = (time_s - peak_s) / self.dome_s
            dome = self.static_N * (1.0 - 0.1 * reach**2)
            force = np.where(np.abs(reach) < 1, np.minimum(np.maximum(force, dome), self.static_N), force)
        return force

    def trace(self, seed: int = 0) -> Trace:
        duration = self.zero_s + self.rise_s + self.sliding_s
        time = np.arange(int(duration * self.rate_Hz)) / self.rate_Hz + 0.37 / self.rate_Hz
        noise = self.noise_N * np.random.default_rng(seed).standard_normal(time.size)
        return Trace("made", time, self.force(time) + noise + self.offset_N, displacement_m=self.speed_m_s * time)


def with_samples(trace: Trace, changes: dict[int, float]) -> Trace:
    """The same trace with some samples replaced."""
    force = trace.force_N.copy()
    for index, value in changes.items():
        force[index] = value
    return Trace(trace.name, trace.time_s, force, displacement_m=trace.displacement_m)
