"""The roller under the wire has friction of its own."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tribo.mechanisms.record import (
    Base,
    Conditions,
    Forces,
    InTable,
    Marks,
    Mechanism,
    Placement,
    TraceEvidence,
    Values,
    amplitude,
)
from tribo.records import FloatArray


def law(values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
    """T -> T exp(mu_b pi / 2), the capstan law over a right angle; ``values`` = [mu_b]."""
    before = base.forces(conditions.normal_load_N)
    gain = np.exp(values[0] * np.pi / 2)
    return Forces(before.static_N * gain, before.sliding_N * gain)


def in_chain(values: Values, recorded: Mapping[str, float]) -> dict[str, float]:
    """The friction coefficient of the roller."""
    return {"roller_friction": float(values[0])}


def of_each(marks: Marks) -> FloatArray:
    """The friction of a roller that first has to turn back: it leaves exp(-pi mu_b) of the force."""
    return -np.log(np.maximum(marks["force_kept_at_turn"], 1e-3)) / np.pi


def change(marks: Marks, mu_b: FloatArray) -> FloatArray:
    """Share by which the pull is shown too high."""
    return np.expm1(mu_b * np.pi / 2)


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
    separates="record how the force falls when the drive turns back, or hang a dead weight over the roller",
    silenced_by=("hang a dead weight over the roller",),
    plain="friction of the roller",
    meaning="the roller under the wire adds friction of its own",
    placement=Placement(chain=in_chain),
    evidence=TraceEvidence(
        quantity="each pull",
        covariate="",
        source="read from the force that is lost at once when the drive turns back",
        observable="turn",
        absent="when the drive turns back, no more of the force is lost at once than a roller friction of "
        "{percent:.1f} % would take",
        reads=("force_kept_at_turn",),
        of_each=of_each,
        change=change,
        least=0.01,  # of the force: what a load cell of class 1 may be off (ISO 7500-1)
    ),
    in_table=InTable(barred="not testable with this table: the calibration on the flat sample absorbs its effect"),
)
