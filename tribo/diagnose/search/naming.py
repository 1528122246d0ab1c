"""Weighing the mechanisms and naming those that explain a screened campaign, one after the other.

Each mechanism is fitted and its freedom penalised; then follows which of them cannot be distinguished.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tribo.diagnose.search.screen import Progress, Screen, screen_left
from tribo.diagnose.statistics.fit import fit
from tribo.diagnose.statistics.linearisation import ModelFit, StartEffects, start_effects
from tribo.diagnose.statistics.model import Acting, Target
from tribo.records import FloatArray

PER_PARAMETER = 1.0  # log likelihood that a further parameter has to earn
CHOICES_FITTED = 4  # of a mechanism with many choices, how many are fitted in full
IN_REACH, CLOSE_BY = 0.5, 3.0  # share of the best first gain, less so much, from which a mechanism is fitted to the end
# Log likelihood, at least and as a share of what the best gains, by which two mechanisms must differ to be told apart.
# If the one is at work, the difference has the expected value D = gain (1 - cosine^2) and the variance 2 D: the other
# one is ahead by 3 in at most 0.7 % of campaigns, whatever D is.
TIED = (3.0, 0.08)
ALIKE = float(np.sqrt(1.0 - 2.0 * TIED[1]))  # cosine above which not even a strong effect tells two mechanisms apart
CLOSE = 3.0  # log likelihood within which a mechanism that can be told apart explains about equally
IN_COMMON = 0.5  # share of its effect that a mechanism must have in common with one it is tied to
MAX_CAUSES = 2


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


@dataclass(frozen=True)
class Named:
    """What explains the campaign: one set of candidates per cause, the best first in each.

    ``rivals`` are distinct mechanisms that explain the last cause about equally; ``left`` is the screen of
    what remains after all causes and ``p_left`` its adjusted p value.
    """

    model: ModelFit
    causes: tuple[tuple[Candidate, ...], ...]
    rivals: tuple[Candidate, ...]
    weighed: tuple[Candidate, ...]
    left: Screen
    p_left: float


def name_causes(
    start: StartEffects,
    first: Screen,
    excluded: Sequence[str],
    *,
    level: float,
    replicates: int,
    rng: np.random.Generator,
    progress: Progress | None = None,
) -> Named:
    """Add mechanisms while each is beyond chance and a misfit remains."""
    model, seen = start.model, first
    causes: list[tuple[Candidate, ...]] = []
    weighed: tuple[Candidate, ...] = ()
    rivals: tuple[Candidate, ...] = ()
    while len(causes) < MAX_CAUSES and seen.p.min() < level:
        ranked = weigh(start, excluded) if not causes else _weighed(model, excluded)
        weighed = weighed or tuple(ranked)
        best = best_beyond_chance(ranked, seen, level)
        if best is None:
            break
        alike, rivals = _sort_rivals(model, best, ranked)
        causes.append(alike)
        model = alike[0].fit
        seen = screen_left(model, replicates=replicates, rng=rng, progress=progress)
    if len(causes) == MAX_CAUSES:
        model, causes, rivals = _revisit(model, causes, rivals, excluded)
        seen = screen_left(model, replicates=replicates, rng=rng, progress=progress)
    return Named(model, tuple(causes), rivals, tuple(weighed), seen, float(seen.p.min()))


def best_beyond_chance(ranked: Sequence[Candidate], seen: Screen, level: float) -> Candidate | None:
    """The first of those that chance does not make as strong; what is within chance explains no misfit."""
    return next((c for c in ranked if seen.p_library(c.strength) < level), None)


def _revisit(
    model: ModelFit,
    causes: list[tuple[Candidate, ...]],
    rivals: tuple[Candidate, ...],
    excluded: Sequence[str],
) -> tuple[ModelFit, list[tuple[Candidate, ...]], tuple[Candidate, ...]]:
    """The first cause was picked before the second was known: pick it again beside the second."""
    alone = _refitted(model, (causes[-1][0].acting,))
    ranked = _weighed(alone, excluded)
    if not ranked:
        return model, causes, rivals
    alike, others = _sort_rivals(alone, ranked[0], ranked)
    return ranked[0].fit, [alike, causes[-1]], (*rivals, *others)


def _weighed(model: ModelFit, excluded: Sequence[str]) -> list[Candidate]:
    return weigh(start_effects(model), excluded)


def weigh(start: StartEffects, excluded: Sequence[str] = ()) -> list[Candidate]:
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
    left = start.left[:, group]
    pull = left.T @ start.target
    # log likelihood of the whole effect, for what is present as a whole or absent
    whole = pull - 0.5 * np.sum(left**2, axis=0)
    small = 0.5 * pull * np.abs(pull) / (np.sum(left**2, axis=0) + 1e-12)
    whole_or_absent = acting[0].mechanism.choosing.all_or_nothing_sd is not None
    rank = whole if whole_or_absent else np.abs(small)
    return [acting[i] for i in np.argsort(-rank)[:CHOICES_FITTED]]


def _candidate(start: ModelFit, acting: Acting, choices: int) -> Candidate:
    fitted = _refitted(start, (*start.acting, acting), to_the_end=False)
    return _judged(start, fitted, float(np.log(choices)))


def _to_the_end(start: ModelFit, c: Candidate) -> Candidate:
    """A candidate that was only tried, fitted until nothing changes any more."""
    return _judged(start, _refitted(c.fit, c.fit.acting), c.raw - c.gain)


def _refitted(f: ModelFit, acting: Sequence[Acting], to_the_end: bool = True) -> ModelFit:
    """The same campaign with these mechanisms, from where a fit has got to."""
    return fit(f.setup, acting, start=f, to_the_end=to_the_end)


def _judged(start: ModelFit, fitted: ModelFit, choosing: float) -> Candidate:
    """What a fit earns beyond ``start``: its parameters and the choosing, in log likelihood, are paid for."""
    acting = fitted.acting[-1]
    raw = fitted.score - start.score - PER_PARAMETER * (len(acting.mechanism.parameters) - 1)
    sd = acting.mechanism.choosing.all_or_nothing_sd
    if sd is not None:
        raw -= 0.5 * ((fitted.values[-1][0] - acting.mechanism.amplitude.start) / sd) ** 2
    return Candidate(acting, fitted, float(raw - choosing), float(raw))


def _sort_rivals(
    start: ModelFit, best: Candidate, ranked: Sequence[Candidate]
) -> tuple[tuple[Candidate, ...], tuple[Candidate, ...]]:
    """Those that the design cannot distinguish from the best, and distinct ones that explain about as much.

    What explains about as much does so whether or not the choices a mechanism had are paid for.
    """
    tied = max(TIED[0], TIED[1] * best.gain)
    near = [c for c in ranked if c is not best and c.gain > best.gain - max(CLOSE, tied)]
    if not near:
        return (best,), ()
    cosine = np.maximum(_likeness(start, best, near), 0.0)
    told = (best.gain * (1.0 - cosine**2) > 2.0 * tied) | (cosine**2 < IN_COMMON)
    alike = [c for c, apart in zip(near, told, strict=True) if not apart and c.gain > best.gain - tied]
    rivals = [c for c, apart in zip(near, told, strict=True) if apart and _about_equal(c, best)]
    return (best, *alike), tuple(rivals)


def _about_equal(c: Candidate, best: Candidate) -> bool:
    return c.gain > best.gain - CLOSE and c.raw > best.raw - CLOSE


def _likeness(start: ModelFit, best: Candidate, others: Sequence[Candidate]) -> FloatArray:
    """Cosine between what ``best`` changes in the fitted ln T and what each other changes, (others,).

    Every model has its own flat law fitted, so what the flat law can absorb is already removed; the sample error
    and the specimens are taken out here.
    """
    f, ground = best.fit, Target(best.fit.setup, best.fit.acting[:-1])
    x = np.concatenate([f.law, *f.values[:-1]])
    jacobian = ground.jacobian(x, ground.predict(x))
    changes = [c.fit.predicted - start.predicted for c in (best, *others)]
    left = replace(f.linear, jacobian=jacobian).cleared(np.stack(changes, axis=2))[0]
    length = np.sqrt(np.sum(left**2, axis=0)) + 1e-12
    return np.asarray((left[:, 1:].T @ left[:, 0]) / (length[1:] * length[0]))


def weights_of(candidates: Sequence[Candidate]) -> FloatArray:
    """Shares of candidates by likelihood, adding to one; the likelihood is trusted as far as the laws are.

    Between laws that may each be wrong in form, a large log likelihood parts less than it seems: differences
    count in units of the tie that :data:`TIED` allows.
    """
    gains = np.array([c.gain for c in candidates])
    unit = max(1.0, TIED[1] * gains.max() / CLOSE)
    share = np.exp((gains - gains.max()) / unit)
    return np.asarray(share / share.sum())
