"""tests.csv: rows of cells by column name, for any delimiter, and errors of the table itself.

Two kinds of cells are read here as well: which pulls of an export a row means (PATH, PATH#2, PATH#2/3, PATH#2/* or
PATH#*), and times of tests (ISO 8601, or day, month and year in the order that the column as a whole settles).
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import date, datetime, time
from pathlib import Path
from typing import Any

from tribo.errors import CampaignError, Problem, ReadError, system_problem
from tribo.input_files import (
    FIRST_YEAR,
    LARGEST_TABLE_BYTES,
    LAST_YEAR,
    LONGEST_CELL,
    MOST_COLUMNS,
    MOST_TABLE_ROWS,
    OLD_EXCEL,
    ZIP,
    read_input,
    sheets_as_text,
)
from tribo.units import CAMPAIGN_COLUMNS
from tribo.user_text import is_control, nearest

TOML = "campaign.toml"
RAW = "raw"
TABLES = ("tests.csv", "tests.xlsx", "tests.ods", "tests.xls")
_NAMES_OF_TESTS = ("tests", "test")


def of_kind(*kinds: str) -> tuple[str, ...]:
    """Columns of tests.csv of these kinds, in the order of the reference."""
    return tuple(c.name for c in CAMPAIGN_COLUMNS.values() if c.kind in kinds)


KNOWN = tuple(CAMPAIGN_COLUMNS)
REQUIRED = ("test_id", "file", "sample")
LOADS = of_kind("load")
NUMBERS = of_kind("load", "number", "correction", "force", "uncertainty")
COUNTS = of_kind("count")
EVALUATED = of_kind("force")
_NAMES = of_kind("name")  # on one line, without control characters

WHOLE = "whole"  # a record that is read as one, whatever it holds
_CHOICE = re.compile(rf"#(\*|{WHOLE}|\d+(?:/(?:\d+|\*|{WHOLE}))?)$")
ALLOWED_DATES = (
    "YYYY-MM-DD or YYYY-MM-DDTHH:MM:SS; DD/MM/YYYY or MM/DD/YYYY where a day after the 12th settles the order"
)
_SEP = re.compile(r"sep=([,;\t|])\r?\n", re.IGNORECASE)  # how a spreadsheet states the delimiter
_DATE = re.compile(r"(\d{1,4})([-./])(\d{1,2})\2(\d{1,4})")
_TIME = re.compile(r"(\d{1,2}):(\d\d)(?::(\d\d)(?:[.,](\d{1,9}))?)?(?: ?([AaPp])\.?[Mm]\.?)?")
_ISO = re.compile(r"\d{4}-?\d\d-?\d\d(?:[T ]\d\d.*)?|\d{4}-?W\d\d.*")
DAY_FIRST, MONTH_FIRST, UNSETTLED, CONTRADICTORY = "day first", "month first", "unsettled", "contradictory"
_WHY = {
    UNSETTLED: "no date of this column settles whether the day or the month comes first",
    CONTRADICTORY: "some dates of this column name the day first and others the month",
}


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


def read_tests(root: Path, problems: list[Problem]) -> list[TestRow] | None:
    """The rows of the table of tests; None where it cannot be used, with every fault added to ``problems``."""
    file = str(root)
    try:
        file = _tests_file(root)
        names, header_row, rows = read_table(root / file, file)
    except OSError as why:
        problems.append(system_problem(why, file))
        return None
    except CampaignError as why:
        problems += why.problems
        return None
    if not names:
        problems.append(Problem("empty", "the file has neither a header nor tests", file=file))
        return None
    found = _header_faults(names, file, header_row)
    problems += found
    return None if any(p.kind != "resembles_a_column" for p in found) else rows


def _tests_file(root: Path) -> str:
    """tests.csv, or tests.xlsx or tests.ods where there is none; CampaignError where there are two of them, or none."""
    there = [name for name in TABLES if (root / name).exists() or (root / name).is_symlink()]
    if len(there) > 1:
        what = "the tests are listed in more than one file; it is not clear which one is meant"
        raise CampaignError(Problem("several_tables", what, file=there[0], found=", ".join(there), allowed="one file"))
    if there:
        return there[0]
    beside = sorted(path.name for path in root.iterdir() if path.is_file() and path.name != TOML)
    near = next((n for n in beside if n.partition(".")[0].casefold() in _NAMES_OF_TESTS), "")
    near = near or nearest(TABLES[0], beside, 0.75)
    allowed = f"{TABLES[0]}, {' or '.join(TABLES[1:3])}{f'; rename {near}?' if near else ''}"
    raise CampaignError(Problem("missing_file", f"a campaign must contain {TABLES[0]}", TABLES[0], allowed=allowed))


def read_table(path: Path, file: str) -> tuple[list[str], int, list[TestRow]]:
    """The column names of a table, the line they are in, and the lines below; no names where there is no header.

    A delimited table of any encoding and delimiter, or a sheet of a workbook.

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
    first = next((line for line in text.splitlines() if line.strip()), "")
    stated = _SEP.match(text)
    delimiter = "\t" if is_workbook else stated[1] if stated else max(",;\t|", key=first.count)
    quoting: Any = csv.QUOTE_NONE if is_workbook else csv.QUOTE_MINIMAL
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, quoting=quoting)
    names: list[str] = []
    header_row = 0
    rows: list[TestRow] = []
    try:
        for cells in reader:
            stripped = [cell.strip() for cell in cells]
            if not any(stripped) or (stated and reader.line_num == 1):
                continue
            if not names:
                names, header_row = stripped, reader.line_num
                _check_size("too_many_columns", len(names), MOST_COLUMNS, "columns", file)
                continue
            rows.append(_row(stripped, names, reader.line_num, delimiter, file))
            _check_size("too_many_rows", len(rows), MOST_TABLE_ROWS, "rows", file)
    except csv.Error as why:
        problem = Problem("not_a_table", f"not a readable table ({why})", file, reader.line_num)
        if "field limit" in str(why):  # of the csv module, usually behind a quotation mark that is not closed
            what = "a cell is too long; a quotation mark before it may not be closed"
            allowed = f"at most {LONGEST_CELL} characters"
            problem = Problem("cell_too_long", what, file, reader.line_num, allowed=allowed)
        raise CampaignError(problem) from why
    return names, header_row, rows


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
    if "\0" in cell or (name in _NAMES and any(map(is_control, cell))):
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
        for name in unknown:
            if near := nearest(name, [n for n in KNOWN if n not in names], 0.8):
                what = f"this column is kept as a covariate; did you mean {near}?"
                problems.append(Problem("resembles_a_column", what, file, row, name))
    return problems


