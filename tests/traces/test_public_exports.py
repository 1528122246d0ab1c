"""The friction of public exports, as computed from them independently by column name."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from in_one_test import in_one_test

from tribo import read_pull
from tribo.readers import read_blocks, read_export
from tribo.records import Trace
from tribo.traces import load_of, oscillation_of, pieces_of, read_pulls, split_pulls

GF = 9.80665e-3
PAPER_SLIDER_N = 0.0307 * 9.80665


@pytest.fixture
def exports(shared: Path) -> Path:
    folder = shared / "exports"
    if not folder.is_dir():
        pytest.skip("no public exports")
    return folder


@in_one_test([("001", (153.4, 181.7)), ("050", (156.9, 186.2))])
def test_cetr_strokes_part_into_friction_and_zero(exports: Path, stroke: str, means: tuple[float, float]) -> None:
    """The drive stands still from 1.4 s on: the force relaxes and is no longer rough."""
    blocks = read_blocks(exports / f"fr_cetr_umt2_2N_stroke{stroke}.csv")
    for block, mean in zip(blocks, means, strict=True):
        slides = (block.time_s > 0.8) & (block.time_s < 1.35)
        assert np.abs(block.force_N[slides]).mean() / GF == pytest.approx(mean, abs=1.0)
    strokes = pieces_of(blocks)
    assert [options.turned for _, options in strokes.values()] == [True, False]
    zeros = [options.zero.force_N / GF for _, options in strokes.values() if options.zero]
    assert zeros == pytest.approx([-20, 20], abs=7)
    pulls = read_pulls(blocks, rule="last_share", parameters={"start_s": 0.6})
    halves = [p.sliding_N / GF for p in pulls]
    assert np.mean(halves) == pytest.approx(np.mean(means), abs=2)
    assert abs(halves[0] - halves[1]) < 0.3 * abs(means[0] - means[1])
    assert load_of(blocks[0])[0] == pytest.approx(1.96, abs=0.01)
    if stroke == "001":  # early maxima are static
        raw = [(p.static_N + p.zero_N) / GF for p in pulls]
        assert raw == pytest.approx([153, 179], abs=1)


@in_one_test(
    [("60N_1", 9.7, 7.16), ("60N_2", 15.4, 8.05), ("100N_1", 18.1, 13.86)],
)
def test_te67_pin_on_disc(exports: Path, name: str, first_minute: float, second_half: float) -> None:
    trace = read_export(exports / f"fr_te67_PPS_{name}.tsv")
    assert len(split_pulls(trace)) == 1
    pull = read_pull(trace, rule="last_share")
    assert pull.static_N == pytest.approx(first_minute, abs=0.05)
    assert pull.sliding_N == pytest.approx(second_half, abs=0.015)


def newport(exports: Path, load: str) -> Trace:
    lever = {"friction force": "#4 [N m / 2.6666666667 mm]"}
    return read_export(exports / f"fr_newport_1rps{load}N.txt", columns=lever)


@in_one_test(["1", "3", "5", "10", "15"])
def test_newport_records_are_cut_to_the_time_under_load(exports: Path, load: str) -> None:
    loaded = max(split_pulls(newport(exports, load)), key=lambda piece: load_of(piece)[0])
    assert load_of(loaded)[0] == pytest.approx(float(load), rel=0.12)
    assert loaded.time_s[0] < 30
    assert loaded.time_s[-1] == pytest.approx(60, abs=1.5)


def test_newport_friction_against_load_across_files(exports: Path) -> None:
    loads, friction = [], []
    for load in ("1", "3", "5", "10", "15"):
        trace = newport(exports, load)
        loaded = max(read_pulls(trace), key=lambda p: p.window_s[1] - p.window_s[0] if 15 < p.window_s[0] < 55 else 0)
        raw = np.loadtxt(exports / f"fr_newport_1rps{load}N.txt", delimiter=";", skiprows=1)
        inside = (raw[:, 1] >= loaded.window_s[0]) & (raw[:, 1] <= loaded.window_s[1])
        torque = raw[inside, 3].mean()
        assert loaded.sliding_N + loaded.zero_N == pytest.approx(torque / (2 / 3 * 4e-3), rel=0.02)
        loads.append(float(load))
        friction.append(loaded.sliding_N + loaded.zero_N)
    mu, at_no_load = np.polyfit(loads, friction, 1)
    assert 0.005 < mu < 0.05
    assert at_no_load > 0


def paper(exports: Path, name: str) -> Trace:
    columns = {"time": "t [s]", "friction force": "Fnorm [30.7 gf]"}
    return read_export(exports / f"fr_paper_stickslip_{name}.mat", columns=columns)


def test_paper_on_paper_sticks_slips_and_loads_at_k_v(exports: Path) -> None:
    slow, fast = (
        oscillation_of(trace.time_s, trace.force_N)
        for trace in (paper(exports, "k168Nm_v42"), paper(exports, "k168Nm_v1100"))
    )
    assert slow.cycles == pytest.approx(226, rel=0.05)
    assert slow.peak_N / PAPER_SLIDER_N == pytest.approx(0.323, abs=0.004)
    assert slow.trough_N / PAPER_SLIDER_N == pytest.approx(0.284, abs=0.004)
    assert slow.loading_N_per_s / PAPER_SLIDER_N == pytest.approx(0.0237, abs=0.0004)
    assert slow.loading_N_per_s == pytest.approx(168 * 42e-6, rel=0.03)
    assert fast.loading_N_per_s / slow.loading_N_per_s == pytest.approx(1100 / 42, rel=0.05)
