"""The springs of the bulk relax (a Prony series)."""

from __future__ import annotations

import numpy as np

from tribo.mechanisms.record import REFERENCE_SPEED_M_S, Base, Conditions, Forces, Mechanism, Values, amplitude
from tribo.records import FloatArray


def law(values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
    """Neither the peak nor the sliding mean changes to first order; ``values`` = [g]."""
    return base.forces(conditions.normal_load_N)


def rise(values: Values, stiffness_N_per_m: FloatArray, conditions: Conditions) -> FloatArray:
    """Slope of the rise, k (1 + g ln(v / v_0)): a broad Prony spectrum seen at the rate of the pull."""
    return stiffness_N_per_m * (1.0 + values[0] * np.log(conditions.speed_m_s / REFERENCE_SPEED_M_S))


MECHANISM = Mechanism(
    name="bulk_viscoelasticity",
    kind="bulk",
    formula="k = k_0 (1 + g ln(v / 0.2 mm/s))",
    parameters=(amplitude("g", "", 0.0, 0.3, 0.05, "relative stiffening per e-fold of rate"),),
    law=law,
    rise=rise,
    sign=1,
    regimes=("rise",),
    enters="the springs between the blocks and to the slider",
    shows="a rounded rise that is steeper at higher speed, relaxation on stopping",
    confused_with="machine_compliance",
    separates="stop and hold in mid-rise",
    silenced_by=("stop and hold in mid-rise",),
    needs=("speed_m_s",),
)
