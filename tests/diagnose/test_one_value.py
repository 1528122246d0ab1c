"""Causes that are bound to one value of a recorded quantity: each is named with its value, and nothing else is."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from blind.bench import Design
from blind.direct import ingested
from blind.tribometer import hide
from laboratories.campaign import both, make, multiply
from laboratories.handed_over import handed_over
from laboratories.laboratory import Laboratory, day_of
from laboratories.one_value import hide_one_value
from mechanisms.test_contract import base, conditions
from support import first_quick

from tribo.diagnostics import examine
from tribo.diagnostics.candidates import _more_than_groups_differ, judged, refitted
from tribo.diagnostics.fit import fit
from tribo.diagnostics.model import candidates, setup
from tribo.diagnostics.observations import observe
from tribo.diagnostics.predictor import tabled_predictor
from tribo.diagnostics.verdict import Verdict
from tribo.lawsearch.diagnosis_with_laws import with_laws
from tribo.mechanisms import MECHANISMS
from tribo.wording.verdict_sentences import worded

PATTERNS_OFF = Laboratory(samples=("F", "A", "B", "C"), days=6, pattern_rms=0.15)
NAMES = {
    "weight": "wrong_weight", "tare of a day": "tare_of_one_day", "area of a specimen": "area_of_one_specimen",
}  # fmt: skip


@cache
def told_of(kind: str) -> tuple[Verdict, str]:
    """The verdict on a campaign in which a cause of this kind is hidden, and the value that it is bound to."""
    lab = replace(PATTERNS_OFF, samples=("F", "B")) if kind == "weight" else PATTERNS_OFF
    made = make(10, lab, hide=hide_one_value(10, lab, kind))
    return worded(examine(handed_over(made.bench, 10), seed=10, replicates=(40, 20)).verdict), made.truth["value"]


@pytest.mark.parametrize("kind", first_quick(NAMES))
def test_the_value_that_is_off_is_named_and_no_other_cause_beside_what_cannot_be_told_from_it(kind: str) -> None:
    v, value = told_of(kind)
    right = {c.mechanism: c.choice for c in v.causes}
    assert NAMES[kind] in right
    assert f" {value.removesuffix('.0')} " in f" {right[NAMES[kind]]} "
    assert all({NAMES[kind], name} <= set(v.equivalent[0]) for name in right if name != NAMES[kind])


@pytest.mark.slow
def test_a_lot_that_moves_its_specimens_is_named_although_it_spreads_them() -> None:
    """Specimens seem to scatter by as much as the lots differ; what they scatter beside the lots is what counts."""
    made = make(4, PATTERNS_OFF, hide=hide_one_value(4, PATTERNS_OFF, "lot"))
    v = examine(handed_over(made.bench, 4), seed=4, replicates=(40, 20)).verdict
    assert [c.mechanism for c in v.causes] == ["covariate:lot"]
    assert v.causes[0].choice == f"lot is {made.truth['value']}"


@pytest.mark.parametrize(("hidden", "more"), [("factor", False), ("tare", True)])
def test_a_day_that_differs_by_a_factor_has_no_wrong_tare(hidden: str, more: bool) -> None:
    """A tare of one day explains something of a factor too. It is a cause where it explains more than a factor does."""
    bench = make(3, replace(PATTERNS_OFF, days=14)).bench
    day = day_of(bench.tests)
    here = day == min(day)
    if hidden == "factor":
        multiply(bench, np.outer(here, [0.15, 0.10]))
    else:
        bench.static, bench.sliding = bench.static + 0.15 * here, bench.sliding + 0.15 * here
    o = observe(handed_over(bench, 3))
    start = fit(setup(o, tabled_predictor(o.patterns)))
    known = candidates(start.setup, start.law)
    acting = next(a for a in known if a.name == "tare_of_one_day" and a.choice.endswith(day[here][0]))
    tare = judged(start, refitted(start, (acting,)), 0.0)
    assert tare.gain > 3.0
    assert _more_than_groups_differ(start, tare) == more


@pytest.mark.parametrize(("hidden", "more"), [("factor", False), ("area", True)])
def test_a_specimen_that_lies_far_out_has_no_other_area(hidden: str, more: bool) -> None:
    """Another area explains something of a factor too. It is a cause where it explains more than a factor does."""
    bench = make(3, PATTERNS_OFF).bench
    here = bench.column("specimen") == "F2"
    if hidden == "factor":
        multiply(bench, np.outer(here, [-0.2, -0.25]))
    else:
        multiply(bench, np.log1p(-0.5 * here[:, None] * bench.adhesion_N() / both(bench)))
    o = observe(handed_over(bench, 3))
    start = fit(setup(o, tabled_predictor(o.patterns)))
    known = candidates(start.setup, start.law)
    acting = next(a for a in known if a.name == "area_of_one_specimen" and a.choice == "F2")
    area = judged(start, refitted(start, (acting,)), 0.0)
    assert area.gain > 3.0
    assert _more_than_groups_differ(start, area) == more


@pytest.mark.parametrize(("hidden", "more"), [("patterns", False), ("weight", True)])
def test_patterns_that_the_model_describes_badly_at_one_load_have_no_wrong_weight(hidden: str, more: bool) -> None:
    """A wrong weight explains something of such patterns too. It is a cause where the flat sample shows it as well."""
    bench = make(3, PATTERNS_OFF).bench
    here = bench.column("mass_g") == 50.0
    if hidden == "patterns":
        multiply(bench, np.outer(here & (bench.column("sample") != "F"), [0.08, 0.08]))
    else:
        multiply(bench, np.log1p(0.15 * here[:, None] * (1.0 - bench.adhesion_N() / both(bench))))
    o = observe(handed_over(bench, 3))
    start = fit(setup(o, tabled_predictor(o.patterns)))
    known = candidates(start.setup, start.law)
    acting = next(a for a in known if a.name == "wrong_weight" and a.choice.startswith("mass 50"))
    weight = judged(start, refitted(start, (acting,)), 0.0)
    assert weight.gain > 6.0
    assert _more_than_groups_differ(start, weight) == more


def test_the_remedy_says_which_weight_to_weigh() -> None:
    v, value = told_of("weight")
    assert v.causes[0].text.endswith(f"Weigh the {value.removesuffix('.0')} g weight.")


def test_masses_of_two_steps_that_were_exchanged_are_two_wrong_weights_and_no_law_of_the_pressure() -> None:
    b = hide(3, [], Design(samples=("F", "A", "B"), repeats=1))
    for column in ("mass_g", "N"):
        light, heavy = (float(b.tests.loc[b.tests["mass_g"] == mass, column].iloc[0]) for mass in (25.0, 50.0))
        b.tests[column] = b.tests[column].replace({light: heavy, heavy: light})
    d = with_laws(examine(ingested(b, 3), seed=3, replicates=(40, 20)), seed=3)
    assert d.verdict.verdict == "named"
    assert {(c.mechanism, c.choice) for c in d.verdict.causes} == {
        ("wrong_weight", "mass 25 g"), ("wrong_weight", "mass 50 g"),
    }  # fmt: skip
    assert not [layer for layer in d.verdict.layers if layer.kind == "law"]
    said = worded(d.verdict).sentence
    assert "a wrong weight: mass 25 g" in said
    assert "a wrong weight (mass 50 g) by " in said


@pytest.mark.slow
def test_with_patterns_off_and_nothing_hidden_no_value_is_named() -> None:
    made = make(6, PATTERNS_OFF)
    assert examine(handed_over(made.bench, 6), seed=6, replicates=(40, 20)).verdict.causes == ()


def test_of_three_loads_no_weight_is_said_to_be_wrong() -> None:
    c = conditions()
    m, b = MECHANISMS["wrong_weight"], base(c)
    assert len(m.choices(b, c)) == 4
    three = replace(c, normal_load_N=np.where(c.normal_load_N < 0.1, 0.25, c.normal_load_N))
    assert m.choices(base(three), three) == ()


def test_a_step_is_called_by_its_mass_and_the_weight_of_the_slider_stays() -> None:
    c = conditions()
    weighed = replace(c, mass_kg=(c.normal_load_N - 0.02) / 9.80665)
    m, b = MECHANISMS["wrong_weight"], base(weighed)
    choice = m.choices(b, weighed)[0]
    assert choice.startswith("mass 4.0")
    half = m.law(np.array([-0.5]), b, weighed, choice)
    expected = b.static_mu * np.where(c.normal_load_N < 0.1, 0.02 + 0.04 / 2, c.normal_load_N) + b.static_adhesion_N
    assert half.static_N == pytest.approx(expected)
