"""Contact of finite stiffness: closed forms, the readable twin, energy, and a mesh that stops to matter."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import minimize_scalar
from support.energy_balance import energy_balance

from tribo.errors import SimulationError
from tribo.records import Pattern
from tribo.springblock import LocalFriction, SimConfig, simulate
from tribo.springblock.engines.fast import integrate as run_fast
from tribo.springblock.engines.reference import integrate as run_reference
from tribo.springblock.engines.state import Thresholds, lattice_of, thresholds_of
from tribo.springblock.lattice import make_lattice

KAPPA = 1.2e11  # Pa/m, K_s / l2 at the defaults
ELASTIC = SimConfig(blocks=(17, 17), dt_s=1e-8, duration_peaks=1.02, angle_deg=20.0, seed=3)
ELASTIC = ELASTIC.with_(contact_stiffness_Pa_per_m=KAPPA)


@pytest.mark.parametrize("angle_deg", [0.0, 35.0])
def test_one_block_yields_slips_and_is_bound_again_as_in_closed_form(angle_deg: float):
    """The force at which it yields, its way while it slides and after it is bound again, to 1e-6, without damping."""
    config = ELASTIC.with_(blocks=(1, 1), angle_deg=angle_deg, dt_s=1e-10, damping_per_s=0.0)
    lattice = lattice_of(config)
    static, sliding = 2.0e-6, 1.2e-6
    local = Thresholds(np.array([static]), np.array([sliding]))
    spring, bond, slider = config.shear_stiffness_N_m, config.bond_stiffness_N_m, config.speed_m_s
    w = slider * spring / (spring + bond)
    yields = static / bond / w

    def way(t: float, force: float, stiffness: float, speed: float) -> float:
        """From rest under a force against springs, while the slider's pull grows with its way."""
        creep, ring = slider * spring / stiffness, math.sqrt(stiffness / config.mass_kg)
        settled = force / stiffness
        return creep * t + settled * (1.0 - math.cos(ring * t)) + (speed - creep) / ring * math.sin(ring * t)

    def at(t: float) -> tuple[float, float]:
        """Time since the first step that sees the yielding, half a step after it, and the way since then."""
        run = run_fast(config.with_(duration_s=yields + t), lattice, local)
        assert run.first_failure_s == pytest.approx(yields, rel=1e-9)
        assert run.peak_N == pytest.approx(spring * (slider - w) * yields, rel=1e-6)
        return run.end_s - yields - 0.5 * config.dt_s, float(np.hypot(*run.displacement_m[0])) - static / bond

    t, found = at(0.3e-6)
    assert found == pytest.approx(way(t, static - sliding, spring, w), rel=1e-6)
    rest = minimize_scalar(lambda t: -way(t, static - sliding, spring, w), (0.5e-6, 0.7e-6), tol=1e-12)
    t, found = at(1.0e-6)
    top, left = -float(rest.fun), static - spring * -float(rest.fun) + spring * slider * float(rest.x) - sliding
    assert found == pytest.approx(top + way(t - float(rest.x), left, spring + bond, 0.0), rel=1e-6)


def test_two_blocks_share_the_load_as_in_closed_form():
    """A cavity beside one contact: the time of yielding from two equations, and T at that time, to 1e-6."""
    config = ELASTIC.with_(blocks=(2, 1), angle_deg=0.0, dt_s=1e-9)
    stiffness, bond, link = config.shear_stiffness_N_m, config.bond_stiffness_N_m, config.stiffness_N_m
    lattice = make_lattice(np.array([[False, True]]), stiffness / link, False, bond / link)
    static = 2.0e-6
    own = np.array([[stiffness + link, -link], [-link, stiffness + link + bond]])
    w = np.linalg.solve(own, stiffness * config.speed_m_s * np.ones(2))
    lag = np.linalg.solve(own, config.mass_kg * config.damping_per_s * w)
    yields = (static / bond + lag[1]) / w[1]
    run = run_fast(
        config.with_(duration_s=yields + 1e-6), lattice, Thresholds(np.array([0.0, static]), np.array([0.0, 1.2e-6]))
    )
    assert run.first_failure_s == pytest.approx(yields, rel=1e-6)
    expected = stiffness * float((config.speed_m_s * yields - w * yields + lag).sum())
    assert run.peak_N == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("kappa", [3e10, 1.2e11, 5e11])
