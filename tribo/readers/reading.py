"""From an export to traces in SI units, with all doubts."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np

from tribo.errors import Problem, ReadError
from tribo.input_files import OLD_EXCEL, ZIP, sheets_as_text
from tribo.readers.binary_machines import BINARY_MACHINES
from tribo.readers.checks import (
    NO_TIME,
    STROKE,
    Arrays,
    beyond_measurement,
    check_scale,
    check_time,
    complete,
    spread_over_ticks,
    why_no_path,
)
from tribo.readers.clocks import by_the_clock
from tribo.readers.columns import (
    ACCEPTABLE,
    ROWS_LEFT_OUT,
    Column,
    Columns,
    Given,
    assign,
    match_column,
    parse_columns,
)
from tribo.readers.layout import Layout, cut, first_table, tables_one_below_the_other
from tribo.readers.parsing import parse_block, refuse_ambiguous_marks
from tribo.readers.source import HEAD_BYTES, Source, export_bytes, is_workbook_archive, open_text
from tribo.readers.text_machines import TEXT_MACHINES, Machine
from tribo.readers.wide_tables import looks_wide, records_side_by_side
from tribo.records import Correction, ExportFormat, FloatArray, Trace
from tribo.units import QUANTITIES

READERS: dict[str, Machine] = {machine.name: machine for machine in (*BINARY_MACHINES, *TEXT_MACHINES)}
FATAL = ("time_goes_back", "scale_jump")  # damage for which a table is set aside
_WRITTEN_IN_BLOCKS = ("mts793", "testsuite")  # one header for each buffer of a long acquisition
_FLAGS = {"missing_unit": "column_without_unit"}  # of a trace, where it is not the kind of the problem
_CHOICE = re.compile(r"(.+)#(\d+)")
_WIDE = 'for several records side by side: friction_force = "* [N]", or "F* [N]" for the columns whose names begin so'
_INSTEAD_OF_A_CLOCK = (
    'a column in seconds, or a row counter with the sampling interval as its unit: time = "NAME [0.01 s]" in columns'
)
_FEWEST_ALIKE = 50  # rows with one value, from which a column is said to be constant
_ALONG_X = re.compile(r"((?:.*(?:\b|_))?[Ff]?)([xX])(\b.*)")  # "Fx [N]", "F_x", "DAQ.Fx (N)", "Force X"
_CLOCK = re.compile(r"(?<![\d:])\d{1,3}:\d\d(?::\d\d)?(?![\d:])")


@dataclass(frozen=True)
class ReadTable:
    """One table: its position, the meaning of its columns, the numbers by quantity in SI units, the doubts."""

    source: Source
    machine: Machine
    layout: Layout
    columns: tuple[Column, ...]
    arrays: Arrays
    findings: tuple[Problem, ...]
    skipped: int = 0  # rows of the table that belong to a trace before this one
    passed_over: Mapping[int, str] = field(default_factory=dict)  # columns by position, and why they are not used

    def row_of(self, sample: int) -> int:
        """Line of the file, from 1, of a sample, from 0."""
        return _row_of(self.source, self.layout, self.skipped + sample)


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

    Examples
    --------
    >>> trace = tribo.read_export("data/example/raw/T001.csv")
    >>> trace.name, trace.source.family, trace.force_N.size, trace.source.columns["friction force"]
    ('T001', 'bluehill', 400, 'Load [N]')
    """
    path, chosen = split_choice(Path(path))
    file = str(path) if file is None else file
    name = path.stem if name is None else name
    readings, _, _ = read_tables(path, parse_columns(columns, correction), file)
    if chosen is not None:
        readings = [part for reading in readings for part in split_at_restarts(reading)]
        name = f"{name}#{chosen}" if len(readings) > 1 else name
    (trace,) = _traces([one_of(readings, chosen, file)], name, file, split=False)
    return trace


def split_choice(path: Path) -> tuple[Path, int | None]:
    """(a.csv, 2) of a.csv#2 where no file is called so."""
    chosen = None if path.exists() else _CHOICE.fullmatch(path.name)
    return (path, None) if chosen is None else (path.with_name(chosen[1]), int(chosen[2]))


