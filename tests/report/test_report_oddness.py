"""A pull far from its siblings is found and shown; nothing is dropped."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from report.laid_out import html
from tribo.comparison.findings import ODD_SCORE, standings
from tribo.records import Study
from tribo.wording import study_sentences as wording


def with_static(study: Study, test_id: str, factor: float) -> Study:
    pull = study.ingested.pulls[test_id]
    moved = replace(pull, static_N=pull.static_N * factor)
    return replace(study, ingested=replace(study.ingested, pulls={**study.ingested.pulls, test_id: moved}))


def odd_pulls(study: Study) -> dict[str, dict[str, Any]]:
    """Pulls beyond the limit, by test, the largest deviation first."""
    odd = {i: row for i, row in standings(study).items() if abs(row["score"]) > ODD_SCORE}
    return dict(sorted(odd.items(), key=lambda item: -abs(item[1]["score"])))


def test_a_pull_at_half_the_force_is_the_oddest(study: Study) -> None:
    test_id, oddest = next(iter(odd_pulls(with_static(study, "T0010", 0.5)).items()))
    assert (test_id, oddest["regime"], oddest["siblings"]) == ("T0010", "static", 2)
    assert oddest["deviation"] == pytest.approx(-0.5, abs=0.06)
    assert oddest["score"] < -3.5
    assert "below the median of the 2 other pulls" in wording.odd_sentence(oddest)


def test_an_odd_pull_is_shown_and_still_used(study: Study) -> None:
    page = html(with_static(study, "T0010", 0.5), drawn={})
    first = page.index('<li class="card')
    assert 'data-id="T0010"' in page[first : page.index(">", first)]  # the oddest comes first
    assert "below the median of the 2 other pulls" in page


def test_ordinary_scatter_is_not_odd(study: Study) -> None:
    assert len(odd_pulls(study)) <= 0.02 * len(study.ingested.pulls)


def test_two_pulls_at_a_load_cannot_say_which_is_odd(study: Study) -> None:
    keep = [t for t in study.ingested.campaign.tests if t.specimen[-1] in "12"]
    campaign = replace(study.ingested.campaign, tests=tuple(keep))
    pulls = {t.test_id: study.ingested.pulls[t.test_id] for t in keep}
    two = replace(study, ingested=replace(study.ingested, campaign=campaign, pulls=pulls))
    assert odd_pulls(with_static(two, keep[0].test_id, 0.3)) == {}


def test_a_campaign_without_pulls_has_no_odd_ones(study: Study) -> None:
    assert odd_pulls(replace(study, ingested=replace(study.ingested, pulls={}))) == {}
