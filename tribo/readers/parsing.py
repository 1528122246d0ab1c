"""Numbers with thousands separators, decided by the column as a whole: 1,000.5 and 1.000,5 and 1 000,5 and 1'000.5.

Errors in rows that cannot be parsed, for every row and cell.

The numbers of a table, parsed by one call in C per piece; damage is looked for only where that fails.
"""

from __future__ import annotations

import io
import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from tribo.errors import Problem, ReadError
from tribo.input_files import MOST_EXPORT_ROWS as LARGEST_TABLE_ROWS
from tribo.readers.layout import Block, Layout, cut
from tribo.readers.source import Source
from tribo.records import FloatArray

_BLANKS = " \u00a0\u202f\u2009"
_APOSTROPHES = "'\u2019"
_PLAIN = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_LARGEST_UNGROUPED = 1000.0
_LEAST_NEIGHBOUR = 0.1  # of a grouped number: one decimal order


def parse_grouped(text: str, layout: Layout, used: Sequence[int]) -> FloatArray | None:
    """Rows of a table of which some columns group their thousands, shape (rows, used); None where they do not."""
    rows = [cut(line, layout.delimiter) for line in text.split("\n") if line.strip(' \t;,"|')]
    if not rows or any(len(row) != layout.n_cells for row in rows):
        return None
    columns = [_numbers([row[index] for row in rows], layout.decimal) for index in used]
    found = [column for column in columns if column is not None]
    return np.array(found).T if len(found) == len(columns) else None


def _numbers(cells: Sequence[str], decimal: str) -> list[float] | None:
    """The numbers of a column, or None where its cells do not group their thousands in one way."""
    plain = [cell.replace(decimal, ".") for cell in cells]
    other = "." if decimal == "," else ","
    if not any(other in cell for cell in cells) and all(_PLAIN.fullmatch(cell) for cell in plain):
        return [float(cell) for cell in plain]
    marks = {c for cell in cells for c in cell if not c.isalnum() and c not in (decimal, "+", "-")}
    mark = marks.pop() if len(marks) == 1 else ""
    if not mark or mark not in f".,{_BLANKS}{_APOSTROPHES}":
        return None
    decimals = {bool(decimal in cell) for cell in cells}
    numbers = [_number(cell, mark, decimal) for cell in cells]
    whole = [n for n in numbers if n is not None]
    # one cell without decimals among cells that have them is a slipped mark, not a thousand
    if len(whole) < len(numbers) or len(decimals) > 1:
        return None
    return whole if _stand_among_their_like(whole, [mark in cell for cell in cells]) else None


def _stand_among_their_like(numbers: Sequence[float], grouped: Sequence[bool]) -> bool:
    """Whether each grouped number has a neighbour of its order; a slipped mark makes one that stands out."""
    sizes = [0.0, *map(abs, numbers), 0.0]
    return all(
        max(sizes[k], sizes[k + 2]) >= _LEAST_NEIGHBOUR * sizes[k + 1] for k, there in enumerate(grouped) if there
    )


def _number(cell: str, mark: str, decimal: str) -> float | None:
    """A cell whose thousands, where it has any, are all grouped; None where it is written in another way."""
    m, d = re.escape(mark), re.escape(decimal)
    grouped = re.fullmatch(rf"[-+]?[1-9]\d{{0,2}}(?:{m}\d{{3}})+(?:{d}\d*)?", cell)
    number = cell.replace(mark, "").replace(decimal, ".")
    if grouped is None and (mark in cell or not _PLAIN.fullmatch(number) or abs(float(number)) >= _LARGEST_UNGROUPED):
        return None
    return float(number)


def ambiguous_mark(text: str, layout: Layout, used: Sequence[int]) -> tuple[int, int, str] | None:
    """(row from 0, column, cell) of a number whose only mark may be a decimal one or a thousands separator, or None.

    A mark is settled by any cell of the table that is no group of three: 0,123 or 1,2 or 1234,5.
    """
    group = re.compile(rf"[-+]?[1-9]\d{{0,2}}{re.escape(layout.decimal)}\d{{3}}")
    first: tuple[int, int, str] | None = None
    for k, line in enumerate(text.split("\n")):
        for index, cell in enumerate(cut(line, layout.delimiter)):
            if layout.decimal not in cell:
                continue
            if not group.fullmatch(cell):
                return None
            if first is None and index in used:
                first = (k, index, cell)
    return first


