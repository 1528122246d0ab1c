"""The card says what was found, how much, where and how sure, in the same words on every output."""

from __future__ import annotations

import html as html_text
import json
from dataclasses import asdict, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from report.conftest import Written
from report.laid_out import html
from report.synthetic import verdict_of
from tribo.diagnostics.verdict import Cause, Estimate, Layer, Verdict
from tribo.errors import Problem
from tribo.mechanisms import MECHANISMS
from tribo.records import LawFit, SetAside, Study
from tribo.wording.card import Card, card_law, card_of, card_text, to_know, verdict_text
from tribo.wording.verdict_sentences import finding, why_next, worded

LAYER: dict[str, Any] = {
    "kind": "cause", "name": "suction", "samples": ["B", "C"], "regimes": ["static"], "p_adjusted": 1e-9,
    "effect_percent": 41.7, "low": 30.2, "high": 54.9, "parameters": {}, "formula": "", "tied_with": [], "gain": None,
    "text": "", "at": "static friction of C at 0.0637 N",
}  # fmt: skip
CAUSE = {"mechanism": "suction", "weight": 1.0, "parameters": {}, "text": "acts on cavities"}
FOUND: dict[str, Any] = {
    "schema": "tribo.verdict/2", "verdict": "named", "text": "The model fails beyond chance.", "misfits": [],
    "causes": [CAUSE], "equivalent": [], "excluded": [], "gain": None, "set_aside": [], "layers": [LAYER],
    "not_testable": [{"mechanism": "contact_ageing", "reason": "cannot be tested with this design: no hold times"}],
    "next_test": {
        "text": "Vent the cavities: 18 pulls of C.", "separates": ["suction", "edge_adhesion"],
        "design": {"hours": 3.1}, "expected_bits": 0.9,
    },
}  # fmt: skip


def misfit(**other: Any) -> dict[str, Any]:
    found = {
        "observable": "both", "sample": "", "covariate": "time of day", "effect_percent": -21.4, "p_adjusted": 1e-6,
        "text": "", "low": -25.0, "high": -17.0,
    }  # fmt: skip
    return found | other


@pytest.fixture
def card(study: Study) -> Card:
    return card_of(study, verdict_of(FOUND))


def test_the_sentence_says_what_happens_how_much_where_and_its_name(card: Card) -> None:
    assert card.sentence == (
        "The air in the cavities is below room pressure, which presses the sample down (suction under the cavities): "
        "this changes static friction of B and C by up to +42 % (90 % interval +30 to +55 %), most in static friction "
        "of C at 0.0637 N."
    )


@pytest.mark.parametrize("name", MECHANISMS)
def test_every_mechanism_has_a_meaning_that_reads_as_a_sentence(name: str) -> None:
    meaning = MECHANISMS[name].meaning
    assert 20 < len(meaning) < 130
    assert meaning[0].islower()
    assert not meaning.endswith(".")
    assert "_" not in meaning


def test_no_card_of_any_mechanism_shows_an_identifier(study: Study) -> None:
    for name in MECHANISMS:
        found = FOUND | {"causes": [{**CAUSE, "mechanism": name}], "layers": [{**LAYER, "name": name}]}
        card = card_of(study, verdict_of(found))
        assert "_" not in card_text(card)
        assert MECHANISMS[name].in_words in card.sentence


def test_causes_that_cannot_be_told_apart_are_not_called_identified(study: Study) -> None:
    tied = FOUND | {
        "layers": [{**LAYER, "tied_with": ["normal_load_error"]}],
        "equivalent": [["suction", "normal_load_error"]],
        "causes": [CAUSE, {**CAUSE, "mechanism": "normal_load_error"}],
    }
    card = card_of(study, verdict_of(tied))
    assert card.sentence.startswith(
        "Suction under the cavities or an error of the normal load (this campaign cannot tell which) changes"
    )
    assert any("each of these equally well" in sentence for sentence in card.to_know)


