"""Tables of one file: rows, restarts of time, specimens side by side and what is neither."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tribo.errors import ReadError
from tribo.readers import inspect_export, read_blocks, read_export


def saved(folder: Path, lines: list[str]) -> Path:
    path = folder / "export.csv"
    path.write_text("\n".join(lines) + "\n")
    return path


def table(times: list[float], blank_after: int = -1) -> list[str]:
    lines = ["Time (s),Fx (N)"]
    for k, t in enumerate(times):
        lines += [f"{t:.3f},{0.1 * k:.2f}", *([""] if k == blank_after else [])]
    return lines


TEN = [0.1 * k for k in range(10)]


@pytest.mark.parametrize(("again", "parts"), [(0.0, 2), (0.29, 2), (-0.29, 2), (0.31, 1), (-0.31, 1)])
def test_time_starts_again_within_three_steps_of_where_it_began(tmp_path: Path, again: float, parts: int) -> None:
    path = saved(tmp_path, table(TEN + [t + again for t in TEN]))
    if parts == 2:
        first, second = read_blocks(path)
        assert first.time_s == pytest.approx(TEN)
        assert second.time_s == pytest.approx(np.array(TEN) + again)
        assert (first.first_row, second.first_row) == (2, 12)
        assert first.flags == second.flags
        assert "time_goes_back" not in first.flags
        assert not second.problems
    else:
        with pytest.raises(ReadError) as caught:
            read_blocks(path)
        assert [(p.kind, p.row) for p in caught.value.problems] == [("time_goes_back", 12)]


def test_one_of_three_restarts_that_begins_elsewhere_leaves_the_table_whole(tmp_path: Path) -> None:
    path = saved(tmp_path, table([*TEN, *TEN, *(t + 0.5 for t in TEN)]))
    with pytest.raises(ReadError) as caught:
        read_blocks(path)
    assert [p.kind for p in caught.value.problems] == ["time_goes_back"]


def test_three_starts_of_time_are_three_traces_with_their_rows_and_names(tmp_path: Path) -> None:
    tables = inspect_export(saved(tmp_path, table(TEN * 3))).tables
    assert [t.first_row for t in tables] == [2, 12, 22]
    assert [t.rows for t in tables] == [10, 10, 10]
    assert [t.label for t in tables] == [f"part, start {k} of time" for k in (1, 2, 3)]


@pytest.mark.parametrize(("blank_after", "row"), [(-1, 8), (2, 9), (7, 8)])
def test_blank_lines_are_counted_in_the_row_of_a_problem(tmp_path: Path, blank_after: int, row: int) -> None:
    """The seventh sample, whose time decreases, stands in line 8, or in 9 behind a blank line."""
    times = [*TEN[:6], 0.45, *TEN[6:]]
    with pytest.raises(ReadError) as caught:
        read_export(saved(tmp_path, table(times, blank_after)))
    assert [(p.kind, p.row) for p in caught.value.problems] == [("time_goes_back", row)]


@pytest.mark.parametrize(("high", "varies"), [(1.0, False), (1.9, False), (2.1, True), (10.0, True)])
def test_a_force_that_grows_tenfold_is_refused_unless_the_load_changes_by_half_or_more(
    tmp_path: Path, high: float, varies: bool
) -> None:
    up = [10 <= k < 20 for k in range(30)]
    rows = [f"{0.1 * k:.1f},{3.0 if more else 0.3},{high if more else 1.0}" for k, more in enumerate(up)]
    path = saved(tmp_path, ["Time (s),Fx (N),Fz (N)", *rows])
    if varies:
        assert read_export(path).flags == ()
        return
    with pytest.raises(ReadError) as caught:
        read_export(path)
    assert [(p.kind, p.row) for p in caught.value.problems] == [("scale_jump", 12)]


def test_two_specimens_side_by_side_keep_their_rows_where_one_is_shorter(tmp_path: Path) -> None:
    head = ["first,,second,", "Time (s),Fx (N),Time (s),Fx (N)"]
    both = [f"{0.1 * k:.1f},{0.1 * k:.2f},{0.1 * k:.1f},{0.2 * k:.2f}" for k in range(6)]
    longer = [f",,{0.1 * k:.1f},{0.2 * k:.2f}" for k in range(6, 9)]
    one, two = read_blocks(saved(tmp_path, [*head, *both, *longer]))
    assert (one.time_s.size, two.time_s.size) == (6, 9)
    assert (one.first_row, two.first_row) == (3, 3)
    assert two.force_N == pytest.approx(0.2 * np.arange(9))


def test_two_specimens_side_by_side_may_end_in_rows_without_the_cells_of_the_second(tmp_path: Path) -> None:
    head = ["first,,second,", "Time (s),Fx (N),Time (s),Fx (N)"]
    both = [f"{0.1 * k:.1f},{0.1 * k:.2f},{0.1 * k:.1f},{0.2 * k:.2f}" for k in range(6)]
    longer = [f"{0.1 * k:.1f},{0.1 * k:.2f}" for k in range(6, 9)]
    one, two = read_blocks(saved(tmp_path, [*head, *both, *longer]))
    assert (one.time_s.size, two.time_s.size) == (9, 6)
    assert one.force_N == pytest.approx(0.1 * np.arange(9))
