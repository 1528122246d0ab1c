"""Every contrast of the diagnosis: its columns, written out by hand for a series of forty-eight tests."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tribo.diagnostics.contrasts import Contrast, all_contrasts, numeric_covariates
from tribo.diagnostics.model import Acting, Setup, added, setup, start_changes
from tribo.diagnostics.observations import Observations, observe
from tribo.diagnostics.predictor import tabled_predictor
from tribo.mechanisms import MECHANISMS

from .synthetic import Design, hidden

SERIES = Design(samples=("F", "B"), masses_g=(5.0, 25.0, 60.0, 138.5), specimens=3, repeats=2, missing=0.0)
OBSERVABLES = {"static": (1.0, 0.0), "sliding": (0.0, 1.0), "both": (1.0, 1.0), "drop": (1.0, -1.0)}


@cache
def observed() -> Observations:
    o = observe(hidden(seed=6, design=SERIES))
    assert o.n == 48
    batch = np.array(["a", "b", "c"] * 16)
    lamp = np.array([f"{k % 7 + 1}" for k in range(48)])
    c = replace(o.conditions, columns={"batch": batch, "lamp": lamp, "name": np.array([f"n{k}" for k in range(48)])})
    return replace(o, conditions=c)


def setup_of(o: Observations) -> Setup:
    return setup(o, tabled_predictor(o.patterns))


def contrasts(o: Observations) -> list[Contrast]:
    s = setup_of(o)
    acting, courses, _ = start_changes(s, s.first_law)
    return all_contrasts(s, s.first_law, acting, courses)


@cache
def seen() -> tuple[Contrast, ...]:
    return tuple(contrasts(observed()))


def one(kind: str, observable: str, covariate: str, sample: str = "") -> Contrast:
    (found,) = [
        c for c in seen() if (c.kind, c.observable, c.title, c.sample) == (kind, observable, covariate, sample)
    ]
    return found


def of_kind(kind: str) -> list[Contrast]:
    return [contrast for contrast in seen() if contrast.kind == kind]


@pytest.mark.parametrize("observable", OBSERVABLES)
def test_a_trend_follows_the_standardised_number_in_one_regime_both_or_their_difference(observable: str) -> None:
    order = observed().conditions.run_order
    number = (order - order.mean()) / order.std()
    found = one("trend", observable, "run_order").columns
    assert found[:, :, 0] == pytest.approx(number[:, None] * np.array(OBSERVABLES[observable]))
    assert found.shape == (48, 2, 1)


def test_numbers_that_vary_are_covariates_and_a_test_without_a_value_lies_at_the_mean() -> None:
    o = observed()
    names = set(numeric_covariates(setup_of(o)))
    recorded = {"run_order", "specimen_run", "started_at", "time of day", "temperature_C", "humidity_pct", "lamp"}
    assert names == recorded
    gap = o.conditions.temperature_C.copy()
    gap[3] = np.nan
    speeds = np.where(np.arange(48) % 2, 2e-4, 8e-4)
    changed = replace(o, conditions=replace(o.conditions, temperature_C=gap, speed_m_s=speeds, hold_s=np.zeros(48)))
    found = numeric_covariates(setup_of(changed))
    assert set(found) == recorded | {"speed_mm_s"}
    assert found["temperature_C"][3] == 0.0
    assert np.delete(found["temperature_C"], 3).std() == pytest.approx(1.0)
    assert found["speed_mm_s"] == pytest.approx(np.where(np.arange(48) % 2, -1.0, 1.0))
    assert found["lamp"].mean() == pytest.approx(0.0)
    assert found["lamp"].std() == pytest.approx(1.0)


def test_a_shape_has_six_groups_of_alike_size_less_one_and_of_few_values_one_each() -> None:
    order = observed().conditions.run_order
    columns = one("shape", "static", "run_order").columns
    assert columns.shape == (48, 2, 5)
    assert columns[:, 0].sum(axis=0).tolist() == [8.0] * 5
    group = (order - 1) // 8
    for k in range(5):
        assert columns[:, 0, k].tolist() == (group == k + 1).astype(float).tolist()
    assert not columns[:, 1].any()
    runs = observed().conditions.specimen_run
    few = replace(observed(), conditions=replace(observed().conditions, specimen_run=np.minimum(runs, 4.0)))
    (shape,) = [x for x in contrasts(few) if (x.kind, x.observable, x.covariate) == ("shape", "both", "specimen_run")]
    for k in range(3):
        assert shape.columns[:, 0, k].tolist() == (np.minimum(runs, 4.0) == k + 2).astype(float).tolist()
    assert shape.freedom == 3


def test_two_values_are_a_trend_and_have_no_shape() -> None:
    two = replace(observed().conditions, temperature_C=np.where(np.arange(48) % 2, 20.0, 25.0))
    kinds = {x.kind for x in contrasts(replace(observed(), conditions=two)) if x.covariate == "temperature_C"}
    assert kinds == {"trend"}


def test_the_levels_of_a_text_column_are_its_names_less_one() -> None:
    for observable in ("static", "sliding", "both"):
        columns = one("level", observable, "batch").columns
        assert columns.shape == (48, 2, 2)
        regime = 1 if observable == "sliding" else 0
        for k, name in enumerate("bc"):
            wanted = (observed().conditions.columns["batch"] == name).astype(float)
            assert columns[:, regime, k].tolist() == wanted.tolist()
    assert {contrast.covariate for contrast in of_kind("level")} == {"batch"}  # at most one name for eight tests


def test_up_to_one_name_for_eight_tests_makes_levels() -> None:
    for names, there in ((6, True), (7, False)):
        column = np.array([f"x{k % names}" for k in range(48)])
        c = replace(observed().conditions, columns={"who": column})
        found = [contrast for contrast in contrasts(replace(observed(), conditions=c)) if contrast.kind == "level"]
        assert bool(found) == there
        assert all(contrast.freedom == names - 1 for contrast in found)


def test_a_sample_has_an_offset_a_slope_and_a_curve_against_the_logarithm_of_pressure() -> None:
    o = observed()
    p = setup_of(o).log_pressure
    here = (o.conditions.sample == "B").astype(float)
    for covariate, shape in (
        ("sample", np.ones(48)), ("normal_load_N", p), ("normal_load_N, bend", p**2 - np.mean(p**2)),
    ):  # fmt: skip
        for observable, regimes in OBSERVABLES.items():
            found = one("sample", observable, covariate, "B").columns[:, :, 0]
            assert found == pytest.approx((here * shape)[:, None] * np.array(regimes))
    assert len(of_kind("sample")) == 2 * 4 * 3


def test_calibration_takes_up_level_and_slope_of_the_flat_sample_and_nothing_else() -> None:
    assert one("sample", "static", "sample", "F").is_taken_up("F")
    assert one("sample", "static", "normal_load_N", "F").is_taken_up("F")
    assert not one("sample", "static", "normal_load_N, bend", "F").is_taken_up("F")
    assert not one("sample", "static", "sample", "B").is_taken_up("F")
    assert not one("trend", "static", "run_order").is_taken_up("F")
    assert not replace(one("trend", "static", "run_order"), sample="F").is_taken_up("F")


def test_a_specimen_has_an_offset_in_each_regime_and_one_slope() -> None:
    o = observed()
    p = setup_of(o).log_pressure
    here = (o.conditions.specimen == "B2").astype(float)
    for observable in ("static", "sliding", "both"):
        found = one("specimen", observable, "specimen B2", "B").columns[:, :, 0]
        assert found == pytest.approx(here[:, None] * np.array(OBSERVABLES[observable]))
    slope = one("specimen", "both", "specimen B2 by load", "B").columns[:, :, 0]
    assert slope == pytest.approx((here * p)[:, None] * np.ones(2))
    assert len(of_kind("specimen")) == 6 * 4


def test_a_specimen_pulled_as_two_samples_names_both() -> None:
    both = np.where(observed().conditions.specimen == "B1", "F1", observed().conditions.specimen)
    found = contrasts(replace(observed(), conditions=replace(observed().conditions, specimen=both)))
    assert {contrast.sample for contrast in found if contrast.covariate == "specimen F1"} == {"B/F"}


def test_periods_are_harmonics_of_the_series_down_to_four_tests_and_three_of_the_day() -> None:
    o = observed()
    rank = (o.conditions.run_order - 1) / 48
    series = [contrast for contrast in of_kind("period") if contrast.covariate.startswith("run_order")]
    assert [contrast.title for contrast in series] == [f"run_order, period {48 / k:.3g}" for k in range(1, 13)]
    for k, contrast in enumerate(series, start=1):
        wave = np.column_stack([np.sin(2 * np.pi * k * rank), np.cos(2 * np.pi * k * rank)])
        assert contrast.columns[:, 0] == pytest.approx(wave)
        assert contrast.columns[:, 1] == pytest.approx(wave)
    daily = [contrast for contrast in of_kind("period") if contrast.covariate == "time of day"]
    assert len(daily) == 3
    for k, contrast in enumerate(daily, start=1):
        turns = 2 * np.pi * k * o.clock_h / 24
        assert contrast.columns[:, 0] == pytest.approx(np.column_stack([np.sin(turns), np.cos(turns)]))


def test_no_period_of_the_day_is_sought_in_two_hours_or_without_a_clock() -> None:
    for clock in (9.0 + 2.0 * np.arange(48) / 47, np.full(48, np.nan)):
        found = contrasts(replace(observed(), clock_h=clock))
        assert not [x for x in found if x.kind == "period" and x.covariate == "time of day"]


def test_no_period_of_the_series_is_sought_where_fewer_than_nineteen_orders_are_recorded() -> None:
    for orders, there in ((18, False), (19, True)):
        few = np.minimum(observed().conditions.run_order, float(orders))
        found = contrasts(replace(observed(), conditions=replace(observed().conditions, run_order=few)))
        assert any(x.kind == "period" and x.covariate.startswith("run_order") for x in found) == there


def test_stretches_are_runs_of_two_to_five_successive_tenths_of_the_series() -> None:
    order = observed().conditions.run_order
    tenth = ((order - 1) * 10) // 48
    wanted = [(a, b) for a in range(10) for b in range(a + 1, min(a + 5, 10))]
    found = of_kind("block")
    assert len(found) == len(wanted) == 30
    for (first, last), contrast in zip(wanted, found, strict=True):
        inside = (tenth >= first) & (tenth <= last)
        assert contrast.columns[:, 0, 0].tolist() == contrast.columns[:, 1, 0].tolist() == inside.astype(float).tolist()
        assert contrast.title == f"run_order, from {order[inside].min():.0f} to {order[inside].max():.0f}"


@pytest.mark.parametrize(("tests", "there"), [(29, False), (30, True)])
def test_stretches_are_sought_in_thirty_tests_or_more(tests: int, there: bool) -> None:
    found = contrasts(observed().take(np.arange(48) < tests))
    assert any(contrast.kind == "block" for contrast in found) == there


def test_an_order_that_is_not_recorded_gives_no_stretch_and_no_period() -> None:
    unknown = np.full(48, np.nan)
    found = contrasts(replace(observed(), conditions=replace(observed().conditions, run_order=unknown)))
    assert not any(x.kind == "block" or x.covariate.startswith("run_order") for x in found)


def test_every_candidate_is_a_contrast_at_what_it_changes_and_adhesion_one_at_its_share() -> None:
    s = setup_of(observed())
    candidates, courses, _ = start_changes(s, s.first_law)
    mechanisms = {(x.acting.mechanism.name, x.acting.choice): x for x in of_kind("mechanism") if x.acting is not None}
    for k, acting in enumerate(candidates):
        column = added(courses[k])[:, :, 0]
        if np.ptp(column) > 0:
            assert mechanisms[acting.mechanism.name, acting.choice].columns[:, :, 0] == pytest.approx(column)
    base, load = s.base(s.first_law), s.observations.conditions.normal_load_N
    forces = base.forces(load)
    share = np.column_stack([base.static_adhesion_N / forces.static_N, base.sliding_adhesion_N / forces.sliding_N])
    assert one("trend", "both", "tau0").columns[:, :, 0] == pytest.approx(share)
    assert all(contrast.freedom == 1 for contrast in of_kind("mechanism"))


def test_a_mechanism_that_is_present_as_a_whole_is_known_by_its_own_spread() -> None:
    (label,) = [contrast for contrast in of_kind("mechanism") if contrast.covariate == "mislabelled_specimen"][:1]
    sd = MECHANISMS["mislabelled_specimen"].choosing.all_or_nothing_sd
    assert sd is not None
    assert label.about_one == pytest.approx(1 / sd**2)
    assert replace(label, acting=Acting(MECHANISMS["suction"])).about_one == 0.0
    assert one("trend", "both", "tau0").about_one == 0.0


def test_a_contrast_that_is_not_finite_or_does_not_vary_is_none() -> None:
    assert all(np.isfinite(contrast.columns).all() and np.ptp(contrast.columns) > 0 for contrast in seen())


def test_a_sample_has_an_offset_a_slope_and_a_bend_of_its_own_tests() -> None:
    o = observed()
    log_pressure = setup_of(o).log_pressure
    for name, covariate in (("F", "normal_load_N"), ("B", "normal_load_N")):
        slope = one("sample", "static", covariate, name).columns[:, 0, 0]
        assert slope == pytest.approx(np.where(o.conditions.sample == name, log_pressure, 0.0))
        bend = one("sample", "static", f"{covariate}, bend", name).columns[:, 0, 0]
        curved = log_pressure**2 - np.mean(log_pressure**2)
        assert bend == pytest.approx(np.where(o.conditions.sample == name, curved, 0.0))
        offset = one("sample", "static", "sample", name).columns[:, 0, 0]
        assert offset.tolist() == (o.conditions.sample == name).astype(float).tolist()
