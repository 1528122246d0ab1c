"""Records of other people's rigs against means that were taken by column with numpy alone.

Where a force drifts while it slides, its mean is taken over the window that tribo states, which has to lie in the slide
by the columns of the file; else over the part that the file or its authors name.
"""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from on_the_command_line import run

from tribo import load_campaign, read_pull
from tribo.readers import read_blocks, read_export
from tribo.records import STANDARD_GRAVITY, Correction, Pull, Test, Trace
from tribo.traces import PullOptions, evaluate, pieces_of
from tribo.zeroing import zero_choice

REAL = Path(__file__).resolve().parents[3] / "shared" / "real"
pytestmark = pytest.mark.skipif(not REAL.is_dir(), reason="the real campaigns are not at hand")
SLIDING = 0.005
STATIC = 0.01


def files(folder: str, glob: str) -> list[Path]:
    return sorted((REAL / folder).glob(glob))


def a_test(zero: str = "", speed: float | None = None) -> Test:
    return Test("T", "f", "S", math.nan, "S", speed_m_s=speed, zero=zero_choice(zero))


def numbers(lines: Sequence[str], separator: str) -> np.ndarray:
    """Rows of numbers, a decimal comma or point, as long as the first of them; texts left out."""
    rows = []
    for line in lines:
        cells = [cell.strip().replace(",", ".") if separator != "," else cell for cell in line.split(separator)]
        try:
            rows.append([float(cell) for cell in cells if cell])
        except ValueError:
            continue
    usual = max({len(row) for row in rows}, key=[len(row) for row in rows].count)
    return np.array([row for row in rows if len(row) == usual])


def test_every_step_of_the_plastics_has_the_mean_of_its_window() -> None:
    for file in files("rotary-plastics-down", "*.csv"):
        lines = file.read_text(encoding="latin-1").splitlines()
        head = next(k for k, line in enumerate(lines) if line.startswith("Step,"))
        table = numbers([line.rstrip(",") for line in lines[head + 1 :]], ",")
        ends = [0, *(np.flatnonzero(np.diff(table[:, 0])) + 1), len(table)]
        steps = [table[a:b, 4] for a, b in pairwise(ends)]
        tables = read_blocks(file)
        assert len(steps) == len(tables) == 4
        for step, trace in zip(steps, tables, strict=True):
            pull = read_pull(trace, test=a_test())
            assert math.isnan(pull.static_N)
            first, last = np.searchsorted(trace.time_s, pull.window_s)
            assert last - first > 0.3 * step.size  # the force drifts, so its mean is that of the window
            assert pull.sliding_N == pytest.approx(abs(step[first : last + 1].mean()), rel=SLIDING)


