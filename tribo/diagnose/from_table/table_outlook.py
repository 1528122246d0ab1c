"""Readings of a published table, and what each gives: records and estimates."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tribo.diagnose.from_table.table_observations import Table, TableFit, fit_fixed, fit_table
from tribo.diagnose.statistics.model import Acting
from tribo.diagnose.verdict import Estimate, Outcome
from tribo.mechanisms.table import MECHANISMS

LEVEL = 0.01
CLOSE = 3.0
PATTERNS = "patterns"  # the flat law is free: a misfit of F is one of the patterned samples together


@dataclass(frozen=True)
class Reading:
    """One way to read the table: whose simulation is the model, the correlation of mu and tau0, the meaning of sd."""

    model: str
    correlation: float
    specimens: int
    why: str = ""


@dataclass(frozen=True)
class Weighed:
    """A mechanism fitted to the table; ``gain`` is the log likelihood it earns net of its freedom."""

    acting: Acting
    fit: TableFit
    gain: float

    @property
    def name(self) -> str:
        return self.acting.mechanism.name


@dataclass(frozen=True)
class Outlook:
    """What one reading gives: the adjusted p value of every look at the table, before and after the best mechanism."""

    reading: Reading
    table: Table
    baseline: TableFit
    looks: Mapping[str, float]
    weighed: tuple[Weighed, ...]
    p_library: float
    looks_left: Mapping[str, float]

    @property
    def p_misfit(self) -> float:
        """Adjusted p value of the strongest look."""
        return min(self.looks.values())

    @property
    def p_left(self) -> float:
        """The same for what the best mechanism leaves over."""
        return min(self.looks_left.values())

    @property
    def outcome(self) -> Outcome:
        if self.p_misfit >= LEVEL:
            return "no_misfit"
        if self.p_library >= LEVEL or self.p_left < LEVEL:
            return "unknown"
        return "undetermined" if len(self.near) > 1 else "named"

    @property
    def near(self) -> tuple[Weighed, ...]:
        """The best and those that explain about as much."""
        return tuple(w for w in self.weighed if w.gain > self.weighed[0].gain - CLOSE)


def estimate_of(w: Weighed) -> dict[str, Estimate]:
    """Parameters with 90 % intervals, kept inside their bounds."""
    found = {}
    for k, p in enumerate(w.acting.mechanism.parameters):
        half = 1.645 * float(np.sqrt(max(w.fit.covariance[4 + k, 4 + k], 0.0)))
        value = float(w.fit.parameters[0][k])
        found[p.name] = Estimate(value, max(value - half, p.low), min(value + half, p.high), p.unit)
    return found


def upper_limit(baseline: TableFit, name: str, drop: float = 1.353) -> float:
    """Largest amplitude within ``drop`` of the best log likelihood (95 % one-sided), the flat law fitted anew."""
    from scipy.optimize import brentq

    acting = Acting(MECHANISMS[name])
    p = acting.mechanism.amplitude
    best = fit_table(baseline.table, (acting,), baseline.root)

    def excess(value: float) -> float:
        return best.score - fit_fixed(baseline, acting, value).score - drop

    start = float(best.parameters[0][0])
    return p.high if excess(p.high) < 0 else float(brentq(excess, start, p.high, xtol=1e-4 * p.start))
