"""Ensembles that are stopped, go on, and give the same bits on threads and on dask."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import h5py
import pandas as pd
import pytest
import xarray as xr

from tribo.errors import SimulationError
from tribo.simulate import SimConfig, run_ensemble, stratified_design
from tribo.simulate.resume import read_stored, run_stored

SMALL = SimConfig(blocks=(40, 40), dt_s=1e-7, rest_tolerance=1e-2)
RESULTS = ["static_friction", "sliding_friction", "peak_s", "window_end_s"]


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
    monkeypatch.setattr("tribo.simulate.resume.simulate", lambda config: pytest.fail("ran again"))
    pd.testing.assert_frame_equal(run_stored(design(1), tmp_path / "e.h5"), first, check_exact=True)


def test_another_design_is_refused(tmp_path: Path):
    """A store does not mix two designs; a file that is no store is named."""
    run_stored(design(1), tmp_path / "e.h5")
    with pytest.raises(SimulationError, match="another design"):
        run_stored(design(2), tmp_path / "e.h5")
    (tmp_path / "text.h5").write_text("not HDF5")
    with pytest.raises(SimulationError, match="cannot be read as HDF5"):
        run_stored(design(1), tmp_path / "text.h5")


KILLED = """
import sys
sys.path.insert(0, {folder!r})
from test_resume import design
from tribo.simulate.resume import run_stored
run_stored(design(20), {store!r}, jobs=2, progress=lambda done, total: print(done, flush=True))
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
    table = run_stored(design(20), store, progress=lambda count, _: seen.append(count))
    assert seen[0] == done
    assert table["done"].all()
    kept = before["done"]
    pd.testing.assert_frame_equal(table.loc[kept, RESULTS], before.loc[kept, RESULTS], check_exact=True)
    some = design(20)[::9]
    pd.testing.assert_frame_equal(
        table[RESULTS][::9].reset_index(drop=True), run_ensemble(some)[RESULTS], check_exact=True
    )


def test_a_scheduler_without_dask_is_an_error_that_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Naming the package to install."""
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(SimulationError, match="pip install distributed"):
        run_stored(design(1), tmp_path / "e.h5", scheduler="tcp://nowhere:1")


@pytest.mark.filterwarnings("ignore")
def test_dask_gives_the_same_bits(tmp_path: Path):
    """A LocalCluster of two processes against threads."""
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as cluster:
        far = run_stored(design(2), tmp_path / "far.h5", scheduler=cluster.scheduler_address)
    near = run_stored(design(2), tmp_path / "near.h5", jobs=1)
    pd.testing.assert_frame_equal(far, near, check_exact=True)
