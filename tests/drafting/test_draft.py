"""tribo init --from: a campaign drafted from exports says what they say, and lists what they do not."""

from __future__ import annotations

import hashlib
import json
import zipfile
from pathlib import Path

import numpy as np
import pytest
from on_the_command_line import run

from tribo import stages
from tribo.campaign import load_campaign
from tribo.drafting.draft import columns_in_name, name_expression, proposed_patterns, started_at
from tribo.errors import CampaignError

NAMES = "{sample}_{normal_load_N}N_{speed_rpm}RPM_{repeat}"


def pull(sign: float = 1.0, seed: int = 1) -> str:
    """A pull of 2 N sliding and 3 N static friction, as a table."""
    time = np.arange(0, 20, 0.02)
    force = np.interp(time, [0, 4, 7, 7.1, 20], [0, 0, 3, 2, 2]) + np.random.default_rng(seed).normal(
        0, 0.005, time.size
    )
    return (
        "Time [s]\tForce [N]\n" + "\n".join(f"{t:.2f}\t{sign * f:.5f}" for t, f in zip(time, force, strict=True)) + "\n"
    )


def raw_folder(folder: Path, exports: dict[str, str]) -> Path:
    for name, text in exports.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    return folder


def rows_of(folder: Path) -> list[dict[str, str]]:
    lines = (folder / "tests.csv").read_text(encoding="utf-8").splitlines()
    return [dict(zip(lines[0].split(","), line.split(","), strict=True)) for line in lines[1:]]


@pytest.mark.parametrize(
    ("pattern", "name", "fields"),
    [
        (NAMES, "PPS+15PTFE_60N_200RPM_1",
         {"sample": "PPS+15PTFE", "normal_load_N": "60", "speed_rpm": "200", "repeat": "1"}),
        ("{speed_rps}rps{normal_load_N}[N]", "1rps0-7", {"speed_rps": "1", "normal_load_N": "0.7"}),
        ("{speed_rps}rps{normal_load_N}[N]", "1rps15N", {"speed_rps": "1", "normal_load_N": "15"}),
        ("k{stiffness_N_per_m}Nm_v{speed_um_s}", "k168Nm_v42", {"stiffness_N_per_m": "168", "speed_mm_s": "0.042"}),
        ("{sample}_{load_mN}mN", "A_b_250mN", {"sample": "A_b", "normal_load_N": "0.25"}),
        ("{sample} T{temperature_C}", "A T-20", {"sample": "A", "temperature_C": "-20"}),
    ],
)  # fmt: skip
def test_a_pattern_reads_columns_of_tests_from_a_name(pattern: str, name: str, fields: dict[str, str]) -> None:
    assert columns_in_name(name, [pattern]) == fields


@pytest.mark.parametrize("pattern", ["no field", "{sample}_{sample}"])
def test_a_pattern_without_a_field_or_with_one_twice_is_refused(pattern: str) -> None:
    with pytest.raises(CampaignError, match="at least one field"):
        name_expression(pattern)


def test_a_pattern_is_proposed_where_none_is_given() -> None:
    names = ["PPS_60N_200RPM_1", "PPS_100N_200RPM_2", "PTFE_60N_200RPM_1", "notes"]
    (pattern,) = proposed_patterns(names)
    assert pattern == NAMES
    assert [name for name in names if columns_in_name(name, [pattern])] == names[:3]
    assert proposed_patterns(["1rps0-3N", "1rps5N"]) == ("{speed_rps}rps{normal_load_N}N",)
    assert proposed_patterns(["alpha", "beta"]) == ()


@pytest.mark.parametrize(
    ("metadata", "date"),
    [
        ({"Test started at 19": "54:05 on 2019-04-12"}, "2019-04-12T19:54:05"),
        ({"Run date 12 May 2022 12": "21:50"}, "2022-05-12T12:21:50"),
        ({"Started at": "12:21:58.029 12 May 2022"}, "2022-05-12T12:21:58"),
        ({"Datum": "24.12.2025 08:30"}, "2025-12-24T08:30"),
        ({"Serial": "2020-13-45", "Date": "2025-01-02"}, "2025-01-02"),
        ({"Operator": "B. Maier"}, ""),
    ],
)
def test_the_start_of_a_test_is_found_in_its_header(metadata: dict[str, str], date: str) -> None:
    assert started_at(metadata) == date


