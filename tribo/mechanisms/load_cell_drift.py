"""The zero of the load cell drifts with time."""

from __future__ import annotations

from collections.abc import Mapping

from tribo.mechanisms.record import (
    Base,
    Conditions,
    DirectMeasurement,
    Forces,
    InTable,
    Mechanism,
    Placement,
    TraceEvidence,
    Values,
    amplitude,
)


def law(values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
    """T -> T + rate x (time since the first pull); ``values`` = [rate] in N/h."""
    before = base.forces(conditions.normal_load_N)
    extra_N = values[0] * conditions.elapsed_s / 3600.0
    return Forces(before.static_N + extra_N, before.sliding_N + extra_N)


def in_chain(values: Values, recorded: Mapping[str, float]) -> dict[str, float]:
    """An offset that counts from when the zero was taken."""
    return {"offset_N": float(values[0]) * recorded["elapsed_s"] / 3600.0}


MECHANISM = Mechanism(
    name="load_cell_drift",
    kind="instrument",
    formula="T -> T + rate t",
    parameters=(amplitude("rate", "N/h", -0.2, 0.2, 0.002, "drift of the zero"),),
    law=law,
    sign=1,
    regimes=("static", "sliding"),
    enters="measuring chain, after the slider force",
    shows="T follows the run order, and so does the force before contact",
    confused_with="run-in",
    separates="read the force before contact, or use a fresh specimen in the middle of the series",
    silenced_by=("read the zero before and after each pull",),
    needs=("elapsed_s",),
    plain="a drift of the load cell",
    meaning="the zero of the load cell moves with time",
    placement=Placement(chain=in_chain),
    evidence=TraceEvidence(
        quantity="zero drift",
        covariate="started_at",
        source="read from the force before contact; the zero of each pull was subtracted",
        observable="zero",
        corrected="the force before contact changes by {found}; the zero of each pull was subtracted, so it cannot "
        "explain the friction forces",
        contains=("load_cell_offset",),
    ),
    measurement=DirectMeasurement("Record the unloaded cell every hour for a day.", 2e-4, 1.0),
    in_table=InTable(missing="no times are printed"),
)
