"""The numbers of a table, parsed by one call in C per piece; damage is looked for only where that fails.

Thousands separators are decided by a column as a whole: 1,000.5 and 1.000,5 and 1 000,5 and 1'000.5. Where no number
of a table tells them from decimals, the table is refused. Damage is named for every row and cell.
"""

from __future__ import annotations

import io
import re
from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from tribo.errors import Problem, ReadError
from tribo.input_files import MOST_EXPORT_ROWS as LARGEST_TABLE_ROWS
from tribo.readers.layout import BLANK, Layout, cut
from tribo.readers.source import HEAD_BYTES, Source
from tribo.records import FloatArray

_FOR_PANDAS_BYTES = 200_000  # numpy starts faster, pandas runs faster; both round to the nearest double
_COMMA_TO_POINT = bytes.maketrans(b",", b".")
_EXACT_BY_DEFAULT = (3, 1)  # from this pandas on; earlier ones are asked for the nearest double
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_THOUSANDS_MARKS = ".,' \u2019\u00a0\u202f\u2009"
_LARGEST_UNGROUPED = 1000.0
_LEAST_NEIGHBOUR = 0.1  # of a grouped number: one decimal order
_MOST_PROBLEMS = 50
_MOST_COUNTED = 1000
_FEWEST_GROUPED = 4  # faults of one kind in one column that become one problem
_TAIL_BYTES = 4000
_MARKS_AND_DIGITS = re.compile(r"[-+\d.,'’\s]+")
_NOTHING = frozenset({"", "nan", "n/a", "na", "#n/a", "--", "---", "-", "null", "none", "inf", "infinity"})


def parse_block(
    source: Source, table: Layout, used: Sequence[int], accepted: Collection[str] = ()
) -> tuple[FloatArray, list[Problem]]:
    """Columns ``used`` of a table, shape (len(used), rows), as written (no unit applied), and doubts about its rows.

    Rows with damage that is ``accepted`` are left out.

    Raises
    ------
    ReadError
        too_many_rows; or truncated_mid_row, wrong_number_of_cells, text_in_numbers, two_decimal_marks and nan_gap,
        all at once.
    """
    if source.arrays:
        # arrays of one length are padded: rows at the end in which one has no number are left out
        columns = np.array([source.arrays[index] for index in used], dtype=float)
        finite = np.isfinite(columns).all(axis=0)
        last = int(np.flatnonzero(finite)[-1]) + 1 if finite.any() else 0
        padded = finite.size - last
        return columns[:, :last], [_empty_end(padded, source.file, last + 1)] if padded else []
    rows = sum(chunk.count(b"\n") for chunk in source.chunks(table.start, table.end)) + 1
    if rows > LARGEST_TABLE_ROWS:
        allowed = f"at most {LARGEST_TABLE_ROWS} rows: split the export, or record at a lower rate"
        what = "too many rows for one table"
        raise ReadError(Problem("too_many_rows", what, source.file, found=f"{rows} rows", allowed=allowed))
    numbers = np.empty((len(used), rows))  # room for all rows, so that no number is held twice
    filled = 0
    problems: list[Problem] = []
    doubts: list[Problem] = []
    row, start = table.header_rows + 1, table.start
    for chunk in source.chunks(table.start, table.end):
        start += len(chunk)
        ends_file = start >= len(source.data)
        values = parse_rows(chunk, table, used)
        breaks_off = ends_file and _cut_short(source, table)
        if values is None or breaks_off or not np.isfinite(values).all():
            text = source.text(chunk).replace("\r\n", "\n")
            if start >= table.end and not breaks_off:
                text, doubt = _without_empty_end(text, table, used, source.file, row)
                doubts += [doubt] if doubt else []
            found = _damage(text, table, used, source.file, row, ends_file, breaks_off)
            values = None if found else _parse_slowly(text, table, used)
            if found and all(p.kind in ("two_decimal_marks", "more") for p in found):
                values = _parse_grouped(text, table, used)
                found = found if values is None else []
            if found and all(p.kind in (*accepted, "more") for p in found):
                values, left_out = _whole_rows(text, table, used)
                what = f"{left_out} damaged rows are left out, as accepted; this is the first"
                doubts.append(replace(found[0], kind="accepted", what=f"{what}: {found[0].what}", allowed=None))
                found = []
            if values is None and not found:
                found = [Problem("unreadable", "the table does not consist of numbers", source.file, row)]
            problems += found
        if len(problems) > _MOST_PROBLEMS:
            break
        row += chunk.count(b"\n")
        if values is not None:
            numbers[:, filled : filled + len(values)] = values.T
            filled += len(values)
    if problems:
        raise ReadError(problems)
    return numbers[:, :filled], doubts


