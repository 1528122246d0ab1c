"""Machines and programs that export text: what the content of a file is recognised by, and what it implies.

A new one is a record in ``TEXT_MACHINES``. Most need no more than ``recognises``, which looks at the content, never at
the name of the file. ``hints`` gives the columns and units that the format is known to mean but does not write, each
with its reason; ``advice`` states what the user must give for such a file; ``as_table`` writes the file anew where its
rows are not those of a table.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tribo.readers.columns import Hint, match_column, split_unit
from tribo.readers.layout import Layout, cut
from tribo.readers.source import Source


@dataclass(frozen=True)
class Machine:
    """A family of exports: of one machine, or of the program that many machines come with.

    ``opens`` is given for binary files only: the arrays of a file as sources.
    """

    name: str
    text: str
    recognises: Callable[[Source], bool]
    hints: Callable[[Source, Layout], tuple[Hint, ...]] = lambda source, layout: ()
    advice: str = ""
    as_table: Callable[[Source], Source] | None = None
    opens: Callable[[Source], tuple[Source, ...]] | None = None


def _found(expression: str, flags: int = 0) -> Callable[[Source], bool]:
    """Whether an expression is found in the first lines, which stand in one text with a line end before each."""
    pattern = re.compile(expression, flags)
    return lambda source: bool(pattern.search(source.head_text))


def _begins(*texts: str) -> Callable[[Source], bool]:
    return lambda source: source.head[0].startswith(texts)


# Instron Bluehill: quoted cells, units in brackets in a row of their own; results tables and several specimens one
# below the other.
_BLUEHILL_KEYS = _found(r'^"?(specimen label|results table|sample description|test method|specimen)\b', re.I | re.M)
_BLUEHILL_UNITS = _found(r'^"?\(s\)"?[,;\t]|[,;\t]"?\((?:mm|m?N|kN|s|m|gf|kgf)\)"?', re.M)

# Zwick testXpert: quoted key rows, a row of names and a row of units, both quoted, bare numbers.
_TESTXPERT_NAMES = _found(
    r'^"(?:prüfzeit|zeit|temps|temps d.essai|test time|time|standardweg|standard travel)"[;,\t].*'
    r'"(?:standardkraft|kraft|force standard|standard force|force)"|'
    r'^"(?:prüfzeit|zeit|temps|test time)"[;,\t]"(?:standardweg|traverse absolue|course standard|standard travel)"',
    re.I | re.M,
)
_TESTXPERT_UNITS = _found(r'^"(?:m?s|min|mm|m?N)"[;,\t]"', re.M)
_TESTXPERT_SHEET = _found(r"^(?:.*\t)?(?:standard force|standardkraft|force standard)(?:\t|$)", re.I | re.M)


def _is_testxpert(source: Source) -> bool:
    if source.part:  # a sheet of a workbook has no quotes
        return _TESTXPERT_SHEET(source)
    return '"' in source.head_text and _TESTXPERT_NAMES(source) and _TESTXPERT_UNITS(source)


def _is_bam(source: Source) -> bool:
    """A semicolon line of test data over tabs (PMD), or key, value and unit rows over names and units."""
    first = source.head[0]
    if first.count(";") >= 3 and "PMD" in first.split(";"):
        return True
    return any(line.startswith(("Specimen ID:\t", "Probe;")) for line in source.head[:4])


# LabVIEW measurement files (.lvm): one header per segment, units in the names or in Y_Unit_Label. With "X_Columns No"
# the rows hold no time: it follows from X0 and Delta_X of the header of their segment.
_LVM_NUMBER_OR_NOTHING = re.compile(r"\s*(?:[-+]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][-+]?\d+)?|NaN)?\s*")
_LVM_ACCELERATION = re.compile(r"m/s(?:ec)?(?:\^?2|²)")


def _lvm_as_table(source: Source) -> Source:
    """The times that its rows leave out written, comments behind its rows left out."""
    if source.is_large:
        return source
    lines = source.text(bytes(source.data)).split("\n")
    header: dict[str, str] = {}
    row: int | None = None
    width = 0  # cells of a row without its comment; 0 where the header names no column of comments
    for k, line in enumerate(lines):
        cells = line.split("\t")
        key, rest = cells[0], cells[1:]
        if key.startswith(("***End_of_Header***", "X_Value")):
            row = 0 if key == "X_Value" else None
            width = cells.index("Comment") if "Comment" in cells else 0
        elif row is not None and any(rest) and all(map(_LVM_NUMBER_OR_NOTHING.fullmatch, cells[:2])):
            if not key.strip() and header.get("X_Columns") == "No":  # X0 + row Delta_X, where the header gives them
                with suppress(ValueError):
                    start, step = (float(header.get(name, "").replace(",", ".")) for name in ("X0", "Delta_X"))
                    key = f"{start + row * step:.9f}".replace(".", header.get("Decimal_Separator") or ".")
            lines[k] = "\t".join([key, *(rest[: width - 1] if width else rest)])
            row += 1
        elif key.strip():
            header[key] = rest[0] if rest else ""
            row = None
    return replace(source, data="\n".join(lines).encode(source.codec, errors="replace"))


def _lvm_hints(source: Source, layout: Layout) -> tuple[Hint, ...]:
    """X_Value is time in seconds where X_Dimension says Time; Y_Unit_Label gives the units of the channels."""
    found = []
    dimension = layout.metadata.get("X_Dimension", "Time")
    if "X_Value" in layout.names and dimension.startswith("Time"):
        found.append(Hint("time", "X_Value [s]", "X_Value of a LabVIEW file is in seconds"))
    labels = layout.metadata.get("Y_Unit_Label", "").split()
    if any(_LVM_ACCELERATION.match(label) for label in labels):  # g is then the acceleration of gravity as well
        labels = ["" if label == "g" else label for label in labels]
    channels = [name for name in layout.names[1:] if name and name != "Comment"]
    for name, unit in zip(channels, labels, strict=False):
        hit = match_column(name)
        if unit and hit and split_unit(name)[1] is None and not any(h.quantity == hit[0] for h in found):
            found.append(Hint(hit[0], f"{name} [{unit}]", "unit from Y_Unit_Label"))
    return tuple(found)


# Newport rotary rig: one tab-separated line of settings, then semicolon-separated numbers without names. Columns by the
# rig's own evaluation script: step time, time, force across the contact, torque, position of the vertical stage, turns
# a second, speed of that stage. The friction is a torque, so its lever must be given.
_NEWPORT_SETTINGS = re.compile(r"(?:-?\d+\.\d+\t){15}-?\d+\.\d+\s*")
_NEWPORT_ROW = re.compile(r"(?:-?\d+\.\d+;){6}-?\d+\.\d+\s*")


def _is_newport(source: Source) -> bool:
    head = source.head
    return len(head) > 1 and bool(_NEWPORT_SETTINGS.fullmatch(head[0])) and bool(_NEWPORT_ROW.fullmatch(head[1]))


def _newport_hints(source: Source, layout: Layout) -> tuple[Hint, ...]:
    if any(layout.names):  # of a file beside the export
        return ()
    columns = {"time": "#2 [s]", "normal force": "#3 [N]", "torque": "#4 [N m]", "rotation speed": "#6 [rev/s]"}
    return tuple(Hint(quantity, column, "fixed column order of this rig") for quantity, column in columns.items())


# Rtec and alike: one table per step, each with its own header, or one log whose time starts again with each step. The
# log writes its timestamp without a unit; it is in seconds.
_RTEC_STEP = _found(r"\n\W{0,3}(?:recipe )?step\W{0,3}\d+\b", re.I)
_RTEC_FORCES = _found(r"F[xz].*F[xz]|COF")


def _is_rtec(source: Source) -> bool:
    return "DAQ.F" in source.head_text or (_RTEC_FORCES(source) and _RTEC_STEP(source))


def _rtec_hints(source: Source, layout: Layout) -> tuple[Hint, ...]:
    is_log = any(name.startswith("DAQ.F") for name in layout.names)
    bare = "Timestamp" in layout.names and not layout.units[layout.names.index("Timestamp")]
    return (Hint("time", "Timestamp [s]", "Rtec logs count in seconds"),) if is_log and bare else ()


# Phoenix TE67: tabs, decimal commas, an empty first column, no units; what they are follows from the columns. Load =
# mass times g only if the load is in newton and the mass in gram, and friction coefficient = friction force / load only
# if both forces share a unit. Clock and test time run alike only if the test time is in seconds. The sliding velocity
# is 2 pi times radius times turns a minute only if it is in m/s and the radius in millimetre.
_TE67_CLOCK = re.compile(r"(\d+):(\d\d):(\d\d)")
_TE67_GRAVITY_M_S2 = 9.81  # what the rig itself reckons with
_TE67_ROWS_BYTES = 20_000
_TE67_STEADY = 0.9  # of the rows; while the drive speeds up, velocity and turns are not of the same instant


def _is_te67(source: Source) -> bool:
    head = source.head
    return head[0].startswith("Data file\t") and any(line.startswith("Test control file\t") for line in head[:8])


def _te67_hints(source: Source, layout: Layout) -> tuple[Hint, ...]:
    """Units that the numbers themselves prove."""
    start = source.offset(source.start, layout.header_rows)
    lines, _ = source.lines(start, _TE67_ROWS_BYTES)
    rows = [row for row in (cut(line, layout.delimiter) for line in lines) if len(row) == layout.n_cells]
    columns = {name: [row[k] for row in rows] for k, name in reversed(list(enumerate(layout.names)))}

    def numbers(name: str) -> np.ndarray:
        try:
            return np.array([float(cell.replace(",", ".")) for cell in columns.get(name, [])])
        except ValueError:
            return np.array([])

    found = []
    time, clock = numbers("Test Time"), [_TE67_CLOCK.fullmatch(cell) for cell in columns.get("Time", [])]
    seconds = [int(c[1]) * 3600 + int(c[2]) * 60 + int(c[3]) for c in clock if c]
    of_all_rows = len(seconds) >= 10 and len(seconds) == len(clock) == time.size
    if of_all_rows and abs((seconds[-1] - seconds[0]) % 86400 - (time[-1] - time[0])) < 2.0:
        found.append(Hint("time", "Test Time [s]", "no unit in the file; it agrees with the clock column"))
    velocity, radius, turns = numbers("Sliding Velocity"), numbers("Radius"), numbers("Speed")
    if velocity.any() and velocity.size == radius.size == turns.size:
        # the velocity is written to 1 mm/s, the turns to one a minute
        rounded = 1e-3 + 2.0 * np.pi * radius * 1e-3 / 60.0
        alike = np.abs(2.0 * np.pi * radius * 1e-3 * turns / 60.0 - velocity) <= rounded
        if alike.mean() > _TE67_STEADY:
            reason = "no unit in the file; it equals 2 pi times the radius (mm) times the speed (turns a minute)"
            found.append(Hint("speed", "Sliding Velocity [m/s]", reason))
    mass, load = numbers("Mass"), numbers("Load")
    if mass.size and mass.size == load.size and np.allclose(load, mass * 1e-3 * _TE67_GRAVITY_M_S2, rtol=1e-4):
        reason = "no unit in the file; the load column equals mass (g) times 9.81 m/s2"
        found.append(Hint("normal force", "Load [N]", reason))
        force, coefficient = numbers("Friction Force"), numbers("Friction Coefficient")
        same_size = force.size and force.size == load.size == coefficient.size
        if same_size and np.all(np.abs(coefficient * load - force) <= 0.06):  # the force is written to 0.1 N
            reason += ", and the friction force equals friction coefficient times load"
            found.append(Hint("friction force", "Friction Force [N]", reason))
    return tuple(found)


# JSON of programs that evaluate: rows under "data" with their names under "columns", rows that name their cells, or
# lists by name. The data sets of a banded rotary damper (ARTS-Laboratory) have rows without names; the keys with their
# units say which rig it is, and the authors state the order.
_DAMPER_COLUMNS = (
    "time", "displacement", "friction force", "velocity", "actuator force 1", "actuator force 2",
)  # fmt: skip


def _json_as_table(source: Source) -> Source:
    """The columns of numbers as named arrays; the text as it is where it holds none."""
    try:
        stored = json.loads(source.text(bytes(source.data)))
    except (ValueError, RecursionError):
        return source
    columns = _json_columns(stored)
    arrays = {}
    for name, values in columns.items():
        with suppress(TypeError, ValueError):
            arrays[name] = np.array([np.nan if v is None else v for v in values], dtype=float)
    sizes = [a.size for a in arrays.values() if a.ndim == 1 and a.size > 1]
    most = max(set(sizes), key=sizes.count, default=0)
    kept = {name: a for name, a in arrays.items() if a.ndim == 1 and a.size == most}
    if len(kept) < 2:
        return source
    return replace(source, data=b"", names=tuple(kept), arrays=tuple(kept.values()), machine="json")


def _json_columns(stored: Any) -> dict[str, Sequence[Any]]:
    """The columns of a JSON value by name, "#1" and so on where they have none."""
    above = stored if isinstance(stored, dict) else {}
    rows = above.get("data", above.get("rows", above.get("records"))) if above else stored
    if isinstance(rows, list) and rows and all(isinstance(row, dict) for row in rows):
        return {str(name): [row.get(name) for row in rows] for name in rows[0]}
    if isinstance(rows, list) and rows and all(isinstance(row, list) for row in rows):
        width = len(rows[0])
        if any(len(row) != width for row in rows):
            return {}
        named = next((above[key] for key in ("columns", "names", "header", "headers", "fields") if key in above), None)
        names = [str(name) for name in named] if isinstance(named, list) and len(named) == width else []
        if not names and "friction force units" in above and width == len(_DAMPER_COLUMNS):
            names = [f"{name} [{_damper_unit(name, above)}]" for name in _DAMPER_COLUMNS]
        names = names or [f"#{k + 1}" for k in range(width)]
        return {name: [row[k] for row in rows] for k, name in enumerate(names)}
    columns = rows if isinstance(rows, dict) else above
    return {str(name): values for name, values in columns.items() if isinstance(values, list)}


def _damper_unit(name: str, above: Mapping[str, Any]) -> str:
    if name == "velocity":
        return f"{above.get('displacement units', '')}/{above.get('time units', '')}"
    return str(above.get(f"{name.rstrip(' 12')} units", ""))


# Kyowa PCD loggers: quoted keys of channels, their units in the row 単位, channels that have numbers only.
def _kyowa_as_table(source: Source) -> Source:
    """The names of channels and their units from the rows above, in the row of names."""
    lines = source.text(bytes(source.data)).split("\n")
    above = {cells[0]: cells[1:] for line in lines[:40] if (cells := cut(line.strip(), ","))}
    for k, line in enumerate(lines[:40]):
        time, *channels = cut(line.strip(), ",")
        if not time.startswith("Time"):
            continue
        called, units = ([*above.get(key, []), *[""] * len(channels)] for key in ("CH名称", "単位"))
        named = [called[j] or channel for j, channel in enumerate(channels)]
        lines[k] = ",".join([time, *(f"{name} [{unit}]" for name, unit in zip(named, units, strict=False))])
        break
    return replace(source, data="\n".join(lines).encode(source.codec, errors="replace"))


# The monitor of an Arduino: a clock and an arrow before what the program of the board prints, numbers in one order or
# behind their names ("F: 1.2 N").
_MONITOR_LINE = re.compile(r"(\d{1,2}:\d\d:\d\d\.\d{3}) -> (.*)")
_PRINTED = re.compile(
    r"(?:([^\W\d][^:=,;\t]*?)\s*[:=]\s*)?([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)"  # name: number
    r"(?:\s*([^\W\d_][\w/]*)(?![\w/]*\s*[:=]))?[\s,;]*"  # its unit
)


def _monitor_as_table(source: Source) -> Source:
    """The clock and the numbers of every line that has as many as most have."""
    rows = []
    for line in source.text(bytes(source.data)).split("\n"):
        found = _MONITOR_LINE.fullmatch(line.strip())
        printed = list(_PRINTED.finditer(found[2])) if found else []
        if found and printed and "".join(p[0] for p in printed) == found[2]:
            rows.append((found[1], printed))
    width = Counter(len(printed) for _, printed in rows).most_common(1)
    whole = [(clock, printed) for clock, printed in rows if len(printed) == width[0][0]]
    if len(whole) < 2:
        return source
    called = [(p[1] or f"value {k}") + (f" [{p[3]}]" if p[3] else "") for k, p in enumerate(whole[0][1], start=1)]
    table = ["\t".join(["Clock", *called]), *("\t".join([clock, *(p[2] for p in printed)]) for clock, printed in whole)]
    data = ("\n".join(table) + "\n").encode(source.codec, errors="replace")
    return replace(source, data=data, machine="monitor")


# Tried in this order; the last one accepts everything the others do not recognise.
TEXT_MACHINES = (
    Machine(
        "bluehill",
        "Instron Bluehill 3 and Universal, raw data CSV",
        lambda source: _BLUEHILL_KEYS(source) and _BLUEHILL_UNITS(source),
    ),
    Machine("testxpert", "Zwick testXpert, CSV and TRA, German, French or English names", _is_testxpert),
    Machine("testsuite", "MTS TestSuite, text export of timed data", _found("\nData Acquisition:")),
    Machine("mts793", "MTS 793 (MPT), data file with acquisition blocks", _begins("MTS793|")),
    Machine(  # a specimen row above the names, seconds as sec; specimens may stand side by side
        "trapezium",
        "Shimadzu Trapezium CSV, one or several specimens",
        _found(
            r'^"?(?:Temps|Time|Zeit)"?[,;\t]"?(?:Force|Kraft)"?[,;\t]"?(?:Stroke|Disp|Hub|Course).*\n"?sec"?[,;\t]',
            re.M,
        ),
    ),
    Machine(  # channel numbers before the names, units in brackets behind them
        "walterbai",
        "Walter+Bai, semicolon-separated channels",
        lambda source: bool(re.match(r"^S/No;C_\d+_", source.head[0])),
    ),
    Machine("bam", "BAM and PMD style, test data above tab-separated columns", _is_bam),
    Machine(  # forces in gram-force written as g, the normal force negative
        "umt",
        "CETR and Bruker UMT, CSV of the data viewer, one table per step",
        _begins("Created by CETR", "Created by Bruker UMT", "Created by UMT"),
    ),
    Machine("te67", "Phoenix TE67 pin-on-disc, TSV with decimal commas", _is_te67, _te67_hints),
    Machine(  # TRB, NTR: names with units, or as passed on without, to be given then
        "csm",
        "CSM and Anton Paar tribometer, tab-separated",
        _found(r"\nTime *(?:\[s\])?[\t;] *Distance[^\t;]*[\t;] *laps\b", re.I),
        advice='this table has no units; give them: time = "Time [s]", friction_force = "FrictionForce [N]" in columns',
    ),
    Machine(  # steps of several types, only some with a table, many empty columns
        "pcs",
        "PCS Instruments MTM and EHD, text export of steps",
        lambda source: bool(re.match(r"(MTM|EHD|ETM|HFRR)\d* Test Data File", source.head[0])),
    ),
    Machine(
        "labview",
        "LabVIEW measurement file, .lvm",
        _begins("LabVIEW Measurement"),
        _lvm_hints,
        as_table=_lvm_as_table,
    ),
    Machine(  # "Interval data:" before the names, units in brackets below
        "rheocompass",
        "Anton Paar RheoCompass, one table per interval",
        _found(r"\n(?:Interval data|Intervall-?\s?daten|Données de l.intervalle):", re.I),
    ),
    Machine(
        "newport",
        "Newport rotary rig, settings line and columns without names",
        _is_newport,
        _newport_hints,
        advice="column 4 is the friction torque; give the lever arm: lever_arm_mm = 2.5 in campaign.toml, "
        'or friction_force = "#4 [N m / 2.5 mm]" in columns',
    ),
    Machine(
        "json",
        "JSON with columns or rows of numbers",
        lambda source: source.machine == "json" or source.head_text.lstrip()[:1] in ("{", "["),
        as_table=_json_as_table,
    ),
    Machine(
        "kyowa",
        "Kyowa PCD logger, numbered channels",
        _begins('"ID番号","PCD-'),
        advice='the channels have numbers only; say what they measure: normal_force = "CH1", friction_force = "CH2" in '
        "columns",
        as_table=_kyowa_as_table,
    ),
    Machine(
        "monitor",
        "serial monitor of an Arduino, a clock before every line",
        lambda source: sum(bool(_MONITOR_LINE.fullmatch(line.strip())) for line in source.head[:20]) > 2,
        as_table=_monitor_as_table,
    ),
    Machine("rtec", "Rtec and similar, one table per step, columns in any order", _is_rtec, _rtec_hints),
    Machine("delimited", "plain delimited table with column names and units", lambda source: True),
)
