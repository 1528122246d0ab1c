"""What campaign.toml, tests.csv and the command line state about exports, and forces that were evaluated elsewhere."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from tribo import stages
from tribo.campaign import load_campaign
from tribo.cli import main
from tribo.errors import CampaignError
from tribo.records import Ingested

STATIC_N, SLIDING_N = 3.0, 2.0


def pull() -> tuple[np.ndarray, np.ndarray]:
    """Time, and the force of a pull: at rest, a rise to the static peak, sliding, with a little noise."""
    time = np.arange(0, 20, 0.02)
    force = np.interp(time, [0, 4, 7, 7.1, 20], [0, 0, STATIC_N, SLIDING_N, SLIDING_N])
    return time, force + np.random.default_rng(1).normal(0, 0.005, time.size)


def export(names: str, *columns: np.ndarray) -> str:
    return names + "\n" + "\n".join("\t".join(f"{v:.6f}" for v in row) for row in zip(*columns, strict=True)) + "\n"


def campaign(folder: Path, tests: str, exports: dict[str, str], stated: str = "", tables: str = "") -> Path:
    (folder / "raw").mkdir(parents=True)
    head = f'[campaign]\ntitle = "stated"\nnominal_area_mm2 = 50.0\n{stated}\n[patterns.F]\ncavity = "none"\n'
    (folder / "campaign.toml").write_text(head + tables, encoding="utf-8")
    (folder / "tests.csv").write_text(tests, encoding="utf-8")
    for name, text in exports.items():
        (folder / "raw" / name).write_text(text, encoding="utf-8")
    return folder


def ingested(folder: Path) -> Ingested:
    return stages.ingest(load_campaign(folder))


def forces(found: Ingested) -> dict[str, tuple[float, float]]:
    return {i: (round(p.static_N, 1), round(p.sliding_N, 1)) for i, p in found.pulls.items()}


ONE = "test_id,file,sample,normal_load_N\nT1,raw/a.txt,F,10\n"


def test_sign_lever_arm_and_gain_of_a_campaign_are_those_of_its_tests(tmp_path: Path) -> None:
    time, force = pull()
    torque = export("Time [s]\tTorque [N mm]", time, -force * 2.5)
    folder = campaign(tmp_path / "c", ONE, {"a.txt": torque}, "sign = -1\nlever_arm_mm = 2.5\n")
    assert forces(ingested(folder)) == {"T1": (STATIC_N, SLIDING_N)}


def test_a_test_states_its_own_in_place_of_the_campaign(tmp_path: Path) -> None:
    time, force = pull()
    tests = (
        "test_id,file,sample,normal_load_N,sign,gain,lever_arm_mm\n"
        "T1,raw/a.txt,F,10,,,\nT2,raw/b.txt,F,10,1,2,\nT3,raw/c.txt,F,10,,,5.0\n"
    )
    exports = {
        "a.txt": export("Time [s]\tTorque [N mm]", time, -force * 2.5),
        "b.txt": export("Time [s]\tForce [N]", time, force / 2),
        "c.txt": export("Time [s]\tTorque [N mm]", time, -force * 5.0),
    }
    folder = campaign(tmp_path / "c", tests, exports, "sign = -1\nlever_arm_mm = 2.5\n")
    found = ingested(folder)
    assert not found.set_aside
    assert forces(found) == {"T1": (STATIC_N, SLIDING_N), "T2": (STATIC_N, SLIDING_N), "T3": (STATIC_N, SLIDING_N)}


def test_the_command_line_states_it_in_place_of_both(tmp_path: Path) -> None:
    time, force = pull()
    text = export("Time [s]\tForce [N]", time, -force)
    folder = campaign(tmp_path / "c", ONE.replace("_N\n", "_N,gain\n").replace("10\n", "10,3\n"), {"a.txt": text})
    done = CliRunner().invoke(
        main, ["ingest", str(folder), "-o", str(tmp_path / "o"), "--set", "sign=-1", "--set", "gain=1"]
    )
    assert done.exit_code == 0, done.output
    row = (tmp_path / "o" / "tests.csv").read_text(encoding="utf-8").splitlines()
    values = dict(zip(row[0].split(","), row[1].split(","), strict=False))
    assert float(values["sliding_N"]) == pytest.approx(SLIDING_N, abs=0.01)
    wrong = CliRunner().invoke(main, ["ingest", str(folder), "-o", str(tmp_path / "o"), "--set", "sing=-1"])
    assert wrong.exit_code == 2
    assert "sign, gain, lever_arm_mm, sampling_rate_Hz" in " ".join(wrong.output.split())


def test_a_sampling_rate_and_a_speed_make_the_time(tmp_path: Path) -> None:
    time, force = pull()
    tests = (
        "test_id,file,sample,normal_load_N,speed_mm_s,sampling_rate_Hz\nT1,raw/a.txt,F,10,,50\nT2,raw/b.txt,F,10,0.5,\n"
    )
    path = export("Displacement [mm]\tForce [N]", 0.5 * time, 1.01 * force)
    folder = campaign(
        tmp_path / "c",
        tests,
        {"a.txt": export("Force [N]\tFz [N]", force, 10 + 0 * force), "b.txt": path},
    )
    found = ingested(folder)
    assert not found.set_aside
    np.testing.assert_allclose(found.traces["T1"].time_s, time, atol=1e-9)
    np.testing.assert_allclose(found.traces["T2"].time_s, time, atol=1e-5)
    assert np.isfinite(found.pulls["T2"].rise_N_per_s)


def test_without_speed_nothing_per_second_is_given(tmp_path: Path) -> None:
    time, force = pull()
    folder = campaign(tmp_path / "c", ONE, {"a.txt": export("Displacement [mm]\tForce [N]", 0.5 * time, force)})
    found = ingested(folder)
    (pulled,) = found.pulls.values()
    assert (round(pulled.static_N, 1), round(pulled.sliding_N, 1)) == (STATIC_N, SLIDING_N)
    assert "no_time" in pulled.flags
    assert np.isnan([pulled.rise_N_per_s, pulled.stick_slip_period_s, pulled.drift_N_per_s]).all()
    assert any("durations, rates" in str(p) for d in found.doubts() for p in d.problems)


def test_columns_are_stated_by_file_and_by_glob(tmp_path: Path) -> None:
    time, force = pull()
    tests = "test_id,file,sample,normal_load_N\nT1,raw/a.txt,F,10\nT2,raw/rig2_b.txt,F,10\nT3,raw/rig2_c.txt,F,10\n"
    exports = {
        "a.txt": export("Time [s]\tForce [N]", time, force),
        "rig2_b.txt": export("c1\tc2\tForce [N]", time * 1e3, force * 1e3 + 1e-4, 0 * force),
        "rig2_c.txt": export("c1\tc2\tc3", time * 1e3, 0 * force, force + 2e-4),
    }
    tables = (
        '[columns."raw/rig2_*"]\ntime = "c1 [ms]"\nfriction_force = "c2 [mN]"\nignore = ["Force"]\n'
        '[columns."rig2_c.txt"]\nfriction_force = "c3 [N]"\n'
    )
    found = ingested(campaign(tmp_path / "c", tests, exports, tables=tables))
    assert not found.set_aside
    assert set(forces(found).values()) == {(STATIC_N, SLIDING_N)}


def test_a_wrong_key_in_a_table_of_columns_is_named_with_its_row(tmp_path: Path) -> None:
    time, force = pull()
    folder = campaign(
        tmp_path / "c", ONE, {"a.txt": export("t\tF", time, force)}, tables='[columns."raw/*"]\ntyme = "t [s]"\n'
    )
    with pytest.raises(CampaignError, match="did you mean time"):
        load_campaign(folder)


def test_an_entry_of_a_zip_is_the_file_of_a_test(tmp_path: Path) -> None:
    time, force = pull()
    folder = campaign(tmp_path / "c", ONE.replace("raw/a.txt", "raw/all.zip/in/a.txt"), {})
    with zipfile.ZipFile(folder / "raw" / "all.zip", "w") as out:
        out.writestr("in/a.txt", export("Time [s]\tForce [N]", time, force))
        out.writestr("b.txt", "none")
    assert forces(ingested(folder)) == {"T1": (STATIC_N, SLIDING_N)}


def test_impossible_statements_are_named_with_row_and_column(tmp_path: Path) -> None:
    tests = (
        "test_id,file,sample,normal_load_N,sign,gain,sliding_N,sliding_mu,sliding_u_N\n"
        "T1,,F,10,2,,1,,\nT2,,F,10,,-1,1,,\nT3,,F,10,,,1,0.1,\nT4,raw/a.txt,F,10,,,1,,\nT5,,F,10,,,1,,-1\nT6,,F,10,,,1,,0.1\n"
    )
    time, force = pull()
    found = load_campaign(campaign(tmp_path / "c", tests, {"a.txt": export("Time [s]\tForce [N]", time, force)}))
    kinds = {s.test_id: [p.kind for p in s.problems] for s in found.set_aside}
    assert kinds == {
        "T1": ["not_a_sign"],
        "T2": ["not_positive"],
        "T3": ["force_given_twice"],
        "T4": ["file_and_force"],
        "T5": ["negative"],
    }
    assert [t.test_id for t in found.tests] == ["T6"]


MU, ADHESION_N = 0.3, 0.5


def evaluated(column: str) -> str:
    rows = [f"test_id,sample,specimen,normal_load_N,{column},cycle"]
    for k, load in enumerate((2.0, 4.0, 8.0, 16.0) * 3):
        force = MU * load + ADHESION_N
        value = force / load if column in ("coefficient", "sliding_mu") else force
        rows.append(f"T{k},F,F{k // 4},{load},{value:.6f},{k}")
    return "\n".join(rows) + "\n"


@pytest.mark.parametrize("column", ["sliding_N", "coefficient", "sliding_mu"])
def test_forces_evaluated_elsewhere_are_fitted_like_pulls(tmp_path: Path, column: str) -> None:
    folder = campaign(tmp_path / "c", evaluated(column), {})
    found = ingested(folder)
    assert not found.traces
    assert len(found.pulls) == 12
    assert found.pulls["T3"].sliding_N == pytest.approx(MU * 16 + ADHESION_N, abs=1e-4)
    assert {p.rule for p in found.pulls.values()} == {"given"}
    assert found.campaign.tests[3].covariates == {"cycle": "3"}
    fits = stages.fit(found)
    (law,) = [f for f in fits if f.regime == "sliding"]
    assert law.value("mu") == pytest.approx(MU, rel=1e-3)
    assert law.value("tau0_Pa") * 50e-6 == pytest.approx(ADHESION_N, rel=1e-3)


def test_a_fit_of_evaluated_forces_is_written_by_the_command(tmp_path: Path) -> None:
    folder = campaign(tmp_path / "c", evaluated("sliding_N"), {})
    done = CliRunner().invoke(main, ["fit", str(folder), "-o", str(tmp_path / "o")])
    assert done.exit_code == 0, done.output
    assert (tmp_path / "o" / "fits.csv").read_text(encoding="utf-8").count("sliding") == 1


def test_a_normal_stress_is_a_load_by_the_nominal_area(tmp_path: Path) -> None:
    tests = "test_id,sample,normal_stress_Pa,sliding_mu\nT1,F,2000,0.5\nT2,F,-1,0.5\n"
    found = load_campaign(campaign(tmp_path / "c", tests, {}))
    assert found.tests[0].normal_load_N == pytest.approx(0.1)
    assert found.tests[0].evaluated is not None
    assert found.tests[0].evaluated["sliding_N"] == pytest.approx(0.05)
    assert [s.problems[0].kind for s in found.set_aside] == ["load_not_positive"]
