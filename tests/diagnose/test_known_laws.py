"""Laws of earlier campaigns: tested on a new one, in a plan, and in the spring-block model."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from blind.tribometer import hide
from support import first_quick

from tribo.diagnostics.candidates import refitted
from tribo.diagnostics.model import Acting, Setup
from tribo.diagnostics.verdict import Cause, Estimate, Layer, Verdict
from tribo.errors import CampaignError, SimulationError
from tribo.lawsearch import model_choice
from tribo.lawsearch.diagnosis_with_laws import with_laws, without_causes
from tribo.lawsearch.grammar import Shape, WrittenLaw
from tribo.lawsearch.known_laws import KnownLaw, law_text, plan_law, read_laws, validate_law, validate_laws
from tribo.lawsearch.model_choice import without_refuted_causes
from tribo.mechanisms import MECHANISMS
from tribo.mechanisms_in_model import columns_from, with_law
from tribo.springblock.config import SimConfig
from tribo.wording.law_sentences import planned_law_sentence
from tribo.wording.part_sentences import layer_sentence
from tribo.wording.verdict_sentences import worded

from .examined import Once, examined
from .known import Change, baseline, made
from .synthetic import SMALL, ingested

WARM = WrittenLaw((Shape("linear", "temperature_C", 20.0, 26.0),))
SIZE = {"a": Estimate(0.6, 0.5, 0.7, "")}


def warming(s: Setup) -> np.ndarray:
    t = s.observations.conditions.temperature_C
    return np.repeat(0.1 * (t - 23.0)[:, None], 2, axis=1)


def curved(s: Setup) -> np.ndarray:
    t = s.observations.conditions.temperature_C
    return np.repeat(-0.05 * (t - 23.0)[:, None] ** 2, 2, axis=1)


def nothing(s: Setup) -> np.ndarray:
    return np.zeros((s.observations.n, 2))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A law that is at work in ``warming``, and one of a column that is nowhere recorded."""
    (tmp_path / "law-1.toml").write_text(law_text(WARM, SIZE, "first"))
    other = WrittenLaw((Shape("linear", "lot_age_d", 0.0, 9.0),))
    (tmp_path / "law-2.toml").write_text(law_text(other, SIZE, "second"))
    return tmp_path


def test_a_known_law_that_holds_is_added_and_one_that_cannot_be_tested_says_why(folder: Path) -> None:
    _, answers, layers, _ = validate_laws(baseline(made(warming, seed=31)), read_laws(folder), np.random.default_rng(0))
    assert [law.answer for law in answers] == ["held", "cannot be told"]
    assert [layer.name for layer in layers] == ["temperature_C"]
    assert "The law of first held" in layer_sentence(layers[0])
    assert layers[0].low < layers[0].effect_percent < layers[0].high


def test_a_verdict_lists_the_answers_about_known_laws(folder: Path, once: Once) -> None:
    quiet = with_laws(examined("nothing_of_known_size", once), read_laws(folder))
    said = worded(quiet.verdict)
    assert [law["answer"] for law in said.model["known_laws"]] == ["not held", "cannot be told"]
    assert "0 of 2 known laws held." in said.text
    assert all(layer.kind == "pattern_correction" for layer in quiet.verdict.layers)


STEP = WrittenLaw((Shape("step", "temperature_C", 20.0, 26.0, place=23.0),))


def stepped(s: Setup) -> np.ndarray:
    t = s.observations.conditions.temperature_C
    return np.repeat(0.3 * (t > 23.0)[:, None], 2, axis=1)


