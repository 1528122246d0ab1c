"""Scores of contrasts at several sizes of the random effects, against dense matrices from their definition."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tribo.diagnostics.model import EVERY, EffectCourse, Setup, Target, added, course
from tribo.diagnostics.normal_equations import model_columns
from tribo.diagnostics.replicates import SIZE_STEPS, Replicates, fitted_noise, replicates_at
from tribo.diagnostics.scatter import Noise, log_size_prior
from tribo.diagnostics.score_statistics import AS_FITTED, informations, scores, terms_in, terms_of

from .test_likelihood import campaign, dense, noise_of, residual_of

SPANS = [slice(0, 1), slice(1, 3), slice(3, 4)]
SEED = 8


def columns(s: Setup) -> np.ndarray:
    return np.random.default_rng(SEED).normal(size=(s.observations.n, 2, 4))


def one_replicate(s: Setup, noise: Noise) -> tuple[Replicates, np.ndarray]:
    """The campaign as one replicate of normal noise, and the columns of its law."""
    target = Target(s, ())
    jacobian = target.jacobian(s.first_law, target.predict(s.first_law))
    along = model_columns(jacobian, s)
    residual = residual_of(s).T[None]
    return replicates_at(s, along, fitted_noise(s, noise, 1), residual, residual, noise.tail), jacobian.reshape(-1, 4)


def at_step(s: Setup, noise: Noise, flat: np.ndarray, step: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Information (4, 4) and score (4,) of the columns beyond the law, and the log likelihood without them, the law
    integrated out, of a campaign whose random sizes are ``step`` e-folds larger."""
    stepped = replace(noise, sizes=noise.sizes * np.exp(step))
    whole, contrast, r = dense(s, stepped)[0], columns(s).reshape(-1, 4), residual_of(s).ravel()
    inverse = np.linalg.inv(whole)
    of_law = flat.T @ inverse @ flat
    rest = inverse - inverse @ flat @ np.linalg.solve(of_law, flat.T @ inverse)
    likelihood = -0.5 * (np.linalg.slogdet(whole)[1] + np.linalg.slogdet(of_law)[1] + r @ rest @ r)
    prior = sum(float(log_size_prior(k, size)) for k, size in enumerate(stepped.sizes) if k in s.group)
    return contrast.T @ rest @ contrast, contrast.T @ rest @ r, likelihood + prior


def test_a_contrast_scores_at_the_sizes_that_favour_it_and_pays_for_what_the_model_alone_loses_there() -> None:
    s = campaign()
    noise = noise_of(s)
    replicate, flat = one_replicate(s, noise)
    ready = terms_in(columns(s), SPANS)
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


def test_a_contrast_that_is_there_as_a_whole_or_not_at_all_is_tested_at_a_coefficient_of_one() -> None:
    """Twice the largest log likelihood ratio of a coefficient c, known to 0.2 about one, against none."""
    s = campaign()
    noise = noise_of(s)
    replicate, flat = one_replicate(s, noise)
    known = 1 / 0.2**2
    ready = terms_in(columns(s), SPANS, np.array([known, 0.0, 0.0]))
    information, score, _ = at_step(s, noise, flat, SIZE_STEPS[0])
    c = np.linspace(-1.0, 3.0, 40_001)
    ratio = 2 * (score[0] * c - 0.5 * information[0, 0] * c**2 - 0.5 * known * (c - 1) ** 2)
    found, coefficients = scores(replicate, ready, steps=AS_FITTED)
    assert found[0, 0] == pytest.approx(max(ratio.max(), 0.0), abs=1e-3)
    assert coefficients[0][0, 0] == pytest.approx(c[ratio.argmax()], abs=1e-3)
    free = scores(replicate, terms_in(columns(s), SPANS), steps=AS_FITTED)[0]
    assert found[0, 1:] == pytest.approx(free[0, 1:])


def test_a_column_that_the_law_explains_but_for_a_thousandth_is_not_seen_as_a_contrast() -> None:
    s = campaign()
    noise = noise_of(s)
    replicate, flat = one_replicate(s, noise)
    law = flat.reshape(s.observations.n, 2, 4)
    ready = terms_in(law + 1e-5 * np.abs(law).mean() * columns(s), [slice(k, k + 1) for k in range(4)])
    found, coefficients = scores(replicate, ready)
    assert not found.any()
    assert not any(c.any() for c in coefficients)