def parse_rows(rows: bytes, table: Layout, used: Sequence[int]) -> FloatArray | None:
    """Rows by used columns, or None where a row or a cell is not as the others."""
    if not rows.strip():
        return np.empty((0, len(used)))
    if b'"' in rows and rows.count(b'"') % 2:
        return None
    delimiter, n_cells = (None if table.delimiter == " " else table.delimiter), table.n_cells
    if table.decimal == ",":
        if b"." in rows:
            return None
        if delimiter == ",":
            rows, delimiter = rows.replace(b'","', b'";"'), ";"
        rows = rows.translate(_COMMA_TO_POINT)
    everything = sorted(used) == list(range(n_cells))
    try:
        if len(rows) > _FOR_PANDAS_BYTES and delimiter is not None:
            import pandas as pd

            if not _same_cells_in_all_rows(rows, delimiter, n_cells):
                return None
            version = tuple(int(part) for part in pd.__version__.split(".")[:2])
            exact: dict[str, Any] = {} if version >= _EXACT_BY_DEFAULT else {"float_precision": "round_trip"}
            found = pd.read_csv(
                io.BytesIO(rows),
                sep=delimiter,
                header=None,
                names=list(range(n_cells)),
                usecols=list(used),
                index_col=False,
                dtype=float,
                na_filter=False,
                skip_blank_lines=False,
                **exact,
            )
            n_rows = rows.count(b"\n") + (not rows.endswith(b"\n"))
            return found[list(used)].to_numpy() if len(found) == n_rows else None
        rows = rows.translate(None, delete=b'"')
        if not everything and delimiter and not _same_cells_in_all_rows(rows, delimiter, n_cells):
            return None
        lines = rows.decode("latin-1").rstrip(" \n").split("\n")
        if not everything:
            return np.loadtxt(lines, delimiter=delimiter, comments=None, ndmin=2, usecols=list(used))
        values = np.loadtxt(lines, delimiter=delimiter, comments=None, ndmin=2)
        return values[:, list(used)] if values.shape[1] == n_cells else None
    except (ValueError, OverflowError, IndexError):
        return None


def _same_cells_in_all_rows(rows: bytes, delimiter: str, n_cells: int) -> bool:
    """Whether each row has n_cells cells: a parser that takes some columns only would not tell."""
    codes = np.frombuffer(rows, np.uint8)
    ends = np.flatnonzero(codes == ord("\n"))
    if not rows.endswith(b"\n"):
        ends = np.append(ends, codes.size)
    cuts = np.searchsorted(np.flatnonzero(codes == ord(delimiter)), ends)
    return bool(np.all(np.diff(cuts, prepend=0) == n_cells - 1))


def _whole_rows(text: str, table: Layout, used: Sequence[int]) -> tuple[FloatArray, int]:
    """The rows that have all their cells and a number in each used one, and how many have not."""
    rows = [cut(line, table.delimiter) for line in text.split("\n") if line.strip(BLANK)]
    whole = [
        row
        for row in rows
        if len(row) == table.n_cells and not any(_not_a_number(row[k], table.decimal) for k in used)
    ]
    numbers = [[float(row[k].replace(table.decimal, ".")) for k in used] for row in whole]
    return np.array(numbers).reshape(len(whole), len(used)), len(rows) - len(whole)


def _parse_slowly(text: str, table: Layout, used: Sequence[int]) -> FloatArray | None:
    """Row by row, for what the quick way cannot cut: blank lines inside, delimiters inside quotes."""
    rows = [cut(line, table.delimiter) for line in text.split("\n") if line.strip(BLANK)]
    try:
        return np.array([[float(row[k].replace(table.decimal, ".")) for k in used] for row in rows])
    except (ValueError, IndexError):
        return None


def _parse_grouped(text: str, table: Layout, used: Sequence[int]) -> FloatArray | None:
    """Rows of a table of which some columns group their thousands, shape (rows, used); None where they do not."""
    rows = [cut(line, table.delimiter) for line in text.split("\n") if line.strip(BLANK)]
    if not rows or any(len(row) != table.n_cells for row in rows):
        return None
    columns = [_numbers([row[index] for row in rows], table.decimal) for index in used]
    found = [column for column in columns if column is not None]
    return np.array(found).T if len(found) == len(columns) else None


