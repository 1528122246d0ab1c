"""A request to end a command leaves no unfinished file, however often it is made."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest

from tribo.cli.console import ended_by_terminate
from tribo.files import whole_file


def test_a_second_request_does_not_interrupt_the_removal_of_unfinished_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    removed = Path.unlink

    def asked_again(path: Path, missing_ok: bool = False) -> None:
        os.kill(os.getpid(), signal.SIGTERM)
        removed(path, missing_ok=missing_ok)

    monkeypatch.setattr(Path, "unlink", asked_again)
    with pytest.raises(KeyboardInterrupt), ended_by_terminate(), whole_file(tmp_path / "a.csv") as part:  # noqa: PT012
        part.write_text("half")
        os.kill(os.getpid(), signal.SIGTERM)
    assert list(tmp_path.iterdir()) == []


def test_afterwards_requests_are_answered_as_before() -> None:
    before = signal.getsignal(signal.SIGTERM)
    with pytest.raises(KeyboardInterrupt), ended_by_terminate():
        os.kill(os.getpid(), signal.SIGTERM)
    assert signal.getsignal(signal.SIGTERM) == before
