"""The tables of a file: where a header ends and the next one begins, how rows are cut, what the columns are called."""

from __future__ import annotations

import csv
import json
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from tribo.errors import Problem, ReadError
from tribo.input_files import read_input, toml_table
from tribo.readers.columns import Given, bare_unit, is_unit, match_column
from tribo.readers.source import HEAD_BYTES, LARGEST_HEAD_BYTES, Source

_NUMBER_START = re.compile(r"[-+]?[.,]?\d")
_ROW_OF_NUMBERS = re.compile(r"""[\s";,|]*[-+]?[.,]?\d[-+\d\s.,;|"'’/:eEnaNATZ]*""")
_COMMA_NUMBER = re.compile(r"[-+]?(?:\d+,\d*|,\d+)(?:[eE][-+]?\d+)?")
_DOT_NUMBER = re.compile(r"[-+]?(?:\d+\.\d*|\.\d+)(?:[eE][-+]?\d+)?")
_GROUPED = re.compile(r"[-+]?[1-9]\d{0,2}(?:(?P<mark>[.,'’\s])\d{3})+(?!(?P=mark))(?P<decimal>[.,])\d*")
_ROWS_LOOKED_AT = 5
_ROWS_SEARCHED = 100  # for the first number of a column
_HEADER_LINES_LOOKED_AT = 200
_MEASURED = ("time", "friction force", "displacement", "temperature", "speed", "torque")
_COMMENTS = {"comment", "comments", "kommentar", "commentaire"}
_MARK_AT_NAME = re.compile(r"^(?:[#%;]|//)+\s*(?=[^\W\d])")  # "%Time(s)"
_COMMENT_MARKS = ("#", "%", "//", ";")
BLANK = ' \t;,"|'
_TEXT_LINE = re.compile(rb'^[ \t;,"]*[A-Za-z#*<\[({=_\x80-\xff][^\n]*', re.M)
_LABEL = re.compile(r"\b(step|segment|specimen|probe|cycle|interval|data acquisition|run|schritt|zyklus)\b", re.I)
_SIDECARS = (".toml", ".json", ".hdr", ".header", ".names", ".columns", ".meta", ".info", ".ini")
_LARGEST_SIDECAR_BYTES = 100_000