def test_stress_beside_an_edge_falls_over_the_elastic_length(kappa: float):
    """Along a straight edge, lengths l sqrt(K / 2 (K_s + k)) in contact and l sqrt(K / 2 K_s) beside it, to 1 %."""
    config = SimConfig(blocks=(320, 3), spacing_m=0.25e-6, thickness_m=5e-6, edges="periodic", angle_deg=90.0)
    stiffness, bond = config.shear_stiffness_N_m, kappa * config.spacing_m**2
    mask = np.arange(320) >= 160
    lattice = make_lattice(np.tile(mask, (3, 1)), stiffness / config.stiffness_N_m, True, bond / config.stiffness_N_m)
    u = lattice.follow[320:640, 1, 1]  # of the middle row, per slider
    inside = config.spacing_m * math.sqrt(0.5 * config.stiffness_N_m / (stiffness + bond))
    outside = config.spacing_m * math.sqrt(0.5 * config.stiffness_N_m / stiffness)
    far = stiffness / (stiffness + bond)
    edge = (far / inside + 1.0 / outside) / (1.0 / inside + 1.0 / outside)
    x = (np.arange(160) + 0.5) * config.spacing_m
    expected = far + (edge - far) * np.exp(-x / inside)
    near = slice(0, 60)  # there is an edge at the other side as well
    assert np.abs(u[160:][near] / expected[near] - 1).max() < 1e-2


@pytest.mark.parametrize(("sample", "kappa"), [("F", KAPPA), ("A", KAPPA), ("C", KAPPA), ("C", 3e10)])
def test_readable_twin_has_the_same_peak_and_first_failures(sample: str, kappa: float):
    """Static friction within 0.1 % of Runge-Kutta on all blocks, and the same five blocks yield first."""
    config = ELASTIC.with_(sample=sample, contact_stiffness_Pa_per_m=kappa, dt_s=2e-8)
    lattice = lattice_of(config)
    thresholds = thresholds_of(config, lattice)
    fast = run_fast(config, lattice, thresholds)
    reference = run_reference(config, lattice, thresholds, start_share=0.995)
    assert fast.peak_N == pytest.approx(reference.peak_N, rel=1e-3)
    assert fast.failed[:5].tolist() == reference.failed[:5].tolist()
    for run in (fast, reference):
        assert abs(energy_balance(config, lattice, run).residual) < 5e-4


def test_energy_is_conserved_while_contacts_yield_and_are_bound_again():
    """Work of the slider = elastic + bonds + kinetic + friction + viscous, to 0.05 % at 1e-8 s, through sliding."""
    config = ELASTIC.with_(sample="C", blocks=(24, 24), duration_peaks=1.4)
    lattice = lattice_of(config)
    run = run_fast(config, lattice, thresholds_of(config, lattice))
    assert run.moving.max() > 0
    assert abs(energy_balance(config, lattice, run).residual) < 5e-4


def test_contact_grows_rigid_with_its_stiffness():
    """Static friction of a pattern falls towards that of rigid contact, within 3 % of it at 300 K_s / l2."""
    base = SimConfig(sample="B", blocks=(17, 17), seed=3, angle_deg=20.0, duration_peaks=1.06, dt_s=1e-8)
    peaks = [
        simulate(base.with_(contact_stiffness_Pa_per_m=kappa)).static_friction
        for kappa in (KAPPA, 10 * KAPPA, 300 * KAPPA)
    ]
    rigid = simulate(base).static_friction
    assert peaks[0] > peaks[1] > peaks[2]
    assert peaks[2] == pytest.approx(rigid, rel=0.03)


