"""Fitting a model: Gauss-Newton on law and mechanisms, robust weights, the noise estimated along with them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np
from numpy.typing import NDArray

from tribo.diagnose.statistics.model import N_LAW, Acting, ModelFit, Noise, Setup, first_law, predict
from tribo.diagnose.statistics.scatter import (
    distance,
    first_noise,
    log_prior,
    prior_precision,
    updated_repeats,
    updated_sizes,
    weights,
    whitener,
)
from tribo.records import FloatArray

TRIAL_GAIN, END_GAIN = 0.5, 2e-3  # log likelihood that a step has to earn for another one to be made
STILL = 0.02  # standard errors of a step below which derivatives are not taken anew
_SCALE = np.array([1.0, 5.0, 1.0, 5.0])


@dataclass(frozen=True)
class Target:
    """What is being fitted: a campaign, the mechanisms on top of the flat law, and their bounds."""

    setup: Setup
    acting: tuple[Acting, ...]

    @cached_property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        lows = [np.array([0.01, -200.0, 0.01, -200.0]), *(a.mechanism.bounds()[0] for a in self.acting)]
        highs = [np.array([100.0, 1000.0, 100.0, 1000.0]), *(a.mechanism.bounds()[1] for a in self.acting)]
        return np.concatenate(lows), np.concatenate(highs)

    @cached_property
    def scales(self) -> FloatArray:
        return np.concatenate([_SCALE, *(np.abs(a.mechanism.start()) for a in self.acting)])

    def values(self, x: FloatArray) -> tuple[FloatArray, ...]:
        """The parameters of each mechanism, out of those of all."""
        ends = N_LAW + np.cumsum([len(a.mechanism.parameters) for a in self.acting])
        return tuple(np.split(x[N_LAW:], ends[:-1] - N_LAW)) if self.acting else ()

    def predict(self, x: FloatArray) -> FloatArray:
        """ln T of every test, (n, 2)."""
        return predict(self.setup, x[:N_LAW], self.acting, self.values(x))

    def residual(self, x: FloatArray) -> FloatArray:
        return self.setup.observations.log_force - self.predict(x)

    def jacobian(self, x: FloatArray, now: FloatArray) -> FloatArray:
        """Forward differences, (n, 2, p); at an upper bound the step goes down."""
        columns = []
        for k, scale in enumerate(self.scales):
            step = 1e-4 * max(scale, 1e-3 * abs(x[k]))
            step = -step if x[k] + step > self.bounds[1][k] else step
            moved = x.copy()
            moved[k] += step
            columns.append((self.predict(moved) - now) / step)
        return np.stack(columns, axis=2)


@dataclass(frozen=True)
class State:
    """Where a fit has got to: parameters, random effects (q,), residual (n, 2) without them, and the noise."""

    x: FloatArray
    effects: FloatArray
    residual: FloatArray
    noise: Noise


@dataclass(frozen=True)
class System:
    """The normal equations of one iteration solved: the inverse of their matrix (p + q, p + q) and the step."""

    inverse: FloatArray
    solution: FloatArray


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
    law = start.law if start is not None else first_law(s)
    begin = noise or (start.noise if start is not None else first_noise(s))
    starts, target, estimate = _starts(acting, start), Target(s, tuple(acting)), noise is None
    if len(starts) > 1 or not to_the_end:
        states = [_begin(target, law, values, begin) for values in starts]
        trials = [_fitted(target, state, estimate, iterations, TRIAL_GAIN) for state in states]
        best = max(trials, key=lambda f: f.score)
        if not to_the_end:
            return best
        law, starts, begin = best.law, [list(best.values)], best.noise if noise is None else noise
    return _fitted(target, _begin(target, law, starts[0], begin), estimate, iterations, END_GAIN)


def fit_without(f: ModelFit, out: NDArray[np.bool_]) -> ModelFit:
    """The same model, noise and all, fitted to the tests that ``out`` (n,) does not mark."""
    fewer = f.setup.take(~out)
    start = replace(f, setup=fewer, residual=f.residual[~out], weight=f.weight[~out])
    return fit(fewer, f.acting, start=start, iterations=12)


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


def _begin(target: Target, law: FloatArray, values: Sequence[FloatArray], noise: Noise) -> State:
    x = np.concatenate([law, *values])
    return State(x, np.zeros(target.setup.random.shape[2]), target.residual(x), noise)


def _fitted(target: Target, state: State, estimate: bool, iterations: int, least_gain: float) -> ModelFit:
    """Steps until one earns less than ``least_gain``; with ``estimate`` the noise is estimated along with them."""
    s = target.setup
    score, jacobian, moved = -np.inf, np.zeros((0, 2, 0)), np.inf
    for _ in range(iterations):
        if moved > STILL:
            jacobian = target.jacobian(state.x, s.observations.log_force - state.residual)
        factor = whitener(s, state.noise)
        weight = weights(s, state.noise, _left(s, state), factor)
        system = _solve(target, state, jacobian, factor * np.sqrt(weight)[:, None, None])
        before = state.x
        state = _step(target, state, system, factor)
        moved = float(np.max(np.abs(state.x - before) / np.sqrt(np.diag(system.inverse)[: len(before)] + 1e-300)))
        if estimate:
            columns = np.concatenate([jacobian, s.random], axis=2)
            state = replace(state, noise=_updated(s, state, weight, columns, system.inverse))
        last, score = score, _score(s, state)
        if abs(score - last) < least_gain:
            break
    weight = weights(s, state.noise, _left(s, state))
    return ModelFit(
        s, target.acting, state.x[:N_LAW], target.values(state.x),
        state.noise, state.effects, state.residual, weight, score, system.inverse,
    )  # fmt: skip


def _left(s: Setup, state: State) -> FloatArray:
    """What is left of every test, (n, 2), random effects taken out."""
    return np.asarray(state.residual - s.random @ state.effects)


def jacobian_at(f: ModelFit) -> FloatArray:
    """Derivative of ln T by law and mechanism parameters at a fit, (n, 2, p)."""
    return Target(f.setup, f.acting).jacobian(np.concatenate([f.law, *f.values]), f.predicted)


def whitened(factor: FloatArray, columns: FloatArray) -> FloatArray:
    """Columns (n, 2, k) times the lower triangles ``factor`` (n, 2, 2), shape (2n, k), static rows first."""
    n = len(columns)
    white = np.empty((2 * n, columns.shape[2]))
    np.multiply(columns[:, 0], factor[:, 0, :1], out=white[:n])
    np.multiply(columns[:, 1], factor[:, 1, 1:], out=white[n:])
    white[n:] += columns[:, 0] * factor[:, 1, :1]
    return white


def _solve(target: Target, state: State, jacobian: FloatArray, factor: FloatArray) -> System:
    """One step under the weighted noise; a parameter at a bound that would leave it is held there."""
    s, x, p = target.setup, state.x, len(state.x)
    white = whitened(factor, np.concatenate([jacobian, s.random, state.residual[:, :, None]], axis=2))
    columns, right = white[:, :-1], white[:, :-1].T @ white[:, -1]
    precision = np.concatenate([np.full(p, 1e-12), prior_precision(s, state.noise)])
    normal = columns.T @ columns + np.diag(precision)
    low, high = target.bounds
    held = np.zeros(len(right), bool)
    for _ in range(3):
        free = ~held
        if held.any():
            inverse = np.zeros_like(normal)
            inverse[np.ix_(free, free)] = _inverse(normal[np.ix_(free, free)])
        else:
            inverse = _inverse(normal)
        solution = inverse @ right
        outward = ((x <= low) & (solution[:p] < 0)) | ((x >= high) & (solution[:p] > 0))
        if not (outward & ~held[:p]).any():
            break
        held[:p] |= outward
    return System(inverse, solution)


def _inverse(matrix: FloatArray) -> FloatArray:
    """Inverse with unit diagonal scaling and a ridge that matters only where columns coincide."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    scaled = matrix * scale[:, None] * scale[None, :]
    return np.linalg.inv(scaled + 1e-9 * np.eye(len(matrix))) * scale[:, None] * scale[None, :]


