"""A campaign handed to the code under test as records, with its further columns and its gaps.

The forces go through ``tests/blind/direct.py``, which is the one place of the generator that names records of the
library.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from blind.bench import Bench
from blind.direct import ingested

FURTHER = ("film_um", "recipe", "lot", "wear_um")


def handed_over(
    bench: Bench,
    seed: int,
    columns: Sequence[str] = FURTHER,
    keep: np.ndarray | None = None,
    cells: Mapping[str, np.ndarray] | None = None,
) -> Any:
    """The campaign as the records of a reader.

    Parameters
    ----------
    bench : Bench
        The finished campaign.
    seed : int
        Of the errors of reading.
    columns : sequence of str
        The further columns that the table has.
    keep : ndarray of bool, shape (n,), optional
        The tests that are handed over; all by default.
    cells : mapping of str to ndarray of object, shape (n,), optional
        What stands in the cells of a column in place of the values: None for an empty cell, or a word.
    """
    whole = ingested(bench, seed)
    tests = []
    for k, (test, row) in enumerate(zip(whole.campaign.tests, bench.tests.to_dict("records"), strict=True)):
        if keep is not None and not keep[k]:
            continue
        own = {name: values[k] for name, values in (cells or {}).items()}
        further = {name: own.pop(name, row[name]) for name in columns}
        written = {name: "" if value is None else str(value) for name, value in further.items()}
        tests.append(replace(test, covariates={**test.covariates, **written}, **_recorded(own)))
    return replace(whole, campaign=replace(whole.campaign, tests=tuple(tests)))


def _recorded(cells: Mapping[str, Any]) -> dict[str, Any]:
    """Fields of a test record with these cells; a word in a column of numbers is no number."""
    given = {name: value for name, value in cells.items() if name in ("temperature_C", "humidity_pct", "hold_s")}
    found: dict[str, Any] = {name: float(v) if isinstance(v, float | int) else None for name, v in given.items()}
    if "speed_mm_s" in cells:
        speed = cells["speed_mm_s"]
        found["speed_m_s"] = speed * 1e-3 if isinstance(speed, float | int) else None
    if "operator" in cells:
        found["operator"] = cells["operator"] or ""
    return found
