"""The roller under the wire has friction of its own."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tribo.mechanisms.record import Base, Conditions, Forces, InTable, Mechanism, Placement, Values, amplitude


def law(values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
    """T -> T exp(mu_b pi / 2), the capstan law over a right angle; ``values`` = [mu_b]."""
    before = base.forces(conditions.normal_load_N)
    gain = np.exp(values[0] * np.pi / 2)
    return Forces(before.static_N * gain, before.sliding_N * gain)


def in_chain(values: Values, recorded: Mapping[str, float]) -> dict[str, float]:
    """The friction coefficient of the roller."""
    return {"roller_friction": float(values[0])}


MECHANISM = Mechanism(
    name="pulley_friction",
    kind="instrument",
    formula="T -> T exp(mu_b pi / 2)",
    parameters=(amplitude("mu_b", "", 0.0, 0.5, 0.03, "friction coefficient of the roller"),),
    law=law,
    sign=1,
    regimes=("static", "sliding"),
    enters="measuring chain, after the slider force",
    shows="the same gain on every sample, which the calibration on the flat sample absorbs",
    confused_with="the friction coefficient itself",
    separates="hang a dead weight over the roller",
    silenced_by=("hang a dead weight over the roller",),
    plain="friction of the roller",
    meaning="the roller under the wire adds friction of its own",
    placement=Placement(chain=in_chain),
    in_table=InTable(barred="not testable with this table: the calibration on the flat sample absorbs its effect"),
)
