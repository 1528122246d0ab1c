"""Workbooks (.xlsx, .xls, .xlsb, .ods): each sheet is read as the tab-separated text it was saved from."""

from __future__ import annotations

import mmap
from pathlib import Path

from tribo.input_files import OLD_EXCEL, ZIP, sheets_as_text
from tribo.readers.source import Source, is_workbook_archive


def is_workbook(raw: bytes | mmap.mmap) -> bool:
    return raw[:4] == OLD_EXCEL or (raw[:4] == ZIP and is_workbook_archive(raw))


def open_workbook(path: Path, file: str, raw: bytes | mmap.mmap) -> tuple[Source, ...]:
    """One source per sheet that holds anything.

    Raises
    ------
    ReadError
        bad_workbook, too_large or empty.
    """
    texts = sheets_as_text(raw[:], file)
    return tuple(
        Source(path, f"{file} [{name}]" if len(texts) > 1 else file, text.encode(), "utf-8", part=name)
        for name, text in texts.items()
    )
