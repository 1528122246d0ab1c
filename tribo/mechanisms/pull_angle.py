"""The wire pulls upwards by an angle."""

from __future__ import annotations

import numpy as np

from tribo.mechanisms.record import Base, Conditions, Forces, Mechanism, Values, amplitude


def law(values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
    """T = (mu N + tau0 A) / (cos f + mu sin f); ``values`` = [f] in radian, upwards positive."""
    before = base.forces(conditions.normal_load_N)
    cos, sin = np.cos(values[0]), np.sin(values[0])
    return Forces(before.static_N / (cos + base.static_mu * sin), before.sliding_N / (cos + base.sliding_mu * sin))


MECHANISM = Mechanism(
    name="pull_angle",
    kind="instrument",
    formula="T = (mu N + tau0 A) / (cos f + mu sin f)",
    parameters=(amplitude("f", "rad", -0.1, 0.2, 0.03, "upward angle of the wire"),),
    law=law,
    sign=-1,
    regimes=("static", "sliding"),
    enters="the virtual instrument and the normal force, as the wire lifts the sled",
    shows="one gain per regime on every sample",
    confused_with="mu itself",
    separates="change the height of the wire",
    silenced_by=("change the height of the wire",),
)
