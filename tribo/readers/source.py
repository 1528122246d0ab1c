"""From a file to bytes with one line ending, and to the text of its head."""

from __future__ import annotations

import codecs
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from tribo.errors import Problem, ReadError

HEAD_BYTES = 2_500
LARGEST_HEAD_BYTES = 400_000
LARGEST_FILE_BYTES = 1_000_000_000
_WIDE_BOMS = {
    codecs.BOM_UTF32_LE: "utf-32",
    codecs.BOM_UTF32_BE: "utf-32",
    codecs.BOM_UTF16_LE: "utf-16",
    codecs.BOM_UTF16_BE: "utf-16",
}
_ASCII = bytes(range(128))
# Letters and signs that western machines write; anything else makes cp1252 an unlikely reading.
_PLAUSIBLE = frozenset("äöüÄÖÜßéèêëàâçîïôùûÉÈÀÇñÑåÅøØæÆáíóúìòãõµ°²³±·×«»‘’“”–—…€ \xa0")


@dataclass(frozen=True)
class Source:
    """An export as bytes: no BOM, wide encodings made UTF-8, lines ending in ``\\n``."""

    path: Path
    file: str
    data: bytes
    encoding: str
    head_bytes: int = HEAD_BYTES
    notes: tuple[str, ...] = field(default=())

    @cached_property
    def lines(self) -> tuple[str, ...]:
        """The first lines as text, each whole (the last one too where the file ends inside the head)."""
        head = self.data[: self.head_bytes]
        if len(self.data) > self.head_bytes:
            head = head[: head.rfind(b"\n") + 1] or head
        return tuple(self.text(head).split("\n"))

    @property
    def has_more(self) -> bool:
        return len(self.data) > self.head_bytes

    def text(self, piece: bytes) -> str:
        """Bytes of this file as text; bytes that the encoding does not know become U+FFFD."""
        return piece.decode("utf-8" if self.encoding.startswith("utf") else self.encoding, errors="replace")

    def line_start(self, line: int) -> int:
        """Offset of a line, counted from 0."""
        start = 0
        for _ in range(line):
            start = self.data.index(b"\n", start) + 1
        return start


def open_source(path: Path, file: str) -> Source:
    """Read a file and settle its encoding.

    Raises
    ------
    ReadError
        missing, empty, bom_only, binary or too_large.
    """
    raw = _read_bytes(path, file)
    bom = next((b for b in (*_WIDE_BOMS, codecs.BOM_UTF8) if raw.startswith(b)), b"")
    if not raw[len(bom) :].strip():
        kind, what = ("bom_only", "nothing but a byte order mark") if bom else ("empty", "the file is empty")
        raise ReadError(Problem(kind, what, file=file, allowed="an export with data rows"))
    if bom in _WIDE_BOMS:
        encoding = _WIDE_BOMS[bom]
        data = raw.decode(encoding, errors="replace").encode("utf-8")
    elif bom:
        encoding, data = "utf-8-sig", raw[len(bom) :]
    else:
        if b"\0" in raw[:HEAD_BYTES]:
            raise ReadError(Problem("binary", "not a text export", file=file, allowed="a text export"))
        encoding, data = _narrow_encoding(raw), raw
    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    return Source(path, file, data, encoding)


def _read_bytes(path: Path, file: str) -> bytes:
    try:
        if path.stat().st_size > LARGEST_FILE_BYTES:
            size = f"{path.stat().st_size} bytes"
            allowed = f"at most {LARGEST_FILE_BYTES} bytes"
            raise ReadError(Problem("too_large", "too large to read", file=file, found=size, allowed=allowed))
        return path.read_bytes()
    except FileNotFoundError as why:
        raise ReadError(Problem("missing", "no such file", file=file)) from why
    except OSError as why:
        raise ReadError(Problem("unreadable", f"cannot be opened ({why.strerror})", file=file)) from why


def _narrow_encoding(raw: bytes) -> str:
    if raw.isascii():
        return "ascii"
    try:
        raw.decode("utf-8")
        return "utf-8"
    except UnicodeDecodeError:
        pass
    strange = raw.translate(None, delete=_ASCII)
    try:
        if set(strange.decode("cp1252")) <= _PLAUSIBLE:
            return "cp1252"
    except UnicodeDecodeError:
        pass
    from charset_normalizer import from_bytes

    best = from_bytes(raw[:HEAD_BYTES]).best()
    return best.encoding if best is not None else "cp1252"
