"""How strongly each look is followed, and how strongly by chance: the maximum over all looks, simulated."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc, ndtri

from tribo.diagnose.fit import fit, jacobian_at, prior_precision, weights, whitened, whitener
from tribo.diagnose.looks import Look
from tribo.diagnose.model import ModelFit
from tribo.records import FloatArray

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Screen:
    """Strength of every look as a standard normal deviate, and what chance gives.

    ``chance`` (replicates,) is the strongest look in each simulated campaign of the fitted model,
    ``chance_library`` the strongest of the mechanisms alone. ``size`` (looks,) is the peak-to-peak effect
    in ln T beyond what the law takes up, ``coefficients`` those of each look's columns.
    """

    looks: tuple[Look, ...]
    strength: FloatArray
    size: FloatArray
    coefficients: tuple[FloatArray, ...]
    chance: FloatArray
    chance_library: FloatArray

    def p_adjusted(self, strength: float | None = None) -> float:
        """Chance that some look is at least this strong (default: the strongest) with nothing hidden."""
        value = float(self.strength.max()) if strength is None else strength
        return _tail(self.chance, value)

    def p_library(self, strength: float) -> float:
        """Chance that some mechanism is at least this strong with nothing hidden."""
        return _tail(self.chance_library, strength)


def _tail(chance: FloatArray, value: float) -> float:
    """Share of replicates at or above, beyond the last one by a fitted Gumbel tail."""
    from scipy.stats import gumbel_r

    if not len(chance):
        return float("nan")
    counted = (1 + np.sum(chance >= value)) / (1 + len(chance))
    if counted > 5.0 / len(chance):
        return float(counted)
    scale = max(float(np.std(chance)) * np.sqrt(6) / np.pi, 1e-3)
    fitted = float(gumbel_r.sf(value, float(np.mean(chance)) - 0.5772 * scale, scale))
    return min(float(counted), max(fitted, 1e-12))


def screen(
    f: ModelFit,
    looks: Sequence[Look],
    *,
    replicates: int,
    rng: np.random.Generator,
    progress: Progress | None = None,
) -> Screen:
    """Look at a fitted model in every way, then do the same with ``replicates`` campaigns it makes itself.

    Each replicate keeps the design, draws specimens, sample errors and repeats anew and is fitted again.
    """
    stacked = np.concatenate([look.columns for look in looks], axis=2)
    ends = np.cumsum([look.freedom for look in looks])
    spans = [slice(int(e - look.freedom), int(e)) for look, e in zip(looks, ends, strict=True)]
    library = np.array([look.kind == "mechanism" for look in looks])
    strength, coefficients = _strengths(f, stacked, spans)
    shapes = [look.columns @ c for look, c in zip(looks, coefficients, strict=True)]
    size = np.ptp(beyond_law(f, np.stack(shapes, axis=2)), axis=(0, 1))
    chance, chance_library = np.zeros(replicates), np.zeros(replicates)
    for k in range(replicates):
        found = _strengths(replicate(f, rng), stacked, spans)[0]
        chance[k] = found.max()
        chance_library[k] = found[library].max() if library.any() else -np.inf
        if progress is not None and k % 20 == 0:
            progress("diagnose", k, replicates)
    return Screen(tuple(looks), strength, size, tuple(coefficients), chance, chance_library)


def replicate(f: ModelFit, rng: np.random.Generator) -> ModelFit:
    """A campaign made by the fitted model itself, fitted again from there."""
    log_force = simulate_log_force(f, rng)
    observations = replace(f.setup.observations, log_force=log_force)
    again = replace(f.setup, observations=observations)
    return fit(again, f.acting, start=replace(f, setup=again), iterations=4, to_the_end=False)


def simulate_log_force(f: ModelFit, rng: np.random.Generator) -> FloatArray:
    """ln T of the same tests with new specimens, sample errors and repeats; repeats resampled from the fit."""
    s = f.setup
    effects = rng.normal(size=s.random.shape[2]) / np.sqrt(prior_precision(s, f.noise))
    factor = whitener(s, f.noise)
    left = np.einsum("nij,nj->ni", factor, f.residual - s.random @ f.effects)
    left = (left - left.mean(axis=0)) * np.sqrt(s.observations.n / (s.observations.n - 4.0))
    drawn = left[rng.integers(0, s.observations.n, s.observations.n)]
    noise = np.linalg.solve(factor, drawn[:, :, None])[:, :, 0]
    return f.predicted + s.random @ effects + noise


def _strengths(
    f: ModelFit, stacked: FloatArray, spans: Sequence[slice]
) -> tuple[FloatArray, list[FloatArray]]:
    """Score test of each group of columns given the fitted model, as normal deviates, and its coefficients."""
    extra, crossed, target = _whitened_system(f, stacked)
    pull = extra.T @ target - crossed[:, :-1].T @ crossed[:, -1]
    squares = np.sum(extra**2, axis=0) - np.sum(crossed[:, :-1] ** 2, axis=0)
    squares = np.maximum(squares, 1e-9 * np.sum(extra**2, axis=0) + 1e-12)
    freedom = np.array([span.stop - span.start for span in spans])
    chi2, coefficients = np.zeros(len(spans)), []
    for k, span in enumerate(spans):
        if freedom[k] == 1:
            solution = pull[span] / squares[span]
        else:
            inner = crossed[:, span]
            own = extra[:, span].T @ extra[:, span] - inner.T @ inner
            solution = np.linalg.solve(own + np.diag(1e-9 * squares[span]), pull[span])
        coefficients.append(solution)
        chi2[k] = pull[span] @ solution
    return deviate(chi2, freedom), coefficients


def _whitened_system(f: ModelFit, stacked: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Whitened columns (2n, k), their part (q, k + 1) along the model, and the whitened residual (2n,).

    The model's columns are law, mechanisms and random effects, these with their penalty; the last column of the
    part is that of the residual. Inner products of whitened columns less those of their parts are scores and
    informations of the marginal model.
    """
    from scipy.linalg import solve_triangular

    s = f.setup
    weight = weights(s, f.noise, f.residual - s.random @ f.effects)
    model = np.concatenate([jacobian_at(f), s.random, f.residual[:, :, None]], axis=2)
    white, extra = whitened(s, f.noise, weight, model), whitened(s, f.noise, weight, stacked)
    columns, target = white[:, :-1], white[:, -1]
    n_law = columns.shape[1] - s.random.shape[2]
    normal = columns.T @ columns + np.diag(np.concatenate([np.zeros(n_law), prior_precision(s, f.noise)]))
    scale = 1.0 / np.sqrt(np.diag(normal) + 1e-300)
    root = np.linalg.cholesky(normal * scale[:, None] * scale[None, :] + 1e-9 * np.eye(len(scale)))
    along = np.column_stack([columns.T @ extra, columns.T @ target]) * scale[:, None]
    return extra, solve_triangular(root, along, lower=True, check_finite=False), target


