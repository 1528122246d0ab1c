"""Rate and state against another code, plain integrations of the same equations, and linear stability."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import odeint

from tribo.errors import SimulationError
from tribo.slider import (
    SliderConfig,
    constant_speed,
    critical_speed_m_s,
    critical_stiffness_N_per_m,
    simulate_slider,
    speed_steps,
    steady_sliding_speed_m_s,
)
from tribo.slider.motion import SliderMachine
from tribo.slider.rate_and_state import friction_path

OTHER_CODE = Path(__file__).resolve().parents[3] / "shared" / "real" / "rate-and-state-other-code" / "cjm_model.tim"
# friction per micrometre, micrometres and seconds, as in rsfmodel and the C code: a load of 1 N and k in N/m
STEP = SliderConfig(
    mass_kg=0.0, stiffness_N_per_m=1e-3 * 1e6, normal_load_N=1.0, law="dieterich",
    values={"mu0": 0.6, "v0_m_s": 1e-6, "a": 0.005, "b": 0.01, "Dc_m": 1e-5},
    drive=speed_steps([0.0, 10.0], [1e-6, 1e-5]), duration_s=40.0, rate_Hz=100.0,
)  # fmt: skip
SECOND = {"b2": 0.001, "Dc2_m": 5e-6}


@pytest.mark.skipif(not OTHER_CODE.exists(), reason="the output of the other code is not here")
def test_a_velocity_step_is_that_of_the_c_code_of_marone_to_the_digits_that_it_prints():
    """Largest difference under 1e-6 of the change of friction; the print has nine digits and a step 1e-7 s late."""
    table = np.genfromtxt(OTHER_CODE, skip_header=2)
    times, printed = np.maximum(table[:, 0], 0.0), table[:, 1]
    unique, back = np.unique(times, return_inverse=True)
    drive = speed_steps([0.0, 1e-13], [1e-6, 1e-5])
    mu, *_ = friction_path(SliderMachine(0.0, 1e3, 0.0, 0.0), STEP.contact(), drive, unique)  # type: ignore[arg-type]
    assert np.abs(mu[back] - printed).max() < 1e-6 * np.ptp(printed)


def plain(config: SliderConfig, times: np.ndarray) -> np.ndarray:
    """Friction by odeint in friction and theta, in micrometres and seconds, with rsfmodel's tolerances of 1e-12."""
    values = {"b2": 0.0, "Dc2_m": 1e-5, **config.values}
    b = [values["b"]] + ([values["b2"]] if values["b2"] else [])
    Dc = [1e6 * values["Dc_m"]] + ([1e6 * values["Dc2_m"]] if values["b2"] else [])
    k, v0, a = 1e-6 * config.stiffness_N_per_m, 1e6 * values["v0_m_s"], values["a"]

    def rates(y, t, load_speed):
        mu, thetas = y[0], y[1:]
        held = sum(bi * math.log(v0 * th / d) for bi, th, d in zip(b, thetas, Dc, strict=True))
        v = v0 * math.exp((mu - 0.6 - held) / a)
        x = [v * th / d for th, d in zip(thetas, Dc, strict=True)]
        grow = [1.0 - xi for xi in x] if config.law == "dieterich" else [-xi * math.log(xi) for xi in x]
        return [k * (load_speed - v), *grow]

    first = 1e6 * config.drive.speeds_m_s[0]
    state = [0.6 + (a - sum(b)) * math.log(first / v0), *(d / first for d in Dc)]
    out = np.empty(times.size)
    knots = [*config.drive.knots_s, times[-1] + 1.0]
    for begin, end, speed in zip(knots, knots[1:], config.drive.speeds_m_s, strict=False):
        inside = (times >= begin) & (times < end)
        asked = np.concatenate([[begin], times[inside], [end]])
        found = odeint(rates, state, asked, args=(1e6 * speed,), rtol=1e-12, atol=1e-12, mxstep=100_000)
        out[inside], state = found[1:-1, 0], found[-1]
    return out


@pytest.mark.parametrize("law", ["dieterich", "ruina"])
@pytest.mark.parametrize("second", [{}, SECOND], ids=["one state", "two states"])
@pytest.mark.parametrize("method", ["fast", "integrated"])
def test_the_velocity_step_of_rsfmodel_is_that_of_a_plain_integration(law: str, second: dict, method: str):
    """Within 1e-8 of the change of friction."""
    # the slip law is unstable against so large a step where the machine is only twice as stiff as critical
    stiffness = STEP.stiffness_N_per_m * (1.0 if law == "dieterich" else 10.0)
    run = simulate_slider(STEP.with_(law=law, method=method, stiffness_N_per_m=stiffness, **second))
    expected = plain(run.config, run.time_s)
    assert np.abs(run.force_N - expected).max() < 1e-8 * np.ptp(expected)


@pytest.mark.parametrize("law", ["dieterich", "ruina"])
def test_slide_hold_slide_is_that_of_a_plain_integration(law: str):
    drive = speed_steps([0.0, 10.0, 110.0], [1e-6, 0.0, 1e-6])
    run = simulate_slider(STEP.with_(law=law, drive=drive, duration_s=150.0, rate_Hz=20.0))
    expected = plain(run.config, run.time_s)
    assert np.abs(run.force_N - expected).max() < 1e-8 * np.ptp(expected)
    assert run.static_friction > 0.6


