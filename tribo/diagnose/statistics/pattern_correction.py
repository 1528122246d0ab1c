"""By how much the model is wrong for each patterned sample: the estimated pattern error with its interval."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from tribo.diagnose.statistics.interval import NORMAL_90, informed_share, over_pattern_error
from tribo.diagnose.statistics.linearisation import ModelFit
from tribo.diagnose.statistics.model import PATTERN
from tribo.records import REGIMES, FloatArray


@dataclass(frozen=True)
class Percent:
    """100 (measured / model - 1) with its 90 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class PatternCorrection:
    """What the measurement of one sample in one regime is over the model, on average over its tests and at loads (N).

    ``p`` is the chance of such a mean correction where the model is right, adjusted for the number of corrections.
    """

    sample: str
    regime: str
    mean: Percent
    at_load: dict[float, Percent]
    p: float


def pattern_corrections(f: ModelFit) -> list[PatternCorrection]:
    """The corrections of all patterned samples, static before sliding; none where no sample is patterned.

    The estimates are shrunk towards the model by as much as the campaign itself suggests: the size of the pattern error
    is learnt from all samples together, and the estimates are averaged over how large it may be.
    """
    s = f.setup
    patterns = np.flatnonzero(s.group[s.random_effects.of_specimens :] == PATTERN)
    if not len(patterns):
        return []
    effects, spread = _averaged(f, patterns)
    columns = s.random_effects.shared[:, :, patterns]
    sample, load = s.observations.conditions.sample, s.observations.conditions.normal_load_N
    there = [str(name) for name in np.unique(sample) if np.any(columns[sample == name])]
    found = []
    for name in there:
        for k, regime in enumerate(REGIMES):
            rows = columns[sample == name, k]
            mean, sd = _estimate(rows.mean(axis=0), effects, spread)
            chance = min(2.0 * float(norm.sf(abs(mean) / sd)) * 2 * len(there), 1.0)
            at = {
                float(f"{load[sample == name][i]:.4g}"): _percent(*_estimate(rows[i], effects, spread))
                for i in _three(load[sample == name])
            }
            found.append(PatternCorrection(name, regime, _percent(mean, sd), at, chance))
    return found


def _averaged(f: ModelFit, patterns: NDArray[np.int64]) -> tuple[FloatArray, FloatArray]:
    """Shared effects and their covariance over the sizes that the pattern error may have."""
    weight, fits = over_pattern_error(f)
    effects = np.array([f.setup.random_effects.parts(g.effects)[1][patterns] for g in fits])
    mean = weight @ effects
    apart = np.einsum("i,ip,iq->pq", weight, effects - mean, effects - mean)
    here = f.linear.columns.parameters + patterns
    within = [g.inverse.border[0][np.ix_(here, here)] / informed_share(g.noise) for g in fits]
    return mean, np.tensordot(weight, np.array(within), axes=1) + apart


def _estimate(row: FloatArray, effects: FloatArray, spread: FloatArray) -> tuple[float, float]:
    """Value and standard error of a combination of random effects."""
    return float(row @ effects), float(np.sqrt(row @ spread @ row)) + 1e-12


def _percent(value: float, sd: float) -> Percent:
    low, middle, high = (100.0 * float(np.expm1(value + k * NORMAL_90 * sd)) for k in (-1, 0, 1))
    return Percent(middle, low, high)


def _three(load: FloatArray) -> list[int]:
    """Tests at the lowest, the middle and the highest load."""
    order = np.argsort(load, kind="stable")
    return list(dict.fromkeys(int(order[k]) for k in (0, len(order) // 2, len(order) - 1)))
