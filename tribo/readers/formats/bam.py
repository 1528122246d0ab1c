"""BAM style: a semicolon line of test data over tabs (PMD), or key, value and unit rows over names and units."""

from __future__ import annotations

from tribo.readers.core.family import Family
from tribo.readers.source import Source


def recognises(source: Source) -> bool:
    first = source.head[0]
    if first.count(";") >= 3 and "PMD" in first.split(";"):
        return True
    return any(line.startswith(("Specimen ID:\t", "Probe;")) for line in source.head[:4])


BAM = Family("bam", "BAM and PMD style, test data above tab-separated columns", recognises)
