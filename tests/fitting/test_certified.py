"""Certified fits (NIST StRD) come out to the digits stated here, values and standard errors."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from nist_strd import DANWOOD, MISRA1A, NOINT1, NOINT2, NORRIS, PONTIUS, Certified
from other_fits import POWER_LAWS, fit_curve

from tribo.errors import FitError
from tribo.fitting.linear import LinearFit, least_squares
from tribo.laws import Law, Parameter

LINEAR_DIGITS = 10
NONLINEAR_DIGITS = 8


def digits(found: np.ndarray, certified: np.ndarray) -> float:
    """Fewest agreeing digits: the log relative error of the StRD."""
    error = np.abs(np.asarray(found) / certified - 1)
    return float(np.min(-np.log10(np.maximum(error, 1e-16))))


def agreeing_digits(fit: LinearFit, certified: Certified) -> float:
    """Fewest agreeing digits among the values, their standard errors and the residual standard deviation."""
    found = [*fit.values, *np.sqrt(np.diag(fit.covariance)), np.sqrt(fit.residual_variance)]
    return digits(np.array(found), np.array([*certified.values, *certified.deviations, certified.residual]))


@pytest.mark.parametrize(
    ("certified", "powers"),
    [(NORRIS, (0, 1)), (PONTIUS, (0, 1, 2)), (NOINT1, (1,)), (NOINT2, (1,))],
    ids=["Norris", "Pontius", "NoInt1", "NoInt2"],
)
def test_linear_fits_agree_with_the_certified_ones_to_ten_digits(certified: Certified, powers: tuple[int, ...]) -> None:
    design = np.column_stack([certified.x**p for p in powers])
    assert agreeing_digits(least_squares(design, certified.y), certified) >= LINEAR_DIGITS


def test_weights_count_as_repeated_pulls() -> None:
    design = np.column_stack([np.ones(36), NORRIS.x])
    weights = np.tile([1.0, 2.0, 3.0], 12)
    times = weights.astype(int)
    repeated = least_squares(np.repeat(design, times, axis=0), np.repeat(NORRIS.y, times))
    weighted = least_squares(design, NORRIS.y, weights)
    np.testing.assert_allclose(weighted.values, repeated.values, rtol=1e-10)
    np.testing.assert_allclose(weighted.unscaled, repeated.unscaled, rtol=1e-10)


def test_the_power_law_of_friction_solves_danwood_to_eight_digits() -> None:
    """y = b1 x^b2 is the power law with b1 = mu_ref and b2 = 1 - n at unit area and reference pressure."""
    fit = fit_curve(POWER_LAWS["pressure_power"], (DANWOOD.x, 1.0, 1.0), DANWOOD.y, np.array([1.0, -4.0]))
    certified = Certified(
        DANWOOD.x, DANWOOD.y, np.array([DANWOOD.values[0], 1 - DANWOOD.values[1]]), DANWOOD.deviations,
        DANWOOD.residual,
    )  # fmt: skip
    assert agreeing_digits(fit, certified) >= NONLINEAR_DIGITS


def saturating(x: Any, b1: Any, b2: Any) -> Any:
    return b1 * (1 - np.exp(-b2 * x))


def saturating_gradient(x: Any, b1: Any, b2: Any) -> tuple[Any, Any]:
    return 1 - np.exp(-b2 * x), b1 * x * np.exp(-b2 * x)


@pytest.mark.parametrize("start", [(500.0, 0.0001), (250.0, 0.0005)], ids=["far", "near"])
def test_a_law_outside_the_table_solves_misra1a_from_both_official_starts(start: tuple[float, float]) -> None:
    law = Law(
        "misra1a", "y = b1 (1 - exp(-b2 x))", saturating, saturating_gradient, ("x",),
        (Parameter("b1", "b1", "", ""), Parameter("b2", "b2", "", "")), False, "NIST StRD",
    )  # fmt: skip
    fit = fit_curve(law, (MISRA1A.x,), MISRA1A.y, np.array(start))
    assert agreeing_digits(fit, MISRA1A) >= NONLINEAR_DIGITS


def test_columns_that_the_data_cannot_part_are_refused() -> None:
    load = np.array([1.0, 1.0, 1.0])
    with pytest.raises(FitError, match="cannot determine"):
        least_squares(np.column_stack([load, np.ones(3)]), np.arange(3.0))


def test_fewer_pulls_than_parameters_are_refused() -> None:
    with pytest.raises(FitError, match="too few pulls"):
        fit_curve(POWER_LAWS["pressure_power"], (np.array([1.0]), 1.0, 1.0), np.array([1.0]), np.array([1.0, 0.0]))
