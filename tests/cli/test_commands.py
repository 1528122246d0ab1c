"""The commands keep the promises of their interface: outputs, exit statuses, faults in words, nothing half done."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from on_the_command_line import digest, run

from tribo.errors import FitError, Problem
from tribo.records import Comparison, Study
from tribo.traces.rules import RULES


@pytest.fixture
def spoiled(small_campaign: Path, tmp_path: Path) -> Path:
    """The small campaign with one export emptied and one row naming an unknown sample."""
    folder = tmp_path / "spoiled"
    shutil.copytree(small_campaign, folder)
    (folder / "raw" / "T003.csv").write_bytes(b"")
    table = (folder / "tests.csv").read_text(encoding="utf-8").splitlines()
    table[5] = table[5].replace(",F,", ",Q,").replace(",B,", ",Q,")
    (folder / "tests.csv").write_text("\n".join(table) + "\n", encoding="utf-8")
    return folder


@pytest.fixture
def said(small_report: Path) -> dict[str, Any]:
    """What `tribo report --json` said of the small campaign."""
    found: dict[str, Any] = json.loads((small_report.parent / "said.json").read_text(encoding="utf-8"))
    return found


def test_report_writes_every_file_of_the_interface(small_report: Path) -> None:
    expected = {"tests.csv", "fits.csv", "comparison.csv", "campaign.nc", "report.html"}
    assert expected <= {p.name for p in small_report.iterdir()}
    for number in (3, 4, 5, 6, 7, 8):
        for kind in ("svg", "png", "csv"):
            assert list((small_report / "figures").glob(f"fig{number}*.{kind}")), (number, kind)


def test_report_leaves_no_temporary_file(small_report: Path) -> None:
    assert [p for p in small_report.rglob("*") if p.name.startswith(".") or p.suffix in {".tmp", ".part"}] == []


def test_tables_have_the_columns_of_the_interface_in_its_order(small_report: Path) -> None:
    columns = {
        "tests.csv": "test_id static_N static_u_N sliding_N sliding_u_N rule window zero_N flags set_aside",
        "fits.csv": "sample regime mu mu_u tau0_kPa tau0_u_kPa cov n_specimens n_tests method chi2_red",
        "comparison.csv": "sample regime normal_load_N measured_N measured_u_N simulated_N simulated_u_N",
    }
    for name, wanted in columns.items():
        found = list(pd.read_csv(small_report / name).columns)
        assert found[: len(wanted.split())] == wanted.split()


def test_the_calibrated_model_gives_back_the_flat_sample(small_report: Path) -> None:
    flat = pd.read_csv(small_report / "comparison.csv").query("sample == 'F'")
    fits = pd.read_csv(small_report / "fits.csv").query("sample == 'F'").set_index("regime")
    for _, row in flat.iterrows():
        law = fits.loc[row["regime"]]
        expected = law["mu"] * row["normal_load_N"] + law["tau0_kPa"] * 1e3 * 55e-6
        assert row["simulated_N"] == pytest.approx(expected, rel=0.02)


def test_json_of_report_carries_the_fits_and_no_talk(said: dict[str, Any]) -> None:
    assert {(f["sample"], f["regime"]) for f in said["fits"]} == {
        (s, r) for s in ("F", "B") for r in ("static", "sliding")
    }
    assert said["set_aside"] == []


def test_nothing_is_written_into_the_campaign(small_campaign: Path, tmp_path: Path) -> None:
    before = digest(small_campaign)
    assert run("ingest", small_campaign, "-o", tmp_path / "out").exit_code == 0
    assert digest(small_campaign) == before


def test_a_zip_gives_the_same_tables_as_its_folder(small_campaign: Path, small_report: Path, tmp_path: Path) -> None:
    archive = shutil.make_archive(str(tmp_path / "campaign"), "zip", small_campaign)
    run("fit", archive, "-o", tmp_path / "out")
    for name in ("tests.csv", "fits.csv"):
        assert (tmp_path / "out" / name).read_bytes() == (small_report / name).read_bytes()


def test_faulty_tests_are_set_aside_and_listed_and_the_rest_stands(spoiled: Path, tmp_path: Path) -> None:
    result = run("ingest", spoiled, "-o", tmp_path / "out")
    assert result.exit_code == 3
    assert "raw/T003.csv: the file is empty" in result.stderr
    assert "tests.csv, row 6, column sample" in result.stderr
    table = pd.read_csv(tmp_path / "out" / "tests.csv")
    assert table["set_aside"].notna().sum() == 2
    assert table["static_N"].notna().sum() == 22


def test_a_test_excluded_by_hand_is_no_fault(small_campaign: Path, tmp_path: Path) -> None:
    folder = tmp_path / "campaign"
    shutil.copytree(small_campaign, folder)
    table = pd.read_csv(folder / "tests.csv")
    table["exclude"] = ["sled tipped over"] + [""] * (len(table) - 1)
    table.to_csv(folder / "tests.csv", index=False)
    result = run("ingest", folder, "-o", tmp_path / "out", "--json")
    assert result.exit_code == 0
    (reason,) = (s["reason"] for s in json.loads(result.stdout)["set_aside"])
    assert "sled tipped over" in reason


def test_an_unusable_campaign_lists_every_fault_at_once_and_writes_nothing(spoiled: Path, tmp_path: Path) -> None:
    toml = (spoiled / "campaign.toml").read_text(encoding="utf-8")
    toml = toml.replace("nominal_area_mm2 = 55.0", "nominal_aera_mm2 = 55.0")
    (spoiled / "campaign.toml").write_text(toml.replace("slider_mass_g = 1.5", 'slider_mass_g = "heavy"'))
    result = run("fit", spoiled, "-o", tmp_path / "out", "--json")
    assert result.exit_code == 1
    assert "nominal_aera_mm2" in result.stderr
    assert "slider_mass_g" in result.stderr
    assert "Traceback" not in result.stderr
    assert len(json.loads(result.stdout)["problems"]) >= 2
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_a_campaign_without_a_flat_sample_is_evaluated_without_the_model(small_campaign: Path, tmp_path: Path) -> None:
    result = run("compare", small_campaign, "-o", tmp_path / "out", "--dry-run", "--flat", "B")
    assert result.exit_code == 1  # B has cavities
    assert "--flat F" in result.stderr
    folder = tmp_path / "campaign"
    shutil.copytree(small_campaign, folder)
    table = pd.read_csv(folder / "tests.csv")
    table[table["sample"] == "B"].to_csv(folder / "tests.csv", index=False)
    result = run("compare", folder, "-o", tmp_path / "out")
    assert result.exit_code == 0
    assert "flat sample" in result.stdout + result.stderr
    assert not (tmp_path / "out" / "comparison.csv").exists()


def test_the_number_of_processes_reaches_the_diagnosis_of_a_report(
    small_campaign: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[int] = []

    def stop(*_: object, jobs: int, **__: object) -> None:
        seen.append(jobs)
        raise FitError(Problem("stopped", "the test has seen enough"))

    monkeypatch.setattr("tribo.stages.diagnose", stop)
    compared = Comparison((), ())
    monkeypatch.setattr(
        "tribo.stages.compare", lambda ingested, fits, *_, **__: Study(ingested, fits, comparison=compared)
    )
    monkeypatch.setattr("tribo.report.write_until", lambda *_: None)
    run("report", small_campaign, "-o", tmp_path / "out", "--jobs", "3")
    assert seen == [3]


def test_a_dry_run_says_what_would_be_done_and_writes_nothing(small_campaign: Path, tmp_path: Path) -> None:
    result = run("report", small_campaign, "-o", tmp_path / "out", "--dry-run")
    assert result.exit_code == 0
    assert "would read 24 exports" in result.stdout
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("arguments", [["report"], ["fit", "nowhere", "-o", "x"], ["fits"], ["simulate", "--sample"]])
def test_wrong_usage_ends_with_status_2(arguments: list[str]) -> None:
    assert run(*arguments).exit_code == 2


def test_a_question_mark_for_the_rule_lists_every_rule_without_a_campaign() -> None:
    result = run("fit", "--rule", "?")
    assert result.exit_code == 0
    assert [line.split(":")[0] for line in result.stdout.splitlines()] == list(RULES)


def test_init_writes_a_campaign_that_loads_and_never_overwrites(tmp_path: Path) -> None:
    assert run("init", tmp_path / "mine").exit_code == 0
    before = digest(tmp_path / "mine")
    assert {"campaign.toml", "tests.csv"} <= set(before)
    assert run("init", tmp_path / "mine").exit_code == 1
    assert digest(tmp_path / "mine") == before


def test_doctor_finds_everything_here() -> None:
    found = json.loads(run("doctor", "--json").stdout)
    assert found["healthy"] is True
    assert found["bundled_example"] is True


def test_simulate_writes_a_run_that_xarray_and_h5py_read(tmp_path: Path) -> None:
    import h5py
    import xarray as xr

    out = tmp_path / "run.nc"
    result = run(
        "simulate", "--sample", "F", "--pressure", 10, "--angle", 30, "--seed", 1, "--blocks", 20, "--duration", 5,
        "-o", out, "--json",
    )  # fmt: skip
    assert result.exit_code == 0
    with xr.open_dataset(out, engine="h5netcdf") as data:
        assert {"time", "force", "moving"} <= set(data.variables)
        assert data["force"].attrs["units"] == "N"
        assert data.attrs["static_friction"] == pytest.approx(json.loads(result.stdout)["static_friction"])
    with h5py.File(out) as file:
        assert file["force"].shape == file["time"].shape


def test_an_impossible_simulation_is_refused_with_everything_that_is_wrong(tmp_path: Path) -> None:
    result = run("simulate", "--sample", "F", "--pressure", -1, "--dt", 1e-3, "-o", tmp_path / "run.nc")
    assert result.exit_code == 1
    assert "pressure" in result.stderr
    assert not (tmp_path / "run.nc").exists()


def test_report_carries_a_verdict_in_the_binding_schema(small_report: Path) -> None:
    verdict = json.loads((small_report / "verdict.json").read_text(encoding="utf-8"))
    assert verdict["schema"] == "tribo.verdict/2"
    assert verdict["verdict"] in {"no_misfit", "named", "undetermined", "unknown"}
    assert {"misfits", "causes", "equivalent", "excluded", "gain", "set_aside", "next_test"} <= set(verdict)


def test_fit_says_what_the_campaign_could_have_shown(said: dict[str, Any]) -> None:
    assert any("static T at 10 kPa" in line for line in said["power"])


def test_a_plan_needs_no_export(small_campaign: Path, tmp_path: Path) -> None:
    shutil.copytree(small_campaign, tmp_path / "plan", ignore=shutil.ignore_patterns("raw"))
    result = run("plan", tmp_path / "plan", "--json")
    assert result.exit_code == 0
    found = {f["mechanism"]: f for f in json.loads(result.stdout)["findings"]}
    assert found["velocity_dependence"]["why"]
    assert found["pull_angle"]["why"]


def test_suction_raises_the_simulated_friction_of_a_patterned_sample(tmp_path: Path) -> None:
    friction = []
    for extra in ([], ["--with", "suction:dp=3000"]):
        result = run(
            "simulate", "--sample", "B", "--pressure", 5, "--blocks", 24, "-o", tmp_path / "run.nc", "--json", *extra
        )
        friction.append(json.loads(result.stdout)["static_friction"])
    assert friction[1] > 1.05 * friction[0]


def test_an_unknown_mechanism_is_refused_with_the_known_ones(tmp_path: Path) -> None:
    out = tmp_path / "run.nc"
    result = run("simulate", "--sample", "B", "--pressure", 5, "--with", "sucktion:dp=1", "-o", out)
    assert result.exit_code == 1
    assert "suction" in result.stderr


@pytest.mark.parametrize("command", ["ingest", "fit", "compare", "diagnose", "report"])
def test_every_command_on_a_campaign_takes_columns(small_campaign: Path, tmp_path: Path, command: str) -> None:
    """Columns that name no quantity make every export unreadable, so that each command shows it obeys them."""
    result = run(command, small_campaign, "-o", tmp_path / "out", "--columns", "fricton_force=Load [N]", "-q")
    assert result.exit_code == 1
    assert "did you mean friction_force?" in result.stderr


def test_diagnose_takes_a_campaign_or_a_published_table_and_not_both(tmp_path: Path) -> None:
    neither = run("diagnose", "-o", tmp_path)
    both = run("diagnose", tmp_path, "--published", "berardo2019", "-o", tmp_path)
    assert (neither.exit_code, both.exit_code) == (2, 2)
    assert "CAMPAIGN" in neither.output


@pytest.mark.slow
def test_the_diagnosis_of_a_published_table_can_be_verified(tmp_path: Path) -> None:
    """Its record names the two tables it rests on, and every file it wrote."""
    assert run("diagnose", "--published", "berardo2019", "-o", tmp_path, "-q").exit_code == 0
    record = json.loads((tmp_path / "provenance.json").read_text(encoding="utf-8"))
    assert set(record["inputs"]) == {"table2.csv", "table2_tribo.csv"}
    assert "verdict.json" in record["outputs"]
    assert run("verify", tmp_path).exit_code == 0
    (tmp_path / "verdict.json").write_text("{}", encoding="utf-8")
    assert run("verify", tmp_path).exit_code == 1


def test_simulations_alone_say_which_tests_were_set_aside_and_why(
    spoiled: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tribo.stages.simulate_cells", lambda *_: ())
    result = run("predict", spoiled, "-o", tmp_path / "out", "-q")
    assert result.exit_code == 3
    assert "T003: raw/T003.csv: the file is empty" in result.stderr
    assert "T005: tests.csv, row 6, column sample" in result.stderr


@pytest.mark.parametrize("command", ["diagnose", "discover"])
def test_where_too_few_tests_are_left_it_is_said_which_were_set_aside_and_why(
    spoiled: Path, tmp_path: Path, command: str
) -> None:
    table = spoiled / "tests.csv"
    table.write_text("".join(table.read_text(encoding="utf-8").splitlines(keepends=True)[:9]), encoding="utf-8")
    result = run(command, spoiled, "-o", tmp_path / "out", "-q")
    if command == "diagnose":
        assert result.exit_code == 3  # done, with tests set aside
        assert json.loads((tmp_path / "out" / "verdict.json").read_text(encoding="utf-8"))["verdict"] == "cannot_tell"
        assert "too little was measured (6 usable tests, at least 12 are needed)" in result.stdout
    else:
        assert result.exit_code == 1
        assert "too few usable tests" in result.stderr
    assert "T003: raw/T003.csv: the file is empty" in result.stderr
    assert "T005: tests.csv, row 6, column sample" in result.stderr
