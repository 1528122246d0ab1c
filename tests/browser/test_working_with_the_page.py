"""What one works with on the page: folding, sorting, figures to quote and to save, decisions kept and loaded back."""

from __future__ import annotations

from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from browser.conftest import Opened, open_report


def exclude(page: Page, test_id: str, reason: str) -> None:
    page.click(f"[data-id={test_id}] button.name")
    page.check("#hand-exclude")
    page.fill("#hand-reason", reason)
    page.click("#pull-close")


def test_a_section_folds_stays_folded_and_opens_where_a_link_leads_into_it(report: Opened) -> None:
    page = report.page
    button = page.locator("#figures > h2 > button")
    expect(button).to_have_attribute("aria-expanded", "true")
    button.click()
    expect(page.locator("#figure-fig4")).to_be_hidden()
    page.reload()
    expect(page.locator("#figures > h2 > button")).to_have_attribute("aria-expanded", "false")
    page.evaluate("location.hash = '#figure-fig4'")
    expect(page.locator("#figure-fig4")).to_be_visible()
    page.click("#fold-all")
    expect(page.locator("#provenance dl")).to_be_hidden()
    page.emulate_media(media="print")
    expect(page.locator("#provenance dl")).to_be_visible()
    assert report.messages == []


def test_a_table_sorts_by_the_numbers_of_a_column(report: Opened) -> None:
    page = report.page
    table = page.locator("#table2 table").first
    head = table.locator("th", has_text="μ").first
    for direction in ("ascending", "descending"):
        head.locator("button").click()
        expect(head).to_have_attribute("aria-sort", direction)
        shown = [float(t.split("±")[0]) for t in table.locator("tbody tr td:nth-child(3)").all_inner_texts()]
        assert len(set(shown)) > 1
        assert shown == sorted(shown, reverse=direction == "descending")


def test_figures_are_numbered_in_order_and_their_files_are_one_click_away(report: Opened, out: Path) -> None:
    page = report.page
    numbers = [f"Figure {k + 1}" for k in range(page.locator("figure").count())]
    assert page.locator("a.number").all_inner_texts() == numbers
    links = page.locator("main a[href]:not([href^=http])").evaluate_all("all => all.map((a) => a.getAttribute('href'))")
    inside = [link[1:] for link in links if link.startswith("#")]
    assert all(page.locator(f"[id='{name}']").count() == 1 for name in inside)
    files = [link for link in links if not link.startswith("#")]
    assert len(files) == 4 * page.locator("figure").count()
    assert all((out / link).is_file() for link in files)


def test_every_figure_with_points_tells_them_under_the_pointer(report: Opened) -> None:
    page = report.page
    names = page.evaluate("Object.entries(JSON.parse(document.getElementById('figure-data').textContent))"
                          ".filter(([, s]) => s.length).map(([name]) => name)")  # fmt: skip
    assert len(names) >= 6
    for name in names:
        at = page.evaluate(
            """(name) => {
              const s = JSON.parse(document.getElementById('figure-data').textContent)[name][0];
              const svg = document.querySelector(`#figure-${name} svg`);
              const box = svg.getBoundingClientRect();
              scrollBy(0, box.top + s.place[1] / svg.viewBox.baseVal.height * box.height - innerHeight / 2);
              const at = new DOMPoint(s.place[0], s.place[1]).matrixTransform(svg.getScreenCTM());
              return [at.x, at.y];
            }""",
            name,
        )
        page.mouse.move(*at)
        expect(page.locator(".tip"), name).to_be_visible()
        page.mouse.move(2, 2)


def test_decisions_are_kept_while_the_page_is_closed_and_can_be_dropped(report: Opened, out: Path) -> None:
    exclude(report.page, "T003", "sled tipped over")
    beside = report.context.new_page()  # a page that shows the decision: the browser has stored it
    beside.goto((out / "report.html").as_uri())
    while beside.locator("#decision-count").text_content() == "No decisions yet.":
        beside.reload()
    report.page.close()
    again = report.context.new_page()
    again.goto((out / "report.html").as_uri())
    beside.close()  # only now: a browser that shows no page at all may not have written yet what it was told
    expect(again.locator("#decision-count")).to_have_text("Excluded: 1. Moved: 0.")
    expect(again.locator("[data-id=T003]")).to_contain_text("sled tipped over")
    expect(again.locator("#decision-note")).to_contain_text("kept by this browser")
    again.click("#forget-decisions")
    expect(again.locator("#decision-count")).to_have_text("No decisions yet.")
    again.reload()
    expect(again.locator("#decision-count")).to_have_text("No decisions yet.")


def test_overrides_are_loaded_back_and_hostile_rows_stay_text_or_are_left_out(
    browser: Browser, report: Opened, out: Path, tmp_path: Path
) -> None:
    page, reason = report.page, 'he said "no", <img src=x onerror=alert(1)>'
    exclude(page, "T003", reason)
    page.click("[data-id=T005] button.name")
    page.fill("#hand-start", "10")
    page.keyboard.press("Tab")
    page.click("#pull-close")
    with page.expect_download() as waiting:
        page.click("#save-overrides")
    path = tmp_path / "overrides.csv"
    waiting.value.save_as(path)

    opened = open_report(browser, out)
    wrong = ["T999,exclude,x,,,", "T004,<b>,,,,", "T006,move,,late,9,", "__proto__,exclude,,,,"]
    path.write_text(path.read_text() + "\n".join(wrong) + "\n")
    opened.page.set_input_files("#load-overrides", path)
    note = "2 decisions loaded from overrides.csv. 4 rows were left out"
    expect(opened.page.locator("#decision-note")).to_contain_text(note)
    expect(opened.page.locator("#decision-count")).to_have_text("Excluded: 1. Moved: 1.")
    expect(opened.page.locator("[data-id=T003] .decision")).to_contain_text(reason)
    with opened.page.expect_download() as again:
        opened.page.click("#save-overrides")
    assert Path(again.value.path()).read_text().splitlines() == path.read_text().splitlines()[:3]
    (tmp_path / "other.csv").write_text("a,b\n1,2\n")
    opened.page.set_input_files("#load-overrides", tmp_path / "other.csv")
    expect(opened.page.locator("#decision-note")).to_contain_text("was not loaded")
    expect(opened.page.locator("#decision-count")).to_have_text("Excluded: 1. Moved: 1.")
    assert opened.messages == []
    opened.context.close()


@pytest.mark.parametrize("width", [390, 1280])
def test_the_contents_stand_at_the_side_where_there_is_room(browser: Browser, out: Path, width: int) -> None:
    opened = open_report(browser, out, width=width)
    contents, main = (opened.page.locator(s).bounding_box() for s in ("#contents", "#main"))
    assert contents is not None
    assert main is not None
    beside = contents["x"] + contents["width"] <= main["x"]
    assert beside == (width > 1000)
    opened.context.close()
