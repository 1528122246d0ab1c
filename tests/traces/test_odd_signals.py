"""Samples that no sensor gives are doubts with their size in newtons, or set aside; healthy records have none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tribo import read_pull
from tribo.errors import TraceError
from tribo.records import Trace
from tribo.traces.signal import odd_signal, wrapped

from .synthetic import Shape

LSB = 1e-4
SEEDS = (1, 2, 3)


def record(seed: int, **shape: float) -> Trace:
    """A pull to 2 N as a recorder of 0.1 mN writes it."""
    trace = Shape(noise_N=0.01, **shape).trace(seed)
    return replace(trace, force_N=np.round(trace.force_N / LSB) * LSB, file="a.csv")


def kinds(trace: Trace) -> list[str]:
    return [problem.kind for problem in odd_signal(trace)]


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize(
    "shape", [{}, {"dome_s": 0.4}, {"swing_N": 0.2}, {"fall_s": 1.0}, {"sliding_N": 2.0}, {"rate_Hz": 500.0}],
    ids=lambda shape: "_".join(shape) or "corner",
)  # fmt: skip
def test_a_healthy_record_has_no_doubt(seed: int, shape: dict[str, float]) -> None:
    trace = record(seed, **shape)
    assert kinds(trace) == []
    assert wrapped(trace.force_N) is None


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("share", [0.8, 0.9, 0.95])
@pytest.mark.parametrize("signed", [True, False])
def test_a_recorder_that_wraps_around_is_named_with_what_is_missing(seed: int, share: float, signed: bool) -> None:
    trace = record(seed)
    top = float(trace.force_N.max())
    limit = share * top
    force = np.where(trace.force_N > limit, trace.force_N - (2 if signed else 1) * limit, trace.force_N)
    found = wrapped(force)
    assert found is not None
    first, samples, range_N, beyond_N = found
    assert first == int(np.argmax(trace.force_N > limit))
    assert samples == int((trace.force_N > limit).sum())
    assert range_N == pytest.approx((2 if signed else 1) * limit, rel=0.1)
    assert beyond_N == pytest.approx(top - limit, abs=0.06)
    with pytest.raises(TraceError, match=r"the range of the recorder was exceeded.*N above the range"):
        read_pull(replace(trace, force_N=force))


def test_dropouts_and_impulses_are_no_wrap() -> None:
    for at in ([174], [175], [174, 175, 176], [300], [300, 301, 302], [170], [200, 420], list(range(300, 308))):
        for value in (0.0, -2.0, 9.0):
            force = record(4).force_N.copy()
            force[at] = value
            assert wrapped(force) is None, (at, value)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("share", [0.89, 0.75, 0.65])
def test_clipping_with_noise_of_the_last_digit_is_named_with_its_size(seed: int, share: float) -> None:
    trace = record(seed)
    limit = share * float(trace.force_N.max())
    noise = LSB * np.random.default_rng(seed).integers(-1, 2, trace.force_N.size)
    clipped = replace(trace, force_N=np.where(trace.force_N > limit, limit + noise, trace.force_N))
    (problem,) = odd_signal(clipped)
    assert problem.kind == "clipped"
    assert "N higher" in str(problem.found)
    assert "clipped" in read_pull(clipped).flags


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(("first", "last"), [(300, 340), (300, 500), (200, 675)])
def test_a_sensor_that_toggles_by_its_last_digit_is_named(seed: int, first: int, last: int) -> None:
    trace = record(seed)
    force = trace.force_N.copy()
    force[first:last] = force[first] + LSB * np.random.default_rng(seed).integers(0, 2, last - first)
    problems = odd_signal(replace(trace, force_N=force))
    assert "toggles" in [problem.kind for problem in problems]
    row = next(problem.row for problem in problems if problem.kind == "toggles")
    assert row is not None
    assert first <= row <= last


@pytest.mark.parametrize(("step", "named"), [(0.5, True), (0.1, True), (0.02, False)])
def test_steps_that_are_no_small_part_of_the_force_are_named_with_half_a_step(step: float, named: bool) -> None:
    trace = record(5)
    found = odd_signal(replace(trace, force_N=np.round(trace.force_N / step) * step))
    assert [problem.kind for problem in found] == ["coarse"] * named
    if named:
        assert f"uncertain by up to {step / 2:.2g} N" in str(found[0].found)


def test_data_points_that_are_there_twice_are_named() -> None:
    trace = record(6)
    clock = np.repeat(trace.time_s, 2) + np.tile([0.0, 0.01], trace.time_s.size)
    each = Trace("each", clock, np.repeat(trace.force_N, 2))
    assert kinds(each) == ["repeated_samples"]
    force = trace.force_N.copy()
    force[400:460] = force[300:360]
    (problem,) = odd_signal(replace(trace, force_N=force))
    assert (problem.kind, problem.row) == ("repeated_samples", trace.first_row + 400)
    assert "as 100 data points before" in str(problem.found)
