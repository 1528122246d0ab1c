"""Scatter of specimens pooled over samples: what is assumed, what it gives, and when it says no."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from other_fits import fit_power_law, pool_specimen_scatter

from tribo.errors import FitError
from tribo.fitting import fit_samples, repeat_scatter
from tribo.fitting.linear import sample_rows, weights_by_repeats, weights_of
from tribo.records import LawFit

AREA = 55e-6
LOADS = np.array([0.06, 0.26, 0.5, 1.4])
LAWS = {"A": (4.0, 18e3), "B": (3.5, 10e3), "C": (4.2, 7e3), "Sx": (3.3, 11e3), "Sy": (3.2, 10e3)}


def fits(spread: dict[str, float] | None = None, specimens: int = 3, seed: int = 0) -> tuple[LawFit, ...]:
    """Specimens whose force is off by a gain of 5 % (or that of ``spread``), pulled without further scatter."""
    rng = np.random.default_rng(seed)
    rows = [
        (sample, f"{sample[0]}{k}", load, gain * (mu * load + tau0 * AREA))
        for sample, (mu, tau0) in LAWS.items()
        for k in range(specimens)
        for gain in [1 + (spread or {}).get(sample, 0.05) * rng.standard_normal()]
        for load in LOADS
    ]
    table = pd.DataFrame(rows, columns=["sample", "specimen", "normal_load_N", "static_N"])
    return fit_samples(table, "static", AREA)


def test_values_stay_and_the_degrees_of_freedom_are_those_of_all_specimens_counted_once() -> None:
    for own, pooled in zip(fits(), pool_specimen_scatter(fits()), strict=True):
        np.testing.assert_array_equal(own.values, pooled.values)
        assert pooled.dof == 3 * 2 + 2  # A, B, C and one pattern S pulled both ways
        assert "pooled over 5 samples" in pooled.method


def test_a_gain_that_scatters_gives_every_sample_its_share_of_mu_and_of_tau0() -> None:
    own = fits()
    shares = [np.array([v[0] for v in f.specimens.values()]) / f.value("mu") for f in own]
    expected = np.sqrt(np.mean([np.var(s, ddof=1) for s in shares]) / 3)
    for fit in pool_specimen_scatter(own):
        assert fit.standard_uncertainty("mu") / fit.value("mu") == pytest.approx(expected, rel=1e-6)
        assert fit.standard_uncertainty("tau0_Pa") / fit.value("tau0_Pa") == pytest.approx(expected, rel=1e-6)
        assert fit.force_u_N(0.5) / fit.force_N(0.5) == pytest.approx(expected, rel=1e-6)


def test_one_sample_alone_keeps_its_own_covariance() -> None:
    (own,) = [fit for fit in fits() if fit.sample == "A"]
    (pooled,) = pool_specimen_scatter((own,))
    np.testing.assert_allclose(pooled.covariance, own.covariance, rtol=1e-6)
    assert pooled.dof == own.dof


def test_a_sample_that_scatters_otherwise_is_noted() -> None:
    assert not any(fit.notes for fit in pool_specimen_scatter(fits(specimens=6)))
    unlike = pool_specimen_scatter(fits({"B": 0.6}, specimens=6))
    assert all(any("is not reliable" in note for note in fit.notes) for fit in unlike)


def test_a_sample_of_one_specimen_gains_an_interval_for_its_pattern() -> None:
    lone = next(fit for fit in fits(specimens=1) if fit.sample == "A")
    others = tuple(fit for fit in fits() if fit.sample != "A")
    pooled = pool_specimen_scatter((lone, *others))[0]
    assert pooled.standard_uncertainty("mu") > 0
    assert not any("one specimen" in note for note in pooled.notes)


def test_specimens_alone_in_their_samples_have_nothing_to_pool() -> None:
    with pytest.raises(FitError, match="between specimens cannot be determined"):
        pool_specimen_scatter(fits(specimens=1))


def test_another_law_is_not_pooled() -> None:
    table = pd.DataFrame({"sample": "A", "specimen": "A1", "normal_load_N": LOADS, "static_N": 1 + LOADS})
    with pytest.raises(FitError, match="cannot be pooled"):
        pool_specimen_scatter(fit_power_law(table, "static", AREA))


def test_weights_of_t_over_n_are_refused_at_zero_load() -> None:
    table = pd.DataFrame({"sample": "A", "specimen": "A1", "normal_load_N": [0.0, 1.0], "static_N": [1.0, 5.0]})
    (rows,) = sample_rows(table, "static")
    with pytest.raises(FitError, match="zero load"):
        weights_of(rows, AREA, "ratio")


def test_the_scatter_of_repeats_is_a_share_of_the_force_in_any_unit() -> None:
    rng = np.random.default_rng(3)
    load = np.repeat([1.0, 2.0, 4.0], 20)
    force = 3.0 * load * (1 + 0.05 * rng.standard_normal(load.size))
    found = []
    for scale in (1.0, 1e-12):
        table = pd.DataFrame({"sample": "F", "specimen": "F1", "normal_load_N": load, "static_N": scale * force})
        scatter = repeat_scatter(sample_rows(table, "static"))
        assert scatter is not None
        found.append(1 / weights_by_repeats(np.array([6.0 * scale]), scatter)[0] / scale**2)
    assert found[1] == pytest.approx(found[0])
    assert np.sqrt(found[0]) / 6.0 == pytest.approx(0.05, rel=0.25)