def test_a_cause_that_the_traces_show_stands_in_the_finding_beside_those_of_the_forces() -> None:
    """The offset of series 17 was missing on the card, which named the causes with a layer alone."""
    offset = Cause(
        "load_cell_offset", 1.0, {"F_0": Estimate(0.006, 0.005, 0.007, "N")},
        shows=MECHANISMS["load_cell_offset"].evidence,
    )  # fmt: skip
    found = verdict_of(FOUND)
    both = worded(replace(found, causes=(offset, *found.causes), next_test=None))
    said = "; in addition, an offset of the load cell (F 0 = 0.00600 N (90 % interval 0.00500 to 0.00700))"
    assert said in both.sentence


def test_a_second_law_stands_in_the_finding_with_the_term_that_it_changes() -> None:
    law = Layer("law", "temperature_C", (), ("static", "sliding"), 1e-6, -30.0, -35.0, -25.0, text="Friction is lower.")
    of_adhesion = SimpleNamespace(law=SimpleNamespace(columns=("humidity_pct",), acts_on="adhesion term"))
    second = replace(law, name="humidity_pct", effect_percent=40.0, low=30.0, high=50.0, shows=of_adhesion)
    v = replace(verdict_of(FOUND), verdict="partly", causes=(), layers=(law, second))
    assert finding(v) == (
        "Friction is lower; in addition, a change of the adhesion term with the humidity by +40 % "
        "(90 % interval +30 to +50 %)."
    )


def test_a_further_cause_says_which_sample_it_concerns() -> None:
    area = {**LAYER, "name": "pattern_geometry", "choice": "S", "effect_percent": -20.0}
    operator = {**LAYER, "name": "covariate:operator", "choice": "operator", "effect_percent": 5.0}
    said = finding(verdict_of(FOUND | {"layers": [LAYER, area, operator]}))
    assert "; in addition, a wrong area fraction (S) by −20 % (" in said
    assert ") and a dependence on operator by +5 % (" in said


def test_one_sentence_states_the_finding_wherever_it_is_said(study: Study) -> None:
    """Card, verdict.json and terminal had a sentence each; what stands beside the card says only what it rests on."""
    for plain in (FOUND, FOUND | {"verdict": "unknown", "misfits": [misfit()], "causes": [], "layers": []}):
        verdict = verdict_of(plain)
        card = card_of(study, verdict)
        assert card.sentence == verdict.sentence
        assert verdict.as_dict()["text"] == f"{verdict.sentence} {verdict.evidence}"
        assert f"{card_text(card)}\n\n{verdict_text(verdict)}".count(verdict.sentence) == 1


def test_laws_that_a_test_would_part_are_called_by_their_column() -> None:
    formulas = ("T * exp(a sin(2 pi elapsed_s / 100))", "load term * exp(a sin(2 pi elapsed_s / 100))")
    law = {"kind": "law", "name": "elapsed_s", "formula": formulas[0], "tied_with": formulas[1:]}
    verdict = {"verdict": "unknown", "layers": [law], "next_test": {"text": "", "design": {}, "separates": formulas}}
    why = "it distinguishes laws of the time since the first pull that fit equally well"
    assert why_next(verdict_of(verdict)) == why


def test_the_next_test_says_why_and_how_long(card: Card) -> None:
    assert card.next_test is not None
    assert card.next_test["hours"] == 3.1
    assert card.next_test["why"] == (
        "it distinguishes suction under the cavities from adhesion along the cavity edges"
    )
    assert "(about 3.1 h)" in card_text(card)


def test_what_the_design_cannot_test_is_said(card: Card) -> None:
    assert "This design cannot test contact ageing." in card.to_know


