"""The pictures of docs/howto/read-your-report.md, taken from a report with headless Chromium.

    python docs/extensions/report_pictures.py out/demo/report.html docs/figures

Each picture is one element of the page, saved as a PNG of at most 256 colours.
"""

from __future__ import annotations

import argparse
import io
import shutil
from pathlib import Path

from PIL import Image
from playwright.sync_api import Page, sync_playwright

# file name -> CSS selector of the element that it shows
PICTURES = {
    "report-ratio": "#figure-agreement",
    "report-sliding-window": "#figure-fig3",
    "report-law": "#table2 div.wide",
    "report-agreement": "#agreement div.wide",
    "report-misfit": "#figure-misfit",
}
WIDTH = 1150


def take(page: Page, selector: str) -> Image.Image:
    """The first element that ``selector`` finds."""
    return Image.open(io.BytesIO(page.locator(selector).first.screenshot()))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("report", type=Path)
    parser.add_argument("folder", type=Path)
    arguments = parser.parse_args()
    browser_path = shutil.which("chromium") or shutil.which("google-chrome")
    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path=browser_path, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": WIDTH, "height": 900}, color_scheme="light", offline=True)
        page.goto(arguments.report.resolve().as_uri())
        page.locator("#pull-list button.name").first.click()
        page.locator("#pull").screenshot(path=arguments.folder / "report-pull.png")
        page.keyboard.press("Escape")
        for name, selector in PICTURES.items():
            picture = take(page, selector).convert("RGB").quantize(256)
            picture.save(arguments.folder / f"{name}.png", optimize=True)
        browser.close()


if __name__ == "__main__":
    main()
