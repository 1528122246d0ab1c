"""Workbooks (.xlsx, .xls, .xlsb, .ods): each sheet as the tab-separated text it could have been saved from."""

from __future__ import annotations

import datetime
import io
import re
import zipfile
from collections.abc import Iterable
from dataclasses import replace

from tribo.errors import Problem, ReadError
from tribo.limits import MOST_WORKBOOK_BYTES
from tribo.zips import size_problems

OLD_EXCEL = b"\xd0\xcf\x11\xe0"
ZIP = b"PK\x03\x04"
_MOST_CELLS = 20_000_000  # of the rectangle that a sheet spans, filled or not: its reader keeps all of them
_CELL = re.compile(rb'<c [^>]*?r="([A-Z]{1,3})(\d{1,7})"')


def sheets_as_text(data: bytes, file: str) -> dict[str, str]:
    """The sheets that hold anything, by name: one line per row, cells separated by tabs.

    Raises
    ------
    ReadError
        bad_workbook, too_large or empty.
    """
    try:
        if data[:4] == ZIP:
            _refuse_large(data, file)
        sheets = _sheets(data)
    except ReadError:
        raise
    except BaseException as why:
        if not isinstance(why, Exception) and type(why).__name__ != "PanicException":  # of Rust, on damaged files
            raise
        raise ReadError(Problem("bad_workbook", f"not a readable workbook ({why})", file=file)) from None
    texts = {name: text for name, text in sheets.items() if text.strip()}
    if not texts:
        raise ReadError(Problem("empty", "the workbook contains no filled cells", file=file))
    return texts


def _refuse_large(data: bytes, file: str) -> None:
    with zipfile.ZipFile(io.BytesIO(data)) as packed:
        entries = packed.infolist()
        if problems := size_problems(entries, len(data), file, MOST_WORKBOOK_BYTES):
            raise ReadError(replace(problem, kind="too_large") for problem in problems)
        for entry in entries:
            if entry.filename.startswith("xl/worksheets/") and entry.filename.endswith(".xml"):
                cells = _spanned(packed.read(entry))
                if cells > _MOST_CELLS:
                    raise _too_large(f"{cells} cells in {entry.filename}", f"at most {_MOST_CELLS}", file)


def _too_large(found: str, allowed: str, file: str) -> ReadError:
    return ReadError(Problem("too_large", "the file is too large", file=file, found=found, allowed=allowed))


def _spanned(sheet: bytes) -> int:
    """Cells of the rectangle from the first to the last cell of a sheet."""
    found = {(letters, int(row)) for letters, row in _CELL.findall(sheet)}
    rows = {row for _, row in found}
    columns = {_column(letters) for letters, _ in found}
    return (max(rows) - min(rows) + 1) * (max(columns) - min(columns) + 1) if found else 0


def _column(letters: bytes) -> int:
    number = 0
    for letter in letters:
        number = 26 * number + letter - 64
    return number


def _sheets(data: bytes) -> dict[str, str]:
    from python_calamine import CalamineWorkbook

    book = CalamineWorkbook.from_filelike(io.BytesIO(data))
    try:
        return {name: _text(book.get_sheet_by_name(name).to_python(skip_empty_area=False)) for name in book.sheet_names}
    finally:
        book.close()


def _text(rows: Iterable[Iterable[object]]) -> str:
    return "\n".join("\t".join(map(_cell, row)) for row in rows) + "\n"


def _cell(value: object) -> str:
    """A cell as text: whole numbers without a decimal point, dates as they are in tests.csv."""
    if isinstance(value, float) and value.is_integer() and abs(value) < 1e15:
        return str(int(value))
    if isinstance(value, datetime.datetime):
        return value.isoformat(" ")
    return " ".join(str(value).split())
