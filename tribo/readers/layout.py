"""Where a header ends and how rows are cut: delimiter, decimal mark, names, units.

Tables in a file, one below the other: steps, segments, specimens.

Names of columns in a file beside a nameless export: NAME.toml, NAME.json or a text of one name a line.
"""

from __future__ import annotations

import csv
import json
import re
import tomllib
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from tribo.errors import Problem, ReadError
from tribo.input_files import read_input
from tribo.readers.columns import Given, bare_unit, is_unit, match_column
from tribo.readers.source import HEAD_BYTES, LARGEST_HEAD_BYTES, Source

_NUMBER_START = re.compile(r"[-+]?[.,]?\d")
_ROW_OF_NUMBERS = re.compile(r"""[\s";,|]*[-+]?[.,]?\d[-+\d\s.,;|"'’/:eEnaNATZ]*""")
_COMMA_NUMBER = re.compile(r"[-+]?(?:\d+,\d*|,\d+)(?:[eE][-+]?\d+)?")
_DOT_NUMBER = re.compile(r"[-+]?(?:\d+\.\d*|\.\d+)(?:[eE][-+]?\d+)?")
_GROUPED = re.compile(r"[-+]?[1-9]\d{0,2}(?:(?P<mark>[.,'’\s])\d{3})+(?!(?P=mark))(?P<decimal>[.,])\d*")
_ROWS_LOOKED_AT = 5
_HEADER_LINES_LOOKED_AT = 200
_MEASURED = ("time", "friction force", "displacement", "temperature", "speed", "torque")
_COMMENTS = {"comment", "comments", "kommentar", "commentaire"}
_COMMENT_MARKS = ("#", "%", "//", ";")
_BLANK = ' \t;,"|'


@dataclass(frozen=True)
class Layout:
    """The layout of a table in a file. ``names``, ``units`` and ``filled`` have ``n_cells`` entries.

    ``header_rows`` counts the lines of the file above the first data row; ``names_row`` and ``units_row`` count
    from 1. ``filled`` is False for a column that is empty in the first rows; ``misfit`` states that the
    names of the file cannot be matched to columns and are ignored.
    """

    delimiter: str
    decimal: str
    header_rows: int
    n_cells: int
    names: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    filled: tuple[bool, ...] = ()
    names_row: int | None = None
    units_row: int | None = None
    metadata: dict[str, str] = field(default_factory=dict)
    misfit: str = ""

    def name(self, index: int) -> str:
        """What a column is called, or its position where it has no name."""
        named = 0 <= index < len(self.names) and self.names[index]
        return named or f"#{index + 1}"


def cut(line: str, delimiter: str) -> list[str]:
    """The cells of one line, quotes and outer blanks taken off."""
    if delimiter == " ":
        return line.replace('"', "").split()
    if '"' not in line:
        return [cell.strip() for cell in line.split(delimiter)]
    cells = line[1:-1].split(f'"{delimiter}"')
    if line[0] == line[-1] == '"' and line.count('"') == 2 * len(cells):
        return [cell.strip() for cell in cells]
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter), [])]
    except csv.Error:
        return [cell.strip(' "') for cell in line.split(delimiter)]


def sniff(source: Source, given: Given, start: int = 0, rows_above: int = 0) -> Layout:
    """The layout of the first table below the line at offset ``start``, which has ``rows_above`` lines above it.

    Raises
    ------
    ReadError
        header_only, not_an_export, one_column or decimal_is_delimiter.
    """
    size = HEAD_BYTES
    while True:
        at_start = start == source.start and size == HEAD_BYTES
        lines, more = source.beginning if at_start else source.lines(start, size)
        first = _first_row_of_numbers(lines)
        if first is None and not (more and size <= LARGEST_HEAD_BYTES):
            first = _first_row_with_words(lines)
        if first is not None and (first + 3 < len(lines) or not more):
            break
        if not more or size > LARGEST_HEAD_BYTES:
            raise ReadError(_no_numbers(lines, given, source.file, rows_above))
        size *= 4
    rows = [line for line in lines[first : first + _ROWS_LOOKED_AT] if line.strip(_BLANK)]
    delimiter = _delimiter(rows, source.file)
    cells = [cut(row, delimiter) for row in rows]
    n_cells = Counter(map(len, cells)).most_common(1)[0][0]
    if len(cells[0]) == 1 < n_cells:
        first += 1  # a line of settings in another delimiter belongs to the header
    first = _step_back_over_damage(lines, first, delimiter, n_cells)
    layout = Layout(delimiter, given.decimal or _decimal(cells), first, n_cells, filled=_filled(cells, n_cells))
    _refuse_decimal_comma_as_delimiter(lines, layout, source.file, rows_above)
    return _below(_with_header(lines, layout, given), rows_above)