def ambiguity(file: str, row: int, column: str, cell: str) -> Problem:
    what = "every number is one to three digits, a mark and three digits: decimals or thousands"
    allowed = 'decimal = "." or decimal = "," in columns'
    return Problem("ambiguous_mark", what, file, row, column, cell, allowed)


MOST_PROBLEMS = 50
MOST_COUNTED = 1000
_BLANK = ' \t;,"|'
FEWEST_GROUPED = 4
_TAIL_BYTES = 4000
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_MARKS_AND_DIGITS = re.compile(r"[-+\d.,'’\s]+")
_OTHER_MARK = "a different decimal mark, or more than one"
_NOTHING = frozenset({"", "nan", "n/a", "na", "#n/a", "--", "---", "-", "null", "none", "inf", "infinity"})


def cut_short(source: Source, block: Block) -> bool:
    """Whether the file breaks off inside its last number: no line end, and fewer decimals than all rows above."""
    if block.end < len(source.data) or source.data[-1:] in (b"\n", b" ", b"\r"):
        return False
    start = max(block.start, block.end - _TAIL_BYTES)
    tail = source.text(source.data[start : block.end]).split("\n")
    tail = tail[1:] if start > block.start else tail
    last_cells = [cut(line, block.layout.delimiter)[-1] for line in tail if line.strip()]
    decimals = [len(cell.partition(block.layout.decimal)[2]) for cell in last_cells]
    return len(decimals) > 4 and len(set(decimals[:-1])) == 1 and decimals[-1] < decimals[0]


def find_damage(
    text: str, layout: Layout, used: Sequence[int], file: str, first_row: int, ends_file: bool, breaks_off: bool
) -> list[Problem]:
    """Cells without a number and rows with too many or too few cells; runs of empty cells are one problem.

    ``first_row`` is the line of the file, from 1, that ``text`` begins with; ``ends_file`` says that the file ends with
    it, so that its last row may be cut, ``breaks_off`` that this row is known to be cut. A last row without a
    line end that lacks its last number is cut as well.
    """
    lines = text.split("\n")
    unfinished = (
        ends_file and bool(lines[-1].strip()) and layout.filled[-1] and not _ends_in_a_number(lines[-1], layout)
    )
    breaks_off = breaks_off or unfinished
    last = max((k for k, line in enumerate(lines) if line.strip(' \t;,"|')), default=-1)
    gaps: dict[int, list[int]] = {}
    problems: list[Problem] = []
    for k in range(last + 1):
        if not lines[k].strip():
            continue
        if len(problems) >= MOST_COUNTED:
            problems.append(Problem("more", "there are further errors in the rows below", file=file, row=first_row + k))
            break
        row_fault = _row_fault(lines[k], layout, file, first_row + k, ends_file and k == last, breaks_off)
        if row_fault:
            problems.append(row_fault)
        else:
            problems += _cell_faults(lines[k], layout, used, file, first_row + k, gaps)
    problems = _grouped(problems) + _gap_problems(layout, gaps, file)
    return sorted(problems, key=lambda p: p.row or 0)


def without_empty_end(
    text: str, layout: Layout, used: Sequence[int], file: str, first_row: int
) -> tuple[str, Problem | None]:
    """The text without the rows at its end that have no number in a column used, and the doubt that says so.

    Only where another column goes on, as in tables of records of unequal length, or where the time or all of them end.
    """
    lines = text.split("\n")
    keep = len(lines)
    while keep and (not lines[keep - 1].strip(_BLANK) or _is_past_the_end(lines[keep - 1], layout, used)):
        keep -= 1
    left_out = sum(bool(line.strip(_BLANK)) for line in lines[keep:])
    if not left_out or not keep:
        return text, None
    return "\n".join(lines[:keep]) + "\n", empty_end(left_out, file, first_row + keep)


def _is_past_the_end(line: str, layout: Layout, used: Sequence[int]) -> bool:
    cells = cut(line, layout.delimiter)
    if len(cells) != layout.n_cells:
        return False
    empty = [cell.lower().lstrip("+-") in _NOTHING for cell in cells]
    ended = [empty[index] for index in used]
    others = [cell for k, cell in enumerate(cells) if k not in used and not empty[k]]
    goes_on = any(_not_a_number(cell, layout.decimal) is None for cell in others)
    return all(ended) or ended[0] or (any(ended) and goes_on)  # the first column used is the time


def empty_end(rows: int, file: str, row: int) -> Problem:
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
        if len(alike) < FEWEST_GROUPED or kind == "more":
            found += alike
        else:
            found.append(replace(alike[0], what=f"{alike[0].what}, in {len(alike)} rows; this is the first"))
    return found


