"""The table of format families, and the way from a path to the sources in it."""

from __future__ import annotations

from pathlib import Path

from tribo.readers.core.family import Family
from tribo.readers.core.packed import export_bytes
from tribo.readers.core.source import Source, open_text
from tribo.readers.formats.bam import BAM
from tribo.readers.formats.bluehill import BLUEHILL
from tribo.readers.formats.csm import CSM
from tribo.readers.formats.delimited import DELIMITED
from tribo.readers.formats.labview import LABVIEW, with_times_written
from tribo.readers.formats.matlab import MATLAB, is_matlab, open_matlab
from tribo.readers.formats.mts import MTS793, TESTSUITE
from tribo.readers.formats.newport import NEWPORT
from tribo.readers.formats.pcs import PCS
from tribo.readers.formats.rheocompass import RHEOCOMPASS
from tribo.readers.formats.rtec import RTEC
from tribo.readers.formats.shimadzu import TRAPEZIUM
from tribo.readers.formats.tdms import TDMS, is_tdms, open_tdms
from tribo.readers.formats.te67 import TE67
from tribo.readers.formats.testxpert import TESTXPERT
from tribo.readers.formats.umt import UMT
from tribo.readers.formats.walterbai import WALTERBAI
from tribo.readers.formats.workbook import is_workbook, open_workbook

# Tried in this order; the last one accepts everything the others do not recognise.
READERS: dict[str, Family] = {
    f.name: f
    for f in (
        TDMS,
        MATLAB,
        BLUEHILL,
        TESTXPERT,
        TESTSUITE,
        MTS793,
        TRAPEZIUM,
        WALTERBAI,
        BAM,
        UMT,
        TE67,
        CSM,
        PCS,
        LABVIEW,
        RHEOCOMPASS,
        NEWPORT,
        RTEC,
        DELIMITED,
    )
}


def family_of(source: Source) -> Family:
    """The first family that recognises the content."""
    return next(f for f in READERS.values() if f.recognises(source))


def open_sources(path: Path, file: str) -> tuple[Source, ...]:
    """The sheets of a workbook, the groups of a .tdms file, the variables of a .mat file, or the one text of another.

    A .gz, and a .zip with one entry, count as what is in them; ``a.zip/b.csv`` is one of several entries.

    Raises
    ------
    ReadError
        The file is missing, empty, binary, too large, or damaged as a whole.
    """
    raw = export_bytes(path, file)
    head = raw[:16]
    if is_workbook(raw):
        return open_workbook(path, file, raw)
    if is_tdms(head):
        return open_tdms(path, file, raw)
    if is_matlab(head):
        return (open_matlab(path, file, raw),)
    return (with_times_written(open_text(path, file, raw)),)
