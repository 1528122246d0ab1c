"""Progress as plain lines: what is left is judged by what this start has done."""

from __future__ import annotations

import pytest

from tribo.cli.console import Console


def test_time_left_counts_only_what_this_start_did(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    """Ninety of a hundred runs were there before; two more took 20 s, so the other eight take 80 s."""
    now = [1000.0]
    monkeypatch.setattr("tribo.cli.console.time.monotonic", lambda: now[0])
    with Console().progress() as report:
        report("simulating", 90, 100)
        now[0] += 20.0
        report("simulating", 92, 100)
        now[0] += 80.0
        report("simulating", 100, 100)
    said = capsys.readouterr().err.splitlines()
    assert said == ["simulating: 92 of 100 (20 s, 80 s left)", "simulating: 100 of 100 (100 s)"]