def _ends_in_a_number(line: str, layout: Layout) -> bool:
    cell = cut(line, layout.delimiter)[-1]
    return _not_a_number(cell, layout.decimal) is None


def _row_fault(line: str, layout: Layout, file: str, row: int, is_last: bool, breaks_off: bool) -> Problem | None:
    cells = cut(line, layout.delimiter)
    place: dict[str, Any] = {"file": file, "row": row, "found": line[-60:]}
    allowed = f"{layout.n_cells} cells"
    if is_last and (len(cells) < layout.n_cells or line.count('"') % 2 or breaks_off):
        column = layout.name(len(cells) - 1)
        what = "the last row is incomplete"
        return Problem("truncated_mid_row", what, column=column, allowed=allowed, **place)
    if len(cells) != layout.n_cells:
        what = f"this row has {len(cells)} cells instead of {layout.n_cells}"
        return Problem("wrong_number_of_cells", what, allowed=allowed, **place)
    return None


def _cell_faults(
    line: str, layout: Layout, used: Sequence[int], file: str, row: int, gaps: dict[int, list[int]]
) -> list[Problem]:
    cells = cut(line, layout.delimiter)
    problems = []
    for index in used:
        cell = cells[index]
        if cell.lower().lstrip("+-") in _NOTHING:
            gaps.setdefault(index, []).append(row)
            continue
        fault = _not_a_number(cell, layout.decimal)
        if fault is not None:
            allowed = f"a number with decimal {'comma' if layout.decimal == ',' else 'point'}"
            problems.append(Problem(*fault, file, row, layout.name(index), cell, allowed))
    return problems


def _not_a_number(cell: str, decimal: str) -> tuple[str, str] | None:
    """(kind, what) of a cell that is no number with this decimal mark, None where it is one."""
    other = "." if decimal == "," else ","
    if other not in cell and _NUMBER.fullmatch(cell.replace(decimal, ".")):
        return None
    if _MARKS_AND_DIGITS.fullmatch(cell):
        return "two_decimal_marks", _OTHER_MARK
    return "text_in_numbers", "text instead of a number"


def _gap_problems(layout: Layout, gaps: dict[int, list[int]], file: str) -> list[Problem]:
    allowed = "a finite number in every row"
    problems = []
    for index, rows in gaps.items():
        what = f"{len(rows)} row{'s' if len(rows) > 1 else ''} without a number; this is the first"
        problems.append(Problem("nan_gap", what, file, rows[0], layout.name(index), None, allowed))
    return problems


_FOR_PANDAS_BYTES = 200_000  # numpy starts faster, pandas runs faster; both round to the nearest double
_COMMA_TO_POINT = bytes.maketrans(b",", b".")
_EXACT_BY_DEFAULT = (3, 1)  # from this pandas on; earlier ones are asked for the nearest double


def parse_block(source: Source, block: Block, used: Sequence[int]) -> tuple[FloatArray, Problem | None]:
    """Columns ``used`` of a table, shape (len(used), rows), as written (no unit applied), and a doubt about its end.

    Raises
    ------
    ReadError
        too_many_rows; or truncated_mid_row, wrong_number_of_cells, text_in_numbers, two_decimal_marks and nan_gap,
        all at once.
    """
    if source.arrays:
        return _end_of_arrays(np.array([source.arrays[index] for index in used], dtype=float), source)
    table = _room_for(source, block, len(used))
    filled = 0
    problems: list[Problem] = []
    doubt: Problem | None = None
    row, start = block.layout.header_rows + 1, block.start
    for chunk in source.chunks(block.start, block.end):
        start += len(chunk)
        ends_file = start >= len(source.data)
        values = parse_rows(chunk, block.layout, used)
        breaks_off = ends_file and cut_short(source, block)
        if values is None or breaks_off or not np.isfinite(values).all():
            text = source.text(chunk).replace("\r\n", "\n")
            if start >= block.end and not breaks_off:
                text, doubt = without_empty_end(text, block.layout, used, source.file, row)
            found = find_damage(text, block.layout, used, source.file, row, ends_file, breaks_off)
            values = None if found else _parse_slowly(text, block.layout, used)
            if found and all(p.kind in ("two_decimal_marks", "more") for p in found):
                values = parse_grouped(text, block.layout, used)
                found = [] if values is not None else found
            if values is None and not found:
                found = [Problem("unreadable", "the table does not consist of numbers", source.file, row)]
            problems += found
        if len(problems) > MOST_PROBLEMS:
            break
        row += chunk.count(b"\n")
        if values is not None:
            table[:, filled : filled + len(values)] = values.T
            filled += len(values)
    if problems:
        raise ReadError(problems)
    return table[:, :filled], doubt


