"""Cells run here, side by side, or on a dask cluster give the same bits, and each keeps its own file."""

from __future__ import annotations

from pathlib import Path

import pytest

from tribo.comparison.prediction import Cell, cell_name, cells_of, remove_other_runs, run_cells
from tribo.records import StudyOptions
from tribo.springblock import SimConfig

DESIGN = [
    SimConfig(sample=sample, pressure_Pa=pressure, blocks=(12, 12), dt_s=1e-7, seed=seed, duration_peaks=1.5)
    for sample in ("F", "B")
    for pressure in (5e3, 20e3)
    for seed in (1, 2)
]


@pytest.fixture(scope="module")
def cells() -> tuple[Cell, ...]:
    return cells_of(DESIGN)


def test_cells_are_named_by_sample_and_pressure_and_keep_the_order(cells: tuple[Cell, ...]) -> None:
    assert [c.name for c in cells] == ["F@5000Pa", "F@20000Pa", "B@5000Pa", "B@20000Pa"]
    assert cell_name("a/b c", 1e3) == "a%2Fb%20c@1000Pa"


def test_one_after_the_other_side_by_side_and_unkept_are_the_same(cells: tuple[Cell, ...], tmp_path: Path) -> None:
    alone = run_cells(cells, StudyOptions(kept=tmp_path / "a", jobs=1))
    together = run_cells(cells, StudyOptions(kept=tmp_path / "b", jobs=6))
    unkept = run_cells(cells, StudyOptions())
    columns = ["sample", "pressure_Pa", "seed", "static_friction", "sliding_friction"]
    assert alone.equals(together)
    assert alone[columns].equals(unkept[columns])


def test_progress_counts_every_run_up_to_all(cells: tuple[Cell, ...], tmp_path: Path) -> None:
    seen: list[tuple[int, int]] = []
    run_cells(cells, StudyOptions(kept=tmp_path), lambda done, total: seen.append((done, total)))
    assert seen[0] == (0, 8)
    assert seen[-1] == (8, 8)
    assert [done for done, _ in seen] == sorted(done for done, _ in seen)


def test_other_seeds_have_other_files_and_those_of_others_are_removed(cells: tuple[Cell, ...], tmp_path: Path) -> None:
    others = cells_of([config.with_(seed=config.seed + 10) for config in DESIGN[:2]])
    run_cells(cells, StudyOptions(kept=tmp_path))
    run_cells(others, StudyOptions(kept=tmp_path))
    assert len(list(tmp_path.glob("*.nc"))) == 5
    remove_other_runs(cells, tmp_path)
    assert sorted(tmp_path.glob("*.nc")) == sorted(c.path(tmp_path) for c in cells)


def test_a_cluster_gives_the_bits_of_threads(cells: tuple[Cell, ...], tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    here = run_cells(cells, StudyOptions(kept=tmp_path / "here"))
    options = {"n_workers": 1, "threads_per_worker": 2, "processes": False, "dashboard_address": "127.0.0.1:0"}
    with distributed.LocalCluster(**options) as cluster:
        away = run_cells(cells, StudyOptions(kept=tmp_path / "away", scheduler=cluster.scheduler_address))
    assert here.equals(away)