def _below(layout: Layout, rows_above: int) -> Layout:
    def shifted(row: int | None) -> int | None:
        return None if row is None else row + rows_above

    return replace(
        layout,
        header_rows=layout.header_rows + rows_above,
        names_row=shifted(layout.names_row),
        units_row=shifted(layout.units_row),
    )


def _first_row_of_numbers(lines: Sequence[str]) -> int | None:
    """First of two neighbouring lines made of numbers (of one at the end of the lines), or None."""
    for k, line in enumerate(lines):
        if not _ROW_OF_NUMBERS.fullmatch(line):
            continue
        following = next((other for other in lines[k + 1 :] if other.strip(_BLANK)), None)
        if following is None or _ROW_OF_NUMBERS.fullmatch(following) or _mostly_numbers(line, following):
            return k
    return None


def _first_row_with_words(lines: Sequence[str]) -> int | None:
    """First of two neighbouring lines with numbers in the same cells, two at least, and words in others."""
    for k, line in enumerate(lines[:-1]):
        following = next((other for other in lines[k + 1 :] if other.strip(_BLANK)), "")
        for delimiter in "\t;,|":
            here, below = (_where_numbers_are(other, delimiter) for other in (line, following))
            if here == below and len(here) > 2 and sum(here) > 1:
                return k
    return None


def _where_numbers_are(line: str, delimiter: str) -> tuple[bool, ...]:
    cells = cut(line, delimiter) if delimiter in line else []
    return tuple(bool(_DOT_NUMBER.fullmatch(c) or _COMMA_NUMBER.fullmatch(c) or c.isdigit()) for c in cells)


def _mostly_numbers(line: str, following: str) -> bool:
    """A whole row of numbers followed by a damaged one is still the first row of a table."""
    starts = [bool(_NUMBER_START.match(cell.strip(' "'))) for cell in re.split(r"[\t;,|]", following)]
    return len(starts) > 1 and starts[0] and 2 * sum(starts) >= len(starts) and line[:1] == following[:1]


def _no_numbers(lines: Sequence[str], given: Given, file: str, rows_above: int) -> Problem:
    for k, line in enumerate(lines[:_HEADER_LINES_LOOKED_AT]):
        for delimiter in "\t;,|":
            if sum(_known(cell, given) for cell in cut(line, delimiter)) >= 2:
                return Problem("header_only", "a header without data rows", file=file, row=rows_above + k + 1)
    what, allowed = "the file contains no table of numbers", "an export of a test"
    return Problem("not_an_export", what, file=file, allowed=allowed)


def _known(name: str, given: Given) -> bool:
    return bool(name) and (match_column(name) is not None or given.names(name))


def _delimiter(rows: Sequence[str], file: str) -> str:
    for delimiter in "\t;|":
        if 2 * sum(delimiter in row.strip() for row in rows) > len(rows):
            return delimiter
    row = rows[-1] if len(rows) < 3 else rows[1]
    words = row.replace('"', "").split()
    if "," in row and not (len(words) > 1 and all(_COMMA_NUMBER.fullmatch(w) or w.isdigit() for w in words)):
        return ","
    if len(words) > 1:
        return " "
    what = "only one column was found; a trace needs time and force"
    raise ReadError(Problem("one_column", what, file=file, found=row[:60]))


def _decimal(rows: Sequence[Sequence[str]]) -> str:
    cells = [cell for row in rows for cell in row]
    commas = sum(1 for cell in cells if "," in cell and (_COMMA_NUMBER.fullmatch(cell) or _last_mark(cell) == ","))
    dots = sum(1 for cell in cells if "." in cell and (_DOT_NUMBER.fullmatch(cell) or _last_mark(cell) == "."))
    return "," if commas > dots else "."


def _last_mark(cell: str) -> str:
    """The decimal mark of a number with thousands separators: the last of two different marks, which occurs once."""
    found = _GROUPED.fullmatch(cell)
    return found["decimal"] if found else ""


def _filled(rows: Sequence[Sequence[str]], n_cells: int) -> tuple[bool, ...]:
    return tuple(any(k < len(row) and row[k] for row in rows[:3]) for k in range(n_cells))


def _step_back_over_damage(lines: Sequence[str], first: int, delimiter: str, n_cells: int) -> int:
    """A damaged row above the first whole one belongs to the data, not to the header."""
    while first > 0:
        cells = cut(lines[first - 1], delimiter)
        starts = [bool(_NUMBER_START.match(cell)) for cell in cells]
        if len(cells) != n_cells or not starts[0] or 2 * sum(starts) <= n_cells:
            break
        first -= 1
    return first


