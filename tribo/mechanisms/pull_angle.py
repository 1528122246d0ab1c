"""The wire pulls upwards by an angle."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tribo.mechanisms.record import (
    Base,
    Conditions,
    Forces,
    Marks,
    Mechanism,
    Placement,
    TraceEvidence,
    Values,
    amplitude,
)
from tribo.records import FloatArray


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


def of_each(marks: Marks) -> FloatArray:
    """The angle whose sine is the share of the pull that the recorded normal load loses, rad."""
    return np.arcsin(np.clip(marks["load_lost_per_pull"], -1.0, 1.0))


def change(marks: Marks, angle: FloatArray) -> FloatArray:
    """Share of the pull that the wire takes off the load."""
    return np.sin(angle)


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
    separates="record the normal load below the sample, or change the height of the wire",
    silenced_by=("change the height of the wire",),
    plain="an inclined wire",
    meaning="the wire is inclined, which changes the load on the contact",
    placement=Placement(load=lifted, chain=in_chain, own_friction=True),
    evidence=TraceEvidence(
        quantity="each pull",
        covariate="",
        source="read from the recorded normal load, which falls in proportion to the pull; a load cell that answers to "
        "the pull (cross-talk) would look the same, and another height of the wire tells them apart",
        observable="load",
        absent="{percent:.1f} % of the pull is missing from the recorded normal load, which a load cell alone may show",
        reads=("load_lost_per_pull",),
        of_each=of_each,
        change=change,
        least=0.01,  # cross-talk that makers of cells for two forces allow, of the other force
    ),
)
