"""What a spoiled trace gets: a named problem, and nothing for a healthy one."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from tribo import read_pull
from tribo.errors import TraceError
from tribo.records import Trace
from tribo.traces import RULES, read_pulls, split_pulls
from tribo.traces.evaluation import _gap_at as gap_at
from tribo.traces.signal import _beyond_chance as beyond_chance

from .synthetic import Shape, with_samples

SHAPE = Shape(noise_N=0.01)


def kind_of(trace: Trace) -> str:
    with pytest.raises(TraceError) as fault:
        read_pull(trace)
    return fault.value.problems[0].kind


def test_a_pull_against_the_sign_is_named() -> None:
    trace = SHAPE.trace()
    assert kind_of(replace(trace, force_N=-trace.force_N)) == "sign_flipped"


@pytest.mark.parametrize("end_s", [1.0, 1.9, 2.5, 3.2])
def test_a_record_that_ends_before_the_peak_is_named(end_s: float) -> None:
    trace = SHAPE.trace()
    kept = trace.time_s < end_s
    assert kind_of(Trace("short", trace.time_s[kept], trace.force_N[kept])) == "stopped_before_peak"


@pytest.mark.parametrize("left", [1.0, 0.2, 0.02, 0.0])
def test_a_record_without_a_force_after_its_peak_is_doubted(left: float) -> None:
    trace = SHAPE.trace()
    after = trace.time_s > trace.time_s[int(np.argmax(trace.force_N))]
    pull = read_pull(replace(trace, force_N=np.where(after, left * trace.force_N, trace.force_N)))
    assert ("force_gone" in pull.flags) is ("force_gone" in {p.kind for p in pull.problems}) is (left < 0.05)


@pytest.mark.parametrize("share", [0.9, 0.7, 0.5])
def test_a_clipped_peak_is_named_with_its_row(share: float) -> None:
    trace = SHAPE.trace()
    clipped = replace(trace, force_N=np.minimum(trace.force_N, share * 2.0), file="a.csv")
    first = int(np.argmax(clipped.force_N))
    with pytest.raises(TraceError) as fault:
        read_pull(clipped)
    (problem,) = fault.value.problems
    assert (problem.kind, problem.file) == ("saturated", "a.csv")
    assert first < problem.row <= first + 4  # noise may part the first samples at the limit from the rest


@pytest.mark.parametrize(("first", "run"), [(250, 40), (400, 375), (150, 25)])
def test_a_sensor_that_repeats_one_value_is_named_with_its_row(first: int, run: int) -> None:
    trace = SHAPE.trace()
    force = trace.force_N.copy()
    force[first : first + run] = force[first]
    with pytest.raises(TraceError) as fault:
        read_pull(replace(trace, force_N=force, first_row=4))
    assert [(p.kind, p.row) for p in fault.value.problems] == [("stuck", 4 + first)]


def test_a_zero_band_and_a_trace_without_noise_are_not_stuck() -> None:
    trace = SHAPE.trace()
    band = replace(trace, force_N=np.where(trace.time_s < 2.0, 0.0, trace.force_N))
    assert np.isfinite(read_pull(band).static_N)
    made = Shape().trace()
    assert (np.diff(made.force_N[-200:]) == 0).all()
    assert np.isfinite(read_pull(made).static_N)


def test_a_coarse_resolution_is_not_taken_for_clipping() -> None:
    for step in (0.01, 0.05, 0.1):
        for shape in (SHAPE, Shape(sliding_N=2.0, noise_N=0.01)):
            trace = shape.trace()
            coarse = replace(trace, force_N=np.round(trace.force_N / step) * step)
            assert np.isfinite(read_pull(coarse).static_N)


def test_gaps_and_time_that_runs_back_are_all_listed() -> None:
    trace = SHAPE.trace()
    time = trace.time_s.copy()
    time[300:] -= 2.0
    force = trace.force_N.copy()
    force[100:104] = np.nan
    with pytest.raises(TraceError) as fault:
        read_pull(replace(trace, time_s=time, force_N=force))
    assert [(p.kind, p.row) for p in fault.value.problems] == [("nan_gap", 101), ("time_goes_back", 301)]


@pytest.mark.parametrize("samples", [0, 1, 2, 19])
def test_too_few_samples_are_named(samples: int) -> None:
    trace = SHAPE.trace()
    assert kind_of(Trace("few", trace.time_s[:samples], trace.force_N[:samples])) == "too_short"


@pytest.mark.parametrize(
    "force", [np.zeros(300), np.full(300, 2.0), 0.01 * np.random.default_rng(0).standard_normal(300)]
)
def test_a_force_that_never_rises_holds_no_pull(force: np.ndarray) -> None:
    assert kind_of(Trace("flat", np.arange(300) / 50, force)) in ("stopped_before_peak", "saturated")


@pytest.mark.parametrize("index", [5, 120, 174, 175, 176, 400])
@pytest.mark.parametrize("height", [0.5, 3.0, -3.0, 60.0])
def test_an_impulse_is_listed_with_its_row_and_does_not_take_the_peak(index: int, height: float) -> None:
    trace = SHAPE.trace()
    spiked = replace(with_samples(trace, {index: trace.force_N[index] + height}), first_row=8)
    pull = read_pull(spiked)
    assert [(p.kind, p.row) for p in pull.problems] == [("spike", index + 8)]
    assert "spike" in pull.flags
    assert pull.static_N == pytest.approx(2.0, rel=0.01)


def test_two_spiked_neighbours_and_several_impulses_are_listed() -> None:
    trace = with_samples(SHAPE.trace(), {100: 9.0, 101: 8.5, 300: -4.0, 500: 12.0})
    pull = read_pull(trace)
    assert [p.row for p in pull.problems] == [101, 102, 301, 501]
    assert pull.static_N == pytest.approx(2.0, rel=0.01)
    assert pull.sliding_N == pytest.approx(1.2, rel=0.01)


def test_an_impulse_of_three_samples_on_the_peak_does_not_take_it() -> None:
    trace = SHAPE.trace()
    pull = read_pull(with_samples(trace, {k: trace.force_N[k] + 1.0 for k in (170, 171, 172)}))
    assert [p.row for p in pull.problems] == [171, 172, 173]
    assert pull.static_N == pytest.approx(2.0, rel=0.01)


def test_a_peak_that_one_sample_saw_is_no_spike() -> None:
    force = np.concatenate([np.zeros(50), [2.0], np.full(200, 1.2)]) + 0.01 * np.random.default_rng(0).standard_normal(
        251
    )
    pull = read_pull(Trace("fast", np.arange(251) / 10, force))
    assert pull.problems == ()
    assert pull.static_N + 2 * pull.static_u_N > 1.95


def test_a_gap_beside_the_peak_is_flagged_and_counted_in_its_uncertainty() -> None:
    trace = SHAPE.trace()
    kept = (trace.time_s < 3.3) | (trace.time_s > 3.55)
    pull = read_pull(Trace("gap", trace.time_s[kept], trace.force_N[kept]))
    assert "gap_at_peak" in pull.flags
    assert abs(pull.static_N - 2.0) < 3 * pull.static_u_N


@pytest.mark.parametrize(("apart", "listed"), [(5, 0), (6, 2)])
def test_impulses_with_four_quiet_samples_between_them_are_impulses_and_closer_ones_are_a_swing(
    apart: int, listed: int
) -> None:
    trace = SHAPE.trace()
    spiked = with_samples(trace, {k: trace.force_N[k] + 0.5 for k in (500, 500 + apart)})
    assert len(read_pull(spiked).problems) == listed


@pytest.mark.parametrize(
    ("spikes", "listed", "last"), [(20, 20, "left out"), (21, 21, "1 more spike"), (25, 21, "5 more")]
)
def test_twenty_impulses_are_listed_one_by_one_and_the_rest_is_counted(spikes: int, listed: int, last: str) -> None:
    trace = SHAPE.trace()
    at = [300 + 15 * k for k in range(spikes)]
    problems = read_pull(with_samples(trace, {k: trace.force_N[k] + 5.0 for k in at})).problems
    assert len(problems) == listed
    assert last in str(problems[-1])
    assert problems[-1].row == at[listed - 1] + 1
    assert ("more" in str(problems[-1])) == (spikes > 20)


@pytest.mark.parametrize(("step_s", "is_gap"), [(3.8, False), (3.9, True)])
def test_a_gap_is_longer_than_three_mean_steps_of_the_record(step_s: float, is_gap: bool) -> None:
    """Nine steps of a second and one of g: the mean is (9 + g)/10 s, three times that is g at 3.86 s."""
    time = np.concatenate([np.arange(6.0), 5.0 + step_s + np.arange(5.0)])
    assert gap_at(time, 5.0 + step_s / 2) == is_gap
    assert not gap_at(time, 2.5)
    assert not gap_at(time, -1.0)
    assert not gap_at(time, 99.0)


def test_a_sharp_apex_and_stick_slip_are_no_spikes() -> None:
    for shape in (Shape(fall_s=0.005), Shape(rise_s=0.1, noise_N=0.01), Shape(swing_N=1.0, swing_s=0.2, noise_N=0.01)):
        for seed in range(10):
            assert read_pull(shape.trace(seed)).problems == ()


finite = st.floats(-1e6, 1e6)


@settings(max_examples=60, deadline=None)
@given(
    force=st.one_of(
        st.lists(finite, min_size=20, max_size=300),
        st.lists(st.sampled_from([0.0, 1.0, -1.0, 2.5]), min_size=20, max_size=300),
    ),
    even=st.booleans(),
)
def test_any_numbers_give_a_pull_or_a_named_problem(force: list[float], even: bool) -> None:
    n = len(force)
    time = np.arange(n) / 10 if even else np.sort(np.random.default_rng(n).random(n))
    trace = Trace("any", time, np.array(force), displacement_m=np.linspace(0, 0.01, n))
    for rule in RULES:
        with suppress(TraceError):
            pull = read_pull(trace, rule=rule)
            assert np.isfinite(pull.static_N) or "no_static" in pull.flags
            assert not pull.static_u_N < 0


@settings(max_examples=60, deadline=None)
@given(st.lists(st.sampled_from([0.0, 1.0, -1.0, 2.5, 2.6, -0.9]), min_size=20, max_size=400))
def test_any_record_is_cut_into_pieces_in_order(force: list[float]) -> None:
    record = Trace(
        "any", np.arange(len(force)) / 10, np.array(force), columns={"normal_force_N": np.array(force[::-1])}
    )
    starts = [piece.time_s[0] for piece in split_pulls(record)]
    assert starts == sorted(starts)
    with suppress(TraceError):
        read_pulls(record)


def test_a_record_whose_force_never_changes_is_a_dead_load_cell_and_not_steady_sliding() -> None:
    trace = SHAPE.trace()
    for force in (0.01, 2.0, -1.0):
        with pytest.raises(TraceError) as faults:
            read_pull(replace(trace, force_N=np.full(trace.force_N.size, force)))
        assert {p.kind for p in faults.value.problems} & {"stuck", "saturated", "stopped_before_peak"}


@pytest.mark.parametrize(("run", "beyond"), [(4, False), (5, True)])
def test_a_flat_top_needs_one_more_sample_than_chance_gives(run: int, beyond: bool) -> None:
    """One pair of a hundred is equal by chance; a run of n samples is n - 1 pairs, and may begin at 1000 places."""
    pairs = np.arange(98) < 0
    assert (1000 * 0.01 ** (run - 1) <= 1e-4) == beyond
    assert beyond_chance(run, pairs, 1000) == beyond
