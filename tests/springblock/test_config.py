"""A configuration is refused before the run, with everything that is wrong with it."""

from __future__ import annotations

import math

import pytest

from tribo.errors import SimulationError
from tribo.records import Pattern
from tribo.springblock import LocalFriction, SimConfig

UM = 1e-6


def kinds(config: SimConfig) -> set[tuple[str, str | None]]:
    with pytest.raises(SimulationError) as refused:
        config.check()
    return {(problem.kind, problem.column) for problem in refused.value.problems}


def test_defaults_are_those_of_the_paper():
    """K_int = 3/4 E l, m = rho l3, and the paper's own time step is stable."""
    config = SimConfig().check()
    assert config.stiffness_N_m == pytest.approx(3.0)
    assert config.shear_stiffness_N_m == pytest.approx(3.0)
    assert config.mass_kg == pytest.approx(1.265e-13)
    assert 1e-7 < config.largest_dt_s < 1.6e-7


def test_all_faults_are_listed_at_once():
    """A negative pressure, a NaN, an unknown choice, an unknown sample and an unstable step come back together."""
    config = SimConfig(
        sample="Q", pressure_Pa=-1.0, angle_deg=math.nan, normal_force="none", dt_s=1e-3,
        friction=LocalFriction(mu_s=math.inf), window_end_peaks=1.01,
    )  # fmt: skip
    assert kinds(config) == {
        ("not_positive", "pressure_Pa"),
        ("not_finite", "angle_deg"),
        ("unknown_choice", "normal_force"),
        ("not_finite", "mu_s"),
        ("unknown_sample", "sample"),
        ("unstable_step", "dt_s"),
        ("empty_window", "window_end_peaks"),
    }  # fmt: skip


def test_a_step_beyond_stability_is_refused_with_the_limit():
    """The message says how large the step may be."""
    with pytest.raises(SimulationError, match=r"at most 1\.5"):
        SimConfig(dt_s=2e-7).check()


@pytest.mark.parametrize(
    ("pattern", "kind"),
    [
        (Pattern("P", "square", (20 * UM, 20 * UM), (15 * UM, 30 * UM)), "impossible_geometry"),
        (Pattern("P", "square", (1 * UM, 1 * UM), (15 * UM, 30 * UM)), "too_coarse"),
        (Pattern("P", "square", (500 * UM, 20 * UM), (600 * UM, 30 * UM)), "too_small"),
        (Pattern("P", "circle"), "no_geometry"),
    ],
)
def test_impossible_cavities_are_refused(pattern: Pattern, kind: str):
    """Cavities that overlap, are finer than the mesh or larger than the domain, or have no size."""
    assert kind in {k for k, _ in kinds(SimConfig(sample="P", pattern=pattern))}


def test_a_sample_without_pattern_is_refused():
    """A name the paper does not know needs a pattern."""
    assert kinds(SimConfig(sample="Q")) == {("unknown_sample", "sample")}


def test_periodic_edges_want_whole_periods():
    """85 blocks hold no whole number of the four-block pitch of A; 84 do."""
    assert ("impossible_geometry", "blocks") in kinds(SimConfig(sample="A", edges="periodic"))
    SimConfig(sample="A", edges="periodic", blocks=(84, 84)).check()


def test_parameters_carry_every_number_of_the_run():
    """The flat mapping holds the local friction and the geometry beside the plain fields."""
    flat = SimConfig(sample="Sx").parameters()
    assert flat["friction_mu_s"] == 5.5
    assert flat["cavity_size_m"] == pytest.approx((200e-6, 40e-6))
    assert flat["thickness_m"] == 5e-6
