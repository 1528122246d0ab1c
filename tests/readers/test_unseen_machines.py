"""Exports in the shape of those of machines that were met after the readers were written; every number is invented."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tribo.drafting.draft import draft_campaign
from tribo.errors import ReadError
from tribo.readers import inspect_export, read_blocks, read_export
from tribo.readers.columns import by_a_word, match_column, split_unit
from tribo.traces.evaluation import evaluate
from tribo.units import unit_factor

N = 120
TIME = 0.05 * np.arange(N)
FRICTION = 0.9 + 0.05 * np.sin(3.0 * TIME)


def saved(folder: Path, header: str, *columns: np.ndarray, encoding: str = "utf-8") -> Path:
    mark = "\t" if "\t" in header else ";" if ";" in header else ","
    rows = (mark.join(f"{value:.6g}" for value in row) for row in zip(*columns, strict=True))
    path = folder / "a.csv"
    path.write_bytes((header + "\n" + "\n".join(rows) + "\n").encode(encoding))
    return path


def refusal(path: Path) -> str:
    with pytest.raises(ReadError) as why:
        read_export(path)
    return str(why.value)


def test_a_japanese_load_beside_a_resistance_of_friction_is_the_normal_load(tmp_path: Path) -> None:
    load = np.full(N, 2.0)
    trace = read_export(saved(tmp_path, "時間(s),荷重(N),摩擦抵抗(N)", TIME, load, FRICTION, encoding="cp932"))
    np.testing.assert_allclose(trace.force_N, FRICTION, rtol=1e-5)
    np.testing.assert_allclose(trace.columns["normal_force_N"], load)


@pytest.mark.parametrize(("force", "read"), [(6.0 * FRICTION, True), (6.0 + 0.001 * TIME, False)])
def test_a_force_beside_a_coefficient_is_friction_only_where_it_follows_it(
    tmp_path: Path, force: np.ndarray, read: bool
) -> None:
    path = saved(tmp_path, "t\tforce\tfriction\ns\tN\t-", TIME, force, FRICTION)
    if read:
        trace = read_export(path)
        np.testing.assert_allclose(trace.force_N, force, rtol=1e-5)
        np.testing.assert_allclose(trace.columns["normal_force_N"], 6.0, rtol=1e-3)
    else:
        assert "it may be the normal load" in refusal(path)
        trace = read_export(path, columns={"normal_force": "force [N]"})
        np.testing.assert_allclose(trace.force_N, force * FRICTION, rtol=1e-5)


@pytest.mark.parametrize(
    "header",
    [
        "Latest: Time (s),Latest: Force (N),Latest: Position (m)",
        "Run 3: Time (s),Run 3: Force (N),Run 3: Position (m)",
        "Time (s) Run #3,Force (N) Run #3,Position (m) Run #3",
        "Time s,Force N,Position m",
        "Station 1 Time\tStation 1 Force\tStation 1 Displacement\ns\tN\tm",
    ],
)
def test_the_run_or_the_station_before_or_behind_a_name_does_not_hide_it(tmp_path: Path, header: str) -> None:
    trace = read_export(saved(tmp_path, header, TIME, FRICTION, 1e-3 * TIME))
    np.testing.assert_allclose(trace.force_N, FRICTION, rtol=1e-5)
    assert trace.displacement_m is not None


@pytest.mark.parametrize(
    "header",
    ["Run 1: Time (s),Run 1: Force (N),Run 2: Time (s),Run 2: Force (N)",
     "Time (s) Run #1;Force (N) Run #1;Time (s) Run #2;Force (N) Run #2"],
)  # fmt: skip
def test_the_runs_of_a_school_logger_are_records_side_by_side(tmp_path: Path, header: str) -> None:
    first, second = read_blocks(saved(tmp_path, header, TIME, FRICTION, TIME, 2.0 * FRICTION))
    np.testing.assert_allclose(first.force_N, FRICTION, rtol=1e-5)
    np.testing.assert_allclose(second.force_N, 2.0 * FRICTION, rtol=1e-5)


def test_a_force_gauge_in_ounce_force_is_read(tmp_path: Path) -> None:
    path = saved(tmp_path, "Reading,Load [ozF],Travel [mm],Time [sec]", np.arange(N), FRICTION, TIME, TIME)
    np.testing.assert_allclose(read_export(path).force_N, 0.278014 * FRICTION, rtol=1e-4)


def test_a_channel_that_is_written_in_volts_as_well_is_read_in_its_unit(tmp_path: Path) -> None:
    header = "Normal Load (µN)\tTime (s)\tLateral Force (V)\tLateral Force (µN)"
    path = saved(tmp_path, header, np.full(N, 1000.0), TIME, 0.01 * FRICTION, 100.0 * FRICTION)
    np.testing.assert_allclose(read_export(path).force_N, 1e-4 * FRICTION, rtol=1e-5)
    assert not inspect_export(path).doubts or "could also be" not in inspect_export(path).in_words()


def test_the_load_of_an_indenter_is_not_taken_for_friction(tmp_path: Path) -> None:
    path = saved(tmp_path, "Depth (nm)\tLoad (µN)\tTime (s)\tDepth (V)\tLoad (V)", TIME, TIME, TIME, TIME, TIME)
    assert "no column was recognised as the friction force" in refusal(path)


def test_a_force_in_volts_is_refused_with_the_way_to_calibrate_it(tmp_path: Path) -> None:
    path = saved(tmp_path, "t [s],Friction force [V]", TIME, 0.04 * FRICTION)
    assert 'what 1 of it means: "Friction force [12.5 N]"' in refusal(path)
    trace = read_export(path, columns={"friction_force": "Friction force [12.5 N]"})
    np.testing.assert_allclose(trace.force_N, 0.5 * FRICTION, rtol=1e-5)


def test_bars_within_cells_do_not_separate_them(tmp_path: Path) -> None:
    rows = "\n".join(f"1|{k},{t:.2f},{f:.4f}" for k, (t, f) in enumerate(zip(TIME, FRICTION, strict=True)))
    (tmp_path / "a.csv").write_text(f"point,t in s,force in N\n{rows}\n", encoding="utf-8")
    np.testing.assert_allclose(read_export(tmp_path / "a.csv").force_N, FRICTION, atol=1e-4)


def test_records_side_by_side_are_not_proposed_for_columns_of_other_units(tmp_path: Path) -> None:
    path = saved(tmp_path, "Time (s)\tPitch Moment (Nm)\tBelt Velocity (m/s)\tBelt Angle (deg)", TIME, TIME, TIME, TIME)
    assert "side by side" not in refusal(path)


def test_a_row_of_bracketed_units_is_shown_without_further_brackets(tmp_path: Path) -> None:
    path = saved(tmp_path, "Time\tForce\tHeater\n[s]\t[N]\t[W]", TIME, FRICTION, TIME)
    assert '"Heater" [W]\n' in inspect_export(path).in_words()


@pytest.mark.parametrize("varies", [False, True])
def test_the_stroke_of_an_oscillating_machine_is_no_path(tmp_path: Path, varies: bool) -> None:
    stroke = 1.0 + (np.sin(TIME) if varies else 1e-3 * np.sin(TIME))
    header = "Time [s]\tCOF\tLoad [N]\tFrequency [Hz]\tStroke [mm]"
    trace = read_export(saved(tmp_path, header, TIME, 0.1 * FRICTION, np.full(N, 50.0), np.full(N, 25.0), stroke))
    assert (trace.displacement_m is not None) == varies


@pytest.mark.parametrize(("path_mm", "is_path"), [(0.02, False), (600.0, True)])
def test_the_wear_of_a_pin_that_is_called_displacement_is_no_path(
    tmp_path: Path, path_mm: float, is_path: bool
) -> None:
    header = "Time [s];Friction force [N];Displacement [mm];Rotational speed [rpm]"
    path = saved(tmp_path, header, TIME, FRICTION, path_mm * TIME / TIME[-1], np.full(N, 200.0))
    assert (read_export(path).displacement_m is not None) == is_path
    assert ("it is far shorter than the path by the rotation speed" in inspect_export(path).in_words()) != is_path


def test_a_displacement_of_micrometres_beside_a_sliding_speed_is_no_path(tmp_path: Path) -> None:
    header = "Time [s];Friction force [N];Displacement [um];Sliding speed [m/s]"
    assert read_export(saved(tmp_path, header, TIME, FRICTION, TIME, np.full(N, 0.1))).displacement_m is None


def test_a_pull_that_breaks_is_not_called_negative_for_what_follows(tmp_path: Path) -> None:
    force = np.where(TIME < 2.0, 40.0 * TIME, -0.5)
    assert inspect_export(saved(tmp_path, "Time [s],Force [N]", TIME, force)).signs == ()


def test_the_channels_of_a_kyowa_logger_have_the_units_above_them(tmp_path: Path) -> None:
    header = '"ID番号","PCD-400A"\n"測定CH数",2\n"CH名称"\n"レンジ","5kμε","2kμε"\n"校正係数",3.1,0.4\n'
    path = saved(
        tmp_path, header + '"単位","g","N"\n"Time(sec)","CH1","CH2"', TIME, 500 * FRICTION, FRICTION, encoding="cp932"
    )
    assert 'normal_force = "CH1"' in refusal(path)
    trace = read_export(path, columns={"normal_force": "CH1", "friction_force": "CH2"})
    np.testing.assert_allclose(trace.force_N, FRICTION, rtol=1e-5)
    np.testing.assert_allclose(trace.columns["normal_force_N"], 500 * 9.80665e-3 * FRICTION, rtol=1e-5)


@pytest.mark.parametrize("line", ["{:.4f}", "Kraft: {:.4f} N", "run=1, F = {:.4f} N; T: 21.5 C"])
def test_the_serial_monitor_of_a_board_is_a_table_with_its_clock(tmp_path: Path, line: str) -> None:
    clock = [f"09:02:{t:06.3f} -> " for t in TIME]
    printed = [clock[0] + "tare done", *(c + line.format(f) for c, f in zip(clock, FRICTION, strict=True))]
    (tmp_path / "a.txt").write_text("\n".join(printed), encoding="utf-8")
    columns = {"friction_force": "value 1 [N]"} if line == "{:.4f}" else {}
    trace = read_export(tmp_path / "a.txt", columns=columns)
    np.testing.assert_allclose(trace.force_N, FRICTION, atol=1e-4)
    np.testing.assert_allclose(trace.time_s, TIME, atol=1e-6)


def test_stroke_and_frequency_are_the_mean_speed_of_an_oscillation(tmp_path: Path) -> None:
    header = "Time [s];Friction coefficient [-];Load [g];Frequency [Hz];Stroke [µm]"
    stroke = 1000.0 + np.sin(TIME)
    trace = read_export(saved(tmp_path, header, TIME, 0.1 * FRICTION, np.full(N, 200.0), np.full(N, 50.0), stroke))
    np.testing.assert_allclose(trace.columns["speed_m_s"], 0.1, rtol=2e-3)
    assert "no_static" in evaluate(trace).flags  # it slides from its first row


def test_the_load_that_was_measured_goes_before_the_one_that_was_set(tmp_path: Path) -> None:
    measured = 12.0 + 0.05 * np.sin(TIME)
    path = saved(
        tmp_path, "X (mm);Fn (N);Measured Fn (N);Ft (N);Time (s)", TIME, np.full(N, 12.0), measured, FRICTION, TIME
    )
    np.testing.assert_allclose(read_export(path).columns["normal_force_N"], measured, rtol=1e-4)


def test_a_temperature_called_t_is_no_time(tmp_path: Path) -> None:
    trace = read_export(
        saved(tmp_path, "T [°C];Elapsed [s];F [N]", 20.0 + TIME, TIME, FRICTION), columns={"time": "Elapsed"}
    )
    np.testing.assert_allclose(trace.columns["temperature_C"], 20.0 + TIME, rtol=1e-4)


def test_a_number_that_a_workbook_shows_as_a_date_is_a_number(tmp_path: Path) -> None:
    from openpyxl import Workbook

    book = Workbook()
    book.active.append(["Time [s]", "Fn [N]", "Ft [N]"])
    for t, f in zip(TIME, FRICTION, strict=True):
        book.active.append([t, 12.0, f])
    book.active.cell(40, 2).number_format = "yyyy-mm-dd"
    book.active.cell(50, 2).value, book.active.cell(50, 2).number_format = 70.5, "yyyy-mm-dd hh:mm"
    book.save(tmp_path / "a.xlsx")
    load = read_export(tmp_path / "a.xlsx").columns["normal_force_N"]
    assert (load[38], load[48]) == (12.0, 70.5)


def test_a_name_of_a_file_with_a_number_sign_keeps_its_recorded_load(tmp_path: Path) -> None:
    (tmp_path / "raw").mkdir()
    for name in ("12N-alloy#3.csv", "12N-brass.csv"):
        saved(tmp_path / "raw", "Time [s];Fn [N];Ft [N]", TIME, np.full(N, 12.0), FRICTION).rename(
            tmp_path / "raw" / name
        )
    draft = draft_campaign(tmp_path / "raw")
    assert "the normal force is recorded for 2 of 2 rows and is used" in draft.found
    assert not any("the load of" in text for text in draft.missing)


@pytest.mark.parametrize(
    ("name", "quantity"),
    [("Godzina [s]", "time"), ("millis", "time"), ("Horizontalkraft [N]", "friction force"),
     ("Forza tangenziale [N]", "friction force"), ("せん断力[N]", "friction force"),
     ("Siła docisku [N]", "normal force"), ("押付荷重[N]", "normal force"),
     ("Carga aplicada (N)", "normal force"), ("摩擦因数", "friction coefficient"),
     ("Coef. de frottement", "friction coefficient"), ("Extensão (mm)", "displacement"), ("移動量[mm]", "displacement"),
     ("Verfahrweg [mm]", "displacement"), ("speed_mm_s", "speed"), ("v [mm/s]", "speed"),
     ("effns_mpa", "normal stress"), ("Angular velocity (rad/s)", "rotation speed")],
)  # fmt: skip
def test_further_words_of_machines_are_known(name: str, quantity: str) -> None:
    hit = match_column(name) or by_a_word(name, split_unit(name)[1] or "")
    assert hit is not None
    assert hit[0] == quantity


@pytest.mark.parametrize(("unit", "quantity", "pascal"), [("mpa", "normal stress", 1e6), ("mPa", "shear stress", 1e-3)])
def test_a_pressure_in_small_letters_is_in_megapascal(unit: str, quantity: str, pascal: float) -> None:
    assert unit_factor(unit, quantity)[0] == pytest.approx(pascal)


def test_the_column_millis_of_a_board_is_in_milliseconds(tmp_path: Path) -> None:
    trace = read_export(saved(tmp_path, "millis,force_N", 1000.0 * TIME, FRICTION))
    np.testing.assert_allclose(trace.time_s, TIME, atol=1e-6)


@pytest.mark.parametrize("header", ["t [s],Fx [N],Fy [N],Fz [N]", "t [s],Force X (N),Force Y (N),Force Z (N)"])
def test_a_sensor_of_three_axes_that_is_pulled_along_y_is_not_read_along_x(tmp_path: Path, header: str) -> None:
    pulled, noise, load = FRICTION * (TIME > 1.0), 0.02 * np.sin(50.0 * TIME), np.full(N, -5.0)
    path = saved(tmp_path, header, TIME, noise, pulled, load)
    assert "is the larger force along the surface" in refusal(path)
    along_y = header.split(",")[2]
    np.testing.assert_allclose(read_export(path, columns={"friction_force": along_y}).force_N, pulled, atol=1e-5)
    swapped = saved(tmp_path, header, TIME, pulled, noise, load)
    np.testing.assert_allclose(read_export(swapped).force_N, pulled, atol=1e-5)


@pytest.mark.parametrize(
    "header",
    [
        "Zeit;Reibkraft;Normalkraft;Weg\nCH0;CH1;CH2;CH3\ns;N;N;mm",
        "Time,Friction,Normal,Position\ns,N,N,mm\nAI0,AI1,AI2,ENC",
    ],
)
def test_a_row_of_channel_numbers_beside_names_and_units_hides_neither(tmp_path: Path, header: str) -> None:
    trace = read_export(saved(tmp_path, header, TIME, FRICTION, np.full(N, 5.0), TIME))
    np.testing.assert_allclose(trace.force_N, FRICTION, rtol=1e-5)
    assert trace.first_row == 4


@pytest.mark.parametrize("mark", ["%", "#", "//", ";"])
def test_a_comment_mark_before_the_first_name_is_none_of_it(tmp_path: Path, mark: str) -> None:
    rows = "\n".join(f"{t:.3f}\t{f:.5f}" for t, f in zip(TIME, FRICTION, strict=True))
    (tmp_path / "a.dat").write_text(f"{mark}Rig 3\n{mark}Time(s)\tFt(N)\n{rows}\n", encoding="utf-8")
    np.testing.assert_allclose(read_export(tmp_path / "a.dat").force_N, FRICTION, atol=1e-5)


def test_the_force_along_a_needle_is_not_taken_for_friction(tmp_path: Path) -> None:
    path = saved(tmp_path, "Time [s],Insertion depth [mm],Axial force [N]", TIME, TIME, FRICTION)
    assert "no column was recognised as the friction force" in refusal(path)
    np.testing.assert_allclose(
        read_export(path, columns={"friction_force": "Axial force"}).force_N, FRICTION, rtol=1e-5
    )


@pytest.mark.parametrize(("pause_s", "records"), [(0.0, 1), (5.0, 3)])
def test_the_buffers_of_a_long_acquisition_are_one_record(tmp_path: Path, pause_s: float, records: int) -> None:
    text = "MTS793|BTW|ENU|1|2|.|/|:|1|0|0|A\n"
    for block in np.split(np.arange(N), 3):
        text += f"\nData Acquisition:\tTimed\t\tTime:\t{TIME[block[-1]]:.3f}\ts\nAxial Force\tTime\nN\ts\n"
        pause = pause_s * block[0] / N
        text += "".join(f"{FRICTION[k]:.5f}\t{TIME[k] + pause:.3f}\n" for k in block)
    (tmp_path / "a.dat").write_text(text, encoding="utf-8")
    traces = read_blocks(tmp_path / "a.dat")
    assert len(traces) == records
    np.testing.assert_allclose(np.concatenate([trace.force_N for trace in traces]), FRICTION, atol=1e-5)


@pytest.mark.parametrize(("sizes", "doubted"), [((N // 3,) * 3, False), ((20, N - 20), True), ((N - 20, 20), True)])
def test_a_header_that_is_none_of_a_series_of_buffers_is_doubted(
    tmp_path: Path, sizes: tuple[int, ...], doubted: bool
) -> None:
    text = "MTS793|BTW|ENU|1|2|.|/|:|1|0|0|A\n"
    for block in np.split(np.arange(sum(sizes)), np.cumsum(sizes)[:-1]):
        text += f"\nData Acquisition:\tTimed\t\tTime:\t{TIME[block[-1]]:.3f}\ts\nAxial Force\tTime\nN\ts\n"
        text += "".join(f"{FRICTION[k]:.5f}\t{TIME[k]:.3f}\n" for k in block)
    (tmp_path / "a.dat").write_text(text, encoding="utf-8")
    (trace,) = read_blocks(tmp_path / "a.dat")
    assert ("header_again" in trace.flags) == doubted


@pytest.mark.parametrize(
    "names",
    ["Fh (N),Fv (N)", "Fuerza horizontal (N),Fuerza vertical (N)", "Force horizontale (N),Force verticale (N)",
     "Forza orizzontale [N],Forza verticale [N]", "Siła pozioma [N],Siła pionowa [N]",
     "Horizontalkraft [N],Vertikalkraft [N]",
     "水平力（N）,垂直力（N）", "Fl [N],Fn [N]"],
)  # fmt: skip
def test_a_horizontal_and_a_vertical_force_are_friction_and_load_of_one_record(tmp_path: Path, names: str) -> None:
    trace = read_export(saved(tmp_path, f"t [s],{names}", TIME, FRICTION, np.full(N, 5.0)))
    np.testing.assert_allclose(trace.force_N, FRICTION, rtol=1e-5)
    np.testing.assert_allclose(trace.columns["normal_force_N"], 5.0)


@pytest.mark.parametrize("names", ["Load cell 1 [N],Load cell 2 [N]", "Sensor A [N],Sensor B [N]"])
def test_two_forces_that_differ_by_a_number_alone_are_refused_until_it_is_stated_what_they_are(
    tmp_path: Path, names: str
) -> None:
    path = saved(tmp_path, f"t [s],{names}", TIME, FRICTION, np.full(N, 5.0))
    first, second = names.split(",")
    assert "are two records, or the friction and the normal force of one" in refusal(path)
    trace = read_export(path, columns={"friction_force": first, "normal_force": second})
    np.testing.assert_allclose(trace.columns["normal_force_N"], 5.0)
    assert len(read_blocks(path, columns={"friction_force": "* [N]"})) == 2


@pytest.mark.parametrize(
    ("other", "read"), [("Resistance (N)", False), ("Peak Load (N)", True), ("Load filtered (N)", True)]
)
def test_a_load_beside_a_force_that_nobody_knows_is_not_read_as_friction(
    tmp_path: Path, other: str, read: bool
) -> None:
    path = saved(tmp_path, f"Time (s),Load (N),{other}", TIME, 3.0 * FRICTION, FRICTION)
    if read:
        np.testing.assert_allclose(read_export(path).force_N, 3.0 * FRICTION, rtol=1e-5)
    else:
        assert "of two forces it is not known which is the friction" in refusal(path)


def test_a_second_sensor_of_the_friction_is_a_doubt(tmp_path: Path) -> None:
    header = "Time (s),Friction force left (N),Friction force right (N),Normal force (N)"
    path = saved(tmp_path, header, TIME, FRICTION, FRICTION, 5.0 * FRICTION)
    assert "could also be Friction force right (N)" in inspect_export(path).in_words()