def _missing(name: str, unknown: list[str], names: list[str], file: str, row: int) -> Problem:
    """A required column that is missing, with the column that may be meant: the same but for capitals, or similar."""
    near = next(filter(None, (nearest(one, unknown) for one in name.split(" or "))), "")
    meant = next((one for one in name.split(" or ") if near and nearest(near, [one])), name)
    found = f"{near} (did you mean {meant}?)" if near else ", ".join(names)
    return Problem("missing_column", "this required column is missing", file, row, name, found)


def split_choice(file: str) -> tuple[str, str]:
    """("raw/a.csv", "2/3") of "raw/a.csv#2/3", the third pull of the second table; "" where nothing is chosen.

    "2" is the second table, "2/*" every pull of it, "*" every pull of every table. "whole" and "2/whole" read a record
    of several levels of speed or load as one.
    """
    found = _CHOICE.search(file)
    return (file, "") if found is None else (file[: found.start()], found[1])


def names_pulls(choice: str) -> bool:
    """Whether a choice cuts tables into pulls, and does not take one as it stands."""
    return not choice.endswith(WHOLE) and (choice.endswith("*") or "/" in choice)


def is_chosen(address: str, choice: str) -> bool:
    """Whether the pull at ``address`` ("2/3") is one of those a choice means."""
    return choice in ("*", address) or choice == f"{address.partition('/')[0]}/*"


def overlap(one: str, other: str) -> bool:
    """Whether two choices within one export may mean the same samples."""
    if {one, other} & {"", "*", WHOLE}:
        return True
    tables = one.partition("/"), other.partition("/")
    if tables[0][0] != tables[1][0]:
        return False
    return any(pull in ("", "*", WHOLE) for _, _, pull in tables) or one == other


def order_of(cells: Iterable[str]) -> str:
    """Whether the dates of a column name the day or the month first.

    A number above 12 settles its place as the day; a column with points between the numbers names the day first
    (DIN 5008). Dates that begin with the year settle nothing.
    """
    first = second = dotted = False
    for cell in cells:
        found = _DATE.match(cell.strip())
        if found is None or len(found[1]) > 2:
            continue
        first |= int(found[1]) > 12
        second |= int(found[3]) > 12
        dotted |= found[2] == "."
    if first and second:
        return CONTRADICTORY
    if second:
        return MONTH_FIRST
    return DAY_FIRST if first or dotted else UNSETTLED


def parsed(cell: str, order: str) -> str:
    """A date, with its time if it has one, in ISO 8601; ``order`` as of :func:`order_of` for the column.

    Raises
    ------
    ValueError
        It is no date, or the order of day and month is not settled; the text is the end of a sentence.
    """
    text = " ".join(cell.split())
    found = _DATE.match(text)
    if _ISO.fullmatch(text):
        day, clock = _iso(text)
    elif found is not None:
        day = _day(found, order)
        clock = _clock(text[found.end() :].lstrip("T ,"))
    else:
        raise ValueError("not a date")
    if not FIRST_YEAR <= day.year <= LAST_YEAR:
        raise ValueError(f"not between the years {FIRST_YEAR} and {LAST_YEAR}")
    return day.isoformat() if clock is None else datetime.combine(day, clock).isoformat()


def _iso(text: str) -> tuple[date, time | None]:
    try:
        if len(text) <= 10 and ":" not in text and "T" not in text:
            return date.fromisoformat(text), None
        moment = datetime.fromisoformat(text)
    except ValueError:
        raise ValueError("not a date") from None
    return moment.date(), moment.timetz()


def _day(found: re.Match[str], order: str) -> date:
    numbers = int(found[1]), int(found[3]), int(found[4])
    if len(found[1]) == 4 and len(found[4]) <= 2:
        year, month, day = numbers
    elif len(found[1]) <= 2 and len(found[4]) == 4:
        first, second, year = numbers
        if first != second and order not in (DAY_FIRST, MONTH_FIRST):
            raise ValueError(_WHY[order])
        day, month = (second, first) if order == MONTH_FIRST else (first, second)
    else:
        raise ValueError("a date needs a year of four digits")
    try:
        return date(year, month, day)
    except ValueError:
        raise ValueError("not a date") from None


def _clock(text: str) -> time | None:
    if not text:
        return None
    found = _TIME.fullmatch(text)
    if found is None:
        raise ValueError("not a time of day")
    hour, half = int(found[1]), (found[5] or "").lower()
    if half and not 1 <= hour <= 12:
        raise ValueError("not a time of day")
    if half:
        hour = hour % 12 + (12 if half == "p" else 0)
    try:
        return time(hour, int(found[2]), int(found[3] or 0), int((found[4] or "0").ljust(6, "0")[:6]))
    except ValueError:
        raise ValueError("not a time of day") from None
