"""One row of tests.csv: all its faults at once, and what it states about the numbers of its export or in their place.

Faults are those of the sample, the direction, numbers, load, zero, date and file.
"""

from __future__ import annotations

import difflib
import errno
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path, PurePosixPath
from typing import Any

from tribo.campaign.table import (
    ALLOWED_DATES,
    COUNTS,
    LOADS,
    NUMBERS,
    RAW,
    TestRow,
    of_kind,
    parsed,
    split_choice,
)
from tribo.errors import Problem, unexpected
from tribo.files import leads_out
from tribo.input_files import (
    ABSOLUTE_ZERO_C,
    LARGEST_COUNT,
    LARGEST_LOAD_N,
    LARGEST_NUMBER,
    SMALLEST_LOAD_N,
    SMALLEST_NUMBER,
)
from tribo.records import Correction, Pattern
from tribo.units import CAMPAIGN_COLUMNS, match_quantity, plain_name
from tribo.user_text import are_numbers, did_you_mean, is_number
from tribo.zeroing import ALLOWED, zero_choice

_CONDITIONS = of_kind("number", "count")
_MOST_WORDS = 4  # of a column, in a note
_NOT_NEGATIVE = ("speed_mm_s", "hold_s", "stiffness_N_per_m")
_WITH_UNIT = re.compile(r"([-+]?\d+(?:[.,]\d+)?)\s*([^\d\s.,+-][^\d]{0,9})?")
_ZEROS = of_kind("zero")
_CORRECTIONS = of_kind("correction")
_UNCERTAINTIES = of_kind("uncertainty")
_FORCES = ("static_N", "sliding_N")
_RATIOS = {"static_mu": "static_N", "sliding_mu": "sliding_N", "coefficient": "sliding_N"}
_MM = 1e-3
_HEAD_BYTES = 20_000
_ENCODINGS = ("utf-8", "cp932", "gb18030", "cp1250")
_LOAD_WORDS = {"load", "last", "charge", "carga", "obciazenie", "нагрузка", "载荷", "负荷", "荷重", "하중"}
_UNIT_BEHIND = re.compile(r"[\s_/]*\(?(?:[mkµu]?N|k?gf|k?g|lbf?)\)?$")

Columns = Mapping[str, str | list[str]]


def row_faults(
    root: Path, row: TestRow, patterns: Mapping[str, Pattern], measured: bool, recorded: bool
) -> list[Problem]:
    """Every fault of a row but that of its date.

    ``measured`` says that the exports must exist, ``recorded`` that the load may be left to the normal force in them.
    """
    if row.fault is not None:
        return [row.fault]
    problems = []
    if not row.cells["test_id"]:
        problems.append(Problem("no_test_id", "test_id is missing", row.file, row.row, "test_id"))
    problems += _sample_faults(row, patterns)
    numbers, faults = _numbers_and_faults(row)
    problems += faults
    for column in _ZEROS:
        cell = row.cells.get(column, "")
        try:
            zero_choice(cell)
        except ValueError:
            problems.append(Problem("unknown_zero", "not a zero", row.file, row.row, column, cell, ALLOWED))
    problems += _stated_faults(row, numbers)
    in_export = measured and (recorded or bool(export_of(row)[1]) or _names_a_load(root, row))
    problems += _load_faults(row, numbers, load_in_export=in_export)
    given = [column for column in (*_FORCES, *_RATIOS) if row.cells.get(column)]
    if given:
        return [*problems, *_force_faults(row, given)]
    problems += [p for p in _file_faults(root, row) if measured or p.kind != "missing"]
    return problems


def date_faults(row: TestRow, order: str) -> list[Problem]:
    cell = row.cells.get("started_at", "")
    if not cell or row.fault is not None:
        return []
    try:
        parsed(cell, order)
    except ValueError as why:
        return [Problem("not_a_date", str(why), row.file, row.row, "started_at", cell, ALLOWED_DATES)]
    return []


