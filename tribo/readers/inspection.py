"""Description of an export before it is used."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from tribo.display import displayed
from tribo.errors import Problem, ReadError
from tribo.input_files import MAPPED_BYTES
from tribo.readers.columns import (
    NEEDED,
    Column,
    Columns,
    Given,
    assign,
    bare_unit,
    by_a_word,
    match_column,
    parse_columns,
    raw_signals,
    split_unit,
)
from tribo.readers.layout import Layout, first_table
from tribo.readers.reading import (
    FATAL,
    ReadTable,
    machine_of,
    one_of,
    open_sources,
    read_tables,
    split_at_restarts,
    split_choice,
)
from tribo.readers.source import HEAD_BYTES
from tribo.records import Correction

_BASELINE_SHARE = 0.05  # of the largest force: a pull that starts above it has no zero phase
_FLAT_TOP = 5  # equal samples at an extreme in a row
_UNEVEN = 0.2  # spread of the time steps over their median
_MISSING = {
    "normal force": "no normal load in the file: give it in tests.csv",
    "displacement": "no displacement",
}
_MARKS = {"\t": "tab", " ": "blanks", "": "nothing", ",": "comma", ";": "semicolon", "|": "bar"}


@dataclass(frozen=True)
class ColumnSeen:
    """A column as the file has it, and the quantity it was taken for ("" if none) and why, or why not."""

    position: int
    name: str
    unit: str
    quantity: str = ""
    reason: str = ""


@dataclass(frozen=True)
class TableSeen:
    """A table that is a trace: its position, its time base in seconds, its forces in newton."""

    label: str
    first_row: int
    rows: int
    start_s: float
    end_s: float
    step_s: float
    shortest_step_s: float
    longest_step_s: float
    lowest_force_N: float
    highest_force_N: float
    normal_load_N: float | None


@displayed()
@dataclass(frozen=True)
class Inspection:
    """Description of an export.

    ``problems`` state why it cannot be read, ``advice`` what to give so that it can, ``doubts`` what to check.
    ``pulls`` lists the pulls within its tables, if there are several, by the text that selects them in tests.csv.
    """

    file: str
    family: str = ""
    family_text: str = ""
    encoding: str = ""
    delimiter: str = ""
    decimal: str = ""
    header_rows: int = 0
    columns: tuple[ColumnSeen, ...] = ()
    tables: tuple[TableSeen, ...] = ()
    other_tables: tuple[str, ...] = ()
    pulls: tuple[str, ...] = ()
    metadata: Mapping[str, str] | None = None
    signs: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    doubts: tuple[Problem, ...] = ()
    problems: tuple[Problem, ...] = ()
    advice: str = ""

    @property
    def refused(self) -> bool:
        """Whether the export cannot be read."""
        return bool(self.problems)

    def record(self) -> dict[str, Any]:
        """All of it for JSON."""
        return {"refused": self.refused, **asdict(self)}

    def in_words(self) -> str:
        """All of it as text."""
        lines = [self.file]
        if self.family:
            mark = "comma" if self.decimal == "," else "point"
            marks = f"{_MARKS.get(self.delimiter, self.delimiter)} between cells, decimal {mark}"
            lines.append(f"  format    {self.family_text} ({self.family})")
            lines.append(f"  encoding  {self.encoding}, {marks}, {self.header_rows} header rows")
        for c in self.columns:
            unit, why = f" [{c.unit}]" if c.unit else "", f" (not used: {c.reason})" if c.reason else ""
            why = f" -> {c.quantity} ({c.reason})" if c.quantity else why
            lines.append(f'  column    {c.position} "{c.name}"{unit}{why}')
        lines += [f"  table     {_table_in_words(t)}" for t in self.tables[:12]]
        if len(self.tables) > 12:
            lines.append(f"  table     and {len(self.tables) - 12} more")
        lines += [f"  pull      {text}" for text in self.pulls[:12]]
        if len(self.pulls) > 12:
            lines.append(f"  pull      and {len(self.pulls) - 12} more")
        if self.other_tables:
            lines.append(f"  no trace  {', '.join(self.other_tables[:12])}")
        lines += [f"  signs     {text}" for text in self.signs]
        lines += [f"  missing   {text}" for text in self.missing]
        lines += [f"  doubt     {problem}" for problem in self.doubts]
        lines += [f"  refused   {problem}" for problem in self.problems]
        if self.advice:
            lines.append(f"  advice    {self.advice}")
        return "\n".join(lines)


def inspect_export(
    path: Path | str, *, columns: Columns | None = None, correction: Correction | None = None
) -> Inspection:
    """Description of an export: family, encoding, columns and why, units, tables, time base, doubts.

    Nothing is raised. Only the beginning of a large file is checked; a doubt then says so.

    Parameters
    ----------
    path : Path
        The export, or ``PATH.zip/ENTRY``; ``PATH#2`` is its second table.
    columns, correction : optional
        As in :func:`tribo.readers.read_export`.

    Returns
    -------
    Inspection
        Of an export that cannot be read, ``problems`` states why.

    Examples
    --------
    >>> seen = tribo.inspect_export("data/example/raw/T001.csv")
    >>> seen.family, seen.tables[0].rows, [column.quantity for column in seen.columns]
    ('bluehill', 400, ['time', 'displacement', 'friction force'])
    """
    path, chosen = split_choice(Path(path))
    file = str(path)
    try:
        readings, others, footer = read_tables(path, parse_columns(columns, correction), file, beginning_only=True)
        parts = [part for reading in readings for part in split_at_restarts(reading)]
        if chosen is not None:
            parts = [one_of(parts, chosen, file)]
    except ReadError as why:
        return _refused(path, file, why.problems, parse_columns(columns, correction, strict=False))
    seen = _read(file, parts, others, footer)
    is_mapped = path.is_file() and path.stat().st_size > MAPPED_BYTES  # PATH.zip/ENTRY is no file, and never mapped
    source = open_sources(path, file)[0] if is_mapped else None
    if source is None or not source.is_large:
        return seen
    checked, everything = len(source.beginning_only().data), len(source.data)
    what = f"only the first {checked / 1e6:.0f} of {everything / 1e6:.0f} MB were checked; found: the last line"
    end = source.text(bytes(source.data[-HEAD_BYTES:])).rstrip().rpartition("\n")[2].strip()
    return replace(seen, doubts=(Problem("only_beginning", what, file, found=end[:60]), *seen.doubts))


def _refused(path: Path, file: str, problems: tuple[Problem, ...], given: Given) -> Inspection:
    """What is known about an export that cannot be read."""
    try:
        source = open_sources(path, file)[0]
    except ReadError:
        return Inspection(file, problems=problems)
    machine = machine_of(source)
    seen = Inspection(file, machine.name, machine.text, source.encoding, problems=problems)
    try:
        layout = first_table(source, given)
    except ReadError:
        return seen
    try:
        with_hints = given.with_hints(machine.hints(source, layout))
        taken, _ = assign(layout.names, layout.units, layout.filled, with_hints)
    except ReadError:
        taken = ()
    of_columns = all(p.kind in ("missing_column", "missing_unit", "unknown_unit") for p in problems)
    time, force = ("NAME", "NAME") if any(layout.names) else ("#1", "#2")
    advice = f'in columns: time = "{time} [unit]", friction_force = "{force} [unit]"'
    return replace(
        seen,
        delimiter=layout.delimiter,
        decimal=layout.decimal,
        header_rows=layout.header_rows,
        columns=_columns(layout, taken),
        metadata=layout.metadata,
        advice=(machine.advice or advice) if of_columns else "",
    )


def _read(file: str, parts: list[ReadTable], others: list[str], footer: list[str]) -> Inspection:
    first, layout = parts[0], parts[0].layout
    findings = [problem for part in parts for problem in part.findings]
    doubts = [problem for problem in findings if problem.kind not in FATAL]
    doubts += [doubt for part in parts[:1] for doubt in _doubts(part, file)]
    if len(parts) > 1:
        what, allowed = f"this export contains {len(parts)} traces", f"{file}#1 to {file}#{len(parts)}"
        doubts.append(Problem("several_tables", what, file=file, allowed=allowed))
    if footer:
        what = f"{len(footer)} lines without data at the end of the file"
        doubts.append(Problem("footer", what, file=file, found=footer[0]))
    return Inspection(
        file=file,
        family=first.machine.name,
        family_text=first.machine.text,
        encoding=first.source.encoding,
        delimiter=layout.delimiter,
        decimal=layout.decimal,
        header_rows=layout.header_rows,
        columns=_columns(layout, first.columns, first.passed_over),
        tables=tuple(_table(part) for part in parts),
        other_tables=tuple(others),
        metadata=layout.metadata,
        signs=_signs(parts),
        missing=tuple(_MISSING[quantity] for quantity in _MISSING if quantity not in first.arrays),
        doubts=tuple(doubts),
        problems=tuple(problem for problem in findings if problem.kind in FATAL),
    )


def _columns(
    layout: Layout, columns: tuple[Column, ...], passed_over: Mapping[int, str] = MappingProxyType({})
) -> tuple[ColumnSeen, ...]:
    taken = {c.index: c for c in columns}
    seen = []
    for k in range(layout.n_cells):
        column = taken.get(k)
        if column is None:
            seen.append(ColumnSeen(k + 1, layout.names[k], bare_unit(layout.units[k]), reason=passed_over.get(k, "")))
        else:
            unit = column.label.rpartition("[")[2].rstrip("]") if "[" in column.label else ""
            seen.append(ColumnSeen(k + 1, layout.names[k], unit, column.quantity, column.reason))
    return tuple(seen)


def _table(reading: ReadTable) -> TableSeen:
    time, force = reading.arrays["time"], reading.arrays["friction force"]
    step = np.diff(time) if time.size > 1 else np.zeros(1)
    normal = reading.arrays.get("normal force")
    return TableSeen(
        label=reading.layout.label,
        first_row=reading.layout.header_rows + 1 + reading.skipped,
        rows=int(time.size),
        start_s=float(time[0]),
        end_s=float(time[-1]),
        step_s=float(np.median(step)),
        shortest_step_s=float(step.min()),
        longest_step_s=float(step.max()),
        lowest_force_N=float(force.min()),
        highest_force_N=float(force.max()),
        normal_load_N=None if normal is None else float(np.median(np.abs(normal))),
    )


def _signs(parts: list[ReadTable]) -> tuple[str, ...]:
    found = []
    normal = parts[0].arrays.get("normal force")
    if normal is not None and np.median(normal) < 0:
        found.append("the normal force is negative under load")
    means = [float(np.mean(part.arrays["friction force"][part.arrays["time"].size // 2 :])) for part in parts]
    if max(means) > 0 > min(means):
        found.append("the friction force changes sign between tables: strokes in opposite directions")
    elif max(means) < 0 and all(-f.min() > f.max() for part in parts for f in [part.arrays["friction force"]]):
        found.append("the friction force is negative")
    return tuple(found)


def _doubts(reading: ReadTable, file: str) -> list[Problem]:
    label = {c.quantity: c.label for c in reading.columns}
    time, force = reading.arrays["time"], reading.arrays["friction force"]
    doubts = _other_candidates(reading)
    step = np.diff(time)
    if step.size and np.percentile(step, 95) - np.percentile(step, 5) > _UNEVEN * max(np.median(step), 1e-12):
        found = f"{step.min():.4g} to {step.max():.4g} s"
        doubts.append(Problem("uneven_time", "the time steps are not equal", file, None, label["time"], found))
    start = float(np.median(force[:5]))
    if abs(start) > _BASELINE_SHARE * float(np.abs(force).max()):
        what = "the force does not start near zero, so the zero cannot be determined"
        place = (file, reading.row_of(0), label["friction force"], f"{start:.4g} N")
        doubts.append(Problem("no_zero_phase", what, *place))
    at_top = np.flatnonzero(force == force.max())
    top = max(np.split(at_top, np.flatnonzero(np.diff(at_top) > 1) + 1), key=len)
    if len(top) >= _FLAT_TOP and np.ptp(force):
        what = f"{len(top)} equal data points at the largest force: possibly clipped"
        place = (file, reading.row_of(int(top[0])), label["friction force"], f"{force[top[0]]:.5g} N")
        doubts.append(Problem("flat_top", what, *place))
    for quantity, values in reading.arrays.items():
        if quantity not in NEEDED and values.size > 1 and not np.ptp(values) and not values[0]:
            doubts.append(Problem("all_zero", f"the {quantity} is always zero", file, None, label[quantity]))
    return doubts


def _other_candidates(reading: ReadTable) -> list[Problem]:
    """Columns that could stand for a needed quantity as well as the one that was taken."""
    layout = reading.layout
    taken, raw = {c.index for c in reading.columns}, raw_signals(layout.names, layout.units)
    doubts = []
    for column in (c for c in reading.columns if c.quantity in NEEDED):
        others = [
            layout.names[k]
            for k in range(layout.n_cells)
            if k not in taken | raw
            and layout.filled[k]
            and layout.names[k]
            and (hit := match_column(layout.names[k]) or by_a_word(layout.names[k], _unit(layout, k)))
            and hit[0] == column.quantity
        ]
        if others:
            what = f"the {column.quantity} could also be {' or '.join(others)}"
            place = (reading.source.file, layout.names_row, column.label)
            doubts.append(Problem("other_candidate", what, *place))
    return doubts


def _unit(layout: Layout, k: int) -> str:
    return bare_unit(layout.units[k]) or split_unit(layout.names[k])[1] or ""


def _table_in_words(table: TableSeen) -> str:
    label = f"{table.label}: " if table.label else ""
    load = "" if table.normal_load_N is None else f", normal load {table.normal_load_N:.4g} N"
    return (
        f"{label}{table.rows} rows from row {table.first_row}, {table.start_s:.6g} to {table.end_s:.6g} s in steps of "
        f"{table.step_s:.4g} s, force {table.lowest_force_N:.4g} to {table.highest_force_N:.4g} N{load}"
    )
