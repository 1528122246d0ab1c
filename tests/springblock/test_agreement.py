"""The fast engine against the paper's algorithm, case by case; the table is in docs/results/simulator-accuracy.md.

The quick cases run with every test. The slow ones are some of those of ``benchmarks/simulator_agreement.py``.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from support import first_quick

from tribo.springblock import SimConfig
from tribo.springblock.engines.fast import integrate as run_fast
from tribo.springblock.engines.reference import integrate as run_reference
from tribo.springblock.engines.state import Trajectory, lattice_of, thresholds_of
from tribo.springblock.run import run_of

RECORD = Path(__file__).resolve().parents[2] / "docs" / "data"
ONE_CAVITY_OF_S = {"blocks": (44, 14), "pattern_first": (2, 3)}


def to_the_peak(config: SimConfig) -> tuple[Trajectory, Trajectory]:
    """Fast and reference run on the same thresholds, until shortly after the peak that the rule asks for."""
    lattice = lattice_of(config)
    thresholds = thresholds_of(config, lattice)
    ahead = run_fast(config, lattice, thresholds)
    end = ahead.first_peak_s if config.peak_rule == "first" else ahead.peak_s
    config = config.with_(duration_s=1.01 * end)
    return run_fast(config, lattice, thresholds), run_reference(config, lattice, thresholds, start_share=0.995)


@pytest.mark.parametrize("pressure_Pa", [2e3, 10e3, 40e3])
def test_flat_peak_and_first_five_failures_are_those_of_the_reference(pressure_Pa: float):
    """Static friction within 0.1 %, and the same five blocks in the same order."""
    fast, reference = to_the_peak(SimConfig(blocks=(24, 24), pressure_Pa=pressure_Pa, seed=5, dt_s=1e-8))
    assert fast.peak_N == pytest.approx(reference.peak_N, rel=1e-3)
    assert fast.failed[:5].tolist() == reference.failed[:5].tolist()


@pytest.mark.parametrize(
    ("sample", "pressure_Pa", "angle_deg", "shape"),
    first_quick(
        [("C", 3e3, 12.0, {"blocks": (17, 17)}), ("Sy", 3e3, 96.0, {**ONE_CAVITY_OF_S, "peak_rule": "first"}),
         ("A", 5e3, 33.0, {"blocks": (17, 17)}), ("B", 25e3, 70.0, {"blocks": (17, 17)}),
         ("Sx", 3e3, -5.0, ONE_CAVITY_OF_S)], 2
    ),
)
def test_patterned_peak_is_that_of_the_reference(sample: str, pressure_Pa: float, angle_deg: float, shape: dict):
    """Static friction within 0.1 % at the default rest tolerance: the highest force, on Sy the first peak.

    Sy climbs on for as long again after its first peak, through avalanches that no two integrations share.
    """
    config = SimConfig(sample=sample, pressure_Pa=pressure_Pa, angle_deg=angle_deg, seed=1, dt_s=2e-8, **shape)
    fast, reference = to_the_peak(config)
    assert fast.peak_N == pytest.approx(reference.peak_N, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("sample", "pressure_Pa", "angle_deg"), [("B", 10e3, 50.0), ("C", 5e3, 20.0), ("Sx", 3e3, 4.0), ("Sy", 3e3, 86.0)]
)
def test_peak_of_a_large_sample_is_that_of_the_reference(sample: str, pressure_Pa: float, angle_deg: float):
    """48 x 48 blocks at the paper's step: within 0.1 %."""
    config = SimConfig(
        sample=sample, pressure_Pa=pressure_Pa, angle_deg=angle_deg, seed=9, blocks=(48, 48), dt_s=1e-8,
        peak_rule="first" if sample == "Sy" else "highest",
    )  # fmt: skip
    fast, reference = to_the_peak(config)
    assert fast.peak_N == pytest.approx(reference.peak_N, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("sample", ["B", "C"])
def test_patterned_sliding_mean_is_that_of_the_reference(sample: str):
    """Ten seeds and angles over the same window: single runs are chaotic, their means agree within 1 %."""

    def mean(run: object) -> float:
        found = []
        for seed in range(10):
            config = SimConfig(
                sample=sample, blocks=(16, 16), angle_deg=9.0 * seed, seed=seed, dt_s=2e-8, duration_peaks=1.4
            )
            lattice = lattice_of(config)
            trajectory = run(config, lattice, thresholds_of(config, lattice))  # type: ignore[operator]
            found.append(run_of(config, trajectory, float(lattice.area_fraction)).sliding_friction)
        return float(np.mean(found))

    assert mean(run_fast) == pytest.approx(mean(run_reference), rel=1e-2)


def test_the_recorded_peaks_hold_what_the_documentation_says():
    """Forty cases and more over all samples from 2 to 40 kPa, all within 0.1 %; flat failures in the same order."""
    cases = pd.read_csv(RECORD / "simulator-peaks.csv")
    assert len(cases) >= 40
    assert set(cases["sample"]) == {"F", "A", "B", "C", "Sx", "Sy"}
    assert (cases["pressure_kPa"].min(), cases["pressure_kPa"].max()) == (2, 40)
    within = cases["difference_percent"].abs() < 0.1
    assert within.sum() >= 40
    assert cases.loc[cases["sample"] == "F", "first_five_equal"].all()


def test_the_recorded_sliding_means_hold_what_the_documentation_says():
    """Ten seeds of every sample; the means differ by less than 1 %."""
    runs = pd.read_csv(RECORD / "simulator-sliding.csv").groupby("sample")
    assert set(runs.groups) == {"F", "A", "B", "C", "Sx", "Sy"}
    assert runs.size().min() >= 10
    means = runs[["sliding_fast", "sliding_reference"]].mean()
    assert (means["sliding_fast"] / means["sliding_reference"] - 1).abs().max() < 1e-2
