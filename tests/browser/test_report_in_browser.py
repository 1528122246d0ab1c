"""The report in a real browser: offline, silent, usable, accessible; what it hands back is what tribo applies."""

from __future__ import annotations

import shutil
from pathlib import Path

import pandas as pd
import pytest
from axe_playwright_python.sync_playwright import Axe
from click.testing import CliRunner
from playwright.sync_api import Browser, Page, expect
from small_lattices import small_lattices
from support import first_quick

from browser.conftest import Opened, open_report
from tribo.cli import main

SERIOUS = {"serious", "critical"}


def visible(page: Page) -> list[str]:
    """The tests whose cards are shown, in their order."""
    found = page.locator("#pull-list > li:visible")
    return [str(found.nth(k).get_attribute("data-id")) for k in range(found.count())]


def test_it_opens_without_a_network_and_leaves_no_message(report: Opened) -> None:
    expect(report.page.locator("#pull-count")).to_be_visible()
    report.page.wait_for_timeout(200)
    assert [url for url in report.requests if not url.endswith("/report.html")] == []
    assert len(report.requests) == 1
    assert report.messages == []


@pytest.mark.parametrize("width", [390, 1280])
def test_no_page_is_wider_than_its_window(browser: Browser, out: Path, width: int) -> None:
    opened = open_report(browser, out, width=width)
    assert opened.page.evaluate("document.documentElement.scrollWidth") <= width
    opened.context.close()


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize(("width", "height"), [(1280, 800), (390, 844)])
def test_the_first_screen_holds_sentence_counts_and_picture(
    browser: Browser, out: Path, width: int, height: int, theme: str
) -> None:
    opened = open_report(browser, out, theme, width)
    opened.page.set_viewport_size({"width": width, "height": height})
    for part in (".verdict", ".counts", "#short figure svg"):
        box = opened.page.locator(part).first.bounding_box()
        assert box is not None
        assert box["y"] + box["height"] <= height, part
        assert box["x"] + box["width"] <= width, part
    opened.context.close()


def test_filters_show_what_they_say(report: Opened) -> None:
    page = report.page
    assert len(visible(page)) == 24
    page.select_option("#filter-sample", "B")
    page.select_option("#filter-specimen", "B2")
    shown = visible(page)
    assert len(shown) == 4
    assert all(page.locator(f"[data-id={i}]").get_attribute("data-specimen") == "B2" for i in shown)
    expect(page.locator("#pull-count")).to_have_text("4 of 24 pulls")
    page.select_option("#sort", "id")
    assert visible(page) == sorted(shown)
    page.click("#clear-filters")
    assert len(visible(page)) == 24


def test_the_oddest_pull_comes_first(report: Opened) -> None:
    odd = [float(str(c.get_attribute("data-odd"))) for c in report.page.locator("#pull-list > li").all()]
    assert odd == sorted(odd, reverse=True)


def test_a_trace_opens_with_its_marks_and_tells_numbers_under_the_pointer(report: Opened) -> None:
    page = report.page
    page.click("[data-id=T005] button.name")
    expect(page.locator("#pull")).to_be_visible()
    expect(page.locator("#pull-h")).to_have_text("T005")
    assert page.locator("#pull-chart [role=slider]").count() == 3
    box = page.locator("#pull-chart svg").bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + 0.6 * box["width"], box["y"] + 0.5 * box["height"])
    expect(page.locator("#pull-reading")).to_contain_text(" N")
    whole = page.locator("#pull-chart .trace").get_attribute("d")
    page.click("#zoom-in")
    assert page.locator("#pull-chart .trace").get_attribute("d") != whole
    page.click("#zoom-all")
    assert page.locator("#pull-chart .trace").get_attribute("d") == whole
    page.keyboard.press("Escape")
    expect(page.locator("#pull")).to_be_hidden()
    assert page.evaluate("document.activeElement.textContent") == "T005"


def test_a_point_of_a_figure_tells_its_numbers(report: Opened) -> None:
    page = report.page
    place = page.evaluate(
        """() => {
          const series = JSON.parse(document.getElementById('figure-data').textContent).agreement[0];
          const svg = document.querySelector('#figure-agreement svg');
          svg.scrollIntoView({block: 'center'});
          const at = new DOMPoint(series.place[0], series.place[1]).matrixTransform(svg.getScreenCTM());
          return {at: [at.x, at.y], x: series.x, y: series.y, value: series.value.slice(0, 2)};
        }"""
    )
    tip = page.locator(".tip")
    page.mouse.move(place["at"][0] - 30, place["at"][1] - 30)
    expect(tip).to_be_hidden()
    page.mouse.move(*place["at"])
    expect(tip).to_be_visible()
    said = dict(line.rsplit(": ", 1) for line in tip.inner_text().splitlines() if ": " in line)
    assert set(said) == {place["x"], place["y"]}
    shown = [float(said[place[axis]].replace("\u2212", "-")) for axis in ("x", "y")]
    assert shown == pytest.approx(place["value"], rel=1e-3)  # four digits are shown


def moved_start(page: Page) -> float:
    return float(page.input_value("#hand-start"))


