"""Fitting a model: Gauss-Newton on law and mechanisms, robust weights, the noise estimated along with them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from tribo.diagnose.statistics.linearisation import (
    Linear,
    ModelFit,
    begin,
    penalised,
    scored,
    solved,
    with_noise_estimated,
)
from tribo.diagnose.statistics.model import N_LAW, Acting, Setup, Target, predict
from tribo.diagnose.statistics.scatter import Noise, first_noise
from tribo.records import FloatArray

TRIAL_GAIN, END_GAIN = 0.5, 2e-3  # log likelihood that a step has to earn for another one to be made
STILL = 0.02  # standard errors of a step below which derivatives are not taken anew
LENGTHS = (1.0, 0.5, 0.25, 0.1, 0.02)  # of a step that does not worsen the penalised likelihood: the first


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
    residual = target.residual(x)
    jacobian = target.jacobian(x, log_force - residual)
    state = begin(s, x, residual, noise)
    score, weight = -np.inf, np.zeros(0)
    for _ in range(iterations):
        system = solved(s, state, jacobian, target.bounds)
        before, p = state, len(state.x)
        least = penalised(s, before) - 1e-9
        for length in LENGTHS:
            x = np.clip(before.x + length * system.solution[:p], *target.bounds)
            effects = before.effects + length * (system.solution[p:] - before.effects)
            trial = replace(before, x=x, effects=effects, residual=target.residual(x))
            if penalised(s, trial) >= least:
                state = trial
                break
        variance = np.diag(system.inverse.border[0])[:p]
        moved = float(np.max(np.abs(state.x - before.x) / np.sqrt(variance + 1e-300)))
        state = with_noise_estimated(s, state, system) if estimate else state
        last, (score, weight) = score, scored(s, state)
        if abs(score - last) < least_gain:
            break
        if moved > STILL:
            jacobian = target.jacobian(state.x, log_force - state.residual)
    jacobian = target.jacobian(state.x, log_force - state.residual)
    return ModelFit(
        s, target.acting, state.x[:N_LAW], target.values(state.x), state.at.noise, state.effects, state.residual, score,
        system.inverse,
        Linear(jacobian, s.random_effects, state.residual, state.at.factor, state.at.precision, weight),
    )  # fmt: skip
