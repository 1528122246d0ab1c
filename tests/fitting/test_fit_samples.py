"""mu and tau0 of samples from pulls nested in specimens."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings, strategies as st

from tribo.errors import FitError
from tribo.fitting import fit_samples
from tribo.fitting.linear import WEIGHTS
from tribo.records import LawFit

AREA = 55e-6
LOADS = np.array([0.06, 0.13, 0.26, 0.5, 0.9, 1.4])
every_weighting = pytest.mark.parametrize("weights", list(WEIGHTS))


def campaign(
    laws: dict[str, list[tuple[float, float]]], repeats: int = 3, scatter: float = 0.0, seed: int = 0
) -> pd.DataFrame:
    """Pulls of samples whose specimens follow the given (mu, tau0_Pa), repeats scattered by a relative sd."""
    rng = np.random.default_rng(seed)
    rows = [
        {
            "test_id": f"{sample}{k}-{i}-{r}",
            "sample": sample,
            "specimen": f"{sample}{k}",
            "normal_load_N": load,
            "static_N": (mu * load + tau0 * AREA) * (1 + scatter * rng.standard_normal()),
        }
        for sample, specimens in laws.items()
        for k, (mu, tau0) in enumerate(specimens)
        for i, load in enumerate(LOADS)
        for r in range(repeats)
    ]
    return pd.DataFrame(rows)


def only(fits: tuple[LawFit, ...]) -> LawFit:
    (fit,) = fits
    return fit


THREE = [(4.7, 22e3), (5.1, 24e3), (4.9, 20e3)]


@every_weighting
def test_specimens_without_scatter_are_fitted_exactly_and_their_mean_is_the_sample(weights: str) -> None:
    fit = only(fit_samples(campaign({"F": THREE}), "static", AREA, weights=weights))
    np.testing.assert_allclose(fit.values, [4.9, 22e3], rtol=1e-10)
    np.testing.assert_allclose(np.array(list(fit.specimens.values())), THREE, rtol=1e-10)


def test_the_covariance_is_that_of_the_mean_over_specimens_with_t_of_g_minus_1() -> None:
    fit = only(fit_samples(campaign({"F": THREE}), "static", AREA))
    np.testing.assert_allclose(fit.covariance, np.cov(np.array(THREE).T) / 3, rtol=1e-8)
    assert (fit.dof, fit.n_specimens, fit.n_tests) == (2, 3, 54)
    low, high = fit.interval("mu")
    assert high - low == pytest.approx(2 * 4.302653 * np.std([4.7, 5.1, 4.9], ddof=1) / np.sqrt(3), rel=1e-6)


@given(shift=st.floats(-40e3, 40e3), gain=st.floats(0.1, 10))
@settings(max_examples=30, deadline=None)
def test_force_weights_follow_an_added_adhesion_and_a_gain_of_the_force_exactly(shift: float, gain: float) -> None:
    table = campaign({"F": THREE}, scatter=0.1)
    plain = only(fit_samples(table, "static", AREA, weights="force"))
    moved = table.assign(static_N=gain * table["static_N"] + shift * AREA)
    fit = only(fit_samples(moved, "static", AREA, weights="force"))
    np.testing.assert_allclose(fit.values, gain * plain.values + [0, shift], rtol=1e-9, atol=1e-6)
    np.testing.assert_allclose(fit.covariance, gain**2 * plain.covariance, rtol=1e-6)


def test_a_negative_adhesion_stays_negative() -> None:
    fit = only(fit_samples(campaign({"F": [(4.9, -1e3), (5.0, -2e3), (5.1, -1.5e3)]}), "static", AREA))
    assert fit.value("tau0_Pa") == pytest.approx(-1.5e3)


def test_the_ratio_weights_are_the_ordinary_fit_of_t_over_n_against_1_over_p() -> None:
    table = campaign({"F": THREE[:1]}, scatter=0.1)
    pressure = table["normal_load_N"] / AREA
    tau0, mu = np.polyfit(1 / pressure, table["static_N"] / table["normal_load_N"], 1)
    fit = only(fit_samples(table, "static", AREA, weights="ratio"))
    np.testing.assert_allclose(fit.values, [mu, tau0], rtol=1e-9)


def test_the_force_weights_are_the_ordinary_fit_of_t_against_n() -> None:
    table = campaign({"F": THREE[:1]}, scatter=0.1)
    mu, intercept = np.polyfit(table["normal_load_N"], table["static_N"], 1)
    fit = only(fit_samples(table, "static", AREA, weights="force"))
    np.testing.assert_allclose(fit.values, [mu, intercept / AREA], rtol=1e-9)


def test_the_relative_weights_solve_the_quasi_likelihood_of_a_gamma_glm() -> None:
    from statsmodels.genmod.families import Gamma
    from statsmodels.genmod.families.links import Identity
    from statsmodels.genmod.generalized_linear_model import GLM
    from statsmodels.tools.sm_exceptions import DomainWarning

    table = campaign({"F": THREE[:1]}, scatter=0.1)
    design = np.column_stack([table["normal_load_N"], np.full(len(table), AREA)])
    with pytest.warns(DomainWarning):  # the identity link may leave the positive numbers; here it does not
        glm = GLM(table["static_N"], design, Gamma(Identity())).fit(tol=1e-12)
    fit = only(fit_samples(table, "static", AREA))
    np.testing.assert_allclose(fit.values, np.asarray(glm.params), rtol=1e-4)


def test_the_method_names_the_weights_and_the_specimens() -> None:
    for weights, text in WEIGHTS.items():
        fit = only(fit_samples(campaign({"F": THREE}), "static", AREA, weights=weights))
        assert text in fit.method
        assert "3 specimens" in fit.method


def test_samples_come_in_alphabetical_order_whatever_the_order_of_the_rows() -> None:
    table = campaign({"Sx": THREE, "A": THREE, "F": THREE}, scatter=0.05)
    shuffled = table.sample(frac=1.0, random_state=3)
    as_run, as_shuffled = (fit_samples(rows, "static", AREA) for rows in (table, shuffled))
    for one, other in zip(as_run, as_shuffled, strict=True):
        assert one.sample == other.sample
        np.testing.assert_allclose(one.values, other.values, rtol=1e-10)
    assert [fit.sample for fit in as_run] == ["A", "F", "Sx"]


def test_one_specimen_has_the_covariance_of_its_tests_and_says_so() -> None:
    fit = only(fit_samples(campaign({"F": THREE[:1]}, scatter=0.1), "static", AREA))
    assert fit.dof == len(LOADS) * 3 - 2
    assert fit.covariance[0, 0] > 0
    assert any("one specimen" in note for note in fit.notes)


def test_missing_cells_leave_the_law_of_exact_specimens_untouched() -> None:
    table = campaign({"F": THREE})
    gaps = table.drop(index=table.index[(table["specimen"] == "F1") & (table["normal_load_N"] < 0.4)])
    gaps.loc[gaps.index[::7], "static_N"] = np.nan
    fit = only(fit_samples(gaps, "static", AREA))
    np.testing.assert_allclose(fit.values, [4.9, 22e3], rtol=1e-9)
    assert fit.n_tests == int(gaps["static_N"].notna().sum())
    assert any("have no static force" in note for note in fit.notes)


def test_a_specimen_at_one_load_is_left_out_of_the_mean_and_named() -> None:
    table = campaign({"F": [*THREE, (9.0, 90e3)]})
    alone = table[(table["specimen"] != "F3") | (table["normal_load_N"] == LOADS[0])]
    fit = only(fit_samples(alone, "static", AREA))
    np.testing.assert_allclose(fit.values, [4.9, 22e3], rtol=1e-2)
    assert fit.n_specimens == 3
    assert any("F3" in note for note in fit.notes)


def test_specimens_at_one_load_each_are_fitted_by_the_line_through_their_means() -> None:
    table = campaign({"F": [(4.9, 22e3)] * len(LOADS)})
    own = {f"F{k}": load for k, load in enumerate(LOADS)}
    fit = only(fit_samples(table[table["normal_load_N"] == table["specimen"].map(own)], "static", AREA))
    np.testing.assert_allclose(fit.values, [4.9, 22e3], rtol=1e-9)
    assert fit.dof == len(LOADS) - 2


def test_a_sample_at_one_load_is_not_a_number_with_its_reason_beside_samples_that_fit() -> None:
    table = campaign({"F": THREE, "A": THREE})
    few = table[(table["sample"] == "F") | (table["normal_load_N"] == LOADS[2])]
    a, f = fit_samples(few, "static", AREA)
    assert np.isnan(a.values).all()
    assert "fewer than two loads" in a.notes[-1]
    assert np.isfinite(f.values).all()


def test_a_table_in_which_no_sample_can_be_fitted_is_refused_with_every_reason() -> None:
    table = campaign({"F": THREE, "A": THREE})
    with pytest.raises(FitError) as why:
        fit_samples(table[table["normal_load_N"] == LOADS[0]], "static", AREA)
    assert len(why.value.problems) == 2


def test_every_impossible_load_is_listed() -> None:
    table = campaign({"F": THREE})
    table.loc[3, "normal_load_N"] = -0.1
    table.loc[8, "normal_load_N"] = np.nan
    with pytest.raises(FitError) as why:
        fit_samples(table, "static", AREA)
    assert [p.test_id for p in why.value.problems] == [table.loc[3, "test_id"], table.loc[8, "test_id"]]


@pytest.mark.parametrize("area", [0.0, -1.0, float("nan")])
def test_an_impossible_area_is_refused(area: float) -> None:
    with pytest.raises(FitError, match="nominal area"):
        fit_samples(campaign({"F": THREE}), "static", area)


def test_a_missing_column_is_named() -> None:
    with pytest.raises(FitError, match="sliding_N"):
        fit_samples(campaign({"F": THREE}), "sliding", AREA)


def test_tests_at_zero_load_are_left_out_of_t_over_n_and_kept_by_the_other_weights() -> None:
    table = campaign({"F": THREE})
    table.loc[table["normal_load_N"] == LOADS[0], "normal_load_N"] = 0.0
    ratio = only(fit_samples(table, "static", AREA, weights="ratio"))
    assert ratio.n_tests == 45
    assert any("9 tests at zero load" in note for note in ratio.notes)
    np.testing.assert_allclose(ratio.values, [4.9, 22e3], rtol=1e-9)
    assert only(fit_samples(table, "static", AREA)).n_tests == 54


def test_unknown_weights_are_refused_with_what_is_allowed() -> None:
    with pytest.raises(FitError, match="relative, ratio, force"):
        fit_samples(campaign({"F": THREE}), "static", AREA, weights="heavy")
    with pytest.raises(FitError, match="specimens or tests"):
        fit_samples(campaign({"F": THREE}), "static", AREA, by="days")


def test_pooling_the_tests_is_narrower_than_the_specimens_where_specimens_differ() -> None:
    table = campaign({"F": [(4.0, 15e3), (5.0, 22e3), (6.0, 29e3)]}, scatter=0.02)
    specimens = only(fit_samples(table, "static", AREA))
    pooled = only(fit_samples(table, "static", AREA, by="tests"))
    assert pooled.interval("mu")[1] - pooled.interval("mu")[0] < 0.4 * (
        specimens.interval("mu")[1] - specimens.interval("mu")[0]
    )


def test_a_curved_law_is_noted_and_a_straight_one_is_not() -> None:
    table = campaign({"F": THREE}, scatter=0.03, seed=5)
    assert not only(fit_samples(table, "static", AREA)).notes
    bow = 1.2 * table["normal_load_N"] ** 2
    bent = only(fit_samples(table.assign(static_N=table["static_N"] - bow), "static", AREA))
    assert any("deviate from a straight line" in note for note in bent.notes)
    assert bent.chi2_red > 3


def test_chi_squared_is_one_on_average_where_the_law_holds() -> None:
    found = [
        only(fit_samples(campaign({"F": THREE}, scatter=0.05, seed=seed), "static", AREA)).chi2_red
        for seed in range(60)
    ]
    dof_line, dof_repeat = 3 * (len(LOADS) - 2), 3 * len(LOADS) * 2
    expected = dof_repeat / (dof_repeat - 2)
    sd = expected * np.sqrt(2 * (dof_line + dof_repeat - 2) / (dof_line * (dof_repeat - 4)))
    assert np.mean(found) == pytest.approx(expected, abs=4 * sd / np.sqrt(len(found)))