def test_a_drafted_campaign_is_evaluated_after_its_area_is_filled_in(tmp_path: Path) -> None:
    raw = raw_folder(tmp_path / "exports", {
        "PPS_60N_200RPM_1.txt": "Test speed: 12 mm/min\nDate: 2025-01-02 10:00:00\n\n" + pull(seed=1),
        "PPS_60N_200RPM_2.txt": "Test speed: 12 mm/min\nDate: 2025-01-02 09:00:00\n\n" + pull(seed=2),
        "notes.md": "nothing to read\n",
    })  # fmt: skip
    folder = tmp_path / "c"
    done = run("init", folder, "--from", raw, "--names", NAMES)
    assert done.exit_code == 0
    assert "not listed in tests.csv: notes.md" in done.output
    rows = rows_of(folder)
    assert [(r["file"], r["sample"], r["normal_load_N"], r["speed_rpm"], r["repeat"]) for r in rows] == [
        ("raw/PPS_60N_200RPM_1.txt", "PPS", "60", "200", "1"),
        ("raw/PPS_60N_200RPM_2.txt", "PPS", "60", "200", "2"),
    ]
    assert [(r["speed_mm_s"], r["started_at"], r["run_order"]) for r in rows] == [
        ("0.2", "2025-01-02T10:00:00", "2"), ("0.2", "2025-01-02T09:00:00", "1"),
    ]  # fmt: skip
    toml = (folder / "campaign.toml").read_text(encoding="utf-8")
    assert "# FILL IN nominal_area_mm2" in toml
    assert not load_campaign(folder).has_area
    (folder / "campaign.toml").write_text(
        toml.replace("# FILL IN nominal_area_mm2 =", "nominal_area_mm2 = 50"), encoding="utf-8"
    )
    found = stages.ingest(load_campaign(folder))
    assert not found.set_aside
    assert {round(p.sliding_N, 1) for p in found.pulls.values()} == {2.0}


def test_a_force_that_is_negative_everywhere_gets_a_sign(tmp_path: Path) -> None:
    raw = raw_folder(tmp_path / "raw", {"A_1N_1.txt": pull(-1.0, 1), "A_2N_1.txt": pull(-1.0, 2)})
    folder = tmp_path / "c"
    assert "negative in every record" in run("init", folder, "--from", raw, "--area-mm2", 50).output
    assert "sign = -1\n" in (folder / "campaign.toml").read_text(encoding="utf-8")
    found = stages.ingest(load_campaign(folder))
    assert {round(p.sliding_N, 1) for p in found.pulls.values()} == {2.0}


def test_records_of_a_wide_table_are_a_row_each_with_what_their_heads_say(tmp_path: Path) -> None:
    lines = "\n".join(f"{0.1 * k:.1f}\t{k}\t{2 * k}" for k in range(20))
    raw = raw_folder(tmp_path / "raw", {"sand.txt": "Time\t250\t500\n" + lines + "\n"})
    options = (
        "--columns",
        "time=Time [s],friction_force=* [N]",
        "--records",
        "{normal_stress_Pa}",
        "--area-mm2",
        22619,
    )
    run("init", tmp_path / "c", "--from", raw / "sand.txt", *options)
    assert [(r["file"], r["normal_stress_Pa"]) for r in rows_of(tmp_path / "c")] == [
        ("raw/sand.txt#1", "250"), ("raw/sand.txt#2", "500"),
    ]  # fmt: skip
    assert [t.normal_load_N for t in load_campaign(tmp_path / "c").tests] == pytest.approx([5.65475, 11.3095])


def test_strokes_in_both_directions_share_a_row(tmp_path: Path) -> None:
    there, back = ("\n".join(f"{0.1 * k:.1f}\t{s * (2 + 0.01 * k)}" for k in range(20)) for s in (1, -1))
    text = f"Time [s]\tFx [N]\n{there}\n\nTime [s]\tFx [N]\n{back}\n"
    raw = raw_folder(tmp_path / "raw", {"a_5N.txt": text})
    run("init", tmp_path / "c", "--from", raw)
    assert [r["file"] for r in rows_of(tmp_path / "c")] == ["raw/a_5N.txt#*"]


