"""Cavities under negative pressure press the sample down."""

from __future__ import annotations

from tribo.mechanisms.record import Base, Conditions, Forces, Mechanism, Values, amplitude


def law(values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
    """N -> N + dp (1 - AF) A in both regimes; ``values`` = [dp] in Pa, at most one atmosphere."""
    pull_down_N = values[0] * (1.0 - conditions.area_fraction) * conditions.nominal_area_m2
    return base.forces(conditions.normal_load_N + pull_down_N)


MECHANISM = Mechanism(
    name="suction",
    kind="pattern",
    formula="N -> N + dp (1 - AF) A",
    parameters=(amplitude("dp", "Pa", 0.0, 101325.0, 3000.0, "pressure missing under the cavities"),),
    law=law,
    sign=1,
    regimes=("static", "sliding"),
    enters="block normal force, shared over the contact blocks",
    shows="rank C > B, S >> A, strongest at low load; static to sliding as mu_s to mu_d; never lowers T",
    confused_with="normal_load_error, load_cell_offset",
    separates="vent holes, the hold time, the force before contact, the weight of the sled",
    silenced_by=("repeat with vented cavities",),
    needs=("area_fraction",),
)
