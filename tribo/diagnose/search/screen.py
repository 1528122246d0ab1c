"""How strongly each look is followed, and how strongly by chance: the maximum over all looks, simulated."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, ndtri

from tribo.diagnose.search.looks import Look, all_looks
from tribo.diagnose.statistics.chance import as_measured, drawn_residuals, refit
from tribo.diagnose.statistics.courses import MOST_PAIRS, added
from tribo.diagnose.statistics.fit import fit
from tribo.diagnose.statistics.linearisation import ModelFit
from tribo.diagnose.statistics.model import start_changes, with_form_error
from tribo.diagnose.statistics.scatter import Replicates
from tribo.diagnose.statistics.scores import Columns, columns_of, scores
from tribo.display import displayed
from tribo.records import FloatArray

Progress = Callable[[str, int, int], None]
AT_ONCE = 20  # replicates, between two looks at whether they suffice
FEWEST = 40
FORM = 0.12  # by how much of its own effect a law may be wrong in form, sample by sample


@displayed()
@dataclass(frozen=True)
class Screen:
    """Strength of every look as a standard normal deviate, and what chance gives.

    ``p`` (looks,) is the adjusted p value of each. ``chance`` (replicates,) is the strongest look in each simulated
    campaign of the fitted model, ``chance_library`` the strongest of the mechanisms alone. ``size`` (looks,) is the
    peak-to-peak effect in ln T that the calibration does not absorb, ``coefficients`` those of each look's columns.
    """

    looks: tuple[Look, ...]
    strength: FloatArray
    size: FloatArray
    coefficients: tuple[FloatArray, ...]
    chance: FloatArray
    chance_library: FloatArray
    p: FloatArray

    def without_columns(self) -> Screen:
        """The same without the columns of the looks, which are large."""
        return replace(self, looks=tuple(replace(look, courses=()) for look in self.looks))

    def p_adjusted(self, strength: float | None = None) -> float:
        """Chance that some look is at least this strong (default: the strongest) with nothing hidden."""
        value = float(self.strength.max()) if strength is None else strength
        return share_beyond(self.chance, value)

    def p_library(self, strength: float) -> float:
        """Chance that some mechanism is at least this strong with nothing hidden."""
        return share_beyond(self.chance_library, strength)


def share_beyond(chance: FloatArray, value: float) -> float:
    """Share of replicates (r,) at or above a value, beyond the last one by a fitted Gumbel tail; NaN without any."""
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
    whole = np.array([look.wholeness for look in looks])
    ready = columns_of([look.courses for look in looks], whole, f.setup.observations.n)
    strengths, found = strengths_of(as_measured(f), ready)
    strength, coefficients = strengths[0], [c[0] for c in found]
    library = np.array([look.kind == "mechanism" for look in looks])
    chance = np.zeros((0, 2))
    while len(chance) < replicates:
        drawn = drawn_residuals(f, rng, min(AT_ONCE, replicates - len(chance)))
        made = refit(f, drawn)
        strengths, _ = strengths_of(made, ready)
        chance = np.concatenate([chance, _strongest(strengths, library)])
        if progress is not None:
            progress("diagnose", len(chance), replicates)
        if decided(chance[:, 0], float(strength.max())):
            break
    shown = _shown(looks, strength)
    looks, strength, coefficients = [looks[k] for k in shown], strength[shown], [coefficients[k] for k in shown]
    size = f.linear.size_beyond_law(
        added(look.courses) @ c for look, c in zip(looks, coefficients, strict=True)
    )
    p = np.array([share_beyond(chance[:, 0], float(value)) for value in strength])
    return Screen(tuple(looks), strength, size, tuple(coefficients), chance[:, 0], chance[:, 1], p)


def _shown(looks: Sequence[Look], strength: FloatArray) -> list[int]:
    """Which looks are shown: of those at two specimens the MOST_PAIRS strongest, and all others. Chance counts all."""
    pairs = [k for k, look in enumerate(looks) if len(look.courses) > 1]
    if len(pairs) <= MOST_PAIRS:
        return list(range(len(looks)))
    weaker = set(sorted(pairs, key=lambda k: -strength[k])[MOST_PAIRS:])
    return [k for k in range(len(looks)) if k not in weaker]


def allowed_wrong_form(model: ModelFit, allowed: int = 0) -> ModelFit:
    """The model with its laws allowed to be wrong in form by a share of their own effect; the first ``allowed`` of them
    are already."""
    acting, values = model.acting[allowed:], model.values[allowed:]
    wider = with_form_error(model.setup, model.law, acting, values, FORM)
    return fit(wider, model.acting, start=model, iterations=10)


def screen_left(
    model: ModelFit, *, replicates: int, rng: np.random.Generator, progress: Progress | None = None, allowed: int = 0
) -> Screen:
    """What is left after a model, its laws allowed to be wrong in form (:func:`allowed_wrong_form`)."""
    widened = allowed_wrong_form(model, allowed)
    looks = all_looks(widened.setup, start_changes(widened.setup, widened.law))
    return screen(widened, looks, replicates=replicates, rng=rng, progress=progress)


def _strongest(strengths: FloatArray, library: NDArray[np.bool_]) -> FloatArray:
    """The strongest look of every replicate, and the strongest of the library's alone, (r, 2)."""
    alone = strengths[:, library].max(axis=1) if library.any() else np.full(len(strengths), -np.inf)
    return np.column_stack([strengths.max(axis=1), alone])


def decided(chance: FloatArray, strongest: float, fewest: int = FEWEST) -> bool:
    """Whether further replicates could not change the decision at one percent: a sequential Monte Carlo test.

    Ten replicates as strong say "within chance" (Besag and Clifford 1991); ten standard deviations beyond
    their mean say the opposite.
    """
    if len(chance) < fewest:
        return False
    beyond = strongest > float(np.mean(chance) + 10.0 * np.std(chance))
    return bool(np.sum(chance >= strongest) >= 10 or beyond)


def strengths_of(fitted: Replicates, looks: Columns) -> tuple[FloatArray, list[FloatArray]]:
    """Strength of every look as a standard normal deviate, (r, looks), and the coefficients of each, (r, d)."""
    chi2, coefficients = scores(fitted, looks)
    return deviate(chi2, looks.freedom), coefficients


def deviate(chi2: FloatArray, freedom: FloatArray | NDArray[np.int64]) -> FloatArray:
    """The standard normal deviates as rare, two-sided, as chi-squared values; beyond 1e-14 by asymptotics."""
    chi2 = np.maximum(chi2, 0.0)
    p = chdtrc(freedom, chi2)
    far = np.sqrt(chi2) - 0.5 * np.sqrt(np.maximum(freedom - 1.0, 0.0))
    near = np.maximum(-ndtri(np.maximum(0.5 * p, 1e-300)), 0.0)
    return np.where(freedom == 1, np.sqrt(chi2), np.where(p > 1e-14, near, far))
