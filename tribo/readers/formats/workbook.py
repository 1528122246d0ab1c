"""Excel workbooks (.xlsx): each sheet is read as the tab-separated text it was saved from."""

from __future__ import annotations

import zipfile
from dataclasses import replace
from pathlib import Path

from tribo.errors import Problem, ReadError
from tribo.readers.core.source import Source
from tribo.zips import size_problems

_OLD_EXCEL = b"\xd0\xcf\x11\xe0"
_MOST_UNPACKED_BYTES = 200_000_000


def is_workbook(head: bytes) -> bool:
    return head.startswith((b"PK\x03\x04", _OLD_EXCEL))


def open_workbook(path: Path, file: str) -> tuple[Source, ...]:
    """One source per sheet that holds anything.

    Raises
    ------
    ReadError
        old_excel, bad_xlsx, too_large or empty.
    """
    with path.open("rb") as stream:
        if stream.read(4) == _OLD_EXCEL:
            raise ReadError(
                Problem(
                    "old_excel",
                    "the old .xls format is not supported",
                    file=file,
                    allowed="the sheet saved as .xlsx or as CSV",
                )
            )
    try:
        with zipfile.ZipFile(path) as packed:
            problems = size_problems(packed.infolist(), path.stat().st_size, file, _MOST_UNPACKED_BYTES)
        if problems:
            raise ReadError(replace(problem, kind="too_large") for problem in problems)
        sheets = _sheets(path)
    except ReadError:
        raise
    except ImportError as why:
        what, allowed = "reading .xlsx needs the package openpyxl", "pip install openpyxl, or save the sheet as text"
        raise ReadError(Problem("needs_openpyxl", what, file=file, allowed=allowed)) from why
    except Exception as why:  # openpyxl raises many kinds on damaged files
        raise ReadError(Problem("bad_xlsx", f"not a readable .xlsx ({why})", file=file)) from why
    texts = {name: text for name, text in sheets.items() if text.strip()}
    if not texts:
        raise ReadError(Problem("empty", "the workbook contains no filled cells", file=file))
    return tuple(
        Source(path, f"{file} [{name}]" if len(texts) > 1 else file, text.encode(), "utf-8", part=name)
        for name, text in texts.items()
    )


def _sheets(path: Path) -> dict[str, str]:
    import openpyxl  # type: ignore[import-untyped]

    book = openpyxl.load_workbook(path, read_only=True, data_only=True)
    try:
        return {sheet.title: _text(sheet.iter_rows(values_only=True)) for sheet in book.worksheets}
    finally:
        book.close()


def _text(rows: object) -> str:
    lines = []
    for row in rows:  # type: ignore[attr-defined]
        cells = ["" if cell is None else " ".join(str(cell).split()) for cell in row]
        lines.append("\t".join(cells))
    return "\n".join(lines) + "\n"
