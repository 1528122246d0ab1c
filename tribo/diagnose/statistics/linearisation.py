"""One campaign at given noise: whitening, normal equations, likelihood; and the fitted model, linear about its
parameters, with what its own columns can absorb of others.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from tribo.diagnose.statistics.model import Acting, Setup, StartChanges, start_changes
from tribo.diagnose.statistics.scatter import AtNoise, Noise, at_estimated_noise, at_noise
from tribo.display import displayed
from tribo.records import FloatArray

SEEN = 1e-3  # share of a mechanism's effect that must be left once the flat law is free


@displayed()
@dataclass(frozen=True)
class State:
    """Where a fit has got to: parameters, random effects (q,), residual (n, 2) without them, and the noise."""

    x: FloatArray
    effects: FloatArray
    residual: FloatArray
    at: AtNoise


@displayed()
@dataclass(frozen=True)
class System:
    """The normal equations of one iteration solved: the inverse of their matrix (p + q, p + q) and the step.

    ``weight`` (n,) is that of the tests, ``columns`` (n, 2, p + q) are those of the model.
    """

    inverse: FloatArray
    solution: FloatArray
    weight: FloatArray
    columns: FloatArray


def begin(s: Setup, x: FloatArray, residual: FloatArray, noise: Noise) -> State:
    """The state of a fit before its first step, all random effects zero."""
    return State(x, np.zeros(s.random.shape[2]), residual, at_noise(s, noise))


def weights(noise: Noise, factor: FloatArray, left: FloatArray) -> FloatArray:
    """Weight of every test under the bivariate t, one on average for normal noise, shape (n,)."""
    return (noise.tail + 2.0) / (noise.tail + distance(factor, left))


def distance(factor: FloatArray, left: FloatArray) -> FloatArray:
    """Squared length of what is left of every test, whitened, shape (n,)."""
    static = factor[:, 0, 0] * left[:, 0]
    return static**2 + (factor[:, 1, 0] * left[:, 0] + factor[:, 1, 1] * left[:, 1]) ** 2


def whitened(factor: FloatArray, columns: FloatArray) -> FloatArray:
    """Columns (n, 2, k) times the lower triangles ``factor`` (n, 2, 2), shape (2n, k), static rows first."""
    n = len(columns)
    white = np.empty((2 * n, columns.shape[2]))
    np.multiply(columns[:, 0], factor[:, 0, :1], out=white[:n])
    np.multiply(columns[:, 1], factor[:, 1, 1:], out=white[n:])
    white[n:] += columns[:, 0] * factor[:, 1, :1]
    return white


def solved(s: Setup, state: State, jacobian: FloatArray, bounds: tuple[FloatArray, FloatArray]) -> System:
    """One step under the weighted noise; a parameter at a bound that would leave it is held there."""
    x, p = state.x, len(state.x)
    weight = weights(state.at.noise, state.at.factor, _left(s, state))
    model = np.concatenate([jacobian, s.random], axis=2)
    both = np.concatenate([model, state.residual[:, :, None]], axis=2)
    white = whitened(state.at.factor * np.sqrt(weight)[:, None, None], both)
    columns, right = white[:, :-1], white[:, :-1].T @ white[:, -1]
    normal = columns.T @ columns + np.diag(np.concatenate([np.full(p, 1e-12), state.at.precision]))
    low, high = bounds
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
    return System(inverse, solution, weight, model)


def _inverse(matrix: FloatArray) -> FloatArray:
    """Inverse with unit diagonal scaling and a ridge that matters only where columns coincide."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    scaled = matrix * scale[:, None] * scale[None, :]
    return np.linalg.inv(scaled + 1e-9 * np.eye(len(matrix))) * scale[:, None] * scale[None, :]


def _left(s: Setup, state: State) -> FloatArray:
    """What is left of every test, (n, 2), random effects taken out."""
    return np.asarray(state.residual - s.random @ state.effects)


def penalised(s: Setup, state: State) -> float:
    """Log density of the tests given the effects, plus that of the effects, without constants of the noise."""
    tail = state.at.noise.tail
    tests = -0.5 * (tail + 2.0) * np.sum(np.log1p(distance(state.at.factor, _left(s, state)) / tail))
    return float(tests - 0.5 * np.sum(state.effects**2 * state.at.precision))


def with_noise_estimated(s: Setup, state: State, system: System) -> State:
    """The same state, the noise estimated anew; the system says how uncertain each prediction is."""
    left, q = _left(s, state), s.random.shape[2]
    columns, inverse = system.columns, system.inverse
    flat = columns.reshape(-1, columns.shape[2])
    blurred = np.einsum("nrk,nsk->nrs", (flat @ inverse).reshape(columns.shape), columns, optimize=True)
    squares = system.weight[:, None, None] * (left[:, :, None] * left[:, None, :] + blurred)
    effects = state.effects, np.diag(inverse)[-q:]
    return replace(state, at=at_estimated_noise(s, state.at, effects, squares[:, [0, 0, 1], [0, 1, 1]].T))