def _end_of_arrays(values: FloatArray, source: Source) -> tuple[FloatArray, Problem | None]:
    """Named arrays without the rows at their end in which one has no number, as arrays of one length are padded."""
    finite = np.isfinite(values).all(axis=0)
    last = int(np.flatnonzero(finite)[-1]) + 1 if finite.any() else 0
    if last == finite.size:
        return values, None
    return values[:, :last], empty_end(finite.size - last, source.file, last + 1)


def _room_for(source: Source, block: Block, columns: int) -> FloatArray:
    """An empty array (columns, lines) for all rows of a table, so that no number is held twice."""
    rows = source.line_ends(block.start, block.end) + 1
    if rows > LARGEST_TABLE_ROWS:
        what, allowed = (
            "too many rows for one table",
            f"at most {LARGEST_TABLE_ROWS} rows: split the export, or record at a lower rate",
        )
        raise ReadError(Problem("too_many_rows", what, source.file, found=f"{rows} rows", allowed=allowed))
    return np.empty((columns, rows))


def _parse_slowly(text: str, layout: Layout, used: Sequence[int]) -> FloatArray | None:
    """Row by row, for what the quick way cannot cut: blank lines inside, delimiters inside quotes."""
    rows = [cut(line, layout.delimiter) for line in text.split("\n") if line.strip(' \t;,"|')]
    try:
        return np.array([[float(row[k].replace(layout.decimal, ".")) for k in used] for row in rows])
    except (ValueError, IndexError):
        return None


def parse_rows(rows: bytes, layout: Layout, used: Sequence[int]) -> FloatArray | None:
    """Rows by used columns, or None where a row or a cell is not as the others."""
    if b'"' in rows and rows.count(b'"') % 2:
        return None
    delimiter = None if layout.delimiter == " " else layout.delimiter
    if layout.decimal == ",":
        if b"." in rows:
            return None
        if delimiter == ",":
            rows, delimiter = rows.replace(b'","', b'";"'), ";"
        rows = rows.translate(_COMMA_TO_POINT)
    try:
        if len(rows) > _FOR_PANDAS_BYTES and delimiter is not None:
            return _parse_many(rows, delimiter, layout.n_cells, used)
        return _parse_few(rows.translate(None, delete=b'"'), delimiter, layout.n_cells, used)
    except (ValueError, OverflowError, IndexError):
        return None


def _parse_few(rows: bytes, delimiter: str | None, n_cells: int, used: Sequence[int]) -> FloatArray | None:
    lines = rows.decode("latin-1").rstrip(" \n").split("\n")
    everything = sorted(used) == list(range(n_cells))
    if not everything and delimiter and not _same_cells_in_all_rows(rows, delimiter, n_cells):
        return None
    if everything:
        values = np.loadtxt(lines, delimiter=delimiter, comments=None, ndmin=2)
        return values[:, list(used)] if values.shape[1] == n_cells else None
    return np.loadtxt(lines, delimiter=delimiter, comments=None, ndmin=2, usecols=list(used))


def _same_cells_in_all_rows(rows: bytes, delimiter: str, n_cells: int) -> bool:
    """Whether each row has n_cells cells: a parser that takes some columns only would not tell."""
    codes = np.frombuffer(rows, np.uint8)
    ends = np.flatnonzero(codes == ord("\n"))
    if not rows.endswith(b"\n"):
        ends = np.append(ends, codes.size)
    cuts = np.searchsorted(np.flatnonzero(codes == ord(delimiter)), ends)
    return bool(np.all(np.diff(cuts, prepend=0) == n_cells - 1))


def _parse_many(rows: bytes, delimiter: str, n_cells: int, used: Sequence[int]) -> FloatArray | None:
    import pandas as pd

    n_rows = rows.count(b"\n") + (not rows.endswith(b"\n"))
    if not _same_cells_in_all_rows(rows, delimiter, n_cells):
        return None
    version = tuple(int(part) for part in pd.__version__.split(".")[:2])
    exact: dict[str, Any] = {} if version >= _EXACT_BY_DEFAULT else {"float_precision": "round_trip"}
    table = pd.read_csv(
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
    return table[list(used)].to_numpy() if len(table) == n_rows else None
