"""The index page shows each campaign as it stands, links its report, and marks a change where one is found."""

from __future__ import annotations

import csv
import io
import json
import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from tribo.site.history import CampaignRow, history
from tribo.site.index_page import (
    _range,
    change_points,
    change_sentence,
    page,
    series,
    ticks,
    trend_csv,
    write_index,
)


def campaigns(jump: float = 0.0) -> list[CampaignRow]:
    """Twelve campaigns of one sample, the last five with another static mu."""
    rng = np.random.default_rng(7)
    rows = []
    for k in range(12):
        value = 4.8 + rng.normal(0, 0.05) + (jump if k >= 7 else 0.0)
        laws = {("F", "static", "mu"): (value, value - 0.1, value + 0.1)}
        rows.append(CampaignRow(f"no {k}", "A & B <x>", "done", (), f"2026-{k + 1:02d}-01", has_report=True, laws=laws))
    return rows


def rendered(rows: list[CampaignRow]) -> str:
    return page(rows, change_points(series(rows)))


def test_a_change_is_marked_and_said_with_its_campaign() -> None:
    text = rendered(campaigns(1.0))
    assert text.count('<line class="change"') == 1
    assert re.search(r"Static μ of F rises from 4\.\d+ to 5\.\d+ at no 7 \(adjusted p 0\.00\d\)", text)


def test_without_a_change_none_is_marked_and_the_page_says_so() -> None:
    text = rendered(campaigns())
    assert '<line class="change"' not in text
    assert "No statistically significant change between campaigns" in text


def test_too_few_campaigns_are_said_to_be_too_few() -> None:
    assert "series of at least 8 campaigns; no series is long enough yet" in rendered(campaigns(1.0)[5:10])


def test_the_page_needs_nothing_from_anywhere_and_is_well_formed() -> None:
    text = rendered(campaigns(1.0))
    assert not re.search(r"https?://(?!www\.w3\.org/2000/svg)|<script [^>]*src|<link|@import|url\(", text)
    open_tags: list[str] = []

    class Balance(HTMLParser):
        def handle_starttag(self, tag: str, attrs: object) -> None:
            if tag not in ("meta", "br"):
                open_tags.append(tag)

        def handle_startendtag(self, tag: str, attrs: object) -> None:
            pass

        def handle_endtag(self, tag: str) -> None:
            assert open_tags.pop() == tag

    Balance().feed(text)
    assert open_tags == []
    assert "A &amp; B &lt;x&gt;" in text
    assert 'href="no%207/report.html"' in text


def test_every_point_lies_inside_its_panel_whatever_its_interval() -> None:
    rows = campaigns(1.0)
    wide = {("F", "static", "mu"): (5.0, -1e6, float("nan"))}
    rows[3] = CampaignRow("wide", "wide", "done", laws=wide)
    for y in re.findall(r'(?:cy|y1|y2)="([\d.-]+)"', rendered(rows)):
        assert 0 <= float(y) <= 136


def test_the_numbers_of_the_figures_stand_in_the_table() -> None:
    lines = trend_csv(campaigns()).splitlines()
    assert lines[0] == "campaign,measured,sample,regime,parameter,value,low,high"
    assert len(lines) == 13


def test_names_with_quotes_commas_and_line_breaks_come_back_from_the_table() -> None:
    names = ('6" wafer, "old"', "a\nb", "plain")
    rows = [CampaignRow(name, "", "done", laws={(f"{name},F", "static", "mu"): (1.0, 0.9, 1.1)}) for name in names]
    back = list(csv.DictReader(io.StringIO(trend_csv(rows), newline="")))
    assert [(row["campaign"], row["sample"]) for row in back] == [(name, f"{name},F") for name in names]


@pytest.mark.parametrize(("after", "verb"), [(1.0, "rises"), (-1.0, "falls")])
def test_a_change_is_said_in_its_direction(after: float, verb: str) -> None:
    rows = campaigns(after)
    ((key, (change,)),) = change_points(series(rows)).items()
    assert verb in change_sentence(key, change, rows)


def site_with(tmp_path: Path, record: dict[str, object] | None, waiting: list[str], listed: bool = True) -> Path:
    """A site of one campaign ``a``, as far as the index looks at it."""
    state = tmp_path / ".tribo"
    (state / "steps" / "a").mkdir(parents=True)
    (tmp_path / "current").mkdir()
    config = {
        "campaigns": {"a": {"waiting": waiting}} if listed else {}, "ready": {"a": {"digest": "D 1 w"}},
    }  # fmt: skip
    (state / "build.json").write_text(json.dumps(config))
    if record is not None:
        known = {"digest": "D 1 w", "status": "done", "problems": [], "finished": "2026-01-02T03:04:05Z"}
        (state / "steps" / "a" / "report.json").write_text(json.dumps({**known, **record}))
    return tmp_path


