"""What campaign.toml and tests.csv state about the numbers of an export, and forces that were evaluated elsewhere."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from fnmatch import fnmatchcase
from typing import Any

from tribo.campaign.numbers import number
from tribo.campaign.table import TestRow
from tribo.errors import Problem
from tribo.records import Correction, Evaluated

CORRECTIONS = ("sign", "gain", "lever_arm_mm", "sampling_rate_Hz")
FORCES = ("static_N", "sliding_N")
RATIOS = {"static_mu": "static_N", "sliding_mu": "sliding_N", "coefficient": "sliding_N"}
UNCERTAINTIES = ("static_u_N", "sliding_u_N", "static_mu_u", "sliding_mu_u", "coefficient_u")
_MM = 1e-3

Columns = Mapping[str, str | list[str]]


def correction_of(numbers: Mapping[str, float | None], general: Any, speed_m_s: float | None) -> Correction:
    """The correction of one test: its own cells first, then [campaign] of campaign.toml."""
    given = {key: numbers.get(key) if numbers.get(key) is not None else getattr(general, key) for key in CORRECTIONS}
    lever = given["lever_arm_mm"]
    return Correction(
        sign=1.0 if given["sign"] is None else given["sign"],
        gain=1.0 if given["gain"] is None else given["gain"],
        lever_arm_m=None if lever is None else lever * _MM,
        sampling_rate_Hz=given["sampling_rate_Hz"],
        speed_m_s=speed_m_s or None,
    )


def stated_faults(row: TestRow, file: str) -> Iterator[Problem]:
    """A sign that is none, a gain, lever arm or rate that is not positive, an uncertainty below zero."""
    for column in (*CORRECTIONS, *UNCERTAINTIES):
        try:
            value = number(row, column)
        except ValueError:
            continue  # named with the other numbers
        if value is None:
            continue
        at = (file, row.row, column, row.cells[column])
        if column == "sign" and value not in (1.0, -1.0):
            yield Problem("not_a_sign", "not a sign", *at, "1 or -1")
        elif column in UNCERTAINTIES and value < 0:
            yield Problem("negative", "must not be negative", *at, "0 or more")
        elif column in CORRECTIONS[1:] and value <= 0:
            yield Problem("not_positive", "must be positive", *at, "more than 0; a reversed direction is sign = -1")


def has_forces(row: TestRow) -> bool:
    """Whether a row gives a force or a coefficient of friction in place of an export."""
    return any(row.cells.get(column) for column in (*FORCES, *RATIOS))


def force_faults(row: TestRow, file: str) -> Iterator[Problem]:
    """A row has an export or forces, not both; a force is given once; a coefficient needs the load."""
    at = (file, row.row)
    given = [column for column in (*FORCES, *RATIOS) if row.cells.get(column)]
    if row.cells.get("file"):
        what = "this row has an export and a force evaluated elsewhere"
        allowed = "an empty cell in file, or empty cells in " + ", ".join(given)
        yield Problem("file_and_force", what, *at, given[0], row.cells[given[0]], allowed)
    for force in FORCES:
        twice = [column for column in given if RATIOS.get(column, column) == force]
        if len(twice) > 1:
            yield Problem("force_given_twice", "the same force is given twice", *at, " and ".join(twice))


def evaluated_forces(row: TestRow, load_N: float) -> Evaluated | None:
    """The forces of a row without an export, in newton; a coefficient is multiplied by the load."""
    if row.cells.get("file") or not has_forces(row):
        return None
    found: dict[str, float] = {}
    for force in FORCES:
        if (value := number(row, force)) is not None:
            found[force] = value
            found[_u(force)] = number(row, _u(force)) or 0.0
    for ratio, force in RATIOS.items():
        if (value := number(row, ratio)) is not None:
            found[force] = value * load_N
            found[_u(force)] = (number(row, f"{ratio}_u") or 0.0) * load_N
    return Evaluated(**found)


def _u(force: str) -> str:
    return force.replace("_N", "_u_N")


def columns_by_file(columns: Mapping[str, Any]) -> tuple[Columns, dict[str, Columns]]:
    """[columns] of campaign.toml: what holds for every export, and what holds for a file or a glob of files."""
    general = {key: value for key, value in columns.items() if not isinstance(value, dict)}
    return general, {key: value for key, value in columns.items() if isinstance(value, dict)}


def columns_of(file: str, general: Columns, by_file: Mapping[str, Columns]) -> Columns:
    """Columns of one export: those of the campaign, replaced by those of every glob that fits, in their order."""
    path = file.partition("#")[0]
    found = dict(general)
    for pattern, columns in by_file.items():
        if any(fnmatchcase(text, pattern) for text in (file, path, path.rpartition("/")[2])):
            found.update(columns)
    return found
