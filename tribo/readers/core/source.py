"""From a file to bytes with one line ending, and to the text of any stretch of it."""

from __future__ import annotations

import codecs
import mmap
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

from tribo.errors import Problem, ReadError, unexpected
from tribo.input_files import MAPPED_BYTES, NotRegularError, TooLargeError, read_or_map
from tribo.limits import LARGEST_EXPORT_BYTES as LARGEST_FILE_BYTES
from tribo.quantities import match_quantity
from tribo.records import FloatArray

HEAD_BYTES = 2_500
LARGEST_HEAD_BYTES = 400_000
CHUNK_BYTES = 16 << 20
_WIDE_BOMS = {
    codecs.BOM_UTF32_LE: "utf-32",
    codecs.BOM_UTF32_BE: "utf-32",
    codecs.BOM_UTF16_LE: "utf-16",
    codecs.BOM_UTF16_BE: "utf-16",
}
_CELL = re.compile(r"[^\t;,|\n\"]+")
# Code pages of Central Europe, China, Japan, Korea, Taiwan and Russia: recognised by names of columns in them.
_BY_NAMES = ("cp1250", "gb18030", "cp932", "cp949", "big5", "cp1251", "iso8859-2")
_MULTIBYTE = ("gb18030", "cp932", "cp949", "big5")
_ASCII = bytes(range(128))
# Letters and signs that western machines write; anything else makes cp1252 an unlikely reading.
_PLAUSIBLE = frozenset("äöüÄÖÜßéèêëàâçîïôùûÉÈÀÇñÑåÅøØæÆáíóúìòãõµ°²³±·×«»‘’“”–—…€ \xa0")


@dataclass(frozen=True)
class Source:
    """An export as bytes without BOM, wide encodings made UTF-8, lines ending in ``\\n``.

    A mapped source (a large file) keeps its bytes as they are on disk. ``arrays`` holds the columns where the
    file is no text but named arrays (MATLAB), ``names`` their names; ``part`` the sheet of a workbook.
    """

    path: Path
    file: str
    data: bytes | mmap.mmap
    encoding: str
    start: int = 0
    part: str = ""
    names: tuple[str, ...] = ()
    arrays: tuple[FloatArray, ...] = ()

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

    def last_line(self) -> str:
        """The last line of the file that is not blank."""
        lines = self.text(bytes(self.data[-HEAD_BYTES:])).split("\n")
        return next((line.strip() for line in reversed(lines) if line.strip()), "")

    def line_ends(self, start: int, end: int) -> int:
        """Line ends from ``start`` to ``end``, counted piece by piece."""
        return sum(chunk.count(b"\n") for chunk in self.chunks(start, end))

    def chunks(self, start: int, end: int) -> Iterator[bytes]:
        """Whole lines from ``start`` to ``end`` in pieces of bounded size."""
        while start < end:
            stop = end
            if end - start > CHUNK_BYTES:
                stop = self.data.rfind(b"\n", start, start + CHUNK_BYTES) + 1
                stop = stop if stop > start else start + CHUNK_BYTES
            yield bytes(self.data[start:stop])
            start = stop


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
        encoding = _wide_without_bom(raw[:HEAD_BYTES])
        if not encoding or isinstance(raw, mmap.mmap):
            raise ReadError(Problem("binary", "this is not a text file", file=file, allowed="a text export"))
        data = raw.decode(encoding, errors="replace").encode("utf-8")
    else:
        encoding, data = ("utf-8-sig" if bom else _narrow_encoding(raw)), raw
        if encoding in _MULTIBYTE:  # their second bytes may look like delimiters
            data = raw[:].decode(encoding, errors="replace").encode("utf-8")
    source = Source(path, file, data, encoding, start=len(bom) if bom == codecs.BOM_UTF8 else 0)
    return source if isinstance(data, mmap.mmap) else _with_one_line_ending(source, data)


def _wide_without_bom(head: bytes) -> str:
    """UTF-16 tells itself in a western text: every other byte is zero."""
    for encoding, zeros, letters in (("utf-16-le", head[1::2], head[::2]), ("utf-16-be", head[::2], head[1::2])):
        if len(zeros) > 8 and not any(zeros) and all(letters):
            return encoding
    return ""


def _with_one_line_ending(source: Source, data: bytes) -> Source:
    if source.start:
        data = data[source.start :]
    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n")
        data = data.replace(b"\r", b"\n") if b"\r" in data else data
    return replace(source, data=data, start=0)


def read_bytes(path: Path, file: str) -> bytes | mmap.mmap:
    """A file's bytes, mapped where they are many.

    Raises
    ------
    ReadError
        missing, unreadable or too_large.
    """
    try:
        return read_or_map(path, LARGEST_FILE_BYTES, MAPPED_BYTES)
    except FileNotFoundError as why:
        raise ReadError(Problem("missing", "this file does not exist", file=file)) from why
    except TooLargeError as why:
        raise _too_large(why.size, LARGEST_FILE_BYTES, file) from why
    except NotRegularError as why:
        raise ReadError(Problem("not_a_file", "not a regular file", file=file)) from why
    except OSError as why:
        raise ReadError(replace(unexpected(why, "cannot be opened"), file=file)) from why


def _too_large(size: int, limit: int, file: str) -> ReadError:
    found, allowed = f"{size} bytes", f"at most {limit} bytes of this encoding"
    return ReadError(Problem("too_large", "the file is too large", file=file, found=found, allowed=allowed))


def _encoding_of_names(head: bytes) -> str:
    """The code page in which more cells of the beginning are names of quantities than in cp1252, or ""."""
    best, most = "", _names_in(head, "cp1252")
    for encoding in _BY_NAMES:
        if (found := _names_in(head, encoding)) > most:
            best, most = encoding, found
    return best


def _names_in(head: bytes, encoding: str) -> int:
    text = head.decode(encoding, errors="replace")
    return sum(match_quantity(cell.strip()) is not None for cell in _CELL.findall(text) if not cell.isascii())


def _narrow_encoding(raw: bytes | mmap.mmap) -> str:
    looked_at = raw if isinstance(raw, bytes) else raw[:CHUNK_BYTES]
    if looked_at.isascii():
        return "ascii"
    try:
        looked_at[: looked_at.rfind(b"\n") + 1 or None].decode("utf-8")
        return "utf-8"
    except UnicodeDecodeError:
        pass
    if by_names := _encoding_of_names(looked_at[:HEAD_BYTES]):
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
