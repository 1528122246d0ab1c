"""Fitting the mixed model of a campaign: Gauss-Newton on law and mechanisms, robust weights, the noise estimated along
with them; and the fitted model, linear about its parameters, with what its own columns absorb of others.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import islice, product

import numpy as np
from numpy.typing import NDArray

from tribo.diagnostics.model import N_LAW, Acting, Setup, Target, predict
from tribo.diagnostics.normal_equations import Inverse, ModelColumns, Normal, Sides, Weighted, model_columns
from tribo.diagnostics.scatter import (
    Noise,
    first_noise,
    log_prior,
    prior_sd,
    updated_repeats,
    updated_sizes,
    whitener,
)
from tribo.display import displayed
from tribo.records import FloatArray

TRIAL_GAIN, END_GAIN = 0.5, 2e-3  # log likelihood that a step has to earn for another one to be made
STILL = 0.02  # standard errors of a step below which derivatives are not taken anew
AT_ONCE = 100  # columns that are written out at the same time
LENGTHS = (1.0, 0.5, 0.25, 0.1, 0.02)  # of a step that does not worsen the penalised likelihood: the first


@displayed()
@dataclass(frozen=True)
class FitState:
    """Where a fit has got to: parameters, random effects (q,), residual (n, 2) without them, and the noise.

    At this noise, ``factor`` (n, 2, 2) whitens the tests, ``precision`` (q,) is that of the random effects, and
    ``log_prior`` the log density of the sizes.
    """

    x: FloatArray
    effects: FloatArray
    residual: FloatArray
    noise: Noise
    factor: FloatArray
    precision: FloatArray
    log_prior: float

    def left(self, s: Setup) -> FloatArray:
        """What is left of every test, (n, 2), random effects taken out."""
        return np.asarray(self.residual - s.on_tests(self.effects))


def state_at(s: Setup, x: FloatArray, effects: FloatArray, residual: FloatArray, noise: Noise) -> FitState:
    """The state of a fit with these parameters and effects at this noise."""
    return FitState(
        x, effects, residual, noise, whitener(s, noise), prior_sd(s, noise.sizes) ** -2, log_prior(s, noise)
    )


def distance(factor: FloatArray, left: FloatArray) -> FloatArray:
    """Squared length of what is left of every test, whitened, shape (n,)."""
    static = factor[:, 0, 0] * left[:, 0]
    return static**2 + (factor[:, 1, 0] * left[:, 0] + factor[:, 1, 1] * left[:, 1]) ** 2


def weights(s: Setup, state: FitState) -> FloatArray:
    """Weight of every test under the bivariate t, one on average for normal noise, shape (n,)."""
    tail = state.noise.tail
    return (tail + 2.0) / (tail + distance(state.factor, state.left(s)))


def whitened(factor: FloatArray, columns: FloatArray) -> FloatArray:
    """Columns (n, 2, k) times the lower triangles ``factor`` (n, 2, 2), shape (2n, k), static rows first."""
    n = len(columns)
    white = np.empty((2 * n, columns.shape[2]))
    np.multiply(columns[:, 0], factor[:, 0, :1], out=white[:n])
    np.multiply(columns[:, 1], factor[:, 1, 1:], out=white[n:])
    white[n:] += columns[:, 0] * factor[:, 1, :1]
    return white


def precision_of(factor: FloatArray, weight: FloatArray) -> FloatArray:
    """Precision of every test from the triangles (n, 2, 2) that whiten it: static, mixed, sliding, (1, 3, n)."""
    first, second, third = factor[:, 0, 0], factor[:, 1, 0], factor[:, 1, 1]
    return (np.stack([first**2 + second**2, second * third, third**2]) * weight)[None]


def solved(
    state: FitState, columns: ModelColumns, weight: FloatArray, bounds: tuple[FloatArray, FloatArray]
) -> tuple[Inverse, FloatArray]:
    """The inverse of the normal matrix at the weighted noise and one step, (p + q,); a parameter at a bound that would
    leave it is held there."""
    x, p = state.x, len(state.x)
    weighted = columns.weighted(precision_of(state.factor, weight))
    normal = weighted.normal.with_prior(*columns.sides(columns.prior(state.precision[None])))
    right = weighted.with_residual(state.residual.T[None])
    held = np.zeros(columns.border.shape[2], bool)
    for _ in range(3):
        inverse = normal.inverse_without(held)
        solution = columns.vector(*inverse.solution(*right))[0]
        outward = ((x <= bounds[0]) & (solution[:p] < 0)) | ((x >= bounds[1]) & (solution[:p] > 0))
        if not (outward & ~held[:p]).any():
            break
        held[:p] |= outward
    return inverse, solution


def penalised(s: Setup, state: FitState) -> float:
    """Log density of the tests given the effects, plus that of the effects, without constants of the noise."""
    tail = state.noise.tail
    tests = -0.5 * (tail + 2.0) * np.sum(np.log1p(distance(state.factor, state.left(s)) / tail))
    return float(tests - 0.5 * np.sum(state.effects**2 * state.precision))


def with_noise_estimated(
    s: Setup, state: FitState, columns: ModelColumns, weight: FloatArray, inverse: Inverse
) -> FitState:
    """The same state, the noise estimated anew; the inverse says how uncertain each prediction is."""
    left, noise = state.left(s), state.noise
    products = np.stack([left[:, 0] ** 2, left[:, 0] * left[:, 1], left[:, 1] ** 2])
    squares = weight * (products + inverse.spread(columns)[0])
    variance = columns.vector(*inverse.variances)[0, columns.parameters :]
    sizes = updated_sizes(s, noise.sizes, state.effects, variance)
    scatter = np.zeros(s.scatter.shape[1]) if noise.scatter is None else noise.scatter
    repeat, scatter = updated_repeats(s, (noise.repeat, scatter), squares, noise.tail)
    estimated = replace(noise, repeat=repeat, scatter=scatter, sizes=sizes)
    return state_at(s, state.x, state.effects, state.residual, estimated)


def scored(s: Setup, state: FitState) -> tuple[float, FloatArray]:
    """Log marginal likelihood by Laplace's method, with the priors of the noise sizes; and the weights of the tests."""
    weight = weights(s, state)
    columns = model_columns(np.zeros((len(weight), 2, 0)), s)
    normal = columns.weighted(precision_of(state.factor, weight)).normal
    curvature = float(normal.with_prior(*columns.sides(state.precision[None])).log_determinant()[0])
    scale = float(np.sum(np.log(state.factor[:, 0, 0] * state.factor[:, 1, 1])))
    prior = 0.5 * np.sum(np.log(state.precision)) + state.log_prior
    return float(penalised(s, state) + scale + prior - 0.5 * curvature), weight


