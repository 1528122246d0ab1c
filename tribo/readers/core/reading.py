"""Every table of an export with its columns, its numbers in SI units, and the doubts about it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from tribo.errors import Problem, ReadError
from tribo.readers.core.assign import Assignment, Column, Hint, assign, is_asked_for
from tribo.readers.core.body import parse_block
from tribo.readers.core.checks import Finding, beyond_measurement, check_scale, check_time
from tribo.readers.core.family import Family
from tribo.readers.core.layout import Layout, cut, sniff
from tribo.readers.core.sidecar import names_beside
from tribo.readers.core.source import HEAD_BYTES, Source
from tribo.readers.core.tables_in_file import Block, side_by_side, split_blocks, whole_block
from tribo.readers.families import family_of
from tribo.records import FloatArray

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


def read_source(source: Source, asked: tuple[Hint, ...]) -> Contents:
    """The tables of one text, sheet or set of variables.

    Raises
    ------
    ReadError
        There is no table at all, or the one there is cannot be read.
    """
    family = family_of(source)
    layout = layout_of(source, asked)
    if source.arrays:
        return Contents((_read_block(source, family, Block(layout, 0, 0), asked),))
    named = partial(is_asked_for, hints=asked)
    beside = list(side_by_side(layout))
    if beside:
        parts = [_specimen(source, layout, columns, number) for number, columns in beside]
        return _gather([(part, block) for part, block in parts], family, asked)
    whole = whole_block(source, layout)
    try:
        return Contents((_read_block(source, family, whole, asked),))
    except ReadError:
        blocks, footer = split_blocks(source, layout, named)
        if len(blocks) == 1 and blocks[0].end == whole.end:
            raise
    return replace(_gather([(source, block) for block in blocks], family, asked), footer=footer)


def layout_of(source: Source, asked: tuple[Hint, ...]) -> Layout:
    """The layout of the first table, names from a sidecar where the file has none.

    Raises
    ------
    ReadError
        There is no table.
    """
    if source.arrays:
        n = len(source.names)
        return Layout("", ".", 0, n, source.names, ("",) * n, (True,) * n)
    return _named_from_beside(source, sniff(source, partial(is_asked_for, hints=asked), source.start))


def _named_from_beside(source: Source, layout: Layout) -> Layout:
    """The layout with the names of a sidecar where the file itself has none."""
    found = None if any(layout.names) or source.part else names_beside(source.path, layout.n_cells)
    if found is None:
        return layout
    return replace(layout, names=found[0], metadata={**layout.metadata, "names of columns from": found[1]})


def _gather(parts: Sequence[tuple[Source, Block]], family: Family, asked: tuple[Hint, ...]) -> Contents:
    readings: list[Reading] = []
    problems: list[Problem] = []
    misfits: list[Problem] = []
    others: list[str] = []
    for source, block in parts:
        try:
            readings.append(_read_block(source, family, block, asked))
        except ReadError as why:
            if all(p.kind == "missing_column" for p in why.problems):
                others.append(block.label)
                misfits.extend(why.problems)
            else:
                problems.extend(why.problems)
    if not readings:
        raise ReadError(problems or misfits[:2])
    return Contents(tuple(readings), tuple(problems), tuple(others))


def _read_block(source: Source, family: Family, block: Block, asked: tuple[Hint, ...]) -> Reading:
    layout = block.layout
    hints = asked + family.hints(source, layout)
    try:
        assignment = assign(layout.names, layout.units, layout.filled, hints)
    except ReadError as why:
        row = layout.units_row or layout.names_row
        problems = [replace(p, file=source.file, row=row) for p in why.problems]
        if layout.misfit:
            problems.insert(0, Problem("names_do_not_fit", layout.misfit, source.file, layout.names_row))
        problems = [_of_a_clock(p, source, block) for p in problems]
        if family.advice:
            problems = [replace(p, allowed=family.advice) for p in problems]
        raise ReadError(problems) from None
    columns = assignment.columns
    written = parse_block(source, block, [c.index for c in columns])
    arrays = {c.quantity: _in_si(row, c) for c, row in zip(columns, written, strict=True)}
    labels = {c.quantity: c.label for c in columns}
    impossible = beyond_measurement(arrays, source.file, labels, partial(_row_of, source, block))
    if impossible:
        raise ReadError(impossible)
    findings = _findings(source, block, assignment, arrays)
    return Reading(source, family, block, assignment, arrays, findings)


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
    left_out = [replace(p, file=source.file, row=row) for p in assignment.left_out]
    return (*found, *(Finding("column_without_unit", p) for p in left_out))


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


def _specimen(source: Source, layout: Layout, columns: tuple[int, ...], number: int) -> tuple[Source, Block]:
    """One of several specimens side by side, as a table of its own that keeps the rows of the file."""
    text = source.text(bytes(source.data[source.offset(source.start, layout.header_rows) :]))
    rows = [cut(line, layout.delimiter) for line in text.split("\n") if line.strip()]
    rows = [row for row in rows if any(k < len(row) and row[k] for k in columns)]
    delimiter = layout.delimiter if layout.delimiter != layout.decimal else "\t"
    lines = [delimiter.join(row[k] if k < len(row) else "" for k in columns) for row in rows]
    data = ("\n" * layout.header_rows + "\n".join(lines) + "\n").encode(source.codec, errors="replace")
    alone = replace(
        layout,
        delimiter=delimiter,
        n_cells=len(columns),
        names=tuple(layout.names[k] for k in columns),
        units=tuple(layout.units[k] for k in columns),
        filled=tuple(layout.filled[k] for k in columns),
    )
    above = [cut(line, layout.delimiter) for line in source.head[: (layout.names_row or 1) - 1]]
    label = next((row[columns[0]] for row in reversed(above) if columns[0] < len(row)), "") or f"specimen {number}"
    part = replace(source, data=data, start=0, part=label)
    return part, replace(whole_block(part, alone), label=label)


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
