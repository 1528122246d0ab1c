"""From an export to traces in SI units, with all doubts."""

from __future__ import annotations

import re
from pathlib import Path

from tribo.errors import Problem, ReadError
from tribo.quantities import QUANTITIES
from tribo.readers.core.given import Columns, Given, parse_columns
from tribo.readers.core.reading import Contents, Reading, read_source, split_at_restarts
from tribo.readers.families import open_sources
from tribo.records import Correction, ExportFormat, Trace

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
