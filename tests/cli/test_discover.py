"""tribo discover on a campaign on disk."""

from __future__ import annotations

import json
from pathlib import Path

from click.testing import CliRunner

from tribo.cli import main


def run(*arguments: str) -> tuple[int, str]:
    result = CliRunner().invoke(main, list(arguments))
    return result.exit_code, result.output


def test_a_law_that_is_none_is_refused_before_anything_is_read(small_campaign: Path, tmp_path: Path) -> None:
    law = tmp_path / "law.toml"
    law.write_text('schema = "tribo.law/1"\n')
    status, said = run("discover", str(small_campaign), "-o", str(tmp_path / "out"), "--with", str(law))
    assert status == 1
    assert "acts_on" in said
    assert not (tmp_path / "out" / "discovery.json").exists()


def test_what_was_searched_is_written_with_its_provenance(small_campaign: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    status, _ = run("discover", str(small_campaign), "-o", str(out), "--jobs", "1", "-q")
    assert status in (0, 3)
    record = json.loads((out / "discovery.json").read_text())
    assert record["laws_tried"] > 1000
    assert {"discovery.json", "laws.csv"} <= set(json.loads((out / "provenance.json").read_text())["outputs"])
