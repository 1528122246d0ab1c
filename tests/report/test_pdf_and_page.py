"""The PDF says all that the page says, but for what only a reader at a screen needs."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import replace
from html.parser import HTMLParser
from importlib.resources import files
from typing import Any

import pandas as pd
import pytest

from report.synthetic import verdict_of
from report.test_card import FOUND, misfit
from report.test_report_uncertainty import components
from tribo.records import Study
from tribo.report import Provenance
from tribo.report.content import content
from tribo.report.page import PAGE, pages_of
from tribo.report.pdf import record_of

SAID = {"td", "th", "p", "li", "dd", "dt", "caption", "h1", "h2", "h3", "summary"}
FOR_A_SCREEN = {"nav", "dialog", "header", "footer", "script", "style", "svg", "figure"}
# heads of columns that the PDF spells out, and what stands in provenance.json
ELSEWHERE = {"Measured", "Simulated", "Command", "Started", "2026-01-01T00:00:00", "tribo report"}
WORDED_OTHERWISE = (
    "Force against time, after subtraction", "Open a pull to see", "provenance.json holds a hash", "budget.csv lists",
    "Friction law T", "T = μN + τ₀A of every sample", "The local friction coefficients of the model were",
    "= agrees ▲", "In short", "Mechanisms ruled out, and why", "Largest part",
)  # fmt: skip


class Said(HTMLParser):
    """What a page says, cell by cell and paragraph by paragraph."""

    def __init__(self) -> None:
        super().__init__()
        self.skipped, self.open, self.texts = 0, [""], []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = dict(attrs)
        of_a_screen = found.get("class") in ("tools", "cards", "hidden") or "data-with-script" in found
        hidden = tag in FOR_A_SCREEN or of_a_screen
        if self.skipped or hidden:
            self.skipped += tag not in ("br", "meta", "input")
        elif tag in SAID:
            self.open.append("")
        elif tag == "br":
            self.open[-1] += " "

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        pass

    def handle_endtag(self, tag: str) -> None:
        if self.skipped:
            self.skipped -= 1
        elif tag in SAID:
            self.texts.append(self.open.pop())

    def handle_data(self, data: str) -> None:
        if not self.skipped:
            self.open[-1] += data


def plain(text: str) -> str:
    """With single blanks and without brackets, which the PDF has around intervals."""
    return re.sub(r"\s+", " ", text.replace("\u00a0", " ").replace("(", "").replace(")", "")).strip()


def strings(value: Any) -> Iterator[str]:
    if isinstance(value, dict):
        for part in value.values():
            yield from strings(part)
    elif isinstance(value, list | tuple):
        for part in value:
            yield from strings(part)
    else:
        yield str(value)


@pytest.fixture(scope="module")
def whole(study: Study) -> dict[str, Any]:
    """The content of a report in which every section has something to say."""
    rows = [r for s in ("A", "F") for r in components(s, "static", 60.0)]
    notes = ("the load means deviate from a straight line: chi2_red 9.1, p = 1e-05",)
    fits = tuple(replace(f, notes=notes, bent=True) if f.sample == "C" else f for f in study.fits)
    said = {"power": ("two samples apart",), "outlying": ("T0007 is far",)}
    full = replace(study, budget=pd.DataFrame(rows), fits=fits, **said)
    verdict = verdict_of(FOUND | {
        "misfits": [misfit(text="Friction falls.")], "excluded": [{"mechanism": "tilt", "reason": "it acts otherwise"}],
        "equivalent": [["suction", "normal_load_error"]],
    })  # fmt: skip
    return content(full, Provenance("tribo report", "2026-01-01T00:00:00", 3, {"rule": "first_peak"}), verdict)


def test_whatever_the_page_says_stands_in_the_pdf(whole: dict[str, Any]) -> None:
    page = Said()
    page.feed(pages_of(whole, {})[PAGE])
    template = (files("tribo.report") / "templates" / "report.typ").read_text(encoding="utf-8")
    record = json.loads(json.dumps(record_of(whole, {})))
    said = plain(" | ".join([*strings(record), template]))
    assert len(page.texts) > 250
    missing = [
        text for text in dict.fromkeys(map(plain, page.texts))
        if text and text not in said and text not in ELSEWHERE and not text.startswith(WORDED_OTHERWISE)
        and not all(part in said for part in re.split(r" (?=\d)|(?<=\.) |: ", text))
    ]  # fmt: skip
    assert missing == []


def test_the_template_uses_every_part_of_the_record(whole: dict[str, Any]) -> None:
    template = (files("tribo.report") / "templates" / "report.typ").read_text(encoding="utf-8")
    assert [name for name in record_of(whole, {}) if f"data.{name}" not in template] == []
