"""Every law of a slider is held to the same contract."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tribo.errors import SimulationError
from tribo.slider import SLIDER_LAWS, SliderConfig, constant_speed, simulate_slider, sinusoid, speed_steps
from tribo.slider.contact_laws import SlipContact, StateContact

VALUES = {
    "coulomb": {"mu_s": 0.36, "mu_d": 0.30, "viscous_N_s_per_m": 0.01},
    "ageing": {"mu_s": 0.31, "mu_d": 0.30, "b": 0.01, "t0_s": 0.05},
    "slip_weakening": {"slip_m": [0.0, 2e-5, 9e-5], "mu": [0.36, 0.32, 0.30]},
    "stribeck": {"mu_s": 0.36, "mu_d": 0.30, "v_s_m_s": 2e-3, "exponent": 2.0, "viscous_N_s_per_m": 0.02},
    "viscous": {"viscous_N_s_per_m": 0.5},
    "adhesion": {"mu_s": 0.3, "mu_d": 0.27, "tau0_s_Pa": 200.0, "tau0_d_Pa": 100.0, "nominal_area_m2": 55e-6},
    "dieterich": {"mu0": 0.6, "v0_m_s": 1e-6, "a": 0.01, "b": 0.012, "Dc_m": 1e-5},
    "ruina": {"mu0": 0.6, "v0_m_s": 1e-6, "a": 0.01, "b": 0.012, "Dc_m": 1e-5, "b2": -0.001, "Dc2_m": 5e-5},
}
ALL = pytest.mark.parametrize("name", SLIDER_LAWS)


def test_every_law_of_the_table_is_tested():
    assert set(VALUES) == set(SLIDER_LAWS)


@ALL
def test_a_law_states_formula_source_and_every_parameter_with_limits(name: str):
    law = SLIDER_LAWS[name]
    assert law.name == name
    assert law.formula.startswith("T")
    assert len(law.source) > 20
    assert set(law.defaults) <= set(law.units)
    for p in law.parameters:
        assert p.text
        assert p.symbol
        assert p.low < p.high
        assert p.unit.replace("^", "") == ("" if p.name == "mu_s" else unit_at_end(p.name))


def unit_at_end(name: str) -> str:
    """The unit that ends the name of a parameter."""
    ends = {"_N_s_per_m": "N s/m", "_m2": "m2", "_Pa": "Pa", "_m_s": "m/s", "_m": "m", "_s": "s"}
    return next((unit for end, unit in ends.items() if name.endswith(end)), "")


@ALL
def test_a_value_outside_its_limits_a_missing_and_an_unknown_one_are_refused_at_once(name: str):
    law = SLIDER_LAWS[name]
    bounded = next(p for p in law.parameters if math.isfinite(p.low))
    required = next((p for p in law.parameters if p.name not in law.defaults and p.name != bounded.name), None)
    below = bounded.low - 1.0
    spoiled = {**VALUES[name], bounded.name: [below] if bounded.name in law.points else below, "nonsense": 1.0}
    if required:
        spoiled.pop(required.name)
    _, problems = law.checked(spoiled)
    found = {(p.kind, p.column) for p in problems}
    assert {("out_of_range", bounded.name), ("unknown_key", "nonsense")} <= found
    assert required is None or ("missing_key", required.name) in found
    _, unclean = law.checked({**VALUES[name], bounded.name: float("nan")})
    assert [p.kind for p in unclean] == ["wrong_value"]


@ALL
def test_all_forces_double_where_load_area_and_viscosity_do(name: str):
    law = SLIDER_LAWS[name]
    values, problems = law.checked(VALUES[name])
    assert problems == []
    twice = {k: 2 * v if k in ("nominal_area_m2", "viscous_N_s_per_m") else v for k, v in values.items()}
    one, two = law.contact(values, 0.3), law.contact(twice, 0.6)
    if isinstance(one, StateContact):
        assert isinstance(two, StateContact)
        assert two.normal_load_N == 2 * one.normal_load_N
        return
    slip, speed = np.array([0.0, 1e-5, 5e-5, 1e-3]), np.array([0.0, 1e-4, 1e-3, 1e-1])
    np.testing.assert_allclose(two.friction_N(slip, speed), 2 * one.friction_N(slip, speed), rtol=1e-14)
    np.testing.assert_allclose(two.threshold_N(slip), 2 * one.threshold_N(slip), rtol=1e-14)


@ALL
def test_the_closed_form_or_the_compiled_method_gives_what_its_readable_twin_gives(name: str):
    if name == "stribeck":  # integrated in either way
        return
    state = isinstance(SLIDER_LAWS[name].contact(SLIDER_LAWS[name].checked(VALUES[name])[0], 1.0), StateContact)
    config = SliderConfig(
        mass_kg=0.0 if state else 0.03, stiffness_N_per_m=900.0 if state else 170.0,
        damping_N_s_per_m=0.0 if state else 0.1, normal_load_N=1.0 if state else 0.3, law=name, values=VALUES[name],
        drive=speed_steps([0.0, 5.0], [2e-6, 1e-5]) if state else constant_speed(3e-3),
        duration_s=20.0 if state else 1.0, rate_Hz=200.0,
    )  # fmt: skip
    fast, slow = simulate_slider(config), simulate_slider(config.with_(method="integrated"))
    assert np.ptp(fast.force_N) > 1e-3 * fast.force_N.max()
    np.testing.assert_allclose(fast.force_N, slow.force_N, rtol=0, atol=2e-9 * np.abs(fast.force_N).max())
    np.testing.assert_allclose(fast.starts_s, slow.starts_s, rtol=0, atol=1e-9)


def test_backlash_under_a_sinusoid_is_the_same_in_closed_form_and_integrated():
    config = SliderConfig(
        values={"mu_s": 0.33, "mu_d": 0.30}, drive=sinusoid(2e-3, 0.5), backlash_m=5e-4, damping_N_s_per_m=0.2,
        duration_s=4.0, rate_Hz=300.0,
    )  # fmt: skip
    fast, slow = simulate_slider(config), simulate_slider(config.with_(method="integrated"))
    assert fast.starts_s.size > 4
    np.testing.assert_allclose(fast.force_N, slow.force_N, rtol=0, atol=1e-9 * fast.force_N.max())
    # while the drive turns round within the gap the spring is slack
    assert (np.abs(fast.force_N - 0.2 * (fast.config.drive.speed_m_s(fast.time_s) - fast.velocity_m_s)) < 1e-12).any()


def test_a_law_that_does_not_exist_is_named_with_the_nearest_one():
    with pytest.raises(SimulationError, match="did you mean coulomb"):
        SliderConfig(law="coulom").check()


def test_points_of_a_law_must_rise_from_zero_and_be_as_many_as_their_values():
    law = SLIDER_LAWS["slip_weakening"]
    assert law.checked({"slip_m": [0.0, 1e-5], "mu": [0.3]})[1]
    assert law.checked({"slip_m": [0.0, 2e-5, 1e-5], "mu": [0.3, 0.3, 0.3]})[1]
    assert law.checked({"slip_m": [1e-5, 2e-5], "mu": [0.3, 0.2]})[1]


def test_static_friction_of_the_ageing_law_grows_with_the_logarithm_of_the_time_stuck():
    contact = SLIDER_LAWS["ageing"].contact(SLIDER_LAWS["ageing"].checked(VALUES["ageing"])[0], 2.0)
    assert isinstance(contact, SlipContact)
    grown = contact.threshold_N(np.array([0.0, 5.0, 500.0]))
    np.testing.assert_allclose(grown, 2.0 * (0.31 + 0.01 * np.log([1.0, 101.0, 10001.0])), rtol=1e-13)
