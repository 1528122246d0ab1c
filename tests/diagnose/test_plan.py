"""What a design can tell before anything is measured, and the tables behind the figures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tribo.diagnostics import (
    Diagnosis,
    contrast_table,
    examine,
    misfit_map,
    plan_design,
    residual_table,
    weighing_table,
)
from tribo.diagnostics.planning import Finding, Plan

from .synthetic import Design, hidden

LADDER = Design(speeds_mm_s=(0.05, 0.2, 0.8), holds_s=(1.0, 10.0, 300.0))


def by_name(p: Plan) -> dict[str, Finding]:
    return {f.mechanism: f for f in p.findings}


def test_one_speed_and_one_hold_show_neither_velocity_nor_ageing() -> None:
    found = by_name(plan_design(hidden().campaign))
    for name in ("velocity_dependence", "contact_ageing", "pulley_friction", "machine_compliance"):
        assert np.isnan(found[name].amplitude)
        assert found[name].why


def test_a_ladder_of_speeds_and_holds_shows_both() -> None:
    found = by_name(plan_design(hidden(design=LADDER).campaign))
    assert 0 < found["velocity_dependence"].effect_percent < 30
    assert 0 < found["contact_ageing"].amplitude < 0.05


def test_suction_is_confused_with_a_load_error_and_named_so() -> None:
    p = plan_design(hidden(design=Design()).campaign)
    assert "normal_load_error" in by_name(p)["suction"].confused_with
    assert any({"suction", "normal_load_error"} <= set(names) for names in p.tied)


def test_mechanisms_whose_effects_are_alike_in_part_only_are_not_called_confused() -> None:
    """A specimen's own pulls are counted apart from the clock, and rims are not in proportion to open area."""
    found = by_name(plan_design(hidden().campaign))
    assert found["run_in"].confused_with == ()
    assert "edge_adhesion" not in found["suction"].confused_with


def test_four_times_the_tests_find_a_trend_of_half_the_size() -> None:
    """Run-in depends on repeats only, so its detectable size falls with the square root of their number."""
    campaign = hidden(design=Design(specimens=2)).campaign
    more = replace(campaign, tests=campaign.tests * 4)
    one, four = (by_name(plan_design(c))["run_in"].amplitude for c in (campaign, more))
    assert four / one == pytest.approx(0.5, abs=0.05)


@pytest.fixture(scope="module")
def examined() -> Diagnosis:
    return examine(hidden(("run_in", 3.0)), replicates=(30, 20))


def test_the_tables_hold_every_test_and_shrink_under_the_named_cause(examined: Diagnosis) -> None:
    rows = residual_table(examined)
    assert len(rows) == 2 * examined.baseline.setup.observations.n
    assert rows["residual_extended_percent"].std() < rows["residual_percent"].std()
    percent = 100 * (rows["measured_N"] / rows["baseline_N"] - 1)
    assert percent.to_numpy() == pytest.approx(rows["residual_percent"].to_numpy())
    assert misfit_map(examined)["n_tests"].sum() == len(rows)


def test_contrasts_and_weights_are_ranked(examined: Diagnosis) -> None:
    assert contrast_table(examined)["strength"].is_monotonic_decreasing
    weighed = weighing_table(examined)
    assert weighed.iloc[0]["mechanism"] == "run_in"
    assert weighed["weight"].sum() == pytest.approx(1.0)
