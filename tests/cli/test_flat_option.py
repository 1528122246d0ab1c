"""A flat sample that was asked for is the one that is used, or the command ends and says which there are."""

from __future__ import annotations

from pathlib import Path

import pytest
from on_the_command_line import run


@pytest.mark.parametrize("command", ["report", "compare", "predict", "diagnose", "discover"])
def test_a_flat_sample_that_was_not_measured_ends_every_command(
    command: str, small_campaign: Path, tmp_path: Path
) -> None:
    found = run(command, small_campaign, "-o", tmp_path / "out", "--flat", "Q", "-q")
    assert found.exit_code == 1
    assert "Q" in found.stderr
    assert "--flat F" in found.stderr
