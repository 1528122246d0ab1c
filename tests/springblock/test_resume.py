"""Ensembles that are stopped, go on, and give the same bits on threads and on dask."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest
import xarray as xr
from click.testing import CliRunner

from tribo.cli import main
from tribo.errors import SimulationError
from tribo.kept_results import DamagedResultWarning
from tribo.own_folder import BusyError
from tribo.records import Run
from tribo.springblock import SimConfig, run_ensemble, stratified_design
from tribo.springblock.ensemble import Work
from tribo.springblock.kept_runs import read_stored, run_stored, varied_columns

SMALL = SimConfig(blocks=(40, 40), dt_s=1e-7, rest_tolerance=1e-2)
RESULTS = ["static_friction", "sliding_friction", "peak_s", "window_end_s"]


@pytest.fixture(scope="module")
def two_workers() -> Iterator[str]:
    """The address of a dask scheduler with two worker processes."""
    distributed = pytest.importorskip("distributed")
    options = {"n_workers": 2, "threads_per_worker": 1, "processes": True, "dashboard_address": "127.0.0.1:0"}
    with distributed.LocalCluster(**options) as cluster:
        yield cluster.scheduler_address


def design(repeats: int = 3) -> list[SimConfig]:
    return stratified_design(["F", "C"], [5e3, 12e3], repeats, base=SMALL)


def test_stored_ensemble_is_the_ensemble(tmp_path: Path):
    """The same rows as run_ensemble to the bit, also for plain h5py and xarray."""
    table = run_stored(design(), tmp_path / "e.h5")
    plain = run_ensemble(design(), jobs=1)
    pd.testing.assert_frame_equal(table[RESULTS], plain[RESULTS], check_exact=True)
    with xr.open_dataset(tmp_path / "e.h5", engine="h5netcdf") as dataset:
        assert dataset["static_friction"].dims == ("run",)
        assert dataset["static_friction"].values.tolist() == table["static_friction"].tolist()
        assert dataset["peak_s"].attrs["units"] == "s"
    with h5py.File(tmp_path / "e.h5") as file:
        assert file.attrs["dt_s"] == 1e-7
        assert file["done"][:].all()


def test_a_second_start_computes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """All rows are there, so no run is made."""
    first = run_stored(design(1), tmp_path / "e.h5")
    monkeypatch.setattr("tribo.springblock.ensemble.simulate", lambda config, threads: pytest.fail("ran again"))
    pd.testing.assert_frame_equal(run_stored(design(1), tmp_path / "e.h5"), first, check_exact=True)


def test_another_design_is_refused(tmp_path: Path):
    """A store does not mix two designs; a file that is no store is named."""
    run_stored(design(1), tmp_path / "e.h5")
    with pytest.raises(SimulationError, match="a different design"):
        run_stored(design(2), tmp_path / "e.h5")
    (tmp_path / "text.h5").write_text("not HDF5")
    with pytest.raises(SimulationError, match="cannot be read as HDF5"):
        run_stored(design(1), tmp_path / "text.h5")


def edited(path: Path, change: Callable[[h5py.File], None]) -> Path:
    """The store after a change by another program."""
    with h5py.File(path, "r+") as file:
        change(file)
    return path


def falsify_one_result(file: h5py.File) -> None:
    file["static_friction"][1] = 9.9


def mark_a_run_not_done(file: h5py.File) -> None:
    file["done"][1] = 0


def move_a_result_to_another_run(file: h5py.File) -> None:
    for name in ("static_friction", "sliding_friction", "peak_s"):
        file[name][1] = file[name][0]


def change_the_time_step(file: h5py.File) -> None:
    file.attrs.modify("dt_s", 2e-7)


def change_the_angles(file: h5py.File) -> None:
    file["angle_deg"].write_direct(np.ones(4))


@pytest.mark.parametrize(
    "change",
    [falsify_one_result, mark_a_run_not_done, move_a_result_to_another_run, change_the_time_step, change_the_angles],
    ids=lambda f: f.__name__,
)
def test_a_file_that_differs_from_its_checksum_is_not_read_and_is_made_again(
    tmp_path: Path, change: Callable[[h5py.File], None]
):
    """Reading it is an error; a start that continues it makes all runs again, and the whole is as it was."""
    first = run_stored(design(1), tmp_path / "e.h5")
    edited(tmp_path / "e.h5", change)
    with pytest.raises(SimulationError, match="differs from its checksum"):
        read_stored(tmp_path / "e.h5")
    with pytest.warns(DamagedResultWarning, match="all runs are computed again"):
        again = run_stored(design(1), tmp_path / "e.h5")
    pd.testing.assert_frame_equal(again, first, check_exact=True)
    with h5py.File(tmp_path / "e.h5") as file:
        assert file.attrs["dt_s"] == 1e-7


def test_a_store_of_another_version_is_not_continued(tmp_path: Path):
    """The sources that computed its runs are part of what it is; a changed value is of no use then."""
    run_stored(design(1), tmp_path / "e.h5")
    edited(tmp_path / "e.h5", lambda file: file.attrs.modify("sources", "0" * 64))
    with pytest.raises(SimulationError, match="another version of tribo"):
        run_stored(design(1), tmp_path / "e.h5")


@pytest.mark.slow
def test_no_flipped_bit_of_a_store_gives_another_number_in_silence(tmp_path: Path):
    """A table with a flipped bit is the same, or is refused."""
    path = tmp_path / "e.h5"
    expected = run_stored(design(1), path)
    intact = path.read_bytes()
    rng = np.random.default_rng(3)
    for place in rng.choice(8 * len(intact), 150, replace=False):
        damaged = bytearray(intact)
        damaged[place // 8] ^= 1 << (place % 8)
        path.write_bytes(bytes(damaged))
        with warnings.catch_warnings(record=True):
            warnings.simplefilter("always")
            try:
                table = read_stored(path)
            except SimulationError:
                continue
        pd.testing.assert_frame_equal(table, expected, check_exact=True)


HOLDING = """
import sys, time
sys.path.insert(0, {folder!r})
from test_resume import design
from tribo.springblock.kept_runs import run_stored
run_stored(design(1), {store!r}, jobs=1, progress=lambda done, total: (print(done, flush=True), time.sleep(60)))
"""


def test_two_processes_do_not_write_one_store(tmp_path: Path):
    """The second is refused with the name of the first, whose rows it would otherwise take for its own."""
    store = tmp_path / "e.h5"
    script = HOLDING.format(folder=str(Path(__file__).parent), store=str(store))
    process = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "0\n"
    try:
        with pytest.raises(BusyError, match=f"process {process.pid} on "):
            run_stored(design(1), store)
    finally:
        process.kill()
        process.communicate()
    (tmp_path / ".e.h5.abc.part").touch()
    assert run_stored(design(1), store)["done"].all()
    assert [path.name for path in tmp_path.iterdir()] == ["e.h5"]


@pytest.mark.slow
def test_a_command_that_is_asked_to_end_leaves_whole_files_only(tmp_path: Path):
    """SIGTERM ends an ensemble as Ctrl-C does: status 130, no lock, no half file, and the next start goes on."""
    store = tmp_path / "e.nc"
    asked = ["simulate", "--sample", "F", "--sample", "C", "--pressure", "5", "--repeats", "400", "--dt", "1e-7",
             "--blocks", "40", "--set", "rest_tolerance=0.01", "-o", str(store)]  # fmt: skip
    process = subprocess.Popen([sys.executable, "-m", "tribo", *asked], stderr=subprocess.PIPE, text=True)
    until = time.monotonic() + 300
    while not (store.exists() and read_stored(store)["done"].any()):
        assert process.poll() is None
        assert time.monotonic() < until
        time.sleep(0.05)
    process.terminate()
    _, said = process.communicate()
    assert process.returncode == 130, said
    assert "interrupted; finished results are kept" in said
    assert [path.name for path in tmp_path.iterdir()] == ["e.nc"]


KILLED = """
import sys
sys.path.insert(0, {folder!r})
from test_resume import design
from tribo.springblock import kept_runs, run_stored
kept_runs.WRITE_EVERY_S = 0.0
run_stored(design(6), {store!r}, jobs=2, progress=lambda done, total: print(done, flush=True))
"""


def test_a_killed_ensemble_goes_on_where_it_was(tmp_path: Path):
    """SIGKILL in the middle: the file opens, what was done stays, the rest is computed, the whole is the same."""
    store = tmp_path / "e.h5"
    script = KILLED.format(folder=str(Path(__file__).parent), store=str(store))
    process = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    for line in process.stdout:
        if int(line) >= 7:
            os.kill(process.pid, signal.SIGKILL)
            break
    process.wait()
    process.stdout.close()
    assert process.returncode == -signal.SIGKILL
    before = read_stored(store)
    done = int(before["done"].sum())
    assert 7 <= done < len(before)
    assert before.loc[before["done"], RESULTS].notna().all().all()
    seen: list[int] = []
    table = run_stored(design(6), store, progress=lambda count, _: seen.append(count))
    assert seen[0] == done
    assert table["done"].all()
    kept = before["done"]
    pd.testing.assert_frame_equal(table.loc[kept, RESULTS], before.loc[kept, RESULTS], check_exact=True)
    some = design(6)[::9]
    pd.testing.assert_frame_equal(
        table[RESULTS][::9].reset_index(drop=True), run_ensemble(some)[RESULTS], check_exact=True
    )


def test_a_scheduler_without_dask_is_an_error_that_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Naming the package to install."""
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(SimulationError, match="pip install distributed"):
        run_stored(design(1), tmp_path / "e.h5", scheduler="tcp://nowhere:1")


