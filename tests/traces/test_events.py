"""Slips one by one, on a Coulomb slider whose every slip is known in closed form."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.coulomb_slider import Slider, noise_of_rigs, random_rig, record, scores

from tribo import read_pull
from tribo.records import STANDARD_GRAVITY, Phase, Test, Trace
from tribo.traces import PullOptions, evaluate, slips_of
from tribo.traces.events import read_between

SLOW = Slider(duration_s=40.0, rate_Hz=500.0)
CALM = replace(SLOW, noise=0.0, impulses=0.0)


def test_without_noise_every_number_of_a_slip_is_that_of_the_closed_form() -> None:
    rig = replace(CALM, creep_m=2e-6)
    time, force, truth = record(rig, 1)
    slips = slips_of(time, force, speed_m_s=rig.speed_m_s)
    assert len(slips) == truth["fail_s"].size
    for name in ("drop_N", "peak_N", "trough_N", "slip_m", "duration_s", "recurrence_s", "hold_s", "stiffness_N_per_m"):
        found = np.array([getattr(s, name) for s in slips])[1:]
        assert found == pytest.approx(truth[name][1:], rel=0.03), name
    assert np.median([s.precursory_slip_m for s in slips[1:]]) == pytest.approx(2e-6, rel=0.2)
    assert math.isnan(slips[0].recurrence_s)


@pytest.mark.parametrize("seed", [71, 72, 73, 74, 75, 76])
def test_slips_are_found_in_the_noise_of_real_rigs(seed: int) -> None:
    rig = random_rig(np.random.default_rng(seed), quick=True)
    time, force, truth = record(rig, seed)
    found = np.array([s.fail_s for s in slips_of(time, force, speed_m_s=rig.speed_m_s)])
    assert scores(found, truth["fail_s"])[0] >= 0.98


@pytest.mark.parametrize("seed", [21, 23, 29])
def test_regular_slips_are_found_where_noise_hides_the_pace_of_a_third_of_their_loadings(seed: int) -> None:
    rig = Slider(stiffness_N_per_m=300.0, speed_m_s=5e-5, mass_kg=0.2, sliding_N=0.36, excess_N=0.047, scatter=0.15,
                 creep_m=0.0, rate_Hz=8.0, duration_s=350.0, noise=0.037, correlation=0.8, impulse=0.06,
                 impulses=0.01)  # fmt: skip
    time, force, truth = record(rig, seed)
    found = np.array([s.fail_s for s in slips_of(time, force, speed_m_s=rig.speed_m_s)])
    assert scores(found, truth["fail_s"])[0] >= 0.97


def test_the_noise_of_real_rigs_alone_is_no_slip() -> None:
    for seed in range(20):
        rng = np.random.default_rng(500 + seed)
        rig = replace(SLOW, noise=0.03, correlation=rng.uniform(0.0, 0.95))
        time = np.arange(3000) / 100.0
        assert slips_of(time, 1.0 + noise_of_rigs(rig, 1.0, time.size, rng), speed_m_s=1e-3) == ()


def test_what_regains_more_than_the_machine_can_supply_is_no_slip() -> None:
    time, force, truth = record(SLOW, 2)
    rng = np.random.default_rng(2)
    for at in rng.integers(50, time.size - 50, 30):  # bursts of 16 ms, which the spring would need 150 ms to regain
        force[at : at + 8] -= 0.014
    slips = slips_of(time, force, speed_m_s=SLOW.speed_m_s, stiffness_N_per_m=SLOW.stiffness_N_per_m)
    assert scores(np.array([s.fail_s for s in slips]), truth["fail_s"])[0] >= 0.97


def test_a_slow_recorder_leaves_duration_and_velocity_out_and_keeps_the_drop() -> None:
    rig = replace(SLOW, rate_Hz=60.0, duration_s=120.0, impulses=0.0)
    time, force, truth = record(rig, 3)
    slips = slips_of(time, force, speed_m_s=rig.speed_m_s)
    assert len(slips) == truth["fail_s"].size
    assert all(math.isnan(s.duration_s) and math.isnan(s.peak_velocity_m_s) for s in slips)
    assert np.median([s.drop_N for s in slips]) == pytest.approx(np.median(truth["drop_N"]), rel=0.02)


def test_without_speed_the_forces_and_times_are_read_and_no_length() -> None:
    time, force, truth = record(CALM, 4)
    slips = slips_of(time, force)
    assert np.median([s.drop_N for s in slips]) == pytest.approx(np.median(truth["drop_N"]), rel=0.01)
    assert all(math.isnan(s.stiffness_N_per_m) and math.isnan(s.slip_m) for s in slips)


def test_the_first_slip_of_a_pull_from_rest_begins_at_its_onset() -> None:
    time = np.arange(0.0, 12.0, 0.01)
    rise = 2.0 * np.clip(time - 2.0, 0.0, 1.0)
    force = np.where(time < 3.0, rise, 1.2 + 0.8 * np.exp(-(time - 3.0) / 0.1))
    force = force + 0.005 * np.random.default_rng(5).standard_normal(time.size)
    (slip,) = read_pull(Trace("pull", time, force), test=Test("T", "", "F", 1.0, "", speed_m_s=1e-3, hold_s=30.0)).slips
    assert slip.start_s == pytest.approx(2.0, abs=0.05)
    assert slip.fail_s == pytest.approx(3.0, abs=0.05)
    assert slip.stiffness_N_per_m == pytest.approx(2000.0, rel=0.02)
    assert slip.drop_N == pytest.approx(0.8, rel=0.1)
    assert slip.hold_s == 30.0


def test_slips_are_removed_added_and_moved_by_hand() -> None:
    time, force, _ = record(CALM, 6)
    trace = Trace("slider", time, force)
    slides = (Phase("steady sliding", 0.0, float(time[-1])),)
    options = PullOptions(test=Test("T", "", "F", 0.3, "", speed_m_s=SLOW.speed_m_s), phases=slides)
    before = evaluate(trace, options).slips
    fifth = before[4]
    removed = evaluate(trace, replace(options, slips=((5, math.nan, math.nan),))).slips
    assert [s.fail_s for s in removed] == [s.fail_s for s in before if s is not fifth]
    assert removed[4].recurrence_s == pytest.approx(before[5].fail_s - before[3].fail_s)
    moved = evaluate(trace, replace(options, slips=((5, fifth.fail_s + 0.004, fifth.end_s),))).slips
    assert [s.by_hand for s in moved] == [k == 4 for k in range(len(before))]
    assert moved[4].drop_N == pytest.approx(fifth.drop_N, rel=0.02)
    again = replace(options, slips=((5, math.nan, math.nan), (0, fifth.fail_s, fifth.end_s)))
    assert [s.fail_s for s in evaluate(trace, again).slips] == pytest.approx([s.fail_s for s in before], abs=2e-3)


PAPER = Path(__file__).resolve().parents[3] / "shared" / "real" / "paper-slider-stick-slip"
# peak, trough (of F/mg), period: of the README beside the records; half a free period
RIGS = {(168, 42): (0.330, 0.268, 1.50, 0.0425), (168, 1100): (0.373, 0.300, 0.160, 0.0425)}


@pytest.mark.skipif(not PAPER.is_dir(), reason="the real campaigns are not at hand")
@pytest.mark.parametrize("rig", RIGS)
def test_the_slips_of_the_paper_slider_are_those_counted_by_hand(rig: tuple[int, int]) -> None:
    from scipy.io import loadmat

    peak, trough, period, half_s = RIGS[rig]
    file = loadmat(PAPER / f"k{rig[0]}Nm_v{rig[1]}.mat")
    weight = 0.0307 * STANDARD_GRAVITY
    force = file["Fnorm"].ravel() * weight
    slips = slips_of(file["t"].ravel(), force, speed_m_s=1e-6 * rig[1], stiffness_N_per_m=rig[0])
    assert np.median([s.peak_N for s in slips]) / weight == pytest.approx(peak, rel=0.05)
    assert np.median([s.trough_N for s in slips]) / weight == pytest.approx(trough, rel=0.1)
    assert np.median([s.recurrence_s for s in slips[1:]]) == pytest.approx(period, rel=0.25)
    assert np.median([s.duration_s for s in slips]) == pytest.approx(half_s, rel=0.3)
    if rig == (168, 42):
        assert len(slips) == 226  # with falls from 0.05 of the weight on, by the README


def test_a_force_that_falls_and_does_not_climb_tells_no_stiffness() -> None:
    time = np.arange(2000) * 1e-3
    force = np.where(time < 0.45, 0.0, np.interp(time, [0.45, 0.47, 0.6, 0.95, 0.97], [0.0, -0.4, -0.4, 0.0, -0.4]))
    spans = [(0.0, 0.45, 0.47, 0.95), (0.6, 0.95, 0.97, 1.5)]
    slips = read_between(time, force, spans, 1e-3, math.nan, from_rest=True)
    assert slips[0].loading_N_per_s == 0.0
    assert math.isnan(slips[0].slip_m)
