"""Stick-slip followed cycle by cycle, on a slider whose spring, drive and friction are known."""

from __future__ import annotations

import numpy as np
import pytest

from tribo.records import Trace
from tribo.traces import oscillation_of

STIFFNESS_N_PER_M, SPEED_M_S, LOW_N, MEAN_PEAK_N, CYCLES = 168.0, 42e-6, 0.085, 0.097, 60
LOADING_N_PER_S = STIFFNESS_N_PER_M * SPEED_M_S


def slider(seed: int, speed_m_s: float = SPEED_M_S, rate_Hz: float = 200.0) -> tuple[Trace, np.ndarray]:
    """A spring loads the slider at k v up to peaks that scatter by 2 mN; every slip falls to one level."""
    rng = np.random.default_rng(seed)
    peaks = rng.normal(MEAN_PEAK_N, 0.002, CYCLES)
    rise_s = (peaks - LOW_N) / (STIFFNESS_N_PER_M * speed_m_s)
    ends = np.cumsum(rise_s)
    time = np.arange(0.0, ends[-1] + rise_s.mean() / 2, 1 / rate_Hz)
    begins = np.concatenate([[0.0], ends])
    force = LOW_N + STIFFNESS_N_PER_M * speed_m_s * (time - begins[np.searchsorted(ends, time, side="right")])
    return Trace("slider", time, force + rng.normal(0, 1e-4, time.size)), peaks


def test_every_stick_is_found_with_its_peak_and_every_slip_with_its_trough() -> None:
    """Peaks are medians over a tenth of a cycle, so that a sharp one may be read low by a twelfth of its height."""
    trace, peaks = slider(1)
    found = oscillation_of(trace.time_s, trace.force_N)
    assert (found.regime, found.cycles) == ("stick-slip", CYCLES - 1)
    assert found.peak_N == pytest.approx(np.median(peaks), abs=(MEAN_PEAK_N - LOW_N) / 12)
    assert found.trough_N == pytest.approx(LOW_N, abs=(MEAN_PEAK_N - LOW_N) / 12)


def test_a_stick_loads_with_the_stiffness_of_the_spring_times_the_speed_of_the_drive() -> None:
    slow, fast = slider(2)[0], slider(2, speed_m_s=10 * SPEED_M_S, rate_Hz=2000.0)[0]
    assert oscillation_of(slow.time_s, slow.force_N).loading_N_per_s == pytest.approx(LOADING_N_PER_S, rel=0.02)
    assert oscillation_of(fast.time_s, fast.force_N).loading_N_per_s == pytest.approx(10 * LOADING_N_PER_S, rel=0.02)


def test_the_period_is_the_time_from_peak_to_peak() -> None:
    trace, peaks = slider(3)
    expected = np.median(peaks[1:] - LOW_N) / LOADING_N_PER_S
    assert oscillation_of(trace.time_s, trace.force_N).period_s == pytest.approx(expected, rel=0.05)


def test_impulses_of_a_sample_are_no_sticks() -> None:
    trace, peaks = slider(4)
    force = trace.force_N.copy()
    force[::997] += 0.05
    found = oscillation_of(trace.time_s, force)
    assert found.peak_N == pytest.approx(np.median(peaks), abs=1e-3)
    assert found.cycles == pytest.approx(CYCLES - 1, abs=1)


def test_a_trace_without_cycles_has_none() -> None:
    time = np.arange(0.0, 20.0, 0.01)
    assert oscillation_of(time, 0.1 * time).cycles == 0


def bursts(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """A steady force of 0.09 N at 2 kHz with bursts of five samples and 0.01 N, four hundred in twenty seconds."""
    rng = np.random.default_rng(seed)
    time = np.arange(40000) / 2000
    force = 0.09 + 2e-4 * rng.standard_normal(time.size)
    for at in rng.integers(10, time.size - 10, 400):
        force[at : at + 5] += 0.01 * rng.choice([-1.0, 1.0])
    return time, force


def test_a_force_that_returns_faster_than_the_spring_can_pull_is_no_slip() -> None:
    """2254 N/m at 42 um/s give 0.095 N/s: a burst regains 0.01 N within 2.5 ms, forty times as fast."""
    time, force = bursts(1)
    assert oscillation_of(time, force).cycles > 100
    found = oscillation_of(time, force, drive_N_per_s=2254 * 42e-6)
    assert found.regime == "steady"
    assert found.cycles <= 3  # where bursts happen to lie far apart


def test_slips_of_a_spring_are_counted_beside_faster_noise() -> None:
    time, force = bursts(2)
    saw = 0.04 * ((time / 0.5) % 1.0)  # 0.08 N/s
    found = oscillation_of(time, force + saw, drive_N_per_s=0.08)
    assert found.cycles == pytest.approx(40, rel=0.1)
    assert found.drop_N == pytest.approx(0.04, rel=0.15)
