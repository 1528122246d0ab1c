"""The effects of all candidates at their start values, on top of a fitted model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribo.diagnose.statistics.chance import as_measured
from tribo.diagnose.statistics.courses import MOST_PAIRS, added
from tribo.diagnose.statistics.linearisation import ModelFit
from tribo.diagnose.statistics.model import Acting, StartChanges, start_changes
from tribo.diagnose.statistics.scores import columns_of, informations
from tribo.display import displayed
from tribo.records import FloatArray

SEEN = 1e-3  # share of a mechanism's effect that must be left once the flat law is free


@displayed()
@dataclass(frozen=True)
class StartEffects:
    """The effects of all candidates at their start values, made once for a fitted ``model``.

    ``length`` (k,) is the strength with which each would show beside the model's own columns, as a standard normal
    deviate, ``pull`` (k,) its score there and ``size`` (k,) its peak-to-peak effect in ln T beyond the law, where it
    was computed. ``absorbed`` are the names of the mechanisms whose effect the calibration on the flat sample absorbs
    almost wholly, at every size that a fit would start from.
    """

    model: ModelFit
    changes: StartChanges
    length: FloatArray
    pull: FloatArray
    size: FloatArray
    absorbed: frozenset[str]

    @property
    def acting(self) -> tuple[Acting, ...]:
        return self.changes.acting


def start_effects(f: ModelFit) -> StartEffects:
    """The effects of all candidates on top of a fit."""
    changes = start_changes(f.setup, f.law)
    ready = columns_of(changes.courses, np.zeros(len(changes.courses)), f.setup.observations.n)
    left, pull = (found[0] for found in informations(as_measured(f), ready))
    return StartEffects(f, changes, np.sqrt(left), pull, _size(f, changes), _absorbed(f, changes))


def _size(f: ModelFit, changes: StartChanges) -> FloatArray:
    """Peak to peak of every candidate; infinite for pairs of specimens where there are very many of them."""
    alone = np.array([len(courses) == 1 for courses in changes.courses])
    sized = alone if np.sum(~alone) > MOST_PAIRS else np.ones(len(alone), bool)
    found = np.full(len(sized), np.inf)
    shown = (added(changes.courses[k])[:, :, 0] for k in np.flatnonzero(sized))
    found[sized] = f.linear.size_beyond_law(shown)
    return found


def _absorbed(f: ModelFit, changes: StartChanges) -> frozenset[str]:
    names = [name for name, columns in changes.every_start.items() for _ in range(columns.shape[2])]
    if not names:
        return frozenset()
    columns = np.concatenate(list(changes.every_start.values()), axis=2)
    kept = np.sum(f.linear.cleared(columns)[0] ** 2, axis=0)
    whole = np.sum(columns**2, axis=(0, 1)) / np.mean(np.diag(f.noise.repeat))
    seen = {name for name, k, w in zip(names, kept, whole, strict=True) if k >= SEEN * max(w, 1e-30)}
    return frozenset(set(names) - seen)