@pytest.mark.parametrize(
    ("at_work", "a", "answer"), first_quick([(stepped, 0.3, "held"), (warming, 0.16, "not held")])
)
def test_a_known_law_replaces_a_cause_of_its_column_unless_that_explains_more(
    at_work: Change, a: float, answer: str
) -> None:
    model = refitted(baseline(made(at_work, seed=31)), [Acting(MECHANISMS["temperature"])])
    known = KnownLaw("law-1.toml", "first", STEP, {"a": Estimate(a, a - 0.04, a + 0.04, "")})
    after, answers, _, replaced = validate_laws(model, [known], np.random.default_rng(0))
    assert answers[0].answer == answer
    left = {a.name for a in after.acting}
    assert ("temperature" in left) == (answer == "not held")
    assert ("temperature" in replaced) == (answer == "held")


def test_the_form_of_a_known_law_may_be_wrong_by_some_of_its_effect() -> None:
    model = baseline(made(stepped, seed=31))
    sizes = (0.3, 0.39, 0.5)
    earlier = [KnownLaw("", "", STEP, {"a": Estimate(a, a - 1e-6, a + 1e-6, "")}) for a in sizes]
    answers = [validate_law(model, known).answer for known in earlier]
    assert answers == ["held", "held", "not held"]


def test_every_faulty_law_of_a_folder_is_named(folder: Path) -> None:
    (folder / "law-3.toml").write_text("x = 1")
    (folder / "law-4.toml").write_text("y = [")
    with pytest.raises(CampaignError) as faults:
        read_laws(folder)
    assert {p.file for p in faults.value.problems} == {"law-3.toml", "law-4.toml"}


def test_a_folder_without_laws_is_refused(tmp_path: Path) -> None:
    with pytest.raises(CampaignError):
        read_laws(tmp_path)


def test_a_mechanism_whose_form_is_wrong_loses_against_a_law_of_its_column() -> None:
    temperature = Acting(MECHANISMS["temperature"])
    wrong = refitted(baseline(made(curved, seed=33)), [temperature])
    right = refitted(baseline(made(warming, seed=33)), [temperature])
    assert set(without_refuted_causes(wrong)[1]) == {"temperature"}
    assert without_refuted_causes(right)[1] == {}


def test_a_cause_that_follows_one_name_of_a_column_loses_against_a_law_of_that_name_on_some_samples() -> None:
    def by_op2(s: Setup, where: np.ndarray) -> np.ndarray:
        here = (s.observations.conditions.columns["operator"] == "op2") & where
        return np.repeat(0.3 * here[:, None], 2, axis=1)

    one_name = [Acting(MECHANISMS["covariate"], "operator is op2")]
    everywhere = made(lambda s: by_op2(s, np.ones(s.observations.n, bool)), seed=33)
    patterned = made(lambda s: by_op2(s, s.observations.conditions.area_fraction < 1.0), seed=33)
    assert without_refuted_causes(refitted(baseline(everywhere), one_name))[1] == {}
    assert set(without_refuted_causes(refitted(baseline(patterned), one_name))[1]) == {"covariate:operator"}


@pytest.mark.slow
def test_other_forms_of_a_recorded_column_that_explain_as_much_are_told_with_its_cause() -> None:
    def film_of(test_id: str) -> float:
        return 1.0 + 0.05 * (37 * int(test_id[1:]) % 101)

    def by_film(s: Setup) -> np.ndarray:
        return np.array([[0.02, 0.02]]) * np.array([[film_of(name)] for name in s.observations.test_ids])

    plain = made(by_film, seed=33)
    tests = tuple(replace(t, covariates={"film_um": str(film_of(t.test_id))}) for t in plain.campaign.tests)
    filmed = replace(plain, campaign=replace(plain.campaign, tests=tests))
    line = refitted(baseline(filmed), [Acting(MECHANISMS["covariate"], "film_um")])
    forms = without_refuted_causes(line)[2]
    assert list(forms) == ["covariate:film_um"]
    law, *ties = forms["covariate:film_um"]
    assert law.form == ((("linear", "film_um", ""),), "T", "both", "all")
    assert "saturating" in {tie.shapes[0].kind for tie in ties}
    assert {tie.columns for tie in ties} == {("film_um",)}
    assert law.form not in {tie.form for tie in ties}


