"""Pages set by typst with the fonts it brings along, so that the same words give the same bytes everywhere."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping
from datetime import datetime
from typing import Any

from tribo.store.whole_files import write_bytes, write_text
from tribo.temporary import temporary_folder

PNG_DPI = 300.0
FIGURE_PAGE = """#set page(width: auto, height: auto, margin: 0pt, fill: white)
#set document(title: sys.inputs.title, description: sys.inputs.origin, date: none)
#image("figure.svg")
"""


def figure_files(svg: bytes, title: str, origin: str) -> dict[str, bytes]:
    """A figure given as SVG, as PDF (vectors, lettering as outlines) and as PNG of 300 dots per inch."""
    import typst

    with temporary_folder() as folder:
        write_bytes(folder / "figure.svg", svg)
        write_text(folder / "page.typ", FIGURE_PAGE)
        compiler: Any = typst.Compiler(root=folder, ignore_system_fonts=True)
        inputs = {"title": title, "origin": origin}
        pdf = compiler.compile(folder / "page.typ", format="pdf", sys_inputs=inputs)
        png = compiler.compile(folder / "page.typ", format="png", ppi=PNG_DPI, sys_inputs=inputs)
    return {"pdf": bytes(pdf), "png": with_text(bytes(png), {"Title": title, "Description": origin})}


def document(source: str, files: Mapping[str, bytes], made_at: datetime | None) -> bytes:
    """A PDF of a typst source and the files it reads; ``made_at`` stands in it as its date of creation."""
    import typst

    with temporary_folder() as folder:
        for name, content in files.items():
            write_bytes(folder / name, content)
        write_text(folder / "document.typ", source)
        compiler: Any = typst.Compiler(root=folder, ignore_system_fonts=True)
        return bytes(compiler.compile(folder / "document.typ", format="pdf", timestamp=made_at))


def with_text(png: bytes, texts: Mapping[str, str]) -> bytes:
    """A PNG with lines of text in it (iTXt, PNG specification 11.3.3.4), put before its picture data."""
    at = png.index(b"IDAT") - 4
    chunks = b"".join(
        _chunk(b"iTXt", key.encode("latin-1") + b"\0\0\0\0\0" + text.encode("utf-8"))
        for key, text in texts.items()
        if text
    )
    return png[:at] + chunks + png[at:]


def _chunk(kind: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
