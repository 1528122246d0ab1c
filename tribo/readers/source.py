"""From a file to bytes with one line ending, unpacked where it is packed, and to the text of any stretch of it.

One entry of a .zip is read as the file itself, one of several by PATH.zip/ENTRY.
"""

from __future__ import annotations

import codecs
import gzip
import io
import mmap
import re
import zipfile
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import IO

from tribo.errors import Problem, ReadError, unexpected
from tribo.input_files import (
    LARGEST_EXPORT_BYTES as LARGEST_FILE_BYTES,
    LAST_BYTES,
    MAPPED_BYTES,
    MOST_UNPACKED_EXPORT_BYTES,
    NotRegularError,
    TooLargeError,
    last_record,
    read_or_map,
)
from tribo.records import FloatArray
from tribo.units import match_quantity

HEAD_BYTES = 2_500
LARGEST_HEAD_BYTES = 400_000
CHUNK_BYTES = 16 << 20
_WIDE_BOMS = {
    codecs.BOM_UTF32_LE: "utf-32",
    codecs.BOM_UTF32_BE: "utf-32",
    codecs.BOM_UTF16_LE: "utf-16",
    codecs.BOM_UTF16_BE: "utf-16",
}
_AS_TEXT = "a text export: save the record as text or CSV in the program that wrote it"
_CELL = re.compile(r"[^\t;,|\n\"]+")
# Code pages of Central Europe, China, Japan, Korea, Taiwan and Russia: recognised by names of columns in them.
_BY_NAMES = ("cp1250", "gb18030", "cp932", "cp949", "big5", "cp1251", "iso8859-2")
_MULTIBYTE = ("gb18030", "cp932", "cp949", "big5")
_ASCII = bytes(range(128))
# Letters and signs that western machines write; anything else makes cp1252 an unlikely reading.
_PLAUSIBLE = frozenset("äöüÄÖÜßéèêëàâçîïôùûÉÈÀÇñÑåÅøØæÆáíóúìòãõµ°²³±·×«»‘’“”–—…€ \xa0")
_JAPANESE_WORD = re.compile(r"[\u3041-\u30ff\u4e00-\u9fff]{2,}")
_CHUNK = 1 << 20
_MOST_LISTED = 12
_GZIP, _ZIP = b"\x1f\x8b", b"PK\x03\x04"
_WORKBOOK_ENTRIES = {"[Content_Types].xml", "META-INF/manifest.xml"}
_DAMAGED = (
    zipfile.BadZipFile, gzip.BadGzipFile, NotImplementedError, EOFError, OSError, RuntimeError, ValueError, zlib.error,
)  # fmt: skip


