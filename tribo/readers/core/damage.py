"""Errors in rows that cannot be parsed, for every row and cell."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from tribo.errors import Problem
from tribo.readers.core.layout import Layout, cut
from tribo.readers.core.source import Source
from tribo.readers.core.tables_in_file import Block

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