def one_of(readings: Sequence[ReadTable], chosen: int | None, file: str) -> ReadTable:
    """The reading of a number, or the only one.

    Raises
    ------
    ReadError
        several_tables.
    """
    number, file = chosen or 1, file.partition("#")[0]
    if number in range(1, len(readings) + 1) and (chosen is not None or len(readings) == 1):
        return readings[number - 1]
    what = f"this export contains {len(readings)} traces"
    allowed = f"one of {file}#1 to {file}#{len(readings)}; in a campaign also {file}#* for all pulls"
    raise ReadError(Problem("several_tables", what, file=file, allowed=allowed))


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
    path = Path(path)
    file = str(path) if file is None else file
    readings, _, _ = read_tables(path, parse_columns(columns, correction), file)
    return _traces(readings, path.stem if name is None else name, file, split=True)


def _traces(readings: Sequence[ReadTable], name: str, file: str, *, split: bool) -> tuple[Trace, ...]:
    """Each table as a trace, cut where its time starts again if that is wanted; ReadError where one is damaged."""
    if split:
        readings = [part for reading in readings for part in split_at_restarts(reading)]
    fatal = [problem for reading in readings for problem in reading.findings if problem.kind in FATAL]
    if fatal and not split and (n := len(list(split_at_restarts(readings[0])))) > 1:
        export = file.partition("#")[0]
        choice = f"; it starts again: one of {export}#1 to {export}#{n}"
        fatal = [replace(p, allowed=f"{p.allowed}{choice}") if p.kind == "time_goes_back" else p for p in fatal]
    if fatal:
        raise ReadError(fatal)
    names = [name] if len(readings) == 1 else [f"{name}#{k + 1}" for k in range(len(readings))]
    traces = []
    for one, reading in zip(names, readings, strict=True):
        arrays, layout = dict(reading.arrays), reading.layout
        source = ExportFormat(
            family=reading.machine.name,
            encoding=reading.source.encoding,
            delimiter=layout.delimiter,
            decimal=layout.decimal,
            header_rows=layout.header_rows,
            columns={c.quantity: c.label for c in reading.columns},
            reasons={c.quantity: c.reason for c in reading.columns},
        )
        trace = Trace(
            name=one,
            time_s=arrays.pop("time"),
            force_N=arrays.pop("friction force"),
            displacement_m=arrays.pop("displacement", None),
            columns={QUANTITIES[quantity].column: values for quantity, values in arrays.items()},
            metadata=layout.metadata,
            source=source,
            file=file,
            flags=tuple(dict.fromkeys(_FLAGS.get(p.kind, p.kind) for p in reading.findings)),
            problems=reading.findings,
            first_row=layout.header_rows + 1 + reading.skipped,
        )
        traces.append(trace)
    return tuple(traces)


def read_tables(
    path: Path, given: Given, file: str, *, beginning_only: bool = False
) -> tuple[list[ReadTable], list[str], list[str]]:
    """All tables of an export that are traces, of all sheets; a sheet without any counts only if none has.

    Returns
    -------
    readings, others, footer
        ``others`` are the labels of tables without a time or a friction force, ``footer`` closing lines. With
        ``beginning_only`` no more is read of a large file than tells what it is.

    Raises
    ------
    ReadError
        No table can be read, or one of several cannot.
    """
    readings: list[ReadTable] = []
    others: list[str] = []
    footer: list[str] = []
    problems: list[Problem] = []  # of tables beside others that can be read
    refused: list[Problem] = []
    for source in open_sources(path, file):
        if beginning_only:
            source = source.beginning_only()
        try:
            machine, layout = machine_of(source), first_table(source, given)
            parts = list(records_side_by_side(source, layout, given))
        except ReadError as why:
            refused += why.problems
            continue
        outcomes = [read_table(machine, *part) for part in parts or [(source, layout, given)]]
        end: Sequence[str] = ()
        if not parts and _lacks_time(outcomes[0]) and (timed := by_the_clock(source, layout, given)) is not None:
            source, stated = timed
            try:
                outcomes = [read_table(machine, source, first_table(source, stated), stated)]
            except ReadError as why:
                outcomes = [why]
        if not parts and isinstance(outcomes[0], ReadError) and not source.arrays:
            tables, end = tables_one_below_the_other(source, layout, given)
            if len(tables) > 1 or tables[0].end != layout.end:
                parts = [(source, table, given) for table in tables]
                outcomes = [read_table(machine, *part) for part in parts]
        read, labels, faults, misfits = _sorted_out(outcomes, [table.label for _, table, _ in parts] or [""])
        if read:
            readings += _of_one_buffer(read) if machine.name in _WRITTEN_IN_BLOCKS else read
            others += labels
            footer += end
            problems += faults
        else:
            refused += faults or (misfits[:2] if parts else misfits)
    if problems or not readings:
        raise ReadError(problems or refused)
    return readings, others, footer


