"""Questions of a user, asked of the search of the built documentation in headless Chromium.

    make docs
    python docs/extensions/search_questions.py out/docs

Each question is answered by one of the pages beside it; counted is whether one of them is among the first three hits.
"""

from __future__ import annotations

import argparse
import shutil
from pathlib import Path
from urllib.parse import quote

from playwright.sync_api import Page, sync_playwright

FIRST = 3
# as a user types them -> pages that answer
QUESTIONS: dict[str, tuple[str, ...]] = {
    "cavity shear deformation": ("reference/mechanisms",),
    "suction": ("reference/mechanisms",),
    "what is static friction": ("concepts/records", "reference/glossary", "reference/traces"),
    "stick-slip": ("howto/stick-slip",),
    "exclude a pull": ("howto/overrides", "howto/read-your-report"),
    "sliding window moved by hand": ("howto/overrides", "howto/read-your-report"),
    "decimal comma": ("howto/when-something-is-wrong", "reference/export-formats", "howto/wide-tables",
                      "tutorials/my-own-tribometer", "howto/start-from-exports"),
    "slider mass": ("howto/when-something-is-wrong", "reference/files", "tutorials/first-campaign",
                    "reference/campaigns"),
    "no flat sample": ("howto/when-something-is-wrong", "howto/rotary-rig", "howto/sliding-only-rigs",
                       "concepts/limits", "reference/limits"),
    "law of my own formula": ("howto/discover-a-law", "howto/new-mechanism"),
    "law.toml": ("howto/discover-a-law", "reference/files"),
    "pin on disc": ("howto/rotary-rig",),
    "reciprocating strokes": ("howto/reciprocating-rig",),
    "confidence interval of mu": ("concepts/fitting", "results/interval-coverage", "results/combined-coverage",
                                  "reference/fitting"),
    "wire angle uncertainty": ("concepts/fitting", "reference/files", "howto/read-your-report", "reference/fitting",
                               "reference/glossary"),
    "figures for a manuscript": ("howto/figures-for-a-manuscript",),
    "how to cite": ("howto/figures-for-a-manuscript",),
    "next test": ("results/next-tests", "howto/read-your-report", "concepts/diagnosis", "reference/files"),
    "run every night": ("howto/schedule-builds",),
    "exit status": ("reference/commands", "howto/when-something-is-wrong"),
}  # fmt: skip


def hits(page: Page, built: Path, question: str) -> list[str]:
    """The pages that the search lists first, by their names without ending."""
    page.goto(f"{(built / 'search.html').resolve().as_uri()}?q={quote(question)}")
    page.wait_for_function("document.querySelector('.search-summary')?.textContent.match(/found|did not match/)")
    links = page.locator("ul.search li > a").evaluate_all("all => all.map(a => a.getAttribute('href'))")
    return [str(link).split("#")[0].split("?")[0].removesuffix(".html").removeprefix("./") for link in links][:FIRST]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("built", type=Path)
    built = parser.parse_args().built
    answered = 0
    with sync_playwright() as play:
        path = shutil.which("chromium") or shutil.which("google-chrome")
        browser = play.chromium.launch(executable_path=path, args=["--no-sandbox", "--allow-file-access-from-files"])
        page = browser.new_page(offline=True)
        for question, pages in QUESTIONS.items():
            found = hits(page, built, question)
            good = bool(set(found) & set(pages))
            answered += good
            print(f"{'answered' if good else 'MISSED  '}  {question}: {', '.join(found) or 'nothing'}")
        browser.close()
    print(f"{answered} of {len(QUESTIONS)} questions are answered by the first {FIRST} hits")
    raise SystemExit(answered < len(QUESTIONS))


if __name__ == "__main__":
    main()
