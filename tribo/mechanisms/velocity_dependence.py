"""Sliding friction follows the logarithm of the speed."""

from __future__ import annotations

import numpy as np

from tribo.mechanisms.record import REFERENCE_SPEED_M_S, Base, Conditions, Forces, Mechanism, Values, amplitude


def law(values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
    """T_d = T_b (1 + a ln(v / v_0)), v_0 = 0.2 mm/s, never below a tenth of T_b; ``values`` = [a]."""
    before = base.forces(conditions.normal_load_N)
    gain = 1.0 + values[0] * np.log(conditions.speed_m_s / REFERENCE_SPEED_M_S)
    return Forces(before.static_N, before.sliding_N * np.maximum(gain, 0.1))


MECHANISM = Mechanism(
    name="velocity_dependence",
    kind="interface",
    formula="T_d = T_b (1 + a ln(v / 0.2 mm/s))",
    parameters=(amplitude("a", "", -0.4, 0.4, 0.05, "relative change per e-fold of speed"),),
    law=law,
    sign=0,
    regimes=("sliding",),
    enters="block sliding thresholds, by the pull speed",
    quick_error=0.05,  # blocks that slid already carry their share of the peak
    shows="sliding force against ln v, all samples alike",
    confused_with="temperature",
    separates="a speed ladder at one temperature",
    silenced_by=("a ladder of five speeds at one temperature",),
    needs=("speed_m_s",),
)
