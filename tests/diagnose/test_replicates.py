"""Replicates of a fitted model: fitted in a batch as one by one, and as strong as chance says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tribo.diagnostics.contrasts import screen
from tribo.diagnostics.fit import fit
from tribo.diagnostics.model import SPECIMEN_DRIFT, setup
from tribo.diagnostics.observations import observe
from tribo.diagnostics.predictor import tabled_predictor
from tribo.diagnostics.replicates import as_measured, drawn_residuals, refit, refits, standardised
from tribo.diagnostics.score_statistics import scores, terms_in

from .known import contrasts_of
from .synthetic import SMALL, hidden
from .test_screen import baseline


def test_a_batch_of_replicates_contrasts_like_each_fitted_by_itself() -> None:
    """The strongest contrast of a replicate is within 5 % of that of the full fit of the same campaign.

    Where a campaign drifts by chance, the full fit goes on to find the size of the drift, which a batch does not wait
    for: there the contrast is stronger in the batch, so that chance is not understated.
    """
    f = baseline()
    contrasts = contrasts_of(f)
    ends = np.cumsum([contrast.freedom for contrast in contrasts])
    spans = [slice(int(e - contrast.freedom), int(e)) for e, contrast in zip(ends, contrasts, strict=True)]
    ready = terms_in(np.concatenate([contrast.columns for contrast in contrasts], axis=2), spans)
    drawn = drawn_residuals(f, np.random.default_rng(5), 6)
    # the law takes the adhesion up at its own parameters alone; what is whole or absent is not tested so here
    alone = np.array([c.freedom == 1 and c.about_one == 0 and c.covariate != "tau0" for c in contrasts])
    batch = np.sqrt(scores(refit(f, drawn), ready)[0][:, alone].max(axis=1))
    still = []
    for k, log_force in enumerate(f.predicted + drawn.transpose(0, 2, 1)):
        again = replace(f.setup, observations=replace(f.setup.observations, log_force=log_force))
        refitted, rng = fit(again, start=replace(f, setup=again)), np.random.default_rng(0)
        single = screen(refitted, contrasts, replicates=0, rng=rng).strength[alone].max()
        still.append(refitted.noise.sizes[SPECIMEN_DRIFT:].max() < 0.01)
        assert batch[k] > 0.95 * single
        if still[-1]:
            assert batch[k] == pytest.approx(single, rel=0.05)
    assert sum(still) >= 4


def test_the_null_is_simulated_from_the_fitted_model() -> None:
    """Scores of a trend are close to standard normal, robust weights making them a little smaller."""
    f = baseline()
    trend = next(c for c in contrasts_of(f) if c.covariate == "run_order" and c.kind == "trend")
    ready = terms_in(trend.columns, [slice(0, 1)])
    chi2 = scores(refit(f, drawn_residuals(f, np.random.default_rng(1), 300)), ready)[0][:, 0]
    assert 0.8 < np.sqrt(np.mean(chi2)) < 1.2
    assert 0.005 < np.mean(chi2 > 3.84) < 0.09


def test_repeats_of_a_replicate_scatter_as_those_of_the_campaign_were_made_to() -> None:
    """Forty-eight groups of eight repeats: their scatter is known to 4 %, and drawn anew with the same size."""
    repeat_sd = (0.09, 0.07)
    design = replace(SMALL, repeats=8, repeat_sd=repeat_sd)
    o = observe(hidden(seed=1, design=design))
    f = fit(setup(o, tabled_predictor(o.patterns)))
    drawn = drawn_residuals(f, np.random.default_rng(0), 100)
    c = o.conditions
    group = np.array([f"{a} {b} {load:.3f}" for a, b, load in zip(c.sample, c.specimen, c.normal_load_N, strict=True)])
    within = [drawn[:, :, group == g].var(axis=2, ddof=1).mean(axis=0) for g in np.unique(group)]
    assert np.sqrt(np.mean(within, axis=0)) == pytest.approx(repeat_sd, rel=0.1)


def test_a_column_that_the_law_takes_up_counts_for_nothing() -> None:

    f = baseline()
    law = terms_in(f.jacobian, [slice(k, k + 1) for k in range(4)])
    chi2, coefficients = scores(as_measured(f), law)
    assert chi2.max() == 0.0
    assert all((c == 0.0).all() for c in coefficients)


def test_what_repeats_are_drawn_from_has_a_weighted_covariance_of_one() -> None:
    """Under the weights of the t distribution, as the fit estimates it."""
    f = baseline()
    left = standardised(f)
    weight = (f.noise.tail + 2) / (f.noise.tail + np.sum(left**2, axis=1))
    assert (left * weight[:, None]).T @ left / len(left) == pytest.approx(np.eye(2), abs=0.02)
    assert np.abs(left.mean(axis=0)).max() < 0.1


def test_the_campaign_itself_as_a_replicate_has_the_weights_and_the_residual_of_its_fit() -> None:
    f = baseline()
    r = as_measured(f)
    assert pytest.approx(f.residual) == r.residual[0].T
    assert r.precision.shape == (1, 3, f.setup.observations.n)
    inverse = np.linalg.inv(f.noise.per_test(f.setup) + f.setup.observations.reading[:, :, None] ** 2 * np.eye(2))
    entries = np.array([inverse[:, 0, 0], inverse[:, 0, 1], inverse[:, 1, 1]])
    assert r.precision[0] == pytest.approx(entries * f.weight)


def test_the_campaign_refitted_as_a_replicate_keeps_its_law_and_its_noise() -> None:
    """The fit is where the steps of a replicate stand still."""
    f = baseline()
    again = refit(f, f.residual.T[None])
    assert pytest.approx(f.residual, abs=2e-3) == again.residual[0].T
    repeat, scatter, sizes = refits(f, f.residual.T[None])[0]
    assert sizes[0] == pytest.approx(f.noise.sizes, rel=0.02)
    assert repeat[0] == pytest.approx(f.noise.repeat, rel=0.02, abs=2e-5)
    assert scatter[0] == pytest.approx(f.noise.scatter, abs=0.02)
