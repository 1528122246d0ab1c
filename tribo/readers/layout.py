"""Where the header ends and how the rows are cut: delimiter, decimal mark, names, units."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

from tribo.errors import Problem, ReadError
from tribo.quantities import match_quantity
from tribo.readers.source import LARGEST_HEAD_BYTES, Source

_NUMBER_START = re.compile(r"[-+\u2212]?[.,]?\d")
_ROW_OF_NUMBERS = re.compile(r'[\s";,|\t]*[-+]?[.,]?\d[-+\d\s.,;|"/:eEnaNA]*')
_COMMA_NUMBER = re.compile(r"[-+]?\d*,\d+(?:[eE][-+]?\d+)?")
_DOT_NUMBER = re.compile(r"[-+]?\d*\.\d+(?:[eE][-+]?\d+)?")
_ROWS_LOOKED_AT = 12


@dataclass(frozen=True)
class Layout:
    """How a table stands in a file. ``names`` and ``units`` have ``n_cells`` entries, "" where there is none.

    ``header_rows`` counts the lines before the first data row; ``names_row`` and ``units_row`` count from 1.
    """

    delimiter: str
    decimal: str
    header_rows: int
    n_cells: int
    names: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    names_row: int | None = None
    units_row: int | None = None
    metadata: dict[str, str] = field(default_factory=dict)
    footer: str = ""  # pattern of closing lines that hold no data


def cut(line: str, delimiter: str) -> list[str]:
    """The cells of one line, quotes and outer blanks taken off."""
    if delimiter == " ":
        return line.replace('"', "").split()
    if '"' not in line:
        return [cell.strip() for cell in line.split(delimiter)]
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter), [])]
    except csv.Error:
        return [cell.strip(' "') for cell in line.split(delimiter)]


def sniff(source: Source, named: Callable[[str], bool]) -> Layout:
    """The layout of the first table of a delimited export.

    ``named(name)`` says that a column name was asked for by the user.

    Raises
    ------
    ReadError
        header_only, not_an_export, one_column or decimal_is_delimiter.
    """
    while True:
        first = _first_row_of_numbers(source.lines)
        if first is not None and (first + 3 < len(source.lines) or not source.has_more):
            break
        if not source.has_more or source.head_bytes > LARGEST_HEAD_BYTES:
            raise ReadError(_no_numbers(source, named))
        source = replace(source, head_bytes=4 * source.head_bytes)
    rows = [line for line in source.lines[first : first + _ROWS_LOOKED_AT] if line.strip()]
    delimiter = _delimiter(rows, source)
    decimal = _decimal(rows, delimiter)
    n_cells = _usual_count(rows, delimiter)
    first = _step_back_over_damage(source.lines, first, delimiter, n_cells)
    return _with_header(source, Layout(delimiter, decimal, first, n_cells), named)


def _first_row_of_numbers(lines: Sequence[str]) -> int | None:
    """First of two neighbouring lines made of numbers (of one at the end of the file), or None."""
    for k, line in enumerate(lines):
        if not _ROW_OF_NUMBERS.fullmatch(line):
            continue
        following = next((other for other in lines[k + 1 :] if other.strip()), None)
        if following is None or _ROW_OF_NUMBERS.fullmatch(following) or _mostly_numbers(line, following):
            return k
    return None


def _mostly_numbers(line: str, following: str) -> bool:
    """A whole row of numbers followed by a damaged one is still the first row of a table."""
    starts = [bool(_NUMBER_START.match(cell.strip(' "'))) for cell in re.split(r"[\t;,|]", following)]
    return len(starts) > 1 and starts[0] and 2 * sum(starts) >= len(starts) and line[:1] == following[:1]


def _no_numbers(source: Source, named: Callable[[str], bool]) -> Problem:
    for k, line in enumerate(source.lines):
        for delimiter in "\t;,|":
            cells = cut(line, delimiter)
            if sum(_known(cell, named) for cell in cells) >= 2:
                return Problem("header_only", "a header and no data row", file=source.file, row=k + 1)
    what, allowed = "no table of numbers in it", "an export of a test"
    return Problem("not_an_export", what, file=source.file, allowed=allowed)


def _known(name: str, named: Callable[[str], bool]) -> bool:
    return bool(name) and (match_quantity(name) is not None or named(name))


def _delimiter(rows: Sequence[str], source: Source) -> str:
    row = rows[0]
    for delimiter in "\t;|":
        if delimiter in row.strip():
            return delimiter
    words = row.replace('"', "").split()
    if "," in row and not (len(words) > 1 and all(_COMMA_NUMBER.fullmatch(w) or w.isdigit() for w in words)):
        return ","
    if len(words) > 1:
        return " "
    what = "one column only: a trace needs time and force"
    raise ReadError(Problem("one_column", what, file=source.file, found=row[:60]))


def _decimal(rows: Sequence[str], delimiter: str) -> str:
    cells = [cell for row in rows for cell in cut(row, delimiter)]
    commas = sum(bool(_COMMA_NUMBER.fullmatch(cell)) for cell in cells)
    dots = sum(bool(_DOT_NUMBER.fullmatch(cell)) for cell in cells)
    return "," if commas > dots else "."


def _usual_count(rows: Sequence[str], delimiter: str) -> int:
    counts = [len(cut(row, delimiter)) for row in rows]
    return max(set(counts), key=lambda n: (counts.count(n), n))


def _step_back_over_damage(lines: Sequence[str], first: int, delimiter: str, n_cells: int) -> int:
    """A damaged row above the first whole one belongs to the data, not to the header."""
    while first > 0:
        cells = cut(lines[first - 1], delimiter)
        starts = [bool(_NUMBER_START.match(cell)) for cell in cells]
        if len(cells) != n_cells or not starts[0] or 2 * sum(starts) <= n_cells:
            break
        first -= 1
    return first


def _with_header(source: Source, layout: Layout, named: Callable[[str], bool]) -> Layout:
    """Names and units are the two lines nearest above the data; the rest of the header is metadata."""
    above = [k for k in range(layout.header_rows) if source.lines[k].strip(' \t;,"')]
    cells = {k: _fit(cut(source.lines[k], layout.delimiter), layout.n_cells) for k in above[-2:]}
    hits = {k: sum(_known(cell, named) for cell in row) for k, row in cells.items()}
    names_row = units_row = None
    if above:
        names_row = above[-1]
        if len(above) > 1 and hits[above[-2]] > hits[above[-1]]:
            names_row, units_row = above[-2], above[-1]
    names = cells[names_row] if names_row is not None else ("",) * layout.n_cells
    units = cells[units_row] if units_row is not None else ("",) * layout.n_cells
    _refuse_decimal_comma_as_delimiter(source, layout, names)
    before = [k for k in above if names_row is None or k < names_row]
    return replace(
        layout,
        names=names,
        units=units,
        names_row=None if names_row is None else names_row + 1,
        units_row=None if units_row is None else units_row + 1,
        metadata=_metadata(source.lines, before, layout.delimiter),
    )


def _fit(cells: Sequence[str], n: int) -> tuple[str, ...]:
    return tuple(cells[:n]) + ("",) * (n - len(cells))


def _refuse_decimal_comma_as_delimiter(source: Source, layout: Layout, names: Sequence[str]) -> None:
    given = sum(bool(name) for name in names)
    row = source.lines[layout.header_rows]
    if layout.delimiter == "," and 1 < given < layout.n_cells - 1 and '"' not in row and "." not in row:
        what = "the comma is both delimiter and decimal mark: the columns cannot be told apart"
        place = (source.file, layout.header_rows + 1)
        raise ReadError(Problem("decimal_is_delimiter", what, *place, found=row[:60]))


def _metadata(lines: Sequence[str], rows: Sequence[int], delimiter: str) -> dict[str, str]:
    """The file's own header lines: first cell, then the rest as it stands ("12.000 mm/min")."""
    found: dict[str, str] = {}
    for k in rows:
        key, *rest = cut(lines[k].strip("\r"), delimiter)
        if not any(rest):
            key, _, value = key.partition(":")
            rest = [value.strip()]
        key = key.rstrip(": ") or f"line {k + 1}"
        found[key if key not in found else f"{key} (line {k + 1})"] = " ".join(r for r in rest if r)
    return found