def test_a_campaign_of_two_replicates_is_scored_one_by_one() -> None:
    s = campaign()
    noise = noise_of(s)
    replicate, _ = one_replicate(s, noise)
    target = Target(s, ())
    along = model_columns(target.jacobian(s.first_law, target.predict(s.first_law)), s)
    residual = np.repeat(residual_of(s).T[None], 2, axis=0)
    both = replicates_at(s, along, fitted_noise(s, noise, 2), residual, residual * np.array([1.0, 0.5])[:, None, None],
                         noise.tail)  # fmt: skip
    ready = terms_in(columns(s), SPANS)
    found, _ = scores(both, ready, steps=AS_FITTED)
    assert found[1] == pytest.approx(0.25 * found[0])
    assert found[0] == pytest.approx(scores(replicate, ready, steps=AS_FITTED)[0][0])


def local_courses(s: Setup) -> list[EffectCourse]:
    """Columns that one specimen each shows, two of them on the first."""
    rng = np.random.default_rng(9)
    found = []
    for specimen in (0, 0, 3, 5):
        values = np.zeros((s.observations.n, 2, 1))
        values[s.tests_of[specimen]] = rng.normal(size=(len(s.tests_of[specimen]), 2, 1))
        found.append(course(values, s))
    return found


def test_a_course_of_one_specimen_is_kept_on_its_tests_and_gives_its_columns_back() -> None:
    s = campaign()
    wide = course(columns(s), s)
    assert wide.specimen == EVERY
    assert np.array_equal(wide.columns, columns(s))
    for found, specimen in zip(local_courses(s), (0, 0, 3, 5), strict=True):
        assert found.specimen == specimen
        assert found.tests.tolist() == np.flatnonzero(s.specimen == specimen).tolist()
        assert np.any(found.columns, axis=(1, 2)).sum() == len(found.values)
        assert found.shows
    assert not course(np.zeros((s.observations.n, 2, 1)), s).shows
    assert not course(np.full((s.observations.n, 2, 1), np.nan), s).shows


def test_contrasts_at_one_specimen_and_at_two_score_as_the_same_columns_written_out() -> None:
    """Beside a contrast of all tests, at free sizes and at sizes known to be one."""
    s = campaign()
    replicate, _ = one_replicate(s, noise_of(s))
    alone = local_courses(s)
    wide = course(columns(s)[:, :, :2], s)
    both = [(alone[0], alone[2]), (alone[1], alone[3])]
    contrasts = [(alone[2],), (wide,), (alone[0],), both[0], (alone[1],), (alone[3],), both[1]]
    stacked = np.concatenate([added(contrast) for contrast in contrasts], axis=2)
    ends = np.cumsum([contrast[0].freedom for contrast in contrasts])
    spans = [slice(int(e) - contrast[0].freedom, int(e)) for e, contrast in zip(ends, contrasts, strict=True)]
    for whole in (np.zeros(len(contrasts)), np.where(np.arange(len(contrasts)) == 1, 0.0, 25.0)):
        found, coefficients = scores(replicate, terms_of(contrasts, whole, s.observations.n))
        expected, written_out = scores(replicate, terms_in(stacked, spans, whole))
        assert found == pytest.approx(expected, rel=1e-6, abs=1e-9)
        for a, b in zip(coefficients, written_out, strict=True):
            assert a == pytest.approx(b, rel=1e-6)


def test_the_information_and_the_score_of_candidates_are_those_of_the_marginal_model() -> None:
    s = campaign()
    noise = noise_of(s)
    replicate, flat = one_replicate(s, noise)
    alone = local_courses(s)
    wide = course(columns(s)[:, :, :1], s)
    contrasts = [(alone[2],), (wide,), (alone[0],), (alone[0], alone[2]), (alone[0], alone[3])]
    left, pull = informations(replicate, terms_of(contrasts, np.zeros(5), s.observations.n))
    inverse = np.linalg.inv(dense(s, noise)[0])
    rest = inverse - inverse @ flat @ np.linalg.solve(flat.T @ inverse @ flat, flat.T @ inverse)
    for k, contrast in enumerate(contrasts):
        column = added(contrast).ravel()
        assert left[0, k] == pytest.approx(column @ rest @ column, rel=1e-4)
        assert pull[0, k] == pytest.approx(column @ rest @ residual_of(s).ravel(), rel=1e-3, abs=1e-4)
