"""Any table of numbers under a row of names with units."""

from __future__ import annotations

from tribo.readers.core.family import Family
from tribo.readers.source import Source


def recognises(source: Source) -> bool:
    return True


DELIMITED = Family("delimited", "plain delimited table with column names and units", recognises)