def _sample_faults(row: TestRow, patterns: Mapping[str, Pattern]) -> list[Problem]:
    """A sample without a pattern; or one named after one direction and pulled along the other."""
    sample, direction = row.cells["sample"], row.cells.get("direction", "").strip().lower()
    if not pattern_of(sample, patterns):
        hint = did_you_mean(sample, [*patterns, *(f"{name}{axis}" for name in patterns for axis in "xy")])
        hint = hint or f"or state its geometry in a table [patterns.{sample}] of campaign.toml"
        allowed = f"{', '.join(patterns)}, or one of these names followed by x or y; {hint}"
        return [Problem("unknown_sample", "no pattern has this name", row.file, row.row, "sample", sample, allowed)]
    axis = "" if sample in patterns else sample[-1:]
    if direction not in ("x", "y") or axis in ("", direction):
        return []
    what = f"sample {sample} is pulled along {axis}, and the column direction says {direction}"
    place = (row.file, row.row, "direction", row.cells["direction"])
    allowed = f"{axis} or an empty cell; or {sample[:-1]}{direction} in the column sample"
    return [Problem("direction_against_sample", what, *place, allowed)]


def number(row: TestRow, column: str) -> float | None:
    """A cell as a number; None where it is empty. ValueError where it is none.

    A condition of a test may not have been recorded, so that a word in its place counts as an empty cell.
    """
    cell = row.cells.get(column, "")
    if not cell:
        return None
    try:
        return _parsed(row, cell)
    except ValueError:
        if column not in _CONDITIONS:
            raise
        return _without_its_unit(row, column, cell)


def _parsed(row: TestRow, cell: str) -> float:
    if "_" in cell:
        raise ValueError(cell)
    value = float(cell.replace(",", ".") if row.decimal_comma and "." not in cell else cell)
    if not math.isfinite(value):
        raise ValueError(cell)
    return value


def _without_its_unit(row: TestRow, column: str, cell: str) -> float | None:
    """The number of a cell that repeats the unit of its column ("45 %" in humidity_pct); None where it holds a word."""
    found, unit = _WITH_UNIT.fullmatch(cell), CAMPAIGN_COLUMNS[column].unit
    if not found or not unit or not found[2] or _plain(found[2]) != _plain(unit):
        return None
    try:
        return _parsed(row, found[1])
    except ValueError:
        return None


def _plain(unit: str) -> str:
    return unit.strip().casefold().lstrip("°")


def words_for_numbers(rows: Sequence[TestRow]) -> Iterator[Problem]:
    """A note on each column of conditions, or of further numbers, in which words stand: they count as not recorded."""
    further = [name for name in rows[0].cells if name and name not in CAMPAIGN_COLUMNS] if rows else []
    further = [name for name in further if are_numbers([row.cells.get(name, "") for row in rows])]
    for column in (*_CONDITIONS, *further):
        words = [row for row in rows if (cell := row.cells.get(column)) and not _is_read(row, column, cell)]
        if words:
            cells = list(dict.fromkeys(row.cells[column] for row in words))
            shown = ", ".join(cells[:_MOST_WORDS]) + (", ..." if len(cells) > _MOST_WORDS else "")
            count = "1 cell holds" if len(words) == 1 else f"{len(words)} cells hold"
            what = f"{count} no number; without one, the value counts as not recorded"
            hint = _meant_number(column, cells[0]) if column in CAMPAIGN_COLUMNS else "a number"
            yield Problem("not_recorded", what, words[0].file, words[0].row, column, shown, f"{hint}, or an empty cell")


def _is_read(row: TestRow, column: str, cell: str) -> bool:
    return number(row, column) is not None if column in _CONDITIONS else is_number(cell)