@dataclass(frozen=True)
class Layout:
    """The layout of a table in a file. ``names``, ``units`` and ``filled`` have ``n_cells`` entries.

    ``header_rows`` counts the lines of the file above the first data row; ``names_row`` and ``units_row`` count
    from 1. ``filled`` is False for a column that is empty in the first rows; ``misfit`` states that the
    names of the file cannot be matched to columns and are ignored. The rows are the bytes from ``start`` to ``end``.
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
    start: int = 0
    end: int = 0
    label: str = ""

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


def first_table(source: Source, given: Given) -> Layout:
    """The layout of the first table, as if all below its header were its rows; names from a sidecar where it has none.

    Raises
    ------
    ReadError
        There is no table.
    """
    if source.arrays:
        n = len(source.names)
        return Layout("", ".", 0, n, source.names, ("",) * n, (True,) * n)
    layout = _table_below(source, given, source.start)
    if not any(layout.names) and not source.part:
        for names, sidecar in _names_beside(source.path):
            if len(names) == layout.n_cells:
                return replace(layout, names=names, metadata={**layout.metadata, "names of columns from": sidecar})
    return layout


def tables_one_below_the_other(
    source: Source, first: Layout, given: Given
) -> tuple[tuple[Layout, ...], tuple[str, ...]]:
    """The tables of a file that begins with ``first``, and the closing lines that hold no data.

    A line of text inside a table begins a new header only if a table with known column names follows, and the
    closing lines only if no number follows and they have not the shape of a row; else it is damage, left in place.
    """
    tables, footer = [], []
    current, searched = first, first.start
    while (found := _TEXT_LINE.search(source.data, searched)) is not None:
        start = found.start()
        cells = cut(source.text(found.group()), current.delimiter)
        if len(cells) == current.n_cells > 1 and any(map(_NUMBER_START.match, cells)):
            searched = found.end()
            continue
        rows_above = current.header_rows + source.data[current.start : start].count(b"\n")
        try:
            following = _table_below(source, given, start, rows_above)
        except ReadError:
            footer = [text for text in source.text(bytes(source.data[start:])).split("\n") if text.strip()][:20]
            current = replace(current, end=start)
            break
        if following.names != first.names and not any(_known(name, given) for name in following.names):
            searched = max(following.start, found.end())
            continue
        tables.append(replace(current, end=_without_a_number_alone(source, current, start)))
        current, searched = following, following.start
    tables.append(current)
    return tuple(replace(t, label=_label(t) or f"table {k}") for k, t in enumerate(tables, start=1)), tuple(footer)


def _without_a_number_alone(source: Source, table: Layout, end: int) -> int:
    """Where the rows of a table end: a line with one cell above the next header is the number of its specimen."""
    start = max(table.start, end - HEAD_BYTES)
    for line in reversed(bytes(source.data[start:end]).split(b"\n")[:-1]):
        text = source.text(line)
        if text.strip(BLANK) and not (table.n_cells > 1 == sum(map(bool, cut(text, table.delimiter)))):
            break
        end -= len(line) + 1
    return max(end, table.start)


def _label(table: Layout) -> str:
    lines = list(table.metadata.items())[::-1]
    lines.sort(key=lambda item: not _LABEL.match(item[0]))  # those that begin with the word come first
    for key, value in lines:
        if _LABEL.search(key) and not key.lower().startswith(("step type", "number of")):
            return f"{key} {value}".strip()
    return ""


def _table_below(source: Source, given: Given, start: int, rows_above: int = 0) -> Layout:
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
    rows = [line for line in lines[first : first + _ROWS_LOOKED_AT] if line.strip(BLANK)]
    delimiter = _delimiter(rows, source.file)
    cells = [cut(row, delimiter) for row in rows]
    n_cells = Counter(map(len, cells)).most_common(1)[0][0]
    if len(cells[0]) == 1 < n_cells:
        first += 1  # a line of settings in another delimiter belongs to the header
    first = _step_back_over_damage(lines, first, delimiter, n_cells)
    filled = tuple(any(k < len(row) and row[k] for row in cells[:3]) for k in range(n_cells))
    layout = Layout(delimiter, given.decimal or _decimal(cells), first, n_cells, filled=filled)
    _refuse_decimal_comma_as_delimiter(lines, layout, source.file, rows_above)
    layout = _with_header(lines, layout, given)
    return replace(
        layout,
        filled=_filled_later(lines[first + len(rows) :], layout, given),
        header_rows=first + rows_above,
        names_row=None if layout.names_row is None else layout.names_row + rows_above,
        units_row=None if layout.units_row is None else layout.units_row + rows_above,
        start=source.offset(start, first),
        end=len(source.data),
    )


def _filled_later(lines: Sequence[str], layout: Layout, given: Given) -> tuple[bool, ...]:
    """``filled`` with the columns of known names that are empty in the first rows, and hold numbers in later ones."""
    rows = [cut(line, layout.delimiter) for line in lines[:_ROWS_SEARCHED]]
    return tuple(
        there or (_known(name, given) and any(k < len(row) and _NUMBER_START.match(row[k]) for row in rows))
        for k, (there, name) in enumerate(zip(layout.filled, layout.names, strict=True))
    )


def _first_row_of_numbers(lines: Sequence[str]) -> int | None:
    """First of two neighbouring lines made of numbers (of one at the end of the lines), or None."""
    for k, line in enumerate(lines):
        if not _ROW_OF_NUMBERS.fullmatch(line):
            continue
        following = next((other for other in lines[k + 1 :] if other.strip(BLANK)), None)
        if following is None or _ROW_OF_NUMBERS.fullmatch(following):
            return k
        # a whole row of numbers followed by a damaged one is still the first row of a table
        starts = [bool(_NUMBER_START.match(cell.strip(' "'))) for cell in re.split(r"[\t;,|]", following)]
        if len(starts) > 1 and starts[0] and 2 * sum(starts) >= len(starts) and line[:1] == following[:1]:
            return k
    return None


def _first_row_with_words(lines: Sequence[str]) -> int | None:
    """First of two neighbouring lines with numbers in the same cells, two at least, and words in others."""
    for k, line in enumerate(lines[:-1]):
        following = next((other for other in lines[k + 1 :] if other.strip(BLANK)), "")
        for delimiter in "\t;,|":
            here, below = (_where_numbers_are(other, delimiter) for other in (line, following))
            if here == below and len(here) > 2 and sum(here) > 1:
                return k
    return None


def _where_numbers_are(line: str, delimiter: str) -> tuple[bool, ...]:
    cells = cut(line, delimiter) if delimiter in line else []
    return tuple(bool(_DOT_NUMBER.fullmatch(c) or _COMMA_NUMBER.fullmatch(c) or c.isdigit()) for c in cells)


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
        if 2 * sum(_separates(delimiter, row) for row in rows) > len(rows):
            return delimiter
    row = rows[-1] if len(rows) < 3 else rows[1]
    words = row.replace('"', "").split()
    if "," in row and not (len(words) > 1 and all(_COMMA_NUMBER.fullmatch(w) or w.isdigit() for w in words)):
        return ","
    if len(words) > 1:
        return " "
    what = "only one column was found; a trace needs time and force"
    allowed = "an export with the time, or the displacement, in a column beside the force"
    raise ReadError(Problem("one_column", what, file=file, found=row[:60], allowed=allowed))


def _separates(delimiter: str, row: str) -> bool:
    """Whether a delimiter stands between cells: of bars, those within a cell such as "1|7" separate none."""
    if delimiter != "|" or "," not in row:
        return delimiter in row.strip()
    return all(not cell or _COMMA_NUMBER.fullmatch(cell) or cell.isdigit() for cell in cut(row, "|"))


def _decimal(rows: Sequence[Sequence[str]]) -> str:
    cells = [cell for row in rows for cell in row]
    commas = sum(1 for cell in cells if "," in cell and (_COMMA_NUMBER.fullmatch(cell) or _last_mark(cell) == ","))
    dots = sum(1 for cell in cells if "." in cell and (_DOT_NUMBER.fullmatch(cell) or _last_mark(cell) == "."))
    return "," if commas > dots else "."


def _last_mark(cell: str) -> str:
    """The decimal mark of a number with thousands separators: the last of two different marks, which occurs once."""
    found = _GROUPED.fullmatch(cell)
    return found["decimal"] if found else ""


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

    def nameless(rows: Iterable[int]) -> Layout:
        nothing = ("",) * layout.n_cells
        return replace(layout, names=nothing, units=nothing, metadata=_metadata(lines, rows, layout.delimiter))

    above = [k for k in range(layout.header_rows) if lines[k].strip(BLANK)]
    cells = {k: _header_cells(lines[k], layout) for k in above[-3:]}
    if not above or len(cells[above[-1]]) == 1 < layout.n_cells:
        return nameless(above)
    hits = {k: sum(_known(cell, given) for cell in row) for k, row in cells.items()}
    names_row, units_row = above[-1], None
    if len(above) > 1 and (hits[above[-2]] > hits[above[-1]] or _are_units(cells[above[-1]], cells[above[-2]])):
        names_row, units_row = above[-2], above[-1]
    if len(above) > 2 and hits[above[-3]] > 1 and hits[above[-2]] == hits[above[-1]] == 0:  # one of both is of channels
        alike = len(cells[above[-3]]) == len(cells[above[-2]]) == len(cells[above[-1]]) == layout.n_cells
        units = [k for k in above[-2:] if _are_units(cells[k], cells[above[-3]])]
        if alike and units:
            names_row, units_row = above[-3], units[0]
    layout = nameless(k for k in above if k < names_row)
    if units_row is not None:
        layout = replace(layout, units=_fit(cells[units_row], layout.n_cells), units_row=units_row + 1)
    names = cells[names_row]
    too_many = [name for name in names[layout.n_cells :] if name and name.lower() not in _COMMENTS]
    if not too_many and not any(layout.filled[len(names) :]):
        return replace(layout, names=_fit(names, layout.n_cells), names_row=names_row + 1)
    named = sum(bool(cell) for cell in names)
    misfit = f"{named} column names for {layout.n_cells} columns: they cannot be matched"
    return replace(layout, misfit=misfit, names_row=names_row + 1)


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
    if cells and len(cells) == layout.n_cells:
        cells[0] = _MARK_AT_NAME.sub("", cells[0])
    if layout.delimiter != " " or len(cells) == layout.n_cells:
        return cells
    wider = re.split(r"\s{2,}", line.replace('"', "").strip())
    return wider if len(wider) == layout.n_cells else cells


def _fit(cells: Sequence[str], n: int) -> tuple[str, ...]:
    """The first ``n`` cells, empty ones added where there are fewer."""
    return tuple(cells[:n]) + ("",) * (n - len(cells))


def _refuse_decimal_comma_as_delimiter(lines: Sequence[str], layout: Layout, file: str, rows_above: int) -> None:
    row = lines[layout.header_rows]
    if layout.delimiter != "," or '"' in row or "." in row:
        return
    above = [line for line in lines[: layout.header_rows] if line.strip(BLANK)]
    given = max((sum(bool(c) for c in cut(line, ",")) for line in above[-2:]), default=0)
    if 1 < given < layout.n_cells - 1:
        what = "the comma is both delimiter and decimal mark, so the columns cannot be separated"
        place = (file, rows_above + layout.header_rows + 1)
        allowed = "an export with semicolons or tabs between the cells, or with decimal points"
        raise ReadError(Problem("decimal_is_delimiter", what, *place, found=row[:60], allowed=allowed))


def _metadata(lines: Sequence[str], rows: Iterable[int], delimiter: str) -> dict[str, str]:
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


def _names_beside(path: Path) -> Iterator[tuple[tuple[str, ...], str]]:
    """(names with their units, name of the sidecar) of each file beside an export that may name its columns.

    A sidecar shares the stem of the export, or adds its suffix to the whole name. TOML and JSON hold ``columns``,
    a list of "name [unit]" or of tables with name and unit; any other text one "name [unit]" a line.
    """
    for suffix in _SIDECARS:
        for beside in (path.with_suffix(suffix), path.with_name(path.name + suffix)):
            if beside == path or not beside.is_file() or beside.stat().st_size > _LARGEST_SIDECAR_BYTES:
                continue
            text = read_input(beside, _LARGEST_SIDECAR_BYTES).decode("utf-8-sig", errors="replace")
            listed: object = []
            try:
                if beside.suffix == ".toml":
                    listed = toml_table(text).get("columns", [])
                elif beside.suffix == ".json":
                    stored = json.loads(text)
                    listed = stored.get("columns", []) if isinstance(stored, dict) else stored
                else:
                    lines = (line.strip() for line in text.splitlines())
                    listed = [line for line in lines if line and not line.startswith("#")]
            except (ValueError, RecursionError):
                continue
            if isinstance(listed, Sequence) and not isinstance(listed, str):
                tables = [c if isinstance(c, dict) else {"name": c} for c in listed]
                units = [f" [{c['unit']}]" if c.get("unit") else "" for c in tables]
                names = tuple(f"{c.get('name', '')}{unit}" for c, unit in zip(tables, units, strict=True))
                yield names, beside.name