def _of_one_buffer(read: Sequence[ReadTable]) -> list[ReadTable]:
    """Blocks of one acquisition, of which each goes on one time step after the last, as the record they are cut from.

    Rows are then counted as if the headers between them were rows as well. Buffers are alike in size, but for a shorter
    last one; a header that stands again elsewhere is a doubt.
    """
    records = [[read[0]]]
    for block in read[1:]:
        before, time = records[-1][-1], block.arrays["time"]
        so_far = before.arrays["time"]
        same = (block.layout.names, block.columns) == (before.layout.names, before.columns)
        step = float(np.median(np.diff(so_far))) if so_far.size > 1 else 0.0
        if same and step > 0 and abs(time[0] - so_far[-1] - step) < step / 2:
            records[-1].append(block)
        else:
            records.append([block])
    return [
        replace(
            blocks[0],
            layout=replace(blocks[0].layout, end=blocks[-1].layout.end),
            arrays={q: np.concatenate([b.arrays[q] for b in blocks]) for q in blocks[0].arrays},
            findings=(*(problem for b in blocks for problem in b.findings), *_copied_header(blocks)),
        )
        if len(blocks) > 1
        else blocks[0]
        for blocks in records
    ]


def _copied_header(blocks: Sequence[ReadTable]) -> list[Problem]:
    """A doubt of blocks that are no series of buffers: the header above the second may be a copy."""
    sizes = [b.arrays["time"].size for b in blocks]
    if len(blocks) > 2 and len(set(sizes[:-1])) == 1 and sizes[-1] <= sizes[0]:
        return []
    file, row = blocks[1].source.file, blocks[1].row_of(0) - 1
    what = "the header stands again in the middle of the table; the rows above and below it were read as one record"
    return [Problem("header_again", what, file, row, allowed="one header above all rows")]


def _lacks_time(outcome: ReadTable | ReadError) -> bool:
    """Whether a table has no time, or a time of day where seconds are wanted."""
    if isinstance(outcome, ReadTable):
        return any(p.kind == NO_TIME for p in outcome.findings)
    return any(p.kind == "time_of_day" or "recognised as the time" in p.what for p in outcome.problems)


def _sorted_out(
    outcomes: Sequence[ReadTable | ReadError], labels: Sequence[str]
) -> tuple[list[ReadTable], list[str], list[Problem], list[Problem]]:
    """The tables that are traces, labels of those that are none, problems, and columns that the latter lack."""
    read: list[ReadTable] = []
    others: list[str] = []
    problems: list[Problem] = []
    misfits: list[Problem] = []
    for outcome, label in zip(outcomes, labels, strict=True):
        if isinstance(outcome, ReadTable):
            read.append(outcome)
        elif all(p.kind in ("missing_column", "header_only") for p in outcome.problems):
            others.append(label)
            misfits += outcome.problems
        else:
            problems += outcome.problems
    timed = [r for r in read if not any(p.kind == NO_TIME for p in r.findings)]
    if timed:  # a table of peaks or results beside records has no time and is none
        others += [r.layout.label for r in read if not any(r is other for other in timed)]
    return timed or read, others, problems, misfits


def open_sources(path: Path, file: str) -> tuple[Source, ...]:
    """The sheets of a workbook, the arrays of a binary file, or the one text of another.

    A .gz, and a .zip with one entry, count as what is in them; ``a.zip/b.csv`` is one of several entries.

    Raises
    ------
    ReadError
        The file is missing, empty, binary, too large, or damaged as a whole.
    """
    raw = export_bytes(path, file)
    if raw[:4] == OLD_EXCEL or (raw[:4] == ZIP and is_workbook_archive(raw)):
        texts = sheets_as_text(raw[:], file)
        return tuple(
            Source(path, f"{file} [{name}]" if len(texts) > 1 else file, text.encode(), "utf-8", part=name)
            for name, text in texts.items()
        )
    undecoded = Source(path, file, raw, "binary")
    for machine in BINARY_MACHINES:
        if machine.opens is not None and machine.recognises(undecoded):
            return tuple(replace(source, machine=machine.name) for source in machine.opens(undecoded))
    source = open_text(path, file, raw)
    for machine in TEXT_MACHINES:
        if machine.as_table is not None and machine.recognises(source):
            return (machine.as_table(source),)
    return (source,)


