"""report.html is one file that needs nothing else, says what the study says and escapes what it did not write."""

from __future__ import annotations

import base64
import hashlib
import re
from collections import Counter
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from report.conftest import Written
from report.laid_out import html
from tribo.records import Study
from tribo.report.content import content
from tribo.report.page import pages_of
from tribo.report.pulls import trace_picture

VOID = {"meta", "br", "link", "img", "hr", "input"}


class Outline(HTMLParser):
    """Open tags, ids and links of a page, and whether every tag was closed in order."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.targets: list[str] = []
        self.tags: Counter[str] = Counter()
        self.sources: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags[tag] += 1
        found = dict(attrs)
        self.ids += [v for k, v in found.items() if k == "id" and v]
        self.targets += [v for k, v in found.items() if k in ("href", "xlink:href") and v]
        self.sources += [v for k, v in found.items() if k in ("src", "srcset", "data") and v]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


@pytest.fixture(scope="module")
def page(written: Written) -> str:
    return (written.out / "report.html").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def outline(page: str) -> Outline:
    parser = Outline()
    parser.feed(page)
    return parser


def test_every_tag_is_closed_in_order(outline: Outline) -> None:
    assert outline.open == []


def test_no_id_stands_twice_and_no_link_leads_nowhere(outline: Outline, written: Written) -> None:
    assert not [i for i, n in Counter(outline.ids).items() if n > 1]
    inside = {t[1:] for t in outline.targets if t.startswith("#")}
    assert inside <= set(outline.ids)
    files = {t for t in outline.targets if not t.startswith("#")}
    assert {f.rsplit(".", 1)[1] for f in files} == {"svg", "pdf", "png", "csv"}
    assert all((written.out / f).is_file() for f in files)


def test_the_page_fetches_nothing_and_runs_only_the_script_its_policy_names(page: str, outline: Outline) -> None:
    assert all(target.startswith(("#", "figures/")) for target in outline.targets)
    assert outline.sources == []
    (script,) = re.findall(r"<script>(.*?)</script>", page, flags=re.DOTALL)
    policy = re.search(r'http-equiv="Content-Security-Policy" content="([^"]*)"', page)
    assert policy is not None
    digest = base64.b64encode(hashlib.sha256(script.encode("utf-8")).digest()).decode()
    assert f"script-src 'sha256-{digest}'" in policy[1]
    assert "default-src 'none'" in policy[1]
    assert outline.tags["script"] == 3  # the other two hold data
    assert page.count('type="application/json"') == 2
    assert "@import" not in page
    assert not re.search(r"url\((?!#)", page)


def test_names_from_the_campaign_are_escaped(page: str) -> None:
    assert "<synthetic>" not in page
    assert "&lt;synthetic&gt;" in page
    assert "excluded by hand: &lt;wire&gt;" in page


def test_every_pull_and_every_test_set_aside_is_on_the_page(page: str, study: Study) -> None:
    for test_id in study.ingested.pulls:
        assert page.count(f'data-id="{test_id}"') == 1
    for test_id in ("T9001", study.ingested.campaign.tests[-1].test_id):
        assert f'<th scope="row">{test_id}</th>' in page
    assert page.count('class="trace"') == len(study.ingested.traces)


@pytest.mark.slow
def test_the_page_draws_its_figures_itself_where_none_are_given(measured: Study, page: str) -> None:
    drawn = html(measured).count("<figure")
    assert drawn == 8  # with T and T/N against load, and every test, of a report without the model
    assert page.count("<figure") == 8


def test_figures_take_the_colours_of_the_theme(page: str, outline: Outline) -> None:
    assert outline.tags["figure"] == 8
    assert "fill: #ffffff" not in page
    assert "stroke: #000000" not in page
    assert "prefers-color-scheme: dark" in page
    assert 'name="viewport"' in page


def test_provenance_is_told(page: str) -> None:
    assert "tribo report &#39;a b&#39; -o out" in page
    assert "2026-01-01T00:00:00" in page


def test_the_page_holds_no_undefined_numbers(page: str) -> None:
    words = re.sub(r"<(svg|style|script)\b.*?</\1>", "", page, flags=re.DOTALL)
    assert not re.search(r"\b(nan|inf|None)\b", words)


def test_a_study_without_a_model_says_nothing_of_it(study: Study) -> None:
    page = html(replace(study, comparison=None, simulated=None, example_runs=()), drawn={})
    assert 'id="agreement"' not in page
    assert "Simulated" not in page
    assert 'id="table2"' in page


def test_an_ingested_campaign_alone_has_a_page(study: Study) -> None:
    page = html(Study(study.ingested), drawn={})
    assert 'id="pulls"' in page
    assert 'id="table2"' not in page


def test_a_trace_of_one_sample_has_no_picture(study: Study) -> None:
    trace, pull = study.ingested.traces["T0001"], study.ingested.pulls["T0001"]
    one = replace(trace, time_s=trace.time_s[:1], force_N=trace.force_N[:1])
    assert trace_picture(one, pull) == ""
    assert trace_picture(trace, replace(pull, peak_s=float("nan"))).count("<circle") == 0


def test_a_sample_that_could_not_be_fitted_leaves_dashes(study: Study) -> None:
    broken = tuple(
        replace(f, values=np.full(2, np.nan), covariance=np.full((2, 2), np.nan), dof=0.0) if f.sample == "B" else f
        for f in study.fits
    )
    broken_page = html(replace(study, fits=broken), drawn={})
    words = re.sub(r"<(svg|style|script)\b.*?</\1>", "", broken_page, flags=re.DOTALL)
    assert not re.search(r"\b(nan|inf)\b", words)
    assert "<td>–</td>" in words


def test_many_pulls_are_spread_over_pages_that_link_each_other(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tribo.report.pulls.PULLS_A_PAGE", 40)
    pages = pages_of(content(study, None, None), {})
    read = {t.test_id for t in study.ingested.campaign.tests if t.test_id in study.ingested.traces}
    read |= set(study.ingested.by_hand)
    shown = {name: re.findall(r'data-id="([^"]*)"', page) for name, page in pages.items()}
    assert list(pages) == ["report.html", *(f"pulls-{k}.html" for k in range(2, -(-len(read) // 40) + 1))]
    assert sorted(i for ids in shown.values() for i in ids) == sorted(read)
    assert set(study.ingested.by_hand) <= set(shown["report.html"])
    for name, page in pages.items():
        parser = Outline()
        parser.feed(page)
        assert parser.open == []
        assert {f"{other}#pulls" for other in pages if other != name} <= set(parser.targets)
        assert f"shows {len(shown[name])} of {len(read)} pulls" in page
        (script,) = re.findall(r"<script>(.*?)</script>", page, re.DOTALL)
        digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
        assert f"script-src 'sha256-{digest}'" in page
