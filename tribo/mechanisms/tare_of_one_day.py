"""On one day the force was zeroed wrongly: every force of that day is off by the same amount."""

from __future__ import annotations

from collections.abc import Mapping

from tribo.mechanisms.covariate import days_of, in_one_run, is_day, on_its_day
from tribo.mechanisms.record import (
    Base,
    Choosing,
    Conditions,
    DirectMeasurement,
    Forces,
    InTable,
    Mechanism,
    Placement,
    Values,
    amplitude,
)


def law(values: Values, base: Base, conditions: Conditions, choice: str) -> Forces:
    """T -> T + F_0 in both regimes on one day; ``values`` = [F_0] in N."""
    before, off = base.forces(conditions.normal_load_N), values[0] * is_day(conditions, choice)
    return Forces(before.static_N + off, before.sliding_N + off)


def in_chain(values: Values, recorded: Mapping[str, float]) -> dict[str, float]:
    """The same force at every time."""
    return {"offset_N": float(values[0])}


def remedy(choice: str) -> str:
    """Where to look."""
    return f"Read the force before contact in the exports of that day ({choice}), and zero it there."


MECHANISM = Mechanism(
    name="tare_of_one_day",
    kind="instrument",
    formula="T -> T + F_0 on one day",
    parameters=(amplitude("F_0", "N", -0.5, 0.5, 0.03, "force shown at zero force on one day"),),
    law=law,
    sign=0,
    regimes=("static", "sliding"),
    enters="measuring chain on one day, after the slider force",
    shows="on one day every force is off by the same amount, whatever the load, the sample and the regime",
    confused_with="a load of that day that was not counted",
    separates="read the zero of that day before and after each pull",
    silenced_by=("read the zero before and after each pull",),
    choices=days_of,
    plain="a wrong tare on one day",
    meaning="on one day the load cell was zeroed wrongly",
    placement=Placement(chain=in_chain),
    choosing=Choosing(column="date", on_test=on_its_day, in_one_run=in_one_run, remedy=remedy),
    measurement=DirectMeasurement("Read the force before contact in the exports of each day.", 0.003, 0.5),
    in_table=InTable(missing="no days are printed"),
)
