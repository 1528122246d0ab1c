"""Whatever a machine writes for friction, load and speed becomes newton and metre, or is refused with what to give."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tribo.errors import ReadError
from tribo.readers import inspect_export, read_export
from tribo.records import Correction, Trace

N = 80
TIME = 0.1 * np.arange(N)
LOAD = np.linspace(50.0, 180.0, N)
MU = 0.166 + 0.01 * np.sin(7.0 * TIME)


def saved(folder: Path, header: str, *columns: np.ndarray, encoding: str = "utf-8", delimiter: str = ";") -> Path:
    rows = [delimiter.join("" if np.isnan(v) else f"{v:.6g}" for v in row) for row in zip(TIME, *columns, strict=True)]
    path = folder / "a.csv"
    path.write_bytes((header.replace(";", delimiter) + "\n" + "\n".join(rows) + "\n").encode(encoding))
    return path


def load_of(trace: Trace) -> np.ndarray:
    return trace.columns["normal_force_N"]


@pytest.mark.parametrize("order", [("Load [N]", "COF"), ("COF", "Load [N]")])
def test_a_load_beside_a_friction_coefficient_is_the_normal_load_and_their_product_the_friction(
    tmp_path: Path, order: tuple[str, str]
) -> None:
    columns = {"Load [N]": LOAD, "COF": MU}
    trace = read_export(saved(tmp_path, ";".join(("Time [s]", *order)), *(columns[name] for name in order)))
    np.testing.assert_allclose(load_of(trace), LOAD, rtol=1e-5)
    np.testing.assert_allclose(trace.force_N, MU * LOAD, rtol=1e-5)


def test_a_coefficient_keeps_its_sign_where_the_load_is_written_negative(tmp_path: Path) -> None:
    trace = read_export(saved(tmp_path, "Time [s];Fz [N];COF", -LOAD, MU))
    np.testing.assert_allclose(trace.force_N, MU * LOAD, rtol=1e-5)


def test_a_load_that_is_the_coefficient_times_a_constant_is_not_taken_for_the_normal_load(tmp_path: Path) -> None:
    path = saved(tmp_path, "Time [s];Load [N];COF", 12.0 * MU, MU)
    with pytest.raises(ReadError, match="may be the friction force"):
        read_export(path)
    trace = read_export(path, columns={"friction_force": "Load [N]"})
    np.testing.assert_allclose(trace.force_N, 12.0 * MU, rtol=1e-5)
    np.testing.assert_allclose(load_of(trace), 12.0, rtol=1e-3)  # friction force over coefficient


def test_a_coefficient_without_a_load_is_multiplied_by_the_stated_one(tmp_path: Path) -> None:
    path = saved(tmp_path, "Time [s];COF", MU)
    with pytest.raises(ReadError, match="normal_load_N"):
        read_export(path)
    np.testing.assert_allclose(read_export(path, correction=Correction(load_N=3.0)).force_N, 3.0 * MU, rtol=1e-5)
    np.testing.assert_allclose(read_export(path, columns={"friction_force": "COF [3 N]"}).force_N, 3 * MU, rtol=1e-5)


def test_a_coefficient_and_a_stress_are_forces_on_the_nominal_area(tmp_path: Path) -> None:
    stress = np.full(N, 30.0)
    path = saved(tmp_path, "Time(s);Friction;Effective_Normal_stress(MPa)", MU, stress)
    with pytest.raises(ReadError, match="nominal_area_mm2"):
        read_export(path)
    trace = read_export(path, correction=Correction(area_m2=25e-4))
    np.testing.assert_allclose(load_of(trace), 75e3)
    np.testing.assert_allclose(trace.force_N, 75e3 * MU, rtol=1e-5)


def test_a_shear_stress_is_a_force_on_the_nominal_area(tmp_path: Path) -> None:
    path = saved(tmp_path, "Time [s];Shear stress [MPa];Normal stress [MPa];Friction", 30 * MU, np.full(N, 30.0), MU)
    with pytest.raises(ReadError, match="nominal_area_mm2"):
        read_export(path)
    trace = read_export(path, correction=Correction(area_m2=1e-4))
    np.testing.assert_allclose(trace.force_N, 3000 * MU, rtol=1e-5)
    np.testing.assert_allclose(load_of(trace), 3000.0)


def test_a_torque_is_divided_by_the_radius_of_its_row(tmp_path: Path) -> None:
    radius = np.linspace(6.0, 15.0, N)
    path = saved(tmp_path, "Time [s];Torque [N mm];Radius [mm];Load [N];Speed [rpm]", 2.0 * radius, radius, LOAD,
                 np.full(N, 60.0))  # fmt: skip
    trace = read_export(path)
    np.testing.assert_allclose(trace.force_N, 2.0, rtol=1e-4)
    np.testing.assert_allclose(load_of(trace), LOAD, rtol=1e-5)
    np.testing.assert_allclose(trace.columns["speed_m_s"], 2e-3 * np.pi * radius, rtol=1e-4)
    stated = read_export(path, correction=Correction(lever_arm_m=4e-3))
    np.testing.assert_allclose(stated.force_N, 0.5 * radius, rtol=1e-4)  # what is stated comes first


@pytest.mark.parametrize(
    ("name", "newton"),
    [
        ("Normal [uN]", 1e-6), ("Normal load (kN)", 1e3), ("Pin Load (N)", 1.0), ("Ball Load [mN]", 1e-3),
        ("Normal Force / kgf", 9.80665), ("Normallast [daN]", 10.0), ("Obciążenie normalne [N]", 1.0),
        ("垂直荷重（N）", 1.0), ("法向载荷(牛)", 1.0), ("Нагрузка [кгс]", 9.80665),
    ],
)  # fmt: skip
def test_the_normal_load_has_many_names_and_units(tmp_path: Path, name: str, newton: float) -> None:
    trace = read_export(saved(tmp_path, f"Time [s];Friction force [N];{name}", MU, LOAD))
    np.testing.assert_allclose(load_of(trace), newton * LOAD, rtol=1e-5)


@pytest.mark.parametrize(
    ("header", "taken"),
    [
        ("Time (s);Friction coeff;Load (g)", {"friction coefficient": "Friction coeff", "normal force": "Load [g]"}),
        ("Time [s];Mean COF;Peak COF;Load [N]", {"friction coefficient": "Mean COF", "normal force": "Load [N]"}),
        ("Time (s);Frictional Force (N);COF;Load (N)", {"friction force": "Frictional Force [N]"}),
        ("Time (s);Load (lbs);COF;Torque (in-lb)", {"torque": "Torque [in-lb]", "normal force": "Load [lbs]"}),
        ("t (s);FR (N);FN (N);n (1/min)", {"friction force": "FR [N]", "rotation speed": "n [1/min]"}),
        ("Time [s];LateralForce_mN;NormalForce_mN", {"friction force": "LateralForce [mN]"}),
        ("Time(sec);Friction(kgf);Load(kgf);Revolution(rpm)", {"rotation speed": "Revolution [rpm]"}),
        ("时间/s;摩擦系数;载荷/N;转速/(r/min)", {"rotation speed": "转速 [r/min]", "normal force": "载荷 [N]"}),
    ],
)
def test_the_columns_of_other_rigs_are_known_by_their_names_and_units(
    tmp_path: Path, header: str, taken: dict[str, str]
) -> None:
    columns = [MU * (1 + 0.1 * np.sin(k * TIME)) for k in range(header.count(";"))]
    trace = read_export(saved(tmp_path, header, *columns, delimiter="\t"))
    assert trace.source is not None
    assert trace.source.columns.items() >= taken.items()


def test_a_load_is_not_the_friction_force_beside_a_coefficient_of_an_unknown_name(tmp_path: Path) -> None:
    with pytest.raises(ReadError, match="no column was recognised as the friction force"):
        read_export(saved(tmp_path, "Time [s];COF of the left pin;Load [N]", MU, LOAD))


def test_a_temperature_in_an_unknown_unit_costs_the_temperature_only(tmp_path: Path) -> None:
    trace = read_export(saved(tmp_path, "Time [s];Friction [N];Temp (mV)", MU, LOAD))
    assert trace.flags == ("unknown_unit",)
    assert "temperature_C" not in trace.columns


def test_a_torque_in_newton_minus_metre_is_one(tmp_path: Path) -> None:
    path = saved(tmp_path, "Time [s];Friction Torque (N-m);Track Radius (mm)", MU, np.full(N, 20.0))
    np.testing.assert_allclose(read_export(path).force_N, MU / 0.02, rtol=1e-4)


@pytest.mark.parametrize("empty", ["", "NaN", "0"])
def test_an_empty_load_column_is_passed_over_for_the_filled_one(tmp_path: Path, empty: str) -> None:
    path = saved(tmp_path, "Time [s];Ball Load (N);Pin Load (N);Friction [N]", np.full(N, np.nan), LOAD, MU)
    path.write_text(path.read_text(encoding="utf-8").replace(";;", f";{empty};"), encoding="utf-8")
    np.testing.assert_allclose(load_of(read_export(path)), LOAD, rtol=1e-5)


def test_a_coordinate_that_never_changes_is_no_displacement(tmp_path: Path) -> None:
    path = saved(tmp_path, "Time [s];Fx [N];XYZ.X Position (mm)", MU, np.zeros(N))
    assert read_export(path).displacement_m is None
    assert "never changes" in inspect_export(path).in_words()
    path = saved(tmp_path, "Time [s];Fx [N];XYZ.X Position (mm)", MU, TIME)
    assert read_export(path).displacement_m is not None


@pytest.mark.parametrize(
    "name", ["Rotary.Velocity (rpm)", "Speed [rpm]", "Tachometer [1/min]", "speed_rpm", "RPM", "Obroty [obr/min]"]
)
def test_turns_a_minute_are_a_rotation_and_with_a_lever_arm_a_speed(tmp_path: Path, name: str) -> None:
    path = saved(tmp_path, f"Time [s];Fx [N];{name}", MU, np.full(N, 477.5))
    trace = read_export(path)
    np.testing.assert_allclose(trace.columns["rotation_rev_per_s"], 477.5 / 60)
    assert "speed_m_s" not in trace.columns
    speed = read_export(path, correction=Correction(lever_arm_m=6e-3)).columns["speed_m_s"]
    np.testing.assert_allclose(speed, 0.3, rtol=1e-3)


@pytest.mark.parametrize(
    ("header", "encoding"),
    [
        ("経過時間 [s];摩擦係数 [-];荷重 [N];回転数 [rpm]", "cp932"),
        ("テスト時間;摩擦係数;荷重;回転数\n秒;-;N;rpm", "cp932"),
        ("时间(s);摩擦系数;载荷(N);转速(转/分)", "gb18030"),
        ("Czas [s];Współczynnik tarcia [-];Obciążenie [N];Prędkość obrotowa [obr/min]", "cp1250"),
        ("Czas [s];Współczynnik tarcia [-];Obciążenie [N];Prędkość obrotowa [obr/min]", "iso8859-2"),
    ],
)
def test_coefficient_load_and_turns_are_known_in_other_languages_and_encodings(
    tmp_path: Path, header: str, encoding: str
) -> None:
    trace = read_export(saved(tmp_path, header, MU, LOAD, np.full(N, 60.0), encoding=encoding, delimiter=","))
    np.testing.assert_allclose(trace.force_N, MU * LOAD, rtol=1e-5)
    np.testing.assert_allclose(trace.columns["rotation_rev_per_s"], 1.0)


def test_words_in_shift_jis_that_nobody_knows_keep_their_row_of_units(tmp_path: Path) -> None:
    header = "番号付記号;検出器出力;送り台座標\nsec;N;mm"
    path = saved(tmp_path, header, MU, TIME, encoding="cp932", delimiter=",")
    seen = inspect_export(path)
    assert seen.encoding == "cp932"
    assert [c.unit for c in seen.columns] == ["sec", "N", "mm"]
    trace = read_export(path, columns={"time": "番号付記号", "friction_force": "検出器出力"})
    np.testing.assert_allclose(trace.force_N, MU, rtol=1e-5)


@pytest.mark.parametrize(
    ("header", "encoding"), [("Cœur;Sœur;Nœud\ns;N;mm", "cp1252"), ("Grubość;Lepkość;Gęstość\ns;N;mm", "cp1250")]
)
def test_western_and_polish_words_are_not_taken_for_japanese(tmp_path: Path, header: str, encoding: str) -> None:
    path = saved(tmp_path, header, MU, TIME, encoding=encoding)
    path.read_bytes().decode("cp932")  # it could be
    assert inspect_export(path).encoding != "cp932"


@pytest.mark.parametrize("shape", ["split", "records", "lists"])
def test_json_is_read_as_rows_with_names_rows_that_name_their_cells_or_lists_by_name(
    tmp_path: Path, shape: str
) -> None:
    names = ["Time [s]", "Friction force [mN]", "note"]
    rows = [[t, 1e3 * m, "x"] for t, m in zip(TIME.tolist(), MU.tolist(), strict=True)]
    stored = {
        "split": {"columns": names, "data": rows},
        "records": [dict(zip(names, row, strict=True)) for row in rows],
        "lists": {name: [row[k] for row in rows] for k, name in enumerate(names)},
    }[shape]
    (tmp_path / "a.json").write_text(json.dumps(stored), encoding="utf-8")
    trace = read_export(tmp_path / "a.json")
    np.testing.assert_allclose(trace.time_s, TIME)
    np.testing.assert_allclose(trace.force_N, MU)


def test_the_banded_damper_is_read_by_the_keys_with_its_units(shared: Path) -> None:
    folder = shared / "real" / "friction-damper"
    if not folder.is_dir():
        pytest.skip("no real campaigns beside this checkout")
    trace = read_export(folder / "1Hz25lbtension.json")
    rows = np.array(json.loads((folder / "1Hz25lbtension.json").read_text(encoding="utf-8"))["data"])
    np.testing.assert_allclose(trace.force_N, rows[:, 2] * 4448.2216152605)
    assert trace.displacement_m is not None
    np.testing.assert_allclose(trace.displacement_m, rows[:, 1] * 0.0254)
    moved = np.gradient(rows[:, 1], rows[:, 0])  # the fourth column is the velocity
    assert np.corrcoef(moved, rows[:, 3])[0, 1] > 0.9
    assert "normal_force_N" not in trace.columns


def test_a_pin_and_a_micrometre_rig_have_their_recorded_loads(shared: Path) -> None:
    folder = shared / "real"
    if not folder.is_dir():
        pytest.skip("no real campaigns beside this checkout")
    pin = read_export(folder / "pcs-pin-on-disc" / "demo_7.txt")
    assert load_of(pin)[:3] == pytest.approx([11.769, 11.714, 11.727])
    micro = read_export(folder / "reciprocating-micrometre" / "test_data_2.txt")
    assert load_of(micro)[:2] == pytest.approx([569.8e-6, 519.9e-6])
    disc = read_export(next((folder / "rotary-plastics-down").glob("014*")).as_posix() + "#1")
    assert disc.displacement_m is None
    assert disc.columns["rotation_rev_per_s"][4] == pytest.approx(477.3825 / 60)
