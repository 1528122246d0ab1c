"""Static friction grows with the time of rest (Dieterich-Ruina)."""

from __future__ import annotations

import numpy as np

from tribo.mechanisms.record import (
    REFERENCE_HOLD_S,
    Base,
    Conditions,
    Forces,
    InTable,
    Mechanism,
    Values,
    Variation,
    amplitude,
)


def law(values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
    """T_s = T_b (1 + b ln(1 + t_hold / t_0)), t_0 = 1 s; ``values`` = [b] relative to the fresh contact."""
    before = base.forces(conditions.normal_load_N)
    gain = 1.0 + values[0] * np.log1p(conditions.hold_s / REFERENCE_HOLD_S)
    return Forces(before.static_N * gain, before.sliding_N)


MECHANISM = Mechanism(
    name="contact_ageing",
    kind="interface",
    formula="T_s = T_b (1 + b ln(1 + t_hold / 1 s))",
    parameters=(amplitude("b", "", 0.0, 0.4, 0.03, "relative growth per e-fold of hold"),),
    law=law,
    sign=1,
    regimes=("static",),
    enters="static thresholds of the blocks, by the time of rest",
    quick_error=0.05,  # a higher peak widens the swing that follows it
    shows="static friction only, linear in the logarithm of the hold time",
    confused_with="humidity",
    separates="hold for 0.1 to 1000 s in random order",
    silenced_by=("hold for 0.1 to 1000 s in random order",),
    needs=("hold_s",),
    plain="contact ageing",
    meaning="static friction grows with the time for which the contact has rested",
    variation=Variation("the hold time over 1, 10 and 300 s", "hold_s", (1.0, 10.0, 300.0)),
    in_table=InTable(missing="the hold time is not printed"),
    without_model=("hold_s",),
)
