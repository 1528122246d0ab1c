"""A path that cannot be looked at is not called missing."""

from __future__ import annotations

import errno
import os
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from tribo.cli import main


def test_an_error_of_the_system_is_named_with_its_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real = os.stat

    def failing(path: Any, *given: Any, **named: Any) -> os.stat_result:
        if str(path) == str(tmp_path):
            raise OSError(errno.EIO, "Input/output error", str(path))
        return real(path, *given, **named)

    monkeypatch.setattr(os, "stat", failing)
    ended = CliRunner().invoke(main, ["verify", str(tmp_path)])
    assert (ended.exit_code, ended.stderr) == (1, f"Error: {tmp_path}: input/output error\n")


def test_a_path_that_is_not_there_is_wrong_usage(tmp_path: Path) -> None:
    ended = CliRunner().invoke(main, ["verify", str(tmp_path / "nothing")])
    assert ended.exit_code == 2
    assert "does not exist" in ended.stderr
