"""Every mechanism of the table is held to the same contract."""

from __future__ import annotations

import numpy as np
import pytest

from tribo.mechanisms.record import Base, Conditions, Mechanism, Values
from tribo.mechanisms.table import MECHANISMS, NAMES, mechanism

LAWS = {"F": (4.8, 1.29, 2.9, 0.62), "B": (4.2, 0.59, 3.0, 0.38), "Sx": (3.7, 0.69, 2.95, 0.47)}
ALL = pytest.mark.parametrize("m", MECHANISMS.values(), ids=list(MECHANISMS))


def conditions() -> Conditions:
    """Forty-eight pulls of three samples at four loads, everything recorded and varied."""
    rng = np.random.default_rng(7)
    samples = np.repeat(["F", "B", "Sx"], 16)
    n = len(samples)
    number = np.tile(np.repeat([1, 2], 8), 3)
    return Conditions(
        normal_load_N=np.tile([0.06, 0.25, 0.6, 1.4], n // 4),
        nominal_area_m2=55e-6,
        area_fraction=np.repeat([1.0, 0.651, 0.697], 16),
        rim_per_m=np.repeat([0.0, 1.4e5, 1.8e4], 16),
        cavity_width_m=np.repeat([0.0, 1e-5, 4e-5], 16),
        elongation=np.repeat([0.0, 0.0, np.log(5.0)], 16),
        sample=samples,
        specimen=np.array([f"{s[0]}{k}" for s, k in zip(samples, number, strict=True)]),
        speed_m_s=np.tile([5e-5, 2e-4, 8e-4], n // 3),
        hold_s=np.tile([1.0, 10.0, 300.0], n // 3),
        specimen_run=np.tile(np.arange(1.0, 9.0), n // 8),
        run_order=np.arange(1.0, n + 1),
        elapsed_s=420.0 * np.arange(n),
        temperature_C=rng.normal(23.0, 1.0, n),
        humidity_pct=rng.normal(50.0, 4.0, n),
        clip_N=np.full(n, 0.02),
        columns={"operator": np.where(np.arange(n) % 2 == 0, "ann", "bo")},
    )


def base(c: Conditions) -> Base:
    rows = np.array([LAWS[s] for s in c.sample])
    return Base(*rows.T, by_sample=LAWS, flat="F")


def first_choice(m: Mechanism, b: Base, c: Conditions) -> str:
    return m.choices(b, c)[0]


def change(m: Mechanism, values: Values) -> np.ndarray:
    c = conditions()
    b = base(c)
    after, before = m.law(values, b, c, first_choice(m, b, c)), b.forces(c.normal_load_N)
    return np.column_stack([after.static_N - before.static_N, after.sliding_N - before.sliding_N])


def test_the_table_names_every_mechanism_by_its_own_name() -> None:
    assert tuple(MECHANISMS) == NAMES == tuple(m.name for m in MECHANISMS.values())


def test_an_unknown_name_is_refused_with_those_there_are() -> None:
    with pytest.raises(KeyError, match="suction"):
        mechanism("sucktion")
    assert mechanism("covariate:operator").name == "covariate"


@ALL
def test_zero_amplitude_is_the_baseline_to_the_bit(m: Mechanism) -> None:
    assert np.array_equal(change(m, m.zero()), np.zeros((48, 2)))


@ALL
def test_a_clear_amplitude_acts_in_the_declared_sign_and_regimes(m: Mechanism) -> None:
    moved = change(m, m.start())
    if m.sign != 0 and m.regimes != ("rise",):
        assert (m.sign * moved >= -1e-12).all()
    assert moved[:, 0].any() == ("static" in m.regimes)
    assert moved[:, 1].any() == ("sliding" in m.regimes)


@ALL
def test_values_start_inside_their_bounds_and_say_their_units(m: Mechanism) -> None:
    low, high = m.bounds()
    assert m.parameters[0].amplitude
    assert not any(p.amplitude for p in m.parameters[1:])
    assert ((low <= m.start()) & (m.start() <= high)).all()
    assert ((low <= m.zero()) & (m.zero() <= high)).all()
    assert all(p.text and p.name for p in m.parameters)
    assert all((m.formula, m.separates, m.shows, m.enters, m.confused_with, m.silenced_by))


@ALL
def test_the_law_is_finite_positive_and_smooth_from_the_start(m: Mechanism) -> None:
    """Central differences of two widths agree, so that a fit may follow the gradient."""
    c = conditions()
    b = base(c)
    choice = first_choice(m, b, c)
    for k, p in enumerate(m.parameters):
        slopes = []
        for h in (1e-3 * abs(p.start), 2e-3 * abs(p.start)):
            step = np.zeros(len(m.parameters))
            step[k] = h
            up, down = (m.law(m.start() + sign * step, b, c, choice).static_N for sign in (1, -1))
            assert (up > 0).all()
            slopes.append((up - down) / (2 * h))
        assert np.allclose(*slopes, rtol=2e-2, atol=1e-6 * np.abs(slopes[0]).max() + 1e-12) or m.name == "tilt"


@ALL
def test_a_mechanism_needs_columns_that_conditions_have(m: Mechanism) -> None:
    c = conditions()
    assert all(hasattr(c, name) for name in m.needs)
    assert m.applies(c) or m.name == "sampling_clip"


def test_what_does_not_vary_does_not_apply() -> None:
    from dataclasses import replace

    one_speed = replace(conditions(), speed_m_s=np.full(48, 2e-4))
    assert not MECHANISMS["velocity_dependence"].applies(one_speed)
    unrecorded = replace(conditions(), humidity_pct=np.full(48, np.nan))
    assert not MECHANISMS["humidity"].applies(unrecorded)
