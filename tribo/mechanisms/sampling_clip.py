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
    Marks,
    Mechanism,
    Placement,
    TraceEvidence,
    Values,
    amplitude,
)
from tribo.records import FloatArray


def law(values: Values, base: Base, conditions: Conditions, choice: str = "") -> Forces:
    """T_s -> T_s - s k v / (2 f_s), at least a tenth of T_s; ``values`` = [s], 1 being the mean loss."""
    before = base.forces(conditions.normal_load_N)
    clipped = np.maximum(before.static_N - values[0] * conditions.clip_N, 0.1 * before.static_N)
    return Forces(clipped, before.sliding_N)


def of_each(marks: Marks) -> FloatArray:
    """What the highest data point misses of the peak on average, over the mean loss by rate and slope alone."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(marks["missed_peak_N"] / np.where(marks["clip_N"] > 0, marks["clip_N"], np.nan))


def change(marks: Marks, share: FloatArray) -> FloatArray:
    """Share of the static peak that the highest data point misses."""
    return marks["missed_peak_N"] / marks["static_N"]


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
    evidence=TraceEvidence(
        quantity="each pull",
        covariate="",
        source="read from how far apart the data points beside the highest one lie",
        observable="peak",
        corrected="the highest data point lies {percent:.1f} % below the peak on average; static friction was read "
        "where rise and fall meet as far as data points tell, and its uncertainty holds what they leave open",
        reads=("missed_peak_N", "clip_N", "static_N"),
        of_each=of_each,
        change=change,
        least=0.01,  # of static friction: the error of a load cell of class 1 (ISO 7500-1)
    ),
    measurement=DirectMeasurement("Repeat twelve pulls at ten times the sampling rate.", 0.2, 1.5),
    in_table=InTable(missing="no sampling rate is printed"),
)
