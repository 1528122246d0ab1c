"""tribo simulate as a command: one run or an ensemble, Table 2, and refusals before anything runs."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path

import on_the_command_line
import pytest
import xarray as xr

from tribo.berardo2019.published_tables import load_table2
from tribo.springblock import SimConfig, simulate as library_run

QUICK = ("--blocks", 45, "--dt", 1e-7, "--set", "rest_tolerance=0.01", "--set", "duration_peaks=1.5")


run = partial(on_the_command_line.run, "simulate")


def test_several_samples_are_an_ensemble_that_goes_on(tmp_path: Path):
    """Means and laws by sample; a second start has nothing left to run; the file opens in xarray."""
    asked = ("--sample", "F", "--sample", "B", "--pressure", 5, "--pressure", 20, "--repeats", 2, *QUICK)
    first = json.loads(run(*asked, "-o", tmp_path / "e.nc", "--json").stdout)
    assert first["runs"] == 8
    assert [(m["sample"], m["pressure_Pa"], m["runs"]) for m in first["means"]] == [
        ("F", 5e3, 2), ("F", 20e3, 2), ("B", 5e3, 2), ("B", 20e3, 2)
    ]  # fmt: skip
    assert {(f["sample"], f["regime"]) for f in first["fits"]} == {
        (s, r) for s in "FB" for r in ("static", "sliding")
    }
    second = run(*asked, "-o", tmp_path / "e.nc", "--json")
    assert json.loads(second.stdout) == first
    assert "simulating: 8 of 8" in second.stderr
    assert "simulating: 1 of 8" not in second.stderr
    with xr.open_dataset(tmp_path / "e.nc", engine="h5netcdf") as data:
        assert data["static_friction"].shape == (8,)


def test_a_parameter_of_several_values_is_compared_in_pairs(tmp_path: Path):
    """--set shear_factor=0.5,1 gives a mean for each, over equal seeds."""
    said = run("--sample", "B", "--pressure", 5, "--repeats", 1, "--set", "shear_factor=0.5,1", *QUICK,
               "-o", tmp_path / "e.nc", "--json")  # fmt: skip
    means = json.loads(said.stdout)["means"]
    assert [m["shear_factor"] for m in means] == [0.5, 1.0]
    assert means[0]["static"] < means[1]["static"]


def test_table_2_stands_beside_the_paper(tmp_path: Path):
    """All 24 numbers with the printed ones and their deviations, from a small design of the same command."""
    said = run("--table2", "--repeats", 1, "--pressure", 5, "--pressure", 20, *QUICK, "-o", tmp_path / "t.nc", "--json")
    rows = json.loads(said.stdout)["table2"]
    assert len(rows) == 12
    paper = load_table2().set_index(["source", "sample", "regime"])
    for row in rows:
        for name in ("mu", "tau0_kPa"):
            printed = paper.loc[("simulation", row["sample"], row["regime"]), name]
            assert row[f"{name}_paper"] == printed
            assert row[f"{name.split('_')[0]}_deviation_percent"] == pytest.approx(100 * (row[name] / printed - 1))


def test_mechanisms_act_on_every_run_of_an_ensemble(tmp_path: Path):
    """Suction raises static friction of B; its store is not mixed with that of the plain model."""
    asked = ("--sample", "B", "--pressure", 5, "--repeats", 2, *QUICK)
    plain = json.loads(run(*asked, "-o", tmp_path / "a.nc", "--json").stdout)["means"][0]
    sucked = json.loads(run(*asked, "--with", "suction:dp=3000", "-o", tmp_path / "b.nc", "--json").stdout)["means"][0]
    assert sucked["static"] > 1.05 * plain["static"]
    mixed = run(*asked, "--with", "suction:dp=3000", "-o", tmp_path / "a.nc")
    assert mixed.exit_code == 1
    assert "a different design" in mixed.stderr


def test_everything_that_is_wrong_is_said_before_anything_runs(tmp_path: Path):
    """Sample, pressure, step, a NaN, a choice, two unknown parameters and a mechanism in one refusal; no file."""
    result = run(
        "--sample", "Q", "--pressure", -1, "--dt", 1e-3, "--set", "mu_s=NaN", "--set", "edges=open",
        "--set", "shear_factr=1", "--with", "sucktion:dp=1", "-o", tmp_path / "run.nc",
    )  # fmt: skip
    assert result.exit_code == 1
    for word in ("sample", "pressure_Pa", "dt_s", "mu_s", "edges", "shear_factor?", "sucktion", "at most 1.5"):
        assert word in result.stderr
    assert "7 problems" in result.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("text", ["samples = ['F']\npressures_kPa = ['x']\n", "samples = ["])
def test_a_faulty_design_file_is_refused_by_name(tmp_path: Path, text: str):
    (tmp_path / "d.toml").write_text(text)
    result = run("--design", tmp_path / "d.toml", "-o", tmp_path / "e.nc")
    assert result.exit_code == 1
    assert "d.toml" in result.stderr


def test_a_design_file_says_all_of_it(tmp_path: Path):
    """Another option about the runs beside it is wrong usage, as is no description at all."""
    (tmp_path / "d.toml").write_text("samples = ['F']\npressures_kPa = [5]\n")
    assert run("--design", tmp_path / "d.toml", "--sample", "F", "-o", tmp_path / "e.nc").exit_code == 2
    assert run("--design", tmp_path / "d.toml", "--table2", "-o", tmp_path / "e.nc").exit_code == 2
    assert run("--sample", "F", "-o", tmp_path / "e.nc").exit_code == 2


def test_the_dense_engine_is_taken_as_the_fast_one(tmp_path: Path):
    """Said once on stderr, and the file is that of the fast engine."""
    asked = ("--sample", "F", "--pressure", 5, *QUICK, "--json")
    fast = run(*asked, "--engine", "fast", "-o", tmp_path / "fast.nc")
    dense = run(*asked, "--engine", "dense", "-o", tmp_path / "dense.nc")
    assert dense.stderr.count("the dense engine is no longer part of tribo") == 1
    assert "dense" not in fast.stderr
    assert json.loads(dense.stdout) | {"out": ""} == json.loads(fast.stdout) | {"out": ""}
    with xr.open_dataset(tmp_path / "dense.nc", engine="h5netcdf") as data:
        assert data.attrs["engine"] == "fast"


def test_one_run_has_the_seed_it_is_given(tmp_path: Path):
    """FILE.nc holds the run that the library makes of the same seed, to the bit."""
    asked = ("--sample", "Sy", "--pressure", 5, *QUICK, "--seed", 11, "-o", tmp_path / "run.nc", "--json")
    said = json.loads(run(*asked).stdout)
    same = SimConfig(sample="Sy", pressure_Pa=5e3, angle_deg=90.0, seed=11, blocks=(45, 45), dt_s=1e-7,
                     rest_tolerance=0.01, duration_peaks=1.5)  # fmt: skip
    assert said["static_friction"] == library_run(same).static_friction
    with xr.open_dataset(tmp_path / "run.nc", engine="h5netcdf") as data:
        assert data.attrs["seed"] == 11
