"""Records of other people's rigs against what was published of them or measured from their columns by hand."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from in_one_test import in_one_test

from tribo import read_pull
from tribo.records import STANDARD_GRAVITY, Pull, Test, Trace
from tribo.zeroing import zero_choice

REAL = Path(__file__).resolve().parents[3] / "shared" / "real"
pytestmark = pytest.mark.skipif(not REAL.is_dir(), reason="the real campaigns are not at hand")

STRESS_PER_FORCE = 0.1250 / (0.0776 * 0.022619)  # levers and area of the ring shear tester, from the authors' script
STRESSES = [250, 250, 500, 500, 1000, 1000, 1500, 1500, 2000, 2000]
SLIDER_N = 0.0307 * STANDARD_GRAVITY
# mean, peak and trough of F/mg, k v/mg per s, and the regime: read by column, the first tenth left out
PAPER = {
    ("168", "42"): (0.302, 0.330, 0.268, 0.0234, "stick-slip"),
    ("168", "1100"): (0.338, 0.373, 0.300, 0.614, "stick-slip"),
    ("1002", "1100"): (0.336, 0.367, 0.303, 3.66, "inertial oscillation"),
    ("2254", "4300"): (0.354, 0.422, 0.268, 32.2, "inertial oscillation"),
}


def a_test(zero: str, load_N: float = math.nan, speed: float | None = None, stiffness: float | None = None) -> Test:
    return Test(
        "T", "f", "S", load_N, "S", speed_m_s=speed, zero=zero_choice(zero), stiffness_N_per_m=stiffness
    )  # fmt: skip


@pytest.fixture
def exports() -> Path:
    return REAL


@pytest.fixture(scope="module")
def quartz() -> list[Pull]:
    (file,) = (REAL / "quartz-sand-ring-shear").glob("443*")
    table = np.genfromtxt(file, delimiter="\t", skip_header=1)
    pulls = []
    for column in table.T[1:]:
        there = np.isfinite(column) & np.isfinite(table[:, 0])
        trace = Trace("sand", table[there, 0], column[there])
        pulls.append(read_pull(trace, rule="highest", test=a_test("none")))
    return pulls


def published(name: str) -> np.ndarray:
    """The published stresses in Pa, in the order of the columns of the record."""
    lines = (REAL / "quartz-sand-ring-shear" / f"published_{name}.txt").read_text().splitlines()[1:]
    values = [float(line.split()[1]) for line in lines if line.strip()]
    return np.array(values[8:] + values[:8])


def test_peak_and_reactivation_of_every_sand_record_are_the_published_ones(quartz: list[Pull]) -> None:
    peaks = np.array([pull.static_N for pull in quartz]) * STRESS_PER_FORCE
    assert peaks == pytest.approx(published("peak"), rel=0.01)
    assert [len(pull.restarts) for pull in quartz] == [1] * 10
    again = np.array([pull.restarts[0].static_N for pull in quartz]) * STRESS_PER_FORCE
    assert again == pytest.approx(published("reactivation"), rel=0.01)


def test_the_lines_through_the_sand_are_the_published_ones(quartz: list[Pull]) -> None:
    found = {
        "peak": [p.static_N for p in quartz], "dynamic": [p.sliding_N for p in quartz],
        "reactivation": [p.restarts[0].static_N for p in quartz],
    }  # fmt: skip
    for name, forces in found.items():
        ours = np.polyfit(STRESSES, np.array(forces) * STRESS_PER_FORCE, 1)
        theirs = np.polyfit(STRESSES, published(name), 1)
        assert ours[0] == pytest.approx(theirs[0], rel=0.01), name
        assert ours[1] == pytest.approx(theirs[1], abs=3.0), name


@in_one_test(PAPER)
def test_the_paper_slider_is_read_while_it_slides(exports: Path, *rig: str) -> None:
    from scipy.io import loadmat

    mean, peak, trough, loading, regime = PAPER[rig[0], rig[1]]
    file = loadmat(exports / "paper-slider-stick-slip" / f"k{rig[0]}Nm_v{rig[1]}.mat")
    trace = Trace("paper", file["t"].ravel(), file["Fnorm"].ravel() * SLIDER_N)
    pull = read_pull(trace, test=a_test("", SLIDER_N, float(rig[1]) * 1e-6, float(rig[0])))
    found = pull.oscillation
    assert found is not None
    assert not pull.problems  # no sample is left out
    assert math.isnan(pull.static_N)
    assert pull.sliding_N / SLIDER_N == pytest.approx(mean, rel=0.02)
    assert found.peak_N / SLIDER_N == pytest.approx(peak, rel=0.05)
    assert found.trough_N / SLIDER_N == pytest.approx(trough, rel=0.05)
    assert found.regime == regime
    if regime == "stick-slip":
        assert found.loading_N_per_s / SLIDER_N == pytest.approx(loading, rel=0.05)


def test_friction_in_motor_oil_is_a_constant_and_a_slope() -> None:
    loads, forces = [], []
    for file in sorted((REAL / "motor-oil-rotary").glob("*.txt")):
        table = np.genfromtxt(file, delimiter=";", skip_header=1)
        columns = {"normal_force_N": table[:, 2], "speed_m_s": table[:, 5] * 2 * math.pi * 8e-3 / 3}
        trace = Trace(file.stem, table[:, 1], table[:, 3] / (8e-3 / 3), columns=columns)
        pull = read_pull(trace, test=a_test("at rest"))
        loads.append(pull.recorded_load_N)
        forces.append(pull.sliding_N)
    assert len(forces) == 16
    slope, constant = np.polyfit(loads, forces, 1)
    assert slope == pytest.approx(0.0276, rel=0.03)
    assert constant == pytest.approx(0.954, rel=0.03)


@in_one_test(["PPS_60N_2", "PPS_100N_1", "PPS+45PTFE_100N_200RPM_30MINS_1"])
def test_a_pin_on_disc_record_at_one_sample_a_second_has_no_static_force(exports: Path, file: str) -> None:
    from tribo.readers import read_export

    trace = read_export(exports / "ptfe-pin-on-disc" / f"{file}.tsv")
    pull = read_pull(trace, test=a_test(""))
    assert math.isnan(pull.static_N)
    second_half = trace.force_N[trace.force_N.size // 2 :]
    assert pull.sliding_N + pull.zero_N == pytest.approx(second_half.mean(), rel=2e-3)
