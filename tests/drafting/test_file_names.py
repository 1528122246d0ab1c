"""Names of files: what a proposed pattern reads, what is asked, and what is said of text that is not used."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from on_the_command_line import run

from tribo import stages
from tribo.campaign import load_campaign
from tribo.drafting.file_names import columns_in_name, not_used, proposed_patterns, radii_in_name, where_it_stops

from .test_draft import pull, raw_folder, rows_of

LONG = "{}_FX2_{}_0.25in_Rotary_{}N_4tests_300-75mm-s_6-15mm-radius"


def folder_of(tmp_path: Path, *names: str) -> Path:
    return raw_folder(tmp_path / "exports", {f"{name}.txt": pull(seed=k) for k, name in enumerate(names)})


@pytest.mark.parametrize(
    ("names", "pattern"),
    [
        ([LONG.format("014", "316SS", 3), LONG.format("018", "Polyimide", 9)],
         LONG.format("{test_id}", "{sample}", "{normal_load_N}")),
        ([LONG.format("014", "316SS", 3), LONG.format("018", "316SS", 9)],
         LONG.format("{test_id}", "316SS", "{normal_load_N}")),
        (["1rps0-3N", "1rps0-7", "1rps15N"], "{speed_rps}rps{normal_load_N}[N]"),
        (["A_500mN_1", "A_2N_2"], "{sample}_{normal_load}_{repeat}"),
        (["0.5Hz20lbtension", "1Hz80lbtension"], "{frequency_Hz}Hz{lbtension_number}lbtension"),
        (["T001", "T002"], "{test_id}"),
        (["T001 steel", "T002 brass"], "T{test_id} {sample}"),
        (["2021-03-04_PTFE_5N", "2021-03-05_PTFE_5N"], "{started_at}_PTFE_{normal_load_N}N"),
        (["PTFE-5N-1", "PTFE-10N-2", "PEEK-5N-1"], "{sample}-{normal_load_N}N-{repeat}"),
    ],
)  # fmt: skip
def test_a_pattern_reads_every_part_that_differs(names: list[str], pattern: str) -> None:
    assert proposed_patterns(names) == (pattern,)
    assert not not_used(names, [pattern])


@pytest.mark.parametrize(
    ("text", "cells"),
    [
        ("A_500mN_1", {"normal_load_N": "0.5"}), ("A_2N_1", {"normal_load_N": "2"}),
        ("A_0.5kgf_1", {"normal_load_N": "4.903325"}),
    ],
)  # fmt: skip
def test_a_load_is_read_with_the_unit_that_stands_in_the_name(text: str, cells: dict[str, str]) -> None:
    assert columns_in_name(text, ["{sample}_{normal_load}_{repeat}"]) == {"sample": "A", "repeat": "1"} | cells


def test_a_speed_with_its_unit_is_one_in_turns_or_on_a_path() -> None:
    assert columns_in_name("300mm-s", ["{speed}"]) == {"speed_mm_s": "300"}
    assert columns_in_name("20um-s", ["{speed}"]) == {"speed_mm_s": "0.02"}
    assert columns_in_name("60rpm", ["{speed}"]) == {"speed_rpm": "60"}


@pytest.mark.parametrize(
    ("name", "pattern", "said"),
    [
        ("A_3N_x", "{sample}_{normal_load_N}N_{repeat}", 'has "x" at character 6, where the pattern has "{repeat}"'),
        ("A-3N", "{sample}_{normal_load_N}N", 'has no "_" behind {sample}, which begins at character 1'),
        ("A_3N_1", "{sample}_{normal_load_N}N", 'goes on with "_1" from character 5'),
    ],
)
def test_a_pattern_that_fits_no_file_says_where_it_stopped(tmp_path: Path, name: str, pattern: str, said: str) -> None:
    assert said in where_it_stops(name, pattern)
    done = run("init", tmp_path / "c", "--from", folder_of(tmp_path, name), "--names", pattern)
    assert done.exit_code == 1
    assert said in " ".join(done.output.split())
    assert not (tmp_path / "c").exists()


def test_two_texts_that_differ_are_asked_about_and_each_answer_works(tmp_path: Path) -> None:
    raw = folder_of(tmp_path, "steel_oil_5N", "steel_dry_5N", "brass_oil_5N")
    asked = run("init", tmp_path / "c", "--from", raw, "--json")
    assert asked.exit_code == 1
    assert "one of them is the sample" in asked.output
    assert not (tmp_path / "c").exists()
    for k, (pattern, samples) in enumerate(
        [
            ("{sample}_{part2}_{normal_load_N}N", ["brass", "steel", "steel"]),
            ("{part1}_{sample}_{normal_load_N}N", ["oil", "dry", "oil"]),
        ]
    ):
        assert pattern in asked.output
        assert run("init", tmp_path / f"c{k}", "--from", raw, "--names", pattern).exit_code == 0
        assert [row["sample"] for row in rows_of(tmp_path / f"c{k}")] == samples


def test_names_that_say_nothing_are_not_pooled_in_silence(tmp_path: Path) -> None:
    raw = folder_of(tmp_path, "alpha", "beta")
    asked = run("init", tmp_path / "c", "--from", raw)
    assert asked.exit_code == 1
    for pattern, samples in (("{sample}", ["alpha", "beta"]), ("{test_id}", ["exports"] * 2), ("*", ["exports"] * 2)):
        assert f'--names "{pattern}"' in asked.output
        folder = tmp_path / pattern.strip("{}*")
        assert run("init", folder / "c", "--from", raw, "--names", pattern).exit_code == 0
        assert [row["sample"] for row in rows_of(folder / "c")] == samples


def test_what_a_pattern_drops_is_stated_in_the_summary_and_in_the_campaign(tmp_path: Path) -> None:
    raw = folder_of(tmp_path, LONG.format("014", "316SS", 3), LONG.format("018", "Polyimide", 9))
    done = run("init", tmp_path / "c", "--from", raw, "--names", "{test_id}_*_{normal_load_N}N_*")
    assert "names not used: FX2_316SS_0.25in_Rotary, FX2_Polyimide_0.25in_Rotary" in " ".join(done.output.split())
    assert "316SS" in (tmp_path / "c" / "campaign.toml").read_text(encoding="utf-8")
    assert [t.test_id for t in load_campaign(tmp_path / "c").tests] == ["014", "018"]


def test_a_load_recorded_in_some_exports_only_stays_with_them_when_the_others_are_filled_in(tmp_path: Path) -> None:
    lines = pull().replace("Force [N]", "Force [N]\tFz [N]").splitlines()
    with_load = "\n".join([lines[0], *(f"{line}\t5.1" for line in lines[1:])]) + "\n"
    raw = raw_folder(tmp_path / "raw", {"A_1.txt": with_load, "A_2.txt": pull(seed=2)})
    done = run("init", tmp_path / "c", "--from", raw, "--area-mm2", 50)
    assert "the load of 1 rows" in done.output
    table = tmp_path / "c" / "tests.csv"
    rows = rows_of(tmp_path / "c")
    assert [row["file"] for row in rows] == ["raw/A_1.txt#1", "raw/A_2.txt"]
    columns = list(rows[0])
    rows[1]["normal_load_N"] = "7"
    table.write_text("\n".join([",".join(columns), *(",".join(row.values()) for row in rows)]) + "\n")
    found = stages.ingest(load_campaign(tmp_path / "c"))
    assert not found.set_aside
    assert [t.normal_load_N for t in found.campaign.tests] == pytest.approx([5.1, 7.0])


def ratio(load: bool) -> str:
    """A coefficient of 0.3 while sliding, with a stress of 2 MPa or without."""
    time = np.arange(0, 20, 0.02)
    mu = np.interp(time, [0, 4, 7, 7.1, 20], [0, 0, 0.4, 0.3, 0.3])
    mu += np.random.default_rng(1).normal(0, 1e-3, time.size)
    rows = [f"{t:.2f}\t{m:.5f}" + ("\t2.0" if load else "") for t, m in zip(time, mu, strict=True)]
    return ("Time [s]\tCOF" + ("\tNormal stress [MPa]" if load else "")) + "\n" + "\n".join(rows) + "\n"


def test_a_coefficient_takes_its_load_from_the_name(tmp_path: Path) -> None:
    raw = raw_folder(tmp_path / "raw", {"A_5N_1.txt": ratio(False), "A_8N_1.txt": ratio(False)})
    assert run("init", tmp_path / "c", "--from", raw).exit_code == 0
    pulls = stages.ingest(load_campaign(tmp_path / "c")).pulls.values()
    assert [p.sliding_N for p in pulls] == pytest.approx([1.5, 2.4], rel=0.01)


def test_a_coefficient_with_a_stress_is_drafted_on_one_square_millimetre(tmp_path: Path) -> None:
    raw = raw_folder(tmp_path / "raw", {"A_1.txt": ratio(True)})
    assert "nominal_area_mm2" in run("init", tmp_path / "c", "--from", raw).output
    toml = tmp_path / "c" / "campaign.toml"
    assert "nominal_area_mm2 = 1 " in toml.read_text(encoding="utf-8")
    found = stages.ingest(load_campaign(tmp_path / "c"))
    assert [t.normal_load_N for t in found.campaign.tests] == pytest.approx([2.0])
    assert [p.sliding_N for p in found.pulls.values()] == pytest.approx([0.6], rel=0.01)
    run("init", tmp_path / "d", "--from", raw, "--area-mm2", 25)
    (test,) = stages.ingest(load_campaign(tmp_path / "d")).campaign.tests
    assert test.normal_load_N == pytest.approx(50.0)


def test_a_noisy_tachometer_tells_the_speed_of_the_drive(tmp_path: Path) -> None:
    time = np.arange(0, 60, 0.01)
    rng = np.random.default_rng(4)
    speed = np.where(time > 10, 1.68, 0.0) + rng.normal(0, 1.0, time.size)
    force = np.where(time > 10, 2.0, 0.0) + rng.normal(0, 0.01, time.size)
    rows = "\n".join(f"{t:.2f}\t{f:.4f}\t{v:.3f}" for t, f, v in zip(time, force, speed, strict=True))
    raw = raw_folder(tmp_path / "raw", {"A_5N.txt": f"Time [s]\tFriction [N]\tTachometer [mm/s]\n{rows}\n"})
    run("init", tmp_path / "c", "--from", raw)
    assert float(rows_of(tmp_path / "c")[0]["speed_mm_s"]) == pytest.approx(1.68, rel=0.05)


REAL = {  # folder: what is told, tests in tests.csv
    "rotary-plastics-down": ((), 8),
    "pcs-pin-on-disc": ((), 1),
    "reciprocating-micrometre": ((), 1),
    "velocity-step-gouge": (("--names", "velstep3_TR2_{test_id}_{sample}"), 1),
    "alloy-reciprocating": (("--names", "{sample}_2_{cycle}"), 10),
    "ptfe-pin-on-disc": ((), 8),
    "motor-oil-rotary": ((), 16),
}


def test_real_exports_are_drafted_into_campaigns_that_run_without_edits(shared: Path, tmp_path: Path) -> None:
    if not (shared / "real").is_dir():
        pytest.skip("no real campaigns beside this checkout")
    for name, (told, tests) in REAL.items():
        folder = tmp_path / name
        assert run("init", folder, "--from", shared / "real" / name, *told).exit_code == 0, name
        campaign = load_campaign(folder)
        assert len(campaign.tests) == tests, name
        assert not campaign.set_aside, name


def filled_in(folder: Path, line: str, value: str) -> None:
    """A key of campaign.toml in [campaign], in place of the line that stands in for it where there is one."""
    toml = folder / "campaign.toml"
    lines = [one for one in toml.read_text(encoding="utf-8").splitlines() if not one.startswith(f"{line} =")]
    lines.insert(lines.index("[campaign]") + 1, f"{line} = {value}")
    toml.write_text("\n".join(lines) + "\n", encoding="utf-8")


def test_what_a_draft_asks_to_fill_in_is_all_that_it_takes(tmp_path: Path) -> None:
    raw = raw_folder(tmp_path / "raw", {"A_1.txt": pull().replace("Force [N]", "Torque [N mm]")})
    asked = " ".join(run("init", tmp_path / "c", "--from", raw).output.split())
    assert "to fill in: lever_arm_mm in campaign.toml, for which 1 was written" in asked
    assert "to fill in: the load of 1 rows: normal_load_N or mass_g in tests.csv" in asked
    assert "to fill in: the speed: pull_speed_mm_s in campaign.toml" in asked
    filled_in(tmp_path / "c", "lever_arm_mm", "2.5")
    filled_in(tmp_path / "c", "pull_speed_mm_s", "3")
    table = tmp_path / "c" / "tests.csv"
    (row,) = rows_of(tmp_path / "c")
    row["normal_load_N"] = "7"
    table.write_text(",".join(row) + "\n" + ",".join(row.values()) + "\n", encoding="utf-8")
    found = stages.ingest(load_campaign(tmp_path / "c"))
    (test,), (read,) = found.campaign.tests, found.pulls.values()
    assert (test.normal_load_N, test.speed_m_s) == (7.0, pytest.approx(3e-3))
    assert read.sliding_N == pytest.approx(2.0 / 2.5, rel=0.01)


def test_a_force_of_both_signs_is_asked_about_and_the_zero_that_is_stated_settles_it(tmp_path: Path) -> None:
    time = np.arange(0, 20, 0.02)
    force = np.interp(time, [0, 4, 7, 7.1, 20], [-1.5, -1.5, 1.5, 0.5, 0.5])
    force += np.random.default_rng(2).normal(0, 0.005, time.size)
    rows = "\n".join(f"{t:.2f}\t{f:.4f}" for t, f in zip(time, force, strict=True))
    raw = raw_folder(tmp_path / "raw", {"A_5N_1.txt": f"Time [s]\tFriction [N]\n{rows}\n"})
    done = run("init", tmp_path / "c", "--from", raw)
    assert "state its zero in campaign.toml" in " ".join(done.output.split())
    filled_in(tmp_path / "c", "zero", '"before contact"')
    (read,) = stages.ingest(load_campaign(tmp_path / "c")).pulls.values()
    assert read.sliding_N == pytest.approx(2.0, rel=0.01)


def test_a_radius_in_the_name_of_a_file_is_that_of_its_tables() -> None:
    turns = [477.5 / 60, 238.7 / 60, 119.2 / 60, 47.71 / 60]
    name = LONG.format("014", "316SS", 3)
    assert radii_in_name(name, 4, turns) == [6.0, 9.0, 12.0, 15.0]
    assert radii_in_name(name, 4, turns[::-1]) == [15.0, 12.0, 9.0, 6.0]
    assert radii_in_name(name, 4, [2 * t for t in turns]) == []  # turns and speeds do not agree
    assert radii_in_name(name, 3, turns[:3]) == []
    for said in ("PTFE_10N_r12.5mm_1", "PTFE_12,5 mm radius", "disc_R=12.5mm"):
        assert radii_in_name(said, 1, [1.0]) == [12.5]
    for said in ("PTFE_10N_12.5mm", "Carter12mm", "r5mm-s_1"):
        assert radii_in_name(said, 1, [1.0]) == []


def test_the_sliding_speed_of_turns_and_a_radius_in_the_name_is_drafted(tmp_path: Path) -> None:
    time = np.arange(400) * 0.1
    rows = [f"{t:.1f}\t{3.0 + 0.02 * np.sin(7 * t):.3f}\t10\t120" for t in time]
    text = "Time [s]\tFriction force [N]\tNormal force [N]\tRotation speed [rpm]\n" + "\n".join(rows) + "\n"
    raw = raw_folder(tmp_path / "exports", {"steel_r20mm_1.txt": text, "brass_r10mm_1.txt": text})
    run("init", str(tmp_path / "c"), "--from", str(raw))
    speeds = {row["radius_mm"]: float(row["speed_mm_s"]) for row in rows_of(tmp_path / "c")}
    assert speeds == {r: pytest.approx(2 * np.pi * float(r) * 2.0, rel=1e-3) for r in ("20", "10")}