@pytest.mark.parametrize(
    ("verdict", "words"),
    [
        ({"verdict": "unknown", "misfits": [misfit()], "causes": [], "layers": []},
         "Friction (static and sliding) of all samples changes with the time of day by −21 % (90 % interval −25 to "),
        ({"verdict": "unknown", "misfits": [misfit(sample="C", covariate="sample", observable="sliding")], "causes": [],
          "layers": []},
         "The model predicts the wrong friction for C: measured sliding friction of C differs most, by −21 %"),
        ({"verdict": "no_misfit", "misfits": [], "causes": [],
          "layers": [LAYER | {"kind": "pattern_correction", "name": "B", "effect_percent": 3.4, "low": -2, "high": 9}]},
         "the largest mean difference, static friction of B, is +3 % (90 % interval −2 to +9 %)"),
        ({"verdict": "partly"}, "part of the difference from the model remains unexplained"),
    ],
)  # fmt: skip
def test_every_outcome_has_a_sentence_with_its_size(verdict: dict[str, Any], words: str, study: Study) -> None:
    assert words in card_of(study, verdict_of(FOUND | verdict)).sentence


def test_tests_set_aside_are_counted_with_their_reasons_also_where_nothing_was_found(study: Study) -> None:
    nothing = FOUND | {"verdict": "no_misfit", "causes": [], "layers": []}
    faults = tuple(SetAside(f"X{k}", "cut", (Problem("truncated", "the file is cut"),)) for k in range(14))
    spoiled = replace(study, ingested=replace(study.ingested, set_aside=(*study.ingested.set_aside, *faults)))
    card = card_of(spoiled, verdict_of(nothing))
    assert card.set_aside == 16
    assert "16 tests set aside" in card.counts
    assert any("14 × the file is cut" in sentence for sentence in card.to_know)


def test_a_specimen_pulled_in_two_directions_counts_once(study: Study) -> None:
    tests = tuple(
        replace(t, specimen=f"S{t.specimen[-1]}") if t.sample in ("Sx", "Sy") else t
        for t in study.ingested.campaign.tests
    )
    campaign = replace(study.ingested.campaign, tests=tests)
    shared = replace(study, ingested=replace(study.ingested, campaign=campaign))
    assert card_of(study, None).specimens == 18
    assert card_of(shared, None).specimens == 15
    assert "15 specimens" in html(shared, drawn={}).replace("\u00a0", " ")


def test_a_law_that_is_no_straight_line_is_said(study: Study) -> None:
    note = "the load means deviate from a straight line: chi2_red 19.31, p = 1e-05"
    fits = tuple(replace(f, notes=(note,), bent=True, chi2_red=19.31) if f.sample == "C" else f for f in study.fits)
    said = card_of(replace(study, fits=fits), verdict_of(FOUND)).to_know
    assert any("not a straight line for C static (χ²/ν = 19) and C sliding (χ²/ν = 19)" in s for s in said)


def test_a_cause_that_bends_the_law_is_named_beside_it(study: Study) -> None:
    """A wrong weight is no physics of the sample: the card says that the bend is what it would do."""
    bent = replace(study, fits=tuple(replace(f, bent=True) if f.sample == "C" else f for f in study.fits))

    def said(cause: str) -> str:
        verdict = Verdict("named", causes=(Cause(cause, 1.0, {}),))
        return next(s for s in to_know(bent, verdict) if "not a straight line" in s)

    assert said("wrong_weight").endswith("This is what a wrong weight would do.")
    assert said("humidity").endswith("depend on the range of loads.")


def test_another_flat_sample_than_f_is_said(study: Study) -> None:
    chosen = replace(study.ingested.campaign, chosen_flat="Q")
    other = replace(study, ingested=replace(study.ingested, campaign=chosen))
    assert "The model is calibrated on sample Q (as chosen)." in card_of(other, verdict_of(FOUND)).to_know


def combined(fit: LawFit, largest: dict[str, tuple[str, float]]) -> LawFit:
    return replace(fit, covariance=fit.covariance * 100, type_a=fit.covariance, largest=largest, alone=fit)


