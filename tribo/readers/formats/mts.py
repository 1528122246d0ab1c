"""MTS: TestSuite with its "Data Acquisition" blocks, and MTS 793 with "Datenerfassung" or the like."""

from __future__ import annotations

from tribo.readers.core.family import Family
from tribo.readers.source import Source


def is_testsuite(source: Source) -> bool:
    return "\nData Acquisition:" in source.head_text


def is_mts793(source: Source) -> bool:
    return source.head[0].startswith("MTS793|")


TESTSUITE = Family("testsuite", "MTS TestSuite, text export of timed data", is_testsuite)
MTS793 = Family("mts793", "MTS 793 (MPT), data file with acquisition blocks", is_mts793)
