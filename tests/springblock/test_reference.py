"""The fast engine against the paper's algorithm, and the energy balance of both."""

from __future__ import annotations

import numpy as np
import pytest
from support.energy_balance import energy_balance

from tribo.errors import SimulationError
from tribo.springblock import SimConfig, simulate
from tribo.springblock.engines import ENGINES
from tribo.springblock.engines.fast import integrate as run_fast
from tribo.springblock.engines.reference import integrate as run_reference
from tribo.springblock.engines.state import lattice_of, thresholds_of

SMALL = SimConfig(blocks=(17, 17), dt_s=1e-8, duration_peaks=1.01)


@pytest.mark.parametrize(
    ("sample", "pressure_Pa", "angle_deg"), [("F", 2e3, 0.0), ("F", 40e3, 37.0), ("A", 10e3, 20.0), ("C", 5e3, 80.0)]
)
def test_peak_is_that_of_the_reference(sample: str, pressure_Pa: float, angle_deg: float):
    """Static friction within 0.1 % of Runge-Kutta on all blocks; on flat samples the first five failures too."""
    config = SMALL.with_(sample=sample, pressure_Pa=pressure_Pa, angle_deg=angle_deg, seed=3)
    lattice = lattice_of(config)
    thresholds = thresholds_of(config, lattice)
    fast = run_fast(config, lattice, thresholds)
    reference = run_reference(config, lattice, thresholds, start_share=0.995)
    assert fast.peak_N == pytest.approx(reference.peak_N, rel=1e-3)
    if sample == "F":
        assert fast.failed[:5].tolist() == reference.failed[:5].tolist()


def test_finite_rotation_moves_the_peak_by_less_than_half_a_percent():
    """Full r_ij springs against linearised ones, both on the reference engine."""
    config = SMALL.with_(
        sample="A", angle_deg=30.0, engine="reference", duration_peaks=1.06, blocks=(13, 13), dt_s=2e-8
    )
    finite = simulate(config.with_(rotation="finite"))
    assert finite.static_friction == pytest.approx(simulate(config).static_friction, rel=5e-3)
    assert finite.static_friction != simulate(config).static_friction


@pytest.mark.parametrize(("sample", "edges", "blocks"), [("F", "periodic", 16), ("C", "free", 17)])
def test_dense_step_has_the_springs_of_finite_rotation_that_the_reference_has(sample: str, edges: str, blocks: int):
    """The peak to 0.003 %, where linear springs are off by over 0.01 % on C; the energy closes to 0.01 %."""
    config = SMALL.with_(
        sample=sample, edges=edges, angle_deg=5.0, seed=3, blocks=(blocks, blocks), rotation="finite", engine="dense"
    )
    lattice = lattice_of(config)
    thresholds = thresholds_of(config, lattice)
    dense = ENGINES["dense"].integrate(config, lattice, thresholds, 1)
    reference = run_reference(config, lattice, thresholds, start_share=0.995)
    linear = ENGINES["dense"].integrate(config.with_(rotation="small"), lattice, thresholds, 1)
    assert dense.peak_N == pytest.approx(reference.peak_N, rel=3e-5)
    assert abs(energy_balance(config, lattice, dense).residual) < 1e-4
    if sample == "C":
        assert abs(linear.peak_N / reference.peak_N - 1) > 1e-4


def test_fast_engine_refuses_finite_rotation():
    """It says which engine can."""
    with pytest.raises(SimulationError, match="engine reference"):
        SMALL.with_(rotation="finite").check()


@pytest.mark.parametrize("sample", ["F", "A", "C"])
def test_energy_is_conserved_and_better_so_with_smaller_steps(sample: str):
    """Work of the slider = elastic + kinetic + friction + viscous, to 1 % at 1e-7 s and 0.05 % at 1e-8 s."""

    def residual(dt_s: float) -> float:
        config = SimConfig(sample=sample, blocks=(30, 30), angle_deg=15.0, seed=2, duration_s=6e-3, dt_s=dt_s)
        lattice = lattice_of(config)
        run = run_fast(config, lattice, thresholds_of(config, lattice))
        return abs(energy_balance(config, lattice, run).residual)

    assert residual(1e-7) < 1e-2
    assert residual(1e-8) < 5e-4


def test_reference_conserves_energy():
    """Through the rupture of a flat and a patterned sample, to 1 %."""
    for sample in ("F", "C"):
        config = SMALL.with_(sample=sample, engine="reference", duration_peaks=1.02)
        lattice = lattice_of(config)
        run = run_reference(config, lattice, thresholds_of(config, lattice), start_share=0.995)
        assert abs(energy_balance(config, lattice, run).residual) < 1e-2


@pytest.mark.slow
def test_sliding_mean_is_that_of_the_reference():
    """Ten seeds of a flat sample over the same window: the means agree within 1 %."""
    config = SimConfig(blocks=(17, 17), angle_deg=20.0, dt_s=1e-8, duration_peaks=1.6, window_end_peaks=1.6)
    means = {
        engine: np.mean([simulate(config.with_(seed=s, engine=engine)).sliding_friction for s in range(10)])
        for engine in ("fast", "reference")
    }
    assert means["fast"] == pytest.approx(means["reference"], rel=1e-2)


def test_a_number_that_is_not_finite_stops_the_run():
    """The message names the time and a block."""
    unstable = SMALL.with_(dt_s=4e-7, duration_peaks=3.0)
    lattice = lattice_of(unstable)
    with pytest.raises(SimulationError, match=r"no longer finite at t = .*x = \d+, y = \d+"):
        run_fast(unstable, lattice, thresholds_of(unstable, lattice))