def _numbers_and_faults(row: TestRow) -> tuple[dict[str, float], list[Problem]]:
    """The numbers of a row, and every cell that holds none, or one that is impossible where it stands."""
    numbers: dict[str, float] = {}
    problems, at = [], (row.file, row.row)
    for column in (*NUMBERS, *COUNTS):
        cell = row.cells.get(column, "")
        try:
            value = number(row, column)
        except ValueError:
            kind = "load_not_a_number" if column in LOADS else "not_a_number"
            problems.append(Problem(kind, "not a number", *at, column, cell, _meant_number(column, cell)))
            continue
        if value is None:
            continue
        numbers[column] = value
        if column in COUNTS and value != int(value):
            problems.append(Problem("not_a_number", "not a whole number", *at, column, cell, "1, 2, ..."))
        least = ABSOLUTE_ZERO_C if column == "temperature_C" else -LARGEST_NUMBER
        least, most = (-LARGEST_COUNT, LARGEST_COUNT) if column in COUNTS else (least, LARGEST_NUMBER)
        outside = "" if least <= value <= most else f"{least:g} to {most:g}"
        if column in ("mass_g", *_NOT_NEGATIVE) and 0 < abs(value) < SMALLEST_NUMBER:
            outside = f"0, or {SMALLEST_NUMBER:g} or more"
        if column in _NOT_NEGATIVE and value < 0:
            problems.append(Problem("negative", "must not be negative", *at, column, cell, "0 or more"))
        elif outside:
            problems.append(Problem("impossible_number", "not a possible value", *at, column, cell, outside))
    return numbers, problems


def _meant_number(column: str, cell: str) -> str:
    """What a cell that holds no number may mean: a number with its unit, or one with a decimal comma."""
    found, unit = _WITH_UNIT.fullmatch(cell), CAMPAIGN_COLUMNS[column].unit
    if not found:
        return "a number"
    digits, given = found[1].replace(",", "."), found[2]
    if not given:
        return f"a number with a decimal point: did you mean {digits}?"
    if not unit:
        return f"a number without a unit: did you mean {digits}?"
    if given.casefold().lstrip("°") == unit.casefold().lstrip("°"):
        return f"a number without its unit, which is in the name of the column: did you mean {digits}?"
    return f"a number in {unit}, without the unit: convert {cell} to {unit}"


def _stated_faults(row: TestRow, numbers: Mapping[str, float]) -> Iterator[Problem]:
    """A sign that is none, a gain, lever arm or rate that is not positive, an uncertainty below zero."""
    for column in (*_CORRECTIONS, *_UNCERTAINTIES):
        value = numbers.get(column)
        if value is None:
            continue
        at = (row.file, row.row, column, row.cells[column])
        if column == "sign" and value not in (1.0, -1.0):
            yield Problem("not_a_sign", "not a sign", *at, "1 or -1")
        elif column in _UNCERTAINTIES and value < 0:
            yield Problem("negative", "must not be negative", *at, "0 or more")
        elif column in _CORRECTIONS[1:] and value <= 0:
            yield Problem("not_positive", "must be positive", *at, "more than 0; a reversed direction is sign = -1")


def _names_a_load(root: Path, row: TestRow) -> bool:
    """Whether a row without a load has an export whose head holds a word for it, or is no text: reading decides."""
    path = relative_path(row.cells.get("file", ""))
    if path is None or any(row.cells.get(column) for column in LOADS):
        return False
    export = root / path
    try:
        if leads_out(root, export):
            return False
        if not export.is_file():  # an entry of a .zip; never a pipe, which would be waited for
            return any(p.is_file() for p in export.parents)
        with export.open("rb") as stream:
            head = stream.read(_HEAD_BYTES)
    except (OSError, ValueError, RuntimeError):
        return False
    if b"\0" in head or head[:2] in (b"PK", b"\x1f\x8b"):
        return True
    for encoding in _ENCODINGS:
        for cell in re.split(r'[\t;,|"\n]', head.decode(encoding, errors="replace")):
            name = _UNIT_BEHIND.sub("", cell.strip())
            quantity = (match_quantity(cell.strip()) or match_quantity(name) or ("",))[0]
            if quantity in ("normal force", "normal stress") or plain_name(name) in _LOAD_WORDS:
                return True
    return False


