"""The machine is a spring in series with the sample."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tribo.mechanisms.record import (
    Base,
    Conditions,
    Forces,
    InTable,
    Marks,
    Mechanism,
    Placement,
    TraceEvidence,
    Values,
    amplitude,
)
from tribo.records import FloatArray


def law(values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
    """Neither the peak nor the sliding mean changes; ``values`` = [1/k_m] in m/N."""
    return base.forces(conditions.normal_load_N)


def rise(values: Values, stiffness_N_per_m: FloatArray, conditions: Conditions) -> FloatArray:
    """Slope of the rise, 1/k = 1/k_m + 1/k_s, from the sample's own stiffness k_s (n,)."""
    return stiffness_N_per_m / (1.0 + values[0] * stiffness_N_per_m)


def of_each(marks: Marks) -> FloatArray:
    """What a rise yields more than the stated spring, m/N."""
    with np.errstate(divide="ignore"):
        return np.asarray(1.0 / marks["rise_stiffness_N_per_m"] - 1.0 / marks["stated_stiffness_N_per_m"])


def change(marks: Marks, compliance: FloatArray) -> FloatArray:
    """Share by which the stated stiffness is above that of the rise."""
    return compliance * marks["stated_stiffness_N_per_m"]


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
    untested="tests.csv states no stiffness of the spring, and no rigid dummy sample was pulled for comparison",
    evidence=TraceEvidence(
        quantity="each pull",
        covariate="",
        source="read from the slope of the rise, which is softer than the stated spring; whether the machine yields or "
        "the sample itself, a pull of a rigid dummy tells",
        observable="rise",
        absent="the rise yields {percent:.1f} % more than the stated spring, which is within the tolerance of springs",
        reads=("rise_stiffness_N_per_m", "stated_stiffness_N_per_m"),
        of_each=of_each,
        change=change,
        least=0.1,  # tolerance of the rate of coil springs in catalogues
    ),
    in_table=InTable(missing="no trace is printed in numbers"),
)
