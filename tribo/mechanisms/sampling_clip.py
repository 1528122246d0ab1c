"""The peak falls between two samples of the recorder."""

from __future__ import annotations

import numpy as np

from tribo.mechanisms.record import Base, Conditions, Forces, Mechanism, Values, amplitude


def law(values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
    """T_s -> T_s - s k v / (2 f_s), at least a tenth of T_s; ``values`` = [s], 1 being the mean loss."""
    before = base.forces(conditions.normal_load_N)
    clipped = np.maximum(before.static_N - values[0] * conditions.clip_N, 0.1 * before.static_N)
    return Forces(clipped, before.sliding_N)


MECHANISM = Mechanism(
    name="sampling_clip",
    kind="instrument",
    formula="T_s -> T_s - s k v / (2 f_s)",
    parameters=(amplitude("s", "", 0.0, 2.0, 1.0, "share of the mean loss between two samples"),),
    law=law,
    sign=-1,
    regimes=("static",),
    enters="the virtual instrument, at the recorder",
    shows="static only, the more the higher the speed",
    confused_with="contact_ageing",
    separates="raise the sampling rate, then decimate",
    silenced_by=("raise the sampling rate tenfold",),
    needs=("clip_N",),
)
