"""Memory is bounded, however large the file: the numbers once, and of an inspection the beginning only."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tribo import read_pull
from tribo.errors import ReadError
from tribo.readers import inspect_export, read_export

ROWS = 60_000
HOLDS_THREE_COLUMNS = 3 * 8


@pytest.fixture
def small_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    """Files above 100 kB count as large, and are read in pieces of 50 kB."""
    monkeypatch.setattr("tribo.readers.source.MAPPED_BYTES", 100_000)
    monkeypatch.setattr("tribo.readers.inspection.MAPPED_BYTES", 100_000)
    monkeypatch.setattr("tribo.readers.source.CHUNK_BYTES", 50_000)
    monkeypatch.setattr("tribo.readers.source.LARGEST_HEAD_BYTES", 50_000)


def long_export(path: Path, rows: int) -> Path:
    time = np.arange(rows) / 1000.0
    force = np.interp(time, [0, 1, 3, 3.2, 1e4], [0, 0, 2.0, 1.2, 1.2])
    force += 0.01 * np.random.default_rng(0).standard_normal(rows)
    lines = [f"{t:.3f},{1e3 * t:.2f},{f:.5f}" for t, f in zip(time, force, strict=True)]
    path.write_text("\n".join(["Time,Extension,Load", "(s),(um),(N)", *lines, ""]))
    return path


def most_bytes(work: Callable[[], Any]) -> int:
    """Most memory that work holds at a time."""
    work()  # what it imports does not count
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def bytes_per_row(work: Callable[[Path], Any], folder: Path) -> float:
    """What a further row costs, told by two files of which one is twice as long."""
    short, long = (long_export(folder / f"{rows}.csv", rows) for rows in (ROWS, 2 * ROWS))
    return (most_bytes(lambda: work(long)) - most_bytes(lambda: work(short))) / ROWS


@pytest.mark.usefixtures("small_pieces")
def test_reading_holds_the_numbers_once_and_little_beside(tmp_path: Path) -> None:
    assert bytes_per_row(read_export, tmp_path) < 2 * HOLDS_THREE_COLUMNS


@pytest.mark.usefixtures("small_pieces")
def test_an_inspection_contrasts_of_the_beginning_and_says_so(tmp_path: Path) -> None:
    assert bytes_per_row(inspect_export, tmp_path) < 0.5
    seen = inspect_export(tmp_path / f"{ROWS}.csv")
    assert not seen.refused
    assert seen.doubts[0].kind == "only_beginning"
    assert (seen.doubts[0].found or "").startswith(f"{(ROWS - 1) / 1000:.3f},")
    assert seen.tables[0].rows < ROWS / 4


@pytest.mark.slow
@pytest.mark.usefixtures("small_pieces")
def test_a_pull_is_read_off_a_long_record_in_bounded_memory(tmp_path: Path) -> None:
    assert bytes_per_row(lambda path: read_pull(read_export(path)), tmp_path) < 120


def test_a_table_of_too_many_rows_is_refused_with_its_count(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tribo.readers.parsing.LARGEST_TABLE_ROWS", 500)
    with pytest.raises(ReadError) as caught:
        read_export(long_export(tmp_path / "long.csv", 600))
    (problem,) = caught.value.problems
    assert (problem.kind, problem.found) == ("too_many_rows", "601 rows")
    assert "split the export" in (problem.allowed or "")