def test_patches_of_friction_are_the_same_on_every_mesh():
    """Each block of a patch has the coefficients of the one block that it is on the coarse mesh, also at a cut edge."""
    coarse = SimConfig(blocks=(9, 7), spacing_m=5e-6, friction_patch_m=5e-6, seed=4)
    fine = coarse.with_(blocks=(17, 14), spacing_m=2.5e-6, thickness_m=5e-6)
    of_coarse, of_fine = (thresholds_of(c, lattice_of(c)) for c in (coarse, fine))
    for one, other in ((of_coarse.static_N, of_fine.static_N), (of_coarse.sliding_N, of_fine.sliding_N)):
        y, x = np.divmod(np.arange(17 * 14), 17)
        np.testing.assert_allclose(4.0 * other, one[(y // 2) * 9 + x // 2], rtol=1e-12)


def test_patches_of_one_block_are_the_draws_of_the_paper():
    """To the bit, as is the default."""
    plain = SimConfig(sample="C", blocks=(18, 15), seed=4)
    patched = plain.with_(friction_patch_m=plain.spacing_m)
    lattice = lattice_of(plain)
    assert np.array_equal(thresholds_of(patched, lattice).static_N, thresholds_of(plain, lattice).static_N)


@pytest.mark.parametrize("patch_m", [7e-6, 1e-9, -5e-6])
def test_patches_that_cut_blocks_are_refused(patch_m: float):
    with pytest.raises(SimulationError, match="friction_patch_m"):
        SimConfig(friction_patch_m=patch_m).check()


@pytest.mark.parametrize(("sample", "pressure_Pa"), [("B", 3e3), ("C", 25e3)])
def test_halving_the_mesh_moves_a_patch_little(sample: str, pressure_Pa: float):
    """From 2.5 to 1.25 um, blocks of equal friction: static friction by less than 2 %, sliding by less than 1 %."""
    found = []
    for spacing_um in (2.5, 1.25):
        n = round(65 / spacing_um)
        config = SimConfig(
            sample=sample, pressure_Pa=pressure_Pa, blocks=(n, n), spacing_m=spacing_um * 1e-6, thickness_m=5e-6,
            dt_s=2e-8 * spacing_um, angle_deg=30.0, duration_peaks=1.5, contact_stiffness_Pa_per_m=3e10,
            friction=LocalFriction(mu_s_sd=0.0, mu_d_sd=0.0), rest_tolerance=1e-2,
        )  # fmt: skip
        found.append(simulate(config))
    coarse, fine = found
    assert fine.static_friction == pytest.approx(coarse.static_friction, rel=0.02)
    assert fine.sliding_friction == pytest.approx(coarse.sliding_friction, rel=0.01)


@pytest.mark.parametrize(
    ("sample", "static", "sliding"),
    [("A", 6.185841855087817, 3.993907474339108), ("Sx", 4.941743739681074, 3.729293750770858)],
)
def test_rigid_contact_is_the_default_with_its_numbers_kept(sample: str, static: float, sliding: float):
    """The numbers from before contact had a stiffness, to rounding on other processors."""
    run = simulate(SimConfig(sample=sample, blocks=(45, 45), angle_deg=17.0, duration_peaks=1.5, seed=7))
    assert run.static_friction == pytest.approx(static, rel=1e-9)
    assert run.sliding_friction == pytest.approx(sliding, rel=1e-6)


def test_contact_that_is_too_stiff_for_the_step_is_refused_with_the_step_it_needs():
    """And a stiffness that is none."""
    with pytest.raises(SimulationError, match=r"at most 4\.3e-08"):
        SimConfig(contact_stiffness_Pa_per_m=1e13).check()
    with pytest.raises(SimulationError, match="contact_stiffness_Pa_per_m"):
        SimConfig(contact_stiffness_Pa_per_m=-1.0).check()


def test_a_pattern_of_its_own_has_elastic_contact_as_well():
    """With ageing contacts, on a lattice that repeats."""
    pattern = Pattern("G", "rectangle", (20e-6, 10e-6), (40e-6, 20e-6), staggered=True)
    config = SimConfig(sample="G", pattern=pattern, edges="periodic", blocks=(16, 16), duration_peaks=1.5)
    run = simulate(config.with_(contact_stiffness_Pa_per_m=KAPPA))
    assert simulate(config).static_friction < run.static_friction