def _with_header(lines: Sequence[str], layout: Layout, given: Given) -> Layout:
    """Names and units are the two lines nearest above the data; the rest of the header is metadata."""
    above = [k for k in range(layout.header_rows) if lines[k].strip(_BLANK)]
    cells = {k: _header_cells(lines[k], layout) for k in above[-2:]}
    if not above or len(cells[above[-1]]) == 1 < layout.n_cells:
        return replace(layout, **_nameless(lines, above, layout))
    hits = {k: sum(_known(cell, given) for cell in row) for k, row in cells.items()}
    names_row, units_row = above[-1], None
    if len(above) > 1 and (hits[above[-2]] > hits[above[-1]] or _are_units(cells[above[-1]], cells[above[-2]])):
        names_row, units_row = above[-2], above[-1]
    header = _nameless(lines, [k for k in above if k < names_row], layout)
    if units_row is not None:
        header["units"] = _fit(cells[units_row], layout.n_cells)
        header["units_row"] = units_row + 1
    if _stands_over(cells[names_row], layout):
        header["names"] = _fit(cells[names_row], layout.n_cells)
        header["names_row"] = names_row + 1
    else:
        named = sum(bool(cell) for cell in cells[names_row])
        header["misfit"] = f"{named} column names for {layout.n_cells} columns: they cannot be matched"
        header["names_row"] = names_row + 1
    return replace(layout, **header)


def _are_units(cells: Sequence[str], names: Sequence[str]) -> bool:
    """Whether a line of cells, none of them a name, are units under a line of as many unknown names."""
    filled = [cell for cell in cells if cell]
    known = [cell for cell in filled if match_column(cell)]
    units = [cell for cell in filled if any(is_unit(bare_unit(cell), quantity) for quantity in _MEASURED)]
    named = sum(bool(name) for name in names)
    return not known and 2 * len(units) > len(filled) > 1 and len(cells) == len(names) and named >= len(filled)


def _header_cells(line: str, layout: Layout) -> list[str]:
    """Cells of a line of names or units; between blanks, names may hold single ones."""
    cells = cut(line, layout.delimiter)
    if layout.delimiter == " " and len(cells) == layout.n_cells + 1 and cells[0] in _COMMENT_MARKS:
        return cells[1:]
    if layout.delimiter != " " or len(cells) == layout.n_cells:
        return cells
    wider = re.split(r"\s{2,}", line.replace('"', "").strip())
    return wider if len(wider) == layout.n_cells else cells


def _stands_over(names: Sequence[str], layout: Layout) -> bool:
    """Whether each name has its column: none without a name but empty ones, none too many but a comment."""
    extra = [name for name in names[layout.n_cells :] if name and name.lower() not in _COMMENTS]
    return not extra and not any(layout.filled[len(names) :])


def _nameless(lines: Sequence[str], above: Sequence[int], layout: Layout) -> dict[str, Any]:
    """Columns without names or units, and the lines above as metadata."""
    nothing = ("",) * layout.n_cells
    return {"names": nothing, "units": nothing, "metadata": metadata(lines, above, layout.delimiter)}


def _fit(cells: Sequence[str], n: int) -> tuple[str, ...]:
    return tuple(cells[:n]) + ("",) * (n - len(cells))


def _refuse_decimal_comma_as_delimiter(lines: Sequence[str], layout: Layout, file: str, rows_above: int) -> None:
    row = lines[layout.header_rows]
    if layout.delimiter != "," or '"' in row or "." in row:
        return
    above = [line for line in lines[: layout.header_rows] if line.strip(_BLANK)]
    given = max((sum(bool(c) for c in cut(line, ",")) for line in above[-2:]), default=0)
    if 1 < given < layout.n_cells - 1:
        what = "the comma is both delimiter and decimal mark, so the columns cannot be separated"
        place = (file, rows_above + layout.header_rows + 1)
        raise ReadError(Problem("decimal_is_delimiter", what, *place, found=row[:60]))


def metadata(lines: Sequence[str], rows: Sequence[int], delimiter: str) -> dict[str, str]:
    """Header lines as the file has them: first cell, then the rest as it stands ("12.000 mm/min")."""
    found: dict[str, str] = {}
    for k in rows:
        key, *rest = cut(lines[k], delimiter)
        if not any(rest):
            for mark in (":", "="):
                if mark in key:
                    key, _, value = key.partition(mark)
                    rest = [value.strip()]
                    break
        key = key.strip().rstrip(":") or f"line {k + 1}"
        found[key if key not in found else f"{key} (line {k + 1})"] = " ".join(r for r in rest if r)
    return found


