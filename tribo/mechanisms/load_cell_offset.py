"""The load cell does not read zero at zero force."""

from __future__ import annotations

from collections.abc import Mapping

from tribo.mechanisms.record import (
    STROKES_APART,
    Base,
    Conditions,
    DirectMeasurement,
    Forces,
    Mechanism,
    Placement,
    TraceEvidence,
    Values,
    amplitude,
)


def law(values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
    """T -> T + F_0 in both regimes; ``values`` = [F_0] in N."""
    before = base.forces(conditions.normal_load_N)
    return Forces(before.static_N + values[0], before.sliding_N + values[0])


def in_chain(values: Values, recorded: Mapping[str, float]) -> dict[str, float]:
    """The same force at every time."""
    return {"offset_N": float(values[0])}


MECHANISM = Mechanism(
    name="load_cell_offset",
    kind="instrument",
    formula="T -> T + F_0",
    parameters=(amplitude("F_0", "N", -2.0, 2.0, 0.1, "force shown at zero force"),),
    law=law,
    sign=1,
    regimes=("static", "sliding"),
    enters="measuring chain, after the slider force",
    shows="a force before contact; the change of T does not depend on the area fraction",
    confused_with="suction",
    separates="read the zero before and after each pull",
    silenced_by=("read the zero before and after each pull",),
    plain="an offset of the load cell",
    meaning="the load cell shows a force when there is none",
    placement=Placement(chain=in_chain),
    evidence=TraceEvidence(
        quantity="zero",
        covariate="",
        source="read from the force before contact; it was subtracted from every force",
        observable="zero",
        corrected="the force before contact is {found}; the zero of each pull was subtracted, so it cannot explain the "
        "friction forces",
    ),
    measurement=DirectMeasurement("Record two seconds of force before contact and after lift-off.", 0.003, 0.5),
    without_model=(STROKES_APART,),
)
