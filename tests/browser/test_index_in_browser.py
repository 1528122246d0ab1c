"""The index page of many campaigns in a real browser: offline, silent, accessible, no wider than a phone."""

from __future__ import annotations

from pathlib import Path

import pytest
from axe_playwright_python.sync_playwright import Axe
from pipeline.test_index_page import campaigns, rendered
from playwright.sync_api import Browser


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
