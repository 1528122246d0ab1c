"""Exports that nobody here wrote: each is read to the right columns and units, or refused with what to give.

The numbers were computed from the files independently of tribo; they stand in the index beside the files.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from in_one_test import in_one_test

from tribo.errors import ReadError
from tribo.readers import inspect_export, read_blocks, read_export
from tribo.records import Trace

GRAM_FORCE = 9.80665e-3

# file: family, rows of each trace, (time, force, displacement) columns as the file spells them; X of the UMT is the
# radius of the track, 3.94925 mm in every row, and no displacement
READ = {
    "fr_cetr_umt2_2N_stroke001.csv": ("umt", (110, 107), "T [sec]", "Fx [g]", None),
    "fr_cetr_umt2_2N_stroke050.csv": ("umt", (107, 108), "T [sec]", "Fx [g]", None),
    "fr_labview_lvm_demo2.txt": ("labview", (6, 6, 6), "X_Value [s]", "fx [N]", "dx [um]"),
    "fr_pcs_ehd2_demo3.txt": ("pcs", (21, 21), "Step Time [s]", "Traction Force 1 [N]", None),
    "fr_pcs_mtm_output.txt": ("pcs", (300,) * 24, "Step Time [s]", "Traction Force [N]", None),
    "fr_te67_PPS_100N_1.tsv": ("te67", (1801,), "Test Time [s]", "Friction Force [N]", None),
    "fr_te67_PPS_60N_1.tsv": ("te67", (1801,), "Test Time [s]", "Friction Force [N]", None),
    "fr_te67_PPS_60N_2.tsv": ("te67", (1801,), "Test Time [s]", "Friction Force [N]", None),
    "ten_bam_42CrMoS4_46NT71.csv": ("bam", (768,), "Time [s]", "Force [kN]", "Displacement [mm]"),
    "ten_instron8852_de_semicolonline_tab.csv": ("bam", (712,), "Zeit [s]", "Kraft [kN]", "Maschine [mm]"),
    "ten_mts793_DEU_latin1_comma.dat": ("mts793", (1216,), "Laufzeit [s]", "Ch 1 Kraft [kN]", "Ch 1 Weg [mm]"),
    "ten_shimadzu_quoted_fr.csv": ("trapezium", (22387,), "Temps [sec]", "Force [N]", "Stroke [mm]"),
    "ten_walterbai_semicolon.csv": (
        "walterbai", (1667,), "C_1_Temps [s]", "C_1_Force [kN]", "C_1_Déplacement [mm]",
    ),
    "ten_zwick_fr_Allong1.TRA": ("testxpert", (2184,), "Temps [s]", "Force standard [N]", "Course standard [mm]"),
    "ten_zwick_testxpert_de_tab.csv": (
        "testxpert", (18876,), "Prüfzeit [s]", "Standardkraft [N]", "Standardweg [mm]",
    ),
}  # fmt: skip
# file: what must be given, and how
REFUSED = {
    "fr_afm_trace_retrace_profile.txt": ("without names", {"time": "#1 [s]", "force": "#2 [N]"}),
    "fr_csm_trib_c1.csv": ("has no units", {"time": "Time [s]", "force": "FrictionForce [N]"}),
    "fr_csm_trib_c2.csv": ("has no units", {"time": "Time [s]", "force": "FrictionForce [N]"}),
    **{
        f"fr_newport_1rps{load}N.txt": ("give the lever arm", {"force": "#4 [N m / 2.6667 mm]"})
        for load in ("0-3", "1", "3", "5", "10", "15")
    },
    **{
        f"fr_paper_stickslip_{name}.mat": ("have no units", {"time": "t [s]", "force": "Fnorm [30.7 gf]"})
        for name in ("k168Nm_v42", "k168Nm_v1100", "k1002Nm_v4300")
    },
}


@pytest.fixture(scope="module")
def exports(shared: Path) -> Path:
    folder = shared / "exports"
    if not folder.is_dir():
        pytest.skip("no real exports beside this checkout")
    return folder


@in_one_test(READ)
def test_every_export_is_read_to_the_right_columns(exports: Path, name: str) -> None:
    family, sizes, time, force, displacement = READ[name]
    traces = read_blocks(exports / name)
    assert tuple(t.time_s.size for t in traces) == sizes
    for trace in traces:
        assert trace.source is not None
        assert trace.source.family == family
        taken = trace.source.columns
        assert (taken["time"], taken["friction force"], taken.get("displacement")) == (time, force, displacement)
        assert np.all(np.diff(trace.time_s) >= 0)
        assert np.isfinite(trace.force_N).all()


@in_one_test(REFUSED)
def test_every_export_that_does_not_say_enough_is_refused_with_what_to_give(exports: Path, name: str) -> None:
    sentence, columns = REFUSED[name]
    with pytest.raises(ReadError, match=sentence):
        read_export(exports / name)
    seen = inspect_export(exports / name)
    assert seen.refused
    assert sentence in seen.in_words()
    assert read_export(exports / name, columns=columns).time_s.size > 20


def test_units_of_the_tensile_exports_are_si(exports: Path) -> None:
    """Largest forces and travels against what the raw cells say in their own unit."""
    zwick = read_export(exports / "ten_zwick_testxpert_de_tab.csv")
    assert zwick.force_N.max() == pytest.approx(86.5222)
    assert zwick.displacement_m is not None
    assert zwick.displacement_m[-1] == pytest.approx(0.247389)
    bam = read_export(exports / "ten_bam_42CrMoS4_46NT71.csv")
    assert bam.force_N[0] == pytest.approx(117.967)
    assert bam.displacement_m is not None
    assert bam.displacement_m[-1] == pytest.approx(3.757264381767434e-3)
    compression = read_blocks(exports / "ten_mts793_DEU_latin1_comma.dat")[0]
    assert compression.force_N[0] == pytest.approx(-1571.9645)
    walterbai = read_export(exports / "ten_walterbai_semicolon.csv")
    assert walterbai.force_N[0] == pytest.approx(2.871407661587)


def _late(trace: Trace) -> np.ndarray:
    return np.abs(trace.force_N[trace.force_N.size // 2 :])


@in_one_test(
    [("001", (134, 173), (0.67, 0.87)), ("050", (137, 171), (0.69, 0.85))],
)
def test_both_strokes_of_the_umt_have_their_friction(
    exports: Path, stroke: str, means_gf: tuple[float, float], coefficients: tuple[float, float]
) -> None:
    traces = read_blocks(exports / f"fr_cetr_umt2_2N_stroke{stroke}.csv")
    assert [_late(t).mean() / GRAM_FORCE for t in traces] == pytest.approx(means_gf, abs=0.6)
    for trace, expected in zip(traces, coefficients, strict=True):
        normal = np.abs(trace.columns["normal_force_N"][trace.force_N.size // 2 :])
        assert (_late(trace) / normal).mean() == pytest.approx(expected, abs=0.0055)
    assert np.sign([np.mean(t.force_N[t.force_N.size // 2 :]) for t in traces]).tolist() == [-1.0, 1.0]


@in_one_test(
    [
        ("PPS_60N_1", 59.841, 9.7, 7.16, 0.32),
        ("PPS_60N_2", 59.841, 15.4, 8.05, 0.39),
        ("PPS_100N_1", 98.1, 18.1, 13.86, 1.78),
    ],
)
def test_pin_on_disc_runs_have_their_friction(
    exports: Path, name: str, load_N: float, highest_N: float, mean_N: float, sd_N: float
) -> None:
    trace = read_export(exports / f"fr_te67_{name}.tsv")
    assert trace.columns["normal_force_N"].mean() == pytest.approx(load_N)
    assert trace.force_N[trace.time_s < trace.time_s[0] + 60].max() == pytest.approx(highest_N)
    assert (_late(trace).mean(), _late(trace).std()) == pytest.approx((mean_N, sd_N), abs=0.0051)


@in_one_test(
    [("c1", 0.401), ("c2", 0.409)])
def test_friction_over_load_of_the_csm_runs_is_three_newton(exports: Path, name: str, mean: float) -> None:
    columns = {"time": "Time [s]", "force": "FrictionForce [N]", "friction_coefficient": "#4"}
    trace = read_export(exports / f"fr_csm_trib_{name}.csv", columns=columns)
    assert trace.columns["friction_coefficient"].mean() == pytest.approx(mean, abs=5e-4)
    ratio = trace.force_N / trace.columns["friction_coefficient"]
    assert np.median(ratio) == pytest.approx(3.0, abs=1e-3)


@in_one_test(
    [("k168Nm_v42", 0.304), ("k168Nm_v1100", 0.334), ("k1002Nm_v4300", 0.292)],
)
def test_paper_on_paper_has_its_friction(exports: Path, name: str, mean: float) -> None:
    time, ratio = _paper_on_paper(exports, name)
    assert ratio.mean() == pytest.approx(mean, abs=5e-4)
    assert 1 / np.median(np.diff(time)) == pytest.approx(2000, rel=1e-3)


def test_paper_on_paper_scatters_when_pulled_fast_and_rises_with_the_spring_when_pulled_slowly(exports: Path) -> None:
    """Standard deviations as published; stick phases rise at k v / (m g), 168 N/m pulled at 42 um/s, 30.7 g."""
    for name, sd in (("k168Nm_v1100", 0.037), ("k1002Nm_v4300", 0.050)):
        assert _paper_on_paper(exports, name)[1].std() == pytest.approx(sd, abs=5e-4)
    time, ratio = _paper_on_paper(exports, "k168Nm_v42")
    step = round(0.2 / float(np.median(np.diff(time))))
    slopes = (ratio[step::step] - ratio[:-step:step]) / (time[step::step] - time[:-step:step])
    assert np.median(slopes[slopes > 0]) == pytest.approx(168 * 42e-6 / (0.0307 * 9.80665), rel=0.03)


def _paper_on_paper(exports: Path, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Time and the ratio of friction to weight."""
    columns = {"time": "t [s]", "force": "Fnorm [30.7 gf]"}
    trace = read_export(exports / f"fr_paper_stickslip_{name}.mat", columns=columns)
    return trace.time_s, trace.force_N / (30.7 * GRAM_FORCE)


@in_one_test([*READ, *REFUSED])
def test_inspection_says_what_a_file_is_and_there_is_no_other(exports: Path, name: str) -> None:
    assert {path.name for path in exports.iterdir()} == {*READ, *REFUSED, "INDEX.md"}
    seen = inspect_export(exports / name)
    assert seen.refused == (name in REFUSED)
    assert seen.family
    assert seen.encoding
    assert seen.record()["columns"]
    if name in READ:
        assert {c.quantity for c in seen.columns} >= {"time", "friction force"}
        assert all(c.reason for c in seen.columns if c.quantity)
        assert sum(t.rows for t in seen.tables) == sum(READ[name][1])
    if name == "ten_zwick_fr_Allong1.TRA":  # a tensile test lacks what a pull has
        assert {d.kind for d in seen.doubts} >= {"no_zero_phase", "time_gap"}
        assert any("no normal load" in text for text in seen.missing)
