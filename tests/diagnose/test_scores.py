"""Scores of looks at several sizes of the random effects, against dense matrices written out from their definition."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tribo.diagnose.search.screen import AS_FITTED, columns_in, scores
from tribo.diagnose.statistics.model import Setup, Target
from tribo.diagnose.statistics.scatter import (
    SIZE_STEPS,
    Noise,
    Replicates,
    fitted_sizes,
    log_size_prior,
    replicates_at,
)

from .test_likelihood import campaign, dense, noise_of, residual_of

SPANS = [slice(0, 1), slice(1, 3), slice(3, 4)]
SEED = 8


def columns(s: Setup) -> np.ndarray:
    return np.random.default_rng(SEED).normal(size=(s.observations.n, 2, 4))


def one_replicate(s: Setup, noise: Noise) -> tuple[Replicates, np.ndarray]:
    """The campaign as one replicate of normal noise, and the columns of its law."""
    target = Target(s, ())
    jacobian = target.jacobian(s.first_law, target.predict(s.first_law))
    along = np.concatenate([jacobian, s.random], axis=2).transpose(1, 0, 2).copy()
    residual = residual_of(s).T[None]
    return replicates_at(s, along, fitted_sizes(s, noise, 1), residual, residual, noise.tail), jacobian.reshape(-1, 4)


def at_step(s: Setup, noise: Noise, flat: np.ndarray, step: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Information (4, 4) and score (4,) of the columns beyond the law, and the log likelihood without them, the law
    integrated out, of a campaign whose random sizes are ``step`` e-folds larger."""
    stepped = noise.with_sizes(noise.sizes * np.exp(step))
    whole, look, r = dense(s, stepped)[0], columns(s).reshape(-1, 4), residual_of(s).ravel()
    inverse = np.linalg.inv(whole)
    of_law = flat.T @ inverse @ flat
    rest = inverse - inverse @ flat @ np.linalg.solve(of_law, flat.T @ inverse)
    likelihood = -0.5 * (np.linalg.slogdet(whole)[1] + np.linalg.slogdet(of_law)[1] + r @ rest @ r)
    prior = sum(float(log_size_prior(k, size)) for k, size in enumerate(stepped.sizes))
    return look.T @ rest @ look, look.T @ rest @ r, likelihood + prior


def test_a_look_scores_at_the_sizes_that_favour_it_and_pays_for_what_the_model_alone_loses_there() -> None:
    s = campaign()
    noise = noise_of(s)
    replicate, flat = one_replicate(s, noise)
    ready = columns_in(columns(s), SPANS)
    steps = [at_step(s, noise, flat, step) for step in SIZE_STEPS]
    best = max(likelihood for _, _, likelihood in steps)
    expected = np.zeros((len(steps), 3))
    for k, (information, score, likelihood) in enumerate(steps):
        for i, span in enumerate(SPANS):
            own = score[span] @ np.linalg.solve(information[span, span], score[span])
            expected[k, i] = own + 2.0 * (likelihood - best)
    found, coefficients = scores(replicate, ready)
    assert found[0] == pytest.approx(np.maximum(expected.max(axis=0), 0.0), rel=1e-3, abs=1e-3)
    information, score, _ = steps[0]
    for span, c in zip(SPANS, coefficients, strict=True):
        assert c[0] == pytest.approx(np.linalg.solve(information[span, span], score[span]), rel=1e-3, abs=1e-5)
    at_first = scores(replicate, ready, steps=AS_FITTED)[0][0]
    assert at_first == pytest.approx(expected[0] - 2.0 * (steps[0][2] - best), rel=1e-3)


def test_a_look_that_is_there_as_a_whole_or_not_at_all_is_tested_at_a_coefficient_of_one() -> None:
    """Twice the largest log likelihood ratio of a coefficient c, known to 0.2 about one, against none."""
    s = campaign()
    noise = noise_of(s)
    replicate, flat = one_replicate(s, noise)
    known = 1 / 0.2**2
    ready = columns_in(columns(s), SPANS, np.array([known, 0.0, 0.0]))
    information, score, _ = at_step(s, noise, flat, SIZE_STEPS[0])
    c = np.linspace(-1.0, 3.0, 40_001)
    ratio = 2 * (score[0] * c - 0.5 * information[0, 0] * c**2 - 0.5 * known * (c - 1) ** 2)
    found, coefficients = scores(replicate, ready, steps=AS_FITTED)
    assert found[0, 0] == pytest.approx(max(ratio.max(), 0.0), abs=1e-3)
    assert coefficients[0][0, 0] == pytest.approx(c[ratio.argmax()], abs=1e-3)
    free = scores(replicate, columns_in(columns(s), SPANS), steps=AS_FITTED)[0]
    assert found[0, 1:] == pytest.approx(free[0, 1:])


def test_a_column_that_the_law_explains_but_for_a_thousandth_is_not_seen_as_a_look() -> None:
    s = campaign()
    noise = noise_of(s)
    replicate, flat = one_replicate(s, noise)
    law = flat.reshape(s.observations.n, 2, 4)
    ready = columns_in(law + 1e-5 * np.abs(law).mean() * columns(s), [slice(k, k + 1) for k in range(4)])
    found, coefficients = scores(replicate, ready)
    assert not found.any()
    assert not any(c.any() for c in coefficients)


def test_a_campaign_of_two_replicates_is_scored_one_by_one() -> None:
    s = campaign()
    noise = noise_of(s)
    replicate, _ = one_replicate(s, noise)
    names = ("precision", "residual", "weighted", "normal", "prior")
    twice = {name: np.repeat(getattr(replicate, name), 2, axis=0) for name in names}
    twice["residual"][1] *= 0.5
    both = replace(replicate, **twice, log_priors=np.repeat(replicate.log_priors, 2, axis=1))
    ready = columns_in(columns(s), SPANS)
    found, _ = scores(both, ready, steps=AS_FITTED)
    assert found[1] == pytest.approx(0.25 * found[0])
    assert found[0] == pytest.approx(scores(replicate, ready, steps=AS_FITTED)[0][0])