def _load_faults(row: TestRow, numbers: Mapping[str, float], load_in_export: bool) -> list[Problem]:
    """normal_load_N must be positive; a sled may carry no mass of its own, but none may be negative.

    With ``load_in_export`` the load may be left to the normal force recorded there.
    """
    at = (row.file, row.row)
    if not any(row.cells.get(column) for column in LOADS):
        file = row.cells.get("file", "") or "raw/a.csv"
        allowed = f"mass_g, normal_load_N or normal_stress_Pa; or {file}#1 in file, if the export records the load"
        missing = Problem("no_load", "the load is missing", *at, " or ".join(LOADS[:2]), None, allowed)
        return [] if load_in_export else [missing]
    for column, unit in (("normal_stress_Pa", "Pa"), ("normal_load_N", "N")):
        if numbers.get(column, 1.0) <= 0:
            found, what = row.cells[column], "a load must be positive"
            return [Problem("load_not_positive", what, *at, column, found, f"more than 0 {unit}")]
    load = numbers.get("normal_load_N")
    if load is not None and not SMALLEST_LOAD_N <= load <= LARGEST_LOAD_N:
        place = (*at, "normal_load_N", row.cells["normal_load_N"], f"{SMALLEST_LOAD_N:g} to {LARGEST_LOAD_N:g} N")
        return [Problem("impossible_load", "not a possible load of a friction test", *place)]
    if load is None and numbers.get("mass_g", 1.0) < 0:
        found, what = row.cells["mass_g"], "a mass must not be negative"
        return [Problem("load_not_positive", what, *at, "mass_g", found, "0 g or more")]
    return []


def _force_faults(row: TestRow, given: Sequence[str]) -> Iterator[Problem]:
    """A row has an export or forces, not both; a force is given once."""
    at = (row.file, row.row)
    if row.cells.get("file"):
        what = "this row has an export and a force evaluated elsewhere"
        allowed = "an empty cell in file, or empty cells in " + ", ".join(given)
        yield Problem("file_and_force", what, *at, given[0], row.cells[given[0]], allowed)
    for force in _FORCES:
        twice = [column for column in given if _RATIOS.get(column, column) == force]
        if len(twice) > 1:
            yield Problem("force_given_twice", "the same force is given twice", *at, " and ".join(twice))


def _file_faults(root: Path, row: TestRow) -> list[Problem]:
    name = row.cells.get("file", "")
    place = (row.file, row.row, "file", name)
    path = relative_path(name)
    try:
        if path is None or leads_out(root, root / path):
            what = "the path leads outside the campaign"
            hint = _meant_file(root, PurePosixPath(name.replace("\\", "/").rpartition("/")[2]))
            allowed = f"a path inside the campaign folder{f'; {hint}' if hint else ''}"
            return [Problem("path_outside_campaign", what, *place, allowed)]
        in_a_zip = any(p.suffix.lower() == ".zip" and (root / p).is_file() for p in path.parents)
        if (root / path).is_file() or in_a_zip:  # its reader looks for the entry
            return []
        if (root / path).exists() and name:
            return [Problem("not_a_file", "not a regular file", *place, "a file of the campaign")]
        hint = _meant_file(root, path)
    except (OSError, ValueError, RuntimeError) as why:  # too long, no permission, links in a circle
        problem = unexpected(why, "this path cannot be followed")
        of_the_name = isinstance(why, OSError) and why.errno in (errno.ENAMETOOLONG, errno.ELOOP)
        return [Problem("path_not_usable" if of_the_name else problem.kind, problem.what, *place)]
    allowed = f"a file of the campaign{f'; {hint}' if hint else ''}"
    return [Problem("missing", "this file does not exist" if name else "no file is given", *place, allowed)]


