"""A verdict is written as it is and told in words that claim no more than it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, get_args

import pytest

from report.laid_out import html
from report.synthetic import verdict_of
from tribo.diagnostics.verdict import Outcome
from tribo.records import Study
from tribo.report import write_verdict
from tribo.wording.verdict_sentences import verdict_in_words

NAMED: dict[str, Any] = {
    "schema": "tribo.verdict/1",
    "verdict": "named",
    "text": "Patterned samples have more friction.",
    "misfits": [
        {
            "observable": "static", "sample": "C", "covariate": "area_fraction", "effect_percent": 12.0,
            "p_adjusted": 0.0001, "text": "C is <12 %> above the model.",
        }
    ],
    "causes": [
        {
            "mechanism": "suction", "weight": 0.61, "text": "acts on cavities",
            "parameters": {"pressure_drop": {"value": 3000.0, "low": 2000.0, "high": 4000.0, "unit": "Pa"}},
        }
    ],
    "equivalent": [["suction", "normal_load_error"]],
    "excluded": [{"mechanism": "tilt", "reason": "acts the other way"}],
    "gain": {
        "held_out": "samples", "log_score_baseline": -1.0, "log_score_extended": -0.5, "difference": 0.5, "se": 0.1,
        "rmse_percent_before": 12.0, "rmse_percent_after": 4.0,
    },
    "set_aside": [],
    "next_test": {"text": "Weigh the sled.", "separates": [], "design": {}, "expected_bits": 1.0},
}  # fmt: skip


def test_the_verdict_is_written_whole(tmp_path: Path) -> None:
    write_verdict(NAMED, tmp_path)
    assert json.loads((tmp_path / "verdict.json").read_text(encoding="utf-8")) == NAMED


def test_the_page_tells_the_verdict_first_and_in_full(study: Study) -> None:
    verdict = verdict_of(NAMED)
    page = html(study, drawn={}, verdict=verdict)
    assert page.index(verdict.sentence.partition(" (")[0]) < page.index("Fitted friction law")
    assert page.count(verdict.sentence.partition(" (")[0]) == 2  # in the title of the first page, and in the card
    assert "C is &lt;12 %&gt; above the model." in page.replace("\u00a0", " ")
    for words in (
        "between suction under the cavities and an error of the normal load", "3000 (2000 to 4000)",
        "log likelihood lower by 4.0",
        "Weigh the sled.", "below 0.001", "predicts better by a log score of 0.500",
    ):  # fmt: skip
        assert words in page.replace("\u00a0", " ")


@pytest.mark.parametrize("outcome", get_args(Outcome))
def test_a_bare_verdict_has_a_sentence_too(outcome: str, study: Study) -> None:
    empty = verdict_of({"verdict": outcome})
    assert empty.sentence.endswith(".")
    assert empty.sentence in html(study, drawn={}, verdict=empty)


def test_a_gain_within_two_standard_errors_may_be_chance() -> None:
    gain = {**NAMED["gain"], "difference": 0.1, "se": 0.1}
    assert "may be due to chance" in verdict_in_words(verdict_of({**NAMED, "gain": gain}))["gain"]


def test_an_interval_that_does_not_exist_is_left_out() -> None:
    cause = {**NAMED["causes"][0], "parameters": {"c": {"value": 1.0, "low": None, "high": None, "unit": ""}}}
    assert verdict_in_words(verdict_of({**NAMED, "causes": [cause]}))["causes"][0]["sizes"] == ["c = 1.00"]


def test_a_study_without_a_diagnosis_does_not_speak_of_one(study: Study) -> None:
    assert 'id="diagnosis"' not in html(study, drawn={})
