"""A run of the model as an export: the machine's stiffness, rate, noise, filter and resolution, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from tribo.mechanisms_in_model import Recorder, as_recorded
from tribo.records import Run, Test
from tribo.traces import PullOptions, evaluate, features_of

AREA_M2, SPEED_M_S, STIFFNESS = 55e-6, 2e-4, 6000.0


def run() -> Run:
    """A square of 3.6 mN under 10 kPa (0.36 um2) that holds 5 N/N and slides at 3, within a micrometre of drive."""
    time = np.linspace(0.0, 6e-3, 3001)
    force = 3.6e-5 * np.where(time < 3e-3, 5.0 * time / 3e-3, 3.0)
    return Run(
        "F", 10e3, 0.0, 0, time, force, np.zeros(time.size, np.int64), 3.6e-5, 5.0, 3.0, 3e-3, (4e-3, 6e-3), "fast",
        {"speed_m_s": SPEED_M_S},
    )  # fmt: skip


def test_the_readers_find_in_a_recorded_run_the_forces_of_the_whole_sled_and_the_stiffness_of_the_machine() -> None:
    trace = as_recorded(
        run(), Recorder(200.0, noise_N=0.004), speed_m_s=SPEED_M_S, stiffness_N_per_m=STIFFNESS,
        nominal_area_m2=AREA_M2, slides_m=2e-3, seed=1,
    )  # fmt: skip
    pull = evaluate(trace, PullOptions(test=Test("T", "", "F", 0.55, "", speed_m_s=SPEED_M_S)))
    load = AREA_M2 * 10e3
    assert pull.static_N == pytest.approx(5.0 * load, rel=0.01)
    assert pull.sliding_N == pytest.approx(3.0 * load, rel=0.01)
    model = 5.0 * load / (SPEED_M_S * 3e-3)  # of the sled in the model itself
    expected = 1.0 / (1.0 / STIFFNESS + 1.0 / model)
    rise = features_of(trace, pull, SPEED_M_S)["rise_stiffness_N_per_m"]
    assert rise.value == pytest.approx(expected, rel=0.02)


def test_a_recorder_without_faults_records_the_force_at_every_place_of_the_drive() -> None:
    trace = as_recorded(run(), Recorder(5e5), speed_m_s=SPEED_M_S, nominal_area_m2=AREA_M2)
    assert trace.displacement_m is not None
    way = trace.displacement_m - SPEED_M_S * 1.0
    shown = (way > 0) & (way < SPEED_M_S * 5.9e-3)
    sleds = AREA_M2 * 10e3 / 3.6e-5
    expected = sleds * np.interp(way[shown], SPEED_M_S * run().time_s, run().force_N)
    assert trace.force_N[shown] == pytest.approx(expected, abs=1e-9 + 1e-6 * expected.max())


def test_resolution_and_filter_act() -> None:
    asked = {"speed_m_s": SPEED_M_S, "stiffness_N_per_m": STIFFNESS, "nominal_area_m2": AREA_M2, "slides_m": 2e-3}
    coarse = as_recorded(run(), Recorder(100.0, resolution_N=0.1), **asked)
    assert np.round(coarse.force_N / 0.1) * 0.1 == pytest.approx(coarse.force_N)
    sharp, slow = (as_recorded(run(), Recorder(100.0, filter_Hz=f), **asked) for f in (0.0, 1.0))
    assert slow.force_N.max() < 0.97 * sharp.force_N.max()
    fallen = int(np.argmax(sharp.force_N)) + 1
    assert slow.force_N[fallen] > sharp.force_N[fallen] + 0.5 * AREA_M2 * 10e3