def test_a_window_is_moved_by_keys_by_dragging_and_by_number(report: Opened) -> None:
    page = report.page
    page.click("[data-id=T005] button.name")
    start = moved_start(page)
    page.locator("#pull-chart .handle.start").focus()
    page.keyboard.press("Shift+ArrowRight")
    by_key = moved_start(page)
    assert by_key > start
    assert page.evaluate("document.activeElement.dataset.which") == "start"
    grip = page.locator("#pull-chart .handle.start .edge").bounding_box()
    assert grip is not None
    page.mouse.move(grip["x"], grip["y"] + 20)
    page.mouse.down()
    page.mouse.move(grip["x"] + 60, grip["y"] + 20)
    page.mouse.up()
    assert moved_start(page) > by_key
    page.fill("#hand-start", "9.25")
    page.keyboard.press("Tab")
    assert moved_start(page) == 9.25
    expect(page.locator("#pull-says")).to_contain_text("Moved by hand")
    page.click("#hand-reset")
    assert moved_start(page) == start
    expect(page.locator("#decision-count")).to_have_text("No decisions yet.")


def save(page: Page, folder: Path) -> Path:
    with page.expect_download() as waiting:
        page.click("#save-overrides")
    assert waiting.value.suggested_filename == "overrides.csv"
    path = folder / "overrides.csv"
    waiting.value.save_as(path)
    return path


def test_an_exclusion_needs_a_reason(report: Opened, tmp_path: Path) -> None:
    page = report.page
    page.click("[data-id=T003] button.name")
    page.check("#hand-exclude")
    page.click("#pull-close")
    page.click("#save-overrides")
    expect(page.locator("#pull")).to_be_visible()
    expect(page.locator("#pull-says")).to_contain_text("enter a reason")
    page.fill("#hand-reason", 'he said "no", twice')
    page.click("#pull-close")
    table = pd.read_csv(save(page, tmp_path))
    assert table.loc[0, ["test_id", "action", "reason"]].tolist() == ["T003", "exclude", 'he said "no", twice']


@pytest.mark.slow
def test_what_the_page_hands_back_is_applied_and_comes_back_on_the_next_page(
    browser: Browser, report: Opened, small_campaign: Path, out: Path, tmp_path: Path
) -> None:
    page = report.page
    page.click("[data-id=T003] button.name")
    page.check("#hand-exclude")
    page.fill("#hand-reason", "sled tipped over")
    page.click("#pull-close")
    page.click("[data-id=T005] button.name")
    page.fill("#hand-start", "10")
    page.keyboard.press("Tab")
    page.fill("#hand-reason", "drift at first")
    page.click("#pull-close")
    expect(page.locator("#decision-count")).to_have_text("Excluded: 1. Moved: 1.")
    overrides = save(page, tmp_path)
    assert report.messages == []

    anew = tmp_path / "out"
    shutil.copytree(out / "kept", anew / "kept")  # what does not hang on the decisions is not made again
    given = ["--runs", "2", "-q", "--overrides", str(overrides)]
    with small_lattices():  # what is simulated is not looked at
        result = CliRunner().invoke(main, ["report", str(small_campaign), "-o", str(anew), *given])
    assert result.exit_code == 0, result.output
    before, after = (pd.read_csv(folder / "tests.csv").set_index("test_id") for folder in (out, anew))
    assert "sled tipped over" in after.loc["T003", "set_aside"]
    assert pd.isna(after.loc["T003", "sliding_N"])
    assert after.loc["T005", "window_start_s"] == pytest.approx(10, abs=0.1)
    assert after.loc["T005", "sliding_N"] != before.loc["T005", "sliding_N"]
    assert after.loc["T005", "static_N"] == before.loc["T005", "static_N"]
    assert before.loc["T003", "sample"] == after.loc["T003", "sample"]
    counts = [pd.read_csv(f / "fits.csv").query(f"sample == '{before.loc['T003', 'sample']}'") for f in (out, anew)]
    assert (counts[0]["n_tests"] - counts[1]["n_tests"]).tolist() == [1, 1]

    opened = open_report(browser, anew)
    again = opened.page
    expect(again.locator("#decision-count")).to_have_text("Excluded: 1. Moved: 1.")
    expect(again.locator("[data-id=T003]")).to_contain_text("Excluded by hand (sled tipped over).")
    expect(again.locator("#measured")).to_contain_text("drift at first")
    assert save(again, tmp_path / "again").read_bytes() == overrides.read_bytes()
    assert opened.messages == []
    opened.context.close()


def test_it_prints_to_pdf_with_every_pull_and_no_buttons(report: Opened) -> None:
    content = report.page.pdf(format="A4")
    assert content.startswith(b"%PDF-")
    report.page.emulate_media(media="print")
    expect(report.page.locator("#pull-tools")).to_be_hidden()
    expect(report.page.locator("#pull-list > li").first).to_be_visible()
    expect(report.page.get_by_text("Surface roughness and preparation")).to_be_visible()  # folded on screen


def test_without_scripts_everything_is_still_there(browser: Browser, out: Path) -> None:
    context = browser.new_context(java_script_enabled=False, offline=True)
    page = context.new_page()
    page.goto((out / "report.html").as_uri())
    assert page.locator("#pull-list > li:visible").count() == 24
    expect(page.locator("#pull-tools")).to_be_hidden()
    expect(page.locator("#figure-agreement svg")).to_be_visible()
    context.close()


@pytest.mark.parametrize("theme", first_quick(["dark", "light"]))
def test_axe_finds_nothing_serious(browser: Browser, out: Path, theme: str) -> None:
    opened = open_report(browser, out, theme)
    page = opened.page
    page.evaluate("document.querySelectorAll('details').forEach((d) => { d.open = true; })")
    violations = Axe().run(page).response["violations"]
    page.click("[data-id=T005] button.name")
    violations += Axe().run(page, context="#pull").response["violations"]
    told = [(v["id"], v["nodes"][0]["html"][:200]) for v in violations if v["impact"] in SERIOUS]
    assert told == []
    opened.context.close()
