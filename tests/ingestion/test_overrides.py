"""overrides.csv: what a person decided is checked like any input, applied, and kept beside the automatic reading."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import support.campaigns

from tribo.campaign import load_campaign
from tribo.errors import CampaignError, Problem
from tribo.ingestion.overrides import apply_overrides
from tribo.records import Ingested
from tribo.stages import ingest
from tribo.wording.study_sentences import by_hand_sentence

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


PHASES = "test_id,action,reason,phase,start_s,end_s"
TOML = """\
[campaign]
title = "Pulls and a slide"
nominal_area_mm2 = 55.0

[patterns.F]
cavity = "none"
"""


def export(force: np.ndarray) -> str:
    scatter = 0.003 * np.random.default_rng(1).standard_normal(force.size)
    lines = [f"{k / 50:.2f},{f:.5f}" for k, f in enumerate(force + scatter)]
    return "\n".join(["Time (s),Friction force (N)", *lines, ""])


@pytest.fixture(scope="module")
def with_a_slide(tmp_path_factory: pytest.TempPathFactory) -> Ingested:
    """A pull, and a slide whose force climbs threefold from the first row on, which is set aside."""
    time = np.arange(1000) / 50
    pulled = np.interp(time, [0, 2, 4, 4.2, 20], [0, 0, 2.0, 1.5, 1.5])
    slides = 0.5 + time / 20
    root = tmp_path_factory.mktemp("slide")
    rows = ["test_id,file,sample,specimen,normal_load_N", "P,raw/P.csv,F,F1,2", "S,raw/S.csv,F,F2,2"]
    exports = {"P.csv": export(pulled), "S.csv": export(slides)}
    found = ingest(load_campaign(support.campaigns.written(root, TOML, rows, exports)))
    assert {s.test_id for s in found.set_aside} == {"S"}
    return found


def test_a_phase_stated_by_hand_brings_back_a_test_that_was_set_aside(with_a_slide: Ingested, tmp_path: Path) -> None:
    rows = ("S,phase,turns from the start,running-in,0,10", "S,phase,,steady sliding,10,20")
    decided = apply_overrides(with_a_slide, written(tmp_path, *rows, header=PHASES), "first_peak")
    assert not decided.set_aside
    pull = decided.pulls["S"]
    assert np.isnan(pull.static_N)
    assert pull.sliding_N == pytest.approx(1.25, abs=0.01)
    assert [(p.name, p.evidence) for p in pull.phases] == [
        ("running-in", "stated by hand"), ("steady sliding", "stated by hand"),
    ]  # fmt: skip
    assert "phases_by_hand" in pull.flags
    said = by_hand_sentence(decided.by_hand["S"], pull)
    assert "turns from the start" in said
    assert "steady sliding from 10.0 to 20.0 s" in said
    assert "automatic value none" in said
    assert "nan" not in said


def test_a_window_moved_by_hand_brings_back_a_test_that_was_set_aside(with_a_slide: Ingested, tmp_path: Path) -> None:
    decided = apply_overrides(with_a_slide, written(tmp_path, "S,move,slides,10,20,"), "first_peak")
    assert decided.pulls["S"].sliding_N == pytest.approx(1.25, abs=0.01)


def test_a_rest_and_a_rise_stated_by_hand_give_the_zero_and_the_peak(with_a_slide: Ingested, tmp_path: Path) -> None:
    rows = ("P,phase,by eye,rest,0,1", "P,phase,by eye,rise,2,4", "P,phase,by eye,end of the drive,12,19")
    pull = apply_overrides(with_a_slide, written(tmp_path, *rows, header=PHASES), "first_peak").pulls["P"]
    assert pull.zero_rule == "mean from 0 to 1 s"
    assert pull.peak_s == pytest.approx(4.0, abs=0.05)
    assert pull.window_s[1] <= 12.0
    assert ("end of the drive", 12.0, 19.0) in [(p.name, p.start_s, p.end_s) for p in pull.phases]


def test_every_fault_of_a_stated_phase_is_named(with_a_slide: Ingested, tmp_path: Path) -> None:
    rows = (
        "P,phase,x,sliding,1,2", "P,phase,x,rise,2,1", "P,phase,x,rise,2,", "P,phase,x,rise,2,99", "P,exclude,x,,,",
    )  # fmt: skip
    found = {(p.row, p.kind) for p in faults(with_a_slide, written(tmp_path, *rows, header=PHASES))}
    assert found == {
        (2, "unknown_phase"), (3, "window_reversed"), (4, "half_a_window"), (5, "outside_trace"), (6, "duplicate_row"),
    }  # fmt: skip


EVENTS = "test_id,action,reason,event,fail_s,end_s,window_start_s,window_end_s"


def test_a_slip_is_taken_out_by_its_number_and_one_added_beside_a_moved_window(
    ingested: Ingested, tmp_path: Path
) -> None:
    pull = ingested.pulls["T005"]
    (slip,) = pull.slips
    added = f"T005,event,late slip,,{pull.window_s[0] + 1.0},{pull.window_s[0] + 1.2},,"
    moved = f"T005,move,drift,,,,{pull.window_s[0] + 0.5},{pull.window_s[1]}"
    path = written(tmp_path, "T005,event,a knock,1,,,,", added, moved, "T006,event,a knock,1,,,,", header=EVENTS)
    decided = apply_overrides(ingested, path, "first_peak")
    assert decided.pulls["T006"].slips == ()
    assert slip.fail_s not in [s.fail_s for s in decided.pulls["T005"].slips]
    assert decided.pulls["T005"].window_s != pull.window_s
    said = by_hand_sentence(decided.by_hand["T006"], decided.pulls["T006"])
    assert said.startswith("Changed by hand (a knock): slip 1 taken out.")


@pytest.mark.parametrize(
    ("row", "kind"),
    [
        ("T005,event,why,7,,,,", "unknown_event"),
        ("T005,event,why,one,,,,", "unknown_event"),
        ("T005,event,,1,,,,", "no_reason"),
        ("T005,event,why,1,4.0,,,", "half_a_slip"),
        ("T005,event,why,,,,,", "half_a_slip"),
        ("T005,event,why,,5.0,4.0,,", "window_reversed"),
        ("T005,event,why,,5.0,4000,,", "outside_trace"),
    ],
)
def test_a_slip_that_cannot_be_changed_so_is_refused(ingested: Ingested, tmp_path: Path, row: str, kind: str) -> None:
    assert [p.kind for p in faults(ingested, written(tmp_path, row, header=EVENTS))] == [kind]
