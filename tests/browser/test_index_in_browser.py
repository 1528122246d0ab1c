"""The index page of many campaigns in a real browser: offline, silent, accessible, no wider than a phone."""

from __future__ import annotations

import shutil
from pathlib import Path

import pandas as pd
import pytest
from axe_playwright_python.sync_playwright import Axe
from pipeline.test_index_page import campaigns, rendered
from playwright.sync_api import Browser, expect

from tribo.report.compare_reports import common_load_N, differences, read_reported, sentences
from tribo.site.history import CampaignRow
from tribo.site.index_page import comparable, page as index_page


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [390, 1280])
def test_the_index_opens_offline_in_silence_and_axe_finds_nothing(
    browser: Browser, tmp_path: Path, scheme: str, width: int
) -> None:
    (tmp_path / "index.html").write_text(rendered(campaigns(1.0)), encoding="utf-8")
    context = browser.new_context(color_scheme=scheme, offline=True, viewport={"width": width, "height": 800})
    page = context.new_page()
    said: list[str] = []
    page.on("console", lambda message: said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.goto(f"file://{tmp_path}/index.html")
    assert said == []
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert [v["id"] for v in Axe().run(page).response["violations"]] == []
    page.locator(".trend a").first.focus()
    assert "no 0: 4." in str(page.evaluate("document.activeElement.getAttribute('aria-label')"))
    context.close()


NAMES = ("first", "2nd <b>", "third")


@pytest.fixture(scope="module")
def site(small_report: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An index of three reports; in the second, static friction of B is 30 % higher."""
    folder = tmp_path_factory.mktemp("site")
    for name in NAMES:
        shutil.copytree(small_report, folder / name, ignore=shutil.ignore_patterns("kept", "*.pdf", "*.png"))
    path = folder / NAMES[1] / "fits.csv"
    fits = pd.read_csv(path)
    here = (fits["sample"] == "B") & (fits["regime"] == "static")
    fits.loc[here, [c for c in fits.columns if c.startswith(("mu", "tau0"))]] *= 1.3
    fits.loc[here, [c for c in fits.columns if c.startswith("cov")]] *= 1.3**2
    fits.to_csv(path, index=False)
    rows = [CampaignRow(name, name, "done", has_report=True) for name in NAMES]
    (folder / "index.html").write_text(index_page(rows, {}, (), comparable(folder, NAMES)), encoding="utf-8")
    return folder


def amounts(cells: list[str]) -> list[list[float]]:
    return [
        [float(part) for part in text.replace("−", "-").replace(" to ", " (").rstrip(")").split(" (")] for text in cells
    ]


def test_two_campaigns_chosen_on_the_index_stand_side_by_side_with_the_numbers_of_compare_reports(
    browser: Browser, site: Path
) -> None:
    context = browser.new_context(color_scheme="dark", offline=True, viewport={"width": 390, "height": 844})
    page = context.new_page()
    said: list[str] = []
    page.on("console", lambda message: said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.goto((site / "index.html").as_uri())
    boxes = page.locator("input.choose")
    expect(page.locator("#compare-note")).to_have_text("Choose two campaigns in the table above.")
    boxes.nth(0).check()
    expect(page.locator("#compare-note")).to_contain_text("one more campaign")
    for k in (2, 1):  # a third choice replaces the first
        boxes.nth(k).check()
    shown = [str(box.get_attribute("value")) for box in boxes.all() if box.is_checked()]
    assert shown == [NAMES[1], NAMES[0]]  # newest first in the table
    first, second = (read_reported(site / name) for name in (NAMES[0], NAMES[1]))
    table, load = differences(first, second), common_load_N(first, second)
    rows = page.locator("#compared tbody tr")
    assert rows.count() == len(table) > 0
    columns = {name: amounts(page.locator(f"#compared tbody td:nth-child({at})").all_inner_texts())
               for name, at in (("first", 4), ("second", 5))}  # fmt: skip
    for name, cells in columns.items():
        expected = table[[name, f"{name}_low", f"{name}_high"]].to_numpy()
        assert [x for cell in cells for x in cell] == pytest.approx(expected.ravel(), rel=5e-3, abs=1e-9)
    marked = page.locator("#compared td.model-too-high")
    assert marked.count() == int(table["distinct"].sum())
    expect(page.locator("#compared .findings")).to_have_text(sentences(table, load)[0])
    pictures = page.locator("#compared img")
    assert pictures.count() == 2 * len(set(first.pictures()) & set(second.pictures())) > 8
    pictures.last.scroll_into_view_if_needed()
    assert page.evaluate("Promise.all([...document.images].map((i) => i.decode().then(() => i.naturalWidth > 0)))")
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    assert [v["id"] for v in Axe().run(page).response["violations"]] == []
    boxes.nth(2).uncheck()
    expect(page.locator("#compared")).to_be_empty()
    assert said == []
    context.close()
