"""The roller under the wire takes its share."""

from __future__ import annotations

import numpy as np

from tribo.mechanisms.record import Base, Conditions, Forces, Mechanism, Values, amplitude


def law(values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
    """T -> T exp(mu_b pi / 2), the capstan law over a right angle; ``values`` = [mu_b]."""
    before = base.forces(conditions.normal_load_N)
    gain = np.exp(values[0] * np.pi / 2)
    return Forces(before.static_N * gain, before.sliding_N * gain)


MECHANISM = Mechanism(
    name="pulley_friction",
    kind="instrument",
    formula="T -> T exp(mu_b pi / 2)",
    parameters=(amplitude("mu_b", "", 0.0, 0.5, 0.03, "friction coefficient of the roller"),),
    law=law,
    sign=1,
    regimes=("static", "sliding"),
    enters="the virtual instrument, after the slider force",
    shows="the same gain everywhere, which the free flat law takes up",
    confused_with="mu itself",
    separates="a dead weight over the roller",
    silenced_by=("hang a dead weight over the roller",),
)
