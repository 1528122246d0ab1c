"""Reading static and sliding friction off traces whose answer is known."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from support import first_quick

from tribo import read_pull
from tribo.errors import TraceError
from tribo.records import Test, Trace
from tribo.traces import RULES
from tribo.zeroing import zero_choice

from .synthetic import Shape, with_samples

NOISY = Shape(noise_N=0.01, offset_N=0.3)
SHAPES = {
    "plain": NOISY,
    "10 Hz": Shape(rate_Hz=10, noise_N=0.01),
    "1 kHz": Shape(rate_Hz=1000, noise_N=0.02),
    "5 kHz": Shape(rate_Hz=5000, noise_N=0.05, sliding_s=20),
    "no drop": Shape(sliding_N=2.0, noise_N=0.01),
    "no drop, 1 kHz": Shape(sliding_N=2.0, noise_N=0.02, rate_Hz=1000),
    "slow fall": Shape(fall_s=2.0, noise_N=0.01, sliding_s=20),
    "sudden drop": Shape(fall_s=0.005, rate_Hz=100, noise_N=0.01),
    "rounded": Shape(dome_s=0.5, noise_N=0.01),
    "rounded, 500 Hz": Shape(dome_s=0.5, noise_N=0.02, rate_Hz=500),
    "stick-slip": Shape(swing_N=0.3, noise_N=0.01, sliding_s=30),
    "noise of 3 %": Shape(noise_N=0.06, rate_Hz=100),
    "newtons by the hundred": Shape(static_N=500, sliding_N=300, noise_N=2.0, rate_Hz=200),
    "millinewtons": Shape(static_N=2e-3, sliding_N=1e-3, noise_N=1e-5),
    "rise of 1000 samples": Shape(rise_s=20, noise_N=0.01, sliding_s=30),
    "zero of 5 N": Shape(offset_N=5.0, noise_N=0.01),
}
SOME_TEST = Test("T1", "raw/T1.csv", "F", 1.0, "F1", speed_m_s=2e-4)


@pytest.mark.parametrize("name", SHAPES)
def test_static_and_sliding_are_found_whatever_the_shape(name: str) -> None:
    shape = SHAPES[name]
    pulls = [read_pull(shape.trace(seed)) for seed in range(3 if shape.rate_Hz > 2000 else 8)]
    static = np.array([p.static_N for p in pulls]) / shape.static_N - 1
    sliding = np.array([p.sliding_N for p in pulls]) / shape.sliding_N - 1
    assert np.median(np.abs(static)) < 0.01
    assert np.abs(static).max() < 0.03
    assert np.abs(sliding).max() < 0.015


@pytest.mark.parametrize("name", first_quick(["plain", "1 kHz", "slow fall", "noise of 3 %", "rise of 1000 samples"]))
def test_stated_uncertainties_cover_the_error(name: str) -> None:
    shape = SHAPES[name]
    pulls = [read_pull(shape.trace(seed)) for seed in range(40)]
    for error, u in (
        ([p.static_N - shape.static_N for p in pulls], [p.static_u_N for p in pulls]),
        ([p.sliding_N - shape.sliding_N for p in pulls], [p.sliding_u_N for p in pulls]),
    ):
        z = np.array(error) / np.array(u)
        assert np.mean(np.abs(z) < 1.96) >= 0.9
        assert np.sqrt(np.mean(z**2)) < 1.3


def test_the_zero_is_the_force_before_contact() -> None:
    pull = read_pull(NOISY.trace())
    assert pull.zero_N == pytest.approx(0.3, abs=4 * pull.zero_u_N)
    assert pull.zero_u_N == pytest.approx(0.01 / math.sqrt(90), rel=0.6)


def test_onset_peak_rise_and_stiffness_are_those_of_the_trace() -> None:
    pull = read_pull(NOISY.trace())
    assert pull.onset_s == pytest.approx(2.0, abs=0.02)
    assert pull.peak_s == pytest.approx(3.5, abs=0.02)
    assert pull.rise_N_per_s == pytest.approx(2.0 / 1.5, rel=0.02)
    assert pull.rise_stiffness_N_per_m == pytest.approx(2.0 / (1.5 * 2e-4), rel=0.02)
    assert pull.noise_N == pytest.approx(0.01, rel=0.2)
    assert abs(pull.drift_N_per_s) < 1e-3


def test_without_displacement_the_stiffness_comes_from_the_speed_of_the_test() -> None:
    trace = replace(NOISY.trace(), displacement_m=None)
    assert math.isnan(read_pull(trace).rise_stiffness_N_per_m)
    assert read_pull(trace, test=SOME_TEST).rise_stiffness_N_per_m == pytest.approx(2.0 / 3e-4, rel=0.02)


def test_stick_slip_is_measured_peak_to_peak_and_by_its_period() -> None:
    pull = read_pull(SHAPES["stick-slip"].trace())
    assert pull.stick_slip_amplitude_N == pytest.approx(0.6, rel=0.05)
    assert pull.stick_slip_period_s == pytest.approx(0.7, rel=0.03)
    assert "stick_slip" in pull.flags


def test_scatter_is_no_stick_slip() -> None:
    for seed in range(5):
        for name in ("plain", "1 kHz", "noise of 3 %"):
            assert math.isnan(read_pull(SHAPES[name].trace(seed)).stick_slip_period_s)


def test_the_window_leaves_the_fall_out_and_unloading_too() -> None:
    shape = Shape(noise_N=0.01, fall_s=1.0, sliding_s=20)
    trace = shape.trace()
    force = trace.force_N * np.clip((22.0 - trace.time_s) / 0.5, 0, 1)  # the carriage is backed off at 21.5 s
    pull = read_pull(replace(trace, force_N=force))
    assert 3.5 + 3 * shape.fall_s < pull.window_s[0] < 13.5
    assert pull.window_s[1] < 21.6
    assert pull.sliding_N == pytest.approx(1.2, rel=0.01)


def test_a_drop_of_none_is_flagged_and_static_is_the_end_of_the_rise() -> None:
    pull = read_pull(SHAPES["no drop"].trace())
    assert "no_drop" in pull.flags or "rounded_peak" in pull.flags
    assert pull.peak_s == pytest.approx(3.5, abs=0.3)


def test_a_later_higher_force_is_not_the_static_peak() -> None:
    trace = NOISY.trace()
    climbing = trace.force_N + 0.2 * np.maximum(trace.time_s - 4.0, 0)  # ends far above the first maximum
    pull = read_pull(replace(trace, force_N=climbing))
    assert pull.static_N == pytest.approx(2.0, rel=0.01)
    assert pull.drift_N_per_s == pytest.approx(0.2, rel=0.1)


def test_a_trace_that_starts_in_the_rise_has_no_zero_and_says_so() -> None:
    trace = NOISY.trace()
    late = trace.time_s > 2.1
    pull = read_pull(Trace("late", trace.time_s[late], trace.force_N[late] - 0.3))
    assert "no_zero_phase" in pull.flags
    assert pull.zero_N == 0.0
    assert pull.zero_u_N == pytest.approx((trace.force_N[late][0] - 0.3) / math.sqrt(3), abs=1e-9)
    assert pull.static_u_N > pull.zero_u_N
    assert pull.static_N == pytest.approx(2.0, rel=0.01)


def test_a_short_zero_before_a_long_rise_is_still_seen() -> None:
    pull = read_pull(Shape(zero_s=0.5, rise_s=15, noise_N=0.01, offset_N=2.0).trace())
    assert pull.zero_N == pytest.approx(2.0, abs=0.02)
    assert pull.static_N == pytest.approx(2.0, rel=0.015)


def test_pull_carries_rule_id_and_window_in_order() -> None:
    pull = read_pull(NOISY.trace(), test=SOME_TEST)
    assert (pull.test_id, pull.rule) == ("T1", "first_peak")
    assert pull.onset_s < pull.peak_s < pull.window_s[0] < pull.window_s[1]


def test_scatter_does_not_lift_the_static_peak_as_it_lifts_a_maximum() -> None:
    shape = Shape(noise_N=0.02, rate_Hz=200)
    traces = [shape.trace(seed) for seed in range(40)]
    bias = np.mean([read_pull(t).static_N for t in traces]) / shape.static_N - 1
    bare = np.mean([t.force_N.max() for t in traces]) / shape.static_N - 1
    assert abs(bias) < 0.003
    assert bare > 3 * abs(bias)


seeds = st.integers(0, 10_000)


@settings(max_examples=25, deadline=None)
@given(seed=seeds, shift=st.floats(-1e4, 1e4))
def test_shifting_the_clock_shifts_only_the_times(seed: int, shift: float) -> None:
    trace = NOISY.trace(seed)
    a, b = read_pull(trace), read_pull(replace(trace, time_s=trace.time_s + shift))
    assert b.static_N == pytest.approx(a.static_N, rel=1e-5)
    assert b.sliding_N == pytest.approx(a.sliding_N, rel=1e-9)
    assert b.peak_s - a.peak_s == pytest.approx(shift, abs=1e-3)


@settings(max_examples=25, deadline=None)
@given(seed=seeds, zero=st.floats(-50, 50))
def test_a_constant_zero_is_taken_out(seed: int, zero: float) -> None:
    trace = NOISY.trace(seed)
    at_rest = replace(SOME_TEST, zero=zero_choice("before contact"))
    a, b = (read_pull(replace(trace, force_N=trace.force_N + z), test=at_rest) for z in (0.0, zero))
    assert b.zero_N - a.zero_N == pytest.approx(zero, abs=1e-9)
    assert (b.static_N, b.sliding_N) == pytest.approx((a.static_N, a.sliding_N), rel=1e-8)


@settings(max_examples=25, deadline=None)
@given(seed=seeds, factor=st.floats(1e-4, 1e4))
def test_another_unit_of_force_scales_every_force_and_no_time(seed: int, factor: float) -> None:
    trace = NOISY.trace(seed)
    a, b = read_pull(trace), read_pull(replace(trace, force_N=factor * trace.force_N))
    for name in ("static_N", "static_u_N", "sliding_N", "sliding_u_N", "zero_N", "rise_N_per_s", "noise_N"):
        assert getattr(b, name) == pytest.approx(factor * getattr(a, name), rel=1e-6)
    assert b.window_s == a.window_s


@settings(max_examples=60, deadline=None)
@given(seed=seeds, index=st.integers(0, 770), height=st.floats(-100, 100))
def test_a_spike_of_any_height_at_any_sample_hardly_changes_the_reading(seed: int, index: int, height: float) -> None:
    trace = NOISY.trace(seed)
    a, b = read_pull(trace), read_pull(with_samples(trace, {index: trace.force_N[index] + height}))
    assert abs(b.static_N - a.static_N) < max(0.02 * a.static_N, 4 * a.static_u_N)
    assert b.sliding_N == pytest.approx(a.sliding_N, rel=0.01)


@pytest.mark.parametrize("name", RULES)
def test_every_rule_reads_a_long_pull(name: str) -> None:
    shape = Shape(noise_N=0.01, sliding_s=100, speed_m_s=2.5e-3)
    pull = read_pull(shape.trace(), rule=name)
    assert pull.rule == name
    assert pull.static_N == pytest.approx(2.0, rel=0.01)
    assert pull.sliding_N == pytest.approx(1.2, rel=0.01)
    assert "window_short" not in pull.flags


def test_lengths_are_counted_in_travel() -> None:
    shape = Shape(noise_N=0.01, sliding_s=100, speed_m_s=2.5e-3)
    trace = shape.trace()
    skip = read_pull(trace, rule="skip_length")
    assert skip.window_s == pytest.approx((2.0 + 0.013 / 2.5e-3, 2.0 + 0.163 / 2.5e-3), abs=0.1)
    iso = read_pull(trace, rule="iso_8295")
    assert iso.window_s[1] == pytest.approx(3.5 + 0.060 / 2.5e-3, abs=0.1)
    short = read_pull(trace, rule="skip_length", parameters={"skip_m": 0.02, "length_m": 0.05})
    assert short.window_s == pytest.approx((10.0, 30.0), abs=0.1)


def test_the_middle_share_is_centred_in_the_stroke() -> None:
    pull = read_pull(NOISY.trace(), rule="middle_share", parameters={"share": 0.5})
    assert pull.window_s == pytest.approx((2.0 + 13.5 / 4, 2.0 + 13.5 * 3 / 4), abs=0.1)


def test_a_stroke_shorter_than_the_rule_asks_is_used_and_flagged() -> None:
    assert "window_short" in read_pull(NOISY.trace(), rule="astm_d1894").flags


def kinds(fault: TraceError) -> list[str]:
    return [p.kind for p in fault.problems]


def test_an_unknown_rule_names_those_there_are() -> None:
    with pytest.raises(TraceError, match="middle_share"):
        read_pull(NOISY.trace(), rule="median")
    with pytest.raises(TraceError, match="skip_m"):
        read_pull(NOISY.trace(), rule="skip_length", parameters={"skip": 1.0})


def test_a_rule_that_counts_travel_needs_travel() -> None:
    with pytest.raises(TraceError) as fault:
        read_pull(replace(NOISY.trace(), displacement_m=None), rule="iso_8295", test=replace(SOME_TEST, speed_m_s=None))
    assert kinds(fault.value) == ["no_displacement"]
    assert fault.value.problems[0].test_id == "T1"


@pytest.mark.parametrize(("rate_Hz", "width_s"), first_quick([(10, 0.3), (50, 0.1), (20, 0.2), (100, 0.1)], 2))
def test_a_top_rounded_over_a_few_samples_lies_within_the_static_uncertainty(rate_Hz: float, width_s: float) -> None:
    """The line bends into its top over ``width_s``; noise hides the bend, and a sharp apex would lie above it."""
    rise_N_per_s, rng = 1.0, np.random.default_rng(int(rate_Hz))
    held = []
    for _ in range(40):
        time = np.arange(rng.uniform(0, 1 / rate_Hz), 14.0, 1 / rate_Hz)
        start = 4.0 - width_s / 2
        bend = np.clip((time - start) / width_s, 0, 1)
        peak = rise_N_per_s * (start - 2.0 + width_s / 2)
        force = rise_N_per_s * (np.clip(time - 2.0, 0, start - 2.0) + width_s * (bend - bend**2 / 2))
        after = np.maximum(time - start - width_s, 0)
        force = np.where(after > 0, 1.3 + (peak - 1.3) * np.exp(-after / 0.3), force)
        pull = read_pull(Trace("arched", time, force + 0.01 * rng.standard_normal(time.size)))
        held.append(abs(pull.static_N - peak) < 1.96 * pull.static_u_N)
    assert np.mean(held) >= 0.85
