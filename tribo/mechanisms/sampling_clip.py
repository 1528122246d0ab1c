"""The peak falls between two samples of the recorder."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tribo.mechanisms.record import (
    Base,
    Conditions,
    DirectMeasurement,
    Forces,
    InTable,
    Mechanism,
    Placement,
    Values,
    amplitude,
)


def law(values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
    """T_s -> T_s - s k v / (2 f_s), at least a tenth of T_s; ``values`` = [s], 1 being the mean loss."""
    before = base.forces(conditions.normal_load_N)
    clipped = np.maximum(before.static_N - values[0] * conditions.clip_N, 0.1 * before.static_N)
    return Forces(clipped, before.sliding_N)


def in_chain(values: Values, recorded: Mapping[str, float]) -> dict[str, float]:
    """The time between two samples, in units of the peak time."""
    return {"interval_peaks": float(values[0]) / recorded["samples_in_rise"]}


MECHANISM = Mechanism(
    name="sampling_clip",
    kind="instrument",
    formula="T_s -> T_s - s k v / (2 f_s)",
    parameters=(amplitude("s", "", 0.0, 2.0, 1.0, "share of the mean loss between two samples"),),
    law=law,
    sign=-1,
    regimes=("static",),
    enters="measuring chain, at the recorder",
    shows="static friction only, more at higher speed",
    confused_with="contact ageing",
    separates="raise the sampling rate, then decimate",
    silenced_by=("raise the sampling rate tenfold",),
    needs=("clip_N",),
    plain="a peak missed between two samples",
    meaning="the recorder misses the top of the peak between two samples",
    placement=Placement(chain=in_chain),
    measurement=DirectMeasurement("Repeat twelve pulls at ten times the sampling rate.", 0.2, 1.5),
    in_table=InTable(missing="no sampling rate is printed"),
)
