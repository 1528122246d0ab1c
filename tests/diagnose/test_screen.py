"""Contrasts, their strength, and what chance gives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2, norm

from tribo.diagnostics.contrasts import Contrast, deviate, screen
from tribo.diagnostics.effect_sizes import _direction
from tribo.diagnostics.fit import ModelFit, fit
from tribo.diagnostics.model import setup, start_changes
from tribo.diagnostics.observations import observe
from tribo.diagnostics.predictor import tabled_predictor
from tribo.diagnostics.replicates import as_measured
from tribo.diagnostics.score_statistics import AS_FITTED, scores, terms_in

from .known import contrasts_of
from .synthetic import hidden


def baseline(*effects: tuple[str, float], seed: int = 3) -> ModelFit:
    o = observe(hidden(*effects, seed=seed))
    return fit(setup(o, tabled_predictor(o.patterns)))


def test_deviates_are_as_rare_as_the_chi_squared_they_stand_for() -> None:
    freedom = np.array([1, 2, 5])
    values = np.array([9.0, 12.0, 20.0])
    assert norm.sf(deviate(values, freedom)) * 2 == pytest.approx(chi2.sf(values, freedom), rel=1e-6)
    assert np.all(np.diff(deviate(np.linspace(1, 4000, 300), np.full(300, 4))) > -0.6)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_misfit_of_a_mechanism_is_positive_where_friction_rises_with_its_column(sign: float) -> None:
    """Also where the driest pulls lie farther from the mean than the wettest ones."""
    f = baseline()
    acting, courses, _ = start_changes(f.setup, f.law)
    k = next(k for k, a in enumerate(acting) if a.name == "humidity")
    contrast = Contrast("mechanism", "both", "humidity", "", courses[k], acting[k])
    c = f.setup.observations.conditions
    dry = replace(c, humidity_pct=c.humidity_pct.mean() + np.minimum(c.humidity_pct - c.humidity_pct.mean(), 1.0))
    change = sign * (dry.humidity_pct - dry.humidity_pct.mean())[:, None] * np.ones(2)
    assert np.abs(change.min() if sign > 0 else change.max()) > 2 * np.abs(change.max() if sign > 0 else change.min())
    assert _direction(contrast, change, dry) == sign
    assert _direction(replace(contrast, acting=None), change, dry) == -sign


def test_columns_of_the_law_itself_are_cleared_away() -> None:

    f = baseline()
    left = f.cleared(f.jacobian)[0]
    assert np.abs(left).max() < 1e-3 * np.abs(f.jacobian).max() / 0.05


def test_the_quick_score_is_that_of_the_cleared_columns() -> None:
    f = baseline()
    contrasts = [contrast for contrast in contrasts_of(f) if contrast.freedom == 1][:60]
    left, target = f.cleared(np.concatenate([contrast.columns for contrast in contrasts], axis=2))
    size = np.sqrt(np.sum(left**2, axis=0))
    seen = size > 1e-3
    ends = [slice(k, k + 1) for k in range(len(contrasts))]
    ready = terms_in(np.concatenate([contrast.columns for contrast in contrasts], axis=2), ends)
    quick = np.sqrt(scores(as_measured(f), ready, steps=AS_FITTED)[0][0])
    assert quick[seen] == pytest.approx(np.abs(left.T @ target / size)[seen], rel=1e-4, abs=1e-5)


def test_a_contrast_that_is_whole_or_absent_is_tested_at_a_size_about_one() -> None:
    f = baseline(("mislabelled_specimen", 1.0))
    contrasts = [c for c in contrasts_of(f) if c.acting is not None and c.acting.name == "mislabelled_specimen"]
    stacked = np.concatenate([c.columns for c in contrasts], axis=2)
    about_one = np.full(len(contrasts), 0.15**-2)
    spans = [slice(k, k + 1) for k in range(len(contrasts))]
    found = scores(as_measured(f), terms_in(stacked, spans, about_one), steps=AS_FITTED)[0][0]
    left, target = f.cleared(stacked)
    sizes = np.linspace(-1.0, 3.0, 40001)[:, None]
    at_size = 2.0 * sizes * (left.T @ target) - sizes**2 * np.sum(left**2, axis=0) - ((sizes - 1.0) / 0.15) ** 2
    assert found == pytest.approx(np.maximum(at_size.max(axis=0), 0.0), abs=1e-3)
    assert 0 < np.sum(found > 0) < len(found)


def test_every_wrong_label_is_looked_for_as_a_whole_and_nothing_else_is() -> None:
    contrasts = contrasts_of(baseline())
    whole = {contrast.acting.name for contrast in contrasts if contrast.about_one > 0 and contrast.acting is not None}
    assert whole == {"mislabelled_specimen"}
    assert all(contrast.about_one == 0 for contrast in contrasts if contrast.acting is None)


def test_an_effect_is_the_strongest_contrast_at_its_own_column() -> None:
    f = baseline(("temperature", 2.5))
    contrasts = contrasts_of(f)
    found = screen(f, contrasts, replicates=0, rng=np.random.default_rng(0))
    strongest = contrasts[int(found.strength.argmax())]
    assert strongest.covariate in ("temperature_C", "temperature")
    temperature = next(k for k, c in enumerate(contrasts) if c.acting is not None and c.acting.name == "temperature")
    assert found.strength[temperature] > 0.98 * found.strength.max()


def test_no_more_replicates_are_made_than_the_decision_needs() -> None:
    plain = baseline()
    contrasts = [contrast for contrast in contrasts_of(plain) if contrast.kind == "trend"]
    within = screen(plain, contrasts[1:2], replicates=200, rng=np.random.default_rng(2))
    f = baseline(("temperature", 2.5))
    beyond = screen(f, contrasts_of(f), replicates=200, rng=np.random.default_rng(2))
    assert len(within.chance) < 200
    assert np.sum(within.chance >= within.strength.max()) >= 10
    assert len(beyond.chance) < 200
    assert beyond.p_adjusted() < 1e-6


def test_a_p_value_beyond_all_replicates_is_small_and_finite() -> None:
    f = baseline(("run_in", 2.5))
    contrasts = [contrast for contrast in contrasts_of(f) if contrast.kind == "trend"]
    found = screen(f, contrasts, replicates=30, rng=np.random.default_rng(2))
    assert 0.0 < found.p_adjusted() < 1e-3
    assert found.p_adjusted(0.0) == 1.0


def test_a_stretch_of_the_series_that_differs_is_found_as_such() -> None:
    """Another counterface for a third of the series: the strongest contrast is one of a stretch of the run order."""
    f = baseline(("outside:counterface", 2.0))
    contrasts = contrasts_of(f)
    strongest = contrasts[int(screen(f, contrasts, replicates=0, rng=np.random.default_rng(0)).strength.argmax())]
    assert strongest.kind == "block"
    assert strongest.title.startswith("run_order, from")
