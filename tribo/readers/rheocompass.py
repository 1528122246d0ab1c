"""Anton Paar RheoCompass: "Interval data:" before the names, units in brackets below, a table an interval."""

from __future__ import annotations

from tribo.readers.family import Family
from tribo.readers.source import Source


def recognises(source: Source) -> bool:
    return "\nInterval data:" in source.head_text


RHEOCOMPASS = Family("rheocompass", "Anton Paar RheoCompass, a table an interval", recognises)