_TEXT_LINE = re.compile(rb'^[ \t;,"]*[A-Za-z#*<\[({=_\x80-\xff][^\n]*', re.M)
_LABEL = re.compile(r"\b(step|segment|specimen|probe|cycle|interval|data acquisition|run|schritt|zyklus)\b", re.I)


@dataclass(frozen=True)
class Block:
    """One table: its layout, and the bytes from ``start`` to ``end`` that hold its rows."""

    layout: Layout
    start: int
    end: int
    label: str = ""


def whole_block(source: Source, layout: Layout) -> Block:
    """Everything below the header as one table."""
    return Block(layout, source.offset(source.start, layout.header_rows), len(source.data))


def split_blocks(source: Source, layout: Layout, given: Given) -> tuple[tuple[Block, ...], tuple[str, ...]]:
    """Tables one below the other, and the closing lines that hold no data.

    A line of text inside a table begins a new header only if a table with known column names follows, and the
    closing lines only if no number follows and they have not the shape of a row; else it is damage, left in place.
    """
    blocks, footer = [], []
    current = whole_block(source, layout)
    searched = current.start
    while (found := _TEXT_LINE.search(source.data, searched)) is not None:
        start = found.start()
        line = source.text(found.group())
        if len(cut(line, current.layout.delimiter)) == current.layout.n_cells and _is_damaged_row(line, current):
            searched = found.end()
            continue
        rows_above = current.layout.header_rows + source.data[current.start : start].count(b"\n")
        try:
            following = sniff(source, given, start, rows_above)
        except ReadError:
            footer = [text for text in source.text(bytes(source.data[start:])).split("\n") if text.strip()][:20]
            current = replace(current, end=start)
            break
        begin = source.offset(start, following.header_rows - rows_above)
        known = following.names == layout.names or any(
            n and (given.names(n) or match_column(n)) for n in following.names
        )
        if not known:
            searched = max(begin, found.end())
            continue
        blocks.append(replace(current, end=start))
        current = Block(following, begin, len(source.data))
        searched = begin
    blocks.append(current)
    return tuple(_labelled(block, k) for k, block in enumerate(blocks)), tuple(footer)


def _is_damaged_row(line: str, block: Block) -> bool:
    cells = cut(line, block.layout.delimiter)
    return len(cells) > 1 and any(re.match(r"[-+]?[.,]?\d", cell) for cell in cells)


def _labelled(block: Block, k: int) -> Block:
    for key, value in reversed(block.layout.metadata.items()):
        if _LABEL.search(key) and not key.lower().startswith(("step type", "number of")):
            return replace(block, label=f"{key} {value}".strip())
    return replace(block, label=f"table {k + 1}")


_SUFFIXES = (".toml", ".json", ".hdr", ".header", ".names", ".columns", ".meta", ".info", ".ini")
_MOST_BYTES = 100_000


def names_beside(path: Path, n_cells: int) -> tuple[tuple[str, ...], str] | None:
    """(names with their units, name of the sidecar) of an export with ``n_cells`` columns, or None.

    A sidecar shares the stem of the export, or adds its suffix to the whole name. TOML and JSON hold ``columns``,
    a list of "name [unit]" or of tables with name and unit; any other text one "name [unit]" a line.
    """
    for suffix in _SUFFIXES:
        for beside in (path.with_suffix(suffix), path.with_name(path.name + suffix)):
            if beside == path or not beside.is_file() or beside.stat().st_size > _MOST_BYTES:
                continue
            names = _names(beside)
            if len(names) == n_cells:
                return tuple(names), beside.name
    return None


def _names(path: Path) -> list[str]:
    text = read_input(path, _MOST_BYTES).decode("utf-8-sig", errors="replace")
    try:
        if path.suffix == ".toml":
            return _listed(tomllib.loads(text).get("columns", []))
        if path.suffix == ".json":
            stored = json.loads(text)
            return _listed(stored.get("columns", []) if isinstance(stored, dict) else stored)
    except (ValueError, RecursionError):
        return []
    return [line.strip() for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]


def _listed(columns: Any) -> list[str]:
    if not isinstance(columns, Sequence) or isinstance(columns, str):
        return []
    return [_one(column) for column in columns]


def _one(column: Any) -> str:
    if isinstance(column, dict):
        unit = column.get("unit", "")
        return f"{column.get('name', '')} [{unit}]" if unit else str(column.get("name", ""))
    return str(column)
