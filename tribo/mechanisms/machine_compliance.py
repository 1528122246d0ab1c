"""The machine is a spring in series with the sample."""

from __future__ import annotations

from tribo.mechanisms.record import Base, Conditions, Forces, Mechanism, Values, amplitude
from tribo.records import FloatArray


def law(values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
    """Neither the peak nor the sliding mean changes; ``values`` = [1/k_m] in m/N."""
    return base.forces(conditions.normal_load_N)


def rise(values: Values, stiffness_N_per_m: FloatArray, conditions: Conditions) -> FloatArray:
    """Slope of the rise, 1/k = 1/k_m + 1/k_s, from the sample's own stiffness k_s (n,)."""
    return stiffness_N_per_m / (1.0 + values[0] * stiffness_N_per_m)


MECHANISM = Mechanism(
    name="machine_compliance",
    kind="instrument",
    formula="1/k = 1/k_m + 1/k_s",
    parameters=(amplitude("1/k_m", "m/N", 0.0, 1e-2, 1e-5, "compliance of machine and wire"),),
    law=law,
    rise=rise,
    sign=-1,
    regimes=("rise",),
    enters="the virtual instrument, a spring in series with the slider",
    shows="the slope of the rise and the stick-slip amplitude, not the means",
    confused_with="bulk_viscoelasticity",
    separates="pull a rigid dummy",
    silenced_by=("pull a rigid dummy",),
)
