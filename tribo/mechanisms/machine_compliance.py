"""The machine is a spring in series with the sample."""

from __future__ import annotations

from collections.abc import Mapping

from tribo.mechanisms.record import Base, Conditions, Forces, InTable, Mechanism, Placement, Values, amplitude
from tribo.records import FloatArray


def law(values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
    """Neither the peak nor the sliding mean changes; ``values`` = [1/k_m] in m/N."""
    return base.forces(conditions.normal_load_N)


def rise(values: Values, stiffness_N_per_m: FloatArray, conditions: Conditions) -> FloatArray:
    """Slope of the rise, 1/k = 1/k_m + 1/k_s, from the sample's own stiffness k_s (n,)."""
    return stiffness_N_per_m / (1.0 + values[0] * stiffness_N_per_m)


def in_chain(values: Values, recorded: Mapping[str, float]) -> dict[str, float]:
    """A spring in series with the sled."""
    return {"compliance_m_per_N": float(values[0])}


MECHANISM = Mechanism(
    name="machine_compliance",
    kind="instrument",
    formula="1/k = 1/k_m + 1/k_s",
    parameters=(amplitude("1/k_m", "m/N", 0.0, 1e-2, 1e-5, "compliance of machine and wire"),),
    law=law,
    rise=rise,
    sign=-1,
    regimes=("rise",),
    enters="measuring chain, as a spring in series with the slider",
    shows="the slope of the rise and the stick-slip amplitude change, the mean forces do not",
    confused_with="bulk viscoelasticity",
    separates="pull a rigid dummy sample",
    silenced_by=("pull a rigid dummy sample",),
    plain="compliance of the machine",
    meaning="the machine yields like a spring, so that the force rises more slowly",
    placement=Placement(chain=in_chain),
    untested="no rigid dummy sample was pulled for comparison",
    in_table=InTable(missing="no trace is printed in numbers"),
)
