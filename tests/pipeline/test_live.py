"""The progress of a build as told by Snakemake: which step of which campaign runs, and how much is left."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from tribo.cli.build_commands import build_progress, in_words, seconds_left
from tribo.cli.console import Console
from tribo.site.workflow import Follower, Progress, run_workflow, typical_seconds

SAID = """\
Job stats:
job          count
---------  -------
fit              2
simulate         1
index            1
all              1
total            5

[Sun Nov 22 01:44:25 2026]
localrule fit:
    output: steps/a/fit.json
    jobid: 4
    reason: Missing output files: steps/a/fit.json
    wildcards: name=a
[Sun Nov 22 01:44:26 2026]
rule simulate:
    jobid: 7
    wildcards: name=b, cell=Sx
Finished jobid: 4 (Rule: fit)
1 of 5 steps (20%) done
"""


def followed(text: str, typical_s: dict[str, float]) -> Follower:
    follower = Follower(typical_s)
    for line in text.splitlines(keepends=True):
        follower.take(line)
    return follower


def test_running_steps_are_named_by_campaign_and_finished_ones_counted() -> None:
    progress = followed(SAID, {}).progress
    assert progress == Progress(1, 5, ("b: simulating Sx",), 0.25)


def test_steps_weigh_as_long_as_they_took_before() -> None:
    """Two fits of 10 s, one simulation of 70 s and an index of the usual 40 s: one fit is 10 of 130 s."""
    progress = followed(SAID, {"fit": 10.0, "simulate": 70.0}).progress
    assert progress.share == pytest.approx(10 / 130)
    assert seconds_left(progress, 12.0) == pytest.approx(12.0 * 12)
    assert in_words(progress, 12.0) == "1 of 5 steps (12 s, about 2 min left): b: simulating Sx"


def test_a_failed_step_runs_no_longer() -> None:
    failed = SAID + "Error in rule simulate:\n    message: None\n    jobid: 7\n"
    assert followed(failed, {}).progress.running == ()


def test_durations_of_earlier_builds_are_found_by_kind_of_step(tmp_path: Path) -> None:
    for name, seconds in (("simulate-A", 4.0), ("simulate-B", 8.0), ("fit", 1.0)):
        (tmp_path / "a").mkdir(exist_ok=True)
        (tmp_path / "a" / f"{name}.json").write_text(f'{{"seconds": {seconds}}}')
    assert typical_seconds(tmp_path) == {"simulate": 6.0, "fit": 1.0}


def test_a_workflow_is_followed_while_it_runs(tmp_path: Path) -> None:
    told: list[Progress] = []
    ended = run_workflow([sys.executable, "-c", f"print({SAID!r}, end='')"], tmp_path, None, told.append)
    assert (ended.returncode, ended.stdout) == (0, SAID)
    assert [p.running for p in told] == [
        ("a: reading exports and fitting laws",), ("a: reading exports and fitting laws", "b: simulating Sx"),
        ("b: simulating Sx",),
    ]  # fmt: skip


def test_temporary_files_that_a_workflow_leaves_are_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    place = tmp_path / "temporary"
    place.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(place))
    monkeypatch.setenv("TMPDIR", str(place))
    leaving = "import tempfile; print(tempfile.mkdtemp())"
    ended = run_workflow([sys.executable, "-c", leaving], tmp_path / "state", None, lambda progress: None)
    assert Path(ended.stdout.strip()).is_relative_to(place)
    assert list(place.iterdir()) == []


def test_a_line_is_printed_when_other_steps_run_and_not_twice(capsys: pytest.CaptureFixture[str]) -> None:
    with build_progress(Console()) as report:
        for _ in range(3):
            report(Progress(0, 2, ("a: fitting laws",), 0.0))
        report(Progress(1, 2, ("a: simulating",), 0.5))
    said = capsys.readouterr().err.splitlines()
    assert [line.partition("): ")[2] for line in said] == ["a: fitting laws", "a: simulating"]