def _numbers(cells: Sequence[str], decimal: str) -> list[float] | None:
    """The numbers of a column, or None where its cells do not group their thousands in one way."""
    plain = [cell.replace(decimal, ".") for cell in cells]
    other = "." if decimal == "," else ","
    if not any(other in cell for cell in cells) and all(_NUMBER.fullmatch(cell) for cell in plain):
        return [float(cell) for cell in plain]
    marks = {c for cell in cells for c in cell if not c.isalnum() and c not in (decimal, "+", "-")}
    mark = marks.pop() if len(marks) == 1 else ""
    if not mark or mark not in _THOUSANDS_MARKS:
        return None
    decimals = {bool(decimal in cell) for cell in cells}
    numbers = [_number(cell, mark, decimal) for cell in cells]
    whole = [n for n in numbers if n is not None]
    # one cell without decimals among cells that have them is a slipped mark, not a thousand
    if len(whole) < len(numbers) or len(decimals) > 1:
        return None
    sizes = [0.0, *map(abs, whole), 0.0]
    grouped = [k for k, cell in enumerate(cells) if mark in cell]
    alike = [max(sizes[k], sizes[k + 2]) >= _LEAST_NEIGHBOUR * sizes[k + 1] for k in grouped]
    return whole if all(alike) else None  # a number without a neighbour of its order has a slipped mark


def _number(cell: str, mark: str, decimal: str) -> float | None:
    """A cell whose thousands, where it has any, are all grouped; None where it is written in another way."""
    m, d = re.escape(mark), re.escape(decimal)
    grouped = re.fullmatch(rf"[-+]?[1-9]\d{{0,2}}(?:{m}\d{{3}})+(?:{d}\d*)?", cell)
    number = cell.replace(mark, "").replace(decimal, ".")
    if grouped is None and (mark in cell or not _NUMBER.fullmatch(number) or abs(float(number)) >= _LARGEST_UNGROUPED):
        return None
    return float(number)


def refuse_ambiguous_marks(source: Source, table: Layout, used: Sequence[int]) -> None:
    """Refuse a table in which no number tells decimals from thousands.

    Raises
    ------
    ReadError
        ambiguous_mark.
    """
    if source.arrays:
        return
    head = "\n".join(source.lines(table.start, min(HEAD_BYTES, table.end - table.start))[0])
    if _ambiguous_mark(head, table, used) is None:
        return
    first: Problem | None = None
    for chunk in source.chunks(table.start, table.end):
        found = _ambiguous_mark(source.text(chunk), table, used)
        if found is None:
            return
        what = "every number is one to three digits, a mark and three digits: decimals or thousands"
        place = (source.file, table.header_rows + 1 + found[0], table.name(found[1]), found[2])
        first = first or Problem("ambiguous_mark", what, *place, 'decimal = "." or decimal = "," in columns')
    if first is not None:
        raise ReadError(first)


def _ambiguous_mark(text: str, table: Layout, used: Sequence[int]) -> tuple[int, int, str] | None:
    """(row from 0, column, cell) of a number whose only mark may be a decimal one or a thousands separator, or None.

    A mark is settled by any cell of the table that is no group of three: 0,123 or 1,2 or 1234,5.
    """
    group = re.compile(rf"[-+]?[1-9]\d{{0,2}}{re.escape(table.decimal)}\d{{3}}")
    first: tuple[int, int, str] | None = None
    for k, line in enumerate(text.split("\n")):
        for index, cell in enumerate(cut(line, table.delimiter)):
            if table.decimal not in cell:
                continue
            if not group.fullmatch(cell):
                return None
            if first is None and index in used:
                first = (k, index, cell)
    return first


def _cut_short(source: Source, table: Layout) -> bool:
    """Whether the file breaks off inside its last number: no line end, and fewer decimals than all rows above."""
    if table.end < len(source.data) or source.data[-1:] in (b"\n", b" ", b"\r"):
        return False
    start = max(table.start, table.end - _TAIL_BYTES)
    tail = source.text(source.data[start : table.end]).split("\n")
    tail = tail[1:] if start > table.start else tail
    last_cells = [cut(line, table.delimiter)[-1] for line in tail if line.strip()]
    decimals = [len(cell.partition(table.decimal)[2]) for cell in last_cells]
    return len(decimals) > 4 and len(set(decimals[:-1])) == 1 and decimals[-1] < decimals[0]


