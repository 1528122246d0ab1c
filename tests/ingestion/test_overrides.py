"""overrides.csv: what a person decided is checked like any input, applied, and kept beside the automatic reading."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tribo.campaign import load_campaign
from tribo.errors import CampaignError, Problem
from tribo.ingestion.overrides import apply_overrides
from tribo.records import Ingested
from tribo.stages import ingest

HEADER = "test_id,action,reason,window_start_s,window_end_s,peak_s"


@pytest.fixture(scope="module")
def ingested(small_campaign: Path) -> Ingested:
    return ingest(load_campaign(small_campaign))


def written(folder: Path, *rows: str, header: str = HEADER) -> Path:
    path = folder / "overrides.csv"
    path.write_text("\n".join((header, *rows)) + "\n", encoding="utf-8")
    return path


def faults(ingested: Ingested, path: Path) -> list[Problem]:
    with pytest.raises(CampaignError) as caught:
        apply_overrides(ingested, path, "first_peak")
    return list(caught.value.problems)


def test_an_excluded_pull_is_set_aside_with_its_reason_and_keeps_its_reading(
    ingested: Ingested, tmp_path: Path
) -> None:
    decided = apply_overrides(ingested, written(tmp_path, "T003,exclude,sled tipped,,,"), "first_peak")
    assert "T003" not in decided.pulls
    assert "T003" not in decided.traces
    (aside,) = (s for s in decided.set_aside if s.test_id == "T003")
    assert "sled tipped" in aside.reason
    assert not aside.problems
    assert decided.by_hand["T003"].automatic == ingested.pulls["T003"]
    assert len(decided.table()) == len(ingested.table()) - 1


def test_a_moved_window_changes_that_pull_alone(ingested: Ingested, tmp_path: Path) -> None:
    pull = ingested.pulls["T005"]
    start, end = pull.window_s
    middle = (start + end) / 2
    decided = apply_overrides(ingested, written(tmp_path, f"T005,move,drift,{middle},{end},"), "first_peak")
    trace = ingested.traces["T005"]
    inside = (trace.time_s >= middle) & (trace.time_s <= end)
    assert decided.pulls["T005"].sliding_N == pytest.approx(float(np.mean(trace.force_N[inside])) - pull.zero_N)
    assert "window_by_hand" in decided.pulls["T005"].flags
    others = {i: p for i, p in decided.pulls.items() if i != "T005"}
    assert others == {i: p for i, p in ingested.pulls.items() if i != "T005"}


def test_what_is_set_aside_already_stays_so(ingested: Ingested, tmp_path: Path) -> None:
    once = apply_overrides(ingested, written(tmp_path, "T003,exclude,sled tipped,,,"), "first_peak")
    again = apply_overrides(once, written(tmp_path, "T003,exclude,sled tipped,,,"), "first_peak")
    assert again.set_aside == once.set_aside
    assert again.pulls == once.pulls


def test_an_empty_table_decides_nothing(ingested: Ingested, tmp_path: Path) -> None:
    assert apply_overrides(ingested, written(tmp_path), "first_peak").pulls == ingested.pulls


def test_every_fault_is_listed_at_once_with_its_place(ingested: Ingested, tmp_path: Path) -> None:
    rows = [
        "T999,exclude,gone,,,",
        "T001,delete,why,,,",
        "T002,exclude,,,,",
        "T003,move,x,5,4,",
        "T004,move,x,four,20,",
        "T005,move,x,1000,1001,",
        "T006,move,x,,,",
        "T007,move,x,5,,",
        "T008,move,x,5,5.0001,",
        "T009,exclude,x,5,6,",
        "T009,exclude,x,,,",
        "T010,exclude,x",
    ]
    found = faults(ingested, written(tmp_path, *rows))
    places = {(p.row, p.kind) for p in found}
    assert {
        (2, "unknown_test"), (3, "unknown_action"), (4, "no_reason"), (5, "window_reversed"), (6, "not_a_number"),
        (7, "outside_trace"), (8, "nothing_moved"), (9, "half_a_window"), (10, "window_short"), (11, "unused_cell"),
        (12, "duplicate_row"), (13, "wrong_number_of_cells"),
    } <= places  # fmt: skip
    assert all(p.file == "overrides.csv" for p in found)
    outside = next(p for p in found if p.kind == "outside_trace")
    assert outside.column == "window_start_s"
    assert outside.found == "1000"
    assert "to" in str(outside.allowed)


@pytest.mark.parametrize("times", ["5,,2", ",5,2"])
def test_a_peak_with_half_a_window_is_one_fault(ingested: Ingested, tmp_path: Path, times: str) -> None:
    path = written(tmp_path, f"{next(iter(ingested.pulls))},move,x,{times}")
    assert [problem.kind for problem in faults(ingested, path)] == ["half_a_window"]


def test_a_column_that_is_none_is_refused_with_the_known_ones(ingested: Ingested, tmp_path: Path) -> None:
    found = faults(ingested, written(tmp_path, header="test_id,act,reason"))
    assert {(p.kind, p.column) for p in found} == {("missing_column", "action"), ("unknown_column", "act")}


def test_a_semicolon_table_with_decimal_commas_means_the_same(ingested: Ingested, tmp_path: Path) -> None:
    comma = apply_overrides(ingested, written(tmp_path, "T005,move,drift,10.5,12.5,"), "first_peak")
    rows = ("T005;move;drift;10,5;12,5;",)
    semicolon = apply_overrides(ingested, written(tmp_path, *rows, header=HEADER.replace(",", ";")), "first_peak")
    assert semicolon.pulls["T005"] == comma.pulls["T005"]


def test_excluding_everything_is_refused(ingested: Ingested, tmp_path: Path) -> None:
    rows = [f"{i},exclude,all,,," for i in ingested.pulls]
    assert [p.kind for p in faults(ingested, written(tmp_path, *rows))] == ["no_usable_test"]


def test_a_missing_file_is_named(ingested: Ingested, tmp_path: Path) -> None:
    (problem,) = faults(ingested, tmp_path / "nowhere.csv")
    assert "nowhere.csv" in str(problem)


def test_every_command_that_reads_a_campaign_takes_overrides_and_says_what_is_wrong_with_them(
    small_campaign: Path, tmp_path: Path
) -> None:
    from click.testing import CliRunner

    from tribo.cli import main

    faulty = str(written(tmp_path, "T999,exclude,gone,,,"))
    for command in ("ingest", "fit", "compare", "diagnose", "report"):
        arguments = [command, str(small_campaign), "-o", str(tmp_path / "out"), "--overrides", faulty]
        result = CliRunner().invoke(main, arguments)
        assert result.exit_code == 1, command
        assert "overrides.csv, row 2, column test_id" in result.stderr
    assert not (tmp_path / "out").exists()


def test_fit_leaves_out_what_overrides_exclude(small_campaign: Path, tmp_path: Path) -> None:
    import pandas as pd
    from click.testing import CliRunner

    from tribo.cli import main

    path = str(written(tmp_path, "T003,exclude,sled tipped,,,", "T005,move,drift,10,12,"))
    result = CliRunner().invoke(main, ["fit", str(small_campaign), "-o", str(tmp_path / "out"), "--overrides", path])
    assert result.exit_code == 0
    table = pd.read_csv(tmp_path / "out" / "tests.csv").set_index("test_id")
    assert "sled tipped" in table.loc["T003", "set_aside"]
    assert np.isnan(table.loc["T003", "static_N"])
    assert "window_by_hand" in table.loc["T005", "flags"]
    assert table.loc["T005", "window_start_s"] == pytest.approx(10, abs=0.1)
