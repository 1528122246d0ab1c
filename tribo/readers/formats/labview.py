"""LabVIEW measurement files (.lvm): one header per segment, units in the names or in Y_Unit_Label.

With "X_Columns No" the rows hold no time: it follows from X0 and Delta_X of the header of their segment.
"""

from __future__ import annotations

import re
from dataclasses import replace

from tribo.readers.columns import Hint, match_column, split_unit
from tribo.readers.core.family import Family
from tribo.readers.layout import Layout
from tribo.readers.source import Source

_HEADER_END = "***End_of_Header***"
_NUMBER_OR_NOTHING = re.compile(r"\s*(?:[-+]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][-+]?\d+)?|NaN)?\s*")
_ACCELERATION = re.compile(r"m/s(?:ec)?(?:\^?2|²)")


def recognises(source: Source) -> bool:
    return source.head[0].startswith("LabVIEW Measurement")


def with_times_written(source: Source) -> Source:
    """The file as a plain table: times that its rows leave out written, comments behind its rows left out.

    Any other file stays as it is.
    """
    if not recognises(source) or source.is_large:
        return source
    lines = source.text(bytes(source.data)).split("\n")
    header: dict[str, str] = {}
    row: int | None = None
    width = 0  # cells of a row without its comment; 0 where the header names no column of comments
    for k, line in enumerate(lines):
        key, _, rest = line.partition("\t")
        if key.startswith((_HEADER_END, "X_Value")):
            row = 0 if key == "X_Value" else None
            width = _cells_before_comment(line)
        elif row is not None and _is_row(line):
            first = _time(header, row) if not key.strip() and header.get("X_Columns") == "No" else key
            lines[k] = "\t".join([first, *(rest.split("\t")[: width - 1] if width else [rest])])
            row += 1
        elif key.strip():
            header[key] = rest.split("\t")[0]
            row = None
    return replace(source, data="\n".join(lines).encode(source.codec, errors="replace"))


def _is_row(line: str) -> bool:
    """Whether a line below the names is a row: numbers, and words only behind them."""
    cells = line.split("\t")
    return any(cells[1:]) and all(_NUMBER_OR_NOTHING.fullmatch(cell) for cell in cells[:2])


def _cells_before_comment(line: str) -> int:
    names = line.split("\t")
    return names.index("Comment") if "Comment" in names else 0


def _time(header: dict[str, str], row: int) -> str:
    """X0 + row Delta_X in the decimal mark of the file; "" where the header does not give them."""
    try:
        start, step = (float(header.get(key, "").replace(",", ".")) for key in ("X0", "Delta_X"))
    except ValueError:
        return ""
    mark = header.get("Decimal_Separator", ".") or "."
    return f"{start + row * step:.9f}".replace(".", mark)


def hints(source: Source, layout: Layout) -> tuple[Hint, ...]:
    """X_Value is time in seconds where X_Dimension says Time; Y_Unit_Label gives the units of the channels."""
    found = []
    dimension = layout.metadata.get("X_Dimension", "Time")
    if "X_Value" in layout.names and dimension.startswith("Time"):
        found.append(Hint("time", "X_Value [s]", "X_Value of a LabVIEW file is in seconds"))
    labels = layout.metadata.get("Y_Unit_Label", "").split()
    if any(_ACCELERATION.match(label) for label in labels):  # g is then the acceleration of gravity as well
        labels = ["" if label == "g" else label for label in labels]
    channels = [name for name in layout.names[1:] if name and name != "Comment"]
    for name, unit in zip(channels, labels, strict=False):
        hit = match_column(name)
        if unit and hit and split_unit(name)[1] is None and not any(h.quantity == hit[0] for h in found):
            found.append(Hint(hit[0], f"{name} [{unit}]", "unit from Y_Unit_Label"))
    return tuple(found)


LABVIEW = Family("labview", "LabVIEW measurement file, .lvm", recognises, hints)
