"""Looks, their strength, and what chance gives."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2, norm

from tribo.diagnose.search.looks import all_looks
from tribo.diagnose.search.screen import cleared, deviate, screen
from tribo.diagnose.statistics.chance import AS_FITTED, as_measured, columns_of, scores
from tribo.diagnose.statistics.fit import fit
from tribo.diagnose.statistics.model import ModelFit, setup
from tribo.diagnose.statistics.observations import observe
from tribo.diagnose.statistics.predictor import tabled_predictor

from .synthetic import hidden


def baseline(*effects: tuple[str, float], seed: int = 3) -> ModelFit:
    o = observe(hidden(*effects, seed=seed))
    return fit(setup(o, tabled_predictor(o.patterns)))


def test_deviates_are_as_rare_as_the_chi_squared_they_stand_for() -> None:
    freedom = np.array([1, 2, 5])
    values = np.array([9.0, 12.0, 20.0])
    assert norm.sf(deviate(values, freedom)) * 2 == pytest.approx(chi2.sf(values, freedom), rel=1e-6)
    assert np.all(np.diff(deviate(np.linspace(1, 4000, 300), np.full(300, 4))) > -0.6)


def test_columns_of_the_law_itself_are_cleared_away() -> None:
    from tribo.diagnose.statistics.fit import jacobian_at

    f = baseline()
    left = cleared(f, jacobian_at(f))[0]
    assert np.abs(left).max() < 1e-3 * np.abs(jacobian_at(f)).max() / 0.05


def test_the_quick_score_is_that_of_the_cleared_columns() -> None:
    f = baseline()
    looks = [look for look in all_looks(f) if look.freedom == 1][:60]
    left, target = cleared(f, np.concatenate([look.columns for look in looks], axis=2))
    size = np.sqrt(np.sum(left**2, axis=0))
    seen = size > 1e-3
    ends = [slice(k, k + 1) for k in range(len(looks))]
    ready = columns_of(np.concatenate([look.columns for look in looks], axis=2), ends)
    quick = np.sqrt(scores(as_measured(f), ready, steps=AS_FITTED)[0][0])
    assert quick[seen] == pytest.approx(np.abs(left.T @ target / size)[seen], rel=1e-4, abs=1e-5)


def test_an_effect_is_the_strongest_look_at_its_own_column() -> None:
    f = baseline(("run_in", 2.5))
    looks = all_looks(f)
    found = screen(f, looks, replicates=0, rng=np.random.default_rng(0))
    strongest = looks[int(found.strength.argmax())]
    assert strongest.covariate in ("specimen_run", "run_in")
    run_in = next(k for k, look in enumerate(looks) if look.acting is not None and look.acting.name == "run_in")
    assert found.strength[run_in] > 0.98 * found.strength.max()


def test_no_more_replicates_are_made_than_the_decision_needs() -> None:
    plain = baseline()
    looks = [look for look in all_looks(plain) if look.kind == "trend"]
    within = screen(plain, looks[1:2], replicates=200, rng=np.random.default_rng(2))
    f = baseline(("run_in", 2.5))
    beyond = screen(f, all_looks(f), replicates=200, rng=np.random.default_rng(2))
    assert len(within.chance) < 200
    assert np.sum(within.chance >= within.strength.max()) >= 10
    assert len(beyond.chance) < 200
    assert beyond.p_adjusted() < 1e-6


def test_a_p_value_beyond_all_replicates_is_small_and_finite() -> None:
    f = baseline(("run_in", 2.5))
    looks = [look for look in all_looks(f) if look.kind == "trend"]
    found = screen(f, looks, replicates=30, rng=np.random.default_rng(2))
    assert 0.0 < found.p_adjusted() < 1e-3
    assert found.p_adjusted(0.0) == 1.0


def test_a_stretch_of_the_series_that_differs_is_found_as_such() -> None:
    """Another counterface for a third of the series: the strongest look is one at a stretch of the run order."""
    f = baseline(("outside:counterface", 2.0))
    looks = all_looks(f)
    strongest = looks[int(screen(f, looks, replicates=0, rng=np.random.default_rng(0)).strength.argmax())]
    assert strongest.kind == "block"
    assert strongest.covariate.startswith("run_order, from")
