"""A campaign drafted from a table of forces that were evaluated elsewhere: one row a test, cycle or pull."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from tribo.campaign.table import KNOWN, Table, read_table
from tribo.errors import CampaignError, Problem
from tribo.ingestion.draft import Draft
from tribo.ingestion.file_names import as_column
from tribo.ingestion.table_columns import proposed_mapping, repeated_or_derived

_FORCES = ("static_N", "sliding_N", "static_mu", "sliding_mu", "coefficient")
_LOADS = ("normal_load_N", "mass_g", "normal_stress_Pa")


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
    table = read_table(path, path.name)
    if table is None or not table.rows:
        raise CampaignError(Problem("empty", "the table has no rows", file=path.name))
    draft = Draft(of_exports=False)
    if not mapping and (mapping := proposed_mapping(table)):
        text = ",".join(f"{field}={name}" for field, name in mapping.items())
        draft.found.append(f'columns "{text}" (proposed; give --table to read them otherwise)')
    if problems := _faults(table, mapping, path.name):
        raise CampaignError(problems)
    left_out = set(mapping.values()) | repeated_or_derived(table, dict(mapping))
    kept = [n for n in table.names if n and n not in left_out and n not in KNOWN and _varies(table, n)]
    width = len(str(len(table.rows)))
    for k, row in enumerate(table.rows, start=1):
        stated = dict(as_column((field, _number(row.cells.get(name, "")))) for field, name in mapping.items())
        others = {name: " ".join(row.cells.get(name, "").split()) for name in kept}
        draft.rows.append({"test_id": f"T{k:0{width}d}", "sample": path.stem, **others, **stated})
    draft.found.append(
        f"{len(table.rows)} rows with {', '.join(mapping)}; kept as covariates: {', '.join(kept) or 'none'}"
    )
    return draft


def is_table_of_forces(path: Path) -> bool:
    """Whether the columns of a file name a load and a friction, both with units, and no time."""
    try:
        table = read_table(path, path.name)
    except (CampaignError, OSError):
        return False
    return table is not None and bool(proposed_mapping(table))


def _varies(table: Table, name: str) -> bool:
    return len({row.cells.get(name, "") for row in table.rows}) > 1


def _number(text: str) -> str:
    return " ".join(text.split())


def _faults(table: Table, mapping: Mapping[str, str], file: str) -> list[Problem]:
    problems = []
    here = ", ".join(name for name in table.names if name)
    for field, name in mapping.items():
        if name not in table.names:
            problems.append(
                Problem("missing_column", f"no such column for {field}", file, table.header_row, name, None, here)
            )
    columns = {as_column((field, "1"))[0] for field in mapping}
    for wanted in (_FORCES, _LOADS):
        if not columns & set(wanted):
            what = "the table needs a force or coefficient, and a load"
            allowed = f"one of {', '.join(wanted)}; columns here: {here}"
            problems.append(Problem("missing_column", what, file, table.header_row, None, None, allowed))
    return problems
