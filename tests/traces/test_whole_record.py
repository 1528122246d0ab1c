"""Records of every shape: what each begins and ends with decides which forces are read from it, and from which zero."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from tribo import read_pull
from tribo.errors import Problem, TraceError
from tribo.records import PHASES, Pull, Test, Trace
from tribo.traces.drive import drive_of, drive_stops
from tribo.traces.evaluation import spring_of
from tribo.traces.phases import phases_of
from tribo.traces.sliding import oscillation_of, transient_end
from tribo.traces.zero import _level
from tribo.zeroing import zero_choice

from .synthetic import Shape

RATE = 50.0
NO_ZERO = Problem("no_zero_there", "the record has no part before contact")


def a_test(zero: str = "", load_N: float = math.nan, **more: float) -> Test:
    return Test("T1", "raw/T1.csv", "S", load_N, "S1", zero=zero_choice(zero), **more)  # type: ignore[arg-type]


def noise(size: int, seed: int = 0, sd: float = 0.01) -> np.ndarray:
    return sd * np.random.default_rng(seed).standard_normal(size)


def slide_hold_slide(holds: tuple[float, ...], peaks: tuple[float, ...], seed: int = 0) -> Trace:
    """A start from rest, then stops of the drive: the force relaxes to 80 % and each restart has a peak of its own."""
    parts, speed = [np.zeros(100), np.linspace(0, 2.4, 60), 2 + 0.4 * np.exp(-np.arange(600) / 20)], [0.0, 1.0, 1.0]
    for hold_s, peak in zip(holds, peaks, strict=True):
        n = int(hold_s * RATE)
        parts += [2 - 0.4 * (1 - np.exp(-np.arange(n) / (n / 3))), np.linspace(1.62, peak, 20)]
        parts += [2 + (peak - 2) * np.exp(-np.arange(600) / 20)]
        speed += [0.0, 1.0, 1.0]
    force = np.concatenate(parts)
    moving = np.concatenate([np.full(p.size, v) for p, v in zip(parts, speed, strict=True)])
    time = np.arange(force.size) / RATE
    return Trace("shs", time, force + noise(force.size, seed), columns={"speed_m_s": 2e-4 * moving})


def with_a_stop(level: float = 2.0, zero: float = 0.0, at_stop: float = 0.0, seed: int = 0) -> Trace:
    """A start from rest, a stop at which the force falls to ``at_stop``, and a restart; only the force is recorded."""
    first = np.concatenate([np.full(100, zero), np.linspace(0, 1.25, 50) * level, np.full(800, level)])
    stop = np.concatenate([np.linspace(level, at_stop, 10), np.full(120, at_stop)])
    again = np.concatenate([np.linspace(at_stop, 1.1 * level, 50), level * (1 + 0.1 * np.exp(-np.arange(800) / 30))])
    force = np.concatenate([first, stop, again])
    return Trace("stop", np.arange(force.size) / RATE, force + noise(force.size, seed))


def sawtooth(seed: int = 0, impulses: int = 0) -> Trace:
    """Stick-slip of 1 N to 0.7 N every 2 s, loaded at 0.16 N/s for 1.9 s, with impulses of one sample."""
    time = np.arange(60 * 500) / 500
    phase = time % 2.0
    force = np.where(phase < 1.9, 0.7 + 0.3 * phase / 1.9, 1.0 - 3.0 * (phase - 1.9)) + noise(time.size, seed, 1e-3)
    rng = np.random.default_rng(seed + 1)
    force[rng.choice(time.size, impulses, replace=False)] += rng.choice([-0.1, 0.1], impulses)
    return Trace("saw", time, force)


def rotary(seed: int = 0) -> Trace:
    """Approach while turning, contact at 10 s, turning until 40 s, rest, lift-off: torque and load have offsets."""
    time = np.arange(60 * 20) / 20
    touching, turning = (time > 10) & (time < 45), time < 40
    load = np.where(touching, 5.0, 0.0) - 0.13 + noise(time.size, seed)
    force = np.where(touching & turning, 1.2, 0.0) + np.where(turning & ~touching, 0.3, 0.0) - 0.6
    columns = {"normal_force_N": load, "speed_m_s": np.where(turning, 0.01, 0.0)}
    return Trace("rotary", time, force + noise(time.size, seed + 1), columns=columns)


def test_the_phases_of_a_record_that_starts_from_rest_are_named() -> None:
    whole = read_pull(Shape(noise_N=0.01, offset_N=0.3).trace(), test=a_test())
    assert [phase.name for phase in whole.phases] == ["rest", "rise", "slip", "steady sliding"]


@pytest.mark.parametrize("seed", range(5))
def test_a_record_that_begins_while_sliding_has_a_mean_and_no_static_force_and_no_zero(seed: int) -> None:
    rng = np.random.default_rng(seed)
    force = 3.0 + 0.05 * np.cumsum(rng.standard_normal(2000)) / 40 + noise(2000, seed, 0.02)
    pull = read_pull(Trace("slides", np.arange(2000) / RATE, force), test=a_test())
    assert math.isnan(pull.static_N)
    assert pull.zero_N == 0.0
    assert pull.sliding_N == pytest.approx(force.mean(), rel=0.01)


@pytest.mark.parametrize("level_N", [-3.0, -0.5])
def test_a_sliding_record_with_the_wrong_sign_says_so(level_N: float) -> None:
    with pytest.raises(TraceError, match="sign may be reversed"):
        read_pull(Trace("slides", np.arange(500) / RATE, level_N + noise(500)), test=a_test())


def test_a_record_in_which_nothing_pulls_is_not_taken_for_sliding() -> None:
    with pytest.raises(TraceError, match="before the static peak"):
        read_pull(Trace("idle", np.arange(500) / RATE, noise(500)), test=a_test())


@pytest.mark.parametrize("seed", range(3))
def test_each_hold_gives_a_static_force_with_its_time(seed: int) -> None:
    holds, peaks = (5.0, 20.0, 60.0), (2.2, 2.35, 2.5)
    pull = read_pull(slide_hold_slide(holds, peaks, seed), test=a_test())
    assert pull.static_N == pytest.approx(2.4, abs=0.03)
    assert [r.hold_s for r in pull.restarts] == pytest.approx(holds, abs=0.5)
    assert [r.static_N for r in pull.restarts] == pytest.approx(peaks, abs=0.03)
    assert [p.name for p in pull.phases].count("hold") == 3


def test_without_a_speed_the_relaxing_force_tells_of_a_hold() -> None:
    trace = replace(slide_hold_slide((20.0, 60.0), (2.35, 2.5)), columns={})
    pull = read_pull(trace, test=a_test())
    assert [r.static_N for r in pull.restarts] == pytest.approx((2.35, 2.5), abs=0.03)
    assert [r.hold_s for r in pull.restarts] == pytest.approx((20.0, 60.0), rel=0.2)


def test_the_peak_after_a_stop_is_a_force_of_its_own() -> None:
    pull = read_pull(with_a_stop(), test=a_test())
    (again,) = pull.restarts
    assert pull.static_N == pytest.approx(2.5, abs=0.05)
    assert again.static_N == pytest.approx(2.2, abs=0.03)
    assert again.hold_s == pytest.approx(130 / RATE, abs=0.3)


def test_a_zero_that_a_stop_contradicts_is_said_and_its_size_is_in_the_uncertainty() -> None:
    sure, unsure = (read_pull(with_a_stop(zero=z, at_stop=0.0), test=a_test()) for z in (0.0, 0.4))
    assert "zero_uncertain" not in sure.flags
    assert "zero_uncertain" in unsure.flags
    assert min(unsure.static_u_N, unsure.sliding_u_N, unsure.restarts[0].static_u_N) > 0.4 / 2
    assert sure.sliding_u_N < 0.05


@pytest.mark.parametrize(
    ("zero", "expected"),
    [("", 0.4), ("before contact", 0.4), ("none", 0.0), ("0.25", 0.25), ("-0.1 N", -0.1), ("at rest", 0.1)],
)
def test_a_zero_is_taken_as_chosen(zero: str, expected: float) -> None:
    pull = read_pull(with_a_stop(zero=0.4, at_stop=0.1), test=a_test(zero))
    assert pull.zero_N == pytest.approx(expected, abs=0.01)
    assert pull.sliding_N == pytest.approx(2.0 - expected, abs=0.02)


def test_a_zero_is_read_over_a_chosen_time() -> None:
    stop_s = 950 / RATE
    pull = read_pull(with_a_stop(zero=0.4, at_stop=0.1), test=a_test(f"[{stop_s + 0.5}, {stop_s + 2}]"))
    assert pull.zero_N == pytest.approx(0.1, abs=0.01)


def test_a_zero_at_rest_needs_a_rest() -> None:
    with pytest.raises(TraceError, match="no rest"):
        read_pull(Trace("slides", np.arange(500) / RATE, 3.0 + noise(500)), test=a_test("at rest"))


def test_approach_rest_and_lift_off_are_no_part_of_sliding() -> None:
    pull = read_pull(rotary(), test=a_test("at rest"))
    assert pull.sliding_N == pytest.approx(1.2, abs=0.02)
    assert pull.recorded_load_N == pytest.approx(5.0, abs=0.02)
    names = [phase.name for phase in pull.phases]
    assert names == ["approach", "steady sliding", "end of the drive", "lift-off"]


@pytest.mark.parametrize("impulses", [0, 100])
def test_stick_slip_is_measured_cycle_by_cycle(impulses: int) -> None:
    pull = read_pull(sawtooth(impulses=impulses), test=a_test())
    found = pull.oscillation
    assert found is not None
    assert (found.regime, found.cycles) == ("stick-slip", pytest.approx(26, abs=2))
    assert found.peak_N == pytest.approx(1.0, abs=0.01)
    assert found.trough_N == pytest.approx(0.7, abs=0.01)
    assert found.drop_N == pytest.approx(0.3, abs=0.01)
    assert found.period_s == pytest.approx(2.0, abs=0.02)
    assert found.loading_N_per_s == pytest.approx(0.3 / 1.9, rel=0.02)
    assert found.stuck_share == pytest.approx(0.95, abs=0.04)
    assert found.period_u_s < 0.02


def test_samples_of_a_slip_are_never_left_out() -> None:
    trace = sawtooth(impulses=100)
    pull = read_pull(trace, test=a_test())
    assert not pull.problems
    assert pull.sliding_N == pytest.approx(trace.force_N[3000:].mean(), abs=1e-3)


def test_a_sinusoid_is_an_inertial_oscillation_and_an_even_force_is_steady() -> None:
    time = np.arange(5000) / 500
    swing = Trace("sine", time, 1.0 + 0.2 * np.sin(2 * np.pi * time / 0.2) + noise(5000, 0, 5e-3))
    even = Trace("even", time, 1.0 + noise(5000, 1, 5e-3))
    regimes = [found.regime for t in (swing, even) if (found := read_pull(t, test=a_test()).oscillation)]
    assert regimes == ["inertial oscillation", "steady"]


def test_irregular_bursts_have_no_regime_of_their_own() -> None:
    rng = np.random.default_rng(3)
    starts = np.cumsum(rng.pareto(0.8, 60) * 60 + 20).astype(int)
    force = np.ones(12000)
    for at in starts[starts < 11900]:
        force[at : at + 40] += 0.5 * np.exp(-np.arange(40) / 10)
    pull = read_pull(Trace("bursts", np.arange(12000) / 500, force + noise(12000, 4, 3e-3)), test=a_test())
    assert pull.oscillation is not None
    assert pull.oscillation.regime == "irregular"


@pytest.mark.parametrize("rate_Hz", [1.0, 2.0, 50.0])
def test_no_static_force_lies_above_what_samples_and_noise_allow(rate_Hz: float) -> None:
    time = np.arange(int(400 * rate_Hz)) / rate_Hz
    force = np.where(time < 4, 0.1, np.minimum(9.0 * (time - 4) / 1.3, 16.0 - 8 * (1 - np.exp(-(time - 4) / 20))))
    pull = read_pull(Trace("coarse", time, force + noise(time.size, 2, 0.05)), test=a_test())
    assert pull.static_N + pull.zero_N < force.max() + 5 * 0.05
    assert pull.static_u_N > 0.02


def test_a_shoulder_below_the_highest_force_is_in_the_uncertainty() -> None:
    shoulder = np.concatenate([np.linspace(0, 2, 100), np.full(200, 2.0) + np.linspace(0, 0.02, 200)])
    rise = np.concatenate([np.zeros(100), shoulder, np.linspace(2.02, 2.6, 300), np.linspace(2.6, 2.2, 400)])
    trace = Trace("shoulder", np.arange(1100 + 600) / RATE, np.concatenate([rise, np.full(600, 2.2)]) + noise(1700))
    first, highest = (read_pull(trace, test=a_test(), rule=rule) for rule in ("first_peak", "highest"))
    assert first.static_N == pytest.approx(2.0, abs=0.06)
    assert highest.static_N == pytest.approx(2.6, abs=0.03)
    assert first.highest_N == pytest.approx(2.6, abs=0.03)
    assert first.static_u_N > 0.3
    assert "peak_ambiguous" in first.flags


def test_a_clear_peak_has_one_reading() -> None:
    pull: Pull = read_pull(Shape(noise_N=0.01).trace(), test=a_test())
    assert pull.first_maximum_N == pull.highest_N == pull.first_drop_N == pull.static_N


@pytest.mark.parametrize("text", ["before", "[3, 1]", "0.1 kN", "[1]", "yes"])
def test_a_zero_that_is_none_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="before contact"):
        zero_choice(text)


@pytest.mark.parametrize("stiffness", [80.0, 400.0])
def test_a_slider_that_is_loaded_as_the_drive_demands_sticks_and_one_that_lags_swings(stiffness: float) -> None:
    """The sawtooth rises by 0.16 N/s: the rate of the drive with 80 N/m at 2 mm/s, a fifth of it with 400 N/m."""
    pull = read_pull(sawtooth(), test=a_test(load_N=2.0, speed_m_s=2e-3, stiffness_N_per_m=stiffness))
    assert pull.oscillation is not None
    assert pull.oscillation.regime == ("stick-slip" if stiffness == 80.0 else "inertial oscillation")


def test_sliding_before_a_stop_counts_where_it_is_settled_however_even_the_sliding_after_it() -> None:
    first, after = 2.0, 1.6
    start = np.concatenate([np.zeros(100), np.linspace(0, 1.25, 50) * first, np.full(800, first)])
    stop = np.concatenate([np.linspace(first, 0, 10), np.zeros(120)])
    again = np.concatenate([np.linspace(0, 1.25 * after, 50), np.full(3000, after)])
    force = np.concatenate([start + noise(start.size), stop, again + noise(again.size, 1, 1e-3)])
    pull = read_pull(Trace("stop", np.arange(force.size) / RATE, force), test=a_test())
    assert len(pull.restarts) == 1
    assert pull.sliding_N == pytest.approx(first, abs=0.01)


def test_the_free_period_is_that_of_the_loaded_mass_on_its_spring() -> None:
    """A load of two kilograms on 80 N/m swings in 2 pi sqrt(2/80) s; at 2 mm/s the spring is loaded by 0.16 N/s."""
    with_spring = spring_of(a_test(speed_m_s=2e-3, stiffness_N_per_m=80.0), 2 * 9.80665)
    assert with_spring["free_period_s"] == pytest.approx(2 * math.pi * math.sqrt(2 / 80))
    assert with_spring["drive_N_per_s"] == pytest.approx(0.16)
    assert all(math.isnan(v) for v in spring_of(a_test(speed_m_s=2e-3), 20.0).values())


@pytest.mark.parametrize("peaks", [2, 3, 4])
def test_a_few_peaks_have_one_cycle_less(peaks: int) -> None:
    time = np.arange(500 * peaks + 50) / 500
    force = 1.0 + 0.2 * (time % 1.0)
    assert oscillation_of(time, force + noise(time.size, 0, 1e-4)).cycles == peaks - 1


def test_where_sliding_before_a_stop_drifts_the_steadiest_slide_after_it_counts() -> None:
    start = np.concatenate([np.zeros(100), np.linspace(0, 3.0, 50), np.linspace(2.6, 1.6, 800)])
    force = start
    for level, drift in ((1.6, 0.8), (1.5, 0.0), (1.4, 0.6)):
        stop = np.concatenate([np.linspace(force[-1], 0, 10), np.zeros(120)])
        slide = np.linspace(level + drift, level, 800)
        force = np.concatenate([force, stop, np.linspace(0, 1.25 * slide[0], 50), slide])
    pull = read_pull(Trace("stops", np.arange(force.size) / RATE, force + noise(force.size)), test=a_test())
    assert len(pull.restarts) == 3
    assert pull.sliding_N == pytest.approx(1.5, abs=0.02)


@pytest.mark.parametrize("size", [12, 15, 17, 19, 20, 23, 41])
def test_a_force_has_settled_within_the_first_half_of_its_samples(size: int) -> None:
    force = 1.0 + np.exp(-np.arange(size) / (size / 6))
    assert 0 < transient_end(force) <= size // 2 + 1


def rotary_slide(length_m: float) -> Pull:
    """A slide that begins at 0.1 m/s under 12 N and falls to 10 N over the first fifth of its length."""
    time = np.arange(0.0, length_m / 0.1, max(length_m / 0.1 / 2000, 0.01))
    force = 10.0 + 2.0 * np.exp(-5.0 * time / time[-1]) + np.random.default_rng(2).normal(0.0, 0.05, time.size)
    force[:20] = np.linspace(0.0, 12.0, 20)
    return read_pull(Trace("disc", time, force), test=Test("T", "f", "S", 50.0, "S", speed_m_s=0.1))


def test_a_slide_over_its_own_track_is_averaged_over_its_second_half() -> None:
    long, short = rotary_slide(100.0), rotary_slide(1.0)
    assert long.window_s == pytest.approx((500.0, 1000.0), rel=0.01)
    assert long.sliding_N == pytest.approx(10.0 + 2.0 * (np.exp(-2.5) - np.exp(-5.0)) / 2.5, abs=0.01)
    assert short.window_s[0] != pytest.approx(5.0, rel=0.01)


def test_slow_waves_that_do_not_repeat_are_no_oscillation() -> None:
    rng = np.random.default_rng(4)
    time = np.arange(0.0, 1800.0, 1.0)
    ends = np.cumsum(rng.lognormal(4.0, 0.7, 40))
    wave = np.sin(np.pi * np.interp(time, ends, np.arange(40)))
    regular = np.sin(2 * np.pi * time / 60.0)
    noise = rng.normal(0.0, 0.01, time.size)
    assert oscillation_of(time, 10.0 + wave + noise).regime == "irregular"
    assert oscillation_of(time, 10.0 + regular + noise).regime == "inertial oscillation"


def ranges_of(*parts: tuple[bool, int]) -> np.ndarray:
    """Whether the drive moves, sample by sample: so many samples of each."""
    return np.concatenate([np.full(n, moves) for moves, n in parts])


def test_a_drive_stands_still_from_five_samples_on() -> None:
    moving = ranges_of((False, 5), (True, 20), (False, 4), (True, 20), (False, 5), (True, 20), (False, 5))
    stops, end, rests = drive_stops(moving, (0, moving.size))
    assert stops == [(49, 54)]
    assert end == 74  # behind it the drive does not move again
    assert rests == [(0, 5), (49, 54), (74, 79)]
    stops, end, rests = drive_stops(moving[:-1], (0, 78))
    assert (end, rests) == (78, [(0, 5), (49, 54)])  # four samples are no end


def test_a_stop_of_the_drive_counts_where_the_bodies_touch_before_and_after_it() -> None:
    moving = ranges_of((True, 20), (False, 10), (True, 20), (False, 10), (True, 20))
    assert drive_stops(moving, (0, 80))[0] == [(20, 30), (50, 60)]
    assert drive_stops(moving, (20, 80))[0] == [(50, 60)]
    assert drive_stops(moving, (19, 80))[0] == [(20, 30), (50, 60)]
    assert drive_stops(moving, (0, 60))[0] == [(20, 30)]
    assert drive_stops(moving, (0, 61))[0] == [(20, 30), (50, 60)]
    assert drive_stops(np.zeros(9, bool), (2, 7)) == ([], 7, [])


def test_a_displacement_that_goes_one_way_tells_where_the_drive_stands_still() -> None:
    travel = np.concatenate([np.arange(1000), np.full(1000, 999), np.arange(1000) + 999]) * 1e-6
    record = Trace("x", np.arange(3000) / 100, np.ones(3000), displacement_m=travel)
    moving = drive_of(record).moving  # type: ignore[union-attr]
    assert moving[:990].all()
    assert not moving[1010:1990].any()
    assert moving[2010:].all()
    assert drive_of(replace(record, displacement_m=np.zeros(3000))) is None
    assert drive_of(replace(record, displacement_m=noise(3000, sd=1e-6))) is None


def test_a_position_that_goes_to_and_fro_tells_where_the_drive_turns() -> None:
    record = Trace("x", np.arange(3000) / 100, np.ones(3000), displacement_m=1e-4 * np.sin(np.arange(3000) / 100))
    drive = drive_of(record)
    assert drive is not None
    assert drive.turns == pytest.approx([math.pi / 2 * 100 * k for k in range(1, 19, 2)], abs=3)


def test_what_a_zero_drifts_is_in_its_uncertainty_as_a_rectangular_distribution() -> None:
    """From 0 to 0.5 N: the medians of the first and the last fifth lie 0.4 N apart."""
    time = np.arange(400) / RATE
    steady = _level(time, noise(400, sd=1e-3), (0, 400), "before contact", NO_ZERO)
    drifting = _level(time, np.linspace(0.0, 0.5, 400) + noise(400, sd=1e-3), (0, 400), "before contact", NO_ZERO)
    assert not steady.drifts
    assert steady.u_N < 1e-3
    assert drifting.drifts
    assert drifting.force_N == pytest.approx(0.25, abs=1e-3)
    assert drifting.u_N == pytest.approx(0.4 / math.sqrt(12.0), rel=0.01)


def seconds_of(trace: Trace) -> list[tuple[str, float, float]]:
    return [(phase.name, phase.start_s, phase.end_s) for phase in phases_of(trace)]


@pytest.mark.parametrize("trace", [rotary(), with_a_stop(), slide_hold_slide((5.0, 20.0), (2.2, 2.35)), sawtooth()])
def test_phases_follow_each_other_from_the_first_sample_to_the_last(trace: Trace) -> None:
    found = seconds_of(trace)
    assert found[0][1] == trace.time_s[0]
    assert found[-1][2] == trace.time_s[-1]
    assert all(end == start for (*_, end), (_, start, _) in pairwise(found))
    assert all(start < end and name in PHASES for name, start, end in found)


def test_a_stop_is_a_hold_and_the_climb_after_it_a_rise() -> None:
    found = seconds_of(slide_hold_slide((20.0,), (2.35,)))
    slide = ["rise", "slip", "steady sliding"]
    assert [name for name, *_ in found] == ["rest", *slide, "hold", *slide]
    assert found[4][1:] == pytest.approx((760 / RATE, 1760 / RATE), abs=0.1)
