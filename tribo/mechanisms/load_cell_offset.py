"""The load cell does not read zero at zero force."""

from __future__ import annotations

from tribo.mechanisms.record import Base, Conditions, Forces, Mechanism, Values, amplitude


def law(values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
    """T -> T + F_0 in both regimes; ``values`` = [F_0] in N."""
    before = base.forces(conditions.normal_load_N)
    return Forces(before.static_N + values[0], before.sliding_N + values[0])


MECHANISM = Mechanism(
    name="load_cell_offset",
    kind="instrument",
    formula="T -> T + F_0",
    parameters=(amplitude("F_0", "N", -2.0, 2.0, 0.1, "force shown at zero force"),),
    law=law,
    sign=1,
    regimes=("static", "sliding"),
    enters="the virtual instrument, after the slider force",
    shows="the force before contact; T whatever the area fraction",
    confused_with="suction",
    separates="read the zero before and after each pull",
    silenced_by=("read the zero before and after each pull",),
)
