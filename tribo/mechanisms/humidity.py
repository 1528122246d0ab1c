"""Adhesion depends on the humidity of the room."""

from __future__ import annotations

import numpy as np

from tribo.mechanisms.record import Base, Conditions, Forces, InTable, Mechanism, Values, amplitude

REFERENCE_PCT = 50.0


def law(values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
    """tau0 -> tau0 (1 + h (RH - 50 %)), never below zero, in both regimes; ``values`` = [h] in 1/percent."""
    gain = np.maximum(1.0 + values[0] * (conditions.humidity_pct - REFERENCE_PCT), 0.0)
    load = conditions.normal_load_N
    return Forces(
        base.static_mu * load + base.static_adhesion_N * gain,
        base.sliding_mu * load + base.sliding_adhesion_N * gain,
    )


MECHANISM = Mechanism(
    name="humidity",
    kind="environment",
    formula="tau0 -> tau0 (1 + h (RH - 50 %))",
    parameters=(amplitude("h", "1/%", -0.15, 0.15, 0.02, "relative change per percent of humidity"),),
    law=law,
    sign=0,
    regimes=("static", "sliding"),
    enters="adhesion of the contact blocks, by the recorded humidity",
    shows="tau0 follows the recorded humidity, so that low loads show it most",
    confused_with="an offset of the load cell that changes between sessions",
    separates="change the humidity in a controlled step",
    silenced_by=("change the humidity in a controlled step at constant temperature",),
    needs=("humidity_pct",),
    plain="humidity",
    meaning="adhesion changes with the humidity of the room",
    in_table=InTable(missing="no humidity is printed"),
    without_model=("humidity_pct",),
)
