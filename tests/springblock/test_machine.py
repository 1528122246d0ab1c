"""The slider on a machine: a rigid one as its limit, closed form, the readable twin, energy; edges that are pulled."""

from __future__ import annotations

import numpy as np
import pytest
from support import first_quick
from support.energy_balance import energy_balance

from tribo.errors import SimulationError
from tribo.springblock import SimConfig, simulate, write_run
from tribo.springblock.engines.fast import integrate as run_fast
from tribo.springblock.engines.reference import integrate as run_reference
from tribo.springblock.engines.state import Thresholds, lattice_of, thresholds_of

SMALL = SimConfig(blocks=(13, 13), dt_s=2e-8, duration_peaks=1.05, angle_deg=20.0, seed=3)
LAYER = 13 * 13 * SMALL.shear_stiffness_N_m  # N/m: the springs between blocks and slider together
ON_MACHINE = SMALL.with_(machine_stiffness_N_per_m=LAYER)
ELASTIC = {"contact_stiffness_Pa_per_m": 1.2e11, "machine_damping_N_s_per_m": 1e-2}


def test_a_heavy_slider_on_a_soft_machine_sticks_and_slips_as_a_coulomb_slider():
    """Peaks F_s, drops (F_s - F_d) (1 + exp(-pi D / sqrt(1 - D2))) and periods, to 3 %; the first peak to 0.2 %."""
    stiffness, mass, damping, static, sliding = 3e-2, 1e-10, 2e-7, 2.0e-6, 1.6e-6
    config = SMALL.with_(
        blocks=(3, 3), angle_deg=0.0, dt_s=5e-8, machine_stiffness_N_per_m=stiffness, slider_mass_kg=mass,
        machine_damping_N_s_per_m=damping, damping_per_s=0.0, speed_m_s=2e-3, duration_s=0.08, sample_interval_s=2e-6,
    )  # fmt: skip
    run = run_fast(config, lattice_of(config), Thresholds(np.full(9, static / 9), np.full(9, sliding / 9)))
    force, time = run.force_N, run.time_s
    starts = np.flatnonzero((force[:-1] > 0.9 * static) & (force[1:] <= 0.9 * static))
    peaks = np.array([force[max(0, k - 200) : k + 1].max() for k in starts])
    troughs = np.array([force[k : k + 300].min() for k in starts])
    share = damping / (2.0 * np.sqrt(stiffness * mass))
    drop = (static - sliding) * (1.0 + np.exp(-np.pi * share / np.sqrt(1.0 - share**2)))
    period = drop / (stiffness * config.speed_m_s) + np.pi * np.sqrt(mass / stiffness)
    assert len(starts) >= 4
    assert peaks[0] == pytest.approx(static, rel=2e-3)
    assert peaks[0] - troughs[0] == pytest.approx(drop, rel=2e-2)
    assert np.allclose(peaks, static, rtol=2e-2)
    assert np.allclose(peaks - troughs, drop, rtol=3e-2)
    assert np.allclose(np.diff(time[starts]), period, rtol=3e-2)


def test_a_stiffer_machine_comes_closer_to_a_rigid_one():
    """Static friction of a pattern; within 0.02 % of it at a thousand times the stiffness of the layer."""
    base = SMALL.with_(sample="C", duration_peaks=1.5)
    rigid = simulate(base)
    off = []
    for times in (1.0, 30.0, 1000.0):
        machine = {"machine_stiffness_N_per_m": times * LAYER, "slider_mass_kg": 1e-9}
        damping = 0.7 * np.sqrt(times * LAYER * 1e-9)
        run = simulate(base.with_(**machine, machine_damping_N_s_per_m=damping, dt_s=2e-8))
        off.append(abs(run.static_friction / rigid.static_friction - 1))
    assert off[0] > off[1] > off[2]
    assert off[2] < 2e-4


