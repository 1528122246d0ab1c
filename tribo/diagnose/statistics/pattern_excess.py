"""Whether the patterned samples differ from the model by more than the model's own error."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tribo.diagnose.statistics.interval import with_pattern_error
from tribo.diagnose.statistics.linearisation import ModelFit
from tribo.diagnose.statistics.model import PATTERN

WITHIN = 1.5  # times the stated error of the model: the range for which docs/blind.md counts false alarms


@dataclass(frozen=True)
class PatternExcess:
    """How far the patterned samples are from the model.

    ``factor`` is the estimated error of the model over the stated one, ``p`` the chance of such a factor where the true
    one is at most WITHIN. ``percent`` holds the mean of measured over modelled T, less one, in percent, by sample as
    (static, sliding).
    """

    factor: float
    p: float
    percent: Mapping[str, tuple[float, float]]


def pattern_excess(f: ModelFit) -> PatternExcess | None:
    """Likelihood ratio of the estimated factor against WITHIN, one-sided; None where the factor is not larger."""
    s = f.setup
    patterns = s.group[s.random_effects.of_specimens :] == PATTERN
    if not patterns.any() or f.noise.pattern <= WITHIN:
        return None
    ratio = 2.0 * (f.score - with_pattern_error(f, WITHIN).score)
    correction = s.random_effects.shared[:, :, patterns] @ s.random_effects.parts(f.effects)[1][patterns]
    sample = s.observations.conditions.sample
    percent = {
        str(name): (float(mean[0]), float(mean[1]))
        for name in np.unique(sample)
        if np.any(mean := 100.0 * np.expm1(correction[sample == name].mean(axis=0)))
    }
    return PatternExcess(f.noise.pattern, _one_sided(ratio), percent)


def _one_sided(ratio: float) -> float:
    from scipy.stats import chi2

    return max(0.5 * float(chi2.sf(max(ratio, 0.0), 1)), 1e-12)
