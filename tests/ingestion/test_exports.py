"""Exports read on several processes give the same as read one by one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tribo import stages
from tribo.campaign import load_campaign
from tribo.display import exact_text
from tribo.ingestion import exports
from tribo.records import SetAside
from tribo.traces import PullOptions

EXAMPLE = Path(__file__).resolve().parents[2] / "data" / "example"


def allow_forks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Processes are forked although a test runner may have threads."""
    monkeypatch.setattr("tribo.forked.may_fork", lambda: True)
    monkeypatch.setattr("tribo.ingestion.exports.may_fork", lambda: True)




def test_two_processes_read_the_same_bits_as_one(monkeypatch, eight_pulls: Path) -> None:  # type: ignore[no-untyped-def]
    allow_forks(monkeypatch)
    campaign = load_campaign(eight_pulls)
    monkeypatch.setattr(exports, "FEWEST_FOR_PROCESSES", len(campaign.tests))
    one, two = stages.ingest(campaign), stages.ingest(campaign, jobs=2)
    assert list(one.pulls) == list(two.pulls)
    for test_id, trace in one.traces.items():
        assert np.array_equal(trace.force_N, two.traces[test_id].force_N)
        assert exact_text(one.pulls[test_id]) == exact_text(two.pulls[test_id])


def test_faults_come_back_from_the_processes_too(
    monkeypatch: pytest.MonkeyPatch, eight_pulls: Path, tmp_path: Path
) -> None:
    import shutil

    allow_forks(monkeypatch)
    monkeypatch.setattr(exports, "FEWEST_FOR_PROCESSES", 2)
    shutil.copytree(eight_pulls, tmp_path / "campaign")
    (tmp_path / "campaign" / "raw" / "T005.csv").write_bytes(b"")
    ingested = stages.ingest(load_campaign(tmp_path / "campaign"), jobs=2)
    (fault,) = ingested.set_aside
    assert (fault.test_id, fault.problems[0].kind, fault.problems[0].file) == ("T005", "empty", "raw/T005.csv")


def test_a_displacement_that_does_not_run_at_the_speed_of_the_test_is_doubted() -> None:
    campaign = load_campaign(EXAMPLE)
    test = campaign.tests[0]
    assert test.speed_m_s is not None
    for factor, doubted in ((1.0, False), (1.1, False), (2.0, True), (0.1, True)):
        told = replace(test, speed_m_s=factor * test.speed_m_s)
        ((_, outcome),), _ = exports.read_row(campaign.root, lambda file: campaign.columns, PullOptions(), told)
        assert not isinstance(outcome, SetAside)
        trace, pull = outcome
        assert trace is not None
        assert ("off_speed" in pull.flags) is ("off_speed" in {p.kind for p in pull.problems}) is doubted


def test_a_doubt_stands_in_the_table_with_its_row_and_can_be_found_on_the_trace(
    eight_pulls: Path, tmp_path: Path
) -> None:
    import shutil

    from tribo.records import Study
    from tribo.report.tables import tests_table

    shutil.copytree(eight_pulls, tmp_path / "campaign")
    path = tmp_path / "campaign" / "raw" / "T005.csv"
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    row = len(lines) - 60
    cells = lines[row - 1].split(",")
    lines[row - 1] = ",".join([*cells[:-1], cells[-1].replace(cells[-1].strip().strip('"'), "99.00000")])
    path.write_text("".join(lines), encoding="utf-8")
    ingested = stages.ingest(load_campaign(tmp_path / "campaign"))
    told = tests_table(Study(ingested)).set_index("test_id")
    assert told.loc["T005", "flags"] == "spike"
    assert f"raw/T005.csv, row {row}, column force" in told.loc["T005", "doubts"]
    assert (told.drop("T005")["doubts"] == "").all()
    trace = ingested.traces["T005"]
    (problem,) = ingested.pulls["T005"].problems
    assert problem.row is not None
    assert trace.force_N[problem.row - trace.first_row] == 99.0
