"""Sliding friction follows the logarithm of the speed."""

from __future__ import annotations

import numpy as np

from tribo.mechanisms.record import (
    REFERENCE_SPEED_M_S,
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
    enters="sliding thresholds of the blocks, by the pull speed",
    quick_error=0.05,  # blocks that slid already carry their share of the peak
    shows="sliding friction is linear in the logarithm of the speed, the same on all samples",
    confused_with="temperature",
    separates="measure at a series of speeds at one temperature",
    silenced_by=("measure at five speeds at one temperature",),
    needs=("speed_m_s",),
    plain="velocity-dependent friction",
    meaning="sliding friction changes with the pull speed",
    variation=Variation("the pull speed over 0.05, 0.2 and 0.8 mm/s", "speed_mm_s", (0.05, 0.2, 0.8)),
    in_table=InTable(missing="all pulls are at one speed"),
    without_model=("speed_mm_s",),
)
