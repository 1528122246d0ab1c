"""A file under its final name is whole; the same study gives the same bytes."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr
from support import first_quick

from report.conftest import PROVENANCE, Written
from tribo.files import whole_file, write_text
from tribo.outputs import unit_of
from tribo.records import Study
from tribo.report import gather_provenance, write_report, write_until
from tribo.report.campaign_nc import write_store

FIGURES = ["agreement", *(f"fig{k}" for k in range(3, 9)), "traces"]


def test_out_holds_the_agreed_files(written: Written) -> None:
    found = {str(p.relative_to(written.out)) for p in written.out.rglob("*") if p.is_file()}
    figures = {f"figures/{name}.{kind}" for name in FIGURES for kind in ("svg", "pdf", "png", "csv")}
    tables = {"tests.csv", "fits.csv", "other_fits.csv", "comparison.csv"}
    assert found == figures | tables | {
        "campaign.nc", "card.json", "report.html", "report.pdf", "provenance.json", "ro-crate-metadata.json",
    }  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", first_quick(["measured", "study"]))
def test_the_same_study_gives_the_same_bytes(name: str, request: pytest.FixtureRequest, tmp_path: Path) -> None:
    first, again = tmp_path / "first", tmp_path / "again"
    for folder in (first, again):
        write_report(request.getfixturevalue(name), folder, provenance=PROVENANCE)
    names = [p.relative_to(first) for p in first.rglob("*") if p.is_file() and p.suffix != ".nc"]
    assert len(names) > 20
    assert not [name for name in names if (first / name).read_bytes() != (again / name).read_bytes()]


@pytest.mark.slow
def test_a_file_that_takes_over_earlier_groups_has_the_same_bytes(study: Study, tmp_path: Path) -> None:
    write_store(study, tmp_path)
    first = (tmp_path / "campaign.nc").read_bytes()
    write_store(study, tmp_path, keep_earlier=True)
    assert (tmp_path / "campaign.nc").read_bytes() == first


def test_an_error_while_writing_leaves_the_old_file_and_no_part(tmp_path: Path) -> None:
    path = write_text(tmp_path / "a.txt", "old")

    def write_half() -> None:
        with whole_file(path) as part:
            part.write_text("ha")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        write_half()
    assert [(p.name, p.read_text()) for p in tmp_path.iterdir()] == [("a.txt", "old")]


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs SIGKILL")
def test_a_killed_run_leaves_no_half_written_file_under_a_final_name(tmp_path: Path) -> None:
    program = (
        "import os, signal, sys\nfrom pathlib import Path\nfrom tribo.files import whole_file\n"
        "with whole_file(Path(sys.argv[1]) / 'a.txt') as part:\n"
        "    part.write_text('ha')\n    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    run = subprocess.run([sys.executable, "-c", program, str(tmp_path)], check=False)
    assert run.returncode == -signal.SIGKILL
    assert [p.name for p in tmp_path.iterdir() if not p.name.startswith(".")] == []


@pytest.mark.parametrize(
    ("until", "expected"),
    [("ingest", {"tests.csv"}), ("fit", {"tests.csv", "fits.csv", "other_fits.csv"})],
)
def test_a_walk_that_stops_early_writes_less(until: str, expected: set[str], of_two: Study, tmp_path: Path) -> None:
    from dataclasses import replace

    short = replace(of_two, comparison=None, fits=of_two.fits if until == "fit" else ())
    write_until(short, tmp_path, until)
    assert {p.name for p in tmp_path.iterdir()} == expected | {"campaign.nc", "provenance.json"}


def test_progress_is_told_of_every_figure(written: Written) -> None:
    assert [done for _, done, _ in written.told] == list(range(1, len(FIGURES) + 1))
    assert {total for _, _, total in written.told} == {len(FIGURES)}


@pytest.fixture
def store(written: Written) -> Path:
    return written.out / "campaign.nc"


def test_xarray_reads_every_trace_back_to_the_same_bits(store: Path, study: Study) -> None:
    with xr.open_datatree(store, engine="h5netcdf") as tree:
        traces = tree["traces"]
        for k, test_id in enumerate(traces["test_id"].values[:5]):
            start, size = int(traces["row_start"][k]), int(traces["row_size"][k])
            part = slice(start, start + size)
            assert (traces["force_N"].values[part] == study.ingested.traces[test_id].force_N).all()
            assert (traces["time_s"].values[part] == study.ingested.traces[test_id].time_s).all()
        assert int(traces["row_size"].sum()) == traces.sizes["sample"]


def test_xarray_opens_the_file_as_a_dataset_of_tests_and_every_group_as_before(store: Path, study: Study) -> None:
    with xr.open_dataset(store) as tests, xr.open_datatree(store, engine="h5netcdf") as tree:
        assert tests.attrs["title"] == study.ingested.campaign.title
        assert set(tests.coords) == {"test_id", "sample", "specimen", "normal_load_N"}
        assert set(tests.variables) == set(tree["tests"].to_dataset(inherit=False).variables)
        found = tests.set_index(test="test_id").sel(test="T0001")
        assert float(found["static_N"]) == pytest.approx(study.ingested.pulls["T0001"].static_N, rel=1e-7)
        assert tests["static_N"].attrs["units"] == "N"
        assert tests.sizes["test"] > tree["traces"].sizes["trace"]  # two tests are set aside
        assert {"tests", "traces", "fits", "comparison", "simulated"} <= set(tree.children)


def test_plain_h5py_reads_names_numbers_and_units(store: Path, study: Study) -> None:
    with h5py.File(store) as file:
        assert file["traces/force_N"].attrs["units"] in ("N", b"N")
        assert file["fits/tau0_kPa"].attrs["units"] in ("kPa", b"kPa")
        assert file["tests/test_id"][0].decode() == "T0001"
        assert np.isnan(file["tests/static_N"][-1])
        assert file.attrs["title"] == study.ingested.campaign.title
        assert set(file) >= {"tests", "fits", "other_fits", "comparison", "simulated", "traces"}


@pytest.mark.parametrize(
    ("column", "unit"),
    [
        ("static_u_N", "N"), ("rise_N_per_s", "N/s"), ("rise_stiffness_N_per_m", "N/m"), ("speed_m_s", "m/s"),
        ("tau0_u_kPa", "kPa"), ("displacement_m", "m"), ("mu", "1"), ("sample", None), ("temperature_C", "degC"),
    ],
)  # fmt: skip
def test_the_unit_ends_the_name(column: str, unit: str | None) -> None:
    assert unit_of(column) == unit


def test_provenance_hashes_what_is_there(study: Study, tmp_path: Path) -> None:
    from dataclasses import replace
    from hashlib import sha256

    (tmp_path / "raw").mkdir()
    (tmp_path / "campaign.toml").write_bytes(b"title")
    (tmp_path / "raw" / "T0001.csv").write_bytes(b"export")
    campaign = replace(study.ingested.campaign, root=tmp_path)
    moved = replace(study, ingested=replace(study.ingested, campaign=campaign))
    before = gather_provenance(moved, "tribo report")
    assert before.inputs["raw/T0001.csv"] == sha256(b"export").hexdigest()
    assert before.inputs.keys() == {"campaign.toml", "raw/T0001.csv"}
    assert before.versions["numpy"] == np.__version__
    (tmp_path / "raw" / "T0001.csv").write_bytes(b"Export")
    assert gather_provenance(moved).inputs_digest != before.inputs_digest


def test_naming_the_report_loads_none_of_the_heavy_libraries() -> None:
    program = (
        "import sys, tribo.report, tribo.figures\n"
        "print([m for m in ('matplotlib', 'pandas', 'xarray', 'jinja2', 'scipy') if m in sys.modules])"
    )
    run = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True)
    assert run.stdout.strip() == "[]"
