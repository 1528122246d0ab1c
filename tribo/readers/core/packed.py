"""Exports inside a .zip or .gz: one entry is read as the file itself, one of several by PATH.zip/ENTRY."""

from __future__ import annotations

import gzip
import io
import mmap
import zipfile
import zlib
from pathlib import Path
from typing import IO, Protocol

from tribo.errors import Problem, ReadError
from tribo.limits import MOST_UNPACKED_EXPORT_BYTES
from tribo.readers.core.source import read_bytes
from tribo.zips import LAST_BYTES, last_record

_CHUNK = 1 << 20
_MOST_LISTED = 12
_GZIP, _ZIP = b"\x1f\x8b", b"PK\x03\x04"
_WORKBOOK_ENTRIES = {"[Content_Types].xml", "META-INF/manifest.xml"}
_DAMAGED = (
    zipfile.BadZipFile, gzip.BadGzipFile, NotImplementedError, EOFError, OSError, RuntimeError, ValueError, zlib.error,
)  # fmt: skip


class _Readable(Protocol):
    def read(self, size: int, /) -> bytes: ...


def export_bytes(path: Path, file: str) -> bytes | mmap.mmap:
    """The bytes of an export, unpacked where it is in a .zip or .gz; PATH may go on into a .zip: ``a.zip/b.csv``.

    Raises
    ------
    ReadError
        missing, unreadable, too_large, bad_archive, encrypted, several_entries or unknown_entry.
    """
    archive, entry = split_entry(path)
    raw = read_bytes(archive, file)
    if raw[:4] == _ZIP and not is_workbook_archive(raw):
        raw = _from_zip(raw, entry, file)
    elif entry:
        raise ReadError(Problem("missing", "this file does not exist", file=file))
    if raw[:2] == _GZIP:
        raw = _from_gzip(raw, file)
    return raw


def split_entry(path: Path) -> tuple[Path, str]:
    """(archive, entry) where a parent of the path is a file; the path itself and "" otherwise."""
    if not path.exists():
        for parent in path.parents:
            if parent.is_file():
                return parent, path.relative_to(parent).as_posix()
    return path, ""


def entries_of(path: Path) -> tuple[str, ...]:
    """Names of the files in a .zip of exports; nothing for any other file."""
    try:
        with path.open("rb") as stream:
            if stream.read(4) != _ZIP:
                return ()
        with zipfile.ZipFile(path) as opened:
            return () if _holds_workbook(opened) else tuple(e.filename for e in _files(opened))
    except _DAMAGED:
        return ()


def is_workbook_archive(raw: bytes | mmap.mmap) -> bool:
    """Whether a .zip is an .xlsx, .xlsb or .ods; one that cannot be listed counts as none."""
    try:
        with zipfile.ZipFile(_stream(raw)) as opened:
            return _holds_workbook(opened)
    except _DAMAGED:
        return False


def _holds_workbook(opened: zipfile.ZipFile) -> bool:
    return bool(_WORKBOOK_ENTRIES & set(opened.namelist()))


def _stream(raw: bytes | mmap.mmap) -> IO[bytes]:
    if isinstance(raw, mmap.mmap):
        raw.seek(0)
        return raw  # type: ignore[return-value]
    return io.BytesIO(raw)


def _files(opened: zipfile.ZipFile) -> list[zipfile.ZipInfo]:
    """The entries that are files, those of the system that made the .zip left out."""
    entries = [e for e in opened.infolist() if not e.is_dir() and not e.filename.startswith("__MACOSX/")]
    return [e for e in entries if not e.filename.rpartition("/")[2].startswith(".")]


def _from_zip(raw: bytes | mmap.mmap, wanted: str, file: str) -> bytes:
    try:
        last_record(raw[-LAST_BYTES:])
        with zipfile.ZipFile(_stream(raw)) as opened:
            entry = _chosen(_files(opened), wanted, file)
            if entry.flag_bits & 1:
                what, allowed = "this .zip is encrypted", "a .zip without a password, or the file unpacked"
                raise ReadError(Problem("encrypted", what, file=file, found=entry.filename, allowed=allowed))
            with opened.open(entry) as packed:
                return _bounded(packed, file)
    except _DAMAGED as why:
        raise _bad(why, "zip", file) from why


def _chosen(entries: list[zipfile.ZipInfo], wanted: str, file: str) -> zipfile.ZipInfo:
    found = [e for e in entries if wanted in ("", e.filename)]
    if len(found) == 1:
        return found[0]
    names = [e.filename for e in entries]
    listed = ", ".join(names[:_MOST_LISTED]) + (", ..." if len(names) > _MOST_LISTED else "")
    if not names:
        raise ReadError(Problem("empty", "this .zip contains no files", file=file))
    if wanted:
        raise ReadError(Problem("unknown_entry", "this .zip has no such entry", file=file, allowed=f"one of {listed}"))
    what = f"this .zip contains {len(names)} files"
    allowed = f"one of them, given after the name of the .zip: {Path(file).name}/{names[0]}; here: {listed}"
    raise ReadError(Problem("several_entries", what, file=file, allowed=allowed))


def _from_gzip(raw: bytes | mmap.mmap, file: str) -> bytes:
    try:
        with gzip.GzipFile(fileobj=_stream(raw)) as packed:
            return _bounded(packed, file)
    except _DAMAGED as why:
        raise _bad(why, "gz", file) from why


def _bounded(packed: _Readable, file: str) -> bytes:
    """Everything a stream holds, up to the limit: what an archive says of its own size is not relied on."""
    found = bytearray()
    while chunk := packed.read(_CHUNK):
        found += chunk
        if len(found) > MOST_UNPACKED_EXPORT_BYTES:
            allowed = f"at most {MOST_UNPACKED_EXPORT_BYTES} bytes unpacked"
            raise ReadError(Problem("too_large", "the file is too large", file=file, allowed=allowed))
    return bytes(found)


def _bad(why: Exception, kind: str, file: str) -> ReadError:
    return ReadError(Problem("bad_archive", f"not a readable .{kind} ({why})", file=file))
