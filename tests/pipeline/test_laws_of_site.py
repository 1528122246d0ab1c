"""Laws found in the campaigns of a site: collected for the next build, and told with the campaigns they held in."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tribo.cli.workflow_step import with_laws
from tribo.site.history import answers_of, collect_laws, laws_csv, laws_in_words
from tribo.site.index_page import page


@pytest.fixture
def current(tmp_path: Path) -> Path:
    """Reports of three campaigns: the law of the first held in the second, and not in the third."""
    folder = tmp_path / "current"
    for name, answer in (("may", None), ("june", "held"), ("july", "not held")):
        (folder / name).mkdir(parents=True)
        known = [{"law": "may/law-1.toml", "found_in": "May", "formula": "=T * exp(a x)", "answer": answer}]
        model = {"known_laws": known} if answer else {}
        (folder / name / "verdict.json").write_text(json.dumps({"model": model}))
    (folder / "may" / "law-1.toml").write_text("law")
    return folder


def test_laws_of_reports_are_collected_and_those_that_went_are_removed(current: Path, tmp_path: Path) -> None:
    state = tmp_path / "state"
    assert with_laws(state / "laws") == []
    collect_laws(current, state)
    assert (state / "laws" / "may" / "law-1.toml").read_text() == "law"
    assert with_laws(state / "laws") == ["--laws", str(state / "laws")]
    (current / "may" / "law-1.toml").unlink()
    collect_laws(current, state)
    assert with_laws(state / "laws") == []


def test_every_law_is_told_with_the_campaigns_it_held_in(current: Path) -> None:
    answers = answers_of(current)
    assert [(a["tested_in"], a["answer"]) for a in answers] == [("july", "not held"), ("june", "held")]
    (said,) = laws_in_words(answers)
    assert said == "may/law-1.toml (=T * exp(a x)): held in june; not held in july."
    assert said in page([], {}, [said]).replace("&#39;", "'")


def test_a_cell_that_a_spreadsheet_would_compute_is_escaped(current: Path) -> None:
    assert "'=T * exp(a x)" in laws_csv(answers_of(current))


def test_a_report_without_a_whole_verdict_says_nothing_about_laws(current: Path) -> None:
    (current / "june" / "verdict.json").write_text("{")
    (current / "july" / "verdict.json").unlink()
    assert answers_of(current) == []
