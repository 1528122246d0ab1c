"""Cavities under negative pressure press the sample down."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from tribo.mechanisms.record import Base, Conditions, Forces, InTable, Mechanism, Values, amplitude


def law(values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
    """N -> N + dp (1 - AF) A in both regimes; ``values`` = [dp] in Pa, at most one atmosphere."""
    pull_down_N = values[0] * (1.0 - conditions.area_fraction) * conditions.nominal_area_m2
    return base.forces(conditions.normal_load_N + pull_down_N)


def finding(
    gains: Sequence[float], sizes: Sequence[float], limit: Callable[[], float], flat_traction_Pa: float
) -> str:
    """What the table says about suction."""
    none = sum(size < 1.0 for size in sizes)
    return (
        f"Suction cups are {'excluded' if none == len(sizes) else 'not excluded'}: suction can only increase "
        f"friction, and its best-fitting size is zero in {none} of {len(sizes)} readings "
        f"(at most {limit() / 1e3:.1f} kPa, 95 %)."
    )


MECHANISM = Mechanism(
    name="suction",
    kind="pattern",
    formula="N -> N + dp (1 - AF) A",
    parameters=(amplitude("dp", "Pa", 0.0, 101325.0, 3000.0, "pressure missing under the cavities"),),
    law=law,
    sign=1,
    regimes=("static", "sliding"),
    enters="normal force of the blocks, shared by the contact blocks",
    shows="higher T on samples with more cavity area (C > B, S >> A), most at low load; it never lowers T",
    confused_with="an error of the normal load, or an offset of the load cell",
    separates="vent the cavities, vary the hold time, read the force before contact, weigh the sled",
    silenced_by=("repeat with vented cavities",),
    removed_by="repeat with vented cavities",
    needs=("area_fraction",),
    plain="suction under the cavities",
    meaning="the air in the cavities is below room pressure, which presses the sample down",
    in_table=InTable(guess="suction cups", finding=finding),
)
