"""Errors of the system and of tribo itself end a command with sentences and status 1; --debug shows the traceback."""

from __future__ import annotations

import errno
import logging
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from on_the_command_line import run

from tribo.campaign import load_campaign
from tribo.cli.console import Console, problems_of
from tribo.cli.workflow_step import run_step
from tribo.errors import Problem, ReadError, SimulationError, TriboError, is_of_the_system, system_problem
from tribo.readers import source


@pytest.fixture(autouse=True)
def _level_of_the_log_returns() -> Iterator[None]:
    level = logging.getLogger("tribo").level
    yield
    logging.getLogger("tribo").setLevel(level)


FULL = OSError(errno.ENOSPC, "No space left on device")


def test_a_value_of_any_length_is_shown_by_its_start_and_end() -> None:
    said = str(Problem("wrong_value", "not a number", found="first" + "\0" * 100_000 + "last"))
    assert len(said) < 2100
    assert "'first" in said
    assert "last'" in said


def test_a_full_disk_is_named_with_the_file_that_was_being_written(
    small_campaign: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(self: Path, content: bytes) -> int:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    result = run("ingest", small_campaign, "-o", tmp_path / "out")
    assert result.exit_code == 1
    assert f"{tmp_path / 'out' / 'tests.csv'}: no space left on device" in result.stderr
    assert "Traceback" not in result.stderr


def test_a_folder_that_cannot_be_made_is_named(small_campaign: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    result = run("ingest", small_campaign, "-o", tmp_path / "file" / "out")
    assert result.exit_code == 1
    assert str(tmp_path / "file" / "out") in result.stderr
    assert "not a directory" in result.stderr


def test_a_name_that_is_too_long_is_named(small_campaign: Path, tmp_path: Path) -> None:
    result = run("ingest", small_campaign, "-o", tmp_path / ("x" * 300))
    assert result.exit_code == 1
    assert "file name too long" in result.stderr


def test_an_error_of_tribo_is_a_sentence_and_with_debug_a_traceback(
    small_campaign: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def broken(*_: object, **__: object) -> None:
        raise ValueError("Invalid \x1b[31m character")

    monkeypatch.setattr("tribo.stages.study", broken)
    result = run("fit", small_campaign, "-o", tmp_path / "out", "--debug")
    assert result.exit_code == 1
    assert "because of an error in tribo (ValueError: Invalid \\x1b[31m character)" in result.stderr
    assert any(record.exc_info for record in caplog.records)
    caplog.clear()
    assert run("fit", small_campaign, "-o", tmp_path / "out").exit_code == 1
    assert not caplog.records


def test_nothing_that_a_terminal_obeys_reaches_it(capsys: pytest.CaptureFixture[str]) -> None:
    Console().say("T\x1b[31m1\x9b\u202e: \ttab\nnext")
    Console().result({}, "mean \x07of \x1b]0;title")
    said = capsys.readouterr()
    assert said.err == "T\\x1b[31m1\\x9b\\u202e: \ttab\nnext\n"
    assert said.out == "mean \\x07of \\x1b]0;title\n"


@pytest.mark.parametrize(("kind", "status", "recorded"), [("system", 1, False), ("no_load", 0, True)])
def test_a_step_of_a_build_that_the_machine_failed_is_tried_again(
    kind: str, status: int, recorded: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said = {"problems": [{"kind": kind, "what": "x"}]}
    monkeypatch.setattr("tribo.cli.workflow_step._run", lambda command: (1, said))
    assert run_step(tmp_path / "fit.json", ["fit"], "digest") == status
    assert (tmp_path / "fit.json").is_file() is recorded


@pytest.mark.parametrize(("cause", "kind"), [(PermissionError(13, "x"), "system"), (FileNotFoundError(2, "x"), "no")])
def test_what_an_error_of_the_system_caused_is_no_fault_of_the_input(cause: OSError, kind: str) -> None:
    why = SimulationError(Problem("no", "cannot be read", file="a.nc"))
    why.__cause__ = cause
    assert [(p.kind, p.what, p.file) for p in problems_of(why)] == [(kind, "cannot be read", "a.nc")]


def test_a_step_of_a_build_that_ends_without_a_word_on_its_input_is_tried_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tribo.cli.workflow_step._run", lambda command: (1, {}))
    assert run_step(tmp_path / "fit.json", ["fit"], "digest") == 1
    assert not (tmp_path / "fit.json").exists()


@pytest.mark.parametrize(("kind", "status", "recorded"), [("system", 3, False), ("no_load", 0, True)])
def test_a_step_of_a_build_without_a_test_that_the_machine_could_not_read_is_tried_again(
    kind: str, status: int, recorded: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said = {"set_aside": [{"test_id": "T1", "reason": "x", "problems": [{"kind": kind, "what": "x"}]}]}
    monkeypatch.setattr("tribo.cli.workflow_step._run", lambda command: (3, said))
    assert run_step(tmp_path / "report.json", ["report"], "digest") == status
    assert (tmp_path / "report.json").is_file() is recorded


def test_an_export_that_the_machine_cannot_open_is_no_fault_of_the_export(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def failing(path: Path, *_: object) -> bytes:
        raise OSError(errno.EIO, os.strerror(errno.EIO), str(path))

    monkeypatch.setattr(source, "read_or_map", failing)
    with pytest.raises(ReadError, match=r"^raw/T1\.csv: cannot be opened: input/output error$") as raised:
        source.export_bytes(tmp_path / "T1.csv", "raw/T1.csv")
    assert is_of_the_system(raised.value.problems[0].kind)


def test_a_path_that_no_machine_can_follow_and_damaged_contents_are_faults_of_the_input(
    small_campaign: Path, tmp_path: Path
) -> None:
    campaign, name = tmp_path / "campaign", f"raw/{'x' * 300}.csv"
    shutil.copytree(small_campaign, campaign)
    table = (campaign / "tests.csv").read_text(encoding="utf-8")
    (campaign / "tests.csv").write_text(table.replace("raw/T001.csv", name), encoding="utf-8")
    (problem,) = [p for p in load_campaign(campaign).problems if p.column == "file"]
    assert "this path cannot be followed: file name too long" in str(problem)
    assert not is_of_the_system(problem.kind)
    assert not is_of_the_system(system_problem(OSError("Unable to open file (truncated file)")).kind)
    assert is_of_the_system(system_problem(OSError(errno.EIO, "Input/output error")).kind)


def test_a_diagnosis_that_fails_leaves_the_report_with_a_note(
    small_campaign: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from tribo import stages
    from tribo.cli.study_commands import _diagnosed

    def broken(*_: object, **__: object) -> None:
        raise IndexError("index 3 is out of bounds")

    monkeypatch.setattr("tribo.stages.diagnose", broken)
    from tribo.campaign import load_campaign

    study = stages.study(load_campaign(small_campaign), until="fit")
    noted, found = _diagnosed(study, stages.DEFAULTS, lambda *_: None)
    assert found is None
    assert any("no diagnosis: the diagnosis stopped because of an error in tribo (IndexError" in n for n in noted.notes)


def test_problems_of_the_input_pass_through(small_campaign: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from tribo.cli.console import problems_of

    mine = Problem("no_load", "the load is missing")
    assert problems_of(TriboError(mine)) == (mine,)
    assert problems_of(FULL)[0].kind == "system"