def _step(target: Target, state: State, system: System, factor: FloatArray) -> State:
    """The longest of a halved sequence of steps that does not worsen the penalised likelihood."""
    s, p = target.setup, len(state.x)
    before = _penalised(s, state, factor)
    for length in (1.0, 0.5, 0.25, 0.1, 0.02):
        x = np.clip(state.x + length * system.solution[:p], *target.bounds)
        effects = state.effects + length * (system.solution[p:] - state.effects)
        trial = replace(state, x=x, effects=effects, residual=target.residual(x))
        if _penalised(s, trial, factor) >= before - 1e-9:
            return trial
    return state


def _penalised(s: Setup, state: State, factor: FloatArray) -> float:
    """Log density of the tests given the effects, plus that of the effects, without constants of the noise."""
    tail = state.noise.tail
    tests = -0.5 * (tail + 2.0) * np.sum(np.log1p(distance(factor, _left(s, state)) / tail))
    return float(tests - 0.5 * np.sum(state.effects**2 * prior_precision(s, state.noise)))


def _score(s: Setup, state: State) -> float:
    """Log marginal likelihood by Laplace's method, with the priors of the noise sizes."""
    factor, precision = whitener(s, state.noise), prior_precision(s, state.noise)
    weight = weights(s, state.noise, _left(s, state), factor)
    white = whitened(factor * np.sqrt(weight)[:, None, None], s.random)
    root = np.linalg.cholesky(white.T @ white + np.diag(precision))
    curvature = 2.0 * np.sum(np.log(np.diag(root)))
    scale = float(np.sum(np.log(factor[:, 0, 0] * factor[:, 1, 1])))
    prior = 0.5 * np.sum(np.log(precision)) + log_prior(s, state.noise)
    return float(_penalised(s, state, factor) + scale + prior - 0.5 * curvature)


def _updated(s: Setup, state: State, weight: FloatArray, columns: FloatArray, inverse: FloatArray) -> Noise:
    """The noise estimated anew; ``columns`` (n, 2, p + q) with ``inverse`` say how uncertain each prediction is."""
    noise, left, q = state.noise, _left(s, state), s.random.shape[2]
    sizes = updated_sizes(s, noise.sizes, state.effects, np.diag(inverse)[-q:])
    flat = columns.reshape(-1, columns.shape[2])
    blurred = np.einsum("nrk,nsk->nrs", (flat @ inverse).reshape(columns.shape), columns, optimize=True)
    squares = weight[:, None, None] * (left[:, :, None] * left[:, None, :] + blurred)
    scatter = np.zeros(s.scatter.shape[1]) if noise.scatter is None else noise.scatter
    packed = squares[:, [0, 0, 1], [0, 1, 1]].T
    repeat, scatter = updated_repeats(s, (noise.repeat, scatter), packed, noise.tail)
    return replace(noise, repeat=repeat, scatter=scatter).with_sizes(sizes)
