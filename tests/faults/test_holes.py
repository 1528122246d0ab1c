"""The page of what is tried to lose a result names a test for every hole, and each of them exists."""

from __future__ import annotations

import re
from pathlib import Path

TESTS = Path(__file__).resolve().parents[1]
PAGE = TESTS.parent / "docs" / "results" / "torture.md"


def test_every_hole_has_a_test_that_exists() -> None:
    holes = PAGE.read_text(encoding="utf-8").partition("| hole |")[2].splitlines()[2:]
    cells = [line.rpartition(" | ")[2] for line in holes if line.startswith("|") and "**" not in line]
    named = [re.findall(r"`([\w/]+\.py)::(\w+)`", cell) for cell in cells]
    assert len(named) >= 45
    assert all(named)
    sources = {file: (TESTS / file).read_text(encoding="utf-8") for tests in named for file, _ in tests}
    assert [name for tests in named for file, name in tests if f"def {name}(" not in sources[file]] == []
