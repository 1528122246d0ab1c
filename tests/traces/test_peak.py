"""The apex of a static peak, and what its shape leaves open."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from tribo import read_pull
from tribo.records import Trace
from tribo.traces.peak import sharp_apex, with_shape_left_open

RATE_HZ, PEAK_N, PEAK_S, LEVEL_N, NOISE_N = 50.0, 2.0, 3.007, 1.2, 1e-4


def corner() -> tuple[np.ndarray, np.ndarray]:
    """A line that rises at 1 N/s to 2 N at 3.007 s and falls exponentially from there; almost without noise."""
    time = np.arange(1.0, 5.0, 1 / RATE_HZ)
    after = np.maximum(time - PEAK_S, 0.0)
    fall = LEVEL_N + (PEAK_N - LEVEL_N) * np.exp(-after / 0.3)
    force = np.where(time < PEAK_S, PEAK_N + time - PEAK_S, fall)
    return time, force + NOISE_N * np.random.default_rng(1).standard_normal(time.size)


def test_a_sharp_apex_is_found_closer_than_half_a_sample_in_time_and_force() -> None:
    time, force = corner()
    peak = int(force.argmax())
    apex = sharp_apex(time, force, peak - 2, peak + 2, NOISE_N)
    assert apex is not None
    assert apex.force_N == pytest.approx(PEAK_N, abs=0.5 / RATE_HZ)
    assert apex.time_s == pytest.approx(PEAK_S, abs=0.5 / RATE_HZ)


def test_a_top_that_may_be_rounded_adds_the_rms_distance_of_a_rectangular_distribution() -> None:
    """GUM 4.3.7: anywhere between the top of the parabola through the five highest samples and the sharp apex."""
    time, force = corner()
    peak = int(force.argmax())
    apex = sharp_apex(time, force, peak - 2, peak + 2, NOISE_N)
    assert apex is not None
    near = slice(peak - 2, peak + 3)
    a, b, c = np.polyfit(time[near] - time[peak], force[near], 2)
    lowest = c - b**2 / (4 * a)
    possible = np.linspace(lowest, apex.force_N, 100_001)
    expected = np.sqrt(np.mean((possible - apex.force_N) ** 2))
    opened = with_shape_left_open(apex, time, force, peak, 2, NOISE_N)
    assert expected > 20 * NOISE_N
    assert opened.shape_u_N == pytest.approx(expected, rel=1e-3)
    assert (opened.force_N, opened.u_N) == (apex.force_N, apex.u_N)


def test_the_static_force_holds_under_noise_of_three_per_cent_that_grows_with_the_force_and_is_correlated() -> None:
    time, held = np.arange(1500) / 50, 0
    force = np.clip((time - 3.0) / 1.6, 0.0, 1.0) * np.where(time > 4.6, 1.5 + 0.5 * np.exp(-(time - 4.6) / 0.2), 2.0)
    for seed in range(30):
        rng = np.random.default_rng(seed)
        rough = lfilter([0.6], [1.0, -0.8], rng.standard_normal(1700))[200:]
        pull = read_pull(Trace("rough", time, force * (1.0 + 0.03 * rough) + 0.003 * rng.standard_normal(1500)))
        held += abs(pull.static_N - 2.0) <= 1.96 * pull.static_u_N
    assert held >= 26
