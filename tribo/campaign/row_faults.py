"""The faults of one row of tests.csv, all at once: sample, direction, numbers, load, zero, date and file."""

from __future__ import annotations

import difflib
import errno
import re
from collections.abc import Mapping
from pathlib import Path, PurePosixPath

from tribo.campaign.choice import split_choice
from tribo.campaign.dates import ALLOWED as ALLOWED_DATES, parsed
from tribo.campaign.numbers import load_faults, number_faults
from tribo.campaign.stated import force_faults, has_forces, stated_faults
from tribo.campaign.table import RAW, ZEROS, TestRow
from tribo.errors import Problem, unexpected
from tribo.links import leads_out
from tribo.nearest import did_you_mean
from tribo.records import Pattern
from tribo.zeroing import ALLOWED, zero_choice


def row_faults(
    root: Path, row: TestRow, patterns: Mapping[str, Pattern], measured: bool, recorded: bool
) -> list[Problem]:
    if row.fault is not None:
        return [row.fault]
    problems = []
    if not row.cells["test_id"]:
        problems.append(Problem("no_test_id", "test_id is missing", row.file, row.row, "test_id"))
    problems += _sample_faults(row, patterns) + _direction_faults(row, patterns)
    problems += number_faults(row, row.file) + _zero_faults(row)
    problems += stated_faults(row, row.file)
    problems += load_faults(row, row.file, load_in_export=measured and (recorded or bool(export_of(row)[1])))
    if has_forces(row):
        return [*problems, *force_faults(row, row.file)]
    problems += [p for p in _file_faults(root, row) if measured or p.kind != "missing"]
    return problems


def _sample_faults(row: TestRow, patterns: Mapping[str, Pattern]) -> list[Problem]:
    sample = row.cells["sample"]
    if pattern_of(sample, patterns):
        return []
    directed = [f"{name}{axis}" for name in patterns for axis in "xy"]
    hint = did_you_mean(sample, [*patterns, *directed])
    hint = hint or f"or state its geometry in a table [patterns.{sample}] of campaign.toml"
    allowed = f"{', '.join(patterns)}, or one of these names followed by x or y; {hint}"
    return [Problem("unknown_sample", "no pattern has this name", row.file, row.row, "sample", sample, allowed)]


def _direction_faults(row: TestRow, patterns: Mapping[str, Pattern]) -> list[Problem]:
    """A sample named after one direction and pulled along the other: one of the two cells is wrong."""
    sample, direction = row.cells["sample"], row.cells.get("direction", "").strip().lower()
    axis = "" if sample in patterns else sample[-1:]
    if direction not in ("x", "y") or axis in ("", direction) or not pattern_of(sample, patterns):
        return []
    what = f"sample {sample} is pulled along {axis}, and the column direction says {direction}"
    place = (row.file, row.row, "direction", row.cells["direction"])
    allowed = f"{axis} or an empty cell; or {sample[:-1]}{direction} in the column sample"
    return [Problem("direction_against_sample", what, *place, allowed)]


def _zero_faults(row: TestRow) -> list[Problem]:
    problems = []
    for column in ZEROS:
        cell = row.cells.get(column, "")
        try:
            zero_choice(cell)
        except ValueError:
            problems.append(Problem("unknown_zero", "not a zero", row.file, row.row, column, cell, ALLOWED))
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


def _file_faults(root: Path, row: TestRow) -> list[Problem]:
    name = row.cells.get("file", "")
    place = (row.file, row.row, "file", name)
    path = relative_path(name)
    try:
        if path is None or leads_out(root, root / path):
            what = "the path leads outside the campaign"
            return [Problem("path_outside_campaign", what, *place, "a path inside the campaign folder")]
        if (root / path).is_file() or _is_in_a_zip(root, path):
            return []
        if (root / path).exists() and name:
            return [Problem("not_a_file", "not a regular file", *place, "a file of the campaign")]
        hint = _meant_file(root, path)
    except (OSError, ValueError, RuntimeError) as why:  # too long, no permission, links in a circle
        problem = unexpected(why, "this path cannot be followed")
        kind = "path_not_usable" if _is_of_the_name(why) else problem.kind
        return [Problem(kind, problem.what, *place)]
    allowed = f"a file of the campaign{f'; {hint}' if hint else ''}"
    return [Problem("missing", "this file does not exist" if name else "no file is given", *place, allowed)]


def _is_of_the_name(why: Exception) -> bool:
    """Whether the path itself is at fault, and not the system that could not follow it now."""
    return isinstance(why, OSError) and why.errno in (errno.ENAMETOOLONG, errno.ELOOP)


def _meant_file(root: Path, path: PurePosixPath) -> str:
    """The file that a path may mean, as a question: in raw/, with an ending, or spelled otherwise."""
    if not path.name:
        return ""
    for folder in dict.fromkeys(((root / path).parent, root / RAW)):
        beside = [p.name for p in folder.iterdir() if p.is_file()] if folder.is_dir() else []
        stems = [name for name in beside if name.rpartition(".")[0].lower() == path.stem.lower()]
        same = [n for n in beside if n.lower() == path.name.lower()] or (stems if len(stems) == 1 else [])
        if near := same or difflib.get_close_matches(path.name, beside, 1, 0.9):
            return f"did you mean {(folder / near[0]).relative_to(root).as_posix()}?"
    return ""


def _is_in_a_zip(root: Path, path: PurePosixPath) -> bool:
    """Whether a part of a path is a .zip of the campaign: the rest is an entry of it, which its reader looks for."""
    return any(parent.suffix.lower() == ".zip" and (root / parent).is_file() for parent in path.parents)


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