def machine_of(source: Source) -> Machine:
    """The machine that wrote a binary file, the first that recognises the content of a text."""
    return READERS[source.machine] if source.machine else next(m for m in TEXT_MACHINES if m.recognises(source))


def read_table(machine: Machine, source: Source, layout: Layout, given: Given) -> ReadTable | ReadError:
    """A table as a trace would hold it, or what keeps it from being one.

    A column that was not asked for is passed over where it cannot be what its name says: one without a number, one of
    zeros beside another of the same quantity, a coordinate that never changes.
    """
    given = given.with_hints(machine.hints(source, layout))
    passed_over: dict[int, str] = {}
    empty_start: list[Problem] = []
    while True:
        ignored = (*given.ignored, *(f"#{index + 1}" for index in passed_over))
        read = _read_columns(machine, source, layout, replace(given, ignored=ignored))
        if isinstance(read, ReadError):
            unwanted = _without_numbers(read, source, layout, given)
            if not unwanted and not empty_start and (later := _first_whole_row(read, source, layout)):
                first, n = layout.header_rows + 1, later.header_rows - layout.header_rows
                layout = later
                what = f"{n} rows at the start lack a value and are left out; this is the first"
                empty_start = [Problem("empty_start", what, source.file, first)]
                continue
        else:
            columns, written, _, _ = read
            unwanted = _says_nothing(columns, written, layout, set(passed_over))
        unwanted = {index: why for index, why in unwanted.items() if index not in passed_over}
        if not unwanted:
            break
        passed_over |= unwanted
    if isinstance(read, ReadError):
        return read
    columns, written, doubts, left_out = read
    if not written.size:
        problem = Problem("header_only", "a header without data rows", source.file, layout.header_rows)
        return ReadError(problem)
    if larger := _larger_along_y(columns, written, source, layout, given):
        return ReadError(larger)
    arrays = {c.quantity: numbers for c, numbers in zip(columns, written, strict=True)}
    for c in columns:
        if (c.factor, c.offset) != (1.0, 0.0):  # in their own memory: a long record is not held twice
            arrays[c.quantity] *= c.factor
            arrays[c.quantity] += c.offset
    labels, row_of = {c.quantity: c.label for c in columns}, partial(_row_of, source, layout)
    try:
        impossible = beyond_measurement(arrays, source.file, labels, row_of)
        if not impossible:
            arrays, columns, completed = complete(arrays, columns, given.correction, source.file)
            labels = {c.quantity: c.label for c in columns}
            impossible = beyond_measurement(arrays, source.file, labels, row_of)
    except ReadError as why:
        return why
    if impossible:
        return ReadError(impossible)
    if no_path := why_no_path(arrays, columns, layout.names):
        (it,) = (c for c in columns if c.quantity == "displacement")
        columns = tuple(c for c in columns if c is not it)
        passed_over[it.index] = no_path
        stroke = arrays.pop("displacement")
        if no_path == STROKE and "frequency" in arrays and "speed" not in arrays:
            arrays["speed"] = 2.0 * stroke * arrays["frequency"]
            reason = "mean speed: twice the stroke times the frequency"
            columns = (*columns, Column("speed", -1, it.label, 1.0, 0.0, reason))
    arrays["time"], coarse = spread_over_ticks(arrays["time"], source.file, labels["time"], row_of)
    findings = coarse + check_time(arrays["time"], source.file, labels["time"], row_of)
    load = arrays.get("normal force")
    load_varies = load is not None and bool(np.ptp(load) > 0.5 * np.abs(load).max())
    for quantity in ("displacement",) if load_varies else ("friction force", "displacement"):
        if quantity in arrays:  # but for a force under a load that varies: tenfold load gives tenfold friction
            jumps = check_scale(arrays[quantity], source.file, labels[quantity], row_of)
            findings += [replace(p, kind="accepted") if p.kind in given.accepted else _acceptable(p) for p in jumps]
    row = layout.units_row or layout.names_row
    findings += [replace(doubt, file=source.file, row=row) for doubt in doubts]
    findings += [*completed, *empty_start, *left_out]
    return ReadTable(source, machine, layout, columns, arrays, tuple(findings), passed_over=passed_over)