def _damage(
    text: str, table: Layout, used: Sequence[int], file: str, first_row: int, ends_file: bool, breaks_off: bool
) -> list[Problem]:
    """Cells without a number and rows with too many or too few cells; runs of empty cells are one problem.

    ``first_row`` is the line of the file, from 1, that ``text`` begins with; ``ends_file`` says that the file ends with
    it, so that its last row may be cut, ``breaks_off`` that this row is known to be cut. A last row without a
    line end that lacks its last number is cut as well.
    """
    lines = text.split("\n")
    if ends_file and lines[-1].strip() and table.filled[-1]:
        last_cell = cut(lines[-1], table.delimiter)[-1]
        breaks_off = breaks_off or _not_a_number(last_cell, table.decimal) is not None
    last = max((k for k, line in enumerate(lines) if line.strip(BLANK)), default=-1)
    whole_row = f"{table.n_cells} cells"
    number = f"a number with decimal {'comma' if table.decimal == ',' else 'point'}"
    gaps: dict[int, list[int]] = {}
    problems: list[Problem] = []
    for k in range(last + 1):
        if not lines[k].strip():
            continue
        if len(problems) >= _MOST_COUNTED:
            problems.append(Problem("more", "there are further errors in the rows below", file=file, row=first_row + k))
            break
        line, row, cells = lines[k], first_row + k, cut(lines[k], table.delimiter)
        incomplete = len(cells) < table.n_cells or line.count('"') % 2 or breaks_off
        if ends_file and k == last and incomplete:
            what, column = "the last row is incomplete", table.name(len(cells) - 1)
            problems.append(Problem("truncated_mid_row", what, file, row, column, line[-60:], whole_row))
            continue
        if len(cells) != table.n_cells:
            what = f"this row has {len(cells)} cells instead of {table.n_cells}"
            problems.append(Problem("wrong_number_of_cells", what, file, row, None, line[-60:], whole_row))
            continue
        for index in used:
            if cells[index].lower().lstrip("+-") in _NOTHING:
                gaps.setdefault(index, []).append(row)
            elif fault := _not_a_number(cells[index], table.decimal):
                problems.append(Problem(*fault, file, row, table.name(index), cells[index], number))
    problems = _grouped(problems)
    for index, rows in gaps.items():
        what = f"{len(rows)} row{'s' if len(rows) > 1 else ''} without a number; this is the first"
        allowed = "a finite number in every row"
        problems.append(Problem("nan_gap", what, file, rows[0], table.name(index), None, allowed))
    return sorted(problems, key=lambda p: p.row or 0)


def _without_empty_end(
    text: str, table: Layout, used: Sequence[int], file: str, first_row: int
) -> tuple[str, Problem | None]:
    """The text without the rows at its end that have no number in a column used, and the doubt that says so.

    Only where another column goes on, as in tables of records of unequal length, or where the time or all of them end.
    """
    lines = text.split("\n")
    keep = len(lines)
    while keep and (not lines[keep - 1].strip(BLANK) or _is_past_the_end(lines[keep - 1], table, used)):
        keep -= 1
    left_out = sum(bool(line.strip(BLANK)) for line in lines[keep:])
    if not left_out or not keep:
        return text, None
    return "\n".join(lines[:keep]) + "\n", _empty_end(left_out, file, first_row + keep)


def _is_past_the_end(line: str, table: Layout, used: Sequence[int]) -> bool:
    cells = cut(line, table.delimiter)
    if len(cells) != table.n_cells:
        return False
    empty = [cell.lower().lstrip("+-") in _NOTHING for cell in cells]
    ended = [empty[index] for index in used]
    others = [cell for k, cell in enumerate(cells) if k not in used and not empty[k]]
    goes_on = any(_not_a_number(cell, table.decimal) is None for cell in others)
    return all(ended) or ended[0] or (any(ended) and goes_on)  # the first column used is the time


def _empty_end(rows: int, file: str, row: int) -> Problem:
    """The doubt about rows at the end of a table that hold no number in a column used."""
    what = f"{rows} rows at the end lack the time or another value and are left out; this is the first"
    return Problem("empty_end", what, file, row)


def _grouped(problems: Sequence[Problem]) -> list[Problem]:
    """Faults of one kind in one column as one problem from a few on, at the first of them."""
    places: dict[tuple[str, str | None], list[Problem]] = {}
    for problem in problems:
        places.setdefault((problem.kind, problem.column), []).append(problem)
    found = []
    for (kind, _), alike in places.items():
        if len(alike) < _FEWEST_GROUPED or kind == "more":
            found += alike
        else:
            found.append(replace(alike[0], what=f"{alike[0].what}, in {len(alike)} rows; this is the first"))
    return found


def _not_a_number(cell: str, decimal: str) -> tuple[str, str] | None:
    """(kind, what) of a cell that is no number with this decimal mark, None where it is one."""
    other = "." if decimal == "," else ","
    if other not in cell and _NUMBER.fullmatch(cell.replace(decimal, ".")):
        return None
    if _MARKS_AND_DIGITS.fullmatch(cell):
        return "two_decimal_marks", "a different decimal mark, or more than one"
    return "text_in_numbers", "text instead of a number"
