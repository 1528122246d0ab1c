"""tribo discover on a campaign on disk."""

from __future__ import annotations

import json
from pathlib import Path

from on_the_command_line import run


def test_a_law_that_is_none_is_refused_before_anything_is_read(small_campaign: Path, tmp_path: Path) -> None:
    law = tmp_path / "law.toml"
    law.write_text('schema = "tribo.law/1"\n')
    result = run("discover", small_campaign, "-o", tmp_path / "out", "--with", law)
    assert result.exit_code == 1
    assert "acts_on" in result.output
    assert not (tmp_path / "out" / "discovery.json").exists()


def test_what_was_searched_is_written_with_its_provenance(small_campaign: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert run("discover", small_campaign, "-o", out, "--jobs", 1, "-q").exit_code in (0, 3)
    record = json.loads((out / "discovery.json").read_text())
    assert record["laws_tried"] > 1000
    assert {"discovery.json", "laws.csv"} <= set(json.loads((out / "provenance.json").read_text())["outputs"])
