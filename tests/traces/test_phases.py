"""Records of programmes: which part is a rest, a slide, a stroke, a step, and what may be read from it."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from tribo import read_pull
from tribo.readers import read_blocks
from tribo.records import PHASES, Pull, Test, Trace
from tribo.traces import PullOptions, evaluate, phases_of, pieces_of, split_pulls
from tribo.traces.drive import level_cuts, quiet_end, speed_level_m_s

REAL = Path(__file__).resolve().parents[3] / "shared" / "real"
at_hand = pytest.mark.skipif(not REAL.is_dir(), reason="the real campaigns are not at hand")
TEST = Test("T1", "raw/T1.csv", "S", math.nan, "S1")


def noise(size: int, seed: int = 0, sd: float = 0.01) -> np.ndarray:
    return sd * np.random.default_rng(seed).standard_normal(size)


def continuous(seed: int = 0, *, rpm: bool = True) -> Trace:
    """Three minutes on a turning disc: 0.14 N more from the first sample to the last, 0.5 N to begin with."""
    time = np.arange(1800) / 10
    force = 0.5 + 0.14 * (1 - np.exp(-time / 40)) + noise(1800, seed)
    columns = {"rotation_rev_per_s": 7.9 + noise(1800, seed + 1, 0.02)} if rpm else {}
    return Trace("disc", time, force, columns=columns)


def of_phase(trace: Trace, name: str) -> list[tuple[float, float]]:
    return [(p.start_s, p.end_s) for p in phases_of(trace) if p.name == name]


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("rpm", "contact"), [(True, ""), (True, "sled"), (False, "ball_on_disc"), (False, "rotary")])
def test_a_disc_that_turns_from_the_first_row_has_no_static_force_and_no_zero(
    seed: int, rpm: bool, contact: str
) -> None:
    trace = continuous(seed, rpm=rpm)
    pull = evaluate(trace, PullOptions(test=TEST, contact=contact))
    assert math.isnan(pull.static_N)
    assert pull.zero_N == 0.0
    assert not pull.problems
    assert pull.sliding_N == pytest.approx(trace.force_N[600:].mean(), rel=0.02)
    assert {p.name for p in pull.phases} <= {"running-in", "steady sliding"}


def test_a_pull_from_rest_over_a_large_zero_keeps_its_static_force_on_a_rotary_rig() -> None:
    time = np.arange(3000) / 50
    climb = np.clip((time - 4) / 2, 0, 1) * np.where(time > 6, 1 + 0.2 * np.exp(-np.maximum(time - 6, 0) / 0.5), 1.2)
    pull = evaluate(Trace("ring", time, 1.0 + climb + noise(3000)), PullOptions(test=TEST, contact="rotary"))
    assert pull.static_N == pytest.approx(1.2, abs=0.05)
    assert pull.zero_N == pytest.approx(1.0, abs=0.02)


def stroke_with_a_rest(channel: str, seed: int = 0) -> Trace:
    """A stroke of 2 N whose drive stops at two thirds of the record; the force relaxes to 1.6 N and is quiet."""
    n = 300
    time, moving = np.arange(n) / 50, np.arange(n) < 200
    slide = 2.0 + noise(n, seed, 0.03)
    force = np.where(moving, slide, 1.6 + 0.4 * np.exp(-np.maximum(time - 4, 0) / 0.05) + noise(n, seed, 1e-4))
    force[:10] = np.linspace(-1.6, 2.0, 10)
    speed = np.where(moving, 5e-3, 0.0)
    trace = Trace("stroke", time, force)
    if channel == "speed":
        return replace(trace, columns={"speed_m_s": speed})
    return replace(trace, displacement_m=np.cumsum(speed) / 50) if channel == "displacement" else trace


@pytest.mark.parametrize("begins", ["", "reversal"])
@pytest.mark.parametrize("channel", ["speed", "displacement", "force alone"])
def test_the_sliding_window_ends_where_the_drive_of_a_stroke_stops(channel: str, begins: str) -> None:
    options = PullOptions(test=TEST, begins=begins)  # type: ignore[arg-type]
    pull = evaluate(stroke_with_a_rest(channel), options)
    assert pull.window_s[1] <= 4.04
    assert pull.sliding_N + pull.zero_N == pytest.approx(2.0, abs=0.02)
    last = pull.phases[-1]
    assert (last.name, last.start_s) == ("end of the drive", pytest.approx(4.0, abs=0.06))


@pytest.mark.parametrize("noisy", [0.0, 0.1, 0.3])
def test_the_speed_of_a_noisy_tachometer_is_its_level(noisy: float) -> None:
    true = 1.68e-3
    moving = (np.arange(4000) > 500) & (np.arange(4000) < 3500)
    speed = np.where(moving, true, 0.0) + noise(4000, 3, noisy * true)
    trace = Trace(
        "tacho", np.arange(4000) / 100, np.where(moving, 1.0, 0.0) + noise(4000), columns={"speed_m_s": speed}
    )
    assert speed_level_m_s(trace) == pytest.approx(true, rel=0.01)
    ((start, end),) = of_phase(trace, "steady sliding")[-1:]
    assert end == pytest.approx(35.0, abs=0.4)
    assert start < 6.0


def test_a_first_plateau_at_one_sample_a_second_is_no_static_friction() -> None:
    """The disc goes 15 cm between two samples: its start from rest is seen by none."""
    time = np.arange(1800.0)
    force = np.where(time < 3, 0.0, 7.0 + 2.5 * np.exp(-(time - 3) / 20)) + noise(1800, 0, 0.05)
    speed = np.where(time < 3, 0.0, 0.15)
    pull = read_pull(Trace("pin", time, force, columns={"speed_m_s": speed}), test=TEST)
    assert math.isnan(pull.static_N)
    assert "no_static" in pull.flags
    assert pull.sliding_N == pytest.approx(7.0, abs=0.02)


def ladder(levels: tuple[float, ...], seed: int = 0, ramp: int = 0) -> np.ndarray:
    """A channel of 500 samples a level, with or without ramps of so many samples between the levels."""
    parts = [np.full(500, levels[0])]
    for one, other in pairwise(levels):
        parts += [np.linspace(one, other, ramp + 2)[1:-1], np.full(500, other)]
    values = np.concatenate(parts)
    return values * (1 + noise(values.size, seed, 0.005))


@pytest.mark.parametrize("ramp", [0, 20, 60])
@pytest.mark.parametrize("levels", [(1.0, 3.0, 10.0, 30.0, 100.0, 300.0), (5.0, 6.0, 7.0, 8.0, 9.0), (4.0, 2.0)])
def test_every_level_of_a_ladder_is_told_from_the_next(levels: tuple[float, ...], ramp: int) -> None:
    found = level_cuts(ladder(levels, ramp=ramp))
    begins = [500 + k * (500 + ramp) for k in range(len(levels) - 1)]
    assert [a for a, _ in found] == pytest.approx(begins, abs=5)
    assert [b for _, b in found] == pytest.approx([a + ramp for a in begins], abs=5)


def test_a_ladder_of_speeds_slides_on_at_its_slowest_level() -> None:
    speed = 1e-3 * ladder((300.0, 30.0, 3.0, 1.0))
    trace = Trace("ladder", np.arange(speed.size) / 10, 1.0 + noise(speed.size), columns={"speed_m_s": speed})
    steady = [p for p in phases_of(trace) if p.name == "steady sliding"]
    assert [p.speed_m_s for p in steady] == pytest.approx([0.3, 0.03, 3e-3, 1e-3], rel=0.01)


def test_a_step_of_speed_is_seen_in_the_displacement_alone() -> None:
    time = np.arange(4000) / 10
    x = np.where(time < 200, 1e-6 * time, 2e-4 + 3e-6 * (time - 200)) + noise(4000, 0, 1e-7)
    force = np.where(time < 200, 10.0, 10.5 + 0.5 * np.exp(-(time - 200) / 10))
    names = [p.name for p in phases_of(Trace("gouge", time, force + noise(4000), displacement_m=x))]
    assert names == ["steady sliding", "step of speed", "steady sliding"]


@pytest.mark.parametrize("ramp_s", [0.0, 1.0])
def test_a_step_of_speed_lies_within_a_sample_of_where_a_noisy_displacement_bends(ramp_s: float) -> None:
    time = np.arange(3000) / 20
    v = 1e-6 * np.interp(time, [80.0, 80.0 + max(ramp_s, 1e-9)], [1.0, 3.0])
    x = np.cumsum(v) / 20 + noise(3000, 5, 2e-8)
    ((start, end),) = of_phase(Trace("steps", time, 4.0 + noise(3000, 6), x), "step of speed")
    assert start == pytest.approx(80.0, abs=0.1)
    assert end == pytest.approx(80.0 + ramp_s, abs=0.1)


def test_a_rough_force_has_no_quiet_end_and_a_force_that_stops_being_rough_has_one() -> None:
    rough = 2.0 + noise(500, 1, 0.02)
    assert quiet_end(rough) == 500
    assert quiet_end(np.concatenate([rough, np.full(100, 1.7)])) == pytest.approx(500, abs=2)


def real(folder: str, name: str, **columns: str) -> list[Trace]:
    (file,) = sorted((REAL / folder).glob(name))
    return read_blocks(file, columns=columns or None)


@at_hand
@pytest.mark.parametrize("name", ["014*", "018*"])
def test_no_step_of_the_rotary_rig_that_never_rests_has_a_static_force_or_a_zero(name: str) -> None:
    pulls: list[Pull] = [read_pull(trace, test=TEST) for trace in real("rotary-plastics-down", name)]
    assert len(pulls) == 4
    assert all(math.isnan(p.static_N) and p.zero_N == 0.0 for p in pulls)


@at_hand
@pytest.mark.parametrize("name", ["*_001.csv", "*_050.csv", "*_100.csv"])
def test_the_window_over_an_alloy_stroke_ends_before_its_force_relaxes(name: str) -> None:
    """By the columns: the force of every stroke leaves its level at 1.4 to 1.55 s and is constant from 1.7 s on."""
    for piece, options in pieces_of(real("alloy-reciprocating", name)).values():
        assert evaluate(piece, replace(options, test=TEST)).window_s[1] < 1.6


@at_hand
def test_the_velocity_step_in_gouge_is_where_the_displacement_bends() -> None:
    stated = {
        "time": "Time(s)", "force": "Friction [N]", "displacement": "Displ(microns) [um]",
        "normal_force": "Effective_Normal_stress(MPa) [N]",
    }  # fmt: skip
    (trace,) = real("velocity-step-gouge", "*.txt", **stated)
    ((start, end),) = of_phase(trace, "step of speed")
    assert 21300 < start < end < 21330


def test_a_force_that_climbs_over_metres_of_sliding_has_no_static_peak() -> None:
    """Running-in from 10 to 27 N within 200 s at 0.15 m/s: thirty metres before the first maximum."""
    time = np.arange(0, 1800, 0.5)
    force = np.where(time < 10, 0.0, 27.0 - 17.0 * np.exp(-(time - 10) / 60)) * np.minimum(np.maximum(time - 10, 0), 1)
    speed = np.where(time < 10, 0.0, 0.15)
    pull = read_pull(Trace("pin", time, force + noise(time.size, 0, 0.1), columns={"speed_m_s": speed}), test=TEST)
    assert math.isnan(pull.static_N)
    assert pull.sliding_N == pytest.approx(27.0, abs=0.1)


def test_two_speeds_of_one_displacement_are_two_pieces_and_a_little_faster_is_one() -> None:
    time = np.arange(4000) / 10
    for ratio, pieces in ((3.0, 2), (1.2, 1)):
        x = np.where(time < 200, 1e-6 * time, 2e-4 + ratio * 1e-6 * (time - 200)) + noise(4000, 0, 1e-7)
        assert len(split_pulls(Trace("gouge", time, 10.0 + noise(4000), displacement_m=x))) == pieces


def test_a_hold_that_only_a_displacement_tells_parts_no_slide() -> None:
    time = np.arange(12000) / 50
    x = np.cumsum(np.where(time % 120 < 40, 1e-3, 0.0)) / 50 + noise(12000, 3, 1e-6)
    force = np.where(time % 120 < 40, 3.0, 2.6) + noise(12000, 4)
    assert len(split_pulls(Trace("holds", time, force, displacement_m=x))) == 1


def rough(size: int, seed: int) -> np.ndarray:
    """Noise of unit size, correlated over four samples, as bodies that slide make it."""
    return np.asarray(lfilter([0.6], [1.0, -0.8], np.random.default_rng(seed).standard_normal(size + 200))[200:])


def test_a_force_that_is_rough_by_four_per_cent_has_no_stops_and_no_static_force_of_a_restart() -> None:
    time = np.arange(1500) / 50
    force = np.clip((time - 3.0) / 1.6, 0.0, 1.0) * np.where(time > 4.6, 1.5 + 0.5 * np.exp(-(time - 4.6) / 0.2), 2.0)
    for seed in range(16):
        trace = Trace("rough", time, force * (1.0 + 0.04 * rough(1500, seed)) + noise(1500, seed, 0.003))
        assert not read_pull(trace).restarts


def test_a_level_as_rough_as_a_slide_before_the_force_climbs_is_no_rest() -> None:
    time = np.arange(2000) / 25
    force = np.where(time < 20, 1.3, np.where(time < 45, 1.8, 2.1))
    slides = Trace("ladder", time, force * (1.0 + 0.02 * rough(2000, 1)) + noise(2000, 2, 0.003))
    assert math.isnan(read_pull(slides, test=TEST).static_N)
    assert math.isfinite(read_pull(replace(slides, force_N=force + noise(2000, 2, 0.02)), test=TEST).static_N)


def test_noise_of_a_tachometer_at_rest_is_no_stroke() -> None:
    moving = (np.arange(3600) > 150) & (np.arange(3600) < 3170)
    speed = np.where(moving, 3e-4, 0.0) + noise(3600, 6, 7e-6)
    trace = Trace("tacho", np.arange(3600) / 50, np.where(moving, 0.6, 0.0) + noise(3600), columns={"speed_m_s": speed})
    names = [p.name for p in phases_of(trace)]
    assert "stroke" not in names
    assert names[-1] == "end of the drive"


def test_load_and_lift_off_are_placed_where_the_load_begins_to_rise_and_has_fallen() -> None:
    time = np.arange(3000) / 50
    load = np.interp(time, [0, 10, 13, 40, 42, 60], [0, 0, 5, 5, 0, 0]) + noise(3000, 0, 0.02)
    speed = np.where(time < 38, 0.02, 0.0)
    force = np.where(time < 38, 0.3 * load, 0.1 * load) + noise(3000, 1, 0.01)
    trace = Trace("rig", time, force, columns={"normal_force_N": load, "speed_m_s": speed})
    found = {p.name: (p.start_s, p.end_s) for p in phases_of(trace)}
    assert found["approach"] == pytest.approx((0, 10), abs=0.15)
    assert found["loading"] == pytest.approx((10, 13), abs=0.15)
    assert found["end of the drive"] == pytest.approx((38, 40), abs=0.1)
    assert found["unloading"] == pytest.approx((40, 42), abs=0.15)
    assert found["lift-off"] == pytest.approx((42, 59.98), abs=0.15)


def test_a_phase_says_what_is_doubtful_about_it() -> None:
    """Rows from 30 to 34 s are lost; the end of the drive is told by the force alone, or by the speed."""
    force = np.concatenate([2.0 + noise(3000, 1, 0.02), np.full(500, 1.7)])
    time = np.arange(3500) / 50
    kept = (time < 30) | (time > 34)
    alone = Trace("slide", time[kept], force[kept])
    told = replace(alone, columns={"speed_m_s": np.where(time[kept] < 60, 1e-3, 0.0)})
    sliding, end = phases_of(alone)
    assert sliding.doubt == "rows are missing in it, for up to 4.04 s"
    assert end.doubt == "only the force tells of it"
    assert phases_of(told)[-1].doubt == ""


def test_the_speed_of_a_phase_comes_from_the_displacement_where_no_speed_was_recorded() -> None:
    time = np.arange(4000) / 10
    x = np.where(time < 200, 1e-6 * time, 2e-4 + 3e-6 * (time - 200))
    found = phases_of(Trace("gouge", time, 10.0 + noise(4000), displacement_m=x))
    assert [p.speed_m_s for p in (found[0], found[-1])] == pytest.approx([1e-6, 3e-6], rel=1e-3)


def test_the_static_force_of_a_ladder_read_as_one_is_that_of_its_start() -> None:
    time = np.arange(6000) / 50
    load = np.interp(time, [0, 30, 31, 60, 61, 90, 91, 120], [1, 1, 2, 2, 3, 3, 4, 4])
    force = load * np.clip((time - 5) / 2, 0, 1) * np.where((time > 6.5) & (time < 7.2), 1.1, 1.0)
    trace = Trace("ladder", time, force + noise(6000), columns={"normal_force_N": load + noise(6000, 1)})
    pull = read_pull(trace, test=TEST)
    assert not pull.static_N > 1.2
    assert "rise" not in [p.name for p in pull.phases if p.start_s > 10]


def test_the_dead_time_at_the_end_of_each_stroke_is_a_hold_and_no_sliding_where_only_the_force_tells() -> None:
    """Strokes of 2 N for 4 s; then the drive waits 2 s, the force relaxes to 1.6 N and is quiet."""
    slide = [2.0 + noise(200, k, 0.03) for k in range(6)]
    waits = 1.6 + 0.4 * np.exp(-np.arange(100) / 3)
    force = np.concatenate([(-1) ** k * np.concatenate([one, waits]) for k, one in enumerate(slide)]) + noise(
        1800, 9, 1e-4
    )
    record = Trace("rig", np.arange(1800) / 50, force)
    assert [p.name for p in phases_of(record)].count("hold") == 5
    assert {p.cycle for p in phases_of(record) if p.name == "stroke"} == {1, 2, 3}
    for piece, options in pieces_of(record).values():
        pull = evaluate(piece, replace(options, test=TEST))
        assert pull.window_s[1] - piece.time_s[0] <= 4.1
        assert pull.sliding_N == pytest.approx(2.0, abs=0.03)


def any_channel(rng: np.random.Generator, n: int) -> np.ndarray:
    """Nothing, one value, noise, a walk, a step, a wave, a coarse resolution or one impulse, at any scale."""
    k = np.arange(n)
    shapes = [
        np.zeros(n), np.full(n, rng.normal()), rng.standard_normal(n), np.cumsum(rng.standard_normal(n)),
        np.where(k < rng.integers(n), 0.0, rng.normal()), np.sin(k / rng.uniform(1, 50)),
        np.repeat(rng.standard_normal(n // 5 + 1), 5)[:n], np.where(k == rng.integers(n), 1.0, 0.0),
    ]  # fmt: skip
    return np.asarray(shapes[rng.integers(len(shapes))] * 10 ** rng.uniform(-6, 3))


@pytest.mark.parametrize("seed", range(8))
def test_the_phases_of_any_record_follow_each_other_from_its_first_sample_to_its_last(seed: int) -> None:
    rng = np.random.default_rng(seed)
    for _ in range(40):
        n = int(rng.choice([20, 25, 40, 100, 300]))
        columns = {c: any_channel(rng, n) for c in ("speed_m_s", "normal_force_N") if rng.random() < 0.5}
        x = any_channel(rng, n) if rng.random() < 0.5 else None
        found = phases_of(Trace("any", np.arange(n) / 10, any_channel(rng, n), x, columns))
        assert (found[0].start_s, found[-1].end_s) == (0.0, (n - 1) / 10)
        assert all(one.end_s == other.start_s for one, other in pairwise(found))
        assert all(phase.end_s > phase.start_s and phase.name in PHASES for phase in found)


def test_a_pull_that_begins_below_zero_is_no_stroke() -> None:
    time = np.arange(1000) / 50
    force = np.interp(time, [0, 3, 5, 5.5, 20], [-1.0, -1.0, 1.0, 0.5, 0.5]) + noise(1000)
    assert [p.name for p in phases_of(Trace("pull", time, force))] == ["rest", "rise", "slip", "steady sliding"]


def slid_and_held(holds: tuple[int, ...], seed: int, *, rough: float, still: float) -> Trace:
    """A sled at 50 Hz that rests, slides for 1000 samples and is held, again and again; force 5, held 3.7 N."""
    rng = np.random.default_rng(seed)
    parts = [still * rng.standard_normal(250)]
    for hold in (*holds, 0):
        slide = 5.0 + rough * lfilter([1.0], [1.0, -0.5], rng.standard_normal(1000))
        slide[:40] += 0.8 * np.exp(-np.arange(40) / 8.0)
        rise = np.linspace(0.0, 1.0, 6) if len(parts) == 1 else np.array([0.8, 1.0])  # as steep, by one spring
        slide[: rise.size] *= rise
        parts += [slide, 3.7 + 1.3 * np.exp(-np.arange(hold) / 30.0) + still * rng.standard_normal(hold)]
    force = np.concatenate(parts)
    return Trace("held", np.arange(force.size) / 50.0, force)


def test_every_hold_of_a_slide_is_placed_within_ten_samples_by_its_force_the_shortest_too() -> None:
    holds = (150, 400, 1600, 6000)
    begins = np.cumsum([250, *(1000 + hold for hold in holds)])[:-1] / 50.0 + 20.0
    for seed in range(12):
        rough, still = ((0.02, 0.01), (0.05, 0.001))[seed % 2]
        found = of_phase(slid_and_held(holds, seed, rough=rough, still=still), "hold")
        assert [a for a, _ in found] == pytest.approx(begins.tolist(), abs=0.2), seed
        assert [b for _, b in found] == pytest.approx((begins + np.array(holds) / 50.0).tolist(), abs=0.2), seed


def test_the_window_of_a_pull_ends_within_ten_samples_of_where_the_force_begins_to_relax() -> None:
    """The force falls by a tenth, with a time constant of half a second, and the load is taken off later."""
    for seed in range(12):
        rng = np.random.default_rng(seed)
        slide = 2.0 + 0.04 * lfilter([1.0], [1.0, -0.6], rng.standard_normal(2200))
        slide[:8] *= np.linspace(0.0, 1.0, 8)
        relaxed = 1.8 + 0.2 * np.exp(-np.arange(350) / 25.0)
        force = np.concatenate((np.zeros(600), slide, relaxed, np.zeros(280))) + 0.003 * rng.standard_normal(3430)
        pull = read_pull(Trace("p", np.arange(3430) / 50.0, force))
        assert pull.window_s[1] == pytest.approx(2800 / 50.0, abs=0.2), seed
