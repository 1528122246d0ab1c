"""CETR and Bruker UMT: one table per step, forces in gram-force written as g, the normal force negative."""

from __future__ import annotations

from tribo.readers.core.family import Family
from tribo.readers.source import Source


def recognises(source: Source) -> bool:
    first = source.head[0]
    return first.startswith(("Created by CETR", "Created by Bruker UMT", "Created by UMT"))


UMT = Family("umt", "CETR and Bruker UMT, CSV of the data viewer, one table per step", recognises)
