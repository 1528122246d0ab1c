"""Contract of every friction law in the table, and exact values of each."""

from __future__ import annotations

import inspect
from collections.abc import Callable

import numpy as np
import pint
import pytest
from hypothesis import given, strategies as st
from other_fits import POWER_LAWS

from tribo.laws import LAWS, Law

every_law = pytest.mark.parametrize("law", {**LAWS, **POWER_LAWS}.values(), ids=[*LAWS, *POWER_LAWS])

CONDITIONS = {
    "normal_load_N": np.array([0.06, 0.3, 1.4]),
    "nominal_area_m2": 55e-6,
    "area_fraction": np.array([0.95, 0.56, 1.0]),
    "reference_pressure_Pa": 10e3,
}
UNITS = {"normal_load_N": "N", "nominal_area_m2": "m^2", "area_fraction": "", "reference_pressure_Pa": "Pa"}
PARAMETERS = {"mu": 4.8, "tau0_Pa": -2.3e3, "a_Pa": 18e3, "b_Pa": 5e3, "mu_ref": 3.1, "n": 0.27, "T0_N": 0.12}
EVERY = {**LAWS, **POWER_LAWS}


def conditions(law: Law) -> list[object]:
    return [CONDITIONS[name] for name in law.conditions]


def parameters(law: Law) -> list[float]:
    return [PARAMETERS[p.name] for p in law.parameters]


@every_law
def test_the_record_names_the_arguments_of_its_functions(law: Law) -> None:
    expected = [*law.conditions] + [p.name for p in law.parameters]
    assert list(inspect.signature(law.function).parameters) == expected
    assert list(inspect.signature(law.gradient).parameters) == expected
    assert all(p.low < PARAMETERS[p.name] < p.high for p in law.parameters)


@every_law
def test_the_gradient_equals_central_differences(law: Law) -> None:
    given_values = parameters(law)
    for k, slope in enumerate(law.gradient(*conditions(law), *given_values)):
        step = 1e-6 * abs(given_values[k])
        up, down = list(given_values), list(given_values)
        up[k] += step
        down[k] -= step
        rise = law.function(*conditions(law), *up) - law.function(*conditions(law), *down)
        np.testing.assert_allclose(np.broadcast_to(slope, rise.shape), rise / (2 * step), rtol=1e-6)


@every_law
def test_a_linear_law_is_its_design_matrix_times_its_parameters_and_no_other_law_is(law: Law) -> None:
    values = np.array(parameters(law))
    from_matrix = law.design_matrix(*conditions(law), at=values) @ values
    linear = np.allclose(from_matrix, law.force_N(tuple(conditions(law)), values), rtol=1e-12)
    assert linear == law.linear


@every_law
def test_twice_the_load_on_twice_the_area_doubles_the_force(law: Law) -> None:
    doubled = {**CONDITIONS}
    doubled["normal_load_N"] = 2 * CONDITIONS["normal_load_N"]
    doubled["nominal_area_m2"] = 2 * CONDITIONS["nominal_area_m2"]
    values = [2 * PARAMETERS[p.name] if p.unit == "N" else PARAMETERS[p.name] for p in law.parameters]
    twice = law.function(*[doubled[name] for name in law.conditions], *values)
    np.testing.assert_allclose(twice, 2 * law.function(*conditions(law), *parameters(law)), rtol=1e-12)


UREG = pint.UnitRegistry(cache_folder=None)


def scaled(unit: str, base: dict[str, float]) -> float:
    """Factor by which a number changes when the base units of length, mass and time shrink by ``base``."""
    dimensions = UREG.Quantity(1.0, unit or "dimensionless").dimensionality
    return float(np.prod([base[name] ** power for name, power in dimensions.items()]))


@every_law
def test_the_declared_units_are_those_of_the_formula(law: Law) -> None:
    base = {"[length]": 3.0, "[mass]": 0.7, "[time]": 11.0}
    args = [np.asarray(CONDITIONS[name]) * scaled(UNITS[name], base) for name in law.conditions]
    args += [PARAMETERS[p.name] * scaled(p.unit, base) for p in law.parameters]
    expected = law.function(*conditions(law), *parameters(law)) * scaled("N", base)
    np.testing.assert_allclose(law.function(*args), expected, rtol=1e-12)


@every_law
def test_every_public_function_says_its_formula_and_units(law: Law) -> None:
    assert law.function.__doc__ is not None
    assert "T = " in law.function.__doc__
    assert law.source


def value(name: str, *args: float) -> float:
    return float(np.asarray(EVERY[name].function(*args)))


@pytest.mark.parametrize(
    ("name", "args", "force"),
    [
        ("amontons", (2.0, 0.5), 1.0),
        ("coulomb_intercept", (2.0, 0.5, 0.25), 1.25),
        ("coulomb_adhesion", (2.0, 1e-4, 0.5, 1e4), 2.0),
        ("three_term", (2.0, 1e-4, 0.5, 0.5, 1e4, 2e4), 3.5),
        ("pressure_power", (8.0, 1.0, 1.0, 0.5, 1 / 3), 2.0),
        ("pressure_power_adhesion", (8.0, 1.0, 1.0, 0.5, 1 / 3, 1.0), 3.0),
        ("pressure_power", (0.0, 1.0, 1.0, 0.5, 1 / 3), 0.0),
        ("pressure_power_adhesion", (0.0, 2.0, 1.0, 0.5, 1 / 3, 3.0), 6.0),
    ],
)
def test_exact_values(name: str, args: tuple[float, ...], force: float) -> None:
    assert value(name, *args) == pytest.approx(force, rel=1e-14)


adhesion_Pa = st.floats(-5e4, 5e4)


@given(st.floats(1e-3, 10), st.floats(1e-6, 1e-3), st.floats(0.1, 9), adhesion_Pa, adhesion_Pa)
def test_at_full_contact_the_three_term_law_is_coulombs_with_the_summed_adhesion(
    load: float, area: float, mu: float, a: float, b: float
) -> None:
    three = value("three_term", load, area, 1.0, mu, a, b)
    assert three == pytest.approx(value("coulomb_adhesion", load, area, mu, a + b), rel=1e-12, abs=1e-12)


def test_the_power_laws_meet_coulombs_law_at_exponent_zero() -> None:
    flat: Callable[..., float] = POWER_LAWS["pressure_power_adhesion"].function
    assert flat(0.7, 55e-6, 1e4, 4.8, 0.0, 2e4) == pytest.approx(
        LAWS["coulomb_adhesion"].function(0.7, 55e-6, 4.8, 2e4), rel=1e-14
    )
