"""Mechanisms that are bound to one day: their choices, and the tests of a day."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tribo.mechanisms.conditions import levels_of
from tribo.mechanisms.covariate import IS, column_of, in_one_run as in_one_run, level_of
from tribo.mechanisms.record import Base, Conditions, OnTest, Values


def days_of(base: Base, conditions: Conditions) -> tuple[str, ...]:
    """ "date is 2026-03-04", for every date where there are several."""
    dates = conditions.columns.get("date")
    return () if dates is None else tuple(f"date{IS}{day}" for day in levels_of(dates))


def is_day(conditions: Conditions, choice: str) -> NDArray[np.bool_]:
    """The tests of the day of a choice, (n,)."""
    return np.asarray(conditions.columns[column_of(choice)] == level_of(choice))


def on_its_day(values: Values, choice: str, conditions: Conditions, test: int) -> OnTest | None:
    """The same values on the tests of the day; None on others."""
    return OnTest(values) if is_day(conditions, choice)[test] else None
