"""Direct evidence: the force before contact and the slope of the rise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tribo.diagnostics.direct_evidence import (
    Evidence,
    certain_evidence,
    direct_evidence,
    rise_stiffening,
    stroke_offset,
    zero_drift,
    zero_offset,
)
from tribo.diagnostics.observations import Observations, observe
from tribo.records import Ingested, Pull, Trace

from .synthetic import Design, hidden


def test_a_clean_zero_is_no_evidence() -> None:
    o = observe(hidden())
    offset, drift = zero_offset(o), zero_drift(o)
    assert offset is not None
    assert drift is not None
    assert not offset.certain
    assert not drift.certain


def test_an_offset_is_read_off_the_force_before_contact() -> None:
    offset = zero_offset(observe(hidden(("load_cell_offset", 1.0))))
    assert offset is not None
    assert offset.certain
    assert offset.interval[0] < 0.113 < offset.interval[1] + 1e-3


def test_a_wandering_zero_is_a_drift() -> None:
    o = observe(hidden(("load_cell_drift", 1.0)))
    drift = zero_drift(o)
    assert drift is not None
    assert drift.certain
    assert drift.value > 0


def test_a_force_that_creeps_before_contact_is_a_drift_where_no_clock_is_kept() -> None:
    o = observe(hidden())
    rng = np.random.default_rng(1)
    creeping = replace(
        o,
        zero_slope_N_per_s=rng.normal(0.002, 0.0005, o.n),
        conditions=replace(o.conditions, elapsed_s=np.full(o.n, np.nan)),
    )
    drift = zero_drift(creeping)
    assert drift is not None
    assert drift.certain
    assert drift.value == pytest.approx(7.2, rel=0.1)


def test_a_rise_that_stiffens_with_the_speed_shows() -> None:
    o = observe(hidden(design=Design(samples=("F", "B"), speeds_mm_s=(0.05, 0.2, 0.8))))
    flat = rise_stiffening(o)
    assert flat is not None
    assert not flat.certain
    steeper = replace(o, rise_N_per_m=o.rise_N_per_m * (o.conditions.speed_m_s / 2e-4) ** 0.08)
    shown = rise_stiffening(steeper)
    assert shown is not None
    assert shown.certain
    assert shown.value == pytest.approx(0.08, abs=0.02)


def test_the_slope_before_contact_comes_from_the_trace() -> None:
    ingested = hidden()
    time = np.linspace(0.0, 3.0, 301)
    pulls = {k: replace(p, onset_s=2.0) for k, p in ingested.pulls.items()}
    traces = {k: Trace(k, time, 0.01 * time) for k in ingested.pulls}
    o = observe(replace(ingested, traces=traces, pulls=pulls))
    assert o.zero_slope_N_per_s == pytest.approx(0.01)
    assert o.conditions.clip_N == pytest.approx(0.5 * 1.2 * 0.01)


def test_a_drift_that_rests_overnight_is_still_a_drift() -> None:
    """The zero follows the hours at the bench, not those of the clock; the offset it leaves is not one of its own."""
    o = observe(hidden(("load_cell_drift", 0.12), seed=4))
    drift = zero_drift(o)
    assert drift is not None
    assert drift.certain
    assert drift.change == pytest.approx(0.15 * 0.12, rel=0.2)


def test_the_p_value_of_an_estimate_is_two_sided_normal_times_the_contrasts() -> None:
    """1.96 standard errors have p = 0.05 (any table of the normal distribution)."""
    e = Evidence(value=-1.959964, standard_error=1.0, certain=False, unit="N")
    assert e.p_adjusted(1) == pytest.approx(0.05, rel=1e-5)
    assert e.p_adjusted(4) == pytest.approx(0.20, rel=1e-5)
    assert e.p_adjusted(40) == 1.0


def test_every_estimate_that_was_made_is_counted() -> None:
    """One offset, and drifts over the clock, over the hours at the bench and within the pulls."""
    o = observe(hidden(("load_cell_drift", 1.0)))
    rng = np.random.default_rng(1)
    evidence = direct_evidence(replace(o, zero_slope_N_per_s=rng.normal(0.0, 0.0005, o.n)))
    assert evidence["load_cell_offset"].estimates == 1
    assert evidence["load_cell_drift"].estimates == 3


def test_a_drift_includes_the_offset_that_it_leaves() -> None:
    found = {
        "load_cell_offset": Evidence(0.2, 0.01, True, "N"),
        "load_cell_drift": Evidence(0.1, 0.01, True, "N/h"),
    }
    assert list(certain_evidence(found)) == ["load_cell_drift"]
    assert list(certain_evidence(found | {"load_cell_drift": Evidence(0.1, 0.1, False, "N/h")})) == ["load_cell_offset"]


def series(**changes: object) -> Observations:
    """Twenty tests in two days, seven minutes apart, with a pause of sixteen hours after the tenth."""
    o = observe(hidden()).take(np.arange(20))
    minutes = 7.0 * np.arange(20) + np.where(np.arange(20) >= 10, 960.0, 0.0)
    quiet = replace(
        o, conditions=replace(o.conditions, elapsed_s=60.0 * minutes), noise_N=np.full(20, 0.01),
        zero_N=np.zeros(20), zero_slope_N_per_s=np.full(20, np.nan), rise_N_per_m=np.full(20, 6e3),
    )  # fmt: skip
    return replace(quiet, **changes)  # type: ignore[arg-type]


def test_an_offset_is_the_median_and_its_error_that_of_a_median() -> None:
    """1.2533 times the standard deviation over root n, the latter from the median deviation (normal distribution)."""
    zero = 0.05 + 0.001 * np.arange(-10.0, 10.0)
    zero[3] = np.nan
    known = zero[np.isfinite(zero)]
    found = zero_offset(series(zero_N=zero))
    assert found is not None
    centre = np.median(known)
    assert found.value == found.change == pytest.approx(centre)
    spread = 1.4826 * np.median(np.abs(known - centre))
    assert found.standard_error == pytest.approx(1.2533 * spread / np.sqrt(19))
    half = 1.645 * found.standard_error
    assert found.interval == pytest.approx((centre - half, centre + half))
    assert zero_offset(series(zero_N=np.array([0.1, 0.1] + [np.nan] * 18))) is None
    assert zero_offset(series(zero_N=np.array([0.1, 0.1, 0.1] + [np.nan] * 17))) is not None


@pytest.mark.parametrize(("offset", "matters"), [(0.0049, False), (0.0051, True), (-0.0051, True)])
def test_an_offset_below_half_the_noise_of_a_reading_does_not_matter(offset: float, matters: bool) -> None:
    found = zero_offset(series(zero_N=np.full(20, offset)))
    assert found is not None
    assert found.certain == matters


def test_an_offset_within_five_standard_errors_is_not_certain() -> None:
    zero = 0.1 * np.where(np.arange(20) % 2, 1.0, -1.0)
    error = 1.2533 * 1.4826 * 0.1 / np.sqrt(20)
    for times, certain in ((4.9, False), (5.1, True)):
        found = zero_offset(series(zero_N=zero + times * error))
        assert found is not None
        assert found.standard_error == pytest.approx(error)
        assert found.certain == certain


def test_where_the_noise_is_unknown_half_a_percent_of_a_weak_pull_matters() -> None:
    unknown = np.full(20, np.nan)
    o = series(noise_N=unknown)
    weak = 0.005 * float(np.exp(np.quantile(o.log_force, 0.05)))
    for offset, matters in ((0.99 * weak, False), (1.01 * weak, True)):
        found = zero_offset(series(noise_N=unknown, zero_N=np.full(20, offset)))
        assert found is not None
        assert found.certain == matters


def test_a_drift_by_the_clock_and_one_by_the_hours_at_the_bench_are_told_apart() -> None:
    """A pause counts for at most five times the usual one: the night for 35 minutes."""
    o = series()
    clock = o.conditions.elapsed_s / 3600.0
    bench = 7.0 / 60.0 * (np.arange(20) + np.where(np.arange(20) >= 10, 4.0, 0.0))
    shaken = 1e-4 * np.where(np.arange(20) % 2, 1.0, -1.0)
    for hours in (clock, bench):
        found = zero_drift(series(zero_N=0.02 * hours + shaken))
        assert found is not None
        assert found.value == pytest.approx(0.02, rel=0.02)
        assert found.change == pytest.approx(0.02 * np.ptp(hours), rel=0.02)
        assert found.certain
        assert found.estimates == 2


def test_a_drift_needs_ten_zeros_and_a_clock() -> None:
    zero = 0.02 * np.arange(20.0)
    nine, ten = (np.where(np.arange(20) < k, zero, np.nan) for k in (9, 10))
    assert zero_drift(series(zero_N=nine)) is None
    assert zero_drift(series(zero_N=ten)) is not None
    still = replace(series().conditions, elapsed_s=np.zeros(20))
    assert zero_drift(series(zero_N=zero, conditions=still)) is None


def test_a_drift_within_pulls_is_that_of_twenty_seconds() -> None:
    """The slopes before contact are per second; 2e-4 N/s over a pull of some 20 s is less than half the noise."""
    unknown = replace(series().conditions, elapsed_s=np.full(20, np.nan))
    for slope, certain in ((2.4e-4, False), (2.6e-4, True)):
        found = zero_drift(series(conditions=unknown, zero_slope_N_per_s=np.full(20, slope)))
        assert found is not None
        assert found.value == pytest.approx(3600 * slope)
        assert found.change == pytest.approx(20 * slope)
        assert found.certain == certain
        assert found.unit == "N/h"
    nine = np.where(np.arange(20) < 9, 1e-3, np.nan)
    assert zero_drift(series(conditions=unknown, zero_slope_N_per_s=nine)) is None


def test_the_stiffening_is_the_slope_of_the_logarithm_of_the_rise_on_that_of_the_speed() -> None:
    speeds = np.where(np.arange(20) % 2, 2e-4, 8e-4)
    shaken = 0.001 * np.where(np.arange(20) % 4 < 2, 1.0, -1.0)
    o = series()
    c = replace(o.conditions, speed_m_s=speeds)
    for slope, certain in ((0.018, False), (0.022, True), (-0.022, True)):
        rise = 6e3 * np.exp(slope * np.log(speeds / 4e-4) + shaken)
        found = rise_stiffening(series(conditions=c, rise_N_per_m=rise))
        assert found is not None
        assert found.value == pytest.approx(slope, abs=2e-4)
        spread = np.sqrt(np.sum((np.log(speeds) - np.log(speeds).mean()) ** 2))
        assert found.standard_error == pytest.approx(1.4826 * 0.001 / spread, rel=0.3)
        assert found.change == pytest.approx(found.value * np.log(4.0))
        assert found.certain == certain


@pytest.mark.parametrize(
    ("good", "ratio", "there"), [(9, 4.0, False), (10, 4.0, True), (10, 1.1, False), (10, 1.11, True)]
)
def test_stiffening_needs_ten_rises_at_speeds_a_tenth_of_an_e_fold_apart(good: int, ratio: float, there: bool) -> None:
    speeds = np.where(np.arange(20) % 2, 2e-4, 2e-4 * ratio)
    rise = np.where(np.arange(20) < good, 6e3, np.where(np.arange(20) % 2, np.nan, -1.0))
    c = replace(series().conditions, speed_m_s=speeds)
    assert (rise_stiffening(series(conditions=c, rise_N_per_m=rise)) is not None) == there


def test_a_p_value_has_a_least_and_is_never_above_one() -> None:
    assert Evidence(9.0, 0.1, True, "N").p_adjusted(3) == 1e-12
    assert Evidence(0.0, 1.0, False, "N").p_adjusted(1) == 1.0


def test_a_rise_that_falls_is_left_out_of_the_stiffening() -> None:
    speeds = np.where(np.arange(20) % 2, 2e-4, 8e-4)
    rise = 6e3 * np.exp(0.03 * np.log(speeds / 4e-4))
    rise[4] = -0.5
    found = rise_stiffening(series(conditions=replace(series().conditions, speed_m_s=speeds), rise_N_per_m=rise))
    assert found is not None
    assert found.value == pytest.approx(0.03, abs=0.003)


def test_strokes_that_share_a_zero_are_as_uncertain_as_that() -> None:
    def pulls(u_N: float) -> Ingested:
        each = {
            f"T{k}": Pull(f"T{k}", "r", sliding_N=2.0, zero_N=0.1 * sign, zero_u_N=u_N, flags=(way,))
            for k, (way, sign) in enumerate([("forward", 1), ("backward", -1)] * 10)
        }
        return replace(hidden(), pulls=each)

    assert stroke_offset(pulls(0.1)) is None
    sure = stroke_offset(pulls(0.01))
    assert sure is not None
    assert sure.parameters["F0"].high - sure.parameters["F0"].low == pytest.approx(2 * 1.83 * 0.01, rel=0.01)
