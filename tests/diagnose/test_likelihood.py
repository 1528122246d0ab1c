"""The likelihood of a campaign and its parts, against dense matrices written out from the model's definition.

With very many degrees of freedom the t distribution is normal, Laplace's method is exact, and a campaign is one normal
vector: covariance = repeats and readings of each test + random effects.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from tribo.diagnostics.fit import (
    FitState,
    fit,
    penalised,
    scored,
    solved,
    state_at,
    weights,
    whitened,
    with_noise_estimated,
)
from tribo.diagnostics.model import FIXED, OF_A_SPECIMEN, PATTERN, SLOPE, SPECIMEN_DRIFT, Setup, Target, setup
from tribo.diagnostics.normal_equations import Inverse, ModelColumns, model_columns
from tribo.diagnostics.observations import observe
from tribo.diagnostics.predictor import tabled_predictor
from tribo.diagnostics.replicates import (
    SIZE_STEPS,
    fitted_noise,
    log_priors,
    products_of,
    replicate_weights,
    replicates_at,
    solved_at_once,
)
from tribo.diagnostics.scatter import (
    FIRST_NUISANCE,
    REPEAT_PRIOR,
    SCATTER_SD,
    SIZE_PRIORS,
    SMALLEST_SD,
    Noise,
    first_noise,
    inverse_noise,
    log_prior,
    log_size_prior,
    prior_sd,
    updated_repeats,
    updated_sizes,
    whitener,
)

from .synthetic import Design, hidden

NORMAL = 1e9  # degrees of freedom
FEW = Design(samples=("F", "A", "B"), masses_g=(5.0, 40.0, 138.5), specimens=3, repeats=2)


@cache
def campaign() -> Setup:
    """Readings that matter beside the repeats, and differ from test to test."""
    o = observe(hidden(seed=5, design=FEW))
    reading = 0.02 + 0.05 * np.random.default_rng(0).random((o.n, 2))
    return setup(replace(o, reading=reading), tabled_predictor(o.patterns))


def noise_of(s: Setup, tail: float = NORMAL) -> Noise:
    """Sizes that all differ; repeats that are correlated, differ by sample and follow the force."""
    repeat = np.array([[0.0081, 0.002], [0.002, 0.0049]])
    scatter = np.array([0.3, -0.1, -0.2, -0.15])
    assert len(scatter) == s.scatter.shape[1]
    sizes = np.array([0.06, 0.03, 0.02, 0.035, 1.7, 1.1, 1.3, 0.021, 0.013, 0.044, 0.026, 0.051, 0.017])
    return Noise(repeat, sizes, scatter, tail)


def of_tests(s: Setup, noise: Noise) -> np.ndarray:
    """Covariance of repeats and readings, (n, 2, 2), test by test."""
    assert noise.scatter is not None
    found = []
    for k in range(s.observations.n):
        times = np.exp(s.scatter[k] @ noise.scatter) ** 2
        found.append(times * noise.repeat + np.diag(s.observations.reading[k] ** 2))
    return np.array(found)


def of_effects(s: Setup, noise: Noise) -> np.ndarray:
    """Variance of every random effect, (q,)."""
    sizes = [1.0 if g == FIXED else noise.sizes[g] for g in s.group]
    return np.array([(size * u) ** 2 for size, u in zip(sizes, s.unit, strict=True)])


def dense(s: Setup, noise: Noise) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Covariance of all tests (2n, 2n), that without random effects, and the design of the effects (2n, q)."""
    n = s.observations.n
    alone = np.zeros((2 * n, 2 * n))
    for k, own in enumerate(of_tests(s, noise)):
        alone[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = own
    random = s.dense.reshape(2 * n, -1)
    return alone + random @ np.diag(of_effects(s, noise)) @ random.T, alone, random


def residual_of(s: Setup) -> np.ndarray:
    return Target(s, ()).residual(s.first_law)


def whole_inverse(inverse: Inverse, columns: ModelColumns) -> np.ndarray:
    """The whole matrices in the order of :meth:`ModelColumns.vector`, (r, p + q, p + q)."""
    r, specimens, _, m = inverse.across.shape
    e = OF_A_SPECIMEN
    wide = inverse.across.reshape(r, e * specimens, m)
    own = wide @ inverse.border @ wide.transpose(0, 2, 1)
    for k in range(specimens):
        own[:, e * k : e * k + e, e * k : e * k + e] += inverse.own[:, k]
    side = -wide @ inverse.border
    whole = np.block([[own, side], [side.transpose(0, 2, 1), inverse.border]])
    numbers = np.arange(whole.shape[1], dtype=float)[None]
    own, shared = numbers[:, : e * specimens].reshape(1, -1, e), numbers[:, e * specimens :]
    order = columns.vector(own, shared)[0].astype(int)
    return np.asarray(whole[:, order][:, :, order])

def step_from(s: Setup, state: FitState, jacobian: np.ndarray, bounds: Any) -> tuple[Inverse, np.ndarray, ModelColumns]:
    """One step of a fit: the inverse of the normal matrix, the solution, and the columns of the model."""
    columns = model_columns(jacobian, s)
    return *solved(state, columns, weights(s, state), bounds), columns


def at_the_mode(s: Setup, noise: Noise) -> FitState:
    """The random effects that are most likely given the tests."""
    residual = residual_of(s)
    whole, _, random = dense(s, noise)
    effects = np.diag(of_effects(s, noise)) @ random.T @ np.linalg.solve(whole, residual.ravel())
    return state_at(s, s.first_law, effects, residual, noise)


def test_the_score_is_the_log_density_of_one_normal_vector_and_that_of_the_sizes() -> None:
    s = campaign()
    noise = noise_of(s)
    score, weight = scored(s, at_the_mode(s, noise))
    n = s.observations.n
    density = multivariate_normal(np.zeros(2 * n), dense(s, noise)[0]).logpdf(residual_of(s).ravel())
    assert score == pytest.approx(density + n * np.log(2 * np.pi) + log_prior(s, noise), abs=1e-4)
    assert weight == pytest.approx(1.0)


def test_the_penalised_density_falls_by_the_tests_and_by_the_effects() -> None:
    s, rng = campaign(), np.random.default_rng(2)
    noise = noise_of(s, tail=6.0)
    effects = 0.05 * rng.normal(size=len(s.group))
    state = state_at(s, s.first_law, effects, residual_of(s), noise)
    left = (residual_of(s).ravel() - dense(s, noise)[2] @ effects).reshape(-1, 2)
    distance = [x @ np.linalg.solve(v, x) for x, v in zip(left, of_tests(s, noise), strict=True)]
    tests = -0.5 * (6.0 + 2.0) * np.sum(np.log1p(np.array(distance) / 6.0))
    assert penalised(s, state) == pytest.approx(tests - 0.5 * np.sum(effects**2 / of_effects(s, noise)))
    expected = 8.0 / (6.0 + np.array(distance))
    assert weights(s, state) == pytest.approx(expected)


def test_the_noise_begins_as_expected() -> None:
    assert first_noise().sizes[:SPECIMEN_DRIFT] == pytest.approx(SIZE_PRIORS[:SPECIMEN_DRIFT, 0])
    assert first_noise().sizes[SPECIMEN_DRIFT:] == pytest.approx(FIRST_NUISANCE)
    assert first_noise().repeat == pytest.approx(REPEAT_PRIOR[0] ** 2 * np.eye(2))


def test_whitened_tests_have_unit_covariance() -> None:
    s = campaign()
    factor, cov = whitener(s, noise_of(s)), of_tests(s, noise_of(s))
    assert factor @ cov @ factor.transpose(0, 2, 1) == pytest.approx(np.broadcast_to(np.eye(2), cov.shape), abs=1e-12)
    assert not factor[:, 0, 1].any()
    columns = np.random.default_rng(1).normal(size=(s.observations.n, 2, 3))
    expected = np.einsum("nij,njk->ink", factor, columns).reshape(-1, 3)
    assert whitened(factor, columns) == pytest.approx(expected)


def test_a_step_is_that_of_generalised_least_squares() -> None:
    s = campaign()
    noise, target = noise_of(s), Target(s, ())
    x = s.first_law
    state = at_the_mode(s, noise)
    jacobian = target.jacobian(x, target.predict(x))
    inverse, solution, columns = step_from(s, state, jacobian, target.bounds)
    whole, flat = dense(s, noise)[0], jacobian.reshape(-1, 4)
    information = flat.T @ np.linalg.solve(whole, flat)
    step = np.linalg.solve(information, flat.T @ np.linalg.solve(whole, residual_of(s).ravel()))
    assert solution[:4] == pytest.approx(step, rel=1e-4, abs=1e-7)
    assert whole_inverse(inverse, columns)[0, :4, :4] == pytest.approx(np.linalg.inv(information), rel=1e-4)
    assert inverse.border[0, :4, :4] == pytest.approx(np.linalg.inv(information), rel=1e-4)
    left = residual_of(s).ravel() - flat @ step
    effects = np.diag(of_effects(s, noise)) @ dense(s, noise)[2].T @ np.linalg.solve(whole, left)
    assert solution[4:] == pytest.approx(effects, rel=1e-3, abs=1e-6)


@pytest.mark.parametrize("side", [0, 1])
def test_a_parameter_at_a_bound_that_would_leave_it_is_held_and_the_others_are_fitted_without_it(side: int) -> None:
    s = campaign()
    noise, target = noise_of(s), Target(s, ())
    state = at_the_mode(s, noise)
    jacobian = target.jacobian(s.first_law, target.predict(s.first_law))
    free = step_from(s, state, jacobian, target.bounds)[1][:4]
    outward = free < 0 if side == 0 else free > 0
    held = int(np.flatnonzero(outward)[0])
    bounds = tuple(b.copy() for b in target.bounds)
    bounds[side][held] = s.first_law[held]
    inverse, solution, columns = step_from(s, state, jacobian, bounds)
    assert solution[held] == 0.0
    assert not whole_inverse(inverse, columns)[0, held].any()
    others = [k for k in range(4) if k != held]
    whole, flat = dense(s, noise)[0], jacobian.reshape(-1, 4)[:, others]
    information = flat.T @ np.linalg.solve(whole, flat)
    step = np.linalg.solve(information, flat.T @ np.linalg.solve(whole, residual_of(s).ravel()))
    assert solution[others] == pytest.approx(step, rel=1e-4, abs=1e-7)
    inward = bounds[1 - side].copy()
    inward[held] = s.first_law[held]
    kept = (target.bounds[0], inward) if side == 0 else (inward, target.bounds[1])
    assert step_from(s, state, jacobian, kept)[1][:4] == pytest.approx(free, rel=1e-6)


def test_cleared_columns_have_the_informations_and_scores_of_the_marginal_model() -> None:
    s, rng = campaign(), np.random.default_rng(3)
    noise, target = noise_of(s), Target(s, ())
    at = at_the_mode(s, noise)
    jacobian = target.jacobian(s.first_law, target.predict(s.first_law))
    weight = 0.5 + rng.random(s.observations.n)
    fitted = {"residual": residual_of(s), "factor": at.factor, "precision": at.precision, "weight": weight}
    linear = replace(fit(s, noise=noise), jacobian=jacobian, **fitted)
    columns = rng.normal(size=(s.observations.n, 2, 2))
    left, cleared = linear.cleared(columns)
    alone = np.zeros((2 * s.observations.n,) * 2)
    for k, own in enumerate(of_tests(s, noise) / weight[:, None, None]):
        alone[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = own
    random = dense(s, noise)[2]
    precision = np.linalg.inv(alone + random @ np.diag(of_effects(s, noise)) @ random.T)
    flat, extra = jacobian.reshape(-1, 4), columns.reshape(-1, 2)
    rest = precision - precision @ flat @ np.linalg.solve(flat.T @ precision @ flat, flat.T @ precision)
    assert left.T @ left == pytest.approx(extra.T @ rest @ extra, rel=1e-4)
    assert left.T @ cleared == pytest.approx(extra.T @ rest @ residual_of(s).ravel(), rel=1e-3, abs=1e-4)
    beyond = linear.beyond_law(columns).reshape(-1, 2)
    expected = extra - flat @ np.linalg.lstsq(flat, extra, rcond=None)[0]
    assert beyond == pytest.approx(expected, abs=1e-9)


def test_the_density_of_the_sizes_is_a_scaled_inverse_chi_of_each_and_an_inverse_wishart_of_the_repeats() -> None:
    s = campaign()
    noise = noise_of(s)
    size, worth = REPEAT_PRIOR
    expected = -0.5 * worth * (np.log(np.linalg.det(noise.repeat)) + size**2 * np.trace(np.linalg.inv(noise.repeat)))
    for k, (wanted, weight) in enumerate(SIZE_PRIORS):
        found = noise.sizes[k]
        each = -weight * np.log(found) - 0.5 * weight * wanted**2 / found**2
        assert log_size_prior(k, np.array(found)) == pytest.approx(each)
        expected += each if k in s.group else 0.0
    assert noise.scatter is not None
    expected -= 0.5 * np.sum(noise.scatter**2) / SCATTER_SD**2
    assert log_prior(s, noise) == pytest.approx(expected)
    alike = replace(noise, scatter=None)
    assert log_prior(s, alike) == pytest.approx(expected + 0.5 * np.sum(noise.scatter**2) / SCATTER_SD**2)
    fixed = replace(s, group=np.where(s.group == PATTERN, FIXED, s.group))
    assert log_prior(fixed, noise) == pytest.approx(expected - float(log_size_prior(PATTERN, noise.sizes[PATTERN])))


def test_the_sizes_of_a_noise_are_those_it_is_given() -> None:
    noise = noise_of(campaign())
    s = campaign()
    assert prior_sd(s, noise.sizes) ** 2 == pytest.approx(of_effects(s, noise))
    both = prior_sd(s, np.array([noise.sizes, 2 * noise.sizes]))
    assert both[1] == pytest.approx(2 * both[0])
    assert noise.per_test(s) + s.observations.reading[:, :, None] ** 2 * np.eye(2) == pytest.approx(of_tests(s, noise))
    alike = replace(noise, scatter=None).per_test(s)
    assert alike == pytest.approx(np.broadcast_to(noise.repeat, alike.shape))


def test_a_size_is_the_rms_of_its_effects_and_of_what_was_expected_before() -> None:
    """Effects known exactly count as one each, unknown ones not at all, and the expectation as what it is worth."""
    s = campaign()
    sizes = noise_of(s).sizes
    effects = np.arange(1.0, 1 + len(s.group)) * 0.01
    known = updated_sizes(s, sizes, effects, np.zeros(len(s.group)))
    unknown = updated_sizes(s, sizes, effects, prior_sd(s, sizes) ** 2)
    for k in np.unique(s.group):
        (wanted, worth), here = SIZE_PRIORS[k], s.group == k
        total = np.sum((effects[here] / s.unit[here]) ** 2) + worth * wanted**2
        assert known[k] ** 2 == pytest.approx(total / (here.sum() + worth))
        assert unknown[k] ** 2 == pytest.approx(total / worth)
    without = replace(s, group=np.where(s.group == SLOPE, FIXED, s.group))
    assert updated_sizes(without, sizes, effects, np.zeros(len(s.group)))[SLOPE] == sizes[SLOPE]


def test_repeats_that_are_as_expected_stay_as_they_are() -> None:
    """Squares of the size that the noise says: no step in the scatter, and a covariance that changes by its prior."""
    s = campaign()
    noise = noise_of(s)
    assert noise.scatter is not None
    quiet = replace(s, observations=replace(s.observations, reading=np.zeros((s.observations.n, 2))))
    expected = of_tests(quiet, noise)
    squares = np.array([expected[:, 0, 0], expected[:, 0, 1], expected[:, 1, 1]])
    at_zero = np.zeros(4)
    alike = replace(noise, scatter=at_zero)
    level = of_tests(quiet, alike)
    same = np.array([level[:, 0, 0], level[:, 0, 1], level[:, 1, 1]])
    repeat, scatter = updated_repeats(quiet, (noise.repeat, at_zero), same, NORMAL)
    size, worth = REPEAT_PRIOR
    n = s.observations.n
    assert scatter == pytest.approx(0.0, abs=1e-12)
    assert repeat == pytest.approx((n * noise.repeat + worth * size**2 * np.eye(2)) / (n + worth))
    # where the scatter is not zero the step goes towards zero by its prior alone, and keeps what is common at zero
    _, moved = updated_repeats(quiet, (noise.repeat, noise.scatter), squares, NORMAL)
    information = 4.0 * quiet.scatter.T @ quiet.scatter + np.eye(4) / SCATTER_SD**2
    step = noise.scatter + np.linalg.solve(information, -noise.scatter / SCATTER_SD**2)
    step[:3] -= step[:3].mean()
    assert moved == pytest.approx(step)


def test_a_sample_with_larger_squares_is_given_larger_repeats_by_one_scoring_step() -> None:
    s = campaign()
    quiet = replace(s, observations=replace(s.observations, reading=np.zeros((s.observations.n, 2))))
    repeat = np.diag([0.0064, 0.0064])
    squares = np.zeros((3, s.observations.n))
    squares[0] = squares[2] = 0.0064
    wide = s.observations.conditions.sample == "B"
    squares[:, wide] *= 1.5
    _, scatter = updated_repeats(quiet, (repeat, np.zeros(4)), squares, 8.0)
    information = 4.0 * 8.0 / 12.0 * s.scatter.T @ s.scatter + np.eye(4) / SCATTER_SD**2
    excess = np.where(wide, 1.0, 0.0)  # a squared distance of 3 where 2 are expected
    step = np.linalg.solve(information, s.scatter.T @ excess)
    step[:3] -= step[:3].mean()
    assert scatter == pytest.approx(step)
    assert scatter[1] > 0 > scatter[0]  # A, B, F
    squares[:, wide] *= 1e4
    _, far = updated_repeats(quiet, (repeat, np.zeros(4)), squares, 8.0)
    assert far[1] - far[0] <= 1.0 + 1e-12  # a step of half in each at the most


def test_what_the_readings_explain_is_not_ascribed_to_the_repeats() -> None:
    """Readings as large as the repeats: half of what is left, and half of its square uncertain, is of the repeats."""
    s = campaign()
    n = s.observations.n
    even = replace(s, observations=replace(s.observations, reading=np.full((n, 2), 0.08)))
    squares = np.array([np.full(n, 2 * 0.0064), np.zeros(n), np.full(n, 2 * 0.0064)])
    repeat, scatter = updated_repeats(even, (0.0064 * np.eye(2), np.zeros(4)), squares, NORMAL)
    assert repeat == pytest.approx(0.0064 * np.eye(2), abs=1e-9)
    assert scatter == pytest.approx(0.0, abs=1e-9)


def test_repeats_are_never_smaller_than_the_best_of_readings() -> None:
    s = campaign()
    nothing = np.zeros((3, s.observations.n))
    repeat, _ = updated_repeats(s, (1e-12 * np.eye(2), np.zeros(4)), nothing, 8.0)
    assert np.sqrt(np.linalg.eigvalsh(repeat)).min() >= SMALLEST_SD


def test_the_noise_is_estimated_from_what_is_left_and_from_how_uncertain_it_is() -> None:
    s = campaign()
    noise, target = replace(noise_of(s), tail=8.0), Target(s, ())
    state = at_the_mode(s, noise)
    jacobian = target.jacobian(s.first_law, target.predict(s.first_law))
    solved_inverse, _, columns = step_from(s, state, jacobian, target.bounds)
    after = with_noise_estimated(s, state, columns, weights(s, state), solved_inverse).noise
    left = residual_of(s) - s.dense @ state.effects
    inverse = whole_inverse(solved_inverse, columns)[0]
    spread = np.array([c @ inverse @ c.T for c in np.concatenate([jacobian, s.dense], axis=2)])
    square = weights(s, state)[:, None, None] * (left[:, :, None] * left[:, None, :] + spread)
    squares = np.array([square[:, 0, 0], square[:, 0, 1], square[:, 1, 1]])
    assert noise.scatter is not None
    repeat, scatter = updated_repeats(s, (noise.repeat, noise.scatter), squares, 8.0)
    sizes = updated_sizes(s, noise.sizes, state.effects, np.diag(inverse)[4:])
    assert after.repeat == pytest.approx(repeat)
    assert after.scatter == pytest.approx(scatter)
    assert after.sizes == pytest.approx(sizes)


def test_many_replicates_are_weighed_and_solved_as_each_by_dense_matrices() -> None:
    s, rng = campaign(), np.random.default_rng(4)
    noise, target = noise_of(s, tail=8.0), Target(s, ())
    n = s.observations.n
    repeats = fitted_noise(s, noise, 2)
    assert repeats[2].tolist() == [noise.sizes.tolist()] * 2
    of_random = prior_sd(s, repeats[2]) ** -2
    assert of_random == pytest.approx(np.array([1 / of_effects(s, noise)] * 2))
    inverse = np.linalg.inv(of_tests(s, noise))
    for found in (*inverse_noise(s, *repeats[:2]), inverse_noise(s, noise.repeat, np.asarray(noise.scatter))):
        assert found == pytest.approx(np.array([inverse[:, 0, 0], inverse[:, 0, 1], inverse[:, 1, 1]]))
    residual = 0.1 * rng.normal(size=(2, 2, n))
    assert products_of(residual)[1] == pytest.approx(
        np.array([residual[1, 0] ** 2, residual[1, 0] * residual[1, 1], residual[1, 1] ** 2])
    )
    weight = replicate_weights(inverse_noise(s, *repeats[:2]), residual, 8.0)
    distance = np.einsum("ran,nab,rbn->rn", residual, inverse, residual)
    assert weight == pytest.approx(10.0 / (8.0 + distance))
    jacobian = target.jacobian(s.first_law, target.predict(s.first_law))
    along = np.concatenate([jacobian, s.dense], axis=2).transpose(1, 0, 2).copy()
    columns = model_columns(jacobian, s)
    precision = inverse_noise(s, *repeats[:2]) * weight[:, None]
    inverted, (own, border) = solved_at_once(columns, precision, residual, of_random)
    spread, solution = whole_inverse(inverted, columns), columns.vector(own, border)
    for r in range(2):
        whole = np.einsum("ank,n,nab,bnl->kl", along, weight[r], inverse, along)
        right = np.einsum("ank,n,nab,bn->k", along, weight[r], inverse, residual[r])
        prior = np.concatenate([np.full(4, 1e-12), 1 / of_effects(s, noise)])
        expected = np.linalg.inv(whole + np.diag(prior))
        assert spread[r] == pytest.approx(expected, rel=1e-4, abs=1e-8)
        assert solution[r] == pytest.approx(expected @ right, rel=1e-3, abs=1e-6)
    assert columns.vector(*inverted.variances) == pytest.approx(np.diagonal(spread, axis1=1, axis2=2))
    added = np.einsum("ank,rk->ran", along, solution)
    assert columns.on_tests(own, border) == pytest.approx(added)
    moved = np.einsum("ank,rkl,bnl->rabn", along, spread, along)
    expected = np.stack([moved[:, 0, 0], moved[:, 0, 1], moved[:, 1, 1]], axis=1)
    assert inverted.spread(columns) == pytest.approx(expected, rel=1e-6)
    ready = replicates_at(s, columns, repeats, residual, 2 * residual, 8.0)
    assert ready.precision == pytest.approx(precision)
    assert ready.group.tolist() == s.group.tolist()
    assert ready.residual == pytest.approx(2 * residual)


def test_the_normal_matrix_by_blocks_is_the_dense_one() -> None:
    s, rng = campaign(), np.random.default_rng(6)
    target = Target(s, ())
    jacobian = target.jacobian(s.first_law, target.predict(s.first_law))
    columns = model_columns(jacobian, s)
    weight = 0.5 + rng.random(s.observations.n)
    inverse = np.linalg.inv(of_tests(s, noise_of(s))) * weight[:, None, None]
    precision = np.array([[inverse[:, 0, 0], inverse[:, 0, 1], inverse[:, 1, 1]]])
    along = np.concatenate([jacobian, s.dense], axis=2)
    whole = np.einsum("nak,nab,nbl->kl", along, inverse, along)
    found = columns.weighted(precision)
    normal = found.normal
    specimens = s.specimens
    last = 4 + OF_A_SPECIMEN * specimens
    here = np.arange(4, last).reshape(specimens, OF_A_SPECIMEN)
    border = np.concatenate([np.arange(4), np.arange(last, whole.shape[0])])
    for k, own in enumerate(here):
        assert normal.own[0, k] == pytest.approx(whole[np.ix_(own, own)])
        assert normal.across[0, k] == pytest.approx(whole[np.ix_(own, border)])
        for other in here[k + 1 :]:
            assert not whole[np.ix_(own, other)].any()
    assert normal.border[0] == pytest.approx(whole[np.ix_(border, border)])
    prior = columns.sides(np.linspace(1.0, 2.0, len(whole))[None])
    raised = whole + np.diag(np.linspace(1.0, 2.0, len(whole)))
    assert normal.with_prior(*prior).log_determinant()[0] == pytest.approx(np.linalg.slogdet(raised)[1])
    other = rng.normal(size=(s.observations.n, 2, 3))
    products = np.einsum("nak,nab,nbl->kl", along, inverse, other)
    own, shared = found.times(other)
    assert own[0] == pytest.approx(products[here])
    assert shared[0] == pytest.approx(products[border])
    residual = rng.normal(size=(s.observations.n, 2))
    right = np.einsum("nak,nab,nb->k", along, inverse, residual)
    assert columns.vector(*found.with_residual(residual.T[None]))[0] == pytest.approx(right)


def test_the_covariance_of_predictions_is_that_of_the_whole_matrix_and_random_effects_lie_on_their_own_tests() -> None:
    s, rng = campaign(), np.random.default_rng(7)
    values = rng.normal(size=(2, s.n_effects))
    assert s.on_tests(values) == pytest.approx(np.einsum("nak,rk->rna", s.dense, values))
    target = Target(s, ())
    state = at_the_mode(s, noise_of(s))
    jacobian = target.jacobian(s.first_law, target.predict(s.first_law))
    inverse, _, columns = step_from(s, state, jacobian, target.bounds)
    rows = np.array([0, 5, 6, 20])
    some = model_columns(np.zeros((len(rows), 2, 4)), s.take(rows))
    flat = np.concatenate([np.zeros((len(rows), 2, 4)), s.dense[rows]], axis=2).reshape(2 * len(rows), -1)
    expected = flat @ whole_inverse(inverse, columns)[0] @ flat.T
    assert inverse.between(some, s.specimen[rows]) == pytest.approx(expected)
    of_tests_alone = np.einsum("nanb->abn", expected.reshape(len(rows), 2, len(rows), 2))  # some specimens have none
    assert inverse.spread(some)[0] == pytest.approx(of_tests_alone[[0, 0, 1], [0, 1, 1]])


def test_steps_of_the_sizes_have_the_density_of_the_sizes_they_lead_to() -> None:
    s = campaign()
    sizes = fitted_noise(s, noise_of(s), 3)[2]
    found = log_priors(s, sizes, SIZE_STEPS)
    assert found.shape == (len(SIZE_STEPS), 3)
    for step, row in zip(SIZE_STEPS, found, strict=True):
        stepped = noise_of(s).sizes * np.exp(step)
        assert row == pytest.approx(sum(float(log_size_prior(k, v)) for k, v in enumerate(stepped) if k in s.group))
    only = replace(s, group=np.where(s.group == PATTERN, FIXED, s.group))
    fewer = log_priors(only, sizes, SIZE_STEPS[:1])[0]
    assert fewer == pytest.approx(found[0] - float(log_size_prior(PATTERN, noise_of(s).sizes[PATTERN])))