@displayed()
@dataclass(frozen=True)
class ModelFit:
    """A fitted model, linear about its parameters. ``residual`` (n, 2) is ln T measured minus the law without random
    effects.

    ``score`` is the log of the marginal likelihood (Laplace), ``inverse`` that of the normal matrix at the last
    step, nothing where a parameter is held at a bound; ``effects`` (q,) are the predicted random effects and
    ``precision`` (q,) is that of each. ``jacobian`` (n, 2, p) is the derivative of ln T by law and mechanisms;
    ``factor`` (n, 2, 2) whitens a test without its robust ``weight`` (n,).
    """

    setup: Setup
    acting: tuple[Acting, ...]
    law: FloatArray
    values: tuple[FloatArray, ...]
    noise: Noise
    effects: FloatArray
    residual: FloatArray
    score: float
    inverse: Inverse = field(repr=False)
    jacobian: FloatArray = field(repr=False)
    factor: FloatArray = field(repr=False)
    precision: FloatArray = field(repr=False)
    weight: FloatArray = field(repr=False)

    @property
    def covariance(self) -> FloatArray:
        """Of the parameters of law and mechanisms, (p, p)."""
        p = self.columns.parameters
        return self.inverse.border[0, :p, :p]

    @property
    def predicted(self) -> FloatArray:
        return self.setup.observations.log_force - self.residual

    @property
    def left(self) -> FloatArray:
        """What is left of every test, (n, 2), random effects taken out."""
        return np.asarray(self.residual - self.setup.on_tests(self.effects))

    @cached_property
    def columns(self) -> ModelColumns:
        """The columns of the model."""
        return model_columns(self.jacobian, self.setup)

    @cached_property
    def weighted(self) -> Weighted:
        """These columns times the precision of every test."""
        return self.columns.weighted(precision_of(self.factor, self.weight))

    @property
    def normal(self) -> Normal:
        """The normal matrix with the prior of the random effects."""
        return self.weighted.normal.with_prior(*self.columns.sides(self.columns.prior(self.precision[None])))

    @property
    def right(self) -> Sides:
        """Products of the columns with the residual."""
        return self.weighted.with_residual(self.residual.T[None])

    def cleared(self, stacked: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Columns (n, 2, k) and the residual, whitened, with law, mechanisms and random effects taken out.

        Their inner products are scores and informations of the marginal model: taking out penalised columns is
        an ordinary projection once the penalty is written as further rows.
        """
        columns, inverse = self.columns, self.normal.inverse()
        others = np.concatenate([stacked, self.residual[:, :, None]], axis=2)
        own, border = self.weighted.times(others)
        each = [inverse.solution(own[..., k], border[..., k]) for k in range(others.shape[2])]
        fitted = np.concatenate([columns.on_tests(*c) for c in each]).transpose(2, 1, 0)
        rows = whitened(self.factor * np.sqrt(self.weight)[:, None, None], others - fitted)
        root = np.sqrt(columns.prior(self.precision[None]))
        penalty = [-root * columns.vector(*c) for c in each]
        left = np.concatenate([rows, np.concatenate(penalty).T])
        return left[:, :-1], left[:, -1]

    def beyond_law(self, columns: FloatArray) -> FloatArray:
        """Columns (n, 2, k) less what the law and the mechanisms of the fit can absorb."""
        flat = self.jacobian.reshape(-1, self.jacobian.shape[2])
        q = np.linalg.qr(flat / np.maximum(np.linalg.norm(flat, axis=0), 1e-300))[0]
        rows = columns.reshape(-1, columns.shape[2])
        return np.asarray((rows - q @ (q.T @ rows)).reshape(columns.shape))

    def size_beyond_law(self, columns: Iterable[FloatArray]) -> FloatArray:
        """Peak-to-peak of each of many columns (n, 2) beyond what law and mechanisms absorb, (k,)."""
        rest, sizes = iter(columns), [np.zeros(0)]
        while batch := list(islice(rest, AT_ONCE)):
            sizes.append(np.ptp(self.beyond_law(np.stack(batch, axis=2)), axis=(0, 1)))
        return np.concatenate(sizes)


def fit(
    s: Setup,
    acting: Sequence[Acting] = (),
    *,
    start: ModelFit | None = None,
    noise: Noise | None = None,
    iterations: int = 30,
    to_the_end: bool = True,
) -> ModelFit:
    """The fit from the best start of the mechanisms' further parameters; a trial from each finds out which.

    ``noise`` given is kept; otherwise it is estimated along with everything else. A trial ends where a step no
    longer earns much; without ``to_the_end`` the best trial is what is returned.
    """
    law = start.law if start is not None else s.first_law
    first = noise or (start.noise if start is not None else first_noise())
    starts, target, estimate = _starts(acting, start), Target(s, tuple(acting)), noise is None
    if len(starts) > 1 or not to_the_end:
        begins = [np.concatenate([law, *values]) for values in starts]
        trials = [_fitted(target, x, first, estimate, (iterations, TRIAL_GAIN)) for x in begins]
        best = max(trials, key=lambda f: f.score)
        if not to_the_end:
            return best
        law, starts, first = best.law, [list(best.values)], best.noise if noise is None else noise
    return _fitted(target, np.concatenate([law, *starts[0]]), first, estimate, (iterations, END_GAIN))


def fit_without(f: ModelFit, out: NDArray[np.bool_]) -> ModelFit:
    """The same model, noise and all, fitted to the tests that ``out`` (n,) does not mark."""
    return fit(f.setup.take(~out), f.acting, start=f, iterations=12)


def residual_on_flat(f: ModelFit) -> FloatArray:
    """ln T measured over the model calibrated on the flat sample alone, shape (n, 2).

    The paper calibrates like this. A fit to all samples, which the statistics rest on, spreads the misfit of a pattern
    over the flat sample too. It stays what is shown where the flat sample was pulled at fewer than three loads.
    """
    c = f.setup.observations.conditions
    other = c.sample != f.setup.observations.flat
    if len(np.unique(np.round(c.normal_load_N[~other], 4))) < 3:
        return f.residual
    return f.setup.observations.log_force - predict(f.setup, fit_without(f, other).law, f.acting, f.values)


def _starts(acting: Sequence[Acting], start: ModelFit | None) -> list[list[FloatArray]]:
    """Start values: those of ``start`` for mechanisms it has, else a small amplitude and every try."""
    each = []
    known = {(a.mechanism.name, a.choice): v for a, v in zip(start.acting, start.values, strict=True)} if start else {}
    for a in acting:
        if (a.mechanism.name, a.choice) in known:
            each.append([known[a.mechanism.name, a.choice]])
            continue
        size = a.mechanism.amplitude
        tries = [(size.zero + 0.3 * (size.start - size.zero), *size.tries)]
        tries += [(p.start, *p.tries) for p in a.mechanism.parameters[1:]]
        each.append([np.array(values) for values in product(*tries)])
    return [list(values) for values in product(*each)]


def _fitted(target: Target, x: FloatArray, noise: Noise, estimate: bool, until: tuple[int, float]) -> ModelFit:
    """Steps from ``x`` until one earns less than a gain, both in ``until``; with ``estimate`` the noise is estimated
    along with them."""
    s, log_force = target.setup, target.setup.observations.log_force
    iterations, least_gain = until
    x = np.clip(x, *target.bounds)
    p = len(x)
    residual = target.residual(x)
    jacobian = target.jacobian(x, log_force - residual)
    state = state_at(s, x, np.zeros(s.n_effects), residual, noise)
    score, weight = -np.inf, np.zeros(0)
    for _ in range(iterations):
        columns, weight = model_columns(jacobian, s), weights(s, state)
        inverse, solution = solved(state, columns, weight, target.bounds)
        before = state
        least = penalised(s, before) - 1e-9
        for length in LENGTHS:
            x = np.clip(before.x + length * solution[:p], *target.bounds)
            effects = before.effects + length * (solution[p:] - before.effects)
            trial = replace(before, x=x, effects=effects, residual=target.residual(x))
            if penalised(s, trial) >= least:
                state = trial
                break
        variance = np.diag(inverse.border[0])[:p]
        moved = float(np.max(np.abs(state.x - before.x) / np.sqrt(variance + 1e-300)))
        state = with_noise_estimated(s, state, columns, weight, inverse) if estimate else state
        last, (score, weight) = score, scored(s, state)
        if abs(score - last) < least_gain:
            break
        if moved > STILL:
            jacobian = target.jacobian(state.x, log_force - state.residual)
    jacobian = target.jacobian(state.x, log_force - state.residual)
    return ModelFit(
        s, target.acting, state.x[:N_LAW], target.values(state.x), state.noise, state.effects, state.residual, score,
        inverse, jacobian, state.factor, state.precision, weight,
    )  # fmt: skip
