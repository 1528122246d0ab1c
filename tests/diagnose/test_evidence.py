"""Direct evidence: the force before contact and the slope of the rise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tribo.diagnose.statistics.direct_evidence import (
    Evidence,
    certain_evidence,
    direct_evidence,
    rise_stiffening,
    zero_drift,
    zero_offset,
)
from tribo.diagnose.statistics.observations import observe
from tribo.records import Trace

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


def test_the_p_value_of_an_estimate_is_two_sided_normal_times_the_looks() -> None:
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
    assert evidence["load_cell_offset"].looks == 1
    assert evidence["load_cell_drift"].looks == 3


def test_a_drift_includes_the_offset_that_it_leaves() -> None:
    found = {
        "load_cell_offset": Evidence(0.2, 0.01, True, "N"),
        "load_cell_drift": Evidence(0.1, 0.01, True, "N/h"),
    }
    assert list(certain_evidence(found)) == ["load_cell_drift"]
    assert list(certain_evidence(found | {"load_cell_drift": Evidence(0.1, 0.1, False, "N/h")})) == ["load_cell_offset"]
