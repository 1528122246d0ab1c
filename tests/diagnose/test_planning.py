"""What a design can tell before anything is measured, a proposed test that is made, and the tables behind figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

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
from tribo.diagnostics.candidates import CauseCandidate, Named, weigh
from tribo.diagnostics.model import OF_PATTERNS, SPECIMEN_DRIFT, Acting, candidates, effect_of
from tribo.diagnostics.observations import enough, observe
from tribo.diagnostics.planning import (
    PAPER_LAW,
    TYPICAL,
    Finding,
    Plan,
    expected_fit,
    first_test_of,
    narrowing_pulls,
    next_test,
    next_test_of,
    settling_test,
    width_left,
)
from tribo.diagnostics.scatter import first_noise
from tribo.diagnostics.score_statistics import start_effects
from tribo.errors import FitError
from tribo.mechanisms import MECHANISMS
from tribo.records import Ingested, Test
from tribo.wording.part_sentences import next_test_sentence
from tribo.wording.verdict_sentences import worded

from .known import LAW, acting, baseline, made, setup_of
from .synthetic import SMALL, Design, hidden

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


def test_the_flat_sample_is_said_to_absorb_only_what_acts_on_a_flat_sample() -> None:
    """Where the model for the patterns may be wrong by any amount, that looks like what acts in the cavities."""
    noise = first_noise()
    sizes = np.where(np.arange(len(noise.sizes)) < SPECIMEN_DRIFT, 100.0, noise.sizes)
    campaign = hidden(design=Design(masses_g=(25.0, 90.0))).campaign
    found = by_name(plan_design(campaign, noise=replace(noise, sizes=sizes)))
    assert found["pulley_friction"].why == "absorbed"
    assert {found[name].why for name in ("suction", "edge_adhesion")} == {"hidden"}


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
    """Humidity depends on repeats only, so its detectable size falls with the square root of their number."""
    campaign = hidden(design=Design(specimens=2)).campaign
    more = replace(campaign, tests=campaign.tests * 4)
    one, four = (by_name(plan_design(c))["humidity"].amplitude for c in (campaign, more))
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


PAIR = {"suction", "normal_load_error"}
OTHERS = set(MECHANISMS) - PAIR


@cache
def campaign() -> Ingested:
    return made(acting("suction", 2.5e3), seed=4)


def with_measured(name: str, value: float, uncertainty: float) -> Ingested:
    c = campaign()
    return replace(c, campaign=replace(c.campaign, measured={name: (value, uncertainty)}))


def ranked(ingested: Ingested) -> dict[str, CauseCandidate]:
    others = {a.name for a in candidates(setup_of(ingested), LAW)} - PAIR
    return {c.name: c for c in weigh(start_effects(baseline(ingested)), others)}


def test_a_load_error_that_was_weighed_and_is_not_there_leaves_the_campaign_to_suction() -> None:
    free, weighed = ranked(campaign()), ranked(with_measured("normal_load_error", 0.0, 0.005))
    assert abs(free["normal_load_error"].gain - free["suction"].gain) < 6
    assert abs(weighed["normal_load_error"].values[0]) <= 0.015
    assert weighed["suction"].gain - weighed["normal_load_error"].gain > 10
    assert weighed["suction"].gain == pytest.approx(free["suction"].gain)


def test_a_load_error_that_was_weighed_and_is_there_wins_over_suction() -> None:
    value = float(ranked(campaign())["normal_load_error"].values[0])
    weighed = ranked(with_measured("normal_load_error", value, 0.005))
    assert weighed["normal_load_error"].values[0] == pytest.approx(value, abs=0.015)
    assert weighed["normal_load_error"].gain - weighed["suction"].gain > 10


def test_a_mechanism_that_was_removed_for_a_test_does_not_change_it() -> None:
    c = campaign().campaign
    vented = tuple(
        replace(t, covariates={"without": "suction; tilt" if k % 2 else "tilt"}) for k, t in enumerate(c.tests)
    )
    s = setup_of(replace(campaign(), campaign=replace(c, tests=vented)))
    change = effect_of(s, LAW, Acting(MECHANISMS["suction"]), np.array([8e3]))
    whole = effect_of(setup_of(campaign()), LAW, Acting(MECHANISMS["suction"]), np.array([8e3]))
    assert not change[1::2].any()
    assert change[::2] == pytest.approx(whole[::2])
    assert np.abs(change[::2]).max() > 0.1
    load = effect_of(s, LAW, Acting(MECHANISMS["normal_load_error"]), np.array([0.1]))
    assert np.all(np.abs(load[1::2]) > 0.01)
    assert "without" not in s.observations.conditions.columns


def test_a_name_that_is_no_mechanism_is_said_with_those_that_are() -> None:
    c = campaign().campaign
    vented = (replace(c.tests[0], covariates={"without": "succion"}), *c.tests[1:])
    both = replace(campaign(), campaign=replace(c, tests=vented, measured={"weight": (0.0, 1.0)}))
    with pytest.raises(FitError) as caught:
        enough(observe(both))
    assert [p.found for p in caught.value.problems] == ["succion", "weight"]
    assert "normal_load_error" in str(caught.value.problems[0].allowed)


def test_the_design_of_a_next_test_says_in_full_what_to_make() -> None:
    both = ranked(campaign())
    first, second = both["suction"], both["normal_load_error"]
    measured = next_test([first, second])
    assert measured is not None
    expected = {"measure": "normal_load_error", "parameter": "dN", "unit": "N", "uncertainty": 0.005, "hours": 0.25}
    assert measured.design == expected
    known = replace(second, acting=replace(second.acting, measured=(0.1, 0.005)))
    pulls = next_test([first, known])
    assert pulls is not None
    assert pulls.design["pulls"] == 18
    assert pulls.design["without"] == "suction" or pulls.design["normal_load_N"] > 0
    vented = set(pulls.design.get("repeat_tests", ()))
    assert vented <= {t.test_id for t in campaign().campaign.tests if t.sample == pulls.design["sample"]}


@pytest.fixture(scope="module")
def faster() -> Diagnosis:
    design = replace(SMALL, speeds_mm_s=(0.1, 0.2, 0.8))
    return examine(hidden(("velocity_dependence", 3.0), design=design), replicates=(20, 10))


def test_a_cause_without_a_rival_is_confirmed_at_values_that_were_not_measured(faster: Diagnosis) -> None:
    (cause,) = faster.verdict.causes
    assert cause.mechanism == "velocity_dependence"
    test = faster.verdict.next_test
    assert test is not None
    assert (test.separates, test.design["covariate"]) == (("velocity_dependence",), "speed_m_s")
    low, middle, high = test.design["values"]
    assert low < 1e-4 < 2e-4 < middle < 8e-4 < high
    assert 0.1 < test.expected_bits <= 1.0
    text = worded(faster.verdict)
    assert text.next_test is not None
    assert "the pull speed at 0.05, 0.4 and 1.6 mm/s" in text.next_test.text


def test_the_predicted_change_of_a_confirming_test_is_that_of_the_formula(faster: Diagnosis) -> None:
    test = faster.verdict.next_test
    assert test is not None
    a = faster.verdict.causes[0].parameters["a"].value
    low, _, high = test.design["values"]
    by_formula = (1 + a * np.log(high / 2e-4)) / (1 + a * np.log(low / 2e-4))
    assert test.design["expected_percent"] == pytest.approx(100 * (by_formula - 1), rel=1e-3)


def test_a_cause_whose_column_cannot_be_set_is_tested_by_itself(examined: Diagnosis) -> None:
    """Run-in without a rival: fresh specimens, pulled as often; nothing is parted from what was already ruled out."""
    assert [c.mechanism for c in examined.verdict.causes] == ["run_in"]
    said = worded(examined.verdict).next_test
    assert said is not None
    assert (said.kind, said.design["covariate"]) == ("vary one column", "specimen_run")
    assert said.text.startswith("Pull fresh specimens of one sample at one load")


def test_a_load_error_without_a_rival_is_measured_and_suction_is_removed() -> None:
    both = ranked(campaign())
    weighed, vented = (settling_test(both[name]) for name in ("normal_load_error", "suction"))
    assert weighed is not None
    assert vented is not None
    assert (weighed.kind, weighed.separates) == ("measure", ("normal_load_error",))
    assert (vented.kind, vented.design["without"]) == ("remove", "suction")


def named_alone(name: str, *values: float) -> CauseCandidate:
    """A mechanism in a campaign made with it."""
    c = made(acting(name, *values), seed=6)
    others = {a.name for a in candidates(setup_of(c), LAW)} - {name}
    (cause,) = weigh(start_effects(baseline(c)), others)
    return cause


def test_further_pulls_narrow_the_size_of_a_cause_and_more_of_them_narrow_it_more() -> None:
    cause = named_alone("pressure_dependent_friction", 0.3)
    loads, samples = (0.3, 3.0), ("A", "B")
    left = [width_left(cause, samples, loads, pulls) for pulls in (0, 6, 18, 72)]
    assert left[0] == 1.0
    assert left == sorted(left, reverse=True)
    assert left[-1] < 0.9


def test_a_cause_that_nothing_measures_or_removes_is_narrowed_at_loads_beyond_the_measured() -> None:
    test = settling_test(named_alone("pressure_dependent_friction", 0.3))
    assert test is not None
    assert (test.kind, test.separates) == ("pull more", ("pressure_dependent_friction",))
    low, high = test.design["normal_loads_N"]
    loads = [t.normal_load_N for t in campaign().campaign.tests]
    assert low == pytest.approx(min(loads) / 2)
    assert high == pytest.approx(max(loads) * 2)
    assert 0.0 < test.design["share_of_width"] <= 0.8
    assert "shared equally and in random order" in next_test_sentence(test)


def test_a_cause_that_pulls_of_any_number_do_not_narrow_is_tested_with_what_was_held_fixed() -> None:
    cause = named_alone("edge_adhesion", 0.1, 0.5)
    sizes = cause.fit.noise.sizes.copy()
    sizes[list(OF_PATTERNS)] = 3.0  # the model is known to be three times as wrong about patterns as it says
    test = settling_test(replace(cause, fit=replace(cause.fit, noise=replace(cause.fit.noise, sizes=sizes))))
    assert test is not None
    assert test.kind == "vary what was fixed"
    assert test.separates == ("edge_adhesion", "velocity_dependence", "contact_ageing")
    assert test.design["sample"] == "B"  # that with the longest rims of this design
    assert test.design["share_of_width"] > 0.8
    assert next_test_sentence(test).startswith("Vary the pull speed over")


@pytest.mark.parametrize(("shear", "suction", "first"), [(0.02, 8e3, "suction"), (0.4, 1e3, "velocity_dependence")])
def test_of_two_causes_the_one_that_changes_friction_most_is_tested_next(
    shear: float, suction: float, first: str
) -> None:
    speeds = replace(SMALL, speeds_mm_s=(0.1, 0.2, 0.8))
    of_speed, of_air = acting("velocity_dependence", shear), acting("suction", suction)
    c = made(lambda s: of_speed(s) + of_air(s), seed=6, design=speeds)
    names = ("suction", "velocity_dependence")
    start, causes = baseline(c), []
    for name in names:
        others = {a.name for a in candidates(setup_of(c), LAW)} - {name}
        (cause,) = weigh(start_effects(start), others)
        causes.append((cause,))
        start = cause.fit
    named = Named(start, None, tuple(causes))  # type: ignore[arg-type]
    test = next_test_of(named, "named", (), start, ())
    assert test is not None
    assert test.separates == (first,)


def test_a_specimen_that_differs_is_pulled_in_turn_with_fresh_ones() -> None:
    f = expected_fit(hidden(design=LADDER).campaign, TYPICAL, PAPER_LAW, None)
    test = first_test_of(f, "specimen B3", sample="B")
    assert next_test_sentence(test) == (
        f"Pull specimen B3 and fresh specimens of B in turn, at one load: {test.design['pulls']} pulls."
    )


def test_two_columns_that_act_together_are_varied_each_with_each() -> None:
    f = expected_fit(hidden(design=LADDER).campaign, TYPICAL, PAPER_LAW, None)
    test = first_test_of(f, "speed_m_s", "hold_s", sample="B")
    assert next_test_sentence(test) == (
        "Set the pull speed and the hold time to their lowest and highest value, each with each, in random order, "
        f"on B at one load: {test.design['pulls']} pulls."
    )


def test_the_pulls_that_are_proposed_leave_four_fifths_of_the_width_of_an_interval() -> None:
    """Counted again from the fit of all tests, the further pulls among them."""
    campaign = hidden(design=replace(LADDER, repeats=2, specimens=2, masses_g=(25.0, 90.0))).campaign

    def information(tests: Sequence[Test]) -> float:
        f = expected_fit(replace(campaign, tests=tuple(tests)), TYPICAL, PAPER_LAW, None)
        speed = f.setup.observations.conditions.speed_m_s
        course = (speed - 0.425e-3) / 0.375e-3
        return float(np.sum(f.cleared(np.repeat(course[:, None], 2, axis=1)[:, :, None])[0] ** 2))

    tests = list(campaign.tests)
    pulls = narrowing_pulls(expected_fit(campaign, TYPICAL, PAPER_LAW, None), ["speed_m_s"], "B")
    assert pulls < 72
    of_b = [t for t in tests if t.sample == "B"]
    further = [
        replace(of_b[k % len(of_b)], test_id=f"further {k}", speed_m_s=(0.05e-3, 0.425e-3, 0.8e-3)[k % 3])
        for k in range(pulls)
    ]
    assert 0.75 < np.sqrt(information(tests) / information([*tests, *further])) < 0.82


def test_the_pulls_for_a_cause_of_names_are_so_many_as_narrow_its_size() -> None:
    """Counted without the cause in the model, which would leave nothing of its column to be known better."""
    c = hidden(("covariate:operator", 3.0))
    others = {a.name for a in candidates(setup_of(c), LAW)} - {"covariate:operator"}
    (cause,) = weigh(start_effects(baseline(c)), others)
    test = settling_test(cause)
    assert test is not None
    assert test.design["covariate"] == "operator"
    assert test.design["pulls"] == narrowing_pulls(baseline(c), ["operator"])
    assert test.design["pulls"] > narrowing_pulls(cause.fit, ["operator"])
