"""Shapes of exports of other rigs: each is read to the numbers that were written, or refused with what to give."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tribo.errors import Problem, ReadError
from tribo.readers import columns_from_text, inspect_export, read_blocks, read_export
from tribo.records import Correction

K = np.arange(9)


def saved(folder: Path, text: str, name: str = "a.txt", encoding: str = "utf-8") -> Path:
    path = folder / name
    path.write_bytes(text.encode(encoding))
    return path


def problems_of(path: Path, **options: object) -> tuple[Problem, ...]:
    with pytest.raises(ReadError) as caught:
        read_export(path, **options)  # type: ignore[arg-type]
    return caught.value.problems


def table(header: str, rows: list[list[str]], delimiter: str) -> str:
    return header + "\n" + "\n".join(delimiter.join(row) for row in rows) + "\n"


def grouped(value: float, mark: str, decimal: str, decimals: int = 3) -> str:
    whole, _, rest = f"{value:,.{decimals}f}".partition(".")
    return whole.replace(",", mark) + (decimal + rest if rest else "")


@pytest.mark.parametrize(
    ("mark", "decimal", "delimiter"),
    [(",", ".", "\t"), (".", ",", ";"), (" ", ",", ";"), ("\u00a0", ",", "\t"), ("'", ".", ";"), ("’", ".", "\t")],
)
def test_thousands_separators_of_a_whole_column_are_read(
    tmp_path: Path, mark: str, decimal: str, delimiter: str
) -> None:
    force = 985.00665 + 20.0 * K
    rows = [
        [f"{0.1 * k:.2f}".replace(".", decimal), grouped(f, mark, decimal, 5)] for k, f in zip(K, force, strict=True)
    ]
    trace = read_export(saved(tmp_path, table(f"Time [s]{delimiter}Force [N]", rows, delimiter)))
    np.testing.assert_allclose(trace.force_N, force)
    np.testing.assert_allclose(trace.time_s, 0.1 * K)


def test_quoted_numbers_above_a_thousand_are_read(tmp_path: Path) -> None:
    force = 1000.00665 + 20.0 * K
    rows = [[f'"{0.1 * k:.1f}"', f'"{f:,.5f}"'] for k, f in zip(K, force, strict=True)]
    text = table('"Time","Load"\n"(s)","(N)"', rows, ",")
    np.testing.assert_allclose(read_export(saved(tmp_path, text)).force_N, force)


def test_grouped_numbers_of_every_column_are_read(tmp_path: Path) -> None:
    rows = [[f'"{1000.5 + k:,.1f}"', f'"{2000.25 + k:,.2f}"'] for k in K]
    trace = read_export(saved(tmp_path, table("Time [ms],Force [N]", rows, ",")))
    np.testing.assert_allclose(trace.force_N, 2000.25 + K)
    np.testing.assert_allclose(trace.time_s, (1000.5 + K) / 1000)


def test_one_number_with_a_slipped_mark_is_no_thousand(tmp_path: Path) -> None:
    rows = [[f"{0.1 * k:.1f}", f"{1.5 + k:.2f}"] for k in K]
    rows[4][1] = "1,234.50"
    (problem,) = problems_of(saved(tmp_path, table("Time [s]\tForce [N]", rows, "\t")))
    assert (problem.kind, problem.row, problem.found) == ("two_decimal_marks", 6, "1,234.50")


def test_a_mark_that_may_be_either_is_refused_until_it_is_given(tmp_path: Path) -> None:
    rows = [[str(k + 1), f"{k + 1},250"] for k in K]
    path = saved(tmp_path, table("Time [s];Force [N]", rows, ";"))
    (problem,) = problems_of(path)
    assert (problem.kind, problem.row, problem.column) == ("ambiguous_mark", 2, "Force [N]")
    assert 'decimal = ","' in str(problem.allowed)
    np.testing.assert_allclose(read_export(path, columns={"decimal": ","}).force_N, K + 1.25)
    np.testing.assert_allclose(read_export(path, columns={"decimal": "."}).force_N, 1000.0 * (K + 1) + 250)
    assert [p.kind for p in problems_of(path, columns={"decimal": ";"})] == ["unknown_decimal"]


@pytest.mark.parametrize("whole", [1, 3])
def test_a_mark_that_may_be_either_is_named_with_the_first_row_that_has_it(tmp_path: Path, whole: int) -> None:
    """The rows before it hold whole numbers."""
    rows = [[str(k + 1), f"{k + 1},250" if k >= whole else str(k + 1)] for k in K]
    (problem,) = problems_of(saved(tmp_path, table("Time [s];Force [N]", rows, ";")))
    assert (problem.kind, problem.row, problem.found) == ("ambiguous_mark", 2 + whole, f"{whole + 1},250")


def test_one_number_settles_the_mark_of_the_whole_table(tmp_path: Path) -> None:
    rows = [[str(k + 1), f"{k + 1},250"] for k in K]
    rows[-1][1] = "9,25"
    np.testing.assert_allclose(read_export(saved(tmp_path, table("Time [s];Force [N]", rows, ";"))).force_N, K + 1.25)


NO_TIME = table("Extension [mm],Force [N]", [[f"{0.2 * k:.1f}", f"{0.5 * k}"] for k in K], ",")


def test_force_against_displacement_takes_its_time_from_the_speed(tmp_path: Path) -> None:
    trace = read_export(saved(tmp_path, NO_TIME), correction=Correction(speed_m_s=2e-3))
    np.testing.assert_allclose(trace.time_s, 0.1 * K)
    assert trace.flags == ()
    assert trace.source is not None
    assert "2 mm/s" in trace.source.reasons["time"]


def test_force_against_displacement_without_speed_says_what_is_not_determined(tmp_path: Path) -> None:
    trace = read_export(saved(tmp_path, NO_TIME))
    np.testing.assert_allclose(trace.force_N, 0.5 * K)
    assert trace.flags == ("no_time",)
    assert "durations, rates, periods" in str(trace.problems[0])
    assert "speed_mm_s" in str(trace.problems[0].allowed)


def test_a_sampling_rate_makes_the_time_of_an_export_without_one(tmp_path: Path) -> None:
    path = saved(tmp_path, "Force [N]\tFz [N]\n" + "".join(f"{0.5 * k}\t2.0\n" for k in K))
    assert "sampling_rate_Hz" in str(problems_of(path)[0].allowed)
    trace = read_export(path, correction=Correction(sampling_rate_Hz=20.0))
    np.testing.assert_allclose(trace.time_s, K / 20)
    assert inspect_export(path, correction=Correction(sampling_rate_Hz=20.0)).tables[0].step_s == pytest.approx(0.05)


def test_a_time_with_a_unit_is_used_whatever_the_sampling_rate(tmp_path: Path) -> None:
    path = saved(tmp_path, "Time [s]\tForce [N]\n" + "".join(f"{0.1 * k:.1f}\t{0.5 * k}\n" for k in K))
    np.testing.assert_allclose(read_export(path, correction=Correction(sampling_rate_Hz=20.0)).time_s, 0.1 * K)


TORQUE = table("Time [s],Torque [N mm]", [[f"{0.1 * k:.1f}", f"{-5.0 * k}"] for k in K], ",")


def test_a_torque_becomes_a_force_over_the_lever_arm_with_sign_and_gain(tmp_path: Path) -> None:
    path = saved(tmp_path, TORQUE)
    (problem,) = problems_of(path)
    assert "as a torque" in problem.what
    assert "lever_arm_mm" in str(problem.allowed)
    trace = read_export(path, correction=Correction(sign=-1.0, gain=2.0, lever_arm_m=2.5e-3))
    np.testing.assert_allclose(trace.force_N, 4.0 * K)
    np.testing.assert_allclose(trace.columns["torque_Nm"], -5e-3 * K)
    assert trace.source is not None
    assert "2.5 mm" in trace.source.reasons["friction force"]
    assert "sign reversed" in trace.source.reasons["friction force"]


UNIVERSAL = """Results Table 1
,Maximum Force,Static COF,Time at Maximum
,[N],,[s]
1,12.5,0.41,3.2
2,12.9,0.43,3.1
Mean,12.7,0.42,3.15
Standard deviation,0.2,0.01,0.05