def test_campaigns_are_ordered_by_the_time_of_measurement_whatever_its_spelling(tmp_path: Path) -> None:
    starts = {
        "a": ["2026-03-02T23:30:00-05:00"], "b": ["2026-03-03T09:00:00+01:00", "2026-03-03 03:00"],
        "c": ["yesterday", "20260302T120000"], "d": ["2026-03-02T11:59"], "e": ["2026-13-45"],
    }  # fmt: skip
    site_with(tmp_path, None, [], listed=False)
    for name, times in starts.items():
        record = {"digest": "D 1 w", "status": "done", "problems": [], "finished": "2026-01-02T03:04:05Z"}
        (tmp_path / ".tribo" / "steps" / name).mkdir(exist_ok=True)
        (tmp_path / ".tribo" / "steps" / name / "report.json").write_text(json.dumps(record))
        (tmp_path / "current" / name).mkdir()
        cells = "".join(f"T{k},,{time}\n" for k, time in enumerate(times))
        (tmp_path / "current" / name / "tests.csv").write_text(f"test_id,set_aside,started_at\n{cells}")
    rows = history(tmp_path)
    assert [row.name for row in rows] == ["d", "c", "b", "a", "e"]
    assert [row.measured for row in rows] == ["2026-03-02", "2026-03-02", "2026-03-03", "2026-03-02", ""]


PROBLEM = {"kind": "k", "what": "no such file", "file": "tests.csv", "row": 2}


@pytest.mark.parametrize(
    ("record", "waiting", "listed", "state", "why"),
    [
        ({}, [], True, "done", ""),
        ({"status": "some_set_aside"}, [], True, "some set aside", ""),
        ({"status": "unusable", "problems": [PROBLEM]}, [], True, "unusable", "tests.csv, row 2: no such file"),
        ({"digest": "older"}, [], True, "failed", "the next build will try it again"),
        (None, [], True, "failed", "the next build will try it again"),
        ({}, ["raw/x.part is being uploaded"], True, "waiting", "raw/x.part is being uploaded"),
        ({}, [], False, "gone", "the last report is kept"),
    ],
)
def test_each_state_of_a_campaign_is_told_with_its_reason(
    tmp_path: Path, record: dict[str, object] | None, waiting: list[str], listed: bool, state: str, why: str
) -> None:
    (row,) = history(site_with(tmp_path, record, waiting, listed))
    assert row.state == state
    assert why in " ".join(row.why)


def test_the_page_is_written_only_where_it_differs(tmp_path: Path) -> None:
    site = site_with(tmp_path, {}, [])
    first = write_index(site)
    before = (site / "current" / "index.html").stat().st_mtime_ns
    assert write_index(site) == first
    assert (site / "current" / "index.html").stat().st_mtime_ns == before


def test_intervals_of_campaigns_that_agree_are_shown_whole() -> None:
    intervals = [(value, value - 0.4, value + 0.4) for value in (2.2361, 2.2362, 2.2363)]
    assert _range(intervals) == pytest.approx((1.8361, 2.6363))


def test_one_absurd_interval_does_not_squeeze_the_others() -> None:
    intervals = [(2.0 + k / 10, 1.9, 2.4) for k in range(5)]
    assert _range([*intervals, (2.1, -500.0, 500.0)]) == pytest.approx((1.9, 2.4))


@pytest.mark.parametrize(("low", "high"), [(2.2351, 2.2363), (0.0, 140.0), (-0.02, 0.03), (4.7, 9.1)])
def test_the_labels_of_an_axis_differ_and_are_near_their_values(low: float, high: float) -> None:
    found = ticks(low, high)
    assert len({text for _, text in found}) == 3
    for value, text in found:
        assert float(text.replace("−", "-")) == pytest.approx(value, abs=(high - low) / 10)


def test_a_campaign_shows_the_sentence_of_its_card_and_its_combined_interval(tmp_path: Path) -> None:
    site = site_with(tmp_path, {}, [])
    out = site / "current" / "a"
    out.mkdir()
    card = {"sentence": "Friction falls.", "counts": "9 tests used", "next_test": {"line": "Weigh the sled."}}
    (out / "card.json").write_text(json.dumps(card))
    head = "sample,regime,mu,mu_low,mu_high,mu_combined_low,mu_combined_high"
    (out / "fits.csv").write_text(f"{head}\nF,static,2.0,1.9,2.1,1.5,2.5\nA,static,2.0,1.9,2.1,,\n")
    (row,) = history(site)
    assert row.laws == {("F", "static", "mu"): (2.0, 1.5, 2.5), ("A", "static", "mu"): (2.0, 1.9, 2.1)}
    shown = page([row], {})
    assert all(words in shown for words in ("Friction falls.", "9 tests used", "Next test: Weigh the sled."))


def test_a_campaign_that_cannot_tell_is_not_green_in_the_index() -> None:
    untold = CampaignRow("a", "a", "done", (), "2026-01-01", has_report=True, verdict="cannot_tell")
    cells = re.findall(r'<span class="mark ([^"]*)">([^<]*)</span>', page([untold], {}))
    assert [text for _, text in cells] == ["done", "? cannot tell"]
    assert all("cannot-tell" in classes.split() for classes, _ in cells)
    style = rendered([untold])
    assert style.index(".mark.cannot-tell") > style.index(".mark.done")  # the later rule of two equals holds