@dataclass(frozen=True)
class Source:
    """An export as bytes without BOM, wide encodings made UTF-8, lines ending in ``\\n``.

    A mapped source (a large file) keeps its bytes as they are on disk. ``arrays`` holds the columns where the
    file is no text but named arrays, ``names`` their names, and ``machine`` the binary machine that wrote it; ``part``
    is the sheet of a workbook, the group of channels, or the record of several side by side.
    """

    path: Path
    file: str
    data: bytes | mmap.mmap
    encoding: str
    start: int = 0
    part: str = ""
    names: tuple[str, ...] = ()
    arrays: tuple[FloatArray, ...] = ()
    machine: str = ""

    def lines(self, start: int, size: int) -> tuple[tuple[str, ...], bool]:
        """Whole lines of the ``size`` bytes from ``start``, and whether the file goes on after them."""
        piece = self.data[start : start + size]
        more = start + size < len(self.data)
        if more:
            piece = piece[: piece.rfind(b"\n") + 1] or piece
        text = self.text(piece)
        if isinstance(self.data, mmap.mmap):
            text = text.replace("\r\n", "\n")
        return tuple(text.split("\n")), more

    @cached_property
    def beginning(self) -> tuple[tuple[str, ...], bool]:
        """The first lines, and whether the file goes on after them."""
        return self.lines(self.start, HEAD_BYTES)

    @property
    def head(self) -> tuple[str, ...]:
        """The first lines, enough to recognise a family by."""
        return self.beginning[0]

    @cached_property
    def head_text(self) -> str:
        """The first lines as one text, a line end before each."""
        return "\n" + "\n".join(self.head)

    @property
    def codec(self) -> str:
        """The encoding of ``data``."""
        return "utf-8" if self.encoding.startswith("utf") or self.encoding in _MULTIBYTE else self.encoding

    def text(self, piece: bytes) -> str:
        """Bytes of this file as text; bytes that the encoding does not know become U+FFFD."""
        return piece.decode(self.codec, errors="replace")

    def offset(self, start: int, lines: int) -> int:
        """Where the line stands that is ``lines`` lines below the one at ``start``."""
        for _ in range(lines):
            start = self.data.find(b"\n", start) + 1
            if start == 0:
                return len(self.data)
        return start

    @property
    def is_large(self) -> bool:
        """Whether the file is mapped and read in pieces."""
        return isinstance(self.data, mmap.mmap)

    def beginning_only(self) -> Source:
        """The first lines of a large file as a source of their own, enough to tell what it is; any other as it is."""
        if not self.is_large:
            return self
        piece = bytes(self.data[: max(LARGEST_HEAD_BYTES, CHUNK_BYTES // 4)])
        return _with_one_line_ending(self, piece[: piece.rfind(b"\n") + 1] or piece)

    def chunks(self, start: int, end: int) -> Iterator[bytes]:
        """Whole lines from ``start`` to ``end`` in pieces of bounded size."""
        while start < end:
            stop = end
            if end - start > CHUNK_BYTES:
                stop = self.data.rfind(b"\n", start, start + CHUNK_BYTES) + 1
                stop = stop if stop > start else start + CHUNK_BYTES
            yield bytes(self.data[start:stop])
            start = stop


def export_bytes(path: Path, file: str) -> bytes | mmap.mmap:
    """The bytes of an export, mapped where they are many, unpacked where it is in a .zip or .gz.

    PATH may go on into a .zip: ``a.zip/b.csv``.

    Raises
    ------
    ReadError
        missing, unreadable, not_a_file, too_large, bad_archive, encrypted, several_entries or unknown_entry.
    """
    archive = archive_of(path)
    entry = "" if archive is None else path.relative_to(archive).as_posix()
    path = archive or path
    try:
        raw = read_or_map(path, LARGEST_FILE_BYTES, MAPPED_BYTES)
    except FileNotFoundError as why:
        raise ReadError(Problem("missing", "this file does not exist", file=file)) from why
    except TooLargeError as why:
        raise _too_large(why.size, LARGEST_FILE_BYTES, file) from why
    except NotRegularError as why:
        raise ReadError(Problem("not_a_file", "not a regular file", file=file)) from why
    except OSError as why:
        raise ReadError(replace(unexpected(why, "cannot be opened"), file=file)) from why
    if raw[:4] == _ZIP and not is_workbook_archive(raw):
        raw = _unpacked("zip", partial(_from_zip, raw, entry, file), file)
    elif entry:
        raise ReadError(Problem("missing", "this file does not exist", file=file))
    if raw[:2] == _GZIP:
        raw = _unpacked("gz", partial(gzip.GzipFile, fileobj=_stream(raw)), file)
    return raw


def archive_of(path: Path) -> Path | None:
    """The file that a path goes on into, as in ``a.zip/b.csv``; None where the path is one of its own."""
    return None if path.exists() else next((p for p in path.parents if p.is_file()), None)


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


def _unpacked(kind: str, opened: Callable[[], IO[bytes] | gzip.GzipFile], file: str) -> bytes:
    """Everything a stream holds, up to the limit: what an archive says of its own size is not relied on."""
    found = bytearray()
    try:
        with opened() as packed:
            while chunk := packed.read(_CHUNK):
                found += chunk
                if len(found) > MOST_UNPACKED_EXPORT_BYTES:
                    allowed = f"at most {MOST_UNPACKED_EXPORT_BYTES} bytes unpacked"
                    raise ReadError(Problem("too_large", "the file is too large", file=file, allowed=allowed))
    except _DAMAGED as why:
        raise ReadError(Problem("bad_archive", f"not a readable .{kind} ({why})", file=file)) from why
    return bytes(found)


def _from_zip(raw: bytes | mmap.mmap, wanted: str, file: str) -> IO[bytes]:
    """The wanted entry of a .zip, or its only one, as a stream."""
    last_record(raw[-LAST_BYTES:])
    opened = zipfile.ZipFile(_stream(raw))
    entries = _files(opened)
    found = [e for e in entries if wanted in ("", e.filename)]
    if len(found) == 1 and found[0].flag_bits & 1:
        what, allowed = "this .zip is encrypted", "a .zip without a password, or the file unpacked"
        raise ReadError(Problem("encrypted", what, file=file, found=found[0].filename, allowed=allowed))
    if len(found) == 1:
        return opened.open(found[0])
    names = [e.filename for e in entries]
    listed = ", ".join(names[:_MOST_LISTED]) + (", ..." if len(names) > _MOST_LISTED else "")
    if not names:
        raise ReadError(Problem("empty", "this .zip contains no files", file=file))
    if wanted:
        raise ReadError(Problem("unknown_entry", "this .zip has no such entry", file=file, allowed=f"one of {listed}"))
    what = f"this .zip contains {len(names)} files"
    allowed = f"one of them, given after the name of the .zip: {file}/{names[0]}; here: {listed}"
    raise ReadError(Problem("several_entries", what, file=file, allowed=allowed))


def open_text(path: Path, file: str, raw: bytes | mmap.mmap) -> Source:
    """A text export, read as bytes, with its encoding settled.

    Raises
    ------
    ReadError
        empty, bom_only, binary or too_large.
    """
    bom = next((b for b in (*_WIDE_BOMS, codecs.BOM_UTF8) if raw[:4].startswith(b)), b"")
    if not raw[len(bom) : HEAD_BYTES].strip() and not raw[len(bom) : LARGEST_HEAD_BYTES].strip():
        kind, what = ("bom_only", "the file contains only a byte order mark") if bom else ("empty", "the file is empty")
        raise ReadError(Problem(kind, what, file=file, allowed="an export with data rows"))
    if bom in _WIDE_BOMS:
        if isinstance(raw, mmap.mmap):
            raise _too_large(len(raw), MAPPED_BYTES, file)
        encoding = _WIDE_BOMS[bom]
        data: bytes | mmap.mmap = raw.decode(encoding, errors="replace").encode("utf-8")
    elif b"\0" in raw[:HEAD_BYTES]:
        even, odd = raw[:HEAD_BYTES:2], raw[1:HEAD_BYTES:2]  # UTF-16 of a western text: every other byte is zero
        big = len(even) > 8 and not any(even) and all(odd)
        little = len(odd) > 8 and not any(odd) and all(even)
        encoding = "utf-16-le" if little else "utf-16-be"
        if not (big or little) or isinstance(raw, mmap.mmap):
            raise ReadError(Problem("binary", "this is not a text file", file=file, allowed=_AS_TEXT))
        data = raw.decode(encoding, errors="replace").encode("utf-8")
    else:
        encoding, data = ("utf-8-sig" if bom else _narrow_encoding(raw)), raw
        if encoding in _MULTIBYTE:  # their second bytes may look like delimiters
            data = raw[:].decode(encoding, errors="replace").encode("utf-8")
    source = Source(path, file, data, encoding, start=len(bom) if bom == codecs.BOM_UTF8 else 0)
    return source if isinstance(data, mmap.mmap) else _with_one_line_ending(source, data)


def _with_one_line_ending(source: Source, data: bytes) -> Source:
    if source.start:
        data = data[source.start :]
    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n")
        data = data.replace(b"\r", b"\n") if b"\r" in data else data
    return replace(source, data=data, start=0)


def _too_large(size: int, limit: int, file: str) -> ReadError:
    found, allowed = f"{size} bytes", f"at most {limit} bytes of this encoding"
    return ReadError(Problem("too_large", "the file is too large", file=file, found=found, allowed=allowed))


def _is_shift_jis(head: bytes) -> bool:
    """Whether most of what is beyond ASCII are words of two Japanese letters or more, in Shift-JIS.

    An accented letter of a western word takes the letter behind it along, so that its "word" is one letter long;
    Chinese and Korean bytes are katakana of half width.
    """
    try:
        text = head[: head.rfind(b"\n") + 1 or None].decode("cp932")
    except UnicodeDecodeError:
        return False
    beyond = sum(not c.isascii() for c in text)
    in_words = sum(map(len, _JAPANESE_WORD.findall(text)))
    return in_words >= 4 and 2 * in_words > beyond


def _narrow_encoding(raw: bytes | mmap.mmap) -> str:
    looked_at = raw if isinstance(raw, bytes) else raw[:CHUNK_BYTES]
    if looked_at.isascii():
        return "ascii"
    try:
        looked_at[: looked_at.rfind(b"\n") + 1 or None].decode("utf-8")
        return "utf-8"
    except UnicodeDecodeError:
        pass

    def names_in(encoding: str) -> int:
        """Cells of the beginning that are names of quantities, beyond ASCII."""
        cells = _CELL.findall(looked_at[:HEAD_BYTES].decode(encoding, errors="replace"))
        return sum(match_quantity(cell.strip()) is not None for cell in cells if not cell.isascii())

    by_names = max(("cp1252", *_BY_NAMES), key=names_in)  # the first of equal ones
    if by_names not in _MULTIBYTE and _is_shift_jis(looked_at[:HEAD_BYTES]):
        return "cp932"
    if by_names != "cp1252":
        return by_names
    strange = looked_at.translate(None, delete=_ASCII)
    try:
        if set(strange.decode("cp1252")) <= _PLAUSIBLE:
            return "cp1252"
    except UnicodeDecodeError:
        pass
    from charset_normalizer import from_bytes

    best = from_bytes(looked_at[:HEAD_BYTES]).best()
    return best.encoding if best is not None else "cp1252"
