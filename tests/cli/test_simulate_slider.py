"""tribo simulate --slider: one run, an ensemble, a design, and refusals before anything runs."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path

import numpy as np
import on_the_command_line
import pytest
import xarray as xr

from tribo.slider import SliderConfig, constant_speed, simulate_slider

run = partial(on_the_command_line.run, "simulate", "--slider")
MACHINE = ("--mass", 0.03, "--stiffness", 170, "--normal-load", 0.3, "--duration", 6000)


@pytest.fixture
def law(tmp_path: Path) -> Path:
    path = tmp_path / "law.toml"
    path.write_text('law = "coulomb"\n[parameters]\nmu_s = 0.36\nmu_d = 0.30\n')
    return path


def test_a_run_is_written_as_the_library_makes_it(tmp_path: Path, law: Path):
    out = tmp_path / "s.nc"
    said = json.loads(run(*MACHINE, "--speed", 0.2, "--law", law, "-o", out, "--json").stdout)
    same = simulate_slider(
        SliderConfig(0.03, 170.0, 0.0, 0.3, values={"mu_s": 0.36, "mu_d": 0.30}, drive=constant_speed(2e-4),
                     duration_s=6.0)
    )  # fmt: skip
    assert said["static_friction"] == same.static_friction
    assert said["slips"] == same.starts_s.size > 2
    with xr.open_dataset(out, engine="h5netcdf") as data:
        np.testing.assert_array_equal(data["force"], same.force_N)
        np.testing.assert_array_equal(data["stuck"], same.stuck)
        assert {"position", "velocity", "drive"} <= set(data)
        assert data["force"].attrs["units"] == "N"
        assert data.attrs["static_friction"] == same.static_friction
        assert tuple(data.attrs["window"]) == same.window_s
        assert (data.attrs["stiffness_N_per_m_unit"], data.attrs["law_mu_s_unit"]) == ("N/m", "1")
        assert (data.attrs["law_mu_s"], data.attrs["seed"], data.attrs["mass_kg_unit"]) == (0.36, 0, "kg")
        np.testing.assert_array_equal(data.attrs["slip_starts"], same.starts_s)


def test_several_values_are_an_ensemble_of_every_combination(tmp_path: Path, law: Path):
    out = tmp_path / "e.nc"
    said = run(*MACHINE, "--law", law, "--set", "speed_m_s=4e-4,2e-4", "--set", "mu_s=.33,.36,.4", "-o", out, "--json")
    assert json.loads(said.stdout)["runs"] == 6
    with xr.open_dataset(out, engine="h5netcdf") as data:
        assert sorted(set(data["law_mu_s"].values)) == [0.33, 0.36, 0.4]
        assert data["sliding_friction"].shape == (6,)
        np.testing.assert_allclose(data["static_friction"], data["law_mu_s"], rtol=0.02)


def test_a_design_file_describes_an_ensemble(tmp_path: Path, law: Path):
    design = tmp_path / "d.toml"
    design.write_text(
        'law = "slip_weakening"\n[parameters]\nslip_m = [0, 1e-5]\nmu = [[0.36, 0.3], [0.36, 0.32]]\n'
        "duration_s = 2\nspeed_m_s = 2e-4\n"
    )
    run("--design", design, "-o", tmp_path / "e.nc", "--json")
    with xr.open_dataset(tmp_path / "e.nc", engine="h5netcdf") as data:
        assert data["slips"].shape == (2,)


@pytest.mark.parametrize(
    ("drive", "label"),
    [
        (("--steps", "0:0.1,2:0.3"), "1 steps of speed"),
        (("--speed", 0.1, "--hold", "1,2", "--slide", 1), "2 holds"),
        (("--sinusoid", "1,0.5"), "sinusoid"),
    ],
)
def test_every_drive_has_its_option(tmp_path: Path, law: Path, drive: tuple, label: str):
    run(*MACHINE, *drive, "--law", law, "-o", tmp_path / "s.nc")
    with xr.open_dataset(tmp_path / "s.nc", engine="h5netcdf") as data:
        assert label in data.attrs["drive"]


def test_the_drive_follows_a_recorded_displacement(tmp_path: Path, law: Path):
    record = tmp_path / "record.csv"
    rows = [f"{t / 10},{0.01},{0.02 * t}" for t in range(80)]
    record.write_text("Time (s),Load (N),Extension (mm)\n" + "\n".join(rows) + "\n")
    for name, drive in (("a", ("--displacement", record)), ("b", ("--speed", 0.2))):
        run(*MACHINE, *drive, "--law", law, "-o", tmp_path / f"{name}.nc")
    with xr.open_dataset(tmp_path / "a.nc", engine="h5netcdf") as a, xr.open_dataset(tmp_path / "b.nc") as b:
        np.testing.assert_allclose(a["force"], b["force"], atol=1e-9)


def test_everything_that_is_wrong_is_said_before_anything_runs(tmp_path: Path, law: Path):
    wrong = ("--stiffness", -1, "--set", "mu_s=-2", "--set", "stifness=1")
    result = run("--law", "coulomb", *wrong, "-o", tmp_path / "s.nc")
    assert result.exit_code == 1
    for word in ("stiffness_N_per_m", "mu_s", "mu_d", "did you mean"):
        assert word in result.stderr
    assert [p.name for p in tmp_path.iterdir()] == ["law.toml"]


def test_options_of_blocks_and_sliders_are_not_mixed(tmp_path: Path, law: Path):
    assert run(*MACHINE, "--sample", "F", "-o", tmp_path / "s.nc").exit_code == 2
    assert run(*MACHINE, "--speed", 1, "--steps", "0:1", "-o", tmp_path / "s.nc").exit_code == 2
    blocks = ("simulate", "--sample", "F", "--pressure", 5)
    without = on_the_command_line.run(*blocks, "--mass", 1, "-o", tmp_path / "s.nc")
    assert without.exit_code == 2
    assert "only with --slider" in without.stderr


def test_a_faulty_law_file_is_refused_by_name(tmp_path: Path):
    (tmp_path / "bad.toml").write_text('law = "coulom"\nbla = 1\n')
    result = run(*MACHINE, "--law", tmp_path / "bad.toml", "-o", tmp_path / "s.nc")
    assert result.exit_code == 1
    assert "bad.toml" in result.stderr
    assert "did you mean coulomb" in result.stderr