def cleared(f: ModelFit, stacked: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Columns (n, 2, k) and the residual, whitened, with law, mechanisms and random effects taken out.

    Their inner products are scores and informations of the marginal model: taking out penalised columns is
    an ordinary projection once the penalty is written as further rows.
    """
    s = f.setup
    weight = weights(s, f.noise, f.residual - s.random @ f.effects)
    model = np.concatenate([jacobian_at(f), s.random], axis=2)
    white = whitened(s, f.noise, weight, np.concatenate([model, stacked, f.residual[:, :, None]], axis=2))
    q, n_random = model.shape[2], s.random.shape[2]
    penalty = np.sqrt(np.concatenate([np.full(q - n_random, 1e-9), prior_precision(s, f.noise)]))
    rows = np.zeros((q, white.shape[1]))
    rows[:, :q] = np.diag(penalty)
    full = np.concatenate([white, rows])
    scale = 1.0 / np.sqrt(np.sum(full[:, :q] ** 2, axis=0) + 1e-300)
    columns, others = full[:, :q] * scale, full[:, q:]
    normal = columns.T @ columns + 1e-9 * np.eye(q)
    others = others - columns @ np.linalg.solve(normal, columns.T @ others)
    return others[:, :-1], others[:, -1]


def deviate(chi2: FloatArray, freedom: FloatArray) -> FloatArray:
    """The standard normal deviates as rare, two-sided, as chi-squared values; beyond 1e-14 by asymptotics."""
    chi2 = np.maximum(chi2, 0.0)
    p = chdtrc(freedom, chi2)
    far = np.sqrt(chi2) - 0.5 * np.sqrt(np.maximum(freedom - 1.0, 0.0))
    near = np.maximum(-ndtri(np.maximum(0.5 * p, 1e-300)), 0.0)
    return np.where(freedom == 1, np.sqrt(chi2), np.where(p > 1e-14, near, far))


def beyond_law(f: ModelFit, columns: FloatArray) -> FloatArray:
    """Columns (n, 2, k) less what law and mechanisms of the fit can take up."""
    flat = jacobian_at(f).reshape(-1, len(np.concatenate([f.law, *f.values])))
    q = np.linalg.qr(flat / np.maximum(np.linalg.norm(flat, axis=0), 1e-300))[0]
    rows = columns.reshape(-1, columns.shape[2])
    return np.asarray((rows - q @ (q.T @ rows)).reshape(columns.shape))
