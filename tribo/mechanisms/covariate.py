"""T follows a recorded column that no other mechanism owns: operator, date, batch."""

from __future__ import annotations

import numpy as np

from tribo.mechanisms.record import Base, Conditions, Forces, Mechanism, StringArray, Values, amplitude
from tribo.records import FloatArray


def law(values: Values, base: Base, conditions: Conditions, choice: str) -> Forces:
    """T = T_b exp(g s), s the score of the column ``choice``; ``values`` = [g]."""
    before = base.forces(conditions.normal_load_N)
    gain = np.exp(values[0] * score(conditions.columns[choice]))
    return Forces(before.static_N * gain, before.sliding_N * gain)


def score(column: StringArray) -> FloatArray:
    """Numbers are standardised; of two names the first counts -1/2 and the second +1/2."""
    try:
        numbers = np.asarray(column, float)
        return np.asarray((numbers - numbers.mean()) / max(numbers.std(), 1e-300))
    except ValueError:
        names = np.unique(column)
        return np.where(column == names[0], -0.5, 0.5)


def columns(base: Base, conditions: Conditions) -> tuple[str, ...]:
    """Every recorded column of numbers, or of exactly two names."""
    return tuple(name for name, column in conditions.columns.items() if _usable(column))


def _usable(column: StringArray) -> bool:
    names = np.unique(column)
    if len(names) < 2:
        return False
    try:
        return bool(np.all(np.isfinite(np.asarray(column, float))))
    except ValueError:
        return len(names) == 2


MECHANISM = Mechanism(
    name="covariate",
    kind="any",
    formula="T = T_b exp(g s), s the standardised column",
    parameters=(amplitude("g", "", -1.5, 1.5, 0.1, "ln T per standard deviation, or from name to name"),),
    law=law,
    sign=0,
    regimes=("static", "sliding"),
    enters="a gain on block thresholds, by the column",
    shows="that column, both regimes",
    confused_with="whatever moved together with that column",
    separates="vary that column alone, in random order",
    silenced_by=("vary that column alone, in random order",),
    choices=columns,
)
