"""Twenty texts written to do harm: as test, sample, operator, file, note and title they stay text on every page.

A page with these texts must consist of the same elements and attributes as one with harmless words in their places,
and show every one of them as it was written.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from html.parser import HTMLParser
from xml.etree import ElementTree

import pytest
from support import first_quick

from report.laid_out import html, pdf
from report.synthetic import make_study
from tribo.figures.catalogue import FIGURES
from tribo.records import SetAside, Study
from tribo.report import Provenance
from tribo.report.drawings import Drawn, svg_text
from tribo.site.history import CampaignRow
from tribo.site.index_page import change_points, page as index_page

TEXTS = (
    "<script>alert(1)</script>", '"><img src=x onerror=alert(1)>', "'><svg/onload=alert(1)>",
    "</script><script>alert(1)</script>", "</title><script>alert(1)</script>", "</style><style>*{display:none}</style>",
    "<!-- x", "-->]]><b>", "{{ 7 * 7 }}{% raw %}", "javascript:alert(1)", "&lt;script&gt;&#60;&amp;",
    '<a href="javascript:alert(1)">x</a>', '" onmouseover="alert(1)', "' onfocus='alert(1)' autofocus='",
    '<iframe srcdoc="<script>">', '#panic("evil") #read("/etc/passwd")', "]*bold* _low_ #{ \\ `raw`",
    "\u202e</g></svg><script>", "<![CDATA[<x>]]>", "<meta http-equiv=refresh content=0>",
)  # fmt: skip
TAME = tuple(f"text number {k}" for k in range(len(TEXTS)))


def test_there_are_twenty_texts() -> None:
    assert len(set(TEXTS)) == len(TEXTS) == 20


def study_of(texts: Sequence[str]) -> Study:
    """A study whose names are these texts: five per sample, and each of them in a test, a file, an operator, a note."""
    samples = tuple(" | ".join(texts[k : k + 5]) for k in range(0, 20, 5))
    study = make_study(samples, n_specimens=2, n_samples=120)
    ingested = study.ingested
    new = {t.test_id: f"{texts[k % 20]} {k}" for k, t in enumerate(ingested.campaign.tests)}
    tests = tuple(
        replace(
            t, test_id=new[t.test_id], file=f"raw/{new[t.test_id]}", operator=texts[k % 20],
            specimen=f"{t.specimen[-1]} {texts[k // 6 % 20]}", covariates={"batch": texts[k % 20]},
        )
        for k, t in enumerate(ingested.campaign.tests)
    )  # fmt: skip
    aside = tuple(SetAside(f"{text} aside", f"excluded by hand: {text}") for text in texts)
    campaign = replace(
        ingested.campaign, tests=tests, title=" ".join(texts), material=texts[0], counterface=texts[1], set_aside=aside
    )
    traces = {new[i]: replace(t, name=new[i], file=f"raw/{new[i]}") for i, t in ingested.traces.items()}
    pulls = {new[i]: replace(p, test_id=new[i]) for i, p in ingested.pulls.items()}
    read = replace(ingested, campaign=campaign, traces=traces, pulls=pulls, set_aside=aside)
    return replace(study, ingested=read, notes=tuple(texts))


def provenance_of(texts: Sequence[str]) -> Provenance:
    options = {"rule": texts[4], "flat": texts[5]}
    return Provenance(f"tribo report {texts[2]}", "2026-01-01T00:00:00", 3, options, {"tribo": texts[3]})


def drawn_with(texts: Sequence[str]) -> dict[str, Drawn]:
    """A figure whose title and caption are the texts."""
    svg = b'<svg width="1" height="2" viewBox="0 0 1 2"></svg>'
    return {"fig6": Drawn("fig6", " ".join(texts), " ".join(texts), {"svg": svg, "csv": b""})}


class Structure(HTMLParser):
    """Elements with the names of their attributes, links, and the text between them."""

    def __init__(self) -> None:
        super().__init__()
        self.elements: list[tuple[str, tuple[str, ...]]] = []
        self.links: list[str] = []
        self.words: list[str] = []
        self.ended: list[str] = []
        self.other: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, tuple(name for name, _ in attrs)))
        self.links += [value or "" for name, value in attrs if name.endswith("href") or name == "src"]
        self.words += [value or "" for _, value in attrs]

    def handle_endtag(self, tag: str) -> None:
        self.ended.append(tag)

    def handle_data(self, data: str) -> None:
        self.words.append(data)

    def handle_comment(self, data: str) -> None:
        self.other.append(data)

    def handle_decl(self, decl: str) -> None:
        self.other.append(decl)

    def unknown_decl(self, data: str) -> None:
        self.other.append(data)


def parsed(page: str) -> Structure:
    found = Structure()
    found.feed(page)
    found.close()
    return found


def same_structure(hostile: str, tame: str) -> Structure:
    """Assert that both pages are made of the same things; returns what the hostile one consists of."""
    found, wanted = parsed(hostile), parsed(tame)
    assert found.elements == wanted.elements
    assert found.ended == wanted.ended
    assert found.other == wanted.other
    assert not [name for _, names in found.elements for name in names if name.startswith("on")]
    assert not [link for link in found.links if re.match(r"\s*(javascript|vbscript|data):", link)]
    return found


def shown(words: Iterable[str], texts: Iterable[str] = TEXTS) -> set[str]:
    """Texts that stand somewhere on the page as they were written, blanks aside."""
    page = re.sub(r"\s+", "", "\n".join(words))
    return {text for text in texts if re.sub(r"\s+", "", text) in page}


@pytest.fixture(scope="module")
def hostile() -> Study:
    return study_of(TEXTS)


@pytest.fixture(scope="module")
def tame() -> Study:
    return study_of(TAME)


def test_the_report_page_shows_every_text_and_is_made_of_nothing_else(hostile: Study, tame: Study) -> None:
    page = html(hostile, provenance_of(TEXTS), drawn=drawn_with(TEXTS))
    found = same_structure(page, html(tame, provenance_of(TAME), drawn=drawn_with(TAME)))
    assert shown(found.words) == set(TEXTS)


def test_the_data_in_the_report_page_are_read_back_as_they_were(hostile: Study) -> None:
    page = html(hostile, drawn={})
    blocks = re.findall(r'<script type="application/json"[^>]*>(.*?)</script>', page, flags=re.DOTALL)
    assert blocks
    read = "\n".join(json.dumps(json.loads(block), ensure_ascii=False) for block in blocks)
    assert "<script" not in "".join(blocks)
    names = [json.dumps(name, ensure_ascii=False)[1:-1] for name in hostile.ingested.pulls]
    assert all(name in read for name in names)


def index_of(texts: Sequence[str]) -> str:
    rows = []
    for k, text in enumerate(texts):
        laws = {(f"{t} sample", "static", "mu"): (4.8 + k / 9, 4.7, 5.9) for t in texts}
        rows.append(CampaignRow(f"{text} {k}", f"{text} title", "unusable", (text, text), "2026-01-01",
                                has_report=True, laws=laws, verdict=text, verdict_text=text))  # fmt: skip
    return index_page(rows, change_points({}))


def test_the_index_page_shows_every_text_and_is_made_of_nothing_else() -> None:
    found = same_structure(index_of(TEXTS), index_of(TAME))
    assert shown(found.words) == set(TEXTS)


@pytest.mark.parametrize("name", first_quick(["fig4", "fig5", "fig8"]))
def test_a_figure_stays_well_formed_and_holds_the_texts_as_text(name: str) -> None:
    figure = FIGURES[name]
    drawn = figure.draw(figure.numbers(make_study(TEXTS, n_specimens=1, n_samples=60)))
    root = ElementTree.fromstring(svg_text(drawn, " ".join(TEXTS), TEXTS[17]))
    tags = {element.tag.rpartition("}")[2] for element in root.iter()}
    assert not tags & {"script", "a", "img", "iframe", "foreignObject", "meta", "b", "x"}
    assert not [name for element in root.iter() for name in element.attrib if name.startswith("on")]
    (title,) = root.iter("{http://www.w3.org/2000/svg}title")
    assert title.text == " ".join(TEXTS)
    assert shown(element.text for element in root.iter() if element.text and element is not title) == set(TEXTS)


def test_the_document_takes_no_text_for_a_command(hostile: Study) -> None:
    """#panic would end the typesetting, #read would fail: neither may be carried out."""
    assert pdf(hostile, provenance_of(TEXTS), drawn={}).startswith(b"%PDF-")
