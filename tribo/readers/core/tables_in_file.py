"""Tables in a file, one below the other: steps, segments, specimens."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

from tribo.errors import ReadError
from tribo.readers.core.given import Given
from tribo.readers.core.layout import Layout, cut, sniff
from tribo.readers.core.names import match_column
from tribo.readers.core.source import Source

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
