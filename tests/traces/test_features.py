"""Features of traces whose answers are known in closed form."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.coulomb_slider import FromRest, Slider, population, pull_from_rest, record

from tribo.outputs import unit_of
from tribo.records import Feature, Phase, Pull, Test, Trace
from tribo.traces import PullOptions, evaluate, features_of
from tribo.traces.features import FEATURES, median_with_interval

DOCS = Path(__file__).resolve().parents[2] / "docs" / "reference" / "features.md"


def read(time: np.ndarray, force: np.ndarray, speed_m_s: float, *phases: Phase) -> tuple[Pull, dict[str, Feature]]:
    trace = Trace("made", time, force)
    test = Test("T", "", "F", 1.0, "", speed_m_s=speed_m_s)
    pull = evaluate(trace, PullOptions(test=test, phases=phases))
    return pull, features_of(trace, pull, speed_m_s)


def test_features_of_a_pull_from_rest_are_those_of_the_closed_form() -> None:
    rig = FromRest(noise=0.002, drops=0)
    time, force, true = pull_from_rest(rig, 1)
    _, found = read(time, force, rig.speed_m_s)
    for name in ("rise_stiffness_N_per_m", "static_drop_N", "decay_length_um", "peak_width_um"):
        assert found[name].value == pytest.approx(true[name], rel=0.03), name
    assert found["rise_bend"].value == pytest.approx(true["rise_bend"], abs=0.02)
    assert found["precursor_drops"].value == 0


def test_drops_before_the_peak_are_counted() -> None:
    time, force, _ = pull_from_rest(FromRest(noise=0.003, drops=3), 2)
    assert read(time, force, 1e-3)[1]["precursor_drops"].value == 3


def test_the_intervals_of_stick_slip_hold_the_medians_of_many_more_slips() -> None:
    rig = Slider(duration_s=40.0, rate_Hz=300.0)
    expected = population(rig, 99)
    own = {"drop_N": "drop_N", "period_s": "recurrence_s", "slip_duration_s": "duration_s", "hold_s": "hold_s"}
    held = []
    for seed in range(12):
        time, force, _ = record(rig, 300 + seed)
        _, found = read(time, force, rig.speed_m_s, Phase("steady sliding", 0.0, float(time[-1])))
        held += [found[name].low <= expected[truth] <= found[name].high for name, truth in own.items()]
    assert sum(held) >= 41  # of 48; with 95 % each, 5 misses or fewer are expected in 95 of 100 starts, 7 in 99


def test_a_median_has_the_interval_of_its_order_statistics() -> None:
    rng = np.random.default_rng(7)
    held = 0
    for _ in range(400):
        f = median_with_interval(rng.exponential(1.0, 20))
        held += f.low <= np.log(2.0) <= f.high
    assert 0.92 <= held / 400 <= 0.98


def test_a_drifting_slide_drifts_beyond_chance_and_a_level_one_does_not() -> None:
    rig = Slider(duration_s=40.0, rate_Hz=300.0)
    time, force, _ = record(rig, 8)
    whole = Phase("steady sliding", 0.0, float(time[-1]))
    level = read(time, force, rig.speed_m_s, whole)[1]["drift_N_per_s"]
    tilted = read(time, force + 2e-4 * time, rig.speed_m_s, whole)[1]["drift_N_per_s"]
    assert level.low < 0.0 < level.high
    assert tilted.low < 2e-4 < tilted.high
    assert tilted.low > 0.0


def test_the_main_frequency_is_that_of_a_swing_in_it() -> None:
    time = np.arange(0.0, 40.0, 0.01)
    force = 1.0 + 0.02 * np.sin(2 * np.pi * 3.0 * time) + 0.005 * np.random.default_rng(9).standard_normal(time.size)
    found = read(time, force, 1e-3, Phase("steady sliding", 0.0, float(time[-1])))[1]
    assert found["main_frequency_Hz"].low <= 3.0 <= found["main_frequency_Hz"].high
    assert found["main_share"].value > 0.7


@pytest.mark.parametrize("stuck_N", [0.0, 1.3])
def test_a_force_that_stands_still_to_the_bit_has_neither_roughness_nor_a_frequency(stuck_N: float) -> None:
    time, force, _ = pull_from_rest(FromRest(noise=0.002, drops=0), 1)
    pull = read(time, force, 1e-3)[0]
    force[time >= pull.window_s[0]] = pull.zero_N + stuck_N
    found = features_of(Trace("stuck", time, force), pull, 1e-3)
    assert not {"roughness", "main_frequency_Hz", "main_share"} & set(found)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("step_share", [0.02, 0.1, 0.44, 0.5])
def test_a_recorder_with_coarse_steps_leaves_finite_features_or_none(seed: int, step_share: float) -> None:
    time, force, _ = pull_from_rest(FromRest(noise=0.0005, drops=seed % 3), seed)
    step = step_share * float(force.max())
    _, found = read(time, np.round(force / step) * step, 1e-3)
    assert all(np.isfinite(feature.value) for feature in found.values())


def test_every_feature_has_a_unit_in_its_name_and_stands_in_the_documentation() -> None:
    text = " ".join(DOCS.read_text(encoding="utf-8").split())
    for name, definition in FEATURES.items():
        assert f"| `{name}` | {definition} | {unit_of(name) or '1'} |" in text, name
