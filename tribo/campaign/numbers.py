"""The numbers of a row of tests.csv: finite, whole where they count, and within what a friction test can have."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

from tribo.campaign.table import COUNTS, LOADS, NUMBERS, TestRow
from tribo.errors import Problem
from tribo.limits import (
    ABSOLUTE_ZERO_C,
    LARGEST_COUNT,
    LARGEST_LOAD_N,
    LARGEST_NUMBER,
    SMALLEST_LOAD_N,
    SMALLEST_NUMBER,
)

_NOT_NEGATIVE = ("speed_mm_s", "hold_s", "stiffness_N_per_m")
_UNITS = {"g": "g", "N": "N", "Pa": "Pa", "s": "s", "C": "C", "pct": "%", "mm": "mm", "Hz": "Hz"}
_WITH_UNIT = re.compile(r"([-+]?\d+(?:[.,]\d+)?)\s*([^\d\s.,+-][^\d]{0,9})?")
_SMALL_OR_ZERO = ("mass_g", *_NOT_NEGATIVE)


def number(row: TestRow, column: str) -> float | None:
    """A cell as a number; None where it is empty. ValueError where it is none."""
    cell = row.cells.get(column, "")
    if not cell:
        return None
    if "_" in cell:
        raise ValueError(cell)
    value = float(cell.replace(",", ".") if row.decimal_comma and "." not in cell else cell)
    if not math.isfinite(value):
        raise ValueError(cell)
    return value


def number_faults(row: TestRow, file: str) -> list[Problem]:
    """Every cell that holds no number, or one that is impossible where it stands."""
    problems, at = [], (file, row.row)
    for column in (*NUMBERS, *COUNTS):
        cell = row.cells.get(column, "")
        try:
            value = number(row, column)
        except ValueError:
            kind = "load_not_a_number" if column in LOADS else "not_a_number"
            problems.append(Problem(kind, "not a number", *at, column, cell, _meant_number(row, column)))
            continue
        if value is None:
            continue
        if column in COUNTS and value != int(value):
            problems.append(Problem("not_a_number", "not a whole number", *at, column, cell, "1, 2, ..."))
        if column in _NOT_NEGATIVE and value < 0:
            problems.append(Problem("negative", "must not be negative", *at, column, cell, "0 or more"))
        elif outside := _outside(column, value):
            problems.append(Problem("impossible_number", "not a possible value", *at, column, cell, outside))
    return problems


def _meant_number(row: TestRow, column: str) -> str:
    """What a cell that holds no number may mean: a number with its unit, or one with a decimal comma."""
    cell, unit = row.cells[column], _UNITS.get(column.rpartition("_")[2], "")
    found = _WITH_UNIT.fullmatch(cell)
    if not found:
        return "a number"
    digits, given = found[1].replace(",", "."), found[2]
    if not given:
        return f"a number with a decimal point: did you mean {digits}?"
    if not unit:
        return f"a number without a unit: did you mean {digits}?"
    if given.casefold() == unit.casefold():
        return f"a number without its unit, which is in the name of the column: did you mean {digits}?"
    return f"a number in {unit}, without the unit: convert {cell} to {unit}"


def _outside(column: str, value: float) -> str:
    """The allowed range where a number lies outside it, else an empty text."""
    least, most = -LARGEST_NUMBER, LARGEST_NUMBER
    if column in COUNTS:
        least, most = -LARGEST_COUNT, LARGEST_COUNT
    if column in _SMALL_OR_ZERO and 0 < abs(value) < SMALLEST_NUMBER:
        return f"0, or {SMALLEST_NUMBER:g} or more"
    if column == "temperature_C":
        least = ABSOLUTE_ZERO_C
    return "" if least <= value <= most else f"{least:g} to {most:g}"


def load_faults(row: TestRow, file: str, load_in_export: bool) -> list[Problem]:
    """normal_load_N must be positive; a sled may carry no mass of its own, but none may be negative.

    With ``load_in_export`` the load may be left to the normal force recorded there.
    """
    at, loads = (file, row.row), _loads(row)
    if not loads and not any(row.cells.get(column) for column in LOADS):
        if load_in_export:
            return []
        allowed = "mass_g, normal_load_N or normal_stress_Pa"
        return [Problem("no_load", "the load is missing", *at, " or ".join(LOADS[:2]), None, allowed)]
    stress = loads.get("normal_stress_Pa")
    if stress is not None and stress <= 0:
        found, what = row.cells["normal_stress_Pa"], "a load must be positive"
        return [Problem("load_not_positive", what, *at, "normal_stress_Pa", found, "more than 0 Pa")]
    load = loads.get("normal_load_N")
    if load is not None and load <= 0:
        found, what = row.cells["normal_load_N"], "a load must be positive"
        return [Problem("load_not_positive", what, *at, "normal_load_N", found, "more than 0 N")]
    if load is not None and not SMALLEST_LOAD_N <= load <= LARGEST_LOAD_N:
        place = (*at, "normal_load_N", row.cells["normal_load_N"], f"{SMALLEST_LOAD_N:g} to {LARGEST_LOAD_N:g} N")
        return [Problem("impossible_load", "not a possible load of a friction test", *place)]
    if load is None and loads.get("mass_g", 1.0) < 0:
        found, what = row.cells["mass_g"], "a mass must not be negative"
        return [Problem("load_not_positive", what, *at, "mass_g", found, "0 g or more")]
    return []


def _loads(row: TestRow) -> Mapping[str, float]:
    """The loads that a row gives as numbers."""
    found = {}
    for column in LOADS:
        try:
            value = number(row, column)
        except ValueError:
            continue
        if value is not None:
            found[column] = value
    return found
