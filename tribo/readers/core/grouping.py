"""Numbers with thousands separators, decided by the column as a whole: 1,000.5 and 1.000,5 and 1 000,5 and 1'000.5."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from tribo.errors import Problem
from tribo.readers.core.layout import Layout, cut
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
