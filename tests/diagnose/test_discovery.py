"""The missing law: found, written down, read again, and tested on another campaign."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from blind.tribometer import Design

from tribo.diagnostics.candidates import refitted
from tribo.diagnostics.diagnosis import Diagnosis, examine
from tribo.diagnostics.model import Acting, Setup
from tribo.diagnostics.replicates import drawn_residuals, refit
from tribo.diagnostics.verdict import Cause, Estimate
from tribo.display import exact_text
from tribo.errors import CampaignError
from tribo.figures.extended_model import draw_law, law_numbers, law_numbers_of
from tribo.kept_results import decoded, encoded
from tribo.lawsearch import diagnosis_with_laws
from tribo.lawsearch.diagnosis_with_laws import law_layers, searched_laws, separating_test, with_laws, with_misfits
from tribo.lawsearch.grammar import (
    ADHESION_TERM,
    LOAD_TERM,
    UNITS,
    Shape,
    WrittenLaw,
    fine_shapes,
    scopes_of,
    shapes_of,
)
from tribo.lawsearch.known_laws import KnownLaw, law_text, read_law, validate_law, why_not_testable
from tribo.lawsearch.model_choice import FoundLaw
from tribo.lawsearch.scoring import Grammar, Projection
from tribo.lawsearch.search import RESCORED, Discovery, discover_laws
from tribo.mechanisms import MECHANISMS
from tribo.mechanisms.record import Base, Conditions
from tribo.wording.law_sentences import discovery_sentence, held_sentence, law_sentence, size_sentence, tied_laws
from tribo.wording.part_sentences import layer_sentence, misfit_sentence, next_test_sentence
from tribo.wording.verdict_sentences import verdict_in_words, worded

from .examined import Once, examined
from .known import acting, baseline, made, net_of


def warm_is_best(s: Setup) -> np.ndarray:
    """Friction is highest at 23 degrees and falls by 3 % per square degree away from it, in the sliding force alone."""
    t = s.observations.conditions.temperature_C
    return np.column_stack([np.zeros(len(t)), -0.03 * (t - 23.0) ** 2])


@pytest.mark.parametrize("column", UNITS)
def test_no_sentence_on_a_law_shows_the_name_of_a_column_of_the_file(column: str) -> None:
    law = WrittenLaw((Shape("linear", column, 1.0, 2.0),))
    said = size_sentence(law, {}, (10.0, 8.0, 12.0))
    assert column not in said
    assert "_" not in said


FORMS = ("linear", "log", "optimum", "log optimum", "step", "soft step", "ramp", "window", "hump", "saturating", "wave")


@pytest.mark.parametrize("column", UNITS)
def test_the_formulas_that_a_law_cannot_be_told_from_are_each_said_in_words(column: str) -> None:
    laws = [WrittenLaw((Shape(kind, column, 1.0, 2.0, place=1.5, width=0.25),)) for kind in FORMS]
    said = [tied_laws([law], by_values=True) for law in laws]
    assert len(set(said)) == len(FORMS)
    assert not [text for text in said if column in text or "_" in text or "*" in text]


def test_a_formula_is_said_in_the_unit_in_which_its_column_is_read() -> None:
    laws = [WrittenLaw((Shape("log optimum", "speed_m_s", 1e-5, 1e-3, place=2e-4),), regime="sliding")]
    said = "a parabola in the logarithm of the pull speed about 0.2 mm/s"
    assert tied_laws(laws) == f"This design cannot distinguish it from: {said} (sliding friction)."
    assert tied_laws(laws, by_values=True) == f"Formulas that these values do not contradict: {said}."


def test_a_period_of_the_time_is_told_in_hours() -> None:
    wave = Shape("wave", "elapsed_s", 0.0, 1e5, width=28_800.0)
    said = size_sentence(WrittenLaw((wave,)), {}, (38.0, 36.0, 40.0))
    assert "periodically with the time since the first pull, period 8 h; highest relative to lowest: +38 %" in said


def test_a_law_that_lowers_friction_has_a_negative_size_and_interval() -> None:
    law = WrittenLaw((Shape("linear", "humidity_pct", 30.0, 60.0),))
    assert "Friction is lower (−21 %, 90 % interval −25 to −17 %) at" in size_sentence(law, {}, (-21.0, -25.0, -17.0))


def test_a_law_of_the_pressure_alone_acts_on_several_patterns_or_on_none() -> None:
    model = baseline(made(nothing, seed=3))
    grammar = Grammar(model, ())
    shapes, groups = grammar.courses.shapes, grammar.scopes
    net = net_of(grammar, Projection(model, model.residual[None]))[0].reshape(len(groups), len(shapes))
    allowed = {
        groups[g].where
        for g, k in zip(*np.nonzero(np.isfinite(net)), strict=True)
        if {s.column for s in shapes[k]} <= {"pressure_Pa", "contact_pressure_Pa"}
    }
    assert allowed == {"all", "flat", "patterned", "1 - AF", "rim"}
    assert all(np.isfinite(net[g]).any() for g in range(len(groups)))


def test_laws_of_the_two_pressures_are_told_apart_at_equal_contact_pressures() -> None:
    one, other = (
        WrittenLaw((Shape("linear", "film_um", 1.0, 2.0), Shape("linear", name, 1.0, 2.0)))
        for name in ("pressure_Pa", "contact_pressure_Pa")
    )
    conditions = baseline(made(nothing, seed=1)).setup.observations.conditions
    assert "at equal contact pressures" in next_test_sentence(separating_test(one, other, conditions))


def test_the_one_column_by_which_two_laws_differ_is_varied_by_itself() -> None:
    warm, worn = Shape("linear", "temperature_C", 20.0, 26.0), Shape("linear", "run_order", 1.0, 40.0)
    conditions = baseline(made(nothing, seed=1)).setup.observations.conditions
    said = next_test_sentence(separating_test(WrittenLaw((warm,)), WrittenLaw((warm, worn)), conditions))
    assert "Vary the run order independently of all other conditions" in said
    said = next_test_sentence(separating_test(WrittenLaw((warm,)), WrittenLaw((worn,)), conditions))
    assert "Vary the temperature and the run order independently of each other and of all other conditions" in said


def nothing(s: Setup) -> np.ndarray:
    return np.zeros((s.observations.n, 2))


DAYS = Design(repeats=2)


def afternoons(s: Setup) -> np.ndarray:
    """Sliding and static friction are higher by 20 % after 13 h, on every day."""
    return np.where(s.observations.conditions.clock_h[:, None] > 13.0, 0.2, 0.0) * np.ones(2)


@pytest.mark.slow
def test_an_effect_of_afternoons_is_told_as_a_step_of_the_time_of_day() -> None:
    law, *_ = discover_laws(baseline(made(afternoons, seed=5, design=DAYS)), replicates=20).laws
    assert law.law.columns == ("clock_h",)
    assert law.law.shapes[0].kind == "step"
    assert law.law.shapes[0].place == pytest.approx(13.0, abs=0.25)
    assert "where the time of day is above 1" in law_sentence(law)


def test_a_law_of_the_time_of_day_is_not_tested_where_no_time_was_recorded() -> None:
    c = replace(baseline(made(nothing, seed=1)).setup.observations.conditions, clock_h=np.array([]))
    assert why_not_testable(c, WrittenLaw((Shape("step", "clock_h", 8.0, 17.0, place=13.0),))) is not None


def one_afternoon(s: Setup) -> np.ndarray:
    """Friction is higher by 80 % after 13 h of the first day alone."""
    return afternoons(s) * 3.0 * (s.observations.conditions.elapsed_s[:, None] < 43_200.0)


@pytest.mark.slow
def test_one_afternoon_is_no_law_of_the_time_of_day() -> None:
    others = {"run_order", "specimen_run", "elapsed_s", "date"}
    found = discover_laws(baseline(made(one_afternoon, seed=5, design=DAYS)), replicates=20, without=others)
    assert "clock_h" not in {name for law in found.laws for name in law.law.columns}


def test_no_wave_of_the_time_since_the_first_pull_stands_for_a_day() -> None:
    c = baseline(made(nothing, seed=1, design=DAYS)).setup.observations.conditions
    times = ("clock_h", "elapsed_s", "specimen_run")
    waves = {(s.column, s.width) for (s, *_), _ in shapes_of(c) if s.kind == "wave" and s.column in times}
    assert waves == {("clock_h", 24.0), ("clock_h", 12.0), ("clock_h", 8.0)}
    assert {len(fine_shapes(Shape("wave", name, width=width), c)) for name, width in waves} == {1}


@pytest.fixture(scope="module")
def found() -> Discovery:
    return discover_laws(baseline(made(warm_is_best, seed=5)), replicates=20)


def test_the_column_the_form_the_regime_and_the_place_are_found(found: Discovery) -> None:
    law = found.laws[0]
    assert law.law.columns == ("temperature_C",)
    assert law.law.shapes[0].kind in ("optimum", "hump")
    assert law.law.regime == "sliding"
    assert law.law.where == "all"
    assert law.parameters["place"].low < 23.0 < law.parameters["place"].high
    assert law.p < 0.01
    assert law.gain is not None
    assert law.gain.difference > 0


def test_the_law_is_said_in_a_sentence_and_as_a_layer(found: Discovery) -> None:
    text, layer = discovery_sentence(found), law_layers(found)[0]
    assert "Sliding friction is higher (+" in text
    assert "near the temperature = 2" in text
    assert (layer.kind, layer.regimes) == ("law", ("sliding",))
    assert layer.low < layer.effect_percent < layer.high


@pytest.fixture(scope="module")
def diagnosed() -> Diagnosis:
    return with_laws(examine(made(lambda s: 2.0 * warm_is_best(s), seed=5), replicates=(40, 40)))


def test_a_diagnosis_adds_the_law_of_what_no_mechanism_explains(diagnosed: Diagnosis) -> None:
    layers = {layer.kind: layer for layer in diagnosed.verdict.layers}
    assert diagnosed.verdict.verdict == "unknown"
    assert layers["law"].name == "temperature_C"
    assert "remainder" not in layers
    said = worded(diagnosed.verdict)
    assert layer_sentence(layers["law"]).rstrip(".") in said.sentence
    assert "the remaining differences are within chance" in said.evidence


@pytest.fixture(scope="module")
def quiet(once: Once) -> Diagnosis:
    return with_laws(examined("nothing_of_known_size", once))


def test_a_campaign_without_misfit_is_searched_and_none_is_found(quiet: Diagnosis) -> None:
    assert quiet.verdict.verdict == "no_misfit"
    assert quiet.laws is not None
    assert quiet.laws.laws == ()
    assert all(layer.kind == "pattern_correction" for layer in quiet.verdict.layers)


def test_a_law_that_no_contrast_had_shown_is_a_misfit(found: Discovery, quiet: Diagnosis) -> None:
    v = with_misfits(quiet.verdict, found, (), (), quiet.baseline)
    assert v.verdict == "unknown"
    assert [(m.observable, m.covariate) for m in v.misfits] == [("sliding", "temperature_C")]
    assert v.misfits[0].low < v.misfits[0].effect_percent < v.misfits[0].high
    assert misfit_sentence(v.misfits[0]) == law_sentence(found.laws[0])
    assert v.next_test is not None
    assert "temperature" in next_test_sentence(v.next_test)


def test_a_law_beside_a_cause_leaves_it_a_part_of_the_answer(found: Discovery, quiet: Diagnosis) -> None:
    cause = Cause("suction", 1.0, {})
    v = with_misfits(replace(quiet.verdict, verdict="named", causes=(cause,)), found, (), (), quiet.baseline)
    assert (v.verdict, v.causes) == ("partly", (cause,))
    assert "A misfit remains beyond chance" in worded(v).text


@pytest.mark.parametrize("step", [with_laws, searched_laws])
def test_a_law_has_to_be_beyond_chance_at_three_tenths_of_the_level_of_a_misfit(
    quiet: Diagnosis, monkeypatch: pytest.MonkeyPatch, step: Callable[..., object]
) -> None:
    levels = []

    def nothing_found(model: object, *, level: float, **_: object) -> Discovery:
        levels.append(level)
        return Discovery((), (), 0)

    monkeypatch.setattr(diagnosis_with_laws, "discover_laws", nothing_found)
    step(quiet, level=0.05)
    assert levels == [pytest.approx(0.015)]


def test_the_figure_shows_the_law_over_its_column(diagnosed: Diagnosis) -> None:
    shown = law_numbers(diagnosed)
    assert set(shown["regime"]) == {"sliding"}
    assert len(shown) == diagnosed.baseline.setup.observations.n
    peak = shown.loc[shown["law_percent"].idxmax(), "x"]
    assert abs(peak - 23.0) < 0.4
    assert (shown["low_percent"] <= shown["high_percent"]).all()
    assert diagnosed.laws is not None
    width = np.diff(np.log1p(shown[["low_percent", "high_percent"]].to_numpy() / 100), axis=1)[:, 0]
    assert width == pytest.approx(np.diff(diagnosed.laws.laws[0].band[1:, :, 1], axis=0)[0])
    assert np.corrcoef(shown["partial_percent"], shown["law_percent"])[0, 1] > 0.5
    assert len(draw_law(shown).axes) == 1


def test_a_campaign_without_laws_has_no_figure_of_them() -> None:
    assert law_numbers_of(Discovery((), (), 0)).empty


def test_a_diagnosis_with_a_law_can_be_kept(diagnosed: Diagnosis) -> None:
    kept = decoded(encoded(diagnosed.without_columns()))
    assert kept.verdict == diagnosed.verdict or repr(kept.verdict) == repr(diagnosed.verdict)
    law = kept.laws.laws[0].model.acting[-1].mechanism.law
    assert law == diagnosed.laws.laws[0].model.acting[-1].mechanism.law


def test_the_report_shows_a_law_with_its_size(diagnosed: Diagnosis) -> None:
    words = verdict_in_words(worded(diagnosed.verdict))
    assert len(words["laws"]) == 1
    assert words["laws"][0]["formula"].startswith("T * exp(a ")
    assert "a = " in words["laws"][0]["formula"]
    assert "samples" in words["laws"][0]["gain"]


def test_the_best_law_by_the_fitted_noise_is_among_those_scored_anew() -> None:
    """Each simulated campaign is searched at the noise of the fit; only its best laws are scored at its own noise."""
    model = baseline(made(nothing, seed=7))
    rng = np.random.default_rng(3)
    drawn = drawn_residuals(model, rng, 1)
    laws = Grammar(model, ())
    every = np.arange(laws.size)
    made_again = refit(model, drawn)
    for k, best in enumerate(laws.best(Projection(model, drawn.transpose(0, 2, 1)), RESCORED)):
        exact = np.concatenate(
            [laws.gains(made_again.one(k), part)[0] - laws.cost(part) for part in np.array_split(every, 12)]
        )
        assert exact[best].max() == pytest.approx(exact.max(), abs=0.05)


def test_nothing_is_written_where_nothing_is_hidden(quiet: Diagnosis) -> None:
    assert quiet.laws is not None
    assert quiet.laws.laws == ()
    assert "None of the" in discovery_sentence(quiet.laws)


def test_a_law_is_read_as_it_was_written(found: Discovery, tmp_path: Path) -> None:
    law = found.laws[0]
    path = tmp_path / "law.toml"
    path.write_text(law_text(law.law, law.parameters, 'series "7"\n[x]'), encoding="utf-8")
    again = read_law(path)
    assert again.law == law.law or exact_text(again.law) == exact_text(law.law)
    assert again.parameters == law.parameters
    assert again.found_in == 'series "7"\n[x]'


def test_faults_of_a_law_are_named_all_at_once(tmp_path: Path) -> None:
    path = tmp_path / "law.toml"
    path.write_text('schema = "tribo.law/1"\nacts_on = "N"\nregime = "both"\nwhere = "all"\n[[shape]]\nkind = "bend"\n')
    with pytest.raises(CampaignError) as faults:
        read_law(path)
    assert {"acts_on", "shape.0.kind", "shape.0.column", "parameters"} <= {p.column for p in faults.value.problems}


def test_a_law_holds_where_it_is_at_work_and_not_where_it_is_absent_or_of_other_size(found: Discovery) -> None:
    law = KnownLaw("", "", found.laws[0].law, found.laws[0].parameters)
    same = baseline(made(warm_is_best, seed=21))
    assert validate_law(same, law).answer == "held"
    assert validate_law(baseline(made(nothing, seed=22)), law).answer == "not held"
    turned = {**law.parameters, "a": Estimate(*(-x for x in _ends(law.parameters["a"])), "")}
    assert validate_law(same, replace(law, parameters=turned)).answer == "not held"


def test_a_law_whose_column_is_not_recorded_cannot_be_told(found: Discovery) -> None:
    law = found.laws[0]
    elsewhere = replace(law.law, shapes=(replace(law.law.shapes[0], column="lot"),))
    answer = validate_law(baseline(made(nothing, seed=22)), KnownLaw("", "", elsewhere, law.parameters))
    assert answer.answer == "cannot be told"
    assert answer.untested == ("not recorded", ("lot",))
    assert "lot is not recorded" in held_sentence(answer)


def _ends(e: Estimate) -> tuple[float, float, float]:
    return e.value, e.high, e.low


def conditions() -> Conditions:
    return baseline(made(nothing, seed=1)).setup.observations.conditions


def test_every_law_of_the_grammar_leaves_the_forces_alone_at_zero_amplitude() -> None:
    c = conditions()
    ones = np.ones(len(c.sample))
    base = Base(4.0 * ones, 1e-3 * ones, 3.0 * ones, 5e-4 * ones)
    before = base.forces(c.normal_load_N)
    for shapes, _ in shapes_of(c)[::7]:
        for scope in scopes_of(c)[0][::5]:
            mechanism = replace(scope, shapes=shapes).mechanism()
            after = mechanism.law(mechanism.zero(), base, c, "")
            np.testing.assert_allclose(after.static_N, before.static_N, rtol=1e-12)
            np.testing.assert_allclose(after.sliding_N, before.sliding_N, rtol=1e-12)


def test_a_law_of_one_term_and_one_regime_changes_nothing_else() -> None:
    c = conditions()
    ones = np.ones(len(c.sample))
    base = Base(4.0 * ones, 1e-3 * ones, 3.0 * ones, 5e-4 * ones)
    law = WrittenLaw((Shape("linear", "temperature_C", 20.0, 26.0),), "adhesion term", "static", "sample B")
    after = law.changed(base, c.normal_load_N, np.log(2.0) * law.weight(c))
    assert after.static_N - base.forces(c.normal_load_N).static_N == pytest.approx((c.sample == "B") * 1e-3)
    assert after.sliding_N == pytest.approx(base.forces(c.normal_load_N).sliding_N, rel=1e-12)


def test_a_column_with_missing_values_is_used_where_it_is_there() -> None:
    c = conditions()
    gaps = replace(c, temperature_C=np.where(np.arange(len(c.sample)) % 5 == 0, np.nan, c.temperature_C))
    shape = next(s for (s, *rest), _ in shapes_of(gaps) if s.column == "temperature_C" and not rest)
    course = shape.of(gaps)[:, 0]
    recorded = course[np.isfinite(gaps.temperature_C)]
    assert course[::5] == pytest.approx(recorded.mean())
    assert np.ptp(recorded) == pytest.approx(1.0)


def lossy_but_less_on_one_pattern(s: Setup) -> np.ndarray:
    """Loss of contact area, by 15 % less on C than its law has it."""
    less = np.where(s.observations.conditions.sample == "C", 0.85, 1.0)[:, None]
    return acting("contact_area_loss", 6e-11)(s) * less


def test_what_a_cause_of_slightly_wrong_form_leaves_is_no_law() -> None:
    model = baseline(made(lossy_but_less_on_one_pattern, seed=8, repeat_sd=(0.02, 0.02)))
    with_cause = refitted(model, [Acting(MECHANISMS["contact_area_loss"])])
    assert discover_laws(with_cause, replicates=20).laws == ()


def test_a_day_is_not_to_be_varied_but_what_it_had_in_particular() -> None:
    shape = Shape("level", "date", level="2026-03-04")
    one, other = (WrittenLaw((shape,), acts_on=term) for term in (LOAD_TERM, ADHESION_TERM))
    test = separating_test(one, other, baseline(made(nothing, seed=1)).setup.observations.conditions)
    said = "Find out what differed on 2026-03-04, and pull with it and without it at "
    assert next_test_sentence(test).startswith(said)


def best_at_23(s: Setup) -> np.ndarray:
    """Friction of the patterned samples is highest at 23 degrees, by a tenth of its logarithm for a degree squared."""
    c = s.observations.conditions
    return np.repeat((np.where(c.area_fraction < 1, -0.1 * (c.temperature_C - 23.0) ** 2, 0.0))[:, None], 2, axis=1)


def test_a_law_of_the_patterned_samples_leaves_their_level_alone() -> None:
    law = discover_laws(baseline(made(best_at_23, seed=9)), replicates=20).laws[0]
    assert (law.law.shapes[0].kind, law.law.where) == ("optimum", "patterned")
    assert law.parameters["place"].low < 23.0 < law.parameters["place"].high
    specimen_gain = law.model.noise.sizes[0]
    assert specimen_gain < 0.15


def test_a_law_that_would_be_chance_even_as_the_only_one_is_not_compared_with_simulated_campaigns() -> None:
    calls: list[str] = []
    model = baseline(made(nothing, seed=102))
    found = discover_laws(model, level=1e-9, replicates=20, progress=lambda stage, *_: calls.append(stage))
    assert found.laws == ()
    assert found.scored[0][2] > 0
    assert calls == []
    discover_laws(model, level=0.5, replicates=20, progress=lambda stage, *_: calls.append(stage))
    assert calls


FIVE = Design(samples=("F", "A", "B"), masses_g=(12.0, 50.0, 138.5), speeds_mm_s=(0.02, 0.06, 0.2, 0.5, 1.0))
THREE = replace(FIVE, speeds_mm_s=(0.05, 0.2, 0.8))


def of_speed(at_speed: Callable[[np.ndarray], np.ndarray], design: Design, seed: int = 3) -> Diagnosis:
    """A campaign whose sliding friction changes with the speed (mm/s) in this way, and with nothing else."""

    def change(s: Setup) -> np.ndarray:
        return at_speed(s.observations.conditions.speed_m_s * 1e3)[:, None] * np.array([0.0, 1.0])

    return examine(made(change, seed=seed, design=design), replicates=(40, 20))


def the_law_of(d: Diagnosis) -> FoundLaw:
    (law,) = with_laws(d).laws.laws
    return law


@cache
def examined_dip() -> Diagnosis:
    """Sliding friction is lower at the second of three speeds."""
    return of_speed(lambda v: -0.14 * np.isclose(v, 0.2), THREE)


@cache
def with_a_dip() -> FoundLaw:
    return the_law_of(examined_dip())


DIP = {"0.05": 0.14 / 3, "0.2": -0.14 * 2 / 3, "0.8": 0.14 / 3}


def test_a_column_of_few_values_is_told_by_its_values_whatever_the_shape() -> None:
    dip, true = with_a_dip(), DIP
    assert dip.levels.keys() == true.keys()
    for value, change in true.items():
        assert dip.levels[value].low < 100 * (np.exp(change) - 1) < dip.levels[value].high
    assert "speed: " in law_sentence(dip)
    assert "above" not in law_sentence(dip)


def test_the_formulas_that_pass_through_the_values_are_listed_and_no_other() -> None:
    kinds = {tie.shapes[0].kind for tie in the_law_of(of_speed(lambda v: -0.05 * np.log(v / 0.1) ** 2, FIVE)).ties}
    assert "log optimum" in kinds
    assert not {"linear", "log", "step"} & kinds


@pytest.fixture
def nothing_is_searched(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(diagnosis_with_laws, "discover_laws", lambda *_, **__: Discovery((), (), 0))


@pytest.mark.usefixtures("nothing_is_searched")
def test_where_the_strongest_misfit_follows_few_values_these_are_told_with_its_chance() -> None:
    d = examined_dip()
    law = the_law_of(d)
    assert (d.verdict.verdict, d.verdict.misfits[0].covariate) == ("unknown", "speed_mm_s")
    assert law.p == d.verdict.misfits[0].p_adjusted
    assert law.levels["0.2"].low < 100 * np.expm1(DIP["0.2"]) < law.levels["0.2"].high < 0.0


@pytest.mark.usefixtures("nothing_is_searched")
@pytest.mark.parametrize("column", ["specimen_run", "temperature_C", "specimen A1"])
def test_a_misfit_of_the_series_of_many_values_or_of_one_specimen_has_no_law_of_its_values(
    column: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(diagnosis_with_laws, "LIKELY", -np.inf)  # whatever it gains
    d = examined_dip()
    (first, *_) = d.verdict.misfits
    d = replace(d, verdict=replace(d.verdict, misfits=(replace(first, covariate=column),)))
    assert with_laws(d).laws.laws == ()


@pytest.mark.usefixtures("nothing_is_searched")
@pytest.mark.parametrize("changed", [{"p_adjusted": 0.01}, {"covariate": "operator"}])
def test_a_misfit_within_chance_or_of_values_that_gain_little_has_no_law_of_its_values(
    changed: dict[str, object],
) -> None:
    d = examined_dip()
    (first, *_) = d.verdict.misfits
    d = replace(d, verdict=replace(d.verdict, misfits=(replace(first, **changed),)))
    assert with_laws(d).laws.laws == ()


def test_a_misfit_that_a_law_explains_on_the_way_is_listed_no_more_but_that_of_a_pattern_is() -> None:
    d = examined_dip()
    (first, *_) = d.verdict.misfits
    others = replace(first, covariate="run_order"), replace(first, covariate="sample", sample="A")
    v = with_laws(replace(d, verdict=replace(d.verdict, misfits=(first, *others)))).verdict
    assert v.shows.within_chance
    assert [m.covariate for m in v.misfits] == ["speed_m_s", "sample"]


@pytest.mark.usefixtures("nothing_is_searched")
def test_the_strongest_misfit_that_a_law_leaves_is_said_with_its_column(monkeypatch: pytest.MonkeyPatch) -> None:
    d = examined_dip()
    monkeypatch.setattr(diagnosis_with_laws, "screen_left", lambda *_, **__: d.screened)  # as if the law explained none
    v = worded(with_laws(d).verdict)
    (remainder,) = (layer for layer in v.layers if layer.kind == "remainder")
    assert (v.shows.within_chance, remainder.name) == (False, "speed_mm_s")
    assert f"A misfit remains beyond chance: {remainder.text}" in v.text
    assert [m.covariate for m in v.misfits].count("speed_mm_s") == 1


def test_a_law_by_values_is_written_and_read_again(tmp_path: Path) -> None:
    dip = with_a_dip()
    (tmp_path / "law.toml").write_text(law_text(dip.law, dip.parameters, "three speeds"), encoding="utf-8")
    again = read_law(tmp_path / "law.toml")
    assert exact_text(again.law) == exact_text(dip.law)
    assert again.parameters == dip.parameters