def test_a_light_slider_moves_as_one_without_inertia():
    light, massless = simulate_slider(STEP.with_(mass_kg=1e-6)), simulate_slider(STEP)
    assert np.abs(light.force_N - massless.force_N).max() < 1e-6 * np.ptp(massless.force_N)


def growth(stiffness: float, load: float, a: float, bs: list[float], Dcs: list[float], mass: float, v: float) -> float:
    """Largest growth rate of a small disturbance of steady sliding, from the eigenvalues of its linear equations."""
    n = len(bs)
    matrix = np.zeros((2 + n, 2 + n))  # position, speed, ln theta_i
    matrix[0, 1] = 1.0
    matrix[1, 0], matrix[1, 1] = -stiffness / mass, -load * a / (v * mass)
    for i, (b, Dc) in enumerate(zip(bs, Dcs, strict=True)):
        matrix[1, 2 + i] = -load * b / mass
        matrix[2 + i, 1], matrix[2 + i, 2 + i] = -1.0 / Dc, -v / Dc
    return float(np.linalg.eigvals(matrix).real.max())


@pytest.mark.parametrize(
    ("bs", "Dcs"), [([0.015], [1e-5]), ([0.012, 0.004], [1e-5, 8e-5]), ([0.02, -0.003], [2e-5, 2e-6])]
)
@pytest.mark.parametrize("mass", [1e-3, 10.0])
def test_disturbances_of_steady_sliding_grow_below_the_critical_stiffness_and_fade_above(
    bs: list[float], Dcs: list[float], mass: float
):
    load, a, v = 10.0, 0.010, 1e-3
    critical = critical_stiffness_N_per_m(load, a, bs, Dcs, mass, v)
    assert growth(critical * (1 - 1e-6), load, a, bs, Dcs, mass, v) > 0
    assert growth(critical * (1 + 1e-6), load, a, bs, Dcs, mass, v) < 0


def test_the_critical_stiffness_of_one_state_is_that_of_rice_and_ruina():
    load, a, b, Dc, m, v = 10.0, 0.010, 0.015, 1e-5, 0.2, 2e-3
    expected = load * (b - a) / Dc * (1 + m * v**2 / (load * a * Dc))
    assert critical_stiffness_N_per_m(load, a, b, Dc, m, v) == pytest.approx(expected, rel=1e-12)
    assert critical_stiffness_N_per_m(load, b, a, Dc, m, v) == 0.0
    assert critical_speed_m_s(expected, load, a, b, Dc, m) == pytest.approx(v, rel=1e-12)
    assert critical_speed_m_s(0.9 * load * (b - a) / Dc, load, a, b, Dc, m) == 0.0


@pytest.mark.parametrize(("share", "grows"), [(0.95, True), (1.05, False)])
def test_a_small_step_of_speed_grows_on_a_machine_softer_than_critical_only(share: float, grows: bool):
    values = {**STEP.values, "a": 0.008, "b": 0.01}
    critical = critical_stiffness_N_per_m(1.0, 0.008, 0.01, 1e-5)
    config = STEP.with_(
        values=values, stiffness_N_per_m=share * critical, drive=speed_steps([0.0, 1.0], [1e-6, 1.001e-6]),
        duration_s=1000.0, rate_Hz=2.0,
    )  # fmt: skip
    force = simulate_slider(config).force_N
    early, late = force[200:700], force[-500:]
    assert (np.ptp(late) > np.ptp(early)) == grows


def test_for_little_damping_the_border_is_that_of_derjaguin():
    zeta, m, k = 1e-5, 0.03, 170.0
    damping = 2.0 * zeta * math.sqrt(k * m)
    expected = 0.02 / math.sqrt(4.0 * math.pi * zeta * k * m)
    assert steady_sliding_speed_m_s(m, k, damping, 0.02) == pytest.approx(expected, rel=1e-3)
    assert steady_sliding_speed_m_s(m, k, 0.0, 0.02) == math.inf
    assert steady_sliding_speed_m_s(m, k, 2.0 * math.sqrt(k * m), 0.02) == 0.0


def test_speed_and_state_fit_the_law_at_every_sample():
    run = simulate_slider(STEP)
    mu = 0.6 + 0.005 * np.log(run.velocity_m_s / 1e-6) + 0.01 * np.log(1e-6 * run.states_s[0] / 1e-5)
    np.testing.assert_allclose(run.force_N, mu, rtol=0, atol=1e-12)
    pace = np.gradient(run.position_m, run.time_s)[1500:]
    np.testing.assert_allclose(pace, run.velocity_m_s[1500:], rtol=1e-4)


def test_a_slider_without_inertia_on_a_machine_too_soft_for_it_is_refused():
    with pytest.raises(SimulationError, match="infinitely fast"):
        simulate_slider(STEP.with_(law="ruina"))


def test_a_drive_that_stands_at_the_start_is_refused():
    with pytest.raises(SimulationError, match="begins in steady sliding"):
        simulate_slider(STEP.with_(drive=constant_speed(0.0)))
