"""From an export to a Trace: pick the family by content, find columns, apply units, name the damage."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from tribo.errors import Problem, ReadError
from tribo.quantities import QUANTITIES
from tribo.readers.assign import Column, assign, is_override, parse_overrides
from tribo.readers.bluehill import BLUEHILL
from tribo.readers.body import parse_body
from tribo.readers.delimited import DELIMITED
from tribo.readers.family import Family
from tribo.readers.layout import Layout
from tribo.readers.source import Source, open_source
from tribo.readers.testsuite import TESTSUITE
from tribo.readers.testxpert import TESTXPERT
from tribo.records import ExportFormat, FloatArray, Trace

# Tried in this order; the last one takes what nobody else recognised.
READERS: dict[str, Family] = {f.name: f for f in (BLUEHILL, TESTXPERT, TESTSUITE, DELIMITED)}


def read_export(
    path: Path | str,
    *,
    columns: Mapping[str, str] | None = None,
    name: str | None = None,
    file: str | None = None,
) -> Trace:
    """Read one export into SI units; the samples stay as recorded.

    Parameters
    ----------
    path : Path
        The export. Its family, encoding, delimiter, decimal mark and header are found from its content.
    columns : mapping, optional
        ``{quantity: "name [unit]"}`` overrides what the names say, e.g. ``{"friction force": "Fx [gf]"}``;
        ``"#3 [N]"`` is the third column.
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
        wrong_number_of_cells, text_in_numbers, two_decimal_marks, nan_gap, time_goes_back.
    """
    path = Path(path)
    file = str(path) if file is None else file
    overrides = parse_overrides(columns)
    source = open_source(path, file)
    family = next(f for f in READERS.values() if f.recognises(source))
    layout = family.layout(source, lambda cell: is_override(cell, overrides))
    found = _assign(source, layout, overrides)
    raw = parse_body(source, layout, [c.index for c in found])
    arrays = {
        c.quantity: row if (c.factor, c.offset) == (1.0, 0.0) else c.factor * row + c.offset
        for c, row in zip(found, raw, strict=True)
    }
    flags = _check_time(source, layout, found, arrays["time"])
    return Trace(
        name=path.stem if name is None else name,
        time_s=arrays.pop("time"),
        force_N=arrays.pop("friction force"),
        displacement_m=arrays.pop("displacement", None),
        columns={QUANTITIES[q].column: values for q, values in arrays.items()},
        metadata=layout.metadata,
        source=_format(source, layout, family, found),
        file=file,
        flags=flags,
    )


def _assign(source: Source, layout: Layout, overrides: tuple[tuple[str, str], ...]) -> tuple[Column, ...]:
    try:
        return assign(layout.names, layout.units, overrides)
    except ReadError as why:
        row = layout.units_row or layout.names_row
        raise ReadError(replace(p, file=source.file, row=row) for p in why.problems) from None


def _check_time(
    source: Source, layout: Layout, found: tuple[Column, ...], time: FloatArray
) -> tuple[str, ...]:
    """Flags of the time base.

    Raises
    ------
    ReadError
        time_goes_back, at the first row that is earlier than the one above it.
    """
    step = np.diff(time)
    if not step.size or step.min() > 0:
        return ()
    if step.min() < 0:
        k = int(np.argmax(step < 0)) + 1
        column = next(c for c in found if c.quantity == "time").label
        what = f"time runs back from {time[k - 1]:.6g} s"
        allowed = "a time that never decreases"
        place = (source.file, _row(source, layout, k), column)
        raise ReadError(Problem("time_goes_back", what, *place, f"{time[k]:.6g} s", allowed))
    return ("time_repeats",)


def _row(source: Source, layout: Layout, k: int) -> int:
    """Line of the file, from 1, of data row ``k``, from 0; blank lines hold no data row."""
    lines = source.data.split(b"\n")[layout.header_rows :]
    filled = [i for i, line in enumerate(lines) if line.strip()]
    return layout.header_rows + filled[k] + 1


def _format(source: Source, layout: Layout, family: Family, found: tuple[Column, ...]) -> ExportFormat:
    return ExportFormat(
        family=family.name,
        encoding=source.encoding,
        delimiter=layout.delimiter,
        decimal=layout.decimal,
        header_rows=layout.header_rows,
        columns={c.quantity: c.label for c in found},
        reasons={c.quantity: c.reason for c in found},
    )
