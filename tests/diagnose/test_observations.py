"""What the diagnosis takes from tests.csv, pulls and traces: every number, exactly."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tribo.diagnostics.observations import Observations, enough, observe
from tribo.errors import FitError
from tribo.records import Campaign, Ingested, Pattern, Pull, SetAside, Test, Trace

CIRCLES = Pattern("C", "circle", (10e-6, 10e-6), (20e-6, 20e-6))
OBLONGS = Pattern("S", "rectangle", (30e-6, 10e-6), (40e-6, 20e-6))
STAMPS = ("2026-03-02T08:30:00", "2026-03-02T09:15:30", "2026-03-03T16:00:00", "2026-03-03T17:45:00")


def row(k: int, **changes: object) -> Test:
    plain = Test(
        f"T{k}", f"raw/T{k}.csv", ("F", "C", "Sx", "Sy")[k % 4], 0.5 * (k + 1), ("F1", "C1", "S1", "S1")[k % 4],
        speed_m_s=2e-4, hold_s=10.0, started_at=STAMPS[k % 4], run_order=k + 1, operator="one",
    )  # fmt: skip
    return replace(plain, **changes)  # type: ignore[arg-type]


def pull(k: int, **changes: object) -> Pull:
    plain = Pull(
        f"T{k}", "first_peak", 2.0 + k, 0.02, 1.0 + k, 0.01, zero_N=0.1 * k, zero_u_N=0.003, onset_s=2.0, peak_s=3.0,
        window_s=(4.0, 9.0), rise_N_per_s=2.0, rise_stiffness_N_per_m=5e3, stick_slip_amplitude_N=0.2, noise_N=0.01,
    )  # fmt: skip
    return replace(plain, **changes)  # type: ignore[arg-type]


def seen(
    tests: list[Test] | None = None, pulls: dict[str, Pull] | None = None, traces: dict[str, Trace] | None = None
) -> Observations:
    tests = [row(k) for k in range(4)] if tests is None else tests
    samples = {"F": Pattern("F"), "C": CIRCLES, "Sx": OBLONGS, "Sy": OBLONGS}
    campaign = Campaign("t", Path(), 55e-6, tuple(tests), samples, pull_speed_m_s=1e-3)
    given = {t.test_id: pull(int(t.test_id[1:])) for t in tests} if pulls is None else pulls
    return observe(Ingested(campaign, traces or {}, given, (SetAside("T99", "a reason"),)))


def test_forces_are_logarithms_and_their_uncertainties_relative() -> None:
    o = seen()
    assert o.n == 4
    assert o.log_force == pytest.approx(np.log([[2.0, 1.0], [3.0, 2.0], [4.0, 3.0], [5.0, 4.0]]))
    assert o.reading == pytest.approx(np.array([[0.02 / s, 0.01 / (s - 1)] for s in (2.0, 3.0, 4.0, 5.0)]))
    assert o.zero_N == pytest.approx([0.0, 0.1, 0.2, 0.3])
    assert list(o.rise_N_per_m) == [5e3] * 4
    assert list(o.stick_slip_N) == [0.2] * 4
    assert list(o.noise_N) == [0.01] * 4
    assert o.flat == "F"


def test_an_unknown_uncertainty_counts_as_none() -> None:
    o = seen([row(0)], {"T0": pull(0, static_u_N=math.nan, sliding_u_N=math.inf)})
    assert o.reading.tolist() == [[0.0, 0.0]]


@pytest.mark.parametrize("regime", ["static_N", "sliding_N"])
@pytest.mark.parametrize("force", [0.0, -1.0, math.nan])
def test_a_test_without_a_positive_force_in_each_regime_is_set_aside_with_the_reason(regime: str, force: float) -> None:
    tests = [row(k) for k in range(4)]
    pulls = {t.test_id: pull(k) for k, t in enumerate(tests)} | {"T1": pull(1, **{regime: force})}
    o = seen(tests, pulls)
    assert o.test_ids.tolist() == ["T0", "T2", "T3"]
    assert [s.test_id for s in o.set_aside] == ["T99", "T1"]
    assert "no positive friction force" in o.set_aside[1].reason


def test_a_test_whose_pull_is_missing_is_not_there() -> None:
    o = seen([row(0), row(1)], {"T0": pull(0)})
    assert o.test_ids.tolist() == ["T0"]
    assert [s.test_id for s in o.set_aside] == ["T99"]


def test_patterns_are_known_by_area_rim_width_and_elongation_along_the_pull() -> None:
    c = seen().conditions
    assert c.area_fraction == pytest.approx([1.0, 1 - math.pi / 16, 1 - 3 / 8, 1 - 3 / 8])
    assert c.rim_per_m == pytest.approx([0.0, math.pi * 10e-6 / 400e-12, 80e-6 / 800e-12, 80e-6 / 800e-12])
    assert c.cavity_width_m == pytest.approx([0.0, 10e-6, 10e-6, 10e-6])
    assert c.elongation == pytest.approx([0.0, 0.0, math.log(3), -math.log(3)])
    assert c.nominal_area_m2 == 55e-6
    assert c.normal_load_N == pytest.approx([0.5, 1.0, 1.5, 2.0])


def test_a_recorded_direction_replaces_that_of_the_name() -> None:
    c = seen([row(2, direction="Y"), row(3, direction="x"), row(3, test_id="T4", direction="other")]).conditions
    assert c.elongation == pytest.approx([-math.log(3), math.log(3), 0.0])


def test_a_test_without_a_speed_has_that_of_the_campaign() -> None:
    assert seen([row(0, speed_m_s=None), row(1)]).conditions.speed_m_s == pytest.approx([1e-3, 2e-4])


def test_the_clock_is_in_hours_of_the_day() -> None:
    o = seen()
    assert o.clock_h == pytest.approx([8.5, 9.0 + 15 / 60 + 30 / 3600, 16.0, 17.75])
    assert np.isnan(seen([row(0, started_at="")]).clock_h).all()


def test_time_counts_in_seconds_from_the_first_test() -> None:
    hours = np.array([0.0, 0.75 + 30 / 3600, 31.5, 33.25])
    assert seen().conditions.elapsed_s == pytest.approx(3600 * hours)
    later_first = [row(2), row(0), row(1, started_at="")]
    elapsed = seen(later_first).conditions.elapsed_s
    assert elapsed[:2] == pytest.approx([31.5 * 3600, 0.0])
    assert np.isnan(elapsed[2])
    assert np.isnan(seen([row(0, started_at="some day")]).conditions.elapsed_s).all()


def test_runs_of_a_specimen_are_counted_in_the_order_of_the_series() -> None:
    orders = (7, 3, 9, 1)
    tests = [row(2, test_id=f"T{k}", run_order=order) for k, order in enumerate(orders)]
    other = row(1, test_id="T5", run_order=5)
    assert seen([*tests, other]).conditions.specimen_run.tolist() == [3, 2, 4, 1, 1]
    recorded = [replace(t, specimen_run=10 + k) for k, t in enumerate(tests)]
    assert seen(recorded).conditions.specimen_run.tolist() == [10, 11, 12, 13]
    partly = [replace(tests[0], specimen_run=4), *tests[1:]]
    assert seen(partly).conditions.specimen_run.tolist() == [3, 2, 4, 1]
    gap = [replace(tests[0], run_order=None), *tests[1:]]
    assert np.isnan(seen([replace(t, started_at="2026-03-02") for t in gap]).conditions.specimen_run).all()
    hours = (14, 11, 16, 9)
    by_time = [replace(t, started_at=f"2026-03-02T{hour:02}:00") for t, hour in zip(gap, hours, strict=True)]
    assert seen(by_time).conditions.specimen_run.tolist() == [3, 2, 4, 1]


def test_further_columns_take_part_where_every_test_has_a_value_and_they_vary() -> None:
    extra = [{"batch": "a", "lid": "on", "oven": "1"}, {"batch": "b", "lid": "on", "oven": ""}]
    tests = [row(k, covariates=extra[k], operator=("one", "two")[k]) for k in (0, 1)]
    columns = seen(tests).conditions.columns
    assert {name: list(values) for name, values in columns.items()} == {"batch": ["a", "b"], "operator": ["one", "two"]}
    days = seen([row(0), row(2)]).conditions.columns
    assert {name: list(values) for name, values in days.items()} == {"date": ["2026-03-02", "2026-03-03"]}


def rising(step_s: float, samples: int, slope_N_per_s: float = 0.0) -> Trace:
    time = step_s * np.arange(samples)
    return Trace("t", time, slope_N_per_s * time)


def test_what_sampling_cuts_off_a_peak_is_half_a_step_of_the_rise_near_it() -> None:
    """2 N/s, sampled every 0.05 s near the peak at 3 s and every second after 5 s."""
    time = np.concatenate([np.arange(0.0, 5.0, 0.05), np.arange(5.0, 30.0)])
    uneven = Trace("t", time, np.zeros_like(time))
    pulls = {"T0": pull(0), "T1": pull(1, rise_N_per_s=-2.0), "T2": pull(2, rise_N_per_s=math.nan), "T3": pull(3)}
    tests = [row(k) for k in range(4)]
    traces = {"T0": uneven, "T1": uneven, "T2": uneven, "T3": rising(1.0, 2)}
    assert seen(tests, pulls, traces).conditions.clip_N == pytest.approx([0.05, 0.0, 0.0, 0.0])


def test_what_sampling_cuts_off_is_known_at_the_end_of_a_record() -> None:
    late, early = pull(0, peak_s=99.0), pull(1, peak_s=-1.0)
    traces = {"T0": rising(0.1, 41), "T1": rising(0.1, 41)}
    found = seen([row(0), row(1)], {"T0": late, "T1": early}, traces).conditions.clip_N
    assert found == pytest.approx([0.1, 0.1])


def test_the_slope_before_contact_is_taken_up_to_a_tenth_before_the_onset() -> None:
    """A force that creeps at 0.01 N/s from 1 s on, and at 1 N/s in the last tenth before the onset at 3 s."""
    time = np.arange(1.0, 3.0, 0.05)
    creep = 0.01 * time + np.where(time >= 2.8 - 1e-9, time - 2.8, 0.0)
    found = seen([row(0)], {"T0": pull(0, onset_s=3.0)}, {"T0": Trace("t", time, creep)})
    assert found.zero_slope_N_per_s == pytest.approx([0.01])


def test_no_slope_is_taken_from_fewer_than_eight_samples() -> None:
    tests, pulls = [row(0), row(1), row(2)], {"T0": pull(0), "T1": pull(1), "T2": pull(2, onset_s=math.nan)}
    traces = {"T0": rising(0.2, 50, 0.03), "T1": rising(0.25, 50, 0.03), "T2": rising(0.1, 50)}
    found = seen(tests, pulls, traces).zero_slope_N_per_s  # nine samples before 1.8 s; eight; no onset
    assert found[:2] == pytest.approx([0.03, 0.03])
    assert np.isnan(found[2])
    traces["T1"] = rising(0.26, 50, 0.03)  # seven
    assert np.isnan(seen(tests, pulls, traces).zero_slope_N_per_s[1])


def test_a_part_of_the_tests_keeps_every_number_with_its_test() -> None:
    o = seen()
    part = o.take(np.array([False, True, False, True]))
    assert part.test_ids.tolist() == ["T1", "T3"]
    assert part.n == 2
    assert part.log_force == pytest.approx(o.log_force[[1, 3]])
    assert part.conditions.normal_load_N == pytest.approx([1.0, 2.0])
    assert part.conditions.columns["date"].tolist() == ["2026-03-02", "2026-03-03"]
    assert part.set_aside == o.set_aside


@pytest.mark.parametrize(("tests", "loads", "enough_of_it"), [(12, 2, True), (11, 2, False), (12, 1, False)])
def test_twelve_tests_at_two_loads_are_the_least(tests: int, loads: int, enough_of_it: bool) -> None:
    rows = [row(0, test_id=f"T{k}", sample="FC"[k // 2 % 2], normal_load_N=1.0 + k % loads) for k in range(tests)]
    o = seen(rows)
    if enough_of_it:
        assert enough(o) is o
        return
    with pytest.raises(FitError, match=f"{tests} tests at {loads} loads"):
        enough(o)


def test_a_hold_of_0_s_and_a_temperature_of_0_degrees_are_values_and_no_gaps() -> None:
    c = seen([row(k, hold_s=0.0 if k % 2 else 10.0, temperature_C=0.0 if k < 2 else 20.0) for k in range(4)]).conditions
    assert c.hold_s.tolist() == [10.0, 0.0, 10.0, 0.0]
    assert c.temperature_C.tolist() == [0.0, 0.0, 20.0, 20.0]
    assert not c.gaps
