"""How strongly each look is followed, and how strongly by chance: the maximum over all looks, simulated."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, ndtri

from tribo.diagnose.search.looks import Look
from tribo.diagnose.statistics.chance import as_measured, columns_of, drawn_residuals, refit, scores
from tribo.diagnose.statistics.fit import jacobian_at, whitened
from tribo.diagnose.statistics.model import ModelFit
from tribo.diagnose.statistics.scatter import prior_precision, weights, whitener
from tribo.records import FloatArray

Progress = Callable[[str, int, int], None]
AT_ONCE = 20  # replicates, between two looks at whether they suffice
FEWEST = 40


@dataclass(frozen=True)
class Screen:
    """Strength of every look as a standard normal deviate, and what chance gives.

    ``chance`` (replicates,) is the strongest look in each simulated campaign of the fitted model,
    ``chance_library`` the strongest of the mechanisms alone. ``size`` (looks,) is the peak-to-peak effect
    in ln T that the calibration does not absorb, ``coefficients`` those of each look's columns.
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
    if not len(chance):
        return float("nan")
    counted = (1 + np.sum(chance >= value)) / (1 + len(chance))
    if counted > 5.0 / len(chance):
        return float(counted)
    scale = max(float(np.std(chance)) * np.sqrt(6) / np.pi, 1e-3)
    above_mode = (value - float(np.mean(chance))) / scale + np.euler_gamma
    fitted = float(-np.expm1(-np.exp(-above_mode)))
    return min(float(counted), max(fitted, 1e-12))


def screen(
    f: ModelFit,
    looks: Sequence[Look],
    *,
    replicates: int,
    rng: np.random.Generator,
    progress: Progress | None = None,
) -> Screen:
    """Look at a fitted model in every way, then do the same with up to ``replicates`` campaigns it makes itself.

    Replicates end once the strongest look is clearly within chance, or clearly beyond it.
    """
    stacked = np.concatenate([look.columns for look in looks], axis=2)
    ends = np.cumsum([look.freedom for look in looks])
    spans = [slice(int(e - look.freedom), int(e)) for e, look in zip(ends, looks, strict=True)]
    ready, freedom = columns_of(stacked, spans), np.array([look.freedom for look in looks])
    chi2, found = scores(as_measured(f), ready)
    strength, coefficients = deviate(chi2[0], freedom), [c[0] for c in found]
    shapes = [look.columns @ c for look, c in zip(looks, coefficients, strict=True)]
    size = np.ptp(beyond_law(f, np.stack(shapes, axis=2)), axis=(0, 1))
    library = np.array([look.kind == "mechanism" for look in looks])
    chance = np.zeros((0, 2))
    while len(chance) < replicates and not _decided(chance[:, 0], float(strength.max())):
        made = refit(f, drawn_residuals(f, rng, min(AT_ONCE, replicates - len(chance))))
        chance = np.concatenate([chance, _strongest(deviate(scores(made, ready)[0], freedom), library)])
        if progress is not None:
            progress("diagnose", len(chance), replicates)
    return Screen(tuple(looks), strength, size, tuple(coefficients), chance[:, 0], chance[:, 1])


def _strongest(strengths: FloatArray, library: NDArray[np.bool_]) -> FloatArray:
    """The strongest look of every replicate, and the strongest of the library's alone, (r, 2)."""
    alone = strengths[:, library].max(axis=1) if library.any() else np.full(len(strengths), -np.inf)
    return np.column_stack([strengths.max(axis=1), alone])


def _decided(chance: FloatArray, strongest: float) -> bool:
    """Whether further replicates could not change the decision at one percent: a sequential Monte Carlo test.

    Ten replicates as strong say "within chance" (Besag and Clifford 1991); ten standard deviations beyond
    their mean say the opposite.
    """
    if len(chance) < FEWEST:
        return False
    beyond = strongest > float(np.mean(chance) + 10.0 * np.std(chance))
    return bool(np.sum(chance >= strongest) >= 10 or beyond)


def cleared(f: ModelFit, stacked: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Columns (n, 2, k) and the residual, whitened, with law, mechanisms and random effects taken out.

    Their inner products are scores and informations of the marginal model: taking out penalised columns is
    an ordinary projection once the penalty is written as further rows.
    """
    s = f.setup
    factor = whitener(s, f.noise)
    weight = weights(s, f.noise, f.residual - s.random @ f.effects, factor)
    model = np.concatenate([jacobian_at(f), s.random], axis=2)
    factor = factor * np.sqrt(weight)[:, None, None]
    white = whitened(factor, np.concatenate([model, stacked, f.residual[:, :, None]], axis=2))
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
    """Columns (n, 2, k) less what the law and the mechanisms of the fit can absorb."""
    flat = jacobian_at(f).reshape(-1, len(np.concatenate([f.law, *f.values])))
    q = np.linalg.qr(flat / np.maximum(np.linalg.norm(flat, axis=0), 1e-300))[0]
    rows = columns.reshape(-1, columns.shape[2])
    return np.asarray((rows - q @ (q.T @ rows)).reshape(columns.shape))