def test_the_uncertainty_of_the_card_is_the_combined_one_with_what_dominates_it(study: Study) -> None:
    largest = {"mu": ("wire angle", 60.4), "tau0_Pa": ("specimens", 48.0), "T": ("wire angle", 50.0)}
    fits = tuple(combined(fit, largest) for fit in study.fits)
    card = card_of(replace(study, fits=fits), verdict_of(FOUND))
    alone = card_of(study, verdict_of(FOUND))
    assert card.laws[0]["mu"].split(" ± ")[1] != alone.laws[0]["mu"].split(" ± ")[1]
    assert card.laws[0]["largest"] == "μ: wire angle (60 %); τ₀: specimens (48 %)"
    assert card_law(combined(study.fits[0], dict.fromkeys(largest, ("repeats", 50.0))))["largest"] == "repeats (50 %)"
    assert card.uncertainty.startswith("combined standard uncertainty")


def test_page_terminal_and_file_hold_the_same_card(written: Written, study: Study, card: Card) -> None:
    page = html_text.unescape(html(study, drawn={}, verdict=verdict_of(FOUND))).replace("\u00a0", " ")
    for words in (card.sentence, card.counts, *card.to_know):
        assert words in page
        assert words in card_text(card)
    assert card.next_test is not None
    assert card.next_test["why"] in page
    kept = json.loads((written.out / "card.json").read_text(encoding="utf-8"))
    assert kept == json.loads(json.dumps(asdict(card_of(study, None))))


def test_intervals_of_a_combined_fit_take_the_degrees_of_freedom_of_both_parts(study: Study) -> None:
    fit = combined(study.fits[0], {})
    low, high = fit.interval("mu")
    assert fit.effective_dof(np.array([1.0, 0.0])) == pytest.approx(study.fits[0].dof * 100**2)
    assert (high - low) / 2 == pytest.approx(1.96 * fit.standard_uncertainty("mu"), rel=1e-3)


def test_the_card_says_that_the_interval_of_a_cause_holds_if_its_formula_is_right(study: Study) -> None:
    said = "The 90 % interval of the size holds if the formula is right or nearly right (suction under the cavities)."
    cause = LAYER | {"formula": MECHANISMS["suction"].formula}
    assert said in card_of(study, verdict_of(FOUND | {"layers": [cause]})).to_know
    without_formula = [cause | {"kind": "remainder"}, cause | {"formula": ""}, cause | {"low": float("nan")}]
    for layer in without_formula:
        assert not any("formula is right" in s for s in card_of(study, verdict_of(FOUND | {"layers": [layer]})).to_know)


@pytest.mark.parametrize("notes", [0, 3, 5, 20])
def test_the_card_in_a_terminal_has_at_most_eight_lines_with_the_next_test_last(card: Card, notes: int) -> None:
    assert card.next_test is not None
    full = replace(card, to_know=tuple(f"Note {k}." for k in range(notes)))
    lines = card_text(full).split("\n")
    assert len(lines) <= 8
    assert lines[:2] == [card.sentence, card.counts]
    assert lines[-1].startswith("Next test: ")
    left_out = notes + len(card.meanings) - sum(line.startswith("Note ") for line in lines)
    left_out -= sum(any(line.startswith(f"{name}:") for name, _ in card.meanings) for line in lines)
    assert (f"The report has {left_out} further notes." in lines) == (left_out > 0)


def test_doubtful_numbers_come_before_any_sentence_on_friction(card: Card) -> None:
    """The first, and how many there are besides; a card without doubts begins with the sentence."""
    doubted = replace(card, doubts=("the load of test T7 is ten times too large", "another one"))
    first, second, *_ = card_text(doubted).splitlines()
    assert first == "Check first: the load of test T7 is ten times too large (and 1 more)"
    assert second == card.sentence
    assert card_text(replace(card, doubts=())).startswith(card.sentence)
