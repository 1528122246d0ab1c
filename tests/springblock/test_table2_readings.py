"""What the study of the open choices reads off a run, which runs it makes, and how it compares them."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tribo.springblock import SimConfig, simulate

sys.path.append(str(Path(__file__).resolve().parents[2] / "benchmarks"))
from table2_readings import (
    VARIANTS,
    Variant,
    combinations,
    mean_between,
    peak_of,
    readings,
    run_study,
    study_designs,
)

SMALL = SimConfig(blocks=(45, 21), dt_s=1e-7, rest_tolerance=1e-2, duration_peaks=1.5)
TIME = np.linspace(0.0, 10.0, 1001)
SAW = np.interp(TIME, [0, 2, 3, 6, 10], [0.0, 5.0, 4.0, 8.0, 6.0])


def test_first_and_highest_peak_of_a_known_trace():
    """5 at 2 s before a fall of a fifth, 8 at 6 s over all; a rule of a larger fall passes over the first."""
    assert peak_of(TIME, SAW, None) == pytest.approx((8.0, 6.0))
    assert peak_of(TIME, SAW, 0.01) == pytest.approx((5.0, 2.0))
    assert peak_of(TIME, SAW, 0.19) == pytest.approx((5.0, 2.0))
    assert peak_of(TIME, SAW, 0.21) == pytest.approx((8.0, 6.0))


def test_mean_of_a_line_is_that_of_its_ends():
    """From 6 to 10 s the force falls from 8 to 6; also where few samples lie in between."""
    assert mean_between(TIME, SAW, 6.0, 10.0) == pytest.approx(7.0)
    assert mean_between(TIME[::100], SAW[::100], 6.5, 9.5) == pytest.approx(7.0)


@pytest.mark.parametrize("sample", ["F", "C"])
def test_readings_are_those_of_the_run(sample: str):
    """The baseline rules give the static and sliding friction of the engine, which counts every step."""
    run = simulate(SMALL.with_(sample=sample, duration_peaks=3.0, seed=3))
    found = readings(run)
    assert found["highest peak"] == pytest.approx(run.static_friction, rel=1e-3)
    assert found["1.05 to 3 peak times"] == pytest.approx(run.sliding_friction, rel=1e-3)
    first = simulate(SMALL.with_(sample=sample, duration_peaks=3.0, seed=3, peak_rule="first"))
    assert found["first fall of 1 %"] == pytest.approx(first.static_friction, rel=2e-3)


@pytest.mark.parametrize("name", VARIANTS)
def test_every_variant_is_possible_and_of_equal_size(name: str):
    """Every configuration passes its checks; as many runs a sample and pressure as the baseline; equal seeds."""
    design = VARIANTS[name].design(("F", "A", "B", "C", "Sx", "Sy"), (3e3, 25e3), 4, SimConfig())
    baseline = VARIANTS["baseline"].design(("F", "A", "B", "C", "Sx", "Sy"), (3e3, 25e3), 4, SimConfig())
    assert [(c.check().sample, c.pressure_Pa, c.seed) for c in design] == [
        (c.sample, c.pressure_Pa, c.seed) for c in baseline
    ]


def test_a_study_compares_its_variants_over_the_same_runs_and_goes_on(tmp_path: Path):
    """Halving K_s lowers B and leaves F; a variant that changes nothing differs by exactly nothing."""
    variants = {"baseline": Variant(), "same": Variant({"shear_factor": 1.0}), "half": Variant({"shear_factor": 0.5})}
    designs = study_designs(SMALL, repeats=2, pressures_Pa=(5e3, 20e3), samples=("F", "B"), variants=variants)
    tables = run_study(tmp_path, designs)
    seen: list[tuple[int, int]] = []
    again = run_study(tmp_path, designs, progress=lambda done, total: seen.append((done, total)))
    assert seen == [(8, 24), (16, 24), (24, 24)]
    assert all(again[name].equals(tables[name]) for name in variants)
    rows = [{"sample": s, "regime": r, "source": "simulation", "mu": 4.0, "tau0_kPa": 10.0}
            for s in ("F", "B") for r in ("static", "sliding")]  # fmt: skip
    fits, distances = combinations(tables, pd.DataFrame(rows), resamples=20)
    change = distances.groupby("variant")[["change", "change_se"]]
    assert (change.max().loc["same"] == 0.0).all()
    of = fits[(fits["reading"] == "highest peak") & (fits["weights"] == "ratio")].set_index(["variant", "sample"])["mu"]
    assert of["half", "B"] < 0.99 * of["baseline", "B"]
    assert of["half", "F"] == pytest.approx(of["baseline", "F"], rel=2e-3)
    assert len(distances) == len(variants) * (3 + 4) * 3
