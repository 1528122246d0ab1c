"""Progress as plain lines, with the time left judged by what this start has done; sentences wrapped on a terminal."""

from __future__ import annotations

import pytest

from tribo.cli.console import Console, wrapped


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


def test_on_a_terminal_sentences_are_wrapped_and_tables_are_not() -> None:
    table = "sample   mu    tau0 (kPa)   T (N)   specimens   tests"
    sentence = "  cause, weight 0.90: " + "normal load error " * 6
    lines = wrapped(f"{table}\n{sentence.rstrip()}", 40).splitlines()
    assert lines[0] == table
    assert all(len(line) <= 40 for line in lines[1:])
    assert " ".join(line.strip() for line in lines[1:]) == sentence.strip()
    assert {line[:4] for line in lines[2:]} == {"    "}