def test_entries_of_a_zip_are_exports(tmp_path: Path) -> None:
    (tmp_path / "raw").mkdir()
    with zipfile.ZipFile(tmp_path / "raw" / "all.zip", "w") as out:
        out.writestr("in/A_1N_1.txt", pull(seed=1))
        out.writestr("in/A_2N_1.txt", pull(seed=2))
    run("init", tmp_path / "c", "--from", tmp_path / "raw" / "all.zip", "--area-mm2", 50)
    assert [r["file"] for r in rows_of(tmp_path / "c")] == ["raw/all.zip/in/A_1N_1.txt", "raw/all.zip/in/A_2N_1.txt"]
    assert len(stages.ingest(load_campaign(tmp_path / "c")).pulls) == 2


def test_exports_that_need_columns_are_listed_with_what_to_give(tmp_path: Path) -> None:
    raw = raw_folder(tmp_path / "raw", {"A_1N.txt": pull().replace("[s]", "").replace("[N]", "")})
    done = run("init", tmp_path / "c", "--from", raw)
    assert 'friction_force = "Force [unit]"' in " ".join(done.output.split())
    assert [r["normal_load_N"] for r in rows_of(tmp_path / "c")] == ["1"]


def test_a_dry_run_writes_nothing_and_nothing_is_ever_overwritten(tmp_path: Path) -> None:
    raw = raw_folder(tmp_path / "raw", {"A_1N_1.txt": pull(seed=1), "A_2N_1.txt": pull(seed=2)})
    folder = tmp_path / "c"
    shown = run("init", folder, "--from", raw, "--dry-run")
    assert not folder.exists()
    assert "T1,raw/A_1N_1.txt,A,1,1" in shown.output
    run("init", folder, "--from", raw)
    (folder / "tests.csv").write_text("mine\n", encoding="utf-8")
    before = {p: hashlib.sha256(p.read_bytes()).hexdigest() for p in folder.rglob("*") if p.is_file()}
    again = run("init", folder, "--from", raw)
    assert again.exit_code == 1
    assert {p: hashlib.sha256(p.read_bytes()).hexdigest() for p in folder.rglob("*") if p.is_file()} == before


def test_exports_already_in_raw_of_the_campaign_stay_where_they_are(tmp_path: Path) -> None:
    raw = raw_folder(tmp_path / "c" / "raw", {"day 1/A_1N_1.txt": pull(seed=1), "day 1/A_2N_1.txt": pull(seed=2)})
    assert run("init", tmp_path / "c", "--from", raw).exit_code == 0
    assert [r["file"] for r in rows_of(tmp_path / "c")] == ["raw/day 1/A_1N_1.txt", "raw/day 1/A_2N_1.txt"]


def test_a_table_of_evaluated_forces_becomes_tests(tmp_path: Path) -> None:
    table = tmp_path / "cof.csv"
    table.write_text(
        'Load,CoF,Material,Label,Constant\n10,0.5,A,"10\nmN",x\n20,0.4,A,"20\nmN",x\n40,0.3,B,"day\n2",x\n40,0.3,B,"day\n3",x\n',
        encoding="utf-8",
    )
    mapping = "sample=Material,normal_load_mN=Load,coefficient=CoF"
    done = run("init", tmp_path / "c", "--from", table, "--table", mapping, "--area-mm2", 16, "--json")
    assert json.loads(done.stdout)["rows"][0]["normal_load_N"] == "0.01"
    found = stages.ingest(load_campaign(tmp_path / "c"))
    assert [p.sliding_N for p in found.pulls.values()] == pytest.approx([0.005, 0.008, 0.012, 0.012])
    assert found.campaign.tests[2].covariates == {"Label": "day 2"}
    wrong = run("init", tmp_path / "d", "--from", table, "--table", "sample=Material,coefficient=COF")
    assert wrong.exit_code == 1
    assert "no such column for coefficient" in wrong.output
    assert "normal_load_N" in wrong.output


def test_a_recorded_load_is_left_to_the_record_and_the_one_in_the_name_is_kept(tmp_path: Path) -> None:
    lines = pull().replace("Force [N]", "Force [N]\tFz [N]").splitlines()
    text = "\n".join([lines[0], *(f"{line}\t5.1" for line in lines[1:])])
    raw = raw_folder(tmp_path / "raw", {"A_5N.txt": text + "\n"})
    done = run("init", tmp_path / "c", "--from", raw, "--area-mm2", 50)
    assert "normal force is recorded for 1 of 1 rows" in done.output
    (row,) = rows_of(tmp_path / "c")
    assert (row["normal_load_N"], row["nominal_load_N"]) == ("", "5")
    (test,) = stages.ingest(load_campaign(tmp_path / "c")).campaign.tests
    assert test.normal_load_N == pytest.approx(5.1)


