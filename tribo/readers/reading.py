"""The table of format families, and the way from a path to the sources in it.

Every table of an export with its columns, its numbers in SI units, and the doubts about it.

From an export to traces in SI units, with all doubts.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from tribo.errors import Problem, ReadError
from tribo.readers.checks import NO_TIME, Finding, beyond_measurement, check_scale, check_time, complete
from tribo.readers.columns import Assignment, Column, Columns, Given, assign, parse_columns
from tribo.readers.core.family import Family
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
from tribo.readers.layout import Block, Layout, cut, names_beside, sniff, split_blocks, whole_block
from tribo.readers.parsing import ambiguity, ambiguous_mark, parse_block
from tribo.readers.source import HEAD_BYTES, Source, export_bytes, open_text
from tribo.readers.wide_tables import looks_wide, parted, records_side_by_side
from tribo.records import Correction, ExportFormat, FloatArray, Trace
from tribo.units import QUANTITIES

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


_WIDE = 'for several records side by side: friction_force = "* [N]", or "F* [N]" for the columns whose names begin so'
_FLAGS = {"missing_unit": "column_without_unit"}
_CLOCK = re.compile(r"(?<!\d)\d{1,2}:\d\d:\d\d(?!\d)")


@dataclass(frozen=True)
class Reading:
    """One table: its position, the meaning of its columns, the numbers by quantity in SI units, the doubts."""

    source: Source
    family: Family
    block: Block
    assignment: Assignment
    arrays: dict[str, FloatArray]
    findings: tuple[Finding, ...]
    skipped: int = 0  # rows of the block that belong to a trace before this one

    def row_of(self, sample: int) -> int:
        """Line of the file, from 1, of a sample, from 0."""
        return _row_of(self.source, self.block, self.skipped + sample)


@dataclass(frozen=True)
class Contents:
    """All tables of an export that are traces, the problems of those that could not be read, and the rest.

    ``others`` are the labels of tables without a time or a friction force, ``footer`` closing lines.
    """

    readings: tuple[Reading, ...]
    problems: tuple[Problem, ...] = ()
    others: tuple[str, ...] = ()
    footer: tuple[str, ...] = ()


def read_source(source: Source, given: Given) -> Contents:
    """The tables of one text, sheet or set of variables.

    Raises
    ------
    ReadError
        There is no table at all, or the one there is cannot be read.
    """
    family = family_of(source)
    layout = layout_of(source, given)
    try:
        records = records_side_by_side(layout, given)
    except ReadError as why:
        raise ReadError(replace(p, file=source.file, row=layout.names_row) for p in why.problems) from None
    if records:
        return _gather(list(parted(source, layout, records, given)), family)
    if source.arrays:
        return Contents((_read_block(source, family, Block(layout, 0, 0), given),))
    whole = whole_block(source, layout)
    try:
        return Contents((_read_block(source, family, whole, given),))
    except ReadError:
        blocks, footer = split_blocks(source, layout, given)
        if len(blocks) == 1 and blocks[0].end == whole.end:
            raise
    return replace(_gather([(source, block, given) for block in blocks], family), footer=footer)


def layout_of(source: Source, given: Given) -> Layout:
    """The layout of the first table, names from a sidecar where the file has none.

    Raises
    ------
    ReadError
        There is no table.
    """
    if source.arrays:
        n = len(source.names)
        return Layout("", ".", 0, n, source.names, ("",) * n, (True,) * n)
    return _named_from_beside(source, sniff(source, given, source.start))


def _named_from_beside(source: Source, layout: Layout) -> Layout:
    """The layout with the names of a sidecar where the file itself has none."""
    found = None if any(layout.names) or source.part else names_beside(source.path, layout.n_cells)
    if found is None:
        return layout
    return replace(layout, names=found[0], metadata={**layout.metadata, "names of columns from": found[1]})


def _gather(parts: Sequence[tuple[Source, Block, Given]], family: Family) -> Contents:
    readings: list[Reading] = []
    problems: list[Problem] = []
    misfits: list[Problem] = []
    others: list[str] = []
    for source, block, given in parts:
        try:
            readings.append(_read_block(source, family, block, given))
        except ReadError as why:
            if all(p.kind == "missing_column" for p in why.problems):
                others.append(block.label)
                misfits.extend(why.problems)
            else:
                problems.extend(why.problems)
    if not readings:
        raise ReadError(problems or misfits[:2])
    timed = [r for r in readings if not any(f.flag == NO_TIME for f in r.findings)]
    if timed:  # a table of peaks or results beside records has no time and is none
        others += [r.block.label for r in readings if not any(r is other for other in timed)]
        readings = timed
    return Contents(tuple(readings), tuple(problems), tuple(others))


def _read_block(source: Source, family: Family, block: Block, given: Given) -> Reading:
    layout = block.layout
    try:
        assignment = assign(layout.names, layout.units, layout.filled, given.with_hints(family.hints(source, layout)))
    except ReadError as why:
        row = layout.units_row or layout.names_row
        problems = [replace(p, file=source.file, row=row) for p in why.problems]
        if layout.misfit:
            problems.insert(0, Problem("names_do_not_fit", layout.misfit, source.file, layout.names_row))
        problems = [_of_a_clock(p, source, block) for p in problems]
        if family.advice:
            problems = [replace(p, allowed=family.advice) for p in problems]
        elif looks_wide(layout):
            problems = [replace(p, allowed=f"{_WIDE}; {p.allowed}") for p in problems]
        raise ReadError(problems) from None
    used = [c.index for c in assignment.columns]
    if not given.decimal:
        _refuse_ambiguous_marks(source, block, used)
    written, end = parse_block(source, block, used)
    arrays = {c.quantity: _in_si(row, c) for c, row in zip(assignment.columns, written, strict=True)}
    arrays, assignment, completed = complete(arrays, assignment, given.correction, source.file)
    labels = {c.quantity: c.label for c in assignment.columns}
    impossible = beyond_measurement(arrays, source.file, labels, partial(_row_of, source, block))
    if impossible:
        raise ReadError(impossible)
    findings = (*_findings(source, block, assignment, arrays), *completed)
    findings += (Finding(end.kind, end),) if end else ()
    return Reading(source, family, block, assignment, arrays, findings)


def _refuse_ambiguous_marks(source: Source, block: Block, used: Sequence[int]) -> None:
    """Refuse a table in which no number tells decimals from thousands."""
    if source.arrays:
        return
    head = "\n".join(source.lines(block.start, min(HEAD_BYTES, block.end - block.start))[0])
    if ambiguous_mark(head, block.layout, used) is None:
        return
    first: Problem | None = None
    for chunk in source.chunks(block.start, block.end):
        found = ambiguous_mark(source.text(chunk), block.layout, used)
        if found is None:
            return
        row, column = block.layout.header_rows + 1 + found[0], block.layout.name(found[1])
        first = first or ambiguity(source.file, row, column, found[2])
    if first is not None:
        raise ReadError(first)


def _of_a_clock(problem: Problem, source: Source, block: Block) -> Problem:
    """A clearer problem where a time without a unit is a time of day."""
    if problem.kind != "missing_unit" or source.arrays or problem.column not in block.layout.names:
        return problem
    cells = cut(source.lines(block.start, HEAD_BYTES)[0][0], block.layout.delimiter)
    index = block.layout.names.index(problem.column)
    if index >= len(cells) or not _CLOCK.search(cells[index]):
        return problem
    what = "a time of day, not a time in seconds"
    allowed = 'a column in seconds, or a row counter with the sampling interval as its unit: time = "NAME [0.01 s]"'
    return replace(problem, kind="time_of_day", what=what, found=cells[index], allowed=f"{allowed} in columns")


def _in_si(numbers: FloatArray, column: Column) -> FloatArray:
    """Numbers as written in SI units, in their own memory: a long record is not held twice."""
    if (column.factor, column.offset) != (1.0, 0.0):
        numbers *= column.factor
        numbers += column.offset
    return numbers


def _findings(
    source: Source, block: Block, assignment: Assignment, arrays: dict[str, FloatArray]
) -> tuple[Finding, ...]:
    row_of = partial(_row_of, source, block)
    label = {c.quantity: c.label for c in assignment.columns}
    found = check_time(arrays["time"], source.file, label["time"], row_of)
    checked = ["displacement"] if _load_varies(arrays) else ["friction force", "displacement"]
    for quantity in checked:
        if quantity in arrays:
            found += check_scale(arrays[quantity], source.file, label[quantity], row_of)
    row = block.layout.units_row or block.layout.names_row
    doubts = [replace(p, file=source.file, row=row) for p in assignment.doubts]
    return (*found, *(Finding(_FLAGS.get(p.kind, p.kind), p) for p in doubts))


def _load_varies(arrays: dict[str, FloatArray]) -> bool:
    """Whether the normal force changes by half or more: a tenfold load gives a tenfold friction."""
    load = arrays.get("normal force")
    return load is not None and bool(np.ptp(load) > 0.5 * np.abs(load).max())


def _row_of(source: Source, block: Block, sample: int) -> int:
    """Line of the file, from 1, of a sample; blank lines hold none."""
    if source.arrays:
        return sample + 1
    row, seen = block.layout.header_rows, -1
    for chunk in source.chunks(block.start, block.end):
        for line in chunk.split(b"\n"):
            row += 1
            seen += bool(line.strip())
            if seen == sample:
                return row
        row -= 1  # a chunk ends with its last line's end
    return row


def split_at_restarts(reading: Reading) -> tuple[Reading, ...]:
    """The reading cut where its time starts again from the beginning; itself where time runs back otherwise."""
    time = reading.arrays["time"]
    step = np.diff(time)
    starts = np.flatnonzero(step < 0) + 1
    near = 3.0 * abs(float(np.median(step))) if step.size else 0.0
    if not starts.size or np.any(np.abs(time[starts] - time[0]) > near):
        return (reading,)
    parts = []
    for k, (first, stop) in enumerate(zip([0, *starts], [*starts, time.size], strict=True)):
        arrays = {q: values[first:stop] for q, values in reading.arrays.items()}
        block = replace(reading.block, label=f"{reading.block.label or 'part'}, start {k + 1} of time")
        others = tuple(f for f in reading.findings if f.flag != "time_goes_back")
        parts.append(replace(reading, block=block, arrays=arrays, findings=others, skipped=int(first)))
    return tuple(parts)


_CHOICE = re.compile(r"(.+)#(\d+)")


def read_export(
    path: Path | str,
    *,
    columns: Columns | None = None,
    correction: Correction | None = None,
    name: str | None = None,
    file: str | None = None,
) -> Trace:
    """Read an export with one pull and convert it to SI units; the data points stay as recorded.

    Parameters
    ----------
    path : Path
        The export; ``PATH#2`` is its second table where it holds several. Family, encoding, delimiter,
        decimal mark and header are found from the content.
    columns : mapping, optional
        ``{quantity: "name [unit]"}`` overrides what the names say, e.g. ``{"friction force": "Fx [gf]"}``;
        ``"#3 [N]"`` is the third column. A unit may carry a number: ``"Fnorm [30.7 gf]"``. ``"none"`` leaves a
        quantity out, ``ignore`` lists columns not to look at, ``decimal`` is the decimal mark.
    correction : Correction, optional
        Sign, gain and lever arm of the friction force; sampling rate or speed where the export has no time.
    name : str, optional
        Name of the trace (the test_id); the file's stem by default.
    file : str, optional
        What the file is called in problems; the path by default.

    Returns
    -------
    Trace
        time in s, force in N, displacement in m where there is one, other quantities in ``columns``.

    Raises
    ------
    ReadError
        Every fault at once, with file, row, column, what was found and what is allowed: missing, empty,
        bom_only, header_only, not_an_export, missing_column, missing_unit, unknown_unit, truncated_mid_row,
        wrong_number_of_cells, text_in_numbers, two_decimal_marks, nan_gap, time_goes_back, scale_jump,
        several_tables.
    """
    path, choice = _split_choice(Path(path))
    traces = _read(path, parse_columns(columns, correction), name, file, split=choice is not None)
    if choice is None and len(traces) == 1:
        return traces[0]
    if choice is not None and 1 <= choice <= len(traces):
        return traces[choice - 1]
    shown = path.name
    what = f"this export contains {len(traces)} traces"
    allowed = f"one of {shown}#1 to {shown}#{len(traces)}; in a campaign also {shown}#* for all pulls"
    raise ReadError(Problem("several_tables", what, file=file or str(path), allowed=allowed))


def read_blocks(
    path: Path | str,
    *,
    columns: Columns | None = None,
    correction: Correction | None = None,
    name: str | None = None,
    file: str | None = None,
) -> tuple[Trace, ...]:
    """Every table of an export that is a trace: steps, segments, strokes or specimens, in the order of the file.

    Arguments and errors are those of :func:`read_export`, except several_tables. A table whose time starts again
    is split there. The traces are named ``name#1``, ``name#2`` and so on if there are several.
    """
    return _read(Path(path), parse_columns(columns, correction), name, file, split=True)


def _split_choice(path: Path) -> tuple[Path, int | None]:
    """("raw/a.csv", 2) of "raw/a.csv#2", unless a file of that name is there."""
    chosen = _CHOICE.fullmatch(path.name)
    if chosen is None or path.exists():
        return path, None
    return path.with_name(chosen[1]), int(chosen[2])


def _read(path: Path, given: Given, name: str | None, file: str | None, *, split: bool) -> tuple[Trace, ...]:
    file = str(path) if file is None else file
    name = path.stem if name is None else name
    readings = [
        part
        for reading in read_contents(path, given, file).readings
        for part in (split_at_restarts(reading) if split else (reading,))
    ]
    fatal = [f.problem for reading in readings for f in reading.findings if f.fatal]
    if fatal:
        raise ReadError(fatal)
    if len(readings) == 1:
        return (_trace(readings[0], name, file),)
    return tuple(_trace(reading, f"{name}#{k}", file) for k, reading in enumerate(readings, start=1))


def read_contents(path: Path, given: Given, file: str, *, beginning_only: bool = False) -> Contents:
    """All tables of an export that are traces, of all sheets; a sheet without any counts only if none has.

    With ``beginning_only`` no more is read of a large file than tells what it is.

    Raises
    ------
    ReadError
        No table can be read, or one of several cannot.
    """
    found, refused = [], []
    for source in open_sources(path, file):
        try:
            found.append(read_source(source.beginning_only() if beginning_only else source, given))
        except ReadError as why:
            refused.append(why)
    problems = [p for contents in found for p in contents.problems]
    if not found or problems:
        raise ReadError(problems or [p for why in refused for p in why.problems])
    return Contents(
        readings=tuple(r for contents in found for r in contents.readings),
        others=tuple(label for contents in found for label in contents.others),
        footer=tuple(line for contents in found for line in contents.footer),
    )


def _trace(reading: Reading, name: str, file: str) -> Trace:
    arrays = dict(reading.arrays)
    return Trace(
        name=name,
        time_s=arrays.pop("time"),
        force_N=arrays.pop("friction force"),
        displacement_m=arrays.pop("displacement", None),
        columns={QUANTITIES[quantity].column: values for quantity, values in arrays.items()},
        metadata=reading.block.layout.metadata,
        source=export_format(reading),
        file=file,
        flags=tuple(dict.fromkeys(f.flag for f in reading.findings)),
        problems=tuple(f.problem for f in reading.findings),
        first_row=reading.block.layout.header_rows + 1 + reading.skipped,
    )


def export_format(reading: Reading) -> ExportFormat:
    """How a table was read."""
    layout = reading.block.layout
    return ExportFormat(
        family=reading.family.name,
        encoding=reading.source.encoding,
        delimiter=layout.delimiter,
        decimal=layout.decimal,
        header_rows=layout.header_rows,
        columns={c.quantity: c.label for c in reading.assignment.columns},
        reasons={c.quantity: c.reason for c in reading.assignment.columns},
    )
