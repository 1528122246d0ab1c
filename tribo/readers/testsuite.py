"""MTS TestSuite: "Data Acquisition" blocks, tab-separated, names padded with blanks, a row of bare units."""

from __future__ import annotations

from tribo.readers.family import Family
from tribo.readers.source import Source


def recognises(source: Source) -> bool:
    return any(line.startswith("Data Acquisition:") for line in source.lines[:60])


TESTSUITE = Family("testsuite", "MTS TestSuite, text export of timed data", recognises)
