"""A campaign drafted from a table of forces that were evaluated elsewhere: one row a test, cycle or pull.

Its columns are as a user maps them, or as their names and units tell the sample, the load, the speed and the friction.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from tribo.campaign.table import EVALUATED, KNOWN, read_table
from tribo.drafting.draft import Draft
from tribo.drafting.file_names import as_column
from tribo.errors import CampaignError, Problem
from tribo.units import match_quantity

_SAMPLE = ("sample", "material", "probe", "werkstoff", "matiere", "materiau", "echantillon", "muestra")
_SETS = ("dataname", "data name", "data set", "dataset", "series")  # of one rig each: not to be pooled
_COEFFICIENT = re.compile(
    r"(?:cof|mu|friction coefficient|coefficient of friction|coefficient)(?: (?:mean|avg|average))?"
)
_FORCE = re.compile(r"(?:friction(?:al)?|sliding|tangential) force(?: (?:mean|avg|average))?")
_LOAD = re.compile(r"(?:nominal |applied |mean )?(?:normal )?load|normal force|nominalload|normalload")
_SPEED = re.compile(r"(?:max |mean |nominal )?(?:lin |linear |sliding )?(?:speed|velocity)|maxlinspeed")
_UNIT_AT_END = re.compile(r"[\[(]\s*(m?k?N|gf?|kgf|um/s|mm/s|m/s|mm/min)\s*[\])]\s*$")
_FIELDS = {
    "N": "normal_load_N", "mN": "normal_load_mN", "kN": "normal_load_kN", "gf": "normal_load_gf", "g": "mass_g",
    "kgf": "normal_load_kgf", "mm/s": "speed_mm_s", "um/s": "speed_um_s", "m/s": "speed_m_s", "mm/min": "speed_mm_min",
}  # fmt: skip
_LOOKED_AT = 200  # rows in which a label has to repeat the number with its unit

Table = Mapping[str, Sequence[str]]  # the cells of each column by its name


def draft_from_table(path: Path, mapping: Mapping[str, str]) -> Draft:
    """The rows of tests.csv from a table; ``mapping`` gives its column for each column of tests.csv.

    A column of tests.csv may carry another unit of its quantity: ``normal_load_mN``. Without a mapping one is proposed
    from the names of the columns. Columns not mapped are kept as covariates, unless every row has the same in them,
    they repeat a mapped column, or they are further figures of the evaluation.

    Raises
    ------
    CampaignError
        The table has no rows, a column that is not there is mapped, or neither a force nor a load is.
    """
    table, header_row = _table_of(path)
    n_rows = len(next(iter(table.values()), ()))
    if not n_rows:
        raise CampaignError(Problem("empty", "the table has no rows", file=path.name))
    draft = Draft(of_exports=False)
    if not mapping and (mapping := proposed_mapping(table)):
        text = ",".join(f"{field}={name}" for field, name in mapping.items())
        draft.found.append(f'columns "{text}" (proposed; give --table to read them otherwise)')
    place, here = (path.name, header_row), ", ".join(filter(None, table))
    problems = [
        Problem("missing_column", f"no such column for {field}", *place, name, None, here)
        for field, name in mapping.items()
        if name not in table
    ]
    columns = {as_column(field, "1")[0] for field in mapping}
    for wanted in (EVALUATED, ("normal_load_N", "mass_g", "normal_stress_Pa")):
        if not columns & set(wanted):
            what = "the table needs a force or coefficient, and a load"
            allowed = f"one of {', '.join(wanted)}; columns here: {here}"
            problems.append(Problem("missing_column", what, *place, None, None, allowed))
    if problems:
        raise CampaignError(problems)
    left_out = {"", *KNOWN, *mapping.values(), *repeated_or_derived(table, mapping)}
    kept = [name for name, cells in table.items() if name not in left_out and len(set(cells)) > 1]
    width = len(str(n_rows))
    for k in range(n_rows):
        cells = {name: " ".join(column[k].split()) for name, column in table.items()}
        stated = dict(as_column(field, cells[name]) for field, name in mapping.items())
        others = {name: cells[name] for name in kept}
        draft.rows.append({"test_id": f"T{k + 1:0{width}d}", "sample": path.stem, **others, **stated})
    draft.found.append(f"{n_rows} rows with {', '.join(mapping)}; kept as covariates: {', '.join(kept) or 'none'}")
    return draft


def _table_of(path: Path) -> tuple[Table, int]:
    """A table by its columns, and the line of the file that names them."""
    names, header_row, rows = read_table(path, path.name)
    return {name: [row.cells.get(name, "") for row in rows] for name in names}, header_row


def is_table_of_forces(path: Path) -> bool:
    """Whether the columns of a file name a load and a friction, both with units, and no time."""
    try:
        return bool(proposed_mapping(_table_of(path)[0]))
    except (CampaignError, OSError):
        return False


def proposed_mapping(table: Table) -> dict[str, str]:
    """Column of the table for each column of tests.csv, as far as names and units tell; {} without load and friction.

    The unit of a number stands in brackets behind the name, or in a column of labels that repeats it: 10 beside
    "10 mN". Without a unit a column is not taken. A table with a time or a displacement is a trace.
    """
    if any((match_quantity(name) or ("", 0))[0] in ("time", "displacement") for name in table):
        return {}
    found: dict[str, str] = {}
    for name in table:
        plain = _plain(name)
        if plain in _SAMPLE:
            found.setdefault("sample", name)
        elif _COEFFICIENT.fullmatch(plain):
            found.setdefault("coefficient", name)
        elif _FORCE.fullmatch(plain) and _unit(table, name) == "N":
            found.setdefault("sliding_N", name)
        elif _LOAD.fullmatch(plain) or _SPEED.fullmatch(plain):
            field = _FIELDS.get(_unit(table, name), "")
            if field.startswith("speed") == bool(_SPEED.fullmatch(plain)) and field:
                found.setdefault(field, name)
    if "sample" in found:
        sample = table[found["sample"]]
        for name, cells in table.items():  # data sets, each of one sample
            if _plain(name) in _SETS and len(set(zip(cells, sample, strict=True))) == len(set(cells)) < len(cells) / 2:
                found["sample"] = name
                break
    loads = [field for field in found if field.startswith(("normal_load", "mass"))]
    return found if loads and ("coefficient" in found or "sliding_N" in found) else {}


def _plain(name: str) -> str:
    """A column name in lower case without its unit, marks as blanks: "CoF.mean" -> "cof mean"."""
    return re.sub(r"[\W_]+", " ", _UNIT_AT_END.sub("", name)).strip().lower()


def _unit(table: Table, name: str) -> str:
    """The unit behind a name, or behind the numbers in another column that repeats this one row by row; else empty."""
    if stated := _UNIT_AT_END.search(name):
        return stated[1]
    for other, labels in table.items():
        units = {_unit_behind(*cells) for cells in zip(table[name][:_LOOKED_AT], labels, strict=False)}
        if other != name and len(units) == 1 and units != {None}:
            return str(units.pop())
    return ""


def _unit_behind(number: str, label: str) -> str | None:
    unit = label.strip().removeprefix(number.strip())
    return unit.strip() if number.strip() and unit != label.strip() and unit.strip() in _FIELDS else None


def repeated_or_derived(table: Table, taken: Mapping[str, str]) -> set[str]:
    """Columns that say nothing of their own: copies of a mapped number in other units or words, and further figures of
    the evaluation, whose names begin like that of the friction ("CoF.sd" beside "CoF.mean")."""
    friction = [name for field, name in taken.items() if field in ("coefficient", "sliding_N", "static_N")]
    stems = {_plain(name).split(" ")[0] for name in friction}
    found = {name for name in table if _plain(name).split(" ")[0] in stems and name not in friction}
    mapped = [name for name in taken.values() if name not in friction]
    for name, cells in table.items():
        for other in (table[other] for other in mapped if other != name):
            if len(set(zip(cells, other, strict=True))) == len(set(cells)) == len(set(other)):
                found.add(name)
    return found
