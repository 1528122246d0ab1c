"""What is written in a table is read back in SI units, whatever the dialect."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings, strategies as st
from support.campaigns import MadeCampaign

from tribo.errors import ReadError
from tribo.readers import READERS, columns_from_text, inspect_export, read_export

from .tables import Dialect, ramp, written

FIXTURE_IS_FINE = settings(deadline=None, max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture])
NAMES = ("Time", "Extension", "Load")
UNITS = ("s", "mm", "N")
TO_SI = {
    "time": {"s": 1.0, "ms": 1e-3, "min": 60.0, "sec": 1.0},
    "displacement": {"mm": 1e-3, "um": 1e-6, "µm": 1e-6, "m": 1.0, "cm": 1e-2},
    "friction force": {"N": 1.0, "mN": 1e-3, "kN": 1e3, "gf": 9.80665e-3, "cN": 1e-2},
}
SPELLED = {
    "time": ("Time", "Prüfzeit", "Temps", "Test Time"),
    "displacement": ("Extension", "Standardweg", "Crosshead", "Displacement", "Course standard"),
    "friction force": ("Load", "Standardkraft", "Force standard", "Friction Force", "Fx"),
}


@st.composite
def tables(draw: st.DrawFn) -> tuple[bytes, dict[str, np.ndarray]]:
    """An export of random dialect, columns in random order, and what is in it in SI units."""
    quantities = draw(st.permutations(list(TO_SI)))
    n = draw(st.integers(3, 40))
    decimals = draw(st.integers(2, 6))
    steps = draw(st.lists(st.integers(1, 10**4), min_size=n, max_size=n))
    values = {
        "time": np.cumsum(steps) / 100.0,
        "displacement": np.array(draw(st.lists(st.floats(-1e3, 1e3), min_size=n, max_size=n))),
        "friction force": np.array(draw(st.lists(st.floats(-1e4, 1e4), min_size=n, max_size=n))),
    }
    texts = {q: [f"{v:.{decimals}f}" for v in values[q]] for q in quantities}
    # 1.000 may be a thousand: a table with nothing but such numbers is refused, as tests/readers/test_shapes.py states
    assume(not all(re.fullmatch(r"-?[1-9]\d{0,2}\.\d{3}", text) for column in texts.values() for text in column))
    names = [draw(st.sampled_from(SPELLED[q])) for q in quantities]
    units = [draw(st.sampled_from(sorted(TO_SI[q]))) for q in quantities]
    delimiter = draw(st.sampled_from(",;\t|"))
    quoted = draw(st.booleans())
    dialect = Dialect(
        delimiter=delimiter,
        decimal=draw(st.sampled_from(",.")) if delimiter != "," or quoted else ".",
        encoding=draw(st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "cp1252", "latin-1"])),
        line_end=draw(st.sampled_from(["\n", "\r\n", "\r"])),
        quoted=quoted,
        units_row=draw(st.booleans()),
        brackets=draw(st.sampled_from(["()", "[]", ""])),
        above=tuple(draw(st.lists(st.sampled_from(["Specimen 3", "# made by hand", "", "Rate: 12"]), max_size=4))),
        last_line_end=draw(st.booleans()),
    )
    rows = [[texts[q][k] for q in quantities] for k in range(n)]
    factors = {q: TO_SI[q][u] for q, u in zip(quantities, units, strict=True)}
    in_si = {q: np.array([float(t) for t in texts[q]]) * factors[q] for q in quantities}
    return written(rows, names, units, dialect), in_si


@FIXTURE_IS_FINE
@given(tables())
def test_any_dialect_reads_back_to_the_same_numbers(tmp_path: Path, table: tuple) -> None:
    data, in_si = table
    path = tmp_path / "table.txt"
    path.write_bytes(data)
    trace = read_export(path)
    np.testing.assert_allclose(trace.time_s, in_si["time"], rtol=1e-15)
    np.testing.assert_allclose(trace.force_N, in_si["friction force"], rtol=1e-15)
    assert trace.displacement_m is not None
    np.testing.assert_allclose(trace.displacement_m, in_si["displacement"], rtol=1e-15)


def _by_hand(path: Path, skip: int, delimiter: str, encoding: str) -> np.ndarray:
    with path.open(encoding=encoding, newline="") as stream:
        rows = list(csv.reader(stream, delimiter=delimiter))[skip:]
    return np.array([[float(c.replace(",", ".")) for c in row] for row in rows]).T


@pytest.mark.parametrize(
    ("family", "skip", "delimiter", "encoding", "order", "factors"),
    [
        ("bluehill", 4, ",", "ascii", (0, 1, 2), (1.0, 1e-3, 1.0)),
        ("testxpert", 3, ";", "cp1252", (0, 1, 2), (1.0, 1e-3, 1e-3)),
        ("testsuite", 5, "\t", "utf-8-sig", (0, 1, 2), (1.0, 1e-3, 1.0)),
        ("delimited", 2, ",", "ascii", (2, 1, 0), (1e-3, 1e-6, 9.80665e-3)),
    ],
)
def test_whole_pulls_in_four_dialects_read_exactly(
    made: Callable[[str], MadeCampaign],
    family: str,
    skip: int,
    delimiter: str,
    encoding: str,
    order: tuple[int, int, int],
    factors: tuple[float, float, float],
) -> None:
    paths = sorted((made(family).folder / "raw").iterdir())[::20]
    for path in paths:
        table = _by_hand(path, skip, delimiter, encoding)
        trace = read_export(path)
        assert trace.source is not None
        assert (trace.source.family, trace.source.encoding, trace.source.header_rows) == (
            family,
            encoding,
            skip,
        )
        np.testing.assert_array_equal(trace.time_s, table[order[0]] * factors[0])
        np.testing.assert_array_equal(trace.displacement_m, table[order[1]] * factors[1])
        np.testing.assert_array_equal(trace.force_N, table[order[2]] * factors[2])


def test_a_large_table_and_a_small_one_round_numbers_alike(tmp_path: Path) -> None:
    """Small tables go through numpy, large ones through pandas: both must give the nearest double."""
    rng = np.random.default_rng(7)
    force = [f"{v:.9f}" for v in rng.normal(size=20_000)]
    rows = [[f"{0.001 * k:.3f}", f"{0.1 * k:.4f}", f] for k, f in enumerate(force)]
    path = tmp_path / "large.csv"
    path.write_bytes(written(rows, NAMES, UNITS))
    assert path.stat().st_size > 300_000
    np.testing.assert_array_equal(read_export(path).force_N, np.array([float(f) for f in force]))


def test_the_header_of_the_file_is_kept_as_metadata(tmp_path: Path) -> None:
    above = ('"Specimen label","T0007"', '"Rate 1","12.000","mm/min"', "")
    path = tmp_path / "a.csv"
    path.write_bytes(written(ramp(), NAMES, UNITS, Dialect(quoted=True, above=above)))
    assert read_export(path).metadata == {"Specimen label": "T0007", "Rate 1": "12.000 mm/min"}


def test_how_a_file_was_read_stands_in_the_trace(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_bytes(written(ramp(), NAMES, UNITS, Dialect(delimiter=";", decimal=",")))
    trace = read_export(path, name="T0001", file="raw/a.txt")
    assert trace.source is not None
    assert (trace.source.delimiter, trace.source.decimal) == (";", ",")
    assert trace.source.columns == {
        "time": "Time [s]",
        "displacement": "Extension [mm]",
        "friction force": "Load [N]",
    }
    assert (trace.name, trace.file) == ("T0001", "raw/a.txt")


def test_further_quantities_come_along_in_si_units(tmp_path: Path) -> None:
    rows = [[*row, "25.0"] for row in ramp()]
    path = tmp_path / "a.csv"
    path.write_bytes(written(rows, (*NAMES, "Normal force"), (*UNITS, "cN")))
    assert read_export(path).columns["normal_force_N"] == pytest.approx(0.25)


@pytest.mark.parametrize("unit", ["°F", "F"])
def test_degrees_fahrenheit_are_read_as_degrees_celsius(tmp_path: Path, unit: str) -> None:
    """Water freezes at 32 degrees F and boils at 212; a unit with an offset is converted by both its numbers."""
    rows = [[*row, fahrenheit] for row, fahrenheit in zip(ramp(9), ["32.0", "212.0", "73.4"] * 3, strict=True)]
    path = tmp_path / "a.csv"
    path.write_bytes(written(rows, (*NAMES, "Temperature"), (*UNITS, unit)))
    assert read_export(path).columns["temperature_C"] == pytest.approx([0.0, 100.0, 23.0] * 3, abs=1e-9)


def test_columns_override_names_and_units(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes(written(ramp(), ("Clock", "Extension", "Channel 7"), ("s", "mm", "V")))
    trace = read_export(path, columns={"time": "Clock", "force": "Channel 7 [mN]", "displacement": "#2 [um]"})
    assert trace.force_N[5] == pytest.approx(0.047e-3)
    assert trace.displacement_m is not None
    assert trace.displacement_m[5] == pytest.approx(0.04e-6)
    assert trace.source is not None
    assert trace.source.reasons["friction force"] == "asked for by name"


def test_a_file_without_names_is_read_by_position(tmp_path: Path) -> None:
    path = tmp_path / "bare.txt"
    path.write_bytes(b"\n".join("\t".join(row).encode() for row in ramp()))
    with pytest.raises(ReadError) as caught:
        read_export(path)
    assert {p.kind for p in caught.value.problems} == {"missing_column"}
    trace = read_export(path, columns={"time": "#1 [s]", "force": "#3 [N]"})
    assert trace.force_N.size == 20


def test_every_family_stands_in_the_table_with_a_sentence() -> None:
    assert list(READERS)[-1] == "delimited"
    assert all(name == family.name and family.text for name, family in READERS.items())


def test_columns_of_a_command_line_are_split_at_the_right_commas() -> None:
    text = "time=Clock, total [s], friction_force = #3 [N m / 2,5 mm],displacement=x=y [mm]"
    assert columns_from_text(text) == {
        "time": "Clock, total [s]",
        "friction_force": "#3 [N m / 2,5 mm]",
        "displacement": "x=y [mm]",
    }
    with pytest.raises(ReadError, match="QUANTITY=COLUMN"):
        columns_from_text("time")


def test_inspection_of_a_damaged_export_still_says_its_columns(tmp_path: Path) -> None:
    rows = ramp()
    rows[4][2] = "O.1"
    path = tmp_path / "a.csv"
    path.write_bytes(written(rows, NAMES, UNITS))
    seen = inspect_export(path)
    assert seen.refused
    assert [c.quantity for c in seen.columns] == ["time", "displacement", "friction force"]
    assert [p.kind for p in seen.problems] == ["text_in_numbers"]
    assert not seen.advice
    assert "row 7" in seen.in_words()


def test_inspection_says_in_one_sentence_what_to_give(tmp_path: Path) -> None:
    path = tmp_path / "bare.txt"
    path.write_bytes(b"\n".join(b"\t".join(cell.encode() for cell in row) for row in ramp()))
    assert inspect_export(path).advice == 'in columns: time = "#1 [unit]", friction_force = "#2 [unit]"'
    assert not inspect_export(path, columns={"time": "#1 [s]", "force": "#3 [N]"}).refused


def test_inspection_names_other_columns_that_would_do(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes(written([[*row, row[2]] for row in ramp()], (*NAMES, "Force"), (*UNITS, "N")))
    seen = inspect_export(path)
    assert any(d.kind == "other_candidate" and "Force" in d.what for d in seen.doubts)
    assert {c.quantity: c.name for c in seen.columns if c.quantity}["friction force"] == "Load"


def test_inspection_never_raises_for_what_is_not_there(tmp_path: Path) -> None:
    seen = inspect_export(tmp_path / "none.csv")
    assert [p.kind for p in seen.problems] == ["missing"]
    assert seen.record()["refused"] is True
