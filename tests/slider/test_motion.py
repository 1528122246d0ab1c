"""Exact facts of a slider on a machine: closed forms of its cycles, its energy, and its border of stick-slip."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
from scipy.integrate import simpson
from scipy.optimize import brentq

from tribo.errors import SimulationError
from tribo.slider import (
    SliderConfig,
    constant_speed,
    recorded_displacement,
    simulate_slider,
    sinusoid,
    slide_hold_slide,
    speed_steps,
    steady_sliding_speed_m_s,
)
from tribo.slider.oscillator import first_fall

COULOMB = SliderConfig(
    mass_kg=0.0307, stiffness_N_per_m=168.0, normal_load_N=0.3011, values={"mu_s": 0.33, "mu_d": 0.30}, rate_Hz=4000.0
)


@pytest.mark.parametrize("speed", [1e-5, 42e-6, 1.1e-3])
def test_a_coulomb_cycle_has_the_drop_period_slope_and_slip_of_its_closed_form(speed: float):
    """Drop 2 (mu_s - mu_d) N, slope k v, slip (2/w)(pi - atan(dF/(v sqrt(km)))), period 2 dF/(k v) + slip: to 1e-9."""
    config = COULOMB
    m, k, load = config.mass_kg, config.stiffness_N_per_m, config.normal_load_N
    excess = 0.03 * load
    slip = 2.0 / math.sqrt(k / m) * (math.pi - math.atan(excess / (speed * math.sqrt(k * m))))
    period = 2.0 * excess / (k * speed) + slip
    duration = 0.33 * load / (k * speed) + 4.5 * period
    run = simulate_slider(config.with_(drive=constant_speed(speed), duration_s=duration))
    assert run.starts_s.size == 5
    np.testing.assert_allclose(np.diff(run.starts_s), period, rtol=1e-9)
    np.testing.assert_allclose(run.stops_s - run.starts_s[: run.stops_s.size], slip, rtol=1e-9)
    inside = run.stuck & (run.time_s > run.starts_s[0])
    place = run.config.drive.position_m(run.stops_s)
    rest = [run.position_m[np.flatnonzero(inside & (run.time_s >= t))[0]] for t in run.stops_s]
    np.testing.assert_allclose(k * (place - rest), (0.33 - 2 * 0.03) * load, rtol=1e-9)
    both = inside[1:] & inside[:-1] & (np.diff(run.position_m) == 0.0)
    np.testing.assert_allclose(np.diff(run.force_N)[both] * config.rate_Hz, k * speed, rtol=1e-9)


@pytest.mark.parametrize("zeta", [0.003, 0.05, 0.4])
@pytest.mark.parametrize("viscous", [0.0, 0.7])
def test_a_damped_coulomb_slider_sticks_again_just_below_its_border_and_never_just_above(zeta: float, viscous: float):
    """Within 1e-6 of the speed, wherever the damping sits."""
    config = COULOMB
    damping = 2.0 * zeta * math.sqrt(config.mass_kg * config.stiffness_N_per_m)
    border = steady_sliding_speed_m_s(config.mass_kg, config.stiffness_N_per_m, damping, 0.03 * config.normal_load_N)
    config = config.with_(
        damping_N_s_per_m=(1 - viscous) * damping, viscous_N_s_per_m=viscous * damping, duration_s=6.0, rate_Hz=10.0
    )
    below = simulate_slider(config.with_(drive=constant_speed(border * (1 - 1e-6))))
    above = simulate_slider(config.with_(drive=constant_speed(border * (1 + 1e-6))))
    assert below.starts_s.size > 3
    assert (above.starts_s.size, above.stops_s.size) == (1, 0)


def segment(m: float, stiffness: float, p0: float, p1: float, x0: float, v0: float):
    """Position and speed under m x'' + K x = p0 + p1 t, with the complex roots of m r^2 + K = 0."""
    r = cmath.sqrt(-stiffness / m)
    shift, pace = x0 - p0 / stiffness, v0 - p1 / stiffness
    up, down = (shift + pace / r) / 2, (shift - pace / r) / 2

    def at(t):
        t = np.asarray(t, float)
        grow, fall = up * np.exp(r * t), down * np.exp(-r * t)
        return (grow + fall).real + (p0 + p1 * t) / stiffness, (r * (grow - fall)).real + p1 / stiffness

    return at


def test_slip_weakening_after_strengthening_follows_its_analytic_solution():
    """Two weakening pieces after a strengthening one, as in Bolotskaya and Hager (2022): path and arrest to 1e-9."""
    m, k, load, speed = 0.03, 170.0, 0.3, 2e-3
    slips, mu = [0.0, 3e-5, 8e-5, 4e-4], [0.30, 0.34, 0.31, 0.25]
    run = simulate_slider(
        SliderConfig(m, k, 0.0, load, "slip_weakening", {"slip_m": slips, "mu": mu}, constant_speed(speed),
                     duration_s=0.4, rate_Hz=20000.0)
    )  # fmt: skip
    t, x, v = mu[0] * load / (k * speed), 0.0, 0.0
    assert run.starts_s[0] == pytest.approx(t, rel=1e-12)
    for i in range(4):
        slope = (mu[i + 1] - mu[i]) / (slips[i + 1] - slips[i]) * load if i < 3 else 0.0
        path = segment(m, k + slope, k * speed * t - mu[i] * load + slope * slips[i], k * speed, x, v)
        scan = np.linspace(1e-9, 0.2, 400_001)
        reached = path(scan)[0] > slips[i + 1] if i < 3 else path(scan)[1] < 0
        j = int(np.argmax(reached))
        goal = (lambda s, p=path, to=slips[i + 1]: p(s)[0] - to) if i < 3 else (lambda s, p=path: p(s)[1])
        end = brentq(goal, scan[j - 1], scan[j], xtol=1e-16)
        inside = (run.time_s > t) & (run.time_s < t + end)
        np.testing.assert_allclose(run.position_m[inside], path(run.time_s[inside] - t)[0], atol=1e-9 * slips[-1])
        x, v, t = float(path(end)[0]), float(path(end)[1]), t + end
    assert run.stops_s[0] == pytest.approx(t, rel=1e-9)
    arrested = np.flatnonzero(run.time_s > t)[0]
    assert run.position_m[arrested] == pytest.approx(x, rel=1e-9)


def test_work_of_the_drive_is_stored_damped_and_rubbed_away():
    """Energy balance over slips of a damped slider with viscous friction, to 1e-7 of the work."""
    m, k, c, load, eta = 0.03, 170.0, 0.15, 0.3, 0.1
    config = SliderConfig(
        m, k, c, load, "coulomb", {"mu_s": 0.36, "mu_d": 0.3, "viscous_N_s_per_m": eta}, constant_speed(2e-3),
        duration_s=2.0, rate_Hz=100_000.0,
    )  # fmt: skip
    run = simulate_slider(config)
    assert run.starts_s.size > 5
    t, v = run.time_s, run.velocity_m_s
    stretch = run.drive_m - run.position_m
    work = simpson(run.force_N * 2e-3, x=t)
    stored = 0.5 * k * stretch[-1] ** 2 + 0.5 * m * v[-1] ** 2
    damped = simpson(c * (2e-3 - v) ** 2 + eta * v**2, x=t)
    rubbed = 0.3 * load * run.position_m[-1]
    assert stored + damped + rubbed == pytest.approx(work, rel=1e-7)


def test_a_slip_begins_where_the_pull_reaches_what_the_time_stuck_has_made_of_static_friction():
    """After slides and holds of 10, 100 and 1000 s: mu_s + b ln(1 + t / t0), to 1e-9."""
    config = COULOMB.with_(
        law="ageing", values={"mu_s": 0.32, "mu_d": 0.31, "b": 0.008, "t0_s": 0.01}, damping_N_s_per_m=0.3,
        drive=slide_hold_slide(1e-4, 20.0, [10.0, 100.0, 1000.0]), duration_s=1200.0, rate_Hz=20.0,
    )  # fmt: skip
    run = simulate_slider(config)
    before = np.searchsorted(run.time_s, run.starts_s) - 1
    stuck = run.stuck[before]
    stretch = run.config.drive.position_m(run.starts_s) - run.position_m[before]
    pull = config.stiffness_N_per_m * stretch + 0.3 * 1e-4
    rest = run.starts_s - np.concatenate([[0.0], run.stops_s[: run.starts_s.size - 1]])
    np.testing.assert_allclose(
        pull[stuck], config.normal_load_N * (0.32 + 0.008 * np.log1p(rest[stuck] / 0.01)), rtol=1e-9
    )
    assert (rest[stuck] > 1000.0).sum() == 1


def test_a_recorded_displacement_of_constant_speed_is_that_drive():
    t = np.linspace(0.0, 5.0, 101)
    by_record = simulate_slider(COULOMB.with_(drive=recorded_displacement(t + 3.0, 1e-3 * t + 0.2), duration_s=4.0))
    by_speed = simulate_slider(COULOMB.with_(drive=constant_speed(1e-3), duration_s=4.0))
    np.testing.assert_allclose(by_record.force_N, by_speed.force_N, rtol=0, atol=1e-9)


def test_a_drive_backwards_mirrors_the_force():
    forth = simulate_slider(COULOMB.with_(drive=constant_speed(1e-3), duration_s=3.0))
    back = simulate_slider(COULOMB.with_(drive=constant_speed(-1e-3), duration_s=3.0))
    np.testing.assert_array_equal(forth.force_N, -back.force_N)


def test_steady_sliding_from_the_start_stays_steady():
    run = simulate_slider(COULOMB.with_(begins_sliding=True, damping_N_s_per_m=0.1, duration_s=5.0))
    np.testing.assert_allclose(run.force_N, 0.30 * 0.3011, rtol=1e-10)


def test_a_viscous_slider_follows_the_drive_with_its_lag():
    run = simulate_slider(COULOMB.with_(law="viscous", values={"viscous_N_s_per_m": 20.0}, duration_s=4.0))
    assert run.force_N[-1] == pytest.approx(20.0 * 1e-4, rel=1e-9)


def test_a_sinusoid_too_small_to_break_the_contact_leaves_the_slider_at_rest():
    amplitude = 0.33 * 0.3011 / 168.0
    stays = simulate_slider(COULOMB.with_(drive=sinusoid(0.999999 * amplitude, 2.0), duration_s=3.0))
    goes = simulate_slider(COULOMB.with_(drive=sinusoid(1.000001 * amplitude, 2.0), duration_s=3.0))
    assert stays.starts_s.size == 0
    assert stays.stuck.all()
    assert goes.starts_s.size > 0


def test_everything_that_is_wrong_with_a_slider_is_said_at_once():
    config = COULOMB.with_(mass_kg=0.0, stiffness_N_per_m=-1.0, rate_Hz=math.inf, mu_s="much", mu_x=1.0, method="slow")
    with pytest.raises(SimulationError) as refused:
        config.check()
    assert {p.column for p in refused.value.problems} == {"stiffness_N_per_m", "rate_Hz", "mu_s", "mu_x", "method"}
    with pytest.raises(SimulationError, match="inertia"):
        COULOMB.with_(mass_kg=0.0).check()


@pytest.mark.parametrize(("times", "speeds"), [([0.0, 0.0], [1.0, 2.0]), ([1.0], [1.0]), ([0.0, 1.0], [1.0]), ([], [])])
def test_steps_of_speed_that_do_not_rise_from_zero_are_refused(times: list[float], speeds: list[float]):
    with pytest.raises(SimulationError, match="rise from 0"):
        speed_steps(times, speeds)


def test_equal_seeds_draw_equal_noise():
    one, same, other = (simulate_slider(COULOMB.with_(noise_N=1e-3, seed=s, duration_s=1.0)).force_N for s in (4, 4, 5))
    np.testing.assert_array_equal(one, same)
    assert (one != other).all()


def test_a_start_at_zero_whose_slope_is_negative_by_rounding_alone_is_no_fall():
    grid = np.linspace(0.0, 1e-3, 5)
    assert first_fall(lambda t: t * t - 1e-20 * t, lambda t: 2 * t - 1e-20, grid) == math.inf
    assert first_fall(lambda t: t * t - 1e-4 * t, lambda t: 2 * t - 1e-4, grid) == 0.0
