"""Fitting a model: Gauss-Newton on law and mechanisms, robust weights, expectation-maximisation of the noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from tribo.diagnose.statistics.model import N_LAW, Acting, ModelFit, Noise, Setup, predict
from tribo.records import FloatArray

SPECIMEN_PRIOR = (0.05, 4.0)  # expected gain of a specimen, and how many specimens that is worth
REPEAT_PRIOR = (0.08, 4.0)
TRIAL_GAIN, END_GAIN = 0.5, 2e-3  # log likelihood that a step has to earn for another one to be made
STILL = 0.02  # standard errors of a step below which derivatives are not taken anew
SMALLEST_SD = 0.003  # of ln T: no reading repeats better
_SCALE = np.array([1.0, 5.0, 1.0, 5.0])


@dataclass(frozen=True)
class System:
    """The normal equations of one iteration: columns whitened by noise and weights, prior on the effects."""

    columns: FloatArray  # (2n, p + q)
    target: FloatArray  # (2n,)
    inverse: FloatArray  # (p + q, p + q), the inverse of the normal matrix
    solution: FloatArray  # (p + q,)


def first_noise(s: Setup) -> Noise:
    """Where the estimation of the noise starts."""
    return Noise(np.diag([REPEAT_PRIOR[0] ** 2] * 2), np.array([SPECIMEN_PRIOR[0]] * 2))


def first_law(s: Setup) -> FloatArray:
    """A robust first guess of the flat law, one regime after the other."""
    c, law = s.observations.conditions, []
    for regime in (0, 1):
        force = np.exp(s.observations.log_force[:, regime])
        columns = [s.shares[:, 2 * regime] * c.normal_load_N, s.shares[:, 2 * regime + 1] * c.nominal_area_m2 * 1e3]
        design = np.column_stack(columns) / force[:, None]
        weight = np.ones(len(force))
        for _ in range(8):
            root = np.sqrt(weight)
            found = np.linalg.lstsq(design * root[:, None], root, rcond=None)[0]
            weight = 1.0 / (1.0 + ((design @ found - 1.0) / 0.15) ** 2)
        law += [max(float(found[0]), 0.05), float(found[1])]
    return np.array(law)


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
    starts = _starts(acting, start)
    if len(starts) > 1 or not to_the_end:
        trials = [
            _fit_from(s, tuple(acting), law, values, begin, noise is None, iterations, TRIAL_GAIN) for values in starts
        ]
        best = max(trials, key=lambda f: f.score)
        if not to_the_end:
            return best
        law, starts, begin = best.law, [list(best.values)], best.noise if noise is None else noise
    return _fit_from(s, tuple(acting), law, starts[0], begin, noise is None, iterations, END_GAIN)


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


def _fit_from(
    s: Setup,
    acting: tuple[Acting, ...],
    law: FloatArray,
    values: list[FloatArray],
    noise: Noise,
    estimate: bool,
    iterations: int,
    least_gain: float,
) -> ModelFit:
    sizes = [len(v) for v in values]
    x = np.concatenate([law, *values])
    low, high = _bounds(acting)
    effects, fitted = np.zeros(s.random.shape[2]), np.zeros((s.observations.n, 2))
    residual = s.observations.log_force - _predict(s, x, acting, sizes)
    score, jacobian, moved = -np.inf, np.zeros((0, 2, 0)), np.inf
    moments = np.einsum("nrp,nsq->rspq", s.random, s.random, optimize=True)
    for _ in range(iterations):
        if moved > STILL:
            jacobian = _jacobian(s, x, acting, sizes, s.observations.log_force - residual)
        factor = whitener(s, noise)
        weight = weights(s, noise, residual - fitted, factor)
        system = _solve(s, noise, factor, weight, jacobian, residual, x, low, high)
        before = x
        x, effects, residual = _step(s, acting, sizes, noise, factor, x, effects, residual, system, low, high)
        fitted = s.random @ effects
        moved = float(np.max(np.abs(x - before) / np.sqrt(np.diag(system.inverse)[: len(x)] + 1e-300)))
        if estimate:
            noise = _update(s, noise, weight, residual - fitted, effects, system, moments)
        last, score = score, _score(s, noise, residual, fitted, effects)
        if abs(score - last) < least_gain:
            break
    return ModelFit(
        s, acting, x[:N_LAW], tuple(np.split(x[N_LAW:], np.cumsum(sizes)[:-1])) if acting else (),
        noise, effects, residual, weights(s, noise, residual - fitted), score, system.inverse,
    )  # fmt: skip


def _bounds(acting: Sequence[Acting]) -> tuple[FloatArray, FloatArray]:
    lows = [np.array([0.01, -200.0, 0.01, -200.0]), *(a.mechanism.bounds()[0] for a in acting)]
    highs = [np.array([100.0, 1000.0, 100.0, 1000.0]), *(a.mechanism.bounds()[1] for a in acting)]
    return np.concatenate(lows), np.concatenate(highs)


def _predict(s: Setup, x: FloatArray, acting: Sequence[Acting], sizes: Sequence[int]) -> FloatArray:
    values = np.split(x[N_LAW:], np.cumsum(sizes)[:-1]) if acting else []
    return predict(s, x[:N_LAW], acting, values)


def _jacobian(
    s: Setup, x: FloatArray, acting: Sequence[Acting], sizes: Sequence[int], now: FloatArray
) -> FloatArray:
    """Forward differences, (n, 2, p); at an upper bound the step goes down."""
    scales = np.concatenate([_SCALE, *(np.abs(a.mechanism.start()) for a in acting)])
    high = _bounds(acting)[1]
    columns = []
    for k, scale in enumerate(scales):
        step = 1e-4 * max(scale, 1e-3 * abs(x[k]))
        step = -step if x[k] + step > high[k] else step
        moved = x.copy()
        moved[k] += step
        columns.append((_predict(s, moved, acting, sizes) - now) / step)
    return np.stack(columns, axis=2)


def jacobian_at(f: ModelFit) -> FloatArray:
    """Derivative of ln T by law and mechanism parameters at a fit, (n, 2, p)."""
    x = np.concatenate([f.law, *f.values])
    return _jacobian(f.setup, x, f.acting, [len(v) for v in f.values], f.predicted)


def whitener(s: Setup, noise: Noise) -> FloatArray:
    """Inverse Cholesky factor of the noise of every test, repeats plus reading, shape (n, 2, 2)."""
    cov = noise.repeat + s.observations.reading[:, :, None] ** 2 * np.eye(2)
    a = np.sqrt(cov[:, 0, 0])
    b = cov[:, 1, 0] / a
    c = np.sqrt(cov[:, 1, 1] - b**2)
    factor = np.zeros_like(cov)
    factor[:, 0, 0], factor[:, 1, 0], factor[:, 1, 1] = 1 / a, -b / (a * c), 1 / c
    return factor


def weights(s: Setup, noise: Noise, left: FloatArray, factor: FloatArray | None = None) -> FloatArray:
    """Weight of every test under the bivariate t, one on average for normal noise, shape (n,)."""
    return (noise.tail + 2.0) / (noise.tail + _distance(whitener(s, noise) if factor is None else factor, left))


def _distance(factor: FloatArray, left: FloatArray) -> FloatArray:
    """Squared length of what is left of every test, whitened, shape (n,)."""
    static = factor[:, 0, 0] * left[:, 0]
    return static**2 + (factor[:, 1, 0] * left[:, 0] + factor[:, 1, 1] * left[:, 1]) ** 2


def prior_precision(s: Setup, noise: Noise) -> FloatArray:
    """One over the variance of every random effect, shape (q,)."""
    sd = np.where(s.group >= 0, noise.specimen[np.maximum(s.group, 0)], s.fixed_sd)
    return 1.0 / sd**2


def whitened(
    s: Setup, noise: Noise, weight: FloatArray, columns: FloatArray, factor: FloatArray | None = None
) -> FloatArray:
    """Columns (n, 2, k) in units of the weighted noise, shape (2n, k), static rows first."""
    factor = (whitener(s, noise) if factor is None else factor) * np.sqrt(weight)[:, None, None]
    n = len(columns)
    white = np.empty((2 * n, columns.shape[2]))
    np.multiply(columns[:, 0], factor[:, 0, :1], out=white[:n])
    np.multiply(columns[:, 1], factor[:, 1, 1:], out=white[n:])
    white[n:] += columns[:, 0] * factor[:, 1, :1]
    return white


def _solve(
    s: Setup,
    noise: Noise,
    factor: FloatArray,
    weight: FloatArray,
    jacobian: FloatArray,
    residual: FloatArray,
    x: FloatArray,
    low: FloatArray,
    high: FloatArray,
) -> System:
    """One step; a parameter at a bound that would leave it is held there."""
    p = len(x)
    both = np.concatenate([jacobian, s.random, residual[:, :, None]], axis=2)
    white = whitened(s, noise, weight, both, factor)
    columns, target = white[:, :-1], white[:, -1]
    precision = np.concatenate([np.full(p, 1e-12), prior_precision(s, noise)])
    normal = columns.T @ columns + np.diag(precision)
    right = columns.T @ target
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
    return System(columns, target, inverse, solution)


def _inverse(matrix: FloatArray) -> FloatArray:
    """Inverse with unit diagonal scaling and a ridge that matters only where columns coincide."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    scaled = matrix * scale[:, None] * scale[None, :]
    return np.linalg.inv(scaled + 1e-9 * np.eye(len(matrix))) * scale[:, None] * scale[None, :]


