"""Several readings of one record: levels, steps, cycles, running-in and holds against what the record was made of."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy import stats
from scipy.signal import lfilter
from support import first_quick

import tribo
from tribo import plot
from tribo.errors import CampaignError
from tribo.records import Ingested, Reading, Restart, Study, Test, Trace
from tribo.report.tables import readings_table
from tribo.traces import PullOptions, evaluate
from tribo.traces.readings import Part, _exponential, readings_of
from tribo.traces.signal import mean_of_level

TEST = Test("T1", "raw/T1.csv", "S", 10.0, "S1")


def noise(size: int, seed: int, sd: float = 0.02, correlated: float = 5.0) -> np.ndarray:
    """Noise of the first order, correlated over so many samples."""
    kept = math.exp(-1.0 / correlated)
    shocks = np.random.default_rng(seed).standard_normal(size + 200) * sd * math.sqrt(1.0 - kept**2)
    return np.asarray(lfilter([1.0], [1.0, -kept], shocks)[200:])


def read(trace: Trace, contact: str = "") -> tuple[Reading, ...]:
    return readings_of([Part(TEST, trace, evaluate(trace, PullOptions(test=TEST, contact=contact)))])


@pytest.mark.parametrize("drift", ["none", "line", "bend", "wave"])
def test_the_interval_of_a_mean_holds_under_correlated_noise_and_slow_drift(drift: str) -> None:
    held = 0
    along = np.linspace(0.0, 1.0, 1500)
    for seed in range(300):
        shape = {
            "none": 0.0 * along, "line": 0.3 * along, "bend": 0.1 * np.exp(-along / 0.3),
            "wave": 0.05 * np.sin(6.0 * along + seed),
        }[drift]  # fmt: skip
        level = 2.0 + shape
        _, low, high = mean_of_level(level + noise(1500, seed))
        held += low <= level.mean() <= high
    assert 0.91 <= held / 300 <= 0.985


def campaign(tmp_path: Path, rows: str, **tables: dict[str, np.ndarray]) -> Ingested:
    (tmp_path / "raw").mkdir()
    for name, columns in tables.items():
        pd.DataFrame(columns).to_csv(tmp_path / "raw" / f"{name}.csv", index=False)
    said = '[campaign]\ntitle = "programmes"\nviscosity_mPa_s = 80\n[patterns.F]\ncavity = "none"\n'
    (tmp_path / "campaign.toml").write_text(said)
    (tmp_path / "tests.csv").write_text(f"test_id,file,sample,normal_load_N\n{rows}")
    return tribo.ingest(tribo.load_campaign(tmp_path))


def a_ladder(seed: int = 0) -> tuple[list[float], dict[str, np.ndarray]]:
    speeds = [1.0, 3.0, 10.0, 30.0, 100.0, 30.0, 10.0, 3.0, 1.0]
    v = np.repeat(speeds, 600)
    rng = np.random.default_rng(seed)
    return [1.5 - 0.2 * math.log10(s) for s in speeds], {
        "time (s)": np.arange(v.size) / 10, "friction force (N)": 1.5 - 0.2 * np.log10(v) + noise(v.size, seed),
        "speed (mm/s)": v * (1 + 0.01 * rng.standard_normal(v.size)),
        "normal force (N)": 10 + 0.02 * rng.standard_normal(v.size),
    }  # fmt: skip


def test_a_ladder_of_speeds_has_a_mean_and_a_hersey_number_for_each_level_up_and_down(tmp_path: Path) -> None:
    true, columns = a_ladder()
    ingested = campaign(tmp_path, "L,raw/ladder.csv,F,\n", ladder=columns)
    levels = [r for r in ingested.readings if r.name == "plateau"]
    assert [r.way for r in levels] == ["up"] * 5 + ["down"] * 4
    assert [r.values["force_N"][0] for r in levels] == pytest.approx(true, rel=0.01)
    held = [r.values["force_N"][1] <= f <= r.values["force_N"][2] for r, f in zip(levels, true, strict=True)]
    assert sum(held) >= 7
    assert levels[2].values["coefficient"][0] == pytest.approx(0.13, rel=0.01)
    assert levels[2].values["hersey_per_m"][0] == pytest.approx(0.08 * 0.01 / 10.0, rel=0.01)
    steps = [r.values["total_change_N"] for r in ingested.readings if r.name == "step of speed"]
    assert [s[0] for s in steps] == pytest.approx(np.diff(true), abs=0.02)
    table = readings_table(Study(ingested))
    assert table is not None
    assert set(table["reading"]) == {"plateau", "step of speed"}
    assert plot.levels(Study(ingested)).axes[0].get_xlabel() == "Hersey number (1/m)"


def test_a_step_of_speed_has_a_change_at_once_and_a_total_change() -> None:
    time = np.arange(4000) / 10
    v = np.where(time < 200, 1e-3, 1e-2)
    force = np.where(time < 200, 6.0, 5.8 + 0.5 * np.exp(-(time - 200) / 8)) + noise(4000, 3, 0.01, 1.0)
    (step,) = (r for r in read(Trace("gouge", time, force, columns={"speed_m_s": v})) if r.name == "step of speed")
    assert step.values["total_change_N"][0] == pytest.approx(-0.2, abs=0.01)
    assert step.values["direct_change_N"][0] == pytest.approx(0.3, abs=0.03)
    assert step.values["direct_change_N"][1] < 0.3 < step.values["direct_change_N"][2]


def test_the_change_at_once_of_a_step_that_only_a_displacement_tells_is_not_lost_in_its_smoothing() -> None:
    time, found = np.arange(1600) / 10, []
    for seed in range(12):
        after = np.maximum(time - 100.0, 0.0)
        x = 1e-6 * (time + 9.0 * after) + noise(1600, seed, 2e-8, 0.1)
        force = np.where(time < 100, 6.0, 5.8 + 0.5 * np.exp(-after / 1.5)) + noise(1600, seed + 50, 0.005, 2.0)
        (step,) = (r for r in read(Trace("gouge", time, force, x)) if r.name == "step of speed")
        found.append(step.values["direct_change_N"])
    assert np.median([value for value, _, _ in found]) == pytest.approx(0.3, rel=0.04)
    assert sum(low <= 0.3 <= high for _, low, high in found) >= 11


def test_the_total_change_of_a_step_holds_nothing_of_the_force_that_still_settles() -> None:
    time, held = np.arange(1200) / 10, 0
    after = np.maximum(time - 60.0, 0.0)
    for seed in range(24):
        force = np.where(time < 60, 6.0, 5.8 + 0.5 * np.exp(-after / 5.0)) + noise(1200, seed, 0.003, 2.0)
        columns = {"speed_m_s": np.where(time < 60, 1e-3, 1e-2)}
        (step,) = (r for r in read(Trace("gouge", time, force, columns=columns)) if r.name == "step of speed")
        _, low, high = step.values["total_change_N"]
        held += low <= -0.2 <= high
    assert held >= 21


def strokes(zero_N: float = 0.1) -> dict[str, np.ndarray]:
    """Strokes of 9 mm at 2 mm/s and 1.5 N, then half a second of rest."""
    time = np.arange(6000) / 100
    way = np.where((time / 5).astype(int) % 2 == 0, 1.0, -1.0)
    moves = (time % 5) < 4.5
    force = zero_N + way * np.where(moves, 1.5, 1.2) + noise(6000, 1, 0.01, 1.0)
    x = np.cumsum(way * moves * 2.0) / 100
    return {"time (s)": time, "friction force (N)": force, "position (mm)": x}


def test_strokes_that_cannot_be_read_as_one_pull_say_how_to_name_them(tmp_path: Path) -> None:
    with pytest.raises(CampaignError, match=r"raw/strokes\.csv#1/\* for all"):
        campaign(tmp_path, "S,raw/strokes.csv,F,5\n", strokes=strokes())


def test_two_strokes_are_a_cycle_with_its_mean_asymmetry_and_work(tmp_path: Path) -> None:
    ingested = campaign(tmp_path, "S,raw/strokes.csv#1/*,F,5\n", strokes=strokes())
    cycles = [r for r in ingested.readings if r.name == "cycle"]
    assert [r.cycle for r in cycles] == [1, 2, 3, 4, 5, 6]
    for cycle in cycles:
        assert cycle.values["force_N"][0] == pytest.approx(1.5, abs=0.005)
        assert cycle.values["asymmetry_N"][0] == pytest.approx(0.1, abs=0.005)
        assert cycle.values["energy_J"][0] == pytest.approx(2 * 9e-3 * 1.5, rel=0.01)
    assert [r.name for r in ingested.readings] == ["cycle"] * 6
    assert plot.cycles(Study(ingested)).axes


def running_in(seed: int, share: float, change: float, sd: float = 0.03) -> Trace:
    """An hour on a disc: the force decays with a time constant of so large a share of the record."""
    time = np.arange(1800.0) * 2
    force = 4.0 + change * np.exp(-time / (share * 3600)) + noise(1800, seed, sd)
    return Trace("disc", time, force, columns={"speed_m_s": np.full(1800, 0.1)})


def test_the_distance_of_running_in_is_read_with_its_interval() -> None:
    found = [next(r for r in read(running_in(seed, 0.08, 2.0)) if r.name == "running-in") for seed in range(20)]
    true_s = 0.08 * 3600 * math.log(10)
    steady = [r for r in found if r.state == "steady"]
    assert len(steady) >= 16
    assert np.median([r.values["run_in_s"][0] for r in steady]) == pytest.approx(true_s, rel=0.01)
    assert sum(r.values["run_in_s"][1] <= true_s <= r.values["run_in_s"][2] for r in steady) >= 0.8 * len(steady)
    assert steady[0].values["run_in_m"][0] == pytest.approx(0.1 * steady[0].values["run_in_s"][0])
    assert steady[0].values["force_N"][0] == pytest.approx(4.0, abs=0.03)


def test_the_interval_of_running_in_holds_where_the_noise_is_as_large_as_the_force() -> None:
    time, held, read_s = np.arange(240.0), 0, 0.07 * 240 * math.log(10.0)
    rng = np.random.default_rng(4)
    for _ in range(300):
        force = 1.0 + np.exp(-time / (0.07 * 240))
        fitted = _exponential(time, force * (1.0 + 0.02 * rng.standard_normal(240)))
        assert fitted is not None
        held += fitted[1][1] <= read_s <= fitted[1][2]
    assert 0.92 <= held / 300 <= 0.98


@pytest.mark.parametrize("share", first_quick([0.4, 1.0, 5.0]))
def test_a_record_that_still_drifts_is_not_called_steady(share: float) -> None:
    states = [r.state for seed in range(12) for r in read(running_in(seed, share, 1.0)) if r.name == "running-in"]
    assert "steady" not in states
    assert states.count("still drifts") >= 10


def test_static_friction_that_grows_with_the_hold_heals_by_so_much_a_decade() -> None:
    time = np.arange(1000) / 10
    pull = evaluate(Trace("disc", time, 4.0 + noise(1000, 1), columns={"speed_m_s": np.full(1000, 0.1)}))
    gains = [(1.0, 0.31), (10.0, 0.42), (100.0, 0.49), (1000.0, 0.61)]
    restarts = tuple(Restart(h, 100.0 * k, 50.0, pull.sliding_N + g, 0.01, 4.0, 0.01) for k, (h, g) in enumerate(gains))
    part = Part(TEST, Trace("disc", time, 4.0 + noise(1000, 1)), replace(pull, restarts=restarts))
    found = readings_of([part])
    (healing,) = (r for r in found if r.name == "healing")
    slope = stats.linregress([0.0, 1.0, 2.0, 3.0], [g for _, g in gains])
    half = stats.t.ppf(0.975, 2) * slope.stderr
    expected = slope.slope, slope.slope - half, slope.slope + half
    assert healing.values["healing_N_per_decade"] == pytest.approx(expected, abs=1e-6)
    assert [r.hold_s for r in found if r.name == "hold"] == [1.0, 10.0, 100.0, 1000.0]


def test_one_pull_from_rest_has_no_further_readings(small_campaign: Path) -> None:
    ingested = tribo.ingest(tribo.load_campaign(small_campaign))
    assert ingested.readings == ()
