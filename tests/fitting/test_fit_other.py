"""The three-term law over all samples, and the mixed model beside the specimens."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from tribo.errors import FitError
from tribo.fitting import fit_three_term, mixed_model

AREA = 55e-6
LOADS = np.array([0.06, 0.13, 0.26, 0.5, 0.9, 1.4])
AREA_FRACTIONS = {"F": 1.0, "A": 0.95, "B": 0.65, "C": 0.56, "Sx": 0.7, "Sy": 0.7}


def pulls(specimens: int = 3, between: float = 0.0, within: float = 0.0, seed: int = 0) -> pd.DataFrame:
    """T = (4.9 N + (18 kPa AF + 4 kPa) A) with relative scatter of specimens and of repeats."""
    rng = np.random.default_rng(seed)
    rows = []
    for sample, area_fraction in AREA_FRACTIONS.items():
        for k in range(specimens):
            gain = 1 + between * rng.standard_normal()
            for load in np.repeat(LOADS, 3):
                force = 4.9 * load + (18e3 * area_fraction + 4e3) * AREA
                noise = 1 + within * rng.standard_normal()
                rows.append((sample, f"{sample[0]}{k}", load, gain * force * noise))
    return pd.DataFrame(rows, columns=["sample", "specimen", "normal_load_N", "static_N"])


def test_the_three_term_law_is_recovered_exactly_without_scatter() -> None:
    fit = fit_three_term(pulls(), "static", AREA, AREA_FRACTIONS)
    assert fit.parameters == ("mu", "a_Pa", "b_Pa")
    np.testing.assert_allclose(fit.values, [4.9, 18e3, 4e3], rtol=1e-9)


def test_the_three_term_law_counts_a_specimen_pulled_both_ways_once() -> None:
    fit = fit_three_term(pulls(between=0.05, within=0.07), "static", AREA, AREA_FRACTIONS)
    assert fit.n_specimens == 15
    assert fit.dof == 12
    assert fit.n_tests == 6 * 3 * 18


@pytest.mark.slow
def test_the_three_term_covariance_is_the_scatter_over_repeated_campaigns() -> None:
    fits = [
        fit_three_term(pulls(between=0.05, within=0.07, seed=s), "static", AREA, AREA_FRACTIONS) for s in range(150)
    ]
    scatter = np.var([f.values for f in fits], axis=0, ddof=1)
    stated = np.mean([np.diag(f.covariance) for f in fits], axis=0)
    assert ((stated / scatter > 0.8) & (stated / scatter < 1.6)).all()


def test_one_area_fraction_cannot_part_a_from_b() -> None:
    with pytest.raises(FitError, match="area fraction"):
        fit_three_term(pulls(), "static", AREA, {"Sx": 0.7, "Sy": 0.7})


def test_a_sample_without_area_fraction_is_left_out_and_named() -> None:
    known = {k: v for k, v in AREA_FRACTIONS.items() if k != "C"}
    fit = fit_three_term(pulls(), "static", AREA, known)
    assert fit.n_tests == 5 * 3 * 18
    assert any("sample C" in note for note in fit.notes)


def test_too_few_specimens_for_the_jackknife_are_refused() -> None:
    with pytest.raises(FitError, match="specimens"):
        fit_three_term(pulls(specimens=1).query("sample in ['F', 'B', 'C']"), "static", AREA, AREA_FRACTIONS)


@pytest.mark.slow
def test_the_mixed_model_agrees_with_the_specimens_mean_on_balanced_data_where_it_converges() -> None:
    from tribo.fitting import fit_samples

    compared = 0
    for seed in range(6):
        table = pulls(specimens=6, between=0.08, within=0.05, seed=seed).query("sample == 'F'")
        mixed = mixed_model(table, "static", AREA)
        if mixed is not None:
            (nested,) = fit_samples(table, "static", AREA)
            np.testing.assert_allclose(mixed.values, nested.values, rtol=0.02)
            compared += 1
    assert compared >= 3


def test_the_mixed_model_has_no_answer_for_one_specimen() -> None:
    assert mixed_model(pulls(specimens=1).query("sample == 'F'"), "static", AREA) is None


def test_the_mixed_model_takes_one_sample_at_a_time() -> None:
    with pytest.raises(FitError, match="one sample"):
        mixed_model(pulls(), "static", AREA)
