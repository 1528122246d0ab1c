"""A real browser, and a real report of a small campaign for it to open."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, sync_playwright

CHROMIUM = ("chromium", "chromium-browser", "google-chrome")


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """Debian's chromium, without a network."""
    path = next((found for name in CHROMIUM if (found := shutil.which(name))), None)
    if path is None:
        pytest.skip("no chromium on this machine; .ci/run installs it where it may")
    with sync_playwright() as play:
        opened = play.chromium.launch(executable_path=path, args=["--no-sandbox", "--disable-dev-shm-usage"])
        yield opened
        opened.close()


@pytest.fixture(scope="session")
def out(small_report: Path) -> Path:
    """`tribo report` on the small campaign."""
    return small_report


@dataclass
class Opened:
    """A report in the browser, with everything it asked for and every message it left."""

    page: Page
    context: BrowserContext
    requests: list[str] = field(default_factory=list)
    messages: list[str] = field(default_factory=list)


def open_report(browser: Browser, out: Path, theme: str = "light", width: int = 1280) -> Opened:
    """The report in a fresh window that has no network."""
    context = browser.new_context(
        offline=True, color_scheme="dark" if theme == "dark" else "light", viewport={"width": width, "height": 900}
    )
    opened = Opened(context.new_page(), context)
    opened.page.on("request", lambda request: opened.requests.append(request.url))
    opened.page.on("console", lambda message: opened.messages.append(message.text))
    opened.page.on("pageerror", lambda error: opened.messages.append(str(error)))
    opened.page.goto((out / "report.html").as_uri())
    return opened


@pytest.fixture
def report(browser: Browser, out: Path) -> Iterator[Opened]:
    """The report in a fresh window of its own."""
    opened = open_report(browser, out)
    yield opened
    opened.context.close()
