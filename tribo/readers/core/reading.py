"""Every table of an export with its columns, its numbers in SI units, and the doubts about it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from tribo.errors import Problem, ReadError
from tribo.readers.core.assign import Assignment, Column, assign
from tribo.readers.core.body import parse_block
from tribo.readers.core.checks import Finding, beyond_measurement, check_scale, check_time
from tribo.readers.core.complete import NO_TIME, complete
from tribo.readers.core.family import Family
from tribo.readers.core.given import Given
from tribo.readers.core.grouping import ambiguity, ambiguous_mark
from tribo.readers.core.layout import Layout, cut, sniff
from tribo.readers.core.sidecar import names_beside
from tribo.readers.core.source import HEAD_BYTES, Source
from tribo.readers.core.tables_in_file import Block, split_blocks, whole_block
from tribo.readers.core.wide import looks_wide, parted, records_side_by_side
from tribo.readers.families import family_of
from tribo.records import FloatArray

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
