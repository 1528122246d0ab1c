"""The numbers of a table, parsed by one call in C per piece; damage is looked for only where that fails."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import Any

import numpy as np

from tribo.errors import Problem, ReadError
from tribo.limits import MOST_EXPORT_ROWS as LARGEST_TABLE_ROWS
from tribo.readers.core.damage import MOST_PROBLEMS, cut_short, empty_end, find_damage, without_empty_end
from tribo.readers.core.grouping import parse_grouped
from tribo.readers.core.layout import Layout, cut
from tribo.readers.core.source import Source
from tribo.readers.core.tables_in_file import Block
from tribo.records import FloatArray

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
