"""Any table of numbers under a row of names with units."""

from __future__ import annotations

from tribo.readers.family import Family
from tribo.readers.source import Source


def recognises(source: Source) -> bool:
    return True


DELIMITED = Family("delimited", "plain delimited table under names with units", recognises)
