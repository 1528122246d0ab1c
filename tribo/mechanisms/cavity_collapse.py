"""Above a pressure the floors of the cavities touch the counterface."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from tribo.mechanisms.record import (
    Base,
    Conditions,
    DirectMeasurement,
    Forces,
    InTable,
    Mechanism,
    MechanismParameter,
    Placement,
    Values,
    amplitude,
)
from tribo.records import FloatArray

REFERENCE_WIDTH_M = 15e-6
SHARPNESS = 6.0  # a collapse is spread over about a third of its pressure


def law(values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
    """T goes from the pattern's law to the flat law around p = p_c (15 um / width)^k.

    ``values`` = [share of the cavity area that touches down, p_c in Pa, k].
    """
    open_N = base.forces(conditions.normal_load_N)
    closed_N = base.as_sample(base.flat).forces(conditions.normal_load_N)
    share = share_down(values, conditions)
    return Forces(
        open_N.static_N + share * (closed_N.static_N - open_N.static_N),
        open_N.sliding_N + share * (closed_N.sliding_N - open_N.sliding_N),
    )


def share_down(values: Values, conditions: Conditions) -> FloatArray:
    """Share of the cavity area that touches down at the pressure of each test, (n,)."""
    width = np.maximum(conditions.cavity_width_m, 1e-9)
    collapse_Pa = values[1] * (REFERENCE_WIDTH_M / width) ** values[2]
    down = 1.0 / (1.0 + (collapse_Pa / conditions.pressure_Pa) ** SHARPNESS)
    return np.asarray(values[0] * np.where(conditions.cavity_width_m > 0, down, 0.0))


def floors(values: Values, conditions: Conditions) -> float:
    """Share of the floors that touch down in one run."""
    return float(share_down(values, conditions)[0])


def finding(
    gains: Sequence[float], sizes: Sequence[float], limit: Callable[[], float], flat_traction_Pa: float
) -> str:
    """What the table says about cavities whose floors touch down."""
    most = max(gains)
    worth = f"earn at most {most:.1f} units of log likelihood" if most > 0 else "do not improve the fit"
    return f"Cavity floors that touch the counterface would raise friction, and {worth}."


MECHANISM = Mechanism(
    name="cavity_collapse",
    kind="pattern",
    formula="T -> flat law above p_c (15 um / width)^k",
    parameters=(
        amplitude("share", "", 0.0, 1.0, 0.5, "share of the cavity area that touches down"),
        MechanismParameter("p_c", "Pa", 2e3, 5e4, 1e4, "collapse pressure of a cavity 15 um wide", tries=(5e3, 2e4)),
        MechanismParameter("k", "", 0.0, 1.5, 0.3, "how fast a wider cavity is weaker"),
    ),
    law=law,
    sign=0,
    regimes=("static", "sliding"),
    enters="mask: cavity blocks become contact blocks",
    quick_error=0.15,  # a floor that carries little slips early: static friction rises later than the law says
    shows="T rises towards that of the flat sample above a load, in weak patterns first",
    confused_with="pressure-dependent friction",
    separates="test a series of cavity depths, or unload after loading",
    silenced_by=("the same pattern with deeper cavities",),
    removed_by="use the same pattern with deeper cavities",
    needs=("area_fraction", "normal_load_N"),
    plain="collapse of the cavities",
    meaning="above a certain load the floors of the cavities touch the counterface, so that the "
    "pattern rubs like a flat sample",
    placement=Placement(floors=floors),
    measurement=DirectMeasurement("Image a weak pattern through the counterface at the highest load.", 0.1, 2.0),
    in_table=InTable(guess="deformed patterns", finding=finding),
)
