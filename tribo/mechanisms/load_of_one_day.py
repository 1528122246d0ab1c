"""On one day something else rests on the slider: a carrier was left off or left on."""

from __future__ import annotations

import numpy as np

from tribo.mechanisms.covariate import days_of, in_one_run, is_day, on_its_day
from tribo.mechanisms.record import (
    Base,
    Choosing,
    Conditions,
    DirectMeasurement,
    Forces,
    InTable,
    Mechanism,
    Values,
    amplitude,
)


def law(values: Values, base: Base, conditions: Conditions, choice: str) -> Forces:
    """N -> N + dN in both regimes on one day; no more can be missing than was put on. ``values`` = [dN] in N."""
    added = np.maximum(values[0], -conditions.weight_N) * is_day(conditions, choice)
    return base.forces(conditions.normal_load_N + added)


def remedy(choice: str) -> str:
    """What to look up and to weigh."""
    return f"Look up what rested on the slider ({choice}): a carrier left off or left on. Weigh what it is."


MECHANISM = Mechanism(
    name="load_of_one_day",
    kind="bookkeeping",
    formula="N -> N + dN on one day",
    parameters=(amplitude("dN", "N", -1.0, 1.0, 0.05, "load on one day that was not counted"),),
    law=law,
    sign=0,
    regimes=("static", "sliding"),
    enters="normal force of the blocks, on one day",
    shows="on one day friction is higher or lower, most at small loads, in the static regime by the larger force",
    confused_with="another tare on that day",
    separates="repeat the smallest load with and without the carrier",
    silenced_by=("weigh the slider with all that rests on it each day",),
    choices=days_of,
    plain="a load of one day that was not counted",
    meaning="on one day something was missing on the slider, or more rested on it than was counted",
    choosing=Choosing(column="date", on_test=on_its_day, in_one_run=in_one_run, remedy=remedy),
    measurement=DirectMeasurement("Weigh what rests on the slider.", 0.005, 0.25),
    in_table=InTable(missing="no days are printed"),
)