@pytest.mark.parametrize(("own_column", "by", "lost"), [(True, 5.0, False), (True, 7.0, True), (False, 5.0, True)])
def test_a_law_of_the_same_column_has_to_be_better_by_more_than_one_of_another_column(
    own_column: bool, by: float, lost: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(model_choice, "_laws_instead", lambda model, together: (by, own_column, ()))
    model = refitted(baseline(made(warming, seed=33)), [Acting(MECHANISMS["temperature"])])
    assert set(without_refuted_causes(model)[1]) == ({"temperature"} if lost else set())


def undetermined() -> Verdict:
    """Humidity, then a film that a load error and a tilt explain as well."""
    causes = [Cause(name, 0.3, {}, "") for name in ("humidity", "covariate:film_um", "normal_load_error", "tilt")]
    layers = [Layer("cause", c.mechanism, (), (), 0.0, 0.0, 0.0, 0.0) for c in causes[:2]]
    return Verdict("undetermined", causes=tuple(causes), layers=tuple(layers))


@pytest.mark.parametrize(
    ("lost", "left"),
    [("covariate:film_um", {"humidity"}), ("humidity", {"covariate:film_um", "normal_load_error", "tilt"})],
)
def test_alternatives_to_a_cause_that_a_law_replaces_are_no_causes_either(lost: str, left: set[str]) -> None:
    after = without_causes(undetermined(), {lost: 9.0})
    assert {c.mechanism for c in after.causes} == left
    assert {e.mechanism for e in after.excluded} == {lost}


def test_a_plan_says_whether_a_design_would_show_a_law() -> None:
    campaign = ingested(hide(3, [], SMALL)).campaign
    large = plan_law(campaign, WARM, SIZE)
    small = plan_law(campaign, WARM, {"a": Estimate(0.03, 0.01, 0.05, "")})
    assert large.strength == pytest.approx(20.0 * small.strength, rel=1e-2)
    assert "would show" in planned_law_sentence(large)
    assert small.tests_needed > len(campaign.tests)
    elsewhere = replace(WARM, shapes=(replace(WARM.shapes[0], column="lot"),))
    assert "lot is not recorded" in planned_law_sentence(plan_law(campaign, elsewhere, SIZE))


def test_a_law_in_the_model_changes_the_thresholds_of_every_block() -> None:
    config = SimConfig(sample="F", pressure_Pa=5e3)
    law = (WARM.mechanism(), np.array([np.log(2.0)]))
    warm = with_law(config, law, {"temperature_C": 26.0}, {}).friction
    assert warm.mu_s == pytest.approx(2.0 * config.friction.mu_s)
    assert warm.sliding_adhesion_Pa == pytest.approx(2.0 * config.friction.sliding_adhesion_Pa)
    assert with_law(config, law, {"temperature_C": 20.0}, {}) == config


def test_a_law_of_one_sample_and_one_regime_leaves_the_rest_of_the_model_alone() -> None:
    of_a = (replace(WARM, where="sample A", regime="static").mechanism(), np.array([0.5]))
    flat, cavities = SimConfig(sample="F", pressure_Pa=5e3), SimConfig(sample="A", pressure_Pa=5e3)
    assert with_law(flat, of_a, {"temperature_C": 26.0}, {}) == flat
    changed = with_law(cavities, of_a, {"temperature_C": 26.0}, {}).friction
    assert changed.mu_s > 1.5 * cavities.friction.mu_s
    assert changed.mu_d == pytest.approx(cavities.friction.mu_d)


def test_a_column_that_the_model_does_not_have_has_to_be_given() -> None:
    assert columns_from("film_um=3.5, hold_s=100", ["film_um", "hold_s", "pressure_Pa"]) == (
        "hold_s=100",
        {"film_um": "3.5"},
    )
    with pytest.raises(SimulationError, match="film_um"):
        columns_from("hold_s=100", ["film_um"])