@pytest.mark.parametrize(
    ("sample", "changes"),
    first_quick(
        [("F", {}), ("C", {"rotation": "finite"}), ("C", {}), ("C", ELASTIC), ("A", {"pulled_edge": "trailing"})], 2
    ),
)
def test_readable_twin_has_the_same_peak_and_energy_is_conserved(sample: str, changes: dict[str, object]):
    """With a machine as stiff as the layer: peaks within 0.1 %, the first four blocks, the energy closed to 0.05 %."""
    config = ON_MACHINE.with_(sample=sample, **changes)
    lattice = lattice_of(config)
    thresholds = thresholds_of(config, lattice)
    twin = run_reference(config, lattice, thresholds, start_share=0.995)
    if "rotation" in changes:
        linear = run_reference(config.with_(rotation="small"), lattice, thresholds, start_share=0.995)
        assert twin.peak_N == pytest.approx(linear.peak_N, rel=5e-3)
        return
    fast = run_fast(config, lattice, thresholds)
    assert fast.peak_N == pytest.approx(twin.peak_N, rel=1e-3)
    assert fast.failed[:4].tolist() == twin.failed[:4].tolist()
    for run in (fast, twin):
        assert abs(energy_balance(config, lattice, run).residual) < 5e-4


def test_energy_is_conserved_through_stick_and_slip():
    """Of a machine softer than the layer by a factor of 100, with dampers and without, over several slips."""
    for damping in (0.0, 2e-3):
        config = SMALL.with_(
            sample="B", machine_stiffness_N_per_m=LAYER / 100, machine_damping_N_s_per_m=damping, duration_s=0.3,
            slider_mass_kg=1e-6, dt_s=5e-8, sample_interval_s=1e-5,
        )  # fmt: skip
        lattice = lattice_of(config)
        run = run_fast(config, lattice, thresholds_of(config, lattice))
        after = run.force_N[run.time_s > run.peak_s]
        assert after.min() < 0.8 * run.peak_N
        assert abs(energy_balance(config, lattice, run).residual) < 5e-4


def test_pulling_an_edge_is_the_same_either_way():
    """Springs and friction know no sign: the row that leads at 0 degrees trails at 180, with the same force."""
    base = SMALL.with_(sample="A", angle_deg=0.0, duration_peaks=1.2)
    one = simulate(base.with_(pulled_edge="leading"))
    other = simulate(base.with_(pulled_edge="trailing", angle_deg=180.0))
    assert one.static_friction == pytest.approx(other.static_friction, rel=1e-9)
    assert one.static_friction < simulate(base).static_friction
    assert SMALL.with_(pulled_edge="trailing", angle_deg=-80.0).pulled_side == (1, -1)


def test_a_machine_that_cannot_be_is_refused(tmp_path):
    """A mass without a stiffness, an edge of a lattice without edges, and a slider too light for the step."""
    with pytest.raises(SimulationError, match="needs the stiffness of the machine"):
        SimConfig(slider_mass_kg=1e-6).check()
    with pytest.raises(SimulationError, match="no edge to pull"):
        SimConfig(pulled_edge="leading", edges="periodic").check()
    with pytest.raises(SimulationError, match="stability"):
        SimConfig(machine_stiffness_N_per_m=1e4, slider_mass_kg=1e-12).check()
    with pytest.raises(SimulationError, match="leading or trailing"):
        SimConfig(pulled_edge="left").check()  # type: ignore[arg-type]


def test_the_machine_stands_in_the_file_of_a_run(tmp_path):
    """Stiffness, mass and damping with their units."""
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "run.nc"
    write_run(simulate(ON_MACHINE.with_(duration_peaks=1.2, slider_mass_kg=1e-6, machine_damping_N_s_per_m=1e-3)), path)
    with h5py.File(path) as file:
        found = {name: file.attrs[f"{name}_unit"] for name in file.attrs if f"{name}_unit" in file.attrs}
    assert found["machine_stiffness_N_per_m"] == "N/m"
    assert found["slider_mass_kg"] == "kg"
    assert found["machine_damping_N_s_per_m"] == "N s/m"