def test_a_scheduler_that_does_not_answer_is_an_error_that_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Naming the address; what was asked for can be started again."""
    monkeypatch.setattr("tribo.springblock.ensemble.SCHEDULER_TIMEOUT_S", 0.5)
    with pytest.raises(SimulationError, match="no dask scheduler answers"):
        run_stored(design(1), tmp_path / "e.h5", scheduler="tcp://127.0.0.1:9")


def test_processes_threads_and_one_job_give_the_same_bits(tmp_path: Path, two_workers: str):
    """A LocalCluster of two worker processes, two threads here, and one after the other."""
    far = run_stored(design(2), tmp_path / "far.h5", scheduler=two_workers)
    near = run_stored(design(2), tmp_path / "near.h5", jobs=2)
    alone = run_stored(design(2), tmp_path / "alone.h5", jobs=1)
    pd.testing.assert_frame_equal(far, alone, check_exact=True)
    pd.testing.assert_frame_equal(near, alone, check_exact=True)


def test_a_fault_in_a_worker_comes_back_whole(tmp_path: Path, two_workers: str):
    """A run too short for its window is refused on the worker; the error here names what is allowed."""
    short = [config.with_(duration_s=1e-6) for config in design(1)]
    with pytest.raises(SimulationError) as refused:
        run_stored(short, tmp_path / "e.h5", scheduler=two_workers)
    assert [(p.kind, p.column) for p in refused.value.problems] == [("too_short", "duration_s")]


def test_the_command_line_takes_the_scheduler(tmp_path: Path, two_workers: str):
    """tribo simulate --scheduler gives the bits of tribo simulate on this machine."""
    options = ["--sample", "F", "--sample", "C", "--pressure", "5", "--repeats", "2", "--dt", "1e-7", "--blocks", "40"]
    for name, where in (("far", ["--scheduler", two_workers]), ("near", ["--jobs", "1"])):
        said = CliRunner().invoke(main, ["simulate", *options, *where, "-o", str(tmp_path / f"{name}.nc"), "--json"])
        assert json.loads(said.stdout)["runs"] == 4
    far, near = (read_stored(tmp_path / f"{name}.nc") for name in ("far", "near"))
    pd.testing.assert_frame_equal(far, near, check_exact=True)


def test_parameters_that_differ_stand_beside_the_runs(tmp_path: Path):
    """A varied number and a varied word are columns; what all runs share is an attribute."""
    runs = [c.with_(shear_factor=f, edges=e) for c in design(1) for f, e in ((0.5, "free"), (1.0, "periodic"))]
    table = run_stored(runs, tmp_path / "e.h5")
    assert varied_columns(table) == ["shear_factor", "edges"]
    assert table["edges"].tolist()[:2] == ["free", "periodic"]
    with xr.open_dataset(tmp_path / "e.h5", engine="h5netcdf") as dataset:
        assert dataset["shear_factor"].values.tolist()[:2] == [0.5, 1.0]
        assert dataset.attrs["dt_s"] == 1e-7


def test_a_store_keeps_what_it_is_asked_to_read_off_a_run(tmp_path: Path):
    """Other work has its own columns, and is not mixed with the usual one."""
    table = run_stored(design(1), tmp_path / "e.h5", work=Work(read=samples_of, units={"samples": "1"}))
    assert (table["samples"] > 100).all()
    assert "static_friction" not in table
    with pytest.raises(SimulationError, match="a different design"):
        run_stored(design(1), tmp_path / "e.h5")


def samples_of(run: Run) -> dict[str, float]:
    return {"samples": float(len(run.time_s))}
