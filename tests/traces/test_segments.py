"""Records of many pulls: cut where they should be, brought to one sign, their zero from the asymmetry of strokes."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tribo.errors import TraceError
from tribo.records import Trace
from tribo.traces import evaluate, load_of, pieces_of, read_pulls, split_pulls
from tribo.traces.cuts import reversals, steps
from tribo.traces.evaluation import _slides_on as slides_on

from .synthetic import Shape

RATE = 100.0


def reciprocating(
    strokes: int = 6, friction: float = 1.0, zero: float = 0.2, noise: float = 0.01, seed: int = 0
) -> Trace:
    """Strokes of 4 s with a static peak 20 % above sliding, the force starting from where the last stroke left it."""
    one = np.arange(int(4 * RATE)) / RATE
    load = np.minimum(-friction + 2.2 * friction * one / 0.5, 1.2 * friction)
    stroke = np.where(one < 0.5, load, friction * (1 + 0.2 * np.exp(-(one - 0.5) / 0.1)))
    force = np.concatenate([(-1) ** k * stroke for k in range(strokes)])
    time = np.arange(force.size) / RATE
    return Trace("rig", time, force + zero + noise * np.random.default_rng(seed).standard_normal(force.size))


def loaded_pulls(loads: tuple[float, ...], mu: float, tau0_A: float, seed: int = 0) -> Trace:
    """Pulls from rest under one load after another in one record: mu N + tau0 A at the peak, 60 % of it sliding."""
    rng = np.random.default_rng(seed)
    force, load, speed = [], [], []
    for n in loads:
        shape = Shape(static_N=mu * n + tau0_A, sliding_N=0.6 * (mu * n + tau0_A), rate_Hz=RATE, zero_s=3, sliding_s=10)
        time = np.arange(int(14.5 * RATE)) / RATE
        force.append(shape.force(time))
        load.append(np.full(time.size, n))
        speed.append(np.where(time < 3.0, 0.0, 2e-4))
    f, n, v = (np.concatenate(x) for x in (force, load, speed))
    noisy = f + 0.01 * rng.standard_normal(f.size)
    columns = {"normal_force_N": n + 0.005 * rng.standard_normal(n.size), "speed_m_s": v}
    return Trace("several", np.arange(f.size) / RATE, noisy, columns=columns)


def test_a_single_pull_comes_back_alone() -> None:
    trace = Shape(noise_N=0.01, swing_N=0.3).trace()
    assert split_pulls(trace) == (trace,)
    load = 1.0 + 0.01 * np.random.default_rng(1).standard_normal(trace.time_s.size)
    speed = np.where(trace.time_s < 2.0, 0.0, 2e-4)
    pulled = replace(trace, columns={"normal_force_N": load, "speed_m_s": speed})
    assert split_pulls(pulled) == (pulled,)


@pytest.mark.parametrize("zero", [0.0, 0.2, -0.5])
@pytest.mark.parametrize("strokes", [2, 3, 8])
def test_strokes_are_cut_where_the_force_passes_its_middle(strokes: int, zero: float) -> None:
    pieces = split_pulls(reciprocating(strokes, zero=zero))
    assert len(pieces) == strokes
    for k, piece in enumerate(pieces[1:], start=1):
        assert 4.0 * k < piece.time_s[0] < 4.0 * k + 0.5
    assert all(370 <= p.time_s.size <= 402 for p in pieces)


@pytest.mark.parametrize("zero", [0.0, 0.2, -0.5])
def test_the_zero_is_half_the_asymmetry_of_the_strokes(zero: float) -> None:
    strokes = pieces_of(reciprocating(zero=zero))
    assert list(strokes) == [f"1/{k}" for k in range(1, 7)]
    assert [options.turned for _, options in strokes.values()] == [False, True] * 3
    for piece, options in strokes.values():
        assert options.zero is not None
        sign = -1 if options.turned else 1
        assert sign * options.zero.force_N == pytest.approx(zero, abs=0.01)
        assert abs(sign * options.zero.force_N - zero) < 4 * options.zero.u_N
        assert float(np.median(piece.force_N)) - options.zero.force_N == pytest.approx(1.0, rel=0.02)


def test_strokes_of_both_directions_give_the_same_friction() -> None:
    pulls = read_pulls(reciprocating(zero=0.3))
    assert [p.test_id for p in pulls] == [f"rig/{k}" for k in range(1, 7)]
    assert [p.sliding_N for p in pulls] == pytest.approx([1.0] * 6, rel=0.01)
    assert [p.static_N for p in pulls] == pytest.approx([1.2] * 6, rel=0.03)
    assert [p.zero_N for p in pulls] == pytest.approx([0.3, -0.3] * 3, abs=0.01)
    assert {p.zero_rule for p in pulls} == {"strokes in both directions"}
    assert "forward" in pulls[0].flags
    assert "backward" in pulls[1].flags


def test_a_stroke_without_a_static_peak_is_read_for_its_sliding_friction_and_a_faulty_one_is_refused() -> None:
    record = reciprocating(zero=0.2)
    third = (record.time_s >= 8.0) & (record.time_s < 12.0)
    level = 1.2 + 0.01 * np.random.default_rng(9).standard_normal(record.time_s.size)
    pulls = read_pulls(replace(record, force_N=np.where(third, level, record.force_N)))
    assert [k for k, p in enumerate(pulls) if "no_static" in p.flags] == [2]
    assert pulls[2].sliding_N == pytest.approx(1.0, rel=0.04)  # the reversal at its end is part of it
    stuck = np.where(third & (record.time_s > 9.0) & (record.time_s < 11.0), record.force_N[920], record.force_N)
    with pytest.raises(TraceError) as fault:
        read_pulls(replace(record, force_N=stuck))
    assert [p.kind for p in fault.value.problems] == ["stuck"]


def test_strokes_all_one_way_have_no_zero() -> None:
    ((_, options),) = pieces_of(Shape(noise_N=0.01, offset_N=0.3).trace()).values()
    assert options.zero is None
    with pytest.raises(TraceError, match="no stroke"):
        pieces_of([])


def test_several_loads_in_one_record_give_the_law() -> None:
    loads = (0.5, 1.0, 2.0, 4.0)
    record = loaded_pulls(loads, mu=0.8, tau0_A=0.4)
    pieces = split_pulls(record)
    pulls = read_pulls(record, rule="first_peak")
    n = np.array([load_of(p)[0] for p in pieces])
    assert n == pytest.approx(loads, rel=0.01)
    mu, tau0_area = np.polyfit(n, [p.static_N for p in pulls], 1)
    assert (mu, tau0_area) == pytest.approx((0.8, 0.4), rel=0.03)
    mu, tau0_area = np.polyfit(n, [p.sliding_N for p in pulls], 1)
    assert (mu, tau0_area) == pytest.approx((0.48, 0.24), rel=0.03)


def test_a_step_of_load_while_sliding_gives_sliding_friction_without_a_static_peak() -> None:
    time = np.arange(4000) / RATE
    load = np.where(time < 10, 1.0, np.where(time < 20, 2.0, 4.0)) + 0.005 * np.sin(time)
    force = 0.5 * np.where(time < 10, 1.0, np.where(time < 20, 2.0, 4.0)) + 0.02 * np.sin(40 * time)
    pulls = read_pulls(Trace("steps", time, force, columns={"normal_force_N": load}))
    assert [p.sliding_N for p in pulls] == pytest.approx([0.5, 1.0, 2.0], rel=0.01)
    assert all(math.isnan(p.static_N) and "no_static" in p.flags for p in pulls)


def test_an_impulse_in_a_later_pull_is_listed_with_its_row_of_the_file() -> None:
    record = loaded_pulls((1.0, 2.0), mu=0.8, tau0_A=0.4)
    at = record.time_s.size - 200
    force = record.force_N.copy()
    force[at] += 5.0
    first, second = read_pulls(replace(record, force_N=force, first_row=30), rule="first_peak")
    assert first.problems == ()
    assert [(p.kind, p.row) for p in second.problems] == [("spike", 30 + at)]


def test_a_step_of_speed_cuts_and_a_start_from_rest_does_not() -> None:
    time = np.arange(3000) / RATE
    speed = np.where(time < 5, 0.0, np.where(time < 15, 1e-3, 3e-3))
    force = np.where(time < 5, 0.0, np.where(time < 15, 1.0, 1.3)) + 0.01 * np.random.default_rng(0).standard_normal(
        3000
    )
    first, second = split_pulls(Trace("speeds", time, force, columns={"speed_m_s": speed}))
    assert (first.time_s[0], second.time_s[0]) == pytest.approx((0.0, 15.0), abs=0.1)


def test_the_passage_of_a_slow_ramp_belongs_to_neither_level() -> None:
    values = np.concatenate([np.zeros(300), np.linspace(0, 10, 60), np.full(600, 10.0)])
    ((end, start),) = steps(values)
    assert 250 <= end <= 320
    assert 340 <= start <= 410


def test_scatter_drift_and_oscillation_are_no_steps() -> None:
    rng = np.random.default_rng(3)
    index = np.arange(2000)
    for values in (
        1 + 0.1 * rng.standard_normal(2000),
        1 + 0.02 * index / 2000,
        1 + 0.3 * np.sin(index / 3),
        np.full(2000, 3.0),
    ):
        assert steps(values) == []


def test_a_force_of_one_sign_is_not_reversed() -> None:
    assert reversals(Shape(noise_N=0.05).trace().force_N) == []


@pytest.mark.parametrize(("start", "drive", "slides"), [(1.0, 1.0, True), (0.2, 1.0, False), (1.0, 0.0, False)])
def test_a_piece_after_a_step_slides_on_unless_its_force_has_fallen_or_its_drive_rests(
    start: float, drive: float, slides: bool
) -> None:
    """However the force climbs later, as where the load is raised."""
    force = np.where(np.arange(400) < 100, start, 2.0)
    speed = np.where(np.arange(400) < 60, drive, 1.0)
    piece = Trace("piece", np.arange(400) / RATE, force, columns={"speed_m_s": 1e-3 * speed})
    assert slides_on(piece) == slides


def with_dwells(strokes: int = 12, offset_N: float = 0.1, unloads: bool = True) -> tuple[Trace, np.ndarray]:
    """A drive that goes 1 mm in 1 s and dwells as long; 0.3 mm stretch the rig before 2 N of friction are reached.

    While it dwells the force creeps by a tenth, other than while it slides. At the end the load is taken off.
    """
    step, rng = 0.01, np.random.default_rng(7)
    way = np.concatenate([np.linspace(0.0, 1.0, 100, endpoint=False), np.ones(100)])
    position = np.concatenate([way if k % 2 == 0 else 1.0 - way for k in range(strokes)])
    moving = np.tile(np.arange(200) < 100, strokes)
    force, stretch = np.zeros(position.size), 0.0
    for k in range(1, position.size):
        stretch = float(np.clip(stretch + position[k] - position[k - 1], -0.3, 0.3))
        force[k] = 2.0 * stretch / 0.3
    rest = np.tile(np.clip(np.arange(200) - 100, 0, None), strokes) * step
    force = force * (1.0 - 0.1 * np.minimum(rest / 0.2, 1.0)) + offset_N
    load = np.full(force.size, 5.0)
    if unloads:
        fall = np.linspace(1.0, 0.0, 100)
        still = np.full(300, position[-1]) + 0.05 * np.concatenate([np.linspace(0, 1, 100), np.ones(200)])
        position, moving = np.append(position, still), np.append(moving, np.zeros(300, bool))
        load = np.append(load, np.concatenate([5.0 * fall, np.zeros(200)]))
        force = np.append(force, np.concatenate([(force[-1] - offset_N) * fall, np.zeros(200)]) + offset_N)
    time = np.arange(force.size) * step
    noisy = force + 0.005 * rng.standard_normal(force.size)
    return Trace("rig", time, noisy, position * 1e-3, columns={"normal_force_N": load}), moving


def test_no_window_of_a_stroke_lies_over_the_dwell_at_its_end() -> None:
    trace, moving = with_dwells()
    pulls = [evaluate(piece, own) for piece, own in list(pieces_of(trace).values())[1:11]]
    assert {"forward", "backward"} <= {flag for pull in pulls for flag in pull.flags}
    for pull in pulls:
        inside = (trace.time_s >= pull.window_s[0]) & (trace.time_s <= pull.window_s[1])
        assert np.count_nonzero(~moving[inside]) <= 5  # a speed by displacement is a mean over so many samples
        assert pull.sliding_N == pytest.approx(2.0, rel=0.01)
        assert abs(pull.zero_N) == pytest.approx(0.1, abs=0.02)


def test_a_dead_time_at_the_end_of_a_stroke_is_no_piece_of_its_own() -> None:
    """Four strokes of 300 samples with 100 at rest between them; the force keeps its sign until the next one moves."""
    speed, force = [], []
    for k in range(4):
        way = 1.0 if k % 2 == 0 else -1.0
        speed += [way * 1e-3] * 300 + [0.0] * 100
        force += ([-0.8 * way * 2.0] * 2 if k else []) + [way * 2.0] * (298 if k else 300) + [0.8 * way * 2.0] * 100
    noise = 0.01 * np.random.default_rng(5).standard_normal(1600)
    record = Trace("r", np.arange(1600) / 50.0, np.array(force) + noise, columns={"speed_m_s": np.array(speed)})
    pieces = split_pulls(record)
    assert len(pieces) == 4
    for piece in pieces:
        assert np.count_nonzero(piece.columns["speed_m_s"]) >= 298


def test_a_stretch_that_moves_without_load_is_no_pull_and_keeps_its_number() -> None:
    """The drive turns, the load comes after 15 s, and both end after 60 s; the torque goes on drifting."""
    time = np.arange(900) / 10.0
    turns, loaded = time < 60.0, (time > 15.0) & (time < 60.0)
    noise = 0.002 * np.random.default_rng(6).standard_normal((2, 900))
    load = np.where(loaded, 5.0, -0.13) + noise[0]
    force = np.where(turns, 0.4 - 0.01 * np.minimum(time, 15.0), -0.3) + np.where(loaded, 0.3, 0.0) + noise[1]
    record = Trace("r", time, force, columns={"normal_force_N": load, "speed_m_s": np.where(turns, 0.01, 0.0)})
    unloaded, piece = split_pulls(record)
    assert unloaded.time_s[-1] <= 15.1
    assert 15.0 <= piece.time_s[0] <= 15.3
    assert 59.7 <= piece.time_s[-1] <= 60.1
    (pull,) = read_pulls(record)
    assert pull.test_id == "r/2"


def test_a_force_that_stands_still_to_the_bit_does_not_relax() -> None:
    from tribo.traces.drive import relaxes_from

    assert relaxes_from(np.full(400, 2.0)) == 400


def test_a_rest_at_an_offset_before_a_pull_is_no_stroke_the_other_way() -> None:
    """The load cell stands at -0.3 N, the sled is drawn with 0.4 N above it."""
    rng = np.random.default_rng(8)
    rest, slide = 0.003 * rng.standard_normal(250) - 0.3, 0.012 * rng.standard_normal(1500) + 0.1
    assert reversals(np.concatenate((rest, slide))) == []
    forward_and_back = np.concatenate((0.012 * rng.standard_normal(700) - 0.3, slide))
    assert reversals(forward_and_back) == [700]
