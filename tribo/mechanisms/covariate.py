"""T follows a recorded column that no other mechanism uses: operator, date, batch."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tribo.mechanisms.conditions import is_level, levels_of
from tribo.mechanisms.record import (
    Base,
    Choosing,
    Conditions,
    Forces,
    InTable,
    Mechanism,
    OnTest,
    StringArray,
    Values,
    amplitude,
)
from tribo.records import FloatArray

MOST_NAMES = 12
IS = " is "


def law(values: Values, base: Base, conditions: Conditions, choice: str) -> Forces:
    """T = T_b exp(g s), s the score of ``choice``: a column, or "batch is a" for one name of several."""
    before = base.forces(conditions.normal_load_N)
    gain = np.exp(values[0] * score(conditions, choice))
    return Forces(before.static_N * gain, before.sliding_N * gain)


def score(conditions: Conditions, choice: str) -> FloatArray:
    """Numbers are standardised; of two names the first counts -1/2 and the second +1/2; one of several counts 1.

    A test whose name was not recorded counts what the others do on average.
    """
    if choice in conditions.columns:
        column = conditions.columns[choice]
        numbers = _numbers(column)
        if numbers is not None:
            return np.asarray((numbers - numbers.mean()) / max(float(numbers.std()), 1e-300))
        return 0.5 - is_level(column, levels_of(column)[0])
    name, level = choice.split(IS, 1)
    return is_level(conditions.columns[name], level)


def choices(base: Base, conditions: Conditions) -> tuple[str, ...]:
    """Every column of numbers or of two names, and every name of a column of up to twelve."""
    found: list[str] = []
    for name, column in conditions.columns.items():
        names = levels_of(column)
        if len(names) < 2:
            continue
        if len(names) == 2 or _numbers(column) is not None:
            found.append(name)
        elif len(names) <= MOST_NAMES:
            found += [f"{name}{IS}{level}" for level in names]
    return tuple(found)


def column_of(choice: str) -> str:
    """The column of a choice."""
    return choice.split(IS, 1)[0]


def level_of(choice: str) -> str:
    """The one name of several that a choice concerns, or nothing."""
    return choice.partition(IS)[2]


def _numbers(column: StringArray) -> FloatArray | None:
    try:
        numbers = np.asarray(column, float)
    except ValueError:
        return None
    return numbers if np.isfinite(numbers).all() else None


def on_test(values: Values, choice: str, conditions: Conditions, test: int) -> OnTest:
    """The score of the test times the amplitude."""
    return np.array([values[0] * score(conditions, choice)[test]]), ""


def in_one_run(conditions: Conditions) -> str:
    """The one column that a run of the simulator has."""
    name, column = next(iter(conditions.columns.items()))
    return f"{name}{IS}{column[0]}"


MECHANISM = Mechanism(
    name="covariate",
    kind="any",
    formula="T = T_b exp(g s), s the score of the column",
    parameters=(amplitude("g", "", -1.5, 1.5, 0.1, "ln T per standard deviation, or from name to name"),),
    law=law,
    sign=0,
    regimes=("static", "sliding"),
    enters="gain of the block thresholds, by the column",
    shows="static and sliding friction follow that column",
    confused_with="anything else that changed together with that column",
    separates="vary that column alone, in random order",
    silenced_by=("vary that column alone, in random order",),
    choices=choices,
    plain="a recorded column",
    meaning="friction follows a recorded column that no other mechanism uses",
    choosing=Choosing(label=column_of, level=level_of, on_test=on_test, in_one_run=in_one_run),
    in_table=InTable(missing="no further column is printed"),
    any_column=True,
)


def days_of(base: Base, conditions: Conditions) -> tuple[str, ...]:
    """ "date is 2026-03-04", for every date where there are several."""
    dates = conditions.columns.get("date")
    return () if dates is None else tuple(f"date{IS}{day}" for day in levels_of(dates))


def is_day(conditions: Conditions, choice: str) -> NDArray[np.bool_]:
    """The tests of the day of a choice, (n,)."""
    return np.asarray(conditions.columns[column_of(choice)] == level_of(choice))


def on_its_day(values: Values, choice: str, conditions: Conditions, test: int) -> OnTest | None:
    """The same values on the tests of the day; None on others."""
    return (values, "") if is_day(conditions, choice)[test] else None
