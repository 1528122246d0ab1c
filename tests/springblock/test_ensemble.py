"""Designs, ensembles, calibration and files."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest
import xarray as xr

from tribo.errors import SimulationError
from tribo.records import Pattern
from tribo.springblock import (
    CalibrationRuns,
    SimConfig,
    angle_range_deg,
    calibrate,
    run_ensemble,
    simulate,
    stratified_design,
    write_ensemble,
    write_run,
)
from tribo.springblock.calibration import simulated_law

SMALL = SimConfig(blocks=(24, 24), dt_s=1e-7, rest_tolerance=1e-2)


def test_angle_law_of_the_paper():
    """0 to 90 deg for isotropic samples, nominal +-10 deg for a named direction."""
    assert angle_range_deg("A") == (0.0, 90.0)
    assert angle_range_deg("Sx") == (-10.0, 10.0)
    assert angle_range_deg("Sy") == (80.0, 100.0)
    assert angle_range_deg("Gy", Pattern("G", "rectangle")) == (80.0, 100.0)
    assert angle_range_deg("Galaxy", Pattern("Galaxy", "circle")) == (0.0, 90.0)


def test_angles_are_stratified_and_seeds_differ():
    """One angle in each stratum; no two runs share a seed; other pressures do not change a run's seed."""
    design = stratified_design(["A", "Sx"], [5e3, 10e3], 4)
    angles = [c.angle_deg for c in design if c.sample == "A" and c.pressure_Pa == 5e3]
    assert [int(a // 22.5) for a in angles] == [0, 1, 2, 3]
    assert len({c.seed for c in design}) == len(design) == 16
    assert {c.seed for c in stratified_design(["Sx"], [10e3], 4)} <= {c.seed for c in design}


def test_rows_do_not_depend_on_threads_or_order():
    """The same configurations on one thread, on two and backwards give the same bits."""
    design = stratified_design(["F", "B"], [5e3, 20e3], 2, base=SMALL)
    seen: list[tuple[int, int]] = []
    one = run_ensemble(design, jobs=1, progress=lambda done, total: seen.append((done, total)))
    pd.testing.assert_frame_equal(one, run_ensemble(design, jobs=2), check_exact=True)
    backwards = run_ensemble(design[::-1], jobs=2)[::-1].reset_index(drop=True)
    pd.testing.assert_frame_equal(one, backwards, check_exact=True)
    assert seen == [(k, 8) for k in range(1, 9)]


def test_an_impossible_design_is_refused_before_anything_runs():
    """All distinct faults of all configurations, each once."""
    design = [*stratified_design(["F"], [-1.0, 5e3], 3), SimConfig(sample="Q")]
    with pytest.raises(SimulationError) as refused:
        run_ensemble(design)
    assert {p.kind for p in refused.value.problems} == {"not_positive", "unknown_sample"}
    assert len(refused.value.problems) == 2


def test_calibration_returns_the_measured_flat_law():
    """The simulated flat sample has the given mu and tau0, static and sliding, on runs it was not tuned on."""
    base = SMALL.with_(blocks=(48, 48))
    static, sliding = (3.9, 18e3), (2.2, 9e3)
    friction = calibrate(static, sliding, base, CalibrationRuns(repeats=4))
    design = stratified_design(["F"], [3e3, 8e3, 25e3], 8, seed=99, base=base.with_(friction=friction))
    table = run_ensemble(design)
    p = table["pressure_Pa"].to_numpy()
    for law, column in ((static, "static_friction"), (sliding, "sliding_friction")):
        mu, tau0_Pa = simulated_law(p, table[column].to_numpy())
        assert mu + tau0_Pa / p == pytest.approx(law[0] + law[1] / p, rel=0.01)


def test_run_file_is_plain_hdf5_with_units_and_parameters(tmp_path: Path):
    """h5py alone finds time, force and moving, the friction read off, the seed and a unit beside each number."""
    run = simulate(SMALL.with_(sample="B", seed=5))
    with h5py.File(write_run(run, tmp_path / "deep" / "run.nc")) as file:
        assert np.array_equal(file["force"][:], run.force_N)
        assert file["force"].attrs["units"] == "N"
        assert file["time"].attrs["units"] == "s"
        assert len(file["moving"]) == len(file["time"])
        for name in ("static_friction", "sliding_friction"):
            assert file.attrs[name] == getattr(run, name)
        assert file.attrs["seed"] == 5
        assert tuple(file.attrs["window"]) == run.window_s
        assert file.attrs["pressure_Pa_unit"] == "Pa"
        assert file.attrs["friction_mu_s_unit"] == "1"
        assert file.attrs["version_numba"]
    assert [p.name for p in (tmp_path / "deep").iterdir()] == ["run.nc"]


def test_ensemble_file_gives_the_table_back(tmp_path: Path):
    """xarray reads the columns of the table unchanged."""
    table = run_ensemble(stratified_design(["F"], [5e3], 2, base=SMALL), jobs=1)
    write_ensemble(table, tmp_path / "e.nc", {"note": "x", "dt_s": 1e-7})
    with xr.open_dataset(tmp_path / "e.nc", engine="h5netcdf") as back:
        assert list(back["sample"].values) == ["F", "F"]
        assert np.array_equal(back["static_friction"].values, table["static_friction"])
        assert back["pressure_Pa"].attrs["units"] == "Pa"


def test_a_failed_write_leaves_no_file(tmp_path: Path):
    """Neither the final name nor a temporary one."""
    table = run_ensemble(stratified_design(["F"], [5e3], 1, base=SMALL), jobs=1)
    with pytest.raises(TypeError):
        write_ensemble(table, tmp_path / "e.nc", {"bad": object()})
    assert list(tmp_path.iterdir()) == []