def _meant_file(root: Path, path: PurePosixPath) -> str:
    """The file that a path may mean, as a question: in raw/, with an ending, or spelled otherwise."""
    if not path.name:
        return ""
    spelled = [p for p in root.iterdir() if p.is_dir() and p.name.lower() == str(path.parent).lower()]
    for folder in dict.fromkeys(((root / path).parent, root / RAW, *spelled)):
        beside = [p.name for p in folder.iterdir() if p.is_file()] if folder.is_dir() else []
        stems = [name for name in beside if name.rpartition(".")[0].lower() == path.stem.lower()]
        same = [n for n in beside if n.lower() == path.name.lower()] or (stems if len(stems) == 1 else [])
        if near := same or difflib.get_close_matches(path.name, beside, 1, 0.9):
            return f"did you mean {(folder / near[0]).relative_to(root).as_posix()}?"
    return ""


def relative_path(name: str) -> PurePosixPath | None:
    """A path inside the campaign, "/" between its parts, a choice such as "#2" dropped; None if it leaves it."""
    path = PurePosixPath(split_choice(name)[0].replace("\\", "/"))
    if path.is_absolute() or ".." in path.parts or "\0" in name or re.match(r"[A-Za-z]:", name):
        return None
    return path


def export_of(row: TestRow) -> tuple[str, str]:
    """(path, choice within it) of the export a row names; the path as it stands where it leaves the campaign."""
    path, choice = split_choice(row.cells.get("file", ""))
    return str(relative_path(path) or path) if path else "", choice


def pattern_of(sample: str, patterns: Mapping[str, Pattern]) -> str:
    """Name of the pattern of a sample ("S" for "Sx"); "" where there is none."""
    if sample in patterns:
        return sample
    return sample[:-1] if sample[-1:] in ("x", "y") and sample[:-1] in patterns else ""


def correction_of(
    numbers: Mapping[str, float | None], general: Any, speed_m_s: float | None, load_N: float
) -> Correction:
    """The correction of one test: its own cells first, then [campaign] of campaign.toml."""
    given = {key: numbers.get(key) if numbers.get(key) is not None else getattr(general, key) for key in _CORRECTIONS}
    lever = given["lever_arm_mm"]
    return Correction(
        sign=1.0 if given["sign"] is None else given["sign"],
        gain=1.0 if given["gain"] is None else given["gain"],
        lever_arm_m=None if lever is None else lever * _MM,
        sampling_rate_Hz=given["sampling_rate_Hz"],
        speed_m_s=speed_m_s or None,
        load_N=None if math.isnan(load_N) else load_N,
        area_m2=None if general.nominal_area_mm2 is None else general.nominal_area_mm2 * _MM**2,
    )


def evaluated_forces(row: TestRow, load_N: float) -> dict[str, float] | None:
    """The forces of a row without an export by their names in a Pull, in newton; a coefficient times the load."""
    if row.cells.get("file") or not any(row.cells.get(column) for column in (*_FORCES, *_RATIOS)):
        return None
    found: dict[str, float] = {}
    for column, force in {**{force: force for force in _FORCES}, **_RATIOS}.items():
        if (value := number(row, column)) is not None:
            is_force = column in _FORCES
            uncertainty = force.replace("_N", "_u_N")
            u = number(row, uncertainty if is_force else f"{column}_u") or 0.0
            found[force] = value if is_force else value * load_N
            found[uncertainty] = u if is_force else u * load_N
    return found


def columns_of(file: str, general: Columns, by_file: Mapping[str, Columns]) -> Columns:
    """Columns of one export: those of the campaign, replaced by those of every glob that fits, in their order."""
    path = file.partition("#")[0]
    found = dict(general)
    for pattern, columns in by_file.items():
        if any(fnmatchcase(text, pattern) for text in (file, path, path.rpartition("/")[2])):
            found.update(columns)
    return found
