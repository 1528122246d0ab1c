"""Power laws of pressure, and errors of the normal load."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from other_fits import POWER_LAWS, fit_errors_in_both, fit_power_law, starting_values

from tribo.errors import FitError
from tribo.fitting import fit_samples
from tribo.fitting.linear import sample_rows

AREA = 55e-6
LOADS = np.array([0.06, 0.13, 0.26, 0.5, 0.9, 1.4])


def pulls(
    exponent: float = 0.0, scatter: float = 0.0, load_error_N: float = 0.0, specimens: int = 3, repeats: int = 3
) -> pd.DataFrame:
    """Specimens of one law T = 4 (p/10 kPa)^-n N + 12 kPa A; the loads as the bench recorded them."""
    rng = np.random.default_rng(11)
    load = np.tile(np.repeat(LOADS, repeats), specimens)
    force = POWER_LAWS["pressure_power_adhesion"].function(load, AREA, 10e3, 4.0, exponent, 12e3)
    return pd.DataFrame(
        {
            "sample": "F",
            "specimen": np.repeat([f"F{k}" for k in range(specimens)], len(LOADS) * repeats),
            "normal_load_N": np.maximum(load + load_error_N * rng.standard_normal(len(load)), 0.0),
            "static_N": force * (1 + scatter * rng.standard_normal(len(load))),
        }
    )


@pytest.mark.parametrize("exponent", [0.3, 0.0, -0.2])
def test_a_power_law_with_adhesion_is_recovered(exponent: float) -> None:
    (fit,) = fit_power_law(pulls(exponent), "static", AREA)
    np.testing.assert_allclose(fit.values, [4.0, exponent, 12e3], rtol=1e-5, atol=1e-6)
    assert fit.parameters == ("mu_ref", "n", "tau0_Pa")
    assert "p_ref 10 kPa" in fit.method


def test_the_exponent_of_a_straight_law_has_zero_in_its_interval_and_that_of_a_bent_one_has_not() -> None:
    (straight,) = fit_power_law(pulls(0.0, 0.05, specimens=5), "static", AREA)
    (bent,) = fit_power_law(pulls(0.4, 0.05, specimens=5), "static", AREA)
    assert straight.interval("n")[0] < 0 < straight.interval("n")[1]
    assert bent.interval("n")[0] > 0


def test_specimens_that_cannot_fix_the_power_law_are_named() -> None:
    table = pulls(0.3)
    (fit,) = fit_power_law(table[table["normal_load_N"] < 0.2], "static", AREA)
    assert np.isnan(fit.values).all()
    assert any("F0" in note for note in fit.notes)


def test_a_straight_law_is_not_a_power_law() -> None:
    with pytest.raises(FitError, match="pressure_power"):
        fit_power_law(pulls(), "static", AREA, law="coulomb_adhesion")


def test_errors_of_the_load_lower_the_ordinary_slope_and_not_that_of_both_variables() -> None:
    table = pulls(scatter=0.02, load_error_N=0.08, specimens=40, repeats=8)
    (ordinary,) = fit_samples(table, "static", AREA, weights="force")
    (both,) = fit_errors_in_both(table, "static", AREA, load_u_N=0.08, weights="force")
    assert ordinary.value("mu") < 3.94
    assert both.value("mu") == pytest.approx(4.0, abs=0.03)
    assert both.value("tau0_Pa") == pytest.approx(12e3, rel=0.04)
    assert "odrpack" in both.method


def test_loads_known_exactly_give_the_ordinary_fit() -> None:
    table = pulls(scatter=0.05)
    (ordinary,) = fit_samples(table, "static", AREA)
    (both,) = fit_errors_in_both(table, "static", AREA, load_u_N=1e-7)
    np.testing.assert_allclose(both.values, ordinary.values, rtol=1e-5)
    np.testing.assert_allclose(both.covariance, ordinary.covariance, rtol=1e-3)


def test_one_specimen_keeps_the_covariance_of_its_pulls() -> None:
    table = pulls(scatter=0.05, specimens=1)
    (ordinary,) = fit_samples(table, "static", AREA)
    (both,) = fit_errors_in_both(table, "static", AREA, load_u_share=1e-7)
    np.testing.assert_allclose(both.covariance, ordinary.covariance, rtol=1e-3)


def test_a_pull_at_zero_load_takes_part_where_loads_are_known_to_a_share() -> None:
    """The load zero is then known exactly: the line goes through that pull as the ordinary one does."""
    table = pulls(scatter=0.05, specimens=1)
    at_rest = table.iloc[[0, 1]].assign(normal_load_N=0.0, static_N=[0.60, 0.62])
    table = pd.concat([table, at_rest], ignore_index=True)
    (ordinary,) = fit_samples(table, "static", AREA)
    (both,) = fit_errors_in_both(table, "static", AREA, load_u_share=0.02)
    assert both.values == pytest.approx(ordinary.values, rel=0.03)


@pytest.mark.parametrize(("constant", "share"), [(0.0, 0.0), (-0.1, 0.2)])
def test_no_error_of_the_load_is_refused(constant: float, share: float) -> None:
    with pytest.raises(FitError, match="above zero"):
        fit_errors_in_both(pulls(), "static", AREA, load_u_N=constant, load_u_share=share)


def test_forces_that_are_all_zero_are_no_measurements_and_give_no_law() -> None:
    table = pulls().assign(static_N=0.0)
    rows = sample_rows(table, "static")[0]
    assert len(rows) == 0
    assert len(rows.without_force) == len(table)
    with pytest.raises(FitError):
        fit_samples(table, "static", AREA)
    law, load = POWER_LAWS["pressure_power_adhesion"], sample_rows(pulls(), "static")[0].load_N
    np.testing.assert_array_equal(starting_values(law, load, np.zeros(len(load)), AREA, 10e3), [1.0, 0.0, 0.0])
