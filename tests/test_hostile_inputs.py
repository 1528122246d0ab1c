"""Whatever a user's file holds, it is read as what it says, or refused with sentences; the long run is a benchmark."""

from __future__ import annotations

import tempfile
import time
import tomllib
from pathlib import Path
from typing import Any

import hostile_inputs as hostile
import pytest
from hypothesis import HealthCheck, Phase, given, settings, strategies as st

from tribo import stages
from tribo.campaign import load_campaign
from tribo.input_files import toml_table
from tribo.records import Ingested

QUICK = settings(
    max_examples=30, derandomize=True, database=None, deadline=None, suppress_health_check=list(HealthCheck),
    phases=[Phase.generate],
)  # fmt: skip
KINDS = {
    "tests.csv": hostile.check_tests_csv,
    "campaign.toml": hostile.check_campaign_toml,
    "design": hostile.check_design,
    "zip": hostile.check_zip,
}
OUTCOMES = {hostile.SAME, hostile.REFUSED, hostile.IN_PART, hostile.CHANGED}


@pytest.fixture(scope="module")
def ingested(small_campaign: Path) -> Ingested:
    return stages.ingest(load_campaign(small_campaign))


@pytest.mark.parametrize("kind", KINDS)
def test_a_hostile_input_is_read_as_it_is_or_refused(kind: str) -> None:
    outcomes = set()

    @QUICK
    @given(st.data())
    def check(data: Any) -> None:
        with tempfile.TemporaryDirectory() as folder:
            outcomes.add(KINDS[kind](data.draw, Path(folder)))

    check()
    assert {hostile.SAME, hostile.REFUSED} <= outcomes <= OUTCOMES


def test_hostile_decisions_by_hand_are_read_as_they_are_or_refused(ingested: Ingested) -> None:
    outcomes = set()

    @QUICK
    @given(st.data())
    def check(data: Any) -> None:
        with tempfile.TemporaryDirectory() as folder:
            outcomes.add(hostile.check_overrides(data.draw, Path(folder), ingested))

    check()
    assert {hostile.SAME, hostile.REFUSED} <= outcomes <= OUTCOMES


def test_what_is_drawn_for_a_zip_does_not_depend_on_the_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    entries, made = [("series/", b"", 0), ("series/tests.csv", b"test_id\n", 8)], []
    for year in (2025, 2026):
        monkeypatch.setattr(time, "localtime", lambda *_, year=year: time.struct_time((year, *[1] * 8)))
        made.append(hostile.zip_of(entries, b""))
    assert made[0] == made[1]


def test_the_bench_tells_a_comment_that_readers_of_zips_disagree_about() -> None:
    campaign = hostile.zip_of([("tests.csv", b"", 0)], b"")
    for comment, readings in ((b"", 1), (b"a comment", 1), (hostile.END, 2), (b"PK", 1), (campaign, 2)):
        assert len(hostile.ends_of(hostile.zip_of([("tests.csv", b"", 0)], comment))) == readings


@pytest.mark.parametrize(
    "text",
    [f"{'a.' * 40_000}a = 1", f"[{'a.' * 40_000}a]", f"x = {{{'a.' * 40_000}a = 1}}", f"{'a . ' * 60}b = 1",
     '"a".' * 60 + "b = 1"],
    ids=["key", "table", "inline", "blanks", "quoted"],
)  # fmt: skip
def test_keys_of_very_many_parts_are_refused_before_they_are_read(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tomllib, "loads", lambda _: pytest.fail("the text was read"))
    with pytest.raises(RecursionError):
        toml_table(text)


def test_points_in_texts_comments_and_numbers_are_no_parts_of_keys() -> None:
    dots = "a." * 100
    text = f"x = '{dots}' # {dots}\ny = \"\"\"\n{dots}\"\"\"\nz = [1.5, 2.5]\nb.c.d = 2\n"
    assert toml_table(text) == {"x": dots, "y": dots, "z": [1.5, 2.5], "b": {"c": {"d": 2}}}
