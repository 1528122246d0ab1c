"""Long cavities close or open under shear, so that the two directions part."""

from __future__ import annotations

import numpy as np

from tribo.mechanisms.record import Base, Conditions, Forces, Mechanism, Values, amplitude


def law(values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
    """T = T_b exp(d e), e = ln(long / short), positive along the long side; ``values`` = [d]."""
    before = base.forces(conditions.normal_load_N)
    gain = np.exp(values[0] * conditions.elongation)
    return Forces(before.static_N * gain, before.sliding_N * gain)


MECHANISM = Mechanism(
    name="cavity_shear_deformation",
    kind="pattern",
    formula="T = T_b exp(d e), e = +-ln(long / short)",
    parameters=(amplitude("d", "", -0.6, 0.6, 0.1, "relative change per e-fold of elongation"),),
    law=law,
    sign=0,
    regimes=("static", "sliding"),
    enters="the mask: cavity width, by the traction and its direction",
    shows="Sx against Sy, both regimes",
    confused_with="pattern_geometry, a misaligned pull",
    separates="reverse the pull, and pull at 45 degrees",
    silenced_by=("pull the long cavities at 45 degrees and in reverse",),
    needs=("elongation",),
)
