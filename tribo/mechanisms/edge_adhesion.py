"""Extra static traction along the rims of the cavities."""

from __future__ import annotations

from tribo.mechanisms.record import (
    Base,
    Conditions,
    Forces,
    Mechanism,
    MechanismParameter,
    Placement,
    Values,
    amplitude,
)


def law(values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
    """T_s -> T_s + e (rim length); ``values`` = [e in N/m, share of it left while sliding]."""
    before = base.forces(conditions.normal_load_N)
    extra_N = values[0] * conditions.rim_per_m * conditions.nominal_area_m2
    return Forces(before.static_N + extra_N, before.sliding_N + values[1] * extra_N)


def rims(values: Values) -> tuple[float, float]:
    """Static force per rim length, N/m, and the share of it left while sliding."""
    return values[0], values[1]


MECHANISM = Mechanism(
    name="edge_adhesion",
    kind="pattern",
    formula="T_s -> T_s + e (rim length)",
    parameters=(
        amplitude("e", "N/m", 0.0, 1.0, 0.03, "static force per rim length"),
        MechanismParameter("share", "", 0.0, 0.4, 0.1, "share of it left while sliding"),
    ),
    law=law,
    sign=1,
    regimes=("static", "sliding"),
    enters="static adhesion of the contact blocks beside a cavity",
    quick_error=0.08,  # it strengthens the blocks that are stressed most
    shows="mostly static friction, in the order B > C >> A > S",
    confused_with="suction",
    separates="test a pattern of the same area fraction at another pitch",
    silenced_by=("use a pattern of the same area fraction at twice the pitch",),
    needs=("rim_per_m",),
    plain="adhesion along the cavity edges",
    meaning="the rims of the cavities stick, which adds friction in proportion to their length",
    placement=Placement(rims=rims),
)