Written = tuple[tuple[Column, ...], FloatArray, tuple[Problem, ...], list[Problem]]


def _read_columns(machine: Machine, source: Source, layout: Layout, given: Given) -> Written | ReadError:
    """The columns of a table, their numbers as written, doubts about the columns and about rows left out."""
    try:
        columns, doubts = assign(layout.names, layout.units, layout.filled, given)
    except ReadError as why:
        return ReadError(_explained(why, machine, source, layout))
    used = [c.index for c in columns]
    try:
        if not given.decimal:
            refuse_ambiguous_marks(source, layout, used)
        written, left_out = parse_block(source, layout, used, given.accepted)
    except ReadError as why:
        return ReadError(map(_acceptable, why.problems))
    return columns, written, doubts, left_out


def _acceptable(problem: Problem) -> Problem:
    """The damage of a table with the way to accept it, where there is one."""
    if problem.kind not in ACCEPTABLE:
        return problem
    how = "leaves out rows without numbers" if problem.kind in ROWS_LEFT_OUT else "takes them as they are"
    accept = f'accept = "{problem.kind}" in columns {how}'
    return replace(problem, allowed=f"{problem.allowed}; {accept}" if problem.allowed else accept)


def _says_nothing(
    columns: Sequence[Column], written: FloatArray, layout: Layout, passed_over: set[int]
) -> dict[int, str]:
    """Columns taken by their names that cannot be what they say, and why, by their position."""
    meant = {k: hit[0] for k, name in enumerate(layout.names) if name and (hit := match_column(name))}
    taken = {c.index for c in columns}
    found = {}
    for column, numbers in zip(columns, written, strict=True):
        if not column.reason.startswith("named") or numbers.size < _FEWEST_ALIKE or np.any(numbers != numbers[0]):
            continue
        others = {k for k, q in meant.items() if q == column.quantity and layout.filled[k]} - taken - passed_over
        if column.quantity == "displacement" and any(c.quantity == "time" for c in columns):
            found[column.index] = "it never changes, so it is no displacement"
        elif column.quantity != "displacement" and not numbers[0] and others:
            found[column.index] = f"it is zero in every row, unlike {layout.name(min(others))}"
    return found


def _larger_along_y(
    columns: Sequence[Column], written: FloatArray, source: Source, layout: Layout, given: Given
) -> Problem | None:
    """The fault of a force that is read along x while the one along y is the larger: a sensor of three axes.

    It counts as larger if it is twice as large, and changes twice as much from the beginning.
    """
    named = (k for k, c in enumerate(columns) if c.quantity == "friction force" and c.reason.startswith("named"))
    x = next(named, None)
    if x is None or (along_x := _ALONG_X.fullmatch(layout.names[columns[x].index])) is None:
        return None
    called = along_x[1] + ("y" if along_x[2] == "x" else "Y") + along_x[3]
    if called not in layout.names or not layout.filled[layout.names.index(called)]:
        return None
    try:
        across, _ = parse_block(source, layout, [layout.names.index(called)], given.accepted)
    except ReadError:
        return None
    if across.shape[1] != written.shape[1]:
        return None
    of_x, of_y = ((_typical(v), _typical(v - np.median(v[:5]))) for v in (written[x], across[0]))
    if of_y[0] < 2.0 * of_x[0] or of_y[1] < 2.0 * of_x[1]:
        return None
    name = layout.names[columns[x].index]
    allowed = f'friction_force = "{called}" in columns; or friction_force = "{name}" if it is the friction nevertheless'
    what = f"{called} is the larger force along the surface, and {name} would be read as the friction force"
    return Problem("larger_along_y", what, source.file, layout.names_row, name, allowed=allowed)


def _typical(values: FloatArray) -> float:
    return float(np.quantile(np.abs(values), 0.9))


