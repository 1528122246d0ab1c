"""The moment of the friction force lifts the trailing edge."""

from __future__ import annotations

import numpy as np

from tribo.mechanisms.record import Base, Conditions, Forces, Mechanism, Values, amplitude
from tribo.records import FloatArray

HEIGHTS = (0.01, 0.02, 0.04, 0.08)


def law(values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
    """The wire at height h over a sled of length L moves the load by e = (T / N) h / L of the length.

    Beyond e = 1/6 only the share 3 (1/2 - e) of the length stays in contact and adheres:
    T = mu N + tau0 A min(1, 3 (1/2 - e)), solved for T. ``values`` = [h / L].
    """
    load = conditions.normal_load_N
    return Forces(
        _tilted(values[0], base.static_mu * load, base.static_adhesion_N, load),
        _tilted(values[0], base.sliding_mu * load, base.sliding_adhesion_N, load),
    )


def _tilted(height: float, friction_N: FloatArray, adhesion_N: FloatArray, load_N: FloatArray) -> FloatArray:
    upright = friction_N + adhesion_N
    part = (friction_N + 1.5 * adhesion_N) / (1.0 + 3.0 * adhesion_N * height / load_N)
    lifted = upright * height / load_N > 1.0 / 6.0
    return np.where(lifted, np.clip(part, friction_N, upright), upright)


MECHANISM = Mechanism(
    name="tilt",
    kind="instrument",
    formula="tau0 A -> tau0 A min(1, 3 (1/2 - (T / N) h / L))",
    parameters=(  # nothing happens below e = 1/6, so that a fit has to start from several heights
        amplitude("h_over_L", "", 0.0, 0.3, 0.02, "height of the wire over length of the sled", HEIGHTS),
    ),
    law=law,
    sign=-1,
    regimes=("static", "sliding"),
    enters="block normal force, linear along the pull",
    quick_error=0.4,  # the light edge also slips first, which the law leaves out: static friction is 14 to 35 % lower
    shows="worst at small load and large T/N",
    confused_with="pressure_dependent_friction",
    separates="lower the wire to the interface",
    silenced_by=("lower the wire to the interface",),
    needs=("normal_load_N",),
)
