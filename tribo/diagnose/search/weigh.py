"""Weighing the mechanisms: fitting each, penalising freedom, and finding which cannot be distinguished."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tribo.diagnose.search.looks import candidates
from tribo.diagnose.search.screen import cleared
from tribo.diagnose.statistics.fit import fit
from tribo.diagnose.statistics.model import Acting, ModelFit, log_forces, predict
from tribo.records import FloatArray

PER_PARAMETER = 1.0  # log likelihood that a further parameter has to earn
CHOICES_FITTED = 4  # of a mechanism with many choices, how many are fitted in full
IN_REACH, CLOSE_BY = 0.5, 3.0  # share of the best first gain, less so much, from which a mechanism is fitted to the end
# Log likelihood, at least and as a share of what the best gains, by which two mechanisms must differ to be told apart:
# if the one is at work, the difference has the expected value gain (1 - cosine^2) and twice that as its variance.
TIED = (5.0, 0.08)
ALIKE = float(np.sqrt(1.0 - 2.0 * TIED[1]))  # cosine above which not even a strong effect tells two mechanisms apart
SEEN = 1e-3  # share of a mechanism's effect that must be left once the flat law is free


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


def weigh(start: ModelFit, excluded: Sequence[str] = ()) -> list[Candidate]:
    """Every mechanism that is not excluded, added to ``start``; the best choice of each, best first.

    All are tried, and those within reach of the best are fitted to the end.
    """
    groups: dict[str, list[Acting]] = {}
    for acting in candidates(start.setup, start.law):
        if acting.name not in excluded and acting not in start.acting:
            groups.setdefault(acting.mechanism.name, []).append(acting)
    tried: dict[str, Candidate] = {}
    for group in groups.values():
        short = [_candidate(start, acting, len(group)) for acting in _most_promising(start, group)]
        tried |= {c.name: c for c in sorted(short, key=lambda c: c.gain)}
    best = max((c.gain for c in tried.values()), default=0.0)
    hopeful = IN_REACH * best - CLOSE_BY
    found = [_to_the_end(start, c) if c.gain > hopeful else c for c in tried.values()]
    return sorted(found, key=lambda c: -c.gain)


def _most_promising(start: ModelFit, group: list[Acting]) -> list[Acting]:
    """All of a small group; of a large one those whose score test is strongest in the right direction."""
    if len(group) <= CHOICES_FITTED:
        return group
    before = predict(start.setup, start.law, (), ())
    columns = [predict(start.setup, start.law, (a,), (a.mechanism.start(),)) - before for a in group]
    left, target = cleared(start, np.stack(columns, axis=2))
    pull = left.T @ target
    # log likelihood of the whole effect, for what is present as a whole or absent
    whole = pull - 0.5 * np.sum(left**2, axis=0)
    small = 0.5 * pull * np.abs(pull) / (np.sum(left**2, axis=0) + 1e-12)
    whole_or_absent = group[0].mechanism.choosing.all_or_nothing_sd is not None
    rank = whole if whole_or_absent else np.abs(small)
    return [group[i] for i in np.argsort(-rank)[:CHOICES_FITTED]]


def _candidate(start: ModelFit, acting: Acting, choices: int) -> Candidate:
    fitted = fit(start.setup, (*start.acting, acting), start=start, to_the_end=False)
    return _judged(start, fitted, float(np.log(choices)))


def _to_the_end(start: ModelFit, c: Candidate) -> Candidate:
    """A candidate that was only tried, fitted until nothing changes any more."""
    return _judged(start, fit(start.setup, c.fit.acting, start=c.fit), c.raw - c.gain)


def _judged(start: ModelFit, fitted: ModelFit, choosing: float) -> Candidate:
    """What a fit earns beyond ``start``: its parameters and the choosing, in log likelihood, are paid for."""
    acting = fitted.acting[-1]
    raw = fitted.score - start.score - PER_PARAMETER * (len(acting.mechanism.parameters) - 1)
    sd = acting.mechanism.choosing.all_or_nothing_sd
    if sd is not None:
        raw -= 0.5 * ((fitted.values[-1][0] - acting.mechanism.amplitude.start) / sd) ** 2
    return Candidate(acting, fitted, float(raw - choosing), float(raw))


def effect(f: ModelFit, index: int = -1) -> FloatArray:
    """Change of ln T by one mechanism of a fit, (n, 2)."""
    base = f.setup.base(f.law)
    conditions = f.setup.observations.conditions
    acting = f.acting[index]
    after = acting.mechanism.law(f.values[index], base, conditions, acting.choice)
    return log_forces(after) - log_forces(base.forces(conditions.normal_load_N))


def likeness(start: ModelFit, best: Candidate, others: Sequence[Candidate]) -> FloatArray:
    """Cosine between what ``best`` changes in the fitted ln T and what each other changes, (others,).

    Every model has its own flat law fitted, so what the flat law can absorb is already removed; the sample error
    and the specimens are taken out here.
    """
    ground = replace(best.fit, acting=best.fit.acting[:-1], values=best.fit.values[:-1])
    changes = [c.fit.predicted - start.predicted for c in (best, *others)]
    left = cleared(ground, np.stack(changes, axis=2))[0]
    length = np.sqrt(np.sum(left**2, axis=0)) + 1e-12
    return np.asarray((left[:, 1:].T @ left[:, 0]) / (length[1:] * length[0]))


def unseen(start: ModelFit) -> dict[str, float]:
    """Mechanisms whose effect the calibration on the flat sample absorbs almost wholly, at every size that a fit would
    start from, with the largest share of the effect that is left."""
    found = {}
    before = predict(start.setup, start.law, (), ())
    for acting in candidates(start.setup, start.law):
        if acting.choice:
            continue
        values = [acting.mechanism.start()]
        values += [np.array([size, *values[0][1:]]) for size in acting.mechanism.amplitude.tries]
        changes = [predict(start.setup, start.law, (acting,), (v,)) - before for v in values]
        kept = np.sum(cleared(start, np.stack(changes, axis=2))[0] ** 2, axis=0)
        whole = np.sum(np.square(changes), axis=(1, 2)) / np.mean(np.diag(start.noise.repeat))
        share = float(np.max(kept / np.maximum(whole, 1e-30)))
        if share < SEEN:
            found[acting.name] = share
    return found
