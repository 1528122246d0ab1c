"""The true normal load differs from the stated one by a constant: an unweighed holder, a wire that lifts."""

from __future__ import annotations

import numpy as np

from tribo.mechanisms.record import Base, Conditions, DirectMeasurement, Forces, Mechanism, Values, amplitude


def law(values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
    """N -> N + dN in both regimes, the load never below zero; ``values`` = [dN] in N."""
    return base.forces(np.maximum(conditions.normal_load_N + values[0], 0.0))


MECHANISM = Mechanism(
    name="normal_load_error",
    kind="instrument",
    formula="N -> N + dN",
    parameters=(amplitude("dN", "N", -1.0, 2.0, 0.1, "load that was not counted"),),
    law=law,
    sign=1,
    regimes=("static", "sliding"),
    enters="normal force of the blocks",
    shows="as suction, but of either sign, because the calibration on the flat sample absorbs its part",
    confused_with="suction",
    separates="weigh the sled and read the vertical force",
    silenced_by=("weigh the sled with everything on it",),
    needs=("area_fraction",),
    plain="an error of the normal load",
    meaning="the true normal load differs from the stated one by a constant",
    measurement=DirectMeasurement("Weigh the sled with everything that rests on it, the wire attached.", 0.005, 0.25),
)
