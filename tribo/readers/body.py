"""The numbers of a table, parsed by one call in C; what is damaged is then found row by row."""

from __future__ import annotations

import io
import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from tribo.errors import Problem, ReadError
from tribo.readers.layout import Layout, cut
from tribo.readers.source import Source
from tribo.records import FloatArray

_FOR_PANDAS_BYTES = 300_000  # numpy starts faster, pandas runs faster; both round to the nearest double
_MOST_PROBLEMS = 50
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_OTHER_MARK = "another decimal mark, or more than one"
_NOTHING = frozenset({"", "nan", "n/a", "na", "#n/a", "--", "---", "-", "null", "none"})


def parse_body(source: Source, layout: Layout, used: Sequence[int]) -> FloatArray:
    """Columns ``used`` of the table, shape (len(used), rows), as written (no unit applied).

    Raises
    ------
    ReadError
        truncated_mid_row, wrong_number_of_cells, text_in_numbers, two_decimal_marks or nan_gap, all at once.
    """
    body = source.data[source.line_start(layout.header_rows) :]
    if layout.footer:
        body = re.sub(layout.footer.encode(), b"", body)
    text = _plain(body, layout)
    values = None if text is None else _parse(text, layout, used)
    if values is None or not np.isfinite(values).all() or _cut_short(source, layout):
        problems = find_damage(source, layout, used)
        if problems:
            raise ReadError(problems)
        if values is None:
            raise ReadError(Problem("unreadable", "the table cannot be read as numbers", file=source.file))
    return np.ascontiguousarray(values.T)


def _plain(body: bytes, layout: Layout) -> bytes | None:
    """The body with decimal points and without quotes, or None where that cannot be done bytewise."""
    if b'"' in body:
        if body.count(b'"') % 2:
            return None
        if layout.decimal == layout.delimiter == ",":
            body = body.replace(b'","', b'";"')
        body = body.replace(b'"', b"")
    if layout.decimal == ",":
        if b"." in body:
            return None
        body = body.replace(b",", b".")
    return body


def _table_delimiter(layout: Layout) -> str | None:
    if layout.delimiter == " ":
        return None
    return ";" if layout.decimal == layout.delimiter == "," else layout.delimiter


def _parse(body: bytes, layout: Layout, used: Sequence[int]) -> FloatArray | None:
    """Rows by columns, or None where a row or a cell is not as the others."""
    delimiter = _table_delimiter(layout)
    everything = list(used) == list(range(layout.n_cells))
    try:
        if len(body) > _FOR_PANDAS_BYTES and delimiter is not None:
            return _parse_large(body, delimiter, layout.n_cells, used)
        lines = body.decode("latin-1").rstrip().split("\n")
        cuts = len(lines) * (layout.n_cells - 1)
        if not everything and delimiter and body.count(delimiter.encode()) != cuts:
            return None
        return np.loadtxt(
            lines, delimiter=delimiter, comments=None, ndmin=2, usecols=None if everything else list(used)
        )[:, slice(None) if not everything else list(used)]
    except (ValueError, OverflowError):
        return None


def _parse_large(body: bytes, delimiter: str, n_cells: int, used: Sequence[int]) -> FloatArray | None:
    import pandas as pd

    rows = body.count(b"\n") + (not body.endswith(b"\n"))
    if body.count(delimiter.encode()) != rows * (n_cells - 1):
        return None
    table = pd.read_csv(
        io.BytesIO(body),
        sep=delimiter,
        header=None,
        names=range(n_cells),
        usecols=list(used),
        dtype=float,
        na_filter=False,
        skip_blank_lines=False,
    )
    return table[list(used)].to_numpy() if len(table) == rows else None


def _cut_short(source: Source, layout: Layout) -> bool:
    """Whether the last row breaks off inside its last number: no line end, fewer decimals than all others."""
    if source.data.endswith((b"\n", b" ")):
        return False
    start = max(source.line_start(layout.header_rows), len(source.data) - 4000)
    tail = source.text(source.data[start:]).split("\n")[1:]
    last_cells = [cut(line, layout.delimiter)[-1] for line in tail if line.strip()]
    decimals = [len(cell.partition(layout.decimal)[2]) for cell in last_cells]
    return len(decimals) > 4 and len(set(decimals[:-1])) == 1 and decimals[-1] < decimals[0]


