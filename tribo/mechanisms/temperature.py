"""Friction depends on the temperature of the room."""

from __future__ import annotations

import numpy as np

from tribo.mechanisms.record import Base, Conditions, Forces, InTable, Mechanism, Values, amplitude

REFERENCE_C = 23.0


def law(values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
    """T = T_b exp(-c (theta - 23 degC)) in both regimes; ``values`` = [c] in 1/K."""
    before = base.forces(conditions.normal_load_N)
    gain = np.exp(-values[0] * (conditions.temperature_C - REFERENCE_C))
    return Forces(before.static_N * gain, before.sliding_N * gain)


MECHANISM = Mechanism(
    name="temperature",
    kind="environment",
    formula="T = T_b exp(-c (theta - 23 degC))",
    parameters=(amplitude("c", "1/K", -0.4, 0.4, 0.03, "relative loss per kelvin"),),
    law=law,
    sign=0,
    regimes=("static", "sliding"),
    enters="block thresholds, by the recorded temperature",
    shows="static and sliding friction follow the recorded temperature",
    confused_with="humidity, or drift",
    separates="change the temperature in a controlled step",
    silenced_by=("change the temperature in a controlled step at constant humidity",),
    needs=("temperature_C",),
    plain="temperature",
    meaning="friction changes with the temperature of the room",
    in_table=InTable(missing="no temperature is printed"),
    without_model=("temperature_C",),
)