def scored(s: Setup, state: State) -> tuple[float, FloatArray]:
    """Log marginal likelihood by Laplace's method, with the priors of the noise sizes; and the weights of the tests."""
    weight = weights(state.at.noise, state.at.factor, _left(s, state))
    white = whitened(state.at.factor * np.sqrt(weight)[:, None, None], s.random)
    root = np.linalg.cholesky(white.T @ white + np.diag(state.at.precision))
    curvature = 2.0 * np.sum(np.log(np.diag(root)))
    scale = float(np.sum(np.log(state.at.factor[:, 0, 0] * state.at.factor[:, 1, 1])))
    prior = 0.5 * np.sum(np.log(state.at.precision)) + state.at.log_prior
    return float(penalised(s, state) + scale + prior - 0.5 * curvature), weight


@displayed()
@dataclass(frozen=True)
class Linear:
    """A fitted model linear about its parameters, with the noise at which it was fitted.

    ``jacobian`` (n, 2, p) is the derivative of ln T by law and mechanisms and ``random`` (n, 2, q) the design of the
    random effects, whose ``precision`` is (q,). ``residual`` (n, 2) is that of the fit; ``factor`` (n, 2, 2) whitens
    a test without its robust ``weight`` (n,).
    """

    jacobian: FloatArray = field(repr=False)
    random: FloatArray = field(repr=False)
    residual: FloatArray = field(repr=False)
    factor: FloatArray = field(repr=False)
    precision: FloatArray = field(repr=False)
    weight: FloatArray = field(repr=False)

    def cleared(self, stacked: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Columns (n, 2, k) and the residual, whitened, with law, mechanisms and random effects taken out.

        Their inner products are scores and informations of the marginal model: taking out penalised columns is
        an ordinary projection once the penalty is written as further rows.
        """
        model = np.concatenate([self.jacobian, self.random], axis=2)
        factor = self.factor * np.sqrt(self.weight)[:, None, None]
        white = whitened(factor, np.concatenate([model, stacked, self.residual[:, :, None]], axis=2))
        q, n_random = model.shape[2], self.random.shape[2]
        penalty = np.sqrt(np.concatenate([np.full(q - n_random, 1e-9), self.precision]))
        rows = np.zeros((q, white.shape[1]))
        rows[:, :q] = np.diag(penalty)
        full = np.concatenate([white, rows])
        scale = 1.0 / np.sqrt(np.sum(full[:, :q] ** 2, axis=0) + 1e-300)
        columns, others = full[:, :q] * scale, full[:, q:]
        normal = columns.T @ columns + 1e-9 * np.eye(q)
        others = others - columns @ np.linalg.solve(normal, columns.T @ others)
        return others[:, :-1], others[:, -1]

    def beyond_law(self, columns: FloatArray) -> FloatArray:
        """Columns (n, 2, k) less what the law and the mechanisms of the fit can absorb."""
        flat = self.jacobian.reshape(-1, self.jacobian.shape[2])
        q = np.linalg.qr(flat / np.maximum(np.linalg.norm(flat, axis=0), 1e-300))[0]
        rows = columns.reshape(-1, columns.shape[2])
        return np.asarray((rows - q @ (q.T @ rows)).reshape(columns.shape))


@displayed()
@dataclass(frozen=True)
class ModelFit:
    """A fitted model. ``residual`` (n, 2) is ln T measured minus the law without random effects.

    ``score`` is the log of the marginal likelihood (Laplace), ``covariance`` that of law, mechanism
    parameters and random effects together, ``effects`` (q,) the predicted random effects, ``linear`` the model
    linear about these parameters.
    """

    setup: Setup
    acting: tuple[Acting, ...]
    law: FloatArray
    values: tuple[FloatArray, ...]
    noise: Noise
    effects: FloatArray
    residual: FloatArray
    score: float
    covariance: FloatArray = field(repr=False)
    linear: Linear = field(repr=False)

    @property
    def weight(self) -> FloatArray:
        """How much each test counts, (n,)."""
        return self.linear.weight

    @property
    def predicted(self) -> FloatArray:
        return self.setup.observations.log_force - self.residual


@displayed()
@dataclass(frozen=True)
class StartEffects:
    """The effects of all candidates at their start values, made once for a fitted ``model``.

    ``left`` (rows, k) are the columns whitened and with the model's own taken out, ``target`` (rows,) the residual
    likewise. ``size`` (k,) is the peak-to-peak effect in ln T beyond the law. ``absorbed`` are the names of the
    mechanisms whose effect the calibration on the flat sample absorbs almost wholly, at every size that a fit would
    start from.
    """

    model: ModelFit
    changes: StartChanges
    left: FloatArray
    target: FloatArray
    size: FloatArray
    absorbed: frozenset[str]

    @property
    def acting(self) -> tuple[Acting, ...]:
        return self.changes.acting

    @property
    def length(self) -> FloatArray:
        """Of ``left``: the strength with which each would show, (k,)."""
        return np.asarray(np.sqrt(np.sum(self.left**2, axis=0)))


def start_effects(f: ModelFit) -> StartEffects:
    """The effects of all candidates on top of a fit."""
    changes = start_changes(f.setup, f.law)
    left, target = f.linear.cleared(changes.columns)
    absorbed = set()
    for name, columns in changes.every_start.items():
        kept = np.sum(f.linear.cleared(columns)[0] ** 2, axis=0)
        whole = np.sum(columns**2, axis=(0, 1)) / np.mean(np.diag(f.noise.repeat))
        if float(np.max(kept / np.maximum(whole, 1e-30))) < SEEN:
            absorbed.add(name)
    size = np.ptp(f.linear.beyond_law(changes.columns), axis=(0, 1))
    return StartEffects(f, changes, left, target, size, frozenset(absorbed))
