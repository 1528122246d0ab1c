"""What a person decided about pulls is said on the page, in the tables and in the data that the page hands back."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import pytest

from report.laid_out import html
from tribo.records import Override, SetAside, Study
from tribo.report.pulls import pull_cards
from tribo.wording.study_sentences import by_hand_sentence


@pytest.fixture(scope="module")
def decided(study: Study) -> Study:
    """T0001 left out, the window of T0002 moved."""
    ingested = study.ingested
    out, moved = ingested.pulls["T0001"], ingested.pulls["T0002"]
    after = replace(moved, window_s=(12.0, 20.0), sliding_N=0.9 * moved.sliding_N, flags=("window_by_hand",))
    by_hand = {
        "T0001": Override("T0001", "exclude", out, ingested.traces["T0001"], "sled <tipped>"),
        "T0002": Override("T0002", "move", moved, ingested.traces["T0002"], "drift", (12.0, 20.0)),
    }
    pulls = {**{i: p for i, p in ingested.pulls.items() if i != "T0001"}, "T0002": after}
    traces = {i: t for i, t in ingested.traces.items() if i != "T0001"}
    aside = (*ingested.set_aside, SetAside("T0001", "excluded by hand in overrides.csv: sled <tipped>"))
    return replace(
        study, ingested=replace(ingested, pulls=pulls, traces=traces, set_aside=aside, by_hand=by_hand)
    )


@pytest.fixture(scope="module")
def page(decided: Study) -> str:
    return html(decided, drawn={})


def test_a_moved_pull_says_what_changed_against_the_rule(decided: Study) -> None:
    sentence = by_hand_sentence(decided.ingested.by_hand["T0002"], decided.ingested.pulls["T0002"])
    assert "(drift)" in sentence
    assert "from 10.0 to 21.5 s to 12.0 to 20.0 s" in sentence
    assert "(−10 %)" in sentence


def test_a_pull_left_out_keeps_its_trace_on_the_page_so_that_it_can_be_taken_back(page: str, decided: Study) -> None:
    cards = {card["test_id"]: card for card in pull_cards(decided)}
    assert [cards[f"T000{k}"]["state"] for k in (1, 2, 3)] == ["excluded", "moved", "used"]
    assert "<path" in cards["T0001"]["picture"]
    assert "Excluded by hand (sled &lt;tipped&gt;)." in page


def test_the_page_lists_moved_pulls_among_what_was_measured(page: str) -> None:
    measured = page[page.index('id="measured"') : page.index('id="table2"')].replace("\u00a0", " ")
    assert "Peaks and windows moved by hand" in measured
    assert "<dt>T0002</dt>" in measured
    assert "excluded by hand in overrides.csv" in measured


def test_the_script_starts_from_the_decisions_that_were_applied(page: str) -> None:
    found = re.search(r'id="trace-data">(.*?)</script>', page, flags=re.DOTALL)
    assert found is not None
    data = json.loads(found[1])
    assert data["T0001"]["decided"] == {
        "action": "exclude", "reason": "sled <tipped>", "peak": None, "window": None,
    }  # fmt: skip
    assert data["T0002"]["decided"]["window"] == [12.0, 20.0]
    assert data["T0002"]["automatic"]["window"] == [10.0, 21.5]
    assert "decided" not in data["T0003"]
