"""Every kind of damage is named with its row and column, and nothing changes silently."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st
from support.campaigns import DIALECTS as MADE_DIALECTS, MadeCampaign

from tribo.errors import Problem, ReadError
from tribo.readers import read_export
from tribo.readers.checks import check_scale

from .tables import Dialect, ramp, written

NAMES = ("Time", "Extension", "Load")
UNITS = ("s", "mm", "N")
HEADER_ROWS = 2
DIALECTS = {
    "quoted": Dialect(quoted=True, line_end="\r\n"),
    "semicolon": Dialect(delimiter=";", decimal=","),
    "tab": Dialect(delimiter="\t", encoding="utf-8-sig"),
    "plain": Dialect(),
}


def problems_of(path: Path, data: bytes) -> tuple[Problem, ...]:
    path.write_bytes(data)
    with pytest.raises(ReadError) as caught:
        read_export(path)
    assert all(p.file == str(path) for p in caught.value.problems)
    return caught.value.problems


@pytest.fixture(params=DIALECTS)
def dialect(request: pytest.FixtureRequest) -> Dialect:
    return DIALECTS[request.param]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "T1.csv"


def test_an_empty_file_is_empty(path: Path) -> None:
    assert problems_of(path, b"")[0].kind == "empty"
    assert problems_of(path, b" \r\n\n")[0].kind == "empty"


def test_a_byte_order_mark_alone_is_no_export(path: Path) -> None:
    assert problems_of(path, b"\xef\xbb\xbf")[0].kind == "bom_only"
    assert problems_of(path, b"\xff\xfe")[0].kind == "bom_only"


def test_a_missing_file_is_missing(path: Path) -> None:
    with pytest.raises(ReadError) as caught:
        read_export(path)
    assert caught.value.problems[0].kind == "missing"


def test_a_header_without_rows_is_named_with_its_row(path: Path, dialect: Dialect) -> None:
    found = problems_of(path, written([], NAMES, UNITS, dialect))
    assert [(p.kind, p.row) for p in found] == [("header_only", 1)]


def test_a_note_is_no_export(path: Path) -> None:
    assert problems_of(path, b"call the supplier\nbefore noon\n")[0].kind == "not_an_export"


def test_a_binary_file_is_no_export(path: Path) -> None:
    assert problems_of(path, b"\x89PNG\r\n\0\0\0\r1234")[0].kind == "binary"


@pytest.mark.parametrize("keep", [5, 9, 15])
def test_a_last_row_that_breaks_off_is_truncated(path: Path, dialect: Dialect, keep: int) -> None:
    whole = written(ramp(), NAMES, UNITS, dialect)
    end = dialect.line_end.encode()
    start = whole.rstrip().rfind(end) + len(end)
    found = problems_of(path, whole[: start + keep])
    assert [(p.kind, p.row) for p in found] == [("truncated_mid_row", HEADER_ROWS + 20)]


def test_a_last_number_cut_short_is_truncated_where_all_others_have_more_digits(path: Path) -> None:
    whole = written(ramp(), NAMES, UNITS, Dialect(last_line_end=False))
    found = problems_of(path, whole[:-2])
    assert [(p.kind, p.row, p.column) for p in found] == [("truncated_mid_row", 22, "Load")]


def test_letters_in_numbers_are_each_named(path: Path, dialect: Dialect) -> None:
    rows = ramp()
    rows[3][2] = rows[3][2].replace("0", "O")
    rows[7][0] = rows[7][0].replace("0", "O", 1)
    found = problems_of(path, written(rows, NAMES, UNITS, dialect))
    assert [(p.kind, p.row, p.column) for p in found] == [
        ("text_in_numbers", HEADER_ROWS + 4, "Load"),
        ("text_in_numbers", HEADER_ROWS + 8, "Time"),
    ]


def test_letters_in_the_first_row_do_not_turn_it_into_a_header(path: Path, dialect: Dialect) -> None:
    rows = ramp()
    rows[0][1] = "0.0O000"
    found = problems_of(path, written(rows, NAMES, UNITS, dialect))
    assert [(p.kind, p.row, p.column) for p in found] == [("text_in_numbers", HEADER_ROWS + 1, "Extension")]


@pytest.mark.parametrize("nothing", ["NaN", "", "n/a", "inf"])
def test_a_gap_is_one_problem_with_its_first_row_and_length(path: Path, dialect: Dialect, nothing: str) -> None:
    rows = ramp()
    for k in range(6, 11):
        rows[k][2] = nothing
    found = problems_of(path, written(rows, NAMES, UNITS, dialect))
    assert [(p.kind, p.row, p.column) for p in found] == [("nan_gap", HEADER_ROWS + 7, "Load")]
    assert found[0].what.startswith("5 rows")


@pytest.mark.parametrize("change", [lambda row: row[:2], lambda row: [*row, "1.0"]])
def test_a_row_of_another_length_is_named(path: Path, dialect: Dialect, change: Callable) -> None:
    rows = ramp()
    rows[9] = change(rows[9])
    found = problems_of(path, written(rows, NAMES, UNITS, dialect))
    assert [(p.kind, p.row) for p in found] == [("wrong_number_of_cells", HEADER_ROWS + 10)]


@pytest.mark.parametrize("n", [30, 20_000])
def test_a_short_row_is_named_even_where_a_long_one_makes_up_for_it(path: Path, n: int) -> None:
    """Columns that are not used count as well: a missing cell shifts those behind it."""
    rows = [[f"{k}", "7", f"{0.04 * k:.3f}", f"{0.01 * k:.5f}"] for k in range(n)]
    rows[9] = [rows[9][0], *rows[9][2:]]
    rows[15] = ["0", *rows[15]]
    found = problems_of(path, written(rows, ("No", "State", "Time", "Load"), ("", "", "s", "N")))
    assert [(p.kind, p.row) for p in found] == [
        ("wrong_number_of_cells", HEADER_ROWS + 10),
        ("wrong_number_of_cells", HEADER_ROWS + 16),
    ]


def test_blank_lines_and_delimiters_in_quotes_are_no_damage(path: Path) -> None:
    rows = [f'{0.04 * k:.3f},"held, then pulled",{0.01 * k:.3f}' for k in range(20)]
    rows.insert(7, "")
    rows += [",,", ",,"]
    path.write_text("\n".join(["Time (s),Phase,Load (N)", *rows]) + "\n")
    np.testing.assert_allclose(read_export(path).force_N, 0.01 * np.arange(20))


def test_time_that_runs_back_is_named_at_the_first_earlier_row(path: Path, dialect: Dialect) -> None:
    rows = ramp()
    found = problems_of(path, written(rows[:12] + rows[6:], NAMES, UNITS, dialect))
    assert [(p.kind, p.row) for p in found] == [("time_goes_back", HEADER_ROWS + 13)]


def test_repeated_times_are_read_and_flagged(path: Path) -> None:
    rows = ramp()
    rows[5][0] = rows[4][0]
    path.write_bytes(written(rows, NAMES, UNITS))
    assert "time_repeats" in read_export(path).flags


def test_rows_of_a_clock_in_whole_seconds_are_spread_over_each_second(path: Path) -> None:
    rows = [[f"{k // 4}", f"{0.1 * k:.3f}", f"{0.01 * k:.4f}"] for k in range(40)]
    path.write_bytes(written(rows, NAMES, UNITS))
    trace = read_export(path)
    assert "coarse_clock" in trace.flags
    np.testing.assert_allclose(trace.time_s, 0.25 * np.arange(40))


def test_rows_that_are_there_twice_keep_the_times_of_the_record(path: Path) -> None:
    rows = [row for row in ramp() for _ in (1, 2)]
    once = [float(row[0]) for row in ramp()]
    path.write_bytes(written(rows, NAMES, UNITS))
    trace = read_export(path)
    assert "coarse_clock" in trace.flags
    np.testing.assert_allclose(trace.time_s[::2], once)


@pytest.mark.parametrize("number", ["1.234,5", "1,234.5", "1.2.3"])
def test_two_decimal_marks_in_a_number_are_named(path: Path, number: str) -> None:
    rows = ramp()
    rows[4][2] = number
    text = "\n".join(["Time\tExtension\tLoad", "s\tmm\tN", *("\t".join(r) for r in rows)]) + "\n"
    found = problems_of(path, text.encode())
    assert [(p.kind, p.row, p.column, p.found) for p in found] == [("two_decimal_marks", 7, "Load", number)]


def test_a_point_in_a_table_of_decimal_commas_is_named(path: Path) -> None:
    rows = ramp()
    data = written(rows, NAMES, UNITS, DIALECTS["semicolon"]).replace(b";0,02700", b";0.02700")
    assert [(p.kind, p.row) for p in problems_of(path, data)] == [("two_decimal_marks", 6)]


def test_a_comma_that_is_both_delimiter_and_decimal_mark_is_refused(path: Path) -> None:
    data = written(ramp(), NAMES, UNITS, Dialect(delimiter=",", decimal=","))
    assert problems_of(path, data)[0].kind == "decimal_is_delimiter"


@pytest.mark.parametrize("unit", ["foo", "mm", "V"])
def test_an_unknown_unit_is_an_error_with_row_and_column(path: Path, unit: str) -> None:
    found = problems_of(path, written(ramp(), NAMES, ("s", "mm", unit)))
    assert [(p.kind, p.row, p.column, p.found) for p in found] == [("unknown_unit", 2, "Load", unit)]


def test_a_missing_unit_is_an_error_and_all_faults_come_at_once(path: Path) -> None:
    found = problems_of(path, written(ramp(), NAMES, ("", "furlongs per day", "N")))
    assert {(p.kind, p.column) for p in found} == {("missing_unit", "Time"), ("unknown_unit", "Extension")}


@pytest.mark.parametrize(
    ("names", "row"),
    [
        ("Time (s),Load (N)", "{k},{t},{f}"),  # a row number without a name, as R writes it
        ("Time (s),Load, filtered (N),Extension (mm)", "{t},{f},{x}"),
        ("Time  Axial Force  Axial Displacement", "{t} {f} {x} 1"),
    ],
)
def test_names_that_do_not_stand_over_their_columns_are_refused(path: Path, names: str, row: str) -> None:
    rows = [row.format(k=k + 1, t=f"{0.1 * k:.2f}", f=f"{0.01 * k:.3f}", x=f"{0.02 * k:.3f}") for k in range(9)]
    found = problems_of(path, "\n".join([names, *rows, ""]).encode())
    assert (found[0].kind, found[0].row) == ("names_do_not_fit", 1)
    assert read_export(path, columns={"time": "#1 [s]", "force": "#2 [N]"}).force_N.size == 9


def test_names_of_several_words_may_stand_between_blanks(path: Path) -> None:
    rows = [f"{0.1 * k:.2f}   {0.01 * k:.3f}   {0.02 * k:.3f}" for k in range(9)]
    path.write_text("\n".join(["Time      Axial Force   Axial Displacement", "s   N   mm", *rows]))
    trace = read_export(path)
    np.testing.assert_allclose(trace.force_N, 0.01 * np.arange(9))
    assert trace.displacement_m is not None
    np.testing.assert_allclose(trace.displacement_m, 0.02e-3 * np.arange(9))


def test_a_missing_column_says_how_to_name_it(path: Path) -> None:
    found = problems_of(path, written(ramp(), ("Time", "Extension", "Voltage"), ("s", "mm", "V")))
    assert [p.kind for p in found] == ["missing_column"]
    assert "friction_force =" in (found[0].allowed or "")
    assert "Voltage" in (found[0].allowed or "")


def test_an_override_that_names_nothing_offers_the_nearest_column(path: Path) -> None:
    path.write_bytes(written(ramp(), NAMES, UNITS))
    with pytest.raises(ReadError, match="did you mean Load"):
        read_export(path, columns={"force": "Laod [N]"})
    with pytest.raises(ReadError, match="did you mean displacement"):
        read_export(path, columns={"displacment": "Extension"})


@pytest.mark.parametrize("factor", [10.0, 0.1])
def test_a_stretch_ten_times_off_its_neighbours_is_named(path: Path, dialect: Dialect, factor: float) -> None:
    rows = ramp(40)
    for k in range(20, 27):
        rows[k][2] = f"{float(rows[k][2]) * factor:.5f}"
    found = problems_of(path, written(rows, NAMES, UNITS, dialect))
    assert [(p.kind, p.row, p.column) for p in found] == [("scale_jump", HEADER_ROWS + 21, "Load [N]")]


def pulled(rng: np.random.Generator) -> np.ndarray:
    """Force of 300 samples: zero, a rise, a peak, sliding, with noise."""
    k = np.arange(300)
    return np.interp(k, [0, 60, 100, 110, 299], [0.02, 0.02, 1.0, 0.7, 0.7]) + 0.01 * rng.standard_normal(300)


@pytest.mark.parametrize("times", [10.0, 0.1, 100.0, 0.01, 1000.0, 0.001])
@pytest.mark.parametrize("start", [85, 150, 280])
def test_a_decimal_mark_that_slips_for_good_is_named_with_its_row(path: Path, times: float, start: int) -> None:
    force = pulled(np.random.default_rng(start))
    force[start:] *= times
    found = problems_of(
        path, written([[f"{0.04 * k:.3f}", "0", f"{f:.5f}"] for k, f in enumerate(force)], NAMES, UNITS)
    )
    assert [(p.kind, p.row, p.column) for p in found] == [("scale_jump", HEADER_ROWS + start + 1, "Load [N]")]


@pytest.mark.parametrize("left", [0.0, 0.07, 0.1, -0.1])
def test_a_force_that_falls_to_a_tenth_keeps_its_noise_and_is_no_slipped_mark(path: Path, left: float) -> None:
    rng = np.random.default_rng(7)
    force = pulled(rng)
    force[200:] = left * 0.7 + 0.01 * rng.standard_normal(100)
    path.write_bytes(written([[f"{0.04 * k:.3f}", "0", f"{f:.5f}"] for k, f in enumerate(force)], NAMES, UNITS))
    assert read_export(path).flags == ()


@pytest.mark.parametrize("stops", [False, True])
def test_a_rest_with_an_offset_and_a_slide_about_ten_times_as_large_are_no_slipped_mark(
    path: Path, stops: bool
) -> None:
    for seed in range(40):
        rng = np.random.default_rng(seed)
        rest, slide = 0.1 + 0.003 * rng.standard_normal(200), 0.011 * rng.standard_normal(300)  # as rough as 4 times
        slide += float(rng.choice([0.93, 1.07]))
        force = np.concatenate((rest, slide, rest[:100] if stops else rest[:0]))
        rows = [[f"{0.04 * k:.3f}", "0", f"{f:.5f}"] for k, f in enumerate(force)]
        path.write_bytes(written(rows, NAMES, UNITS))
        assert read_export(path).flags == (), seed


def test_a_reversal_that_one_sample_shows_half_way_is_no_slipped_mark() -> None:
    """The drive stands before the strokes turn, so that the force is ten times as rough after the turn as before it."""
    for seed in range(40):
        rng = np.random.default_rng([seed, 5])
        rest, slide = 0.005 * rng.standard_normal(200) - 3.36, 0.05 * rng.standard_normal(400) + 3.5
        force = np.concatenate((-slide, rest, [rng.uniform(0.3, 0.42)], slide))
        assert check_scale(force, "a.csv", "force", int) == [], seed


def test_two_impulses_are_no_stretch_between_them(path: Path) -> None:
    force = pulled(np.random.default_rng(3))
    force[[180, 200]] *= 10
    path.write_bytes(written([[f"{0.04 * k:.3f}", "0", f"{f:.5f}"] for k, f in enumerate(force)], NAMES, UNITS))
    assert read_export(path).flags == ()


def test_one_sample_ten_times_off_is_a_spike_and_not_for_the_reader(path: Path) -> None:
    rows = ramp(40)
    rows[20][2] = f"{float(rows[20][2]) * 10:.5f}"
    path.write_bytes(written(rows, NAMES, UNITS))
    assert read_export(path).flags == ()


def test_a_tenfold_load_for_a_while_is_no_slipped_decimal_mark(path: Path) -> None:
    load = [10.0 if 10 <= k < 20 else 1.0 for k in range(30)]
    rows = [[f"{0.1 * k:.2f}", f"{0.3 * n:.3f}", f"{n:.2f}"] for k, n in enumerate(load)]
    path.write_bytes(written(rows, ("Time", "Fx", "Fz"), ("s", "N", "N")))
    assert read_export(path).flags == ()
    without_load = [row[:2] for row in rows]
    found = problems_of(path, written(without_load, ("Time", "Fx"), ("s", "N")))
    assert [p.kind for p in found] == ["scale_jump"]


def test_a_gap_in_time_is_read_and_flagged_with_its_row(path: Path) -> None:
    rows = ramp(40)
    path.write_bytes(written(rows[:20] + rows[30:], NAMES, UNITS))
    trace = read_export(path)
    assert trace.flags == ("time_gap",)
    assert [(p.kind, p.row, p.column) for p in trace.problems] == [("time_gap", HEADER_ROWS + 21, "Time [s]")]


def test_wherever_an_export_breaks_off_it_is_noticed(path: Path, dialect: Dialect) -> None:
    """Cut at every byte of the last rows; only a cut between two rows leaves a whole export."""
    whole = written(ramp(), NAMES, UNITS, dialect)
    text = whole.rstrip()
    for cut in range(len(text) - 60, len(text)):
        between_rows = whole[cut - 1 : cut] in b"\r\n" or whole[cut : cut + 1] in b"\r\n"
        path.write_bytes(whole[:cut])
        if between_rows:
            read_export(path)
            continue
        with pytest.raises(ReadError) as caught:
            read_export(path)
        assert {p.kind for p in caught.value.problems} == {"truncated_mid_row"}


@pytest.fixture
def small_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    """Files above 2 kB count as large: they are mapped, and read in pieces of 1 kB."""
    monkeypatch.setattr("tribo.readers.source.MAPPED_BYTES", 2000)
    monkeypatch.setattr("tribo.readers.source.CHUNK_BYTES", 1000)


@pytest.mark.usefixtures("small_pieces")
def test_a_large_file_read_in_pieces_gives_the_same_numbers(path: Path, dialect: Dialect) -> None:
    rows = ramp(500)
    path.write_bytes(written(rows, NAMES, UNITS, dialect))
    np.testing.assert_array_equal(read_export(path).force_N, [float(row[2]) for row in rows])


@pytest.mark.usefixtures("small_pieces")
def test_damage_in_a_large_file_is_named_with_its_row(path: Path, dialect: Dialect) -> None:
    rows = ramp(500)
    rows[431][2] = "O.5"
    rows[77][0] = rows[76][0] = ""
    found = problems_of(path, written(rows, NAMES, UNITS, dialect))
    assert [(p.kind, p.row) for p in found] == [
        ("nan_gap", HEADER_ROWS + 77),
        ("text_in_numbers", HEADER_ROWS + 432),
    ]


@pytest.mark.usefixtures("small_pieces")
def test_a_large_file_without_line_ends_is_refused(path: Path) -> None:
    header = written(ramp(6), NAMES, UNITS)
    assert problems_of(path, header + b"1.0,2.0," * 3000)[0].kind == "wrong_number_of_cells"


def test_a_file_above_the_limit_is_refused_without_reading_it(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tribo.readers.source.LARGEST_FILE_BYTES", 100)
    assert [p.kind for p in problems_of(path, written(ramp(), NAMES, UNITS))] == ["too_large"]


SPOILS: dict[str, Callable[[list[bytes]], bytes]] = {
    "empty": lambda lines: b"",
    "bom_only": lambda lines: b"\xef\xbb\xbf",
    "header_only": lambda lines: b"".join(lines[: _header_rows(lines)]),
    "truncated_mid_row": lambda lines: b"".join(lines[:-40]) + lines[-40][:-9],
    "text_in_numbers": lambda lines: b"".join([*lines[:90], lines[90].replace(b"0", b"O"), *lines[91:]]),
    "time_goes_back": lambda lines: b"".join([*lines[:300], *lines[240:]]),
    "two_decimal_marks": lambda lines: b"".join([*lines[:90], _doubled_mark(lines[90]), *lines[91:]]),
}


def _first_export(campaign: Path) -> Path:
    return min((campaign / "raw").iterdir())


@pytest.mark.parametrize("made_in", MADE_DIALECTS)
@pytest.mark.parametrize("kind", SPOILS)
def test_a_spoiled_export_of_a_whole_pull_is_named_in_every_dialect(
    made: Callable[[str], MadeCampaign], path: Path, made_in: str, kind: str
) -> None:
    lines = _first_export(made(made_in).folder).read_bytes().splitlines(keepends=True)
    found = problems_of(path, SPOILS[kind](lines))
    assert {p.kind for p in found} == {kind}


def test_the_practice_exports_spoiled_are_named_in_every_dialect(practice: Callable[[str], Path], path: Path) -> None:
    found = {}
    for number in ("01", "02", "03", "04"):
        lines = _first_export(practice(number)).read_bytes().splitlines(keepends=True)
        found |= {(number, kind): {p.kind for p in problems_of(path, spoil(lines))} for kind, spoil in SPOILS.items()}
    assert found == {(number, kind): {kind} for number, kind in found}


def _header_rows(lines: list[bytes]) -> int:
    return next(k for k, line in enumerate(lines) if line.lstrip(b'"-')[:1].isdigit())


def _doubled_mark(line: bytes) -> bytes:
    """1.234 becomes 1.2.34 (or 1,2,34) in the last cell."""
    cut = line.rstrip(b'"\r\n')
    mark = b"," if b";" in line else b"."
    return cut[:-2] + mark + cut[-2:] + line[len(cut) :]


FUZZ = Path(__file__).parents[2] / "benchmarks" / "fuzz_readers.py"


def test_a_sample_of_the_mutants_of_the_benchmark_fails_nowhere(
    made: Callable[[str], MadeCampaign],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture,
) -> None:
    spec = importlib.util.spec_from_file_location("fuzz_readers", FUZZ)
    assert spec is not None
    assert spec.loader is not None
    fuzz = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, "fuzz_readers", fuzz)
    spec.loader.exec_module(fuzz)
    files = [str(_first_export(made(dialect).folder)) for dialect in MADE_DIALECTS]
    monkeypatch.setattr(sys, "argv", ["fuzz_readers", *files, "--mutants", "124", "--keep", str(tmp_path)])
    assert fuzz.main() == 0, capsys.readouterr().out


WHOLE = written(ramp(30), NAMES, UNITS, Dialect(quoted=True, above=("Specimen label,1",)))


@settings(deadline=None, max_examples=200, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_a_mutated_export_is_read_or_refused(tmp_path: Path, data: st.DataObject) -> None:
    mutant = bytearray(WHOLE)
    for _ in range(data.draw(st.integers(1, 6))):
        at = data.draw(st.integers(0, len(mutant) - 1))
        match data.draw(st.sampled_from(["change", "drop", "insert", "cut"])):
            case "change":
                mutant[at] = data.draw(st.integers(0, 255))
            case "drop":
                del mutant[at : at + data.draw(st.integers(1, 40))]
            case "insert":
                mutant[at:at] = data.draw(st.binary(min_size=1, max_size=20))
            case "cut":
                del mutant[at:]
        if not mutant:
            break
    path = tmp_path / "mutant.csv"
    path.write_bytes(bytes(mutant))
    try:
        trace = read_export(path)
    except ReadError:
        return
    assert trace.time_s.size == trace.force_N.size > 0
    assert np.isfinite(trace.force_N).all()


@pytest.mark.parametrize("least", [5e-324, 1e-320, 1e-300])
def test_forces_that_are_next_to_nothing_have_no_scale_to_compare_with(least: float) -> None:
    """Their ratio to others, or that of their changes, has no logarithm."""
    nothing = np.tile([least, 2 * least], 30)
    for values in (np.concatenate([nothing, np.ones(60)]), np.concatenate([np.ones(60), nothing])):
        assert check_scale(values, "a.csv", "force", int) == []
        assert check_scale(values + np.tile([0.0, 1e-5], 60), "a.csv", "force", int) == []
