"""The progress of a build by the journal of its steps: which step of which campaign runs, and how much is left."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from tribo.cli.build_commands import build_progress, in_words, seconds_left
from tribo.cli.console import Console
from tribo.site.build import Progress, progress_of, run_workflow, typical_seconds
from tribo.site.steps import JOURNAL, Step, note

FIT_A, FIT_B, SIMULATE_B, INDEX = Step("fit", "a"), Step("fit", "b"), Step("simulate-Sx", "b"), Step("index")
DUE = [FIT_A, FIT_B, SIMULATE_B, INDEX]


@pytest.fixture
def state(tmp_path: Path) -> Path:
    """One step has ended, another runs."""
    note(tmp_path, FIT_A, "begun")
    note(tmp_path, SIMULATE_B, "begun")
    note(tmp_path, FIT_A, "ended")
    return tmp_path


def test_running_steps_are_named_by_campaign_and_finished_ones_counted(state: Path) -> None:
    assert progress_of(state, DUE, {}) == Progress(1, 4, ("b: simulating Sx",), 0.25)


def test_steps_weigh_as_long_as_they_took_before(state: Path) -> None:
    """Two fits of 10 s, one simulation of 70 s and an index of the usual 40 s: one fit is 10 of 130 s."""
    progress = progress_of(state, DUE, {"fit": 10.0, "simulate": 70.0})
    assert progress.share == pytest.approx(10 / 130)
    assert seconds_left(progress, 12.0) == pytest.approx(12.0 * 12)
    assert in_words(progress, 12.0) == "1 of 4 steps (12 s, about 2 min left): b: simulating Sx"


def test_a_failed_step_runs_no_longer(state: Path) -> None:
    note(state, SIMULATE_B, "ended", 1)
    assert progress_of(state, DUE, {}).running == ()


def test_a_line_of_the_journal_that_is_not_whole_yet_is_left_out(state: Path) -> None:
    with (state / JOURNAL).open("a") as file:
        file.write('{"step": "fit", "camp')
    assert progress_of(state, DUE, {}).done == 1


def test_durations_of_earlier_builds_are_found_by_kind_of_step(tmp_path: Path) -> None:
    for name, seconds in (("simulate-A", 4.0), ("simulate-B", 8.0), ("fit", 1.0)):
        (tmp_path / "a").mkdir(exist_ok=True)
        (tmp_path / "a" / f"{name}.json").write_text(f'{{"seconds": {seconds}}}')
    assert typical_seconds(tmp_path) == {"simulate": 6.0, "fit": 1.0}


def test_a_workflow_is_followed_while_it_runs(tmp_path: Path) -> None:
    told: list[Progress] = []
    work = """
from pathlib import Path
from tribo.site.steps import Step, note
for event in ("begun", "ended"):
    note(Path({state!r}), Step("fit", "a"), event)
    print(event, flush=True)
"""
    command = [sys.executable, "-c", work.format(state=str(tmp_path))]
    ended = run_workflow(command, tmp_path, [FIT_A], None, told.append)
    assert (ended.returncode, ended.stdout) == (0, "begun\nended\n")
    assert told[-1] == Progress(1, 1, (), 1.0)


def test_temporary_files_that_a_workflow_leaves_are_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    place = tmp_path / "temporary"
    place.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(place))
    monkeypatch.setenv("TMPDIR", str(place))
    leaving = "import tempfile; print(tempfile.mkdtemp())"
    ended = run_workflow([sys.executable, "-c", leaving], tmp_path / "state", [], None, lambda progress: None)
    assert Path(ended.stdout.strip()).is_relative_to(place)
    assert list(place.iterdir()) == []


def test_a_line_is_printed_when_other_steps_run_and_not_twice(capsys: pytest.CaptureFixture[str]) -> None:
    with build_progress(Console()) as report:
        for _ in range(3):
            report(Progress(0, 2, ("a: fitting laws",), 0.0))
        report(Progress(1, 2, ("a: simulating",), 0.5))
    said = capsys.readouterr().err.splitlines()
    assert [line.partition("): ")[2] for line in said] == ["a: fitting laws", "a: simulating"]
