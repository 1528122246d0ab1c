"""tests.csv: rows of cells by column name, for any delimiter, and errors of the table itself."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from tribo.errors import CampaignError, Problem, ReadError, system_problem
from tribo.escaping import is_control
from tribo.input_files import read_input
from tribo.limits import LARGEST_TABLE_BYTES, LONGEST_CELL, MOST_COLUMNS, MOST_TABLE_ROWS
from tribo.nearest import nearest
from tribo.sheets import OLD_EXCEL, ZIP, sheets_as_text

REQUIRED = ("test_id", "file", "sample")
LOADS = ("mass_g", "normal_load_N", "normal_stress_Pa")
NUMBERS = (
    "mass_g", "normal_load_N", "normal_stress_Pa", "speed_mm_s", "hold_s", "temperature_C", "humidity_pct",
    "stiffness_N_per_m",
    "sign", "gain", "lever_arm_mm", "sampling_rate_Hz", "static_N", "static_u_N", "sliding_N", "sliding_u_N",
    "static_mu", "static_mu_u", "sliding_mu", "sliding_mu_u", "coefficient", "coefficient_u",
)  # fmt: skip
EVALUATED = ("static_N", "sliding_N", "static_mu", "sliding_mu", "coefficient")
COUNTS = ("repeat", "run_order", "specimen_run")
TEXTS = ("specimen", "direction", "started_at", "operator", "exclude")
ZEROS = ("zero", "load_zero")
NAMES = ("test_id", "file", "sample", "specimen", "direction", "operator")  # on one line, without control characters
RAW = "raw"
TABLES = ("tests.csv", "tests.xlsx", "tests.ods", "tests.xls")
_NAMES_OF_TESTS = ("tests", "test")
KNOWN = (*REQUIRED, *NUMBERS, *COUNTS, *TEXTS, *ZEROS)


@dataclass(frozen=True)
class TestRow:
    """One line of tests.csv: ``row`` counts lines from 1, ``fault`` says that its cells cannot be trusted."""

    __test__ = False

    row: int
    cells: Mapping[str, str]
    decimal_comma: bool
    fault: Problem | None = None
    file: str = TABLES[0]

    @property
    def test_id(self) -> str:
        return self.cells.get("test_id") or f"row {self.row}"


@dataclass(frozen=True)
class Table:
    """A table of a file: column names, the line they are in, and the lines below."""

    names: tuple[str, ...]
    header_row: int
    rows: tuple[TestRow, ...]


def tests_file(root: Path) -> str:
    """Name of the table of tests in a campaign folder: tests.csv, or tests.xlsx or tests.ods where there is no .csv.

    Raises
    ------
    CampaignError
        There are two of them, so that it is not clear which one holds; or none.
    """
    there = [name for name in TABLES if (root / name).exists() or (root / name).is_symlink()]
    if len(there) > 1:
        what = "the tests are listed in more than one file; it is not clear which one is meant"
        raise CampaignError(Problem("several_tables", what, file=there[0], found=", ".join(there), allowed="one file"))
    if there:
        return there[0]
    beside = sorted(path.name for path in root.iterdir() if path.is_file() and path.name != "campaign.toml")
    near = next((n for n in beside if n.partition(".")[0].casefold() in _NAMES_OF_TESTS), "") or nearest(
        TABLES[0], beside, 0.75
    )
    hint = f"; rename {near}?" if near else ""
    allowed = f"{TABLES[0]}, {' or '.join(TABLES[1:3])}{hint}"
    raise CampaignError(Problem("missing_file", f"a campaign must contain {TABLES[0]}", TABLES[0], allowed=allowed))


def read_tests_table(path: Path, file: str, problems: list[Problem]) -> list[TestRow] | None:
    """The rows of tests.csv; None where the table cannot be used, with every fault added to ``problems``."""
    try:
        table = read_table(path, file)
    except OSError as why:
        problems.append(system_problem(why, file))
        return None
    except CampaignError as why:
        problems.extend(why.problems)
        return None
    if table is None:
        problems.append(Problem("empty", "the file has neither a header nor tests", file=file))
        return None
    found = _header_faults(list(table.names), file, table.header_row)
    problems.extend(found)
    return None if any(p.kind != "resembles_a_column" for p in found) else list(table.rows)


def read_table(path: Path, file: str) -> Table | None:
    """A delimited table of any encoding and delimiter, or a sheet of a workbook; None where there is no header.

    Raises
    ------
    OSError
        The file is missing, no regular file, too large, or cannot be read.
    CampaignError
        The table has too many rows or columns, or a cell is too long to be one.
    """
    raw = read_input(path, LARGEST_TABLE_BYTES)
    is_workbook = raw[:4] in (ZIP, OLD_EXCEL)
    text = _sheet_of_tests(raw, file) if is_workbook else _decoded(raw)
    lines = text.splitlines()
    first = next((k for k, line in enumerate(lines) if line.strip()), None)
    if first is None:
        return None
    delimiter = "\t" if is_workbook else max(",;\t|", key=lines[first].count)
    lines_of_text = io.StringIO(text, newline="")
    if is_workbook:
        reader = csv.reader(lines_of_text, delimiter=delimiter, quoting=csv.QUOTE_NONE)
    else:
        reader = csv.reader(lines_of_text, delimiter=delimiter)
    names: list[str] = []
    header_row, rows = 0, []
    try:
        for cells in reader:
            stripped = [cell.strip() for cell in cells]
            if not any(stripped):
                continue
            if not names:
                names, header_row = stripped, reader.line_num
                _check_size("too_many_columns", len(names), MOST_COLUMNS, "columns", file)
                continue
            rows.append(_row(stripped, names, reader.line_num, delimiter, file))
            _check_size("too_many_rows", len(rows), MOST_TABLE_ROWS, "rows", file)
    except csv.Error as why:
        raise CampaignError(_unreadable_cell(why, file, reader.line_num)) from why
    return Table(tuple(names), header_row, tuple(rows))


def _sheet_of_tests(raw: bytes, file: str) -> str:
    """The text of the only filled sheet of a workbook, or of the one called tests."""
    try:
        sheets = sheets_as_text(raw, file)
    except ReadError as why:
        raise CampaignError(why.problems) from None
    named = [name for name in sheets if name.strip().casefold() in _NAMES_OF_TESTS]
    if len(sheets) > 1 and len(named) != 1:
        what, allowed = "several sheets of this workbook are filled", "one filled sheet, or one called tests"
        raise CampaignError(Problem("several_sheets", what, file, found=", ".join(sheets), allowed=allowed))
    return sheets[named[0]] if named else next(iter(sheets.values()))


def _check_size(kind: str, found: int, most: int, what: str, file: str) -> None:
    if found > most:
        allowed = f"at most {most}"
        raise CampaignError(Problem(kind, f"too many {what}", file, found=f"{found} or more", allowed=allowed))


def _unreadable_cell(why: csv.Error, file: str, row: int) -> Problem:
    """A cell beyond the limit of the csv module, usually behind a quotation mark that is not closed."""
    if "field limit" not in str(why):
        return Problem("not_a_table", f"not a readable table ({why})", file, row)
    what = "a cell is too long; a quotation mark before it may not be closed"
    return Problem("cell_too_long", what, file, row, allowed=f"at most {LONGEST_CELL} characters")


def _decoded(raw: bytes) -> str:
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        return raw.decode("utf-16", errors="replace")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("cp1252", errors="replace")


def _row(cells: list[str], names: list[str], row: int, delimiter: str, file: str) -> TestRow:
    while len(cells) > len(names) and not cells[-1]:
        cells.pop()
    fault = None
    if len(cells) != len(names):
        what = f"{len(cells)} cells under {len(names)} column names"
        fault = Problem("wrong_number_of_cells", what, file, row, found=delimiter.join(cells)[:80])
    given = dict(zip(names, cells, strict=False))
    fault = fault or next((f for name, cell in given.items() if (f := _cell_fault(name, cell, file, row))), None)
    fault = fault or _swallowed(given, delimiter, file, row)
    return TestRow(row, given, delimiter != ",", fault, file)


def _cell_fault(name: str, cell: str, file: str, row: int) -> Problem | None:
    """Why a cell cannot be what it is for: longer than any, or a name that a terminal would obey."""
    if len(cell) > LONGEST_CELL:
        found, allowed = f"{len(cell)} characters", f"at most {LONGEST_CELL} characters"
        return Problem("cell_too_long", "this cell is too long", file, row, name, found, allowed)
    if "\0" in cell or (name in NAMES and any(map(is_control, cell))):
        what = "this cell contains a control character or a line break"
        return Problem("control_character", what, file, row, name, cell[:80], "text on one line")
    return None


def _swallowed(cells: Mapping[str, str], delimiter: str, file: str, row: int) -> Problem | None:
    """A cell that holds what looks like further rows, behind a quotation mark that is not closed."""
    enough = max(2, (len(cells) - 1) // 2)
    for name, cell in cells.items():
        inside = cell.split("\n")[1:]
        if any(line.count(delimiter) >= enough for line in inside):
            what = f"this cell contains {len(inside)} further lines of the table; a quotation mark is not closed"
            return Problem("quote_not_closed", what, file, row, name, cell[:80], "one test per line")
    return None


def _header_faults(names: list[str], file: str, row: int) -> list[Problem]:
    problems = []
    unknown = [n for n in names if n not in KNOWN]
    for name in sorted({n for n in names if n and names.count(n) > 1}):
        problems.append(Problem("duplicate_column", "this column occurs twice", file, row, name))
    forces = any(n in names for n in EVALUATED)  # then no row needs an export
    wanted = [n for n in REQUIRED if n not in names and not (forces and n == "file")]
    if not any(n in names for n in LOADS):
        wanted.append(" or ".join(LOADS[:2]))
    problems += [_missing(name, unknown, names, file, row) for name in wanted]
    if not problems:
        problems += [_resembling(n, near, file, row) for n in unknown if (near := _near(n, names))]
    return problems


def _missing(name: str, unknown: list[str], names: list[str], file: str, row: int) -> Problem:
    """A required column that is missing, with the column that may be meant: the same but for capitals, or similar."""
    near = next(filter(None, (nearest(one, unknown) for one in name.split(" or "))), "")
    meant = next((one for one in name.split(" or ") if near and nearest(near, [one])), name)
    found = f"{near} (did you mean {meant}?)" if near else ", ".join(names)
    return Problem("missing_column", "this required column is missing", file, row, name, found)


def _near(name: str, names: list[str]) -> str:
    return nearest(name, [n for n in KNOWN if n not in names], 0.8)


def _resembling(name: str, near: str, file: str, row: int) -> Problem:
    return Problem("resembles_a_column", f"this column is kept as a covariate; did you mean {near}?", file, row, name)
