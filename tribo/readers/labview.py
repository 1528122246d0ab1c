"""LabVIEW measurement files (.lvm): a header a segment, units in the names or in Y_Unit_Label."""

from __future__ import annotations

from tribo.readers.assign import Hint, match_column, split_unit
from tribo.readers.family import Family
from tribo.readers.layout import Layout
from tribo.readers.source import Source


def recognises(source: Source) -> bool:
    return source.head[0].startswith("LabVIEW Measurement")


def hints(source: Source, layout: Layout) -> tuple[Hint, ...]:
    """X_Value is time in seconds where X_Dimension says Time; Y_Unit_Label gives the units of the channels."""
    found = []
    dimension = layout.metadata.get("X_Dimension", "Time")
    if "X_Value" in layout.names and dimension.startswith("Time"):
        found.append(Hint("time", "X_Value [s]", "X_Value of a LabVIEW file is seconds"))
    labels = layout.metadata.get("Y_Unit_Label", "").split()
    channels = [name for name in layout.names[1:] if name and name != "Comment"]
    for name, unit in zip(channels, labels, strict=False):
        hit = match_column(name)
        if hit and split_unit(name)[1] is None and not any(h.quantity == hit[0] for h in found):
            found.append(Hint(hit[0], f"{name} [{unit}]", "unit from Y_Unit_Label"))
    return tuple(found)


LABVIEW = Family("labview", "LabVIEW measurement file, .lvm", recognises, hints)
