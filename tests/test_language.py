"""Sentences that readers stumbled over do not come back, in code, templates, docs or the README."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
READ = ("tribo/**/*.py", "tribo/**/*.html", "tribo/**/*.js", "tribo/**/*.typ", "docs/**/*.md", "README.md")
STUMBLED_OVER = (
    "and do nothing", "as repeats say", "could have shown", "hand back", "hands back", "left for the next round",
    "read elsewhere", "scatters alike", "the oddest", "their siblings", "walk the street", "walked by one campaign",
    "what a person decided", "what of the inputs", "what speaks for", "what weighs most", "who needs single runs",
)  # fmt: skip


def running_text(text: str) -> str:
    """Lower case, lines joined, string literals that follow each other joined."""
    return re.sub(r"\s+", " ", re.sub(r'"\s*\n\s*f?"', "", text)).lower()


@pytest.fixture(scope="module")
def texts() -> dict[str, str]:
    files = [path for pattern in READ for path in sorted(ROOT.glob(pattern))]
    return {str(path.relative_to(ROOT)): running_text(path.read_text(encoding="utf-8")) for path in files}


@pytest.mark.parametrize("phrase", STUMBLED_OVER)
def test_a_phrase_that_readers_stumbled_over_stays_away(phrase: str, texts: dict[str, str]) -> None:
    assert len(texts) > 200
    assert not [file for file, text in texts.items() if phrase in text]


def test_a_phrase_is_found_across_lines_and_literals() -> None:
    assert "read elsewhere" in running_text('say("Read "\n    f"elsewhere\n  by hand")')
