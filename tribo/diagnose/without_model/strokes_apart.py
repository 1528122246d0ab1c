"""Strokes in both directions: the offset of the force between them, which no friction makes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import t as t_distribution

from tribo.diagnose.verdict import Estimate
from tribo.records import Ingested

CERTAIN = 5.0  # standard errors, as for other evidence from traces
_FEWEST = 3


@dataclass(frozen=True)
class Apart:
    """The ``offset`` of the force in N with its 90 % interval: half of what parts the two directions.

    ``percent`` is that of the mean sliding force. ``strokes`` counts those forward and those backward.
    """

    offset: Estimate
    percent: float
    low_percent: float
    high_percent: float
    p: float
    certain: bool
    strokes: tuple[int, int]


def strokes_apart(ingested: Ingested) -> Apart | None:
    """The offset over all pairs of strokes; None without strokes in both directions, or with fewer than three pairs."""
    pulls = list(ingested.pulls.values())
    forward = [p for p in pulls if "forward" in p.flags]
    backward = [p for p in pulls if "backward" in p.flags]
    zeros = np.array([p.zero_N for p in forward if np.isfinite(p.zero_N)])
    if len(zeros) < _FEWEST or not backward:
        return None
    mean, se = float(zeros.mean()), max(float(zeros.std(ddof=1) / np.sqrt(len(zeros))), 1e-12)
    half = float(t_distribution.ppf(0.95, len(zeros) - 1)) * se
    force = float(np.mean([p.sliding_N for p in (*forward, *backward)]))
    p = float(2.0 * t_distribution.sf(abs(mean) / se, len(zeros) - 1))
    low, high = mean - half, mean + half
    return Apart(
        Estimate(mean, low, high, "N"), 100 * mean / force, 100 * low / force, 100 * high / force, p,
        abs(mean) > CERTAIN * se, (len(forward), len(backward)),
    )  # fmt: skip
