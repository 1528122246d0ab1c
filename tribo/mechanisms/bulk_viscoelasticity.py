"""The springs of the bulk relax (a Prony series)."""

from __future__ import annotations

import numpy as np

from tribo.mechanisms.record import (
    REFERENCE_SPEED_M_S,
    Base,
    Conditions,
    Forces,
    InTable,
    Mechanism,
    Placement,
    TraceEvidence,
    Values,
    amplitude,
)
from tribo.records import FloatArray


def law(values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
    """Neither the peak nor the sliding mean changes to first order; ``values`` = [g]."""
    return base.forces(conditions.normal_load_N)


def rise(values: Values, stiffness_N_per_m: FloatArray, conditions: Conditions) -> FloatArray:
    """Slope of the rise, k (1 + g ln(v / v_0)): a broad Prony spectrum at the rate of the pull, N/m."""
    return stiffness_N_per_m * (1.0 + values[0] * np.log(conditions.speed_m_s / REFERENCE_SPEED_M_S))


def stiffening(values: Values, conditions: Conditions) -> float:
    """Gain of the elastic modulus at the speed of the pull."""
    return float(1.0 + values[0] * np.log(conditions.speed_m_s[0] / REFERENCE_SPEED_M_S))


MECHANISM = Mechanism(
    name="bulk_viscoelasticity",
    kind="bulk",
    formula="k = k_0 (1 + g ln(v / 0.2 mm/s))",
    parameters=(amplitude("g", "", 0.0, 0.3, 0.05, "relative stiffening per e-fold of rate"),),
    law=law,
    rise=rise,
    sign=1,
    regimes=("rise",),
    enters="springs between the blocks and to the slider",
    shows="a rounded rise that is steeper at higher speed, and relaxation after stopping",
    confused_with="compliance of the machine",
    separates="stop in mid-rise and hold",
    silenced_by=("stop and hold in mid-rise",),
    needs=("speed_m_s",),
    plain="bulk viscoelasticity",
    meaning="the material behind the contact is stiffer when it is pulled faster",
    placement=Placement(springs=stiffening),
    evidence=TraceEvidence(
        quantity="rise",
        covariate="speed_mm_s",
        source="read from the slope of the rise",
        observable="rise",
        absent="the slope of the rise changes by {percent:.1f} % per e-fold of speed, which is no clear effect",
    ),
    in_table=InTable(missing="no trace is printed in numbers"),
)
