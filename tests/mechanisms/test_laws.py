"""Exact values of the laws, worked out by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tribo.mechanisms import MECHANISMS
from tribo.mechanisms.mislabelled_specimen import moves
from tribo.mechanisms.record import Forces

from .test_contract import LAWS, base, conditions


def forces(name: str, values: list[float], choice: str = "") -> Forces:
    c = conditions()
    return MECHANISMS[name].law(np.array(values), base(c), c, choice)


def before() -> Forces:
    c = conditions()
    return base(c).forces(c.normal_load_N)


def test_a_pattern_that_is_called_sx_is_not_pattern_s_along_x() -> None:
    m = MECHANISMS["pattern_geometry"]
    directed = conditions()
    own = replace(conditions(), pattern=np.repeat(["F", "B", "Sx"], 16))
    assert m.choices(base(own), directed) == ("B", "S")
    assert m.choices(base(own), own) == ("B", "Sx")
    values = np.array([0.1])
    assert (m.law(values, base(own), own, "S").static_N == m.law(np.zeros(1), base(own), own, "Sx").static_N).all()
    assert m.law(values, base(own), directed, "S").static_N == pytest.approx(
        m.law(values, base(own), own, "Sx").static_N, rel=1e-12
    )


def test_suction_adds_mu_dp_times_the_open_area() -> None:
    extra = forces("suction", [5000.0]).static_N - before().static_N
    assert extra[16:32] == pytest.approx(4.2 * 5000.0 * (1 - 0.651) * 55e-6)
    assert extra[:16] == pytest.approx(0.0)


def test_a_load_error_acts_like_a_mass_on_the_sled() -> None:
    extra = forces("normal_load_error", [0.1])
    assert extra.static_N - before().static_N == pytest.approx(0.1 * base(conditions()).static_mu)
    assert extra.sliding_N - before().sliding_N == pytest.approx(0.1 * base(conditions()).sliding_mu)


def test_hertz_like_friction_grows_with_the_two_thirds_power_of_the_load() -> None:
    c = conditions()
    friction = forces("pressure_dependent_friction", [1 / 3]).static_N - base(c).static_adhesion_N
    assert friction[3] / friction[0] == pytest.approx((1.4 / 0.06) ** (2 / 3))


def test_the_area_lost_is_c_times_the_squared_traction_it_leaves() -> None:
    c, loss = conditions(), 2e-11
    after = forces("contact_area_loss", [loss]).static_N
    kept = after / before().static_N
    assert kept == pytest.approx(1 - loss * (after / (c.area_fraction * c.nominal_area_m2)) ** 2)


def test_a_wire_three_degrees_up_costs_a_fifth_at_mu_near_five() -> None:
    after = forces("pull_angle", [np.radians(3.0)]).static_N[:16] / before().static_N[:16]
    assert after == pytest.approx(1 / (np.cos(np.radians(3.0)) + 4.8 * np.sin(np.radians(3.0))))
    assert after[0] == pytest.approx(0.80, abs=0.005)


def test_the_tilted_sled_leaves_friction_and_loses_adhesion() -> None:
    c, h = conditions(), 0.03
    after = forces("tilt", [h]).static_N
    arm = after / c.normal_load_N * h
    kept = np.clip(3 * (0.5 - arm), 0.0, 1.0)
    b = base(c)
    assert after == pytest.approx(b.static_mu * c.normal_load_N + b.static_adhesion_N * kept)


def test_a_wrong_label_is_the_other_sample_to_the_bit_of_rounding() -> None:
    c = conditions()
    after = forces("mislabelled_specimen", [1.0], "B1 of B behaves as F")
    here = (c.specimen == "B1") & (c.sample == "B")
    mu, adhesion = LAWS["F"][:2]
    assert after.static_N[here] == pytest.approx(mu * c.normal_load_N[here] + adhesion)
    assert np.array_equal(after.static_N[~here], before().static_N[~here])
    assert moves("B1 of B swapped with S2 of Sx") == (("B1", "B", "Sx"), ("S2", "Sx", "B"))
    assert moves("S1 of Sy and Sx swapped with F1 of F") == (("S1", "Sy", "F"), ("S1", "Sx", "F"), ("F1", "F", "Sy"))
    assert moves("S1 of Sx and Sy behaves as B") == (("S1", "Sx", "B"), ("S1", "Sy", "B"))


def test_collapsed_cavities_follow_the_flat_law() -> None:
    c = conditions()
    after = forces("cavity_collapse", [1.0, 1e-3, 0.0]).sliding_N
    assert after == pytest.approx(2.9 * c.normal_load_N + 0.62)


def test_a_rigid_machine_leaves_the_rise_alone_and_equal_springs_halve_it() -> None:
    rise = MECHANISMS["machine_compliance"].rise
    assert rise is not None
    stiffness = np.array([6000.0])
    assert np.array_equal(rise(np.array([0.0]), stiffness, conditions()), stiffness)
    assert rise(np.array([1 / 6000.0]), stiffness, conditions()) == pytest.approx(3000.0)


def test_a_column_of_three_names_is_weighed_name_by_name() -> None:
    from dataclasses import replace

    c = replace(conditions(), columns={"batch": np.array(["a", "b", "c"] * 16), "oven_C": np.array(["70", "80"] * 24)})
    m = MECHANISMS["covariate"]
    assert m.choices(base(c), c) == ("batch is a", "batch is b", "batch is c", "oven_C")
    after = m.law(np.array([0.2]), base(c), c, "batch is b").static_N / base(c).forces(c.normal_load_N).static_N
    assert after[:3] == pytest.approx([1.0, np.exp(0.2), 1.0])
