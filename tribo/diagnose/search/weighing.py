"""Weighing the mechanisms: each is fitted on top of a model, and its freedom is penalised."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from tribo.diagnose.statistics.fit import fit
from tribo.diagnose.statistics.linearisation import ModelFit
from tribo.diagnose.statistics.model import Acting
from tribo.diagnose.statistics.start_effects import StartEffects, start_effects
from tribo.display import displayed
from tribo.records import FloatArray

PER_PARAMETER = 1.0  # log likelihood that a further parameter has to earn
CHOICES_FITTED = 4  # of a mechanism with many choices, how many are fitted in full
IN_REACH, CLOSE_BY = 0.5, 3.0  # share of the best first gain, less so much, from which a mechanism is fitted to the end


@displayed()
@dataclass(frozen=True)
class Candidate:
    """A mechanism fitted on top of a model; ``gain`` is the log likelihood it earns net of its freedom, ``raw``
    the same before the choices it had are paid for."""

    acting: Acting
    fit: ModelFit
    gain: float
    raw: float

    @property
    def name(self) -> str:
        return self.acting.name

    @property
    def values(self) -> FloatArray:
        return self.fit.values[-1]

    @property
    def strength(self) -> float:
        """As a standard normal deviate, before the choices are paid for: comparable with what chance reaches."""
        return float(np.sqrt(2.0 * max(self.raw, 0.0)))


def weigh_beside(model: ModelFit, excluded: Collection[str]) -> list[Candidate]:
    return weigh(start_effects(model), excluded)


def weigh(start: StartEffects, excluded: Collection[str] = ()) -> list[Candidate]:
    """Every mechanism that is not excluded, added to a model; the best choice of each, best first.

    All are tried, and those within reach of the best are fitted to the end.
    """
    groups: dict[str, list[int]] = {}
    for k, acting in enumerate(start.acting):
        if acting.name not in excluded and acting not in start.model.acting:
            groups.setdefault(acting.mechanism.name, []).append(k)
    tried: dict[str, Candidate] = {}
    for group in groups.values():
        short = [_candidate(start.model, acting, len(group)) for acting in _most_promising(start, group)]
        tried |= {c.name: c for c in sorted(short, key=lambda c: c.gain)}
    best = max((c.gain for c in tried.values()), default=0.0)
    hopeful = IN_REACH * best - CLOSE_BY
    found = [_to_the_end(start.model, c) if c.gain > hopeful else c for c in tried.values()]
    return sorted(found, key=lambda c: -c.gain)


def _most_promising(start: StartEffects, group: list[int]) -> list[Acting]:
    """All of a small group; of a large one those whose score test is strongest in the right direction."""
    acting = [start.acting[k] for k in group]
    if len(group) <= CHOICES_FITTED:
        return acting
    pull, left = start.pull[group], start.length[group] ** 2
    # log likelihood of the whole effect, for what is present as a whole or absent
    whole = pull - 0.5 * left
    small = 0.5 * pull * np.abs(pull) / (left + 1e-12)
    whole_or_absent = acting[0].mechanism.choosing.all_or_nothing_sd is not None
    rank = whole if whole_or_absent else np.abs(small)
    return [acting[i] for i in np.argsort(-rank)[:CHOICES_FITTED]]


def _candidate(start: ModelFit, acting: Acting, choices: int) -> Candidate:
    fitted = refitted(start, (*start.acting, acting), to_the_end=False)
    return judged(start, fitted, float(np.log(choices)))


def _to_the_end(start: ModelFit, c: Candidate) -> Candidate:
    """A candidate that was only tried, fitted until nothing changes any more."""
    return judged(start, refitted(c.fit, c.fit.acting), c.raw - c.gain)


def refitted(f: ModelFit, acting: Sequence[Acting], to_the_end: bool = True) -> ModelFit:
    """The same campaign with these mechanisms, from where a fit has got to."""
    return fit(f.setup, acting, start=f, to_the_end=to_the_end)


def judged(start: ModelFit, fitted: ModelFit, choosing: float) -> Candidate:
    """What a fit earns beyond ``start``, a direct measurement included: its parameters and the choosing, in log
    likelihood, are paid for."""
    acting = fitted.acting[-1]
    measured = acting.measured_evidence(float(fitted.values[-1][0]))
    raw = fitted.score - start.score + measured - PER_PARAMETER * (len(acting.mechanism.parameters) - 1)
    sd = acting.mechanism.choosing.all_or_nothing_sd
    if sd is not None:
        raw -= 0.5 * ((fitted.values[-1][0] - acting.mechanism.amplitude.start) / sd) ** 2
    return Candidate(acting, fitted, float(raw - choosing), float(raw))
