"""A dry run ends with the status that the build would end with, as far as it is known before."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from support.campaigns import age, small

from tribo.cli import main

pytest.importorskip("snakemake")


def dry(drop: Path, site: Path, *more: str) -> Result:
    result = CliRunner().invoke(main, ["build", str(drop), "-o", str(site), "--dry-run", *more])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result


def test_an_unusable_campaign_gives_status_3(tmp_path: Path) -> None:
    age(small(tmp_path / "drop" / "good", 1))
    assert dry(tmp_path / "drop", tmp_path / "site", "--settle", "0").exit_code == 0
    (tmp_path / "drop" / "bad").mkdir()
    (tmp_path / "drop" / "bad" / "campaign.toml").write_text("[campaign\n")
    result = dry(tmp_path / "drop", tmp_path / "site", "--settle", "0")
    assert result.exit_code == 3
    assert "unusable: bad" in result.output


def test_a_dry_run_opens_the_exports_of_what_is_due(tmp_path: Path) -> None:
    age(small(tmp_path / "drop" / "good", 1))
    (tmp_path / "drop" / "good" / "raw" / "T002.csv").write_bytes(b"")
    result = dry(tmp_path / "drop", tmp_path / "site", "--settle", "0")
    assert "checked good: 7 tests can be used" in result.output
    assert "1 test would be set aside:\n  T002: raw/T002.csv: the file is empty" in result.output


def test_an_unknown_rule_is_refused_once_and_at_once(tmp_path: Path) -> None:
    age(small(tmp_path / "drop" / "good", 1))
    result = dry(tmp_path / "drop", tmp_path / "site", "--settle", "0", "--rule", "iso8295")
    assert result.exit_code == 1
    assert result.output.count("did you mean iso_8295?") == 1


@pytest.mark.slow
def test_a_workflow_that_cannot_run_gives_status_1(tmp_path: Path) -> None:
    age(small(tmp_path / "drop" / "good", 1))
    (tmp_path / "profile").mkdir()
    (tmp_path / "profile" / "config.yaml").write_text("executor: no-such-executor\n")
    result = dry(tmp_path / "drop", tmp_path / "site", "--profile", str(tmp_path / "profile"))
    assert result.exit_code == 1
    assert "the workflow could not be run" in result.output
