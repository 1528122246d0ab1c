"""Each family is recognised by its content and read to the right columns and SI units; the samples are made up."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tribo.errors import ReadError
from tribo.readers import READERS, inspect_export, read_blocks, read_export
from tribo.records import Correction, Trace

GRAM_FORCE = 9.80665e-3


def rows(n: int = 8, *, start: float = 0.0, cells: int = 3, delimiter: str = ",", quoted: bool = False) -> list[str]:
    """Rows of time 0.1 k, then 0.01 k, 0.02 k and so on."""
    lines = []
    for k in range(n):
        values = [f"{start + 0.1 * k:.3f}", *(f"{0.01 * j * k + 0.001:.5f}" for j in range(1, cells))]
        lines.append(delimiter.join(f'"{v}"' if quoted else v for v in values))
    return lines


BLUEHILL = ['"Specimen label","S1"', "", '"Time","Extension","Load"', '"(s)","(mm)","(N)"', *rows(quoted=True)]
BLUEHILL_WITH_RESULTS = [
    '"Results Table 1"',
    '"","Maximum Load","Extension at Maximum Load"',
    '"","(N)","(mm)"',
    '"1","1.5","0.2"',
    '"2","1.6","0.3"',
    "",
    '"Specimen 1"',
    '"Time","Extension","Load"',
    '"(s)","(mm)","(N)"',
    *rows(quoted=True),
    "",
    '"Specimen 2"',
    '"Time","Extension","Load"',
    '"(s)","(mm)","(N)"',
    *rows(5, quoted=True),
]
TESTXPERT_DE = [
    '"Prüfprotokoll";"P1"',
    '"Prüfzeit";"Standardweg";"Standardkraft"',
    '"s";"mm";"mN"',
    *(row.replace(".", ",") for row in rows(delimiter=";")),
]
TESTXPERT_EN = ['"Operator",""', '"Test time","Standard travel","Standard force"', '"s","mm","N"', *rows()]
TRA_FR = ['"Opérateur",""', '"Temps","Traverse absolue","Force standard"', '"s","mm","N"', *rows()]
TESTSUITE = [
    "Data Acquisition: Pull 1 - (Timed)",
    "Station Name: sled",
    "",
    "Time \tCrosshead \tLoad ",
    "s\tmm\tN",
    *rows(delimiter="\t"),
    "",
    "Data Acquisition: Pull 2 - (Timed)",
    "Station Name: sled",
    "",
    "Time \tCrosshead \tLoad ",
    "s\tmm\tN",
    *rows(6, delimiter="\t"),
]
MTS793 = [
    "MTS793|MPT|DEU|1|2|,|.|:|49|1|1|A",
    "",
    "Datenerfassung\t\t\tZeit:\t1,5\ts",
    "Tageszeit\tLaufzeit\tCh 1 Kraft Sollwert\tCh 1 Kraft\tCh 1 Weg",
    "d\ts\tkN\tkN\tmm",
    *(
        f"0,61166\t{0.1 * k:.3f}\t-9,9\t{0.02 * k + 0.001:.5f}\t{0.01 * k + 0.001:.5f}".replace(".", ",")
        for k in range(8)
    ),
]
TRAPEZIUM = ['"C35",,', '"Time","Force","Stroke"', '"sec","N","mm"', *rows(quoted=True)]
TRAPEZIUM_TWO = [
    '"1_1",,,"1_2",,',
    '"Time","Force","Stroke","Time","Force","Stroke"',
    '"sec","N","mm","sec","N","mm"',
    *(f"{a},{b}" for a, b in zip(rows(quoted=True), [*rows(6, quoted=True), '"","",""', '"","",""'], strict=True)),
]
WALTERBAI = [
    "S/No;C_1_Temps[s];C_1_Force[kN];C_1_Déform1[mm];C_1_Déplacement[mm];",
    *(f"{k + 1};{0.1 * k:.15g};{0.02 * k + 0.001:.15g};0;{0.01 * k + 0.001:.15g};" for k in range(8)),
]
PMD = [
    "Probe;P7;INSTRON;1;PMD;8",
    "Maschine [mm]\tKraft [N]\tZeit [s]",
    *(f"{0.01 * k + 0.001:.5E}\t{0.02 * k + 0.001:.5E}\t{0.1 * k:.5E}" for k in range(8)),
]
UMT_STEP = ["", "Step Type Code: 0", "Set Force    = -200", "", "Fx,Fz,X,T,Ff,COF", "g,g,mm,sec,g,", ""]
UMT = [
    "Created by CETR Data Viewer ver.2",
    "Run # 1",
    "Step No. 1",
    *UMT_STEP,
    *(f"{2.0 * k + 0.1:.5f},-200.0,{0.01 * k + 0.001:.5f},{0.1 * k:.3f},{2.0 * k + 0.1:.5f},0.01" for k in range(8)),
    "",
    "Step No. 2",
    *UMT_STEP,
    *(f"{-2.0 * k:.5f},-200.0,{0.01 * k:.5f},{0.1 * k:.3f},{2.0 * k:.5f},0.01" for k in range(6)),
    "",
    "",
]
TE67_NAMES = "\tTime\tTest Time\tMass\tLoad\tFriction Force\tFriction Coefficient\tDisplacement\tFriction Force\t"
TE67 = [
    "Data file\t\tA.TSV",
    "Configuration file\t\tA.CFG",
    "Test control file\t\tA.TSF",
    "test 2\t\tA",
    "\t\t",
    "Test started at 20:32:15 on 2019-04-12",
    TE67_NAMES,
    *(
        f"\t20:32:{15 + k:02d}\t{k},\t1000\t9,810\t{0.5 * k:.1f}\t{0.5 * k / 9.81:.6f}\t3949\t{0.5 * k:.1f}\t".replace(
            ".", ","
        )
        for k in range(12)
    ),
    "Test completed at 20:33:00 on 2019-04-12",
]
CSM = ["Time \tDistance\t Laps\t mu\tFrictionForce", *(row.replace(".", ",") for row in rows(cells=5, delimiter="\t"))]
PCS = [
    "MTM311 Test Data File",
    "Number of steps in profile:\t3",
    "",
    "Step 1 started at 23/03/2018 10:11:45",
    "Step type\tMAPPER",
    "Camera window load = 49.747 N",
    "",
    "Step 2 started at 23/03/2018 10:12:01",
    "Step type\tBOD_TIMED",
    "Step Time (s)\tTraction Coeff (-)\t\tStep Time (s)\tBall Load (N)\tTraction Force (N)",
    *(f"{k + 1}\t0.02\t\t{k + 1}\t50.0\t{0.02 * k + 0.001:.5f}" for k in range(8)),
    "",
    "Step 3 started at 23/03/2018 10:20:01",
    "Step type\tBOD_TIMED",
    "Step Time (s)\tTraction Coeff (-)\t\tStep Time (s)\tBall Load (N)\tTraction Force (N)",
    *(f"{k + 1}\t0.02\t\t{k + 1}\t50.0\t{0.02 * k + 0.001:.5f}" for k in range(5)),
    "",
    "All steps completed, test completed normally",
]
LVM_SEGMENT = [
    "Channels\t3\t\t\t\t",
    "Samples\t8\t8\t8\t",
    "Y_Unit_Label\tN\tN\tmicrometer\t",
    "X_Dimension\tTime\tTime\tTime\t",
    "Delta_X\t0.1\t0.1\t0.1\t",
    "***End_of_Header***\t\t\t\t",
    "X_Value\tfx_N\tfz_N\tdx_um\tComment",
]
LVM = [
    "LabVIEW Measurement\t",
    "Separator\tTab",
    "***End_of_Header***\t",
    "\t",
    *LVM_SEGMENT,
    *(f"{0.1 * k:.6f}\t{0.02 * k + 0.001:.6f}\t13.15\t{10.0 * k + 1:.6f}" for k in range(8)),
    "",
    *LVM_SEGMENT,
    *(f"{0.1 * k:.6f}\t{0.02 * k:.6f}\t13.15\t{10.0 * k:.6f}" for k in range(6)),
]
RHEOCOMPASS_INTERVAL = [
    "Interval data:\tPoint No.\tTime\tSliding Distance\tFriction Force\tNormal Force",
    "\t\t\t\t\t",
    "\t\t[s]\t[mm]\t[N]\t[N]",
]
RHEOCOMPASS = [
    "Project:\tSled",
    "Test:\tPDMS",
    "",
    "Interval and data points:\t1\t8",
    *RHEOCOMPASS_INTERVAL,
    *(f"\t{k + 1}\t{0.1 * k:.3f}\t{0.01 * k + 0.001:.5f}\t{0.02 * k + 0.001:.5f}\t1.0" for k in range(8)),
    "",
    "Interval and data points:\t2\t6",
    *RHEOCOMPASS_INTERVAL,
    *(f"\t{k + 1}\t{0.1 * k:.3f}\t{0.01 * k:.5f}\t{0.02 * k:.5f}\t2.0" for k in range(6)),
]
RTEC_NAMES = "Fz (N),COF,Timestamp (s),X Position (mm),Fx (N)"
RTEC = [
    "Recipe,sled",
    "Step 1",
    RTEC_NAMES,
    *(f"1.0,0.02,{0.1 * k:.3f},{0.01 * k + 0.001:.5f},{0.02 * k + 0.001:.5f}" for k in range(8)),
    "Step 2",
    RTEC_NAMES,
    *(f"2.0,0.02,{0.1 * k:.3f},{0.01 * k:.5f},{0.02 * k:.5f}" for k in range(6)),
]
NEWPORT = [
    "\t".join(["0.050", "0.001", "0.700", "10.000", "3.000", *["1.000"] * 11]),
    *(f"{0.1 * k:.6f};{0.1 * k + 0.05:.6f};-0.121881;{0.002 * k:.6f};499.725000;1.000000;0.050000" for k in range(8)),
]
SPACES = ["Time(s)  Extension(mm)  Load(N)", *(row.replace(",", "   ") for row in rows())]

RTEC_LOG = [
    "Rtec instruments",
    "sled",
    "Step, Timestamp, RecipeStep, DAQ.Fz (N),DAQ.Fx (N),DAQ.COF (),XYZ.X Position (mm),",
    *(f"1,{0.1 * k:.3f},1,1.0,{0.02 * k + 0.001:.5f},0.02,{0.01 * k + 0.001:.5f}," for k in range(8)),
    *(f"2,{0.1 * k:.3f},2,2.0,{0.02 * k:.5f},0.02,{0.01 * k:.5f}," for k in range(6)),
    "End of log",
]
TRB = [
    "TRB3",
    "Linear mode",
    "Time [s]\tDistance [m]\tLaps\tNominal Load [N]\tµ\tLinear Position [mm]\tFriction Force [N]\tHumidity [%]",
    *(f"{0.1 * k:.3f}\t{k}\t1\t2.0\t0.1\t{0.01 * k + 0.001:.5f}\t{0.02 * k + 0.001:.5f}\t45" for k in range(8)),
]

LVM_NO_X_SEGMENT = [
    "Channels\t2\t\t",
    "Y_Unit_Label\tNewtons\tmicrometer\t",
    "X_Dimension\tTime\tTime\t",
    "X0\t0,0\t0,0\t",
    "Delta_X\t0,100000\t0,100000\t",
    "***End_of_Header***\t\t\t",
    "X_Value\tForce\tDisplacement\tComment",
]
LVM_NO_X = [
    "LabVIEW Measurement\t",
    "Separator\tTab",
    "Decimal_Separator\t,",
    "Multi_Headings\tYes",
    "X_Columns\tNo",
    "***End_of_Header***\t",
    "\t",
    *LVM_NO_X_SEGMENT,
    *(f"\t{0.02 * k + 0.001:.6f}\t{10.0 * k + 1:.6f}".replace(".", ",") for k in range(8)),
    "",
    *LVM_NO_X_SEGMENT,
    *(f"\t{0.02 * k:.6f}\t{10.0 * k:.6f}".replace(".", ",") for k in range(6)),
]
RHEOCOMPASS_DE_INTERVAL = [
    "Intervalldaten:\tMesspkt.\tZeit\tGleitgeschwindigkeit\tNormalkraft\tReibkraft",
    "\t\t\t\t\t",
    "\t\t[s]\t[m/s]\t[N]\t[mN]",
]
RHEOCOMPASS_DE = [
    "Projekt:\tSchlitten",
    "Intervall und Messpunkte:\t1\t8",
    *RHEOCOMPASS_DE_INTERVAL,
    *(f"\t{k + 1}\t{0.1 * k:.3f}\t0.001\t1.0\t{0.02 * k + 0.001:.5f}".replace(".", ",") for k in range(8)),
    "",
    "Intervall und Messpunkte:\t2\t6",
    *RHEOCOMPASS_DE_INTERVAL,
    *(f"\t{k + 1}\t{0.1 * k:.3f}\t0.002\t1.0\t{0.02 * k:.5f}".replace(".", ",") for k in range(6)),
]
BLUEHILL_SIDE_BY_SIDE = [
    "Specimen 1,,,Specimen 2,,",
    "Time,Displacement,Force,Time,Displacement,Force",
    "(s),(mm),(N),(s),(mm),(N)",
    *(f"{a},{b}" for a, b in zip(rows(), [*rows(6), ",,", ",,"], strict=True)),
]
BLUEHILL_EMPTY_FIRST = ["", ",Time,Extension,Load", ",(s),(mm),(N)", *(f",{row}" for row in rows())]
TEXT_OF_NUMPY = ["# sled of 50 g", "# time/s disp/mm force/N", *(row.replace(",", " ") for row in rows())]

# text, family, number of traces, factor of the force column, encoding
SAMPLES: dict[str, tuple[list[str], str, int, float]] = {
    "bluehill": (BLUEHILL, "bluehill", 1, 1.0),
    "bluehill, two specimens and results": (BLUEHILL_WITH_RESULTS, "bluehill", 2, 1.0),
    "testxpert german": (TESTXPERT_DE, "testxpert", 1, 1e-3),
    "testxpert english": (TESTXPERT_EN, "testxpert", 1, 1.0),
    "testxpert french": (TRA_FR, "testxpert", 1, 1.0),
    "testsuite, two acquisitions": (TESTSUITE, "testsuite", 2, 1.0),
    "mts 793": (MTS793, "mts793", 1, 1e3),
    "walter+bai": (WALTERBAI, "walterbai", 1, 1e3),
    "pmd": (PMD, "bam", 1, 1.0),
    "umt, two steps": (UMT, "umt", 2, 100 * GRAM_FORCE),
    "pcs, two steps with tables": (PCS, "pcs", 2, 1.0),
    "labview, two segments": (LVM, "labview", 2, 1.0),
    "rheocompass, two intervals": (RHEOCOMPASS, "rheocompass", 2, 1.0),
    "rtec, two steps": (RTEC, "rtec", 2, 1.0),
    "rtec, one log of two steps": (RTEC_LOG, "rtec", 2, 1.0),
    "labview, times left out, two segments": (LVM_NO_X, "labview", 2, 1.0),
    "rheocompass german, two intervals": (RHEOCOMPASS_DE, "rheocompass", 2, 1e-3),
    "bluehill, specimens side by side": (BLUEHILL_SIDE_BY_SIDE, "bluehill", 2, 1.0),
    "bluehill, empty first column": (BLUEHILL_EMPTY_FIRST, "delimited", 1, 1.0),
    "numbers under a comment of names": (TEXT_OF_NUMPY, "delimited", 1, 1.0),
    "anton paar, units in the names": (TRB, "csm", 1, 1.0),
    "blanks between cells": (SPACES, "delimited", 1, 1.0),
}


def saved(folder: Path, lines: list[str], name: str = "export.txt", encoding: str = "cp1252") -> Path:
    path = folder / name
    path.write_bytes("\r\n".join([*lines, ""]).encode(encoding))
    return path


def assert_first_table(trace: Trace, factor: float) -> None:
    """The first table of every sample: eight rows, the force 0.02 k + 0.001 in its own unit."""
    k = np.arange(8)
    np.testing.assert_allclose(trace.force_N, (0.02 * k + 0.001) * factor, rtol=1e-9)
    assert np.ptp(np.diff(trace.time_s)) < 1e-9
    if trace.displacement_m is not None and np.ptp(trace.displacement_m) < 1e-4:
        np.testing.assert_allclose(trace.displacement_m, (0.01 * k + 0.001) * 1e-3, rtol=1e-9)


@pytest.mark.parametrize("sample", SAMPLES)
@pytest.mark.parametrize("encoding", ["cp1252", "utf-8", "utf-16"])
def test_a_family_is_read_from_its_content(tmp_path: Path, sample: str, encoding: str) -> None:
    lines, family, n_traces, factor = SAMPLES[sample]
    traces = read_blocks(saved(tmp_path, lines, encoding=encoding))
    assert len(traces) == n_traces
    assert {t.source.family for t in traces if t.source} == {family}
    assert_first_table(traces[0], factor)


def test_trapezium_specimens_side_by_side_are_a_trace_each(tmp_path: Path) -> None:
    traces = read_blocks(saved(tmp_path, TRAPEZIUM_TWO))
    assert [t.time_s.size for t in traces] == [8, 6]
    for trace in traces:
        np.testing.assert_allclose(trace.force_N, 0.01 * np.arange(trace.time_s.size) + 0.001)
    alone = read_export(saved(tmp_path, TRAPEZIUM))
    np.testing.assert_array_equal(alone.force_N, traces[0].force_N)


def test_specimens_side_by_side_keep_their_names_and_the_format_of_the_file(tmp_path: Path) -> None:
    path = saved(tmp_path, TRAPEZIUM_TWO)
    seen = inspect_export(path)
    assert [t.label for t in seen.tables] == ["1_1", "1_2"]
    assert (seen.family, seen.delimiter, seen.encoding) == ("trapezium", ",", "ascii")
    bare = saved(tmp_path, [line.replace('"', "") for line in TRAPEZIUM_TWO], name="bare.csv")
    assert [t.time_s.size for t in read_blocks(bare)] == [8, 6]
    assert inspect_export(bare).family == "trapezium"


def test_a_counting_column_with_the_sampling_step_as_its_unit_is_a_time(tmp_path: Path) -> None:
    lines = ["Index;Force [ N ]", *(f"{k};{0.02 * k:.3f}" for k in range(9))]
    path = saved(tmp_path, lines)
    with pytest.raises(ReadError, match=r"\[0.01 s\]"):
        read_export(path)
    np.testing.assert_allclose(read_export(path, columns={"time": "Index [0.01 s]"}).time_s, 0.01 * np.arange(9))


def test_several_traces_are_refused_until_one_is_chosen(tmp_path: Path) -> None:
    path = saved(tmp_path, UMT)
    with pytest.raises(ReadError, match="contains 2 traces") as caught:
        read_export(path)
    assert [p.kind for p in caught.value.problems] == ["several_tables"]
    second = read_export(f"{path}#2")
    np.testing.assert_allclose(second.force_N, -2.0 * np.arange(6) * GRAM_FORCE)
    with pytest.raises(ReadError, match=r"#1 to .*#2"):
        read_export(f"{path}#3")


def test_anton_paar_columns_with_units_need_no_help(tmp_path: Path) -> None:
    trace = read_export(saved(tmp_path, TRB, encoding="utf-8"))
    np.testing.assert_allclose(trace.columns["normal_force_N"], 2.0)
    np.testing.assert_allclose(trace.columns["friction_coefficient"], 0.1)
    np.testing.assert_allclose(trace.columns["humidity_pct"], 45)


def test_gram_force_and_signs_of_the_umt_are_kept(tmp_path: Path) -> None:
    path = saved(tmp_path, UMT)
    trace = read_blocks(path)[0]
    np.testing.assert_allclose(trace.columns["normal_force_N"], -200.0 * GRAM_FORCE)
    signs = inspect_export(path).signs
    assert any("negative under load" in text for text in signs)


def test_the_te67_proves_its_units_by_its_own_columns(tmp_path: Path) -> None:
    trace = read_export(saved(tmp_path, TE67))
    np.testing.assert_allclose(trace.force_N, 0.5 * np.arange(12))
    np.testing.assert_allclose(trace.columns["normal_force_N"], 9.81)
    assert trace.displacement_m is None
    assert "column_without_unit" in trace.flags
    assert trace.source is not None
    assert "times 9.81" in trace.source.reasons["friction force"]


def test_the_te67_is_refused_where_its_columns_prove_nothing(tmp_path: Path) -> None:
    lines = [line.replace("\t9,810\t", "\t9,100\t") for line in TE67]
    with pytest.raises(ReadError) as caught:
        read_export(saved(tmp_path, lines))
    assert {(p.kind, p.column) for p in caught.value.problems} == {("missing_unit", "Friction Force")}


def test_the_te67_gives_no_unit_to_a_force_that_is_not_the_coefficient_times_the_load(tmp_path: Path) -> None:
    """A friction force in millinewtons beside a load in newtons: only the load has a proven unit."""
    lines = list(TE67)
    for row in [row for row, line in enumerate(lines) if line.startswith("\t20:32:")]:
        cells = lines[row].split("\t")
        cells[5] = f"{1000 * float(cells[5].replace(',', '.')):.1f}".replace(".", ",")
        lines[row] = "\t".join(cells)
    path = saved(tmp_path, lines)
    with pytest.raises(ReadError) as caught:
        read_export(path)
    assert {(p.kind, p.column) for p in caught.value.problems} == {("missing_unit", "Friction Force")}
    trace = read_export(path, columns={"friction_force": "Friction Force [mN]"})
    np.testing.assert_allclose(trace.force_N, 0.5 * np.arange(12))
    np.testing.assert_allclose(trace.columns["normal_force_N"], 9.81)


@pytest.mark.parametrize("stamp", ["09:00:{:04.1f}", "2026-03-02 09:00:{:04.1f}", "2026-03-02T09:00:{:04.1f}"])
def test_times_of_day_are_read_and_a_counter_may_be_given_in_their_place(tmp_path: Path, stamp: str) -> None:
    lines = ["No,Timestamp,Force (N)", *(f"{k},{stamp.format(0.1 * k)},{0.02 * k:.3f}" for k in range(12))]
    path = saved(tmp_path, lines)
    for given in ({}, {"time": "No [0.1 s]"}):
        trace = read_export(path, columns=given)
        np.testing.assert_allclose(np.diff(trace.time_s), 0.1)


def test_a_table_without_units_is_refused_with_what_to_give(tmp_path: Path) -> None:
    path = saved(tmp_path, CSM)
    with pytest.raises(ReadError, match=r"time = .Time \[s\]."):
        read_export(path)
    columns = {"time": "Time [s]", "friction_force": "FrictionForce [N]", "displacement": "Distance [m]"}
    trace = read_export(path, columns=columns)
    np.testing.assert_allclose(trace.force_N, 0.04 * np.arange(8) + 0.001)
    np.testing.assert_allclose(trace.columns["friction_coefficient"], 0.03 * np.arange(8) + 0.001)


def test_a_torque_needs_its_lever(tmp_path: Path) -> None:
    path = saved(tmp_path, NEWPORT)
    with pytest.raises(ReadError, match="give the lever arm"):
        read_export(path)
    trace = read_export(path, columns={"friction_force": "#4 [N m / 2.5 mm]"})
    np.testing.assert_allclose(trace.force_N, 0.002 * np.arange(8) / 2.5e-3)
    np.testing.assert_allclose(trace.columns["normal_force_N"], -0.121881)
    np.testing.assert_allclose(trace.time_s, 0.1 * np.arange(8) + 0.05)


SIDECARS = {
    "toml": 'columns = ["Step", "Time [s]", {name = "Normal force", unit = "N"}, "Force [mN]", "x [um]", "n", "v"]',
    "json": '{"columns": ["Step", "Time [s]", "Normal force [N]", "Force [mN]", "x [um]", "n", "v"]}',
    "hdr": "# names\nStep\nTime [s]\nNormal force [N]\nForce [mN]\nx [um]\nn\nv\n",
}


@pytest.mark.parametrize("suffix", SIDECARS)
def test_a_sidecar_names_the_columns_of_a_nameless_export(tmp_path: Path, suffix: str) -> None:
    path = saved(tmp_path, NEWPORT)
    path.with_suffix(f".{suffix}").write_text(SIDECARS[suffix])
    trace = read_export(path)
    np.testing.assert_allclose(trace.force_N, 0.002e-3 * np.arange(8), atol=1e-15)
    assert trace.displacement_m is not None
    np.testing.assert_allclose(trace.displacement_m, 499.725e-6)
    assert trace.metadata["names of columns from"] == f"export.{suffix}"


@pytest.mark.parametrize("text", ["{", '{"columns": 3}', '{"columns": ["Time [s]"]}'])
def test_a_sidecar_that_does_not_fit_is_not_used(tmp_path: Path, text: str) -> None:
    path = saved(tmp_path, NEWPORT)
    path.with_suffix(".json").write_text(text)
    with pytest.raises(ReadError, match="give the lever arm"):
        read_export(path)


def test_a_time_that_starts_again_cuts_a_table_into_traces(tmp_path: Path) -> None:
    lines = ["Step,Time (s),Fx (N)", *(f"{s},{0.1 * k:.2f},{0.01 * k * s:.3f}" for s in (1, 2, 3) for k in range(5))]
    path = saved(tmp_path, lines)
    traces = read_blocks(path)
    assert [t.name for t in traces] == ["export#1", "export#2", "export#3"]
    np.testing.assert_allclose(traces[2].force_N, 0.03 * np.arange(5))
    with pytest.raises(ReadError) as caught:
        read_export(path)
    assert [(p.kind, p.row) for p in caught.value.problems] == [("time_goes_back", 7)]
    assert read_export(f"{path}#2").force_N[-1] == pytest.approx(0.08)


def test_samples_behind_a_restart_of_time_keep_their_rows_of_the_file(tmp_path: Path) -> None:
    """One header line, then two records of five rows each: the second begins in row 7, and an inspection says so."""
    lines = ["Time (s),Fx (N)", *(f"{0.1 * k:.2f},{0.01 * k * s:.3f}" for s in (1, 2) for k in range(5))]
    path = saved(tmp_path, lines)
    assert [trace.first_row for trace in read_blocks(path)] == [2, 7]
    assert read_export(f"{path}#2").first_row == 7
    assert [table.first_row for table in inspect_export(path).tables] == [2, 7]


@pytest.mark.parametrize("sample", ["bluehill", "testxpert german", "testsuite, two acquisitions", "mts 793"])
def test_a_sheet_saved_from_an_export_reads_as_the_export(tmp_path: Path, sample: str) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    lines, _, n_traces, factor = SAMPLES[sample]
    delimiter = next(d for d in "\t;," if d in lines[-2])
    book = openpyxl.Workbook()
    for line in lines:
        cells = [cell.strip('"') for cell in line.split(delimiter)]
        book.active.append([_as_cell(cell) for cell in cells])
    book.save(tmp_path / "a.xlsx")
    traces = read_blocks(tmp_path / "a.xlsx")
    assert len(traces) == n_traces
    assert_first_table(traces[0], factor)


def _as_cell(text: str) -> float | str | None:
    try:
        return float(text.replace(",", "."))
    except ValueError:
        return text or None


def test_every_sheet_of_a_workbook_is_looked_at(tmp_path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.append(["Notes", "none"])
    for name in ("Pull 1", "Pull 2"):
        sheet = book.create_sheet(name)
        for row in (["Time", "Load"], ["s", "N"], *([0.1 * k, 0.02 * k] for k in range(9))):
            sheet.append(row)
    book.save(tmp_path / "a.xlsx")
    assert [t.time_s.size for t in read_blocks(tmp_path / "a.xlsx")] == [9, 9]


def test_variables_of_a_mat_file_are_taken_by_name(tmp_path: Path) -> None:
    from scipy.io import savemat

    time, ratio = 0.01 * np.arange(50), 0.3 + 0.01 * np.sin(np.arange(50))
    savemat(tmp_path / "a.mat", {"t": time[:, None], "Fnorm": ratio[None, :], "k": 168.0, "note": "paper"})
    with pytest.raises(ReadError, match="have no units"):
        read_export(tmp_path / "a.mat")
    trace = read_export(tmp_path / "a.mat", columns={"time": "t [s]", "force": "Fnorm [30.7 gf]"})
    np.testing.assert_array_equal(trace.time_s, time)
    np.testing.assert_allclose(trace.force_N, ratio * 0.0307 * 9.80665, rtol=1e-14)


def test_a_mat_file_of_version_7_3_is_read_as_well(tmp_path: Path) -> None:
    import h5py

    with h5py.File(tmp_path / "a.mat", "w", userblock_size=512) as out:
        out["t"], out["F"] = np.arange(9.0)[None, :], np.arange(9.0)[None, :] ** 2
    with (tmp_path / "a.mat").open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file")
    trace = read_export(tmp_path / "a.mat", columns={"time": "t [ms]", "force": "F [mN]"})
    np.testing.assert_allclose(trace.force_N, np.arange(9.0) ** 2 * 1e-3)


@pytest.mark.parametrize(
    "data", [b"MATLAB 5.0 MAT-file, but no more", b"PK\x03\x04 no workbook", b"\xd0\xcf\x11\xe0 old"]
)
def test_a_damaged_container_is_refused(tmp_path: Path, data: bytes) -> None:
    (tmp_path / "a.bin").write_bytes(data)
    with pytest.raises(ReadError) as caught:
        read_export(tmp_path / "a.bin")
    assert caught.value.problems[0].kind in {"bad_mat", "bad_archive", "bad_workbook"}


def test_damage_in_one_of_several_tables_is_named_with_its_row(tmp_path: Path) -> None:
    lines = list(TESTSUITE)
    lines[-2] = lines[-2].replace("0.400", "O.4OO")
    with pytest.raises(ReadError) as caught:
        read_blocks(saved(tmp_path, lines))
    assert [(p.kind, p.row) for p in caught.value.problems] == [("text_in_numbers", len(lines) - 1)]


def test_every_family_has_a_sample_here() -> None:
    tested = {family for _, family, _, _ in SAMPLES.values()} | {"trapezium", "te67", "csm", "newport", "matlab"}
    assert tested | {"tdms", "json", "kyowa", "monitor"} == set(READERS)  # the last two in test_unseen_machines


def with_speed(radius_mm: float) -> list[str]:
    """The TE67 sample with a sliding velocity of 0.15 m/s at 65 turns a minute, and a radius beside it."""
    start = TE67.index(TE67_NAMES)
    cells = f"0,150\t65\t{radius_mm:g}\t"
    rows = [line + (cells if line.startswith("\t20:32:") else "") for line in TE67[start + 1 :]]
    return [*TE67[:start], TE67_NAMES + "Sliding Velocity\tSpeed\tRadius\t", *rows]


def test_the_te67_proves_the_unit_of_its_speed_by_radius_and_turns(tmp_path: Path) -> None:
    trace = read_export(saved(tmp_path, with_speed(22.0)))
    np.testing.assert_allclose(trace.columns["speed_m_s"], 0.15)
    assert "speed_m_s" not in read_export(saved(tmp_path, with_speed(14.0))).columns


def test_turns_of_a_drive_become_a_speed_with_the_lever_arm(tmp_path: Path) -> None:
    lines = ["Time [s]\tTorque [N m]\tSpindle speed [rpm]", *(f"{0.1 * k:.1f}\t{1e-3 * k:.4f}\t30" for k in range(40))]
    trace = read_export(saved(tmp_path, lines), correction=Correction(lever_arm_m=0.02))
    np.testing.assert_allclose(trace.columns["rotation_rev_per_s"], 0.5)
    np.testing.assert_allclose(trace.columns["speed_m_s"], np.pi * 0.02)
