"""Real contact shrinks under shear (Sahli et al., PNAS 2018)."""

from __future__ import annotations

import numpy as np

from tribo.mechanisms.record import Base, Conditions, Forces, Mechanism, Values, amplitude


def law(values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
    """T = T_b A_r / A_r0 with A_r = A_r0 (1 - c (T / A_r0)^2) and A_r0 = AF A, solved for T at the peak.

    ``values`` = [c] in 1/Pa2. Contact lost on the way to the peak does not heal while the sled slides, so the
    sliding force carries the same share of lost area.
    """
    before = base.forces(conditions.normal_load_N)
    traction_Pa = before.static_N / (conditions.area_fraction * conditions.nominal_area_m2)
    kept = 2.0 / (1.0 + np.sqrt(1.0 + 4.0 * values[0] * traction_Pa**2))
    return Forces(before.static_N * kept, before.sliding_N * kept)


MECHANISM = Mechanism(
    name="contact_area_loss",
    kind="interface",
    formula="T = T_b (1 - c (T / (AF A))^2)",
    parameters=(amplitude("c", "1/Pa2", 0.0, 3e-10, 2e-11, "area lost per squared traction"),),
    law=law,
    sign=-1,
    regimes=("static", "sliding"),
    enters="block thresholds, scaled by the contact left at the traction of the peak",
    shows="lower T at high traction: more on patterns and at high load; bends T(N)",
    confused_with="pressure_dependent_friction",
    separates="more loads at the low end, or images of the contact",
    silenced_by=("image the contact area under load and shear",),
    needs=("normal_load_N",),
)
