"""What every candidate would change in a fitted model, and how much of that the model cannot absorb."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribo.diagnose.statistics.linear import ModelFit
from tribo.diagnose.statistics.model import Acting, StartChanges, start_changes
from tribo.records import FloatArray

SEEN = 1e-3  # share of a mechanism's effect that must be left once the flat law is free


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