def test_composites_have_the_mean_of_the_second_half_of_their_half_hour() -> None:
    found = {}
    for file in files("ptfe-pin-on-disc", "PPS*.tsv"):
        table = [line.rstrip("\t").split("\t") for line in file.read_text(encoding="latin-1").splitlines()]
        rows = [cells for cells in table if len(cells) > 12 and cells[1].count(":") == 2]
        friction = np.array([float(cells[-1].replace(",", ".")) for cells in rows])
        found[file.name] = friction
        pull = read_pull(read_export(file), test=a_test())
        assert pull.sliding_N == pytest.approx(friction[friction.size // 2 :].mean(), rel=SLIDING), file.name
    assert len(found) == 8


def test_motor_oil_has_the_mean_torque_of_its_window_over_the_lever() -> None:
    arm = 2 / 3 * 4e-3
    for file in files("motor-oil-rotary", "*.txt"):
        table = numbers(file.read_text().splitlines()[1:], ";")
        time, torque, turns = table[:, 1], table[:, 3], table[:, 5]
        trace = Trace(
            file.stem, time, torque / arm, columns={"normal_force_N": table[:, 2], "speed_m_s": turns * 2 * np.pi * arm}
        )
        pull = read_pull(trace, test=a_test("none"))  # the torque at rest drifts by 2 % of that of sliding
        slides = (time >= pull.window_s[0]) & (time <= pull.window_s[1])
        assert (turns[slides] > 0.5).mean() > 0.98  # the recorded turns are noisy
        by_column = torque[slides].mean() / arm
        friction = abs(by_column - torque[-100:].mean() / arm)  # above the torque at rest at the end
        assert pull.sliding_N == pytest.approx(abs(by_column), abs=SLIDING * friction), file.name


def test_alloy_strokes_have_half_the_difference_of_both_directions() -> None:
    for file in files("alloy-reciprocating", "*.csv"):
        blocks = file.read_text(encoding="latin-1").split("Step No.")[1:]
        tables = [numbers(block.splitlines(), ",") for block in blocks]
        steps = [table for table in tables if len(table) > 50]
        pulls: list[Pull] = [
            evaluate(piece, PullOptions(**{**vars(own), "test": a_test(), "rule": "middle_share"}))
            for piece, own in pieces_of(read_blocks(file)).values()
        ]
        assert len(pulls) == len(steps) == 2
        means = []
        for step, pull in zip(steps, pulls, strict=True):
            inside = (step[:, 8] >= pull.window_s[0]) & (step[:, 8] <= pull.window_s[1])
            assert 0.2 < pull.window_s[0] < pull.window_s[1] < 1.6  # the drive stops at two thirds of the step
            means.append(step[inside, 0].mean() * 1e-3 * STANDARD_GRAVITY)
        by_column = abs(means[0] - means[1]) / 2
        assert np.mean([pull.sliding_N for pull in pulls]) == pytest.approx(by_column, rel=SLIDING), file.name


def test_the_pin_on_disc_has_the_mean_coefficient_of_its_second_half() -> None:
    (file,) = files("pcs-pin-on-disc", "demo_7.txt")
    lines = file.read_text(encoding="latin-1").splitlines()
    head = next(k for k, line in enumerate(lines) if line.startswith("Step Time"))
    rows = [line.split("\t") for line in lines[head + 1 :] if line[:1].isdigit()]
    friction = np.array([float(row[1]) for row in rows if len(row) > 10])
    trace = read_export(file)
    pull = read_pull(trace, test=a_test())
    half = friction.size // 2
    assert pull.sliding_N / pull.recorded_load_N == pytest.approx(friction[half:].mean(), rel=SLIDING)


def test_the_sand_has_the_highest_force_of_its_first_ten_millimetres() -> None:
    (file,) = files("quartz-sand-ring-shear", "443*")
    table = np.genfromtxt(file, delimiter="\t", skip_header=1)
    for column in table.T[1:]:
        there = np.isfinite(column) & np.isfinite(table[:, 0])
        time, force = table[there, 0], column[there]
        highest = float(force[time - time[0] < 10.0 / 0.05].max())
        pull = read_pull(Trace("sand", time, force), rule="highest", test=a_test("none"))
        assert pull.static_N == pytest.approx(highest, rel=STATIC)


def test_the_paper_slider_has_the_mean_without_its_first_tenth() -> None:
    from scipy.io import loadmat

    for file in files("paper-slider-stick-slip", "*.mat"):
        table = loadmat(file)
        time, ratio = table["t"].ravel(), table["Fnorm"].ravel()
        pull = read_pull(Trace("paper", time, ratio), test=a_test())
        assert pull.sliding_N == pytest.approx(ratio[ratio.size // 10 :].mean(), rel=SLIDING), file.name
        assert math.isnan(pull.static_N)


def test_the_gouge_has_the_mean_coefficient_of_both_speeds() -> None:
    (file,) = files("velocity-step-gouge", "velstep3*")
    time, displacement, friction, stress = np.loadtxt(file, skiprows=1).T
    tables = read_blocks(file, correction=Correction(area_m2=1e-6))
    pulls = [evaluate(piece, own) for piece, own in pieces_of(tables, PullOptions(test=a_test())).values()]
    assert len(pulls) == 2
    for pull, speed in zip(pulls, (0.2, 2.0), strict=True):
        inside = (time >= pull.window_s[0]) & (time <= pull.window_s[1])
        assert math.isnan(pull.static_N)
        assert abs(np.polyfit(time[inside], displacement[inside], 1)[0]) == pytest.approx(speed, rel=0.01)
        assert pull.sliding_N == pytest.approx((friction * stress)[inside].mean(), rel=SLIDING)
        assert pull.recorded_load_N == pytest.approx(stress[inside].mean(), rel=SLIDING)


def test_strokes_of_the_micrometre_rig_have_half_the_difference_of_both_directions() -> None:
    (file,) = files("reciprocating-micrometre", "test_data_2.txt")
    time, _, position, friction = np.loadtxt(file, skiprows=1).T
    (table,) = read_blocks(file)
    pulls = [evaluate(piece, own) for piece, own in pieces_of(table, PullOptions(test=a_test())).values()]
    strokes = [p for p in pulls if {"forward", "backward"} & set(p.flags) and p.recorded_load_N > 4.9]
    assert len(strokes) > 90
    differences = []
    for one, other in pairwise(strokes):
        means = [
            friction[(time >= p.window_s[0]) & (time <= p.window_s[1])].mean() * 1e-6 for p in (one, other)
        ]  # fmt: skip
        for pull, way in ((one, 0), (other, 1)):
            moved = position[(time >= pull.window_s[0]) & (time <= pull.window_s[1])]
            assert abs(moved[-1] - moved[0]) < 240.0, way
            steps = np.abs(np.diff(moved))  # the drive dwells for half of the time, and no window lies over a dwell
            assert np.mean(steps > 0.05 * steps.max()) > 0.75
        if means[0] * means[1] < 0:
            differences.append(((one.sliding_N + other.sliding_N) / 2, abs(means[0] - means[1]) / 2))
    found, by_column = np.array(differences).T
    assert found == pytest.approx(by_column, rel=SLIDING)


@pytest.mark.slow
def test_the_damper_has_the_mean_force_of_its_windows() -> None:
    for file in files("friction-damper", "*.json"):
        rows = np.array(json.loads(file.read_text())["data"], float)
        time, force = rows[:, 0], rows[:, 2] * 4448.2216
        (table,) = read_blocks(file)
        pieces = pieces_of(table, PullOptions(test=a_test()))
        pulls = [evaluate(piece, own) for piece, own in pieces.values()]
        slides = [math.isfinite(pull.sliding_N) for pull in pulls]
        assert all(slides[1:]), file.name  # the first piece may end before the damper slides
        assert len(pulls) > 5, file.name
        for pull in pulls if slides[0] else pulls[1:]:
            inside = (time >= pull.window_s[0]) & (time <= pull.window_s[1])
            way = -1.0 if "backward" in pull.flags else 1.0
            by_column = way * force[inside].mean() - pull.zero_N
            assert pull.sliding_N == pytest.approx(by_column, rel=SLIDING), file.name


@pytest.mark.slow
def test_elastomers_have_the_coefficient_of_each_row_times_its_load(tmp_path: Path) -> None:
    (file,) = files("elastomer-per-cycle", "*.csv")
    with file.open(encoding="utf-8-sig", newline="") as rows:
        table = list(csv.DictReader(rows))
    run("init", str(tmp_path / "c"), "--from", str(file.parent))
    found = load_campaign(tmp_path / "c").tests
    assert len(found) == len(table) == 4308
    for test, row in zip(found, table, strict=True):
        load_N = float(row["NominalLoad"]) * 1e-3
        assert test.normal_load_N == pytest.approx(load_N, rel=1e-6)
        assert test.evaluated is not None
        assert test.evaluated["sliding_N"] == pytest.approx(float(row["CoF.mean"]) * load_N, rel=SLIDING)
