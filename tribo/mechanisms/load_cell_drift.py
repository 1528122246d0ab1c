"""The zero of the load cell wanders with time."""

from __future__ import annotations

from tribo.mechanisms.record import Base, Conditions, Forces, Mechanism, Values, amplitude


def law(values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
    """T -> T + rate x (time since the first pull); ``values`` = [rate] in N/h."""
    before = base.forces(conditions.normal_load_N)
    extra_N = values[0] * conditions.elapsed_s / 3600.0
    return Forces(before.static_N + extra_N, before.sliding_N + extra_N)


MECHANISM = Mechanism(
    name="load_cell_drift",
    kind="instrument",
    formula="T -> T + rate t",
    parameters=(amplitude("rate", "N/h", -0.2, 0.2, 0.002, "drift of the zero"),),
    law=law,
    sign=1,
    regimes=("static", "sliding"),
    enters="the virtual instrument, after the slider force",
    shows="the run order, and the force before contact",
    confused_with="run_in",
    separates="the force before contact, or a fresh specimen in the middle of the series",
    silenced_by=("read the zero before and after each pull",),
    needs=("elapsed_s",),
)