def _without_numbers(why: ReadError, source: Source, layout: Layout, given: Given) -> dict[int, str]:
    """Columns that are refused for having no number in any row that was looked at, by their position."""
    if source.arrays or any(p.kind != "nan_gap" for p in why.problems):
        return {}
    first, _ = source.lines(layout.start, HEAD_BYTES)
    last, _ = source.lines(max(layout.start, layout.end - HEAD_BYTES), HEAD_BYTES)
    rows = [cut(line, layout.delimiter) for line in (*first[:-1], *last[1:]) if line.strip()]
    found = {}
    for index in {layout.names.index(p.column) for p in why.problems if p.column in layout.names}:
        cells = [row[index] for row in rows if index < len(row)]
        if not given.names(layout.names[index]) and not any(map(str.isdigit, "".join(cells))):
            found[index] = "it holds no number"
    return found


def _first_whole_row(why: ReadError, source: Source, layout: Layout) -> Layout | None:
    """The table from its first row on that has a number in every column used, where earlier ones lack one."""
    if source.arrays or any(p.kind != "nan_gap" for p in why.problems):
        return None
    used = [layout.names.index(p.column) for p in why.problems if p.column in layout.names]
    lines, _ = source.lines(layout.start, HEAD_BYTES)
    for k, line in enumerate(lines):
        cells = cut(line, layout.delimiter)
        if used and all(index < len(cells) and any(map(str.isdigit, cells[index])) for index in used):
            start = source.offset(layout.start, k)
            return replace(layout, start=start, header_rows=layout.header_rows + k) if k else None
    return None


def _explained(why: ReadError, machine: Machine, source: Source, layout: Layout) -> list[Problem]:
    """The faults of the columns of a table with their place, and what to state in this case."""
    row = layout.units_row or layout.names_row
    problems = [replace(p, file=source.file, row=row) for p in why.problems]
    if layout.misfit:
        allowed = 'columns by their position: time = "#1 [s]", friction_force = "#2 [N]" in columns'
        problems.insert(0, Problem("names_do_not_fit", layout.misfit, source.file, layout.names_row, allowed=allowed))
    cells = [] if source.arrays else cut(source.lines(layout.start, HEAD_BYTES)[0][0], layout.delimiter)
    for k, problem in enumerate(problems):
        at = layout.names.index(problem.column) if problem.column in layout.names else len(cells)
        if problem.kind in ("missing_unit", "unknown_unit") and at < len(cells) and _CLOCK.search(cells[at]):
            what = "a clock, not a time in seconds"
            problems[k] = replace(problem, kind="time_of_day", what=what, found=cells[at], allowed=_INSTEAD_OF_A_CLOCK)
    if machine.advice:
        # the load that a coefficient needs is no matter of names and units
        problems = [p if p.kind == "missing_load" else replace(p, allowed=machine.advice) for p in problems]
    elif looks_wide(layout):
        problems = [p if p.kind != "missing_column" else replace(p, allowed=_with_wide(p.allowed)) for p in problems]
    return problems


def _with_wide(allowed: str | None) -> str:
    """What is allowed, with the way of a wide table before the list of columns."""
    ways, mark, here = (allowed or "").partition("columns here: ")
    return f"{ways}{_WIDE}; {mark}{here}"


def _row_of(source: Source, layout: Layout, sample: int) -> int:
    """Line of the file, from 1, of a sample; blank lines hold none."""
    if source.arrays:
        return sample + 1
    row, seen = layout.header_rows, -1
    for chunk in source.chunks(layout.start, layout.end):
        for line in chunk.split(b"\n"):
            row += 1
            seen += bool(line.strip())
            if seen == sample:
                return row
        row -= 1  # a chunk ends with its last line's end
    return row


def split_at_restarts(reading: ReadTable) -> Iterator[ReadTable]:
    """The reading cut where its time starts again from the beginning; itself where time runs back otherwise."""
    time = reading.arrays["time"]
    step = np.diff(time)
    starts = np.flatnonzero(step < 0) + 1
    near = 3.0 * abs(float(np.median(step))) if step.size else 0.0
    if not starts.size or np.any(np.abs(time[starts] - time[0]) > near):
        yield reading
        return
    findings = tuple(p for p in reading.findings if p.kind != "time_goes_back")
    for k, (first, stop) in enumerate(zip([0, *starts], [*starts, time.size], strict=True)):
        arrays = {q: values[first:stop] for q, values in reading.arrays.items()}
        layout = replace(reading.layout, label=f"{reading.layout.label or 'part'}, start {k + 1} of time")
        yield replace(reading, layout=layout, arrays=arrays, findings=findings, skipped=int(first))