def find_damage(source: Source, layout: Layout, used: Sequence[int]) -> list[Problem]:
    """Every cell that holds no number, every row with too many or too few cells, runs of them as one."""
    lines = source.data.decode("latin-1").split("\n")
    last = max(k for k, line in enumerate(lines) if line.strip())
    gaps: dict[int, tuple[int, int]] = {}
    problems: list[Problem] = []
    for k in range(layout.header_rows, last + 1):
        line = lines[k].rstrip("\r")
        if len(problems) >= _MOST_PROBLEMS:
            problems.append(Problem("more", "further faults in the rows below", file=source.file, row=k + 1))
            break
        if not line.strip() or (layout.footer and re.fullmatch(layout.footer.rstrip("\n"), line)):
            continue
        broken = _row_fault(source, layout, k, line, k == last)
        if broken:
            problems.append(broken)
            continue
        problems.extend(_cell_faults(source, layout, used, k, line, gaps))
    problems.extend(_gap_problems(source, layout, gaps))
    return sorted(problems, key=lambda p: p.row or 0)


def _row_fault(source: Source, layout: Layout, k: int, line: str, is_last: bool) -> Problem | None:
    cells = cut(line, layout.delimiter)
    place: dict[str, Any] = {"file": source.file, "row": k + 1, "found": line[-60:]}
    allowed = f"{layout.n_cells} cells"
    if is_last and (len(cells) < layout.n_cells or line.count('"') % 2 or _cut_short(source, layout)):
        what = "the last row breaks off"
        column = _name(layout, len(cells) - 1)
        return Problem("truncated_mid_row", what, column=column, allowed=allowed, **place)
    if len(cells) != layout.n_cells:
        what = f"{len(cells)} cells in a row of {layout.n_cells}"
        return Problem("wrong_number_of_cells", what, allowed=allowed, **place)
    return None


def _cell_faults(
    source: Source, layout: Layout, used: Sequence[int], k: int, line: str, gaps: dict[int, tuple[int, int]]
) -> list[Problem]:
    cells = cut(line, layout.delimiter)
    problems = []
    for index in used:
        cell = cells[index]
        if cell.lower() in _NOTHING or cell.lower().lstrip("+-") in {"inf", "infinity"}:
            start, count = gaps.get(index, (k, 0))
            gaps[index] = (start, count + 1)
            continue
        fault = _not_a_number(cell, layout.decimal)
        if fault is None:
            continue
        kind, what = fault
        allowed = f"a number with decimal {'comma' if layout.decimal == ',' else 'point'}"
        place: dict[str, Any] = {"file": source.file, "row": k + 1, "column": _name(layout, index)}
        problems.append(Problem(kind, what, found=cell, allowed=allowed, **place))
    return problems


def _not_a_number(cell: str, decimal: str) -> tuple[str, str] | None:
    """(kind, what) of a cell that is no number with this decimal mark, None where it is one."""
    if _NUMBER.fullmatch(cell.replace(",", ".") if decimal == "," and "." not in cell else cell):
        return None if decimal == "." or "." not in cell else ("two_decimal_marks", _OTHER_MARK)
    if re.fullmatch(r"[-+\d.,'\s]+", cell):
        return "two_decimal_marks", _OTHER_MARK
    return "text_in_numbers", "letters where a number should be"


def _gap_problems(source: Source, layout: Layout, gaps: dict[int, tuple[int, int]]) -> list[Problem]:
    return [
        Problem(
            "nan_gap",
            f"{count} row{'s' if count > 1 else ''} without a number, the first here",
            file=source.file,
            row=start + 1,
            column=_name(layout, index),
            allowed="a finite number in every row",
        )
        for index, (start, count) in gaps.items()
    ]


def _name(layout: Layout, index: int) -> str:
    return layout.names[index] or f"#{index + 1}" if 0 <= index < len(layout.names) else f"#{index + 1}"