def test_a_table_of_evaluated_forces_is_recognised_by_its_columns_and_the_unit_in_its_labels(tmp_path: Path) -> None:
    rows = [f"silicone,{n},{n / 40:g} kPa,{n} mN,{2 / n:.3f},0.1,{c}" for n in (10, 20, 40) for c in (3, 4)]
    text = "Material,NominalLoad,Pressure,NominalLoad.label,CoF.mean,CoF.sd,CycleID\n" + "\n".join(rows) + "\n"
    raw = raw_folder(tmp_path / "raw", {"cycles.csv": text})
    done = run("init", tmp_path / "c", "--from", raw)
    assert 'columns "sample=Material,normal_load_mN=NominalLoad,coefficient=CoF.mean" (proposed' in done.output
    first = rows_of(tmp_path / "c")[0]
    assert first == {"test_id": "T1", "sample": "silicone", "normal_load_N": "0.01", "coefficient": "0.200",
                     "CycleID": "3"}  # fmt: skip
    assert not (tmp_path / "c" / "raw").exists()


def test_a_table_whose_load_has_no_unit_is_not_guessed(tmp_path: Path) -> None:
    raw = raw_folder(tmp_path / "raw", {"cycles.csv": "Material,Load,CoF\nsilicone,10,0.2\nrubber,20,0.1\n"})
    run("init", tmp_path / "c", "--from", raw)
    assert "coefficient" not in rows_of(tmp_path / "c")[0]


def test_columns_filled_for_all_tests_leave_what_a_name_says(tmp_path: Path) -> None:
    raw = raw_folder(tmp_path / "raw", {"A_5N.txt": pull(), "B.txt": pull()})
    names = ("--names", "{sample}_{normal_load_N}N", "--names", "{sample}")
    run("init", tmp_path / "c", "--from", raw, *names, "--fill", "normal_load_N=2,operator=Ann")
    assert [(r["normal_load_N"], r["operator"]) for r in rows_of(tmp_path / "c")] == [("5", "Ann"), ("2", "Ann")]


def rotary(rest_N: float) -> str:
    """A rotary record of 1 N friction on a lever arm of 2.5 mm, ``rest_N`` at rest, with the turns of the drive."""
    time = np.arange(0, 40, 0.1)
    turns = np.where((time > 2) & (time < 30), 60.0, 0.0)
    torque = (rest_N + (turns > 0)) * 2.5e-3 + np.random.default_rng(3).normal(0, 2e-6, time.size)
    rows = [f"{t:.1f}\t{m:.7f}\t{n:.0f}" for t, m, n in zip(time, torque, turns, strict=True)]
    return "Time [s]\tTorque [N m]\tDrehzahl [1/min]\n" + "\n".join(rows) + "\n"


def test_the_zero_is_taken_at_rest_where_the_drive_shows_the_rest(tmp_path: Path) -> None:
    raw = raw_folder(tmp_path / "raw", {"oil_5N.txt": rotary(-0.5)})
    names = ("--names", "{sample}_{normal_load_N}N", "--set", "lever_arm_mm=2.5")
    done = run("init", tmp_path / "c", "--from", raw, *names)
    assert 'zero = "at rest" was written' in done.output
    (pull,) = stages.ingest(load_campaign(tmp_path / "c")).pulls.values()
    assert pull.sliding_N == pytest.approx(1.0, rel=0.01)
    assert rows_of(tmp_path / "c")[0]["speed_mm_s"] == "15.7"  # 2 pi 2.5 mm at one turn a second


def test_what_init_writes_for_an_unknown_area_is_a_doubt_of_the_results(tmp_path: Path) -> None:
    time = np.arange(600) * 0.1
    ratio = 0.45 + 0.002 * np.random.default_rng(2).standard_normal(600)
    rows = [f"{t:.1f}\t{0.2 * t:.2f}\t{mu:.5f}\t30.0" for t, mu in zip(time, ratio, strict=True)]
    head = "Time (s)\tDispl (microns)\tFriction\tNormal stress (MPa)"
    raw = raw_folder(tmp_path / "raw", {"gouge_1.txt": "\n".join([head, *rows]) + "\n"})
    assert run("init", tmp_path / "c", "--from", raw).exit_code == 0
    said = " ".join(run("ingest", tmp_path / "c", "-o", tmp_path / "out").output.split())
    assert "the nominal area is 1 mm2, which stands where none is known" in said