def _step(
    s: Setup,
    acting: Sequence[Acting],
    sizes: Sequence[int],
    noise: Noise,
    factor: FloatArray,
    x: FloatArray,
    effects: FloatArray,
    residual: FloatArray,
    system: System,
    low: FloatArray,
    high: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The longest of a halved sequence of steps that does not worsen the penalised likelihood."""
    p = len(x)
    precision = prior_precision(s, noise)
    before = _penalised(noise, residual - s.random @ effects, effects, factor, precision)
    for length in (1.0, 0.5, 0.25, 0.1, 0.02):
        trial = np.clip(x + length * system.solution[:p], low, high)
        moved = effects + length * (system.solution[p:] - effects)
        left = s.observations.log_force - _predict(s, trial, acting, sizes)
        if _penalised(noise, left - s.random @ moved, moved, factor, precision) >= before - 1e-9:
            return trial, moved, left
    return x, effects, residual


def _penalised(
    noise: Noise, left: FloatArray, effects: FloatArray, factor: FloatArray, precision: FloatArray
) -> float:
    """Log density of the tests given the effects, plus that of the effects, without constants of the noise."""
    tests = -0.5 * (noise.tail + 2.0) * np.sum(np.log1p(_distance(factor, left) / noise.tail))
    return float(tests - 0.5 * np.sum(effects**2 * precision))


def _score(s: Setup, noise: Noise, residual: FloatArray, fitted: FloatArray, effects: FloatArray) -> float:
    """Log marginal likelihood by Laplace's method, with the priors of the noise sizes."""
    factor, precision = whitener(s, noise), prior_precision(s, noise)
    weight = weights(s, noise, residual - fitted, factor)
    white = whitened(s, noise, weight, s.random, factor)
    root = np.linalg.cholesky(white.T @ white + np.diag(precision))
    curvature = 2.0 * np.sum(np.log(np.diag(root)))
    scale = float(np.sum(np.log(factor[:, 0, 0] * factor[:, 1, 1])))
    size, worth = SPECIMEN_PRIOR
    prior = -0.5 * worth * np.sum(2 * np.log(noise.specimen) + (size / noise.specimen) ** 2)
    penalised = _penalised(noise, residual - fitted, effects, factor, precision)
    return float(penalised + scale + 0.5 * np.sum(np.log(precision)) - 0.5 * curvature + prior)


def _update(
    s: Setup,
    noise: Noise,
    weight: FloatArray,
    left: FloatArray,
    effects: FloatArray,
    system: System,
    moments: FloatArray,
) -> Noise:
    """One step of expectation-maximisation of the noise sizes, with weak priors; ``moments`` (2, 2, q, q) are the
    sums over the tests of products of the random columns."""
    q = s.random.shape[2]
    spread = system.inverse[-q:, -q:]
    variance = effects**2 + np.diag(spread)
    size, worth = SPECIMEN_PRIOR
    specimen = [
        np.sqrt((variance[s.group == r].sum() + worth * size**2) / ((s.group == r).sum() + worth)) for r in (0, 1)
    ]
    n = s.observations.n
    p = system.inverse.shape[0] - q
    total = (left * weight[:, None]).T @ left + np.sum(moments * spread, axis=(2, 3))
    size, worth = REPEAT_PRIOR
    reading = np.diag(np.mean(s.observations.reading**2, axis=0))
    repeat = (total + worth * size**2 * np.eye(2)) / (n - p / 2 + worth) - reading
    return replace(noise, repeat=_positive(repeat), specimen=np.array(specimen))


def _positive(cov: FloatArray) -> NDArray[np.float64]:
    """The nearest covariance with no standard deviation below 0.3 %."""
    values, vectors = np.linalg.eigh(0.5 * (cov + cov.T))
    return np.asarray((vectors * np.maximum(values, SMALLEST_SD**2)) @ vectors.T)