Results Table 2
Time,Displacement,Force
(s),(mm),(N)
"""


@pytest.mark.parametrize("quoted", [False, True])
def test_a_block_of_results_before_the_raw_data_is_no_trace(tmp_path: Path, quoted: bool) -> None:
    rows = [[f"{0.1 * k:.2f}", f"{0.01 * k:.3f}", f"{0.5 * k:.3f}"] for k in K]
    text = UNIVERSAL + "\n".join(",".join(row) for row in rows) + "\n"
    if quoted:
        text = "\n".join(",".join(f'"{c}"' for c in line.split(",")) if line else "" for line in text.split("\n"))
    trace = read_export(saved(tmp_path, text, "a.csv"))
    np.testing.assert_allclose(trace.force_N, 0.5 * K)
    assert trace.source is not None
    assert trace.source.family == "bluehill"


def mts(names: str, units: str, acquisitions: int) -> str:
    parts = ["MTS793|MPT|ENU|1|2|.|/|:|1|0|0|A\n"]
    for a in range(acquisitions):
        parts.append(f"\nData Acquisition\t\tTime:\t{a}.5\tSec\t3/29/2016 1:54:32 PM\n{names}\n{units}\n")
        parts += [f"{a + 0.1 * k:.2f}\t{0.01 * k:.3f}\t{-0.5 * k:.3f}\n" for k in K]
    return "".join(parts)


def test_acquisitions_of_an_mts_793_are_records_each(tmp_path: Path) -> None:
    path = saved(tmp_path, mts("Running Time\tAxial Displacement\tAxial Force", "Sec\tmm\tkN", 17))
    traces = read_blocks(path)
    assert len(traces) == 17
    for a, trace in enumerate(traces):
        np.testing.assert_allclose(trace.time_s, a + 0.1 * K)
        np.testing.assert_allclose(trace.force_N, -500.0 * K)


def test_a_row_of_units_under_unknown_names_is_no_row_of_names(tmp_path: Path) -> None:
    path = saved(tmp_path, mts("Sec Count\tAux 1\tAux 2", "Sec\tmm\tkN", 3))
    seen = inspect_export(path)
    assert [(c.name, c.unit) for c in seen.columns] == [("Sec Count", "Sec"), ("Aux 1", "mm"), ("Aux 2", "kN")]
    traces = read_blocks(path, columns={"time": "Sec Count", "friction_force": "Aux 2"})
    assert len(traces) == 3
    np.testing.assert_allclose(traces[2].force_N, -500.0 * K)


def lvm(names: str, labels: str, rows: list[str]) -> str:
    channels = len(labels.split("\t"))
    return "\n".join(
        [
            "LabVIEW Measurement\t", "Separator\tTab", "Decimal_Separator\t.", "X_Columns\tOne",
            "***End_of_Header***\t", "\t", f"Channels\t{channels}", f"Y_Unit_Label\t{labels}",
            "X_Dimension\t" + "\t".join(["Time"] * channels), "***End_of_Header***\t", f"X_Value\t{names}\tComment",
            *rows,
        ]
    )  # fmt: skip


def test_comments_behind_the_rows_of_an_lvm_are_left_out(tmp_path: Path) -> None:
    rows = [f"{0.1 * k:.1f}\t{0.5 * k}" + ("\tslipped, 3 times" if k in (2, 5) else "") for k in K]
    trace = read_export(saved(tmp_path, lvm("Force", "N", rows), "a.lvm"))
    np.testing.assert_allclose(trace.force_N, 0.5 * K)


def test_a_g_beside_an_acceleration_is_no_gram_force(tmp_path: Path) -> None:
    rows = [f"{0.1 * k:.1f}\t{0.5 * k}\t0.1" for k in K]
    path = saved(tmp_path, lvm("Force\tVibration", "g\tm/s^2", rows), "a.lvm")
    assert [p.kind for p in problems_of(path)] == ["missing_unit"]
    np.testing.assert_allclose(read_export(path, columns={"force": "Force [gf]"}).force_N, 0.5 * K * 9.80665e-3)
    plain = saved(tmp_path, table("Time [s],Fx [g],ax [m/s2]", [row.split("\t") for row in rows], ","))
    (problem,) = problems_of(plain)
    assert problem.kind == "ambiguous_unit"
    assert "gf or N" in str(problem.allowed)


LANGUAGES = [
    ("Czas [s];Droga [mm];Siła [N]", "cp1250"),
    ("Czas [s];Przemieszczenie [mm];Siła tarcia [N]", "utf-8"),
    ("时间(s);位移(mm);力(N)", "gb18030"),
    ("时间（s）;位移（mm）;摩擦力（N）", "utf-8"),
    ("時間(s);変位(mm);荷重(N)", "cp932"),
    ("時間;変位;荷重\n秒;mm;N", "utf-8"),
    ("Время, с;Перемещение, мм;Сила трения, Н", "cp1251"),
    ("시간(s);변위(mm);하중(N)", "cp949"),
    ("Aika [s];Siirtymä [mm];Kitkavoima [N]", "cp1252"),
    ("Čas [s];Dráha [mm];Třecí síla [N]", "cp1250"),
    ("Tiempo (s);Recorrido (mm);Fuerza de fricción (N)", "cp1252"),
]


@pytest.mark.parametrize(("names", "encoding"), LANGUAGES)
def test_names_of_columns_are_known_in_many_languages(tmp_path: Path, names: str, encoding: str) -> None:
    rows = [[f"{0.1 * k:.1f}", f"{0.01 * k:.2f}", f"{0.5 * k:.2f}"] for k in K]
    trace = read_export(saved(tmp_path, table(names, rows, ";"), encoding=encoding))
    np.testing.assert_allclose(trace.time_s, 0.1 * K)
    np.testing.assert_allclose(trace.force_N, 0.5 * K)
    assert trace.displacement_m is not None
    np.testing.assert_allclose(trace.displacement_m, 1e-5 * K)


def test_a_load_in_another_language_beside_a_friction_force_is_the_normal_force(tmp_path: Path) -> None:
    rows = [[f"{0.1 * k:.1f}", f"{0.5 * k:.2f}", "20.0"] for k in K]
    trace = read_export(saved(tmp_path, table("时间(s);摩擦力(N);载荷(N)", rows, ";")))
    np.testing.assert_allclose(trace.columns["normal_force_N"], 20.0)


def test_one_fault_in_many_rows_is_one_problem(tmp_path: Path) -> None:
    rows = [[f"{0.1 * k:.1f}", "OVER" if k % 2 else f"{0.5 * k:.1f}"] for k in range(400)]
    (problem,) = problems_of(saved(tmp_path, table("Time [s],Force [N]", rows, ",")))
    assert (problem.kind, problem.row, problem.column) == ("text_in_numbers", 3, "Force [N]")
    assert "in 200 rows" in problem.what


def test_rows_past_the_end_of_a_shorter_record_are_left_out_with_a_doubt(tmp_path: Path) -> None:
    rows = [[f"{0.1 * k:.1f}", f"{0.5 * k}" if k < 6 else "NaN", f"{0.7 * k}"] for k in K]
    path = saved(tmp_path, table("Time [s]\ta\tb", rows, "\t"))
    trace = read_export(path, columns={"force": "a [N]"})
    np.testing.assert_allclose(trace.force_N, 0.5 * K[:6])
    assert trace.flags == ("empty_end",)
    assert (trace.problems[0].row, trace.problems[0].what[:6]) == (8, "3 rows")


def test_a_column_can_be_left_out_by_quantity_and_by_name(tmp_path: Path) -> None:
    rows = [[f"{0.1 * k:.1f}", f"{0.5 * k}", "text", f"{0.25 * k}"] for k in K]
    path = saved(tmp_path, table("Time [s],Friction force [N],Displacement [mm],Load [N]", rows, ","))
    assert problems_of(path)[0].kind == "text_in_numbers"
    trace = read_export(path, columns={"displacement": "none"})
    assert trace.displacement_m is None
    assert read_export(path, columns=columns_from_text("ignore=Displacement")).displacement_m is None
    other = read_export(path, columns={"ignore": ["Friction force", "#3"]})
    np.testing.assert_allclose(other.force_N, 0.25 * K)


def test_a_table_that_needs_no_columns_does_not_demand_them(tmp_path: Path) -> None:
    first = table("Clock\tChannel 7", [[f"{100 * k}", f"{500 * k}"] for k in K], "\t")
    second = table("Time [s]\tForce [N]", [[f"{0.1 * k:.1f}", f"{0.5 * k}"] for k in K], "\t")
    columns = {"time": "Clock [ms]", "force": "Channel 7 [mN]"}
    traces = read_blocks(saved(tmp_path, first + "\n" + second), columns=columns)
    assert [t.flags for t in traces] == [(), ("column_not_here",)]
    for trace in traces:
        np.testing.assert_allclose(trace.force_N, 0.5 * K)


def test_a_misspelt_column_is_refused_although_the_names_of_the_file_would_do(tmp_path: Path) -> None:
    path = saved(tmp_path, table("Time [s],Force [N],Channel 2 [N]", [["0", "1", "2"], ["1", "2", "3"]], ","))
    assert "did you mean Channel 2" in str(problems_of(path, columns={"force": "Chanel 2"})[0])
