"""The wire pulls upwards by an angle."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tribo.mechanisms.record import Base, Conditions, Forces, Mechanism, Placement, Values, amplitude


def law(values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
    """T = (mu N + tau0 A) / (cos f + mu sin f); ``values`` = [f] in radian, upwards positive."""
    before = base.forces(conditions.normal_load_N)
    cos, sin = np.cos(values[0]), np.sin(values[0])
    return Forces(before.static_N / (cos + base.static_mu * sin), before.sliding_N / (cos + base.sliding_mu * sin))


def lifted(values: Values, pulled: tuple[float, float], traction_Pa: float) -> tuple[float, float]:
    """Share of the normal force that the wire leaves, while the sled sticks and while it slides."""
    lift = np.tan(values[0])
    return 1.0 - pulled[0] * lift, 1.0 - pulled[1] * lift


def in_chain(values: Values, recorded: Mapping[str, float]) -> dict[str, float]:
    """The angle of the wire."""
    return {"wire_angle_rad": float(values[0])}


MECHANISM = Mechanism(
    name="pull_angle",
    kind="instrument",
    formula="T = (mu N + tau0 A) / (cos f + mu sin f)",
    parameters=(amplitude("f", "rad", -0.1, 0.2, 0.03, "upward angle of the wire"),),
    law=law,
    sign=-1,
    regimes=("static", "sliding"),
    enters="measuring chain, and the normal force, because the wire lifts the sled",
    shows="one gain per regime, the same on every sample",
    confused_with="the friction coefficient itself",
    separates="change the height of the wire",
    silenced_by=("change the height of the wire",),
    plain="an inclined wire",
    meaning="the wire is inclined, which changes the load on the contact",
    placement=Placement(load=lifted, chain=in_chain, own_friction=True),
)
