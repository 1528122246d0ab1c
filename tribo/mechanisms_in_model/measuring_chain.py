"""The measuring chain of the virtual tribometer: a run of the model as a machine would show it.

A run pulls a square of a fraction of a millimetre; offsets, drifts and compliances belong to the whole sled. They are
scaled by the nominal area, so that T/N of the run is that of the sled. An ideal chain leaves a run unchanged, bit
for bit.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tribo.records import FloatArray, Run

SLED_AREA_M2 = 55e-6


def measured(
    run: Run,
    speed_m_s: float,
    *,
    wire_angle_rad: float = 0.0,
    roller_friction: float = 0.0,
    compliance_m_per_N: float = 0.0,
    offset_N: float = 0.0,
    interval_peaks: float = 0.0,
    nominal_area_m2: float = SLED_AREA_M2,
) -> Run:
    """The run as recorded by the chain between slider and recorded data, in the order of the signal.

    Parameters
    ----------
    speed_m_s
        The crosshead speed in the time of the model.
    wire_angle_rad
        Upward angle of the wire: its tension is the pull over the cosine (without its effect on the normal load).
    roller_friction
        Coefficient of the roller under the wire, wrapped over a right angle: gain exp(mu pi / 2).
    compliance_m_per_N
        Machine and wire as a spring in series with the sled: the crosshead moves on by the force times this.
    offset_N
        Reading of the load cell at zero force on the sled.
    interval_peaks
        Time between two samples of the recorder in units of the peak time; the peak falls midway between two. Zero
        keeps the samples of the run.
    nominal_area_m2
        Nominal area of the sled.
    """
    sleds = nominal_area_m2 * run.pressure_Pa / run.normal_load_N  # how many of the model's squares make the sled
    if wire_angle_rad or roller_friction:
        run = amplified(run, float(np.exp(roller_friction * np.pi / 2) / np.cos(wire_angle_rad)))
    if compliance_m_per_N:
        run = with_compliance(run, compliance_m_per_N * sleds, speed_m_s)
    if offset_N:
        run = shifted(run, offset_N / sleds)
    if interval_peaks:
        run = sampled(run, interval_peaks * run.peak_s)
    return run


def amplified(run: Run, gain: float) -> Run:
    """Every force times ``gain``."""
    return replace(
        run, force_N=run.force_N * gain, static_friction=run.static_friction * gain,
        sliding_friction=run.sliding_friction * gain,
    )  # fmt: skip


def shifted(run: Run, force_N: float) -> Run:
    """Every force plus ``force_N``."""
    return replace(
        run, force_N=run.force_N + force_N, static_friction=run.static_friction + force_N / run.normal_load_N,
        sliding_friction=run.sliding_friction + force_N / run.normal_load_N,
    )  # fmt: skip


def with_compliance(run: Run, compliance_m_per_N: float, speed_m_s: float) -> Run:
    """The same forces on the clock of a crosshead that has to stretch the machine as well.

    The force that falls in a slip lets the machine spring back faster than the crosshead moves: such a drop is
    upright. Static and sliding friction are those of the slider.
    """
    clock = np.maximum.accumulate(run.time_s + run.force_N * compliance_m_per_N / speed_m_s)

    def moved(time_s: float) -> float:
        return float(np.interp(time_s, run.time_s, clock))

    return replace(
        run, time_s=clock, peak_s=moved(run.peak_s), window_s=(moved(run.window_s[0]), moved(run.window_s[1]))
    )


def sampled(run: Run, interval_s: float) -> Run:
    """The data points of a recorder with this interval, half an interval to either side of the peak."""
    first = np.mod(run.peak_s - interval_s / 2, interval_s)
    time: FloatArray = np.arange(first, run.time_s[-1], interval_s)
    force = np.interp(time, run.time_s, run.force_N)
    moving = np.interp(time, run.time_s, run.moving).round().astype(np.int64)
    before = np.interp(run.peak_s - interval_s / 2, run.time_s, run.force_N)
    after = np.interp(run.peak_s + interval_s / 2, run.time_s, run.force_N)
    static = max(float(before), float(after)) / run.normal_load_N
    return replace(run, time_s=time, force_N=force, moving=moving, static_friction=min(static, run.static_friction))
