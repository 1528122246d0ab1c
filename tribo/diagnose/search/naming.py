"""From a screened campaign to the mechanisms that explain it, one after the other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tribo.diagnose.search.looks import all_looks
from tribo.diagnose.search.screen import Progress, Screen, screen
from tribo.diagnose.search.weigh import TIED, Candidate, effect, likeness, weigh
from tribo.diagnose.statistics.fit import fit
from tribo.diagnose.statistics.model import FIXED, ModelFit, Setup
from tribo.records import FloatArray

CLOSE = 3.0  # log likelihood within which a mechanism that can be told apart explains about equally
IN_COMMON = 0.5  # share of its effect that a mechanism must have in common with one it is tied to
FORM = 0.12  # by how much of its own effect a law may be wrong in form, sample by sample
MAX_CAUSES = 2


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
    baseline: ModelFit,
    first: Screen,
    excluded: Sequence[str],
    *,
    level: float,
    replicates: int,
    rng: np.random.Generator,
    progress: Progress | None = None,
) -> Named:
    """Add mechanisms while each is beyond chance and a misfit remains."""
    model, seen = baseline, first
    causes: list[tuple[Candidate, ...]] = []
    weighed: tuple[Candidate, ...] = ()
    rivals: tuple[Candidate, ...] = ()
    while len(causes) < MAX_CAUSES and seen.p_adjusted() < level:
        ranked = weigh(model, excluded)
        weighed = weighed or tuple(ranked)
        if not ranked or not _is_real(ranked[0], seen, level):
            break
        alike, rivals = _sort_rivals(model, ranked)
        causes.append(alike)
        model = alike[0].fit
        seen = _screen_left(model, replicates, rng, progress)
    if len(causes) == MAX_CAUSES:
        model, causes, rivals = _revisit(model, causes, rivals, excluded)
        seen = _screen_left(model, replicates, rng, progress)
    return Named(model, tuple(causes), rivals, tuple(weighed), seen, seen.p_adjusted())


def _revisit(
    model: ModelFit,
    causes: list[tuple[Candidate, ...]],
    rivals: tuple[Candidate, ...],
    excluded: Sequence[str],
) -> tuple[ModelFit, list[tuple[Candidate, ...]], tuple[Candidate, ...]]:
    """The first cause was picked before the second was known: pick it again beside the second."""
    alone = fit(model.setup, (causes[-1][0].acting,), start=model)
    ranked = weigh(alone, excluded)
    if not ranked:
        return model, causes, rivals
    alike, others = _sort_rivals(alone, ranked)
    return ranked[0].fit, [alike, causes[-1]], (*rivals, *others)


def _is_real(candidate: Candidate, seen: Screen, level: float) -> bool:
    """Whether chance would make some mechanism earn as much in fewer than ``level`` of the campaigns."""
    return seen.p_library(float(np.sqrt(2.0 * max(candidate.raw, 0.0)))) < level


def _sort_rivals(
    start: ModelFit, ranked: Sequence[Candidate]
) -> tuple[tuple[Candidate, ...], tuple[Candidate, ...]]:
    """Those that the design cannot distinguish from the best, and distinct ones that explain about as much."""
    best = ranked[0]
    tied = max(TIED[0], TIED[1] * best.gain)
    near = [c for c in ranked[1:] if c.gain > best.gain - max(CLOSE, tied)]
    if not near:
        return (best,), ()
    cosine = np.maximum(likeness(start, best, near), 0.0)
    told = (best.gain * (1.0 - cosine**2) > 2.0 * tied) | (cosine**2 < IN_COMMON)
    alike = [c for c, apart in zip(near, told, strict=True) if not apart and c.gain > best.gain - tied]
    rivals = [c for c, apart in zip(near, told, strict=True) if apart and c.gain > best.gain - CLOSE]
    return (best, *alike), tuple(rivals)


def _screen_left(
    model: ModelFit, replicates: int, rng: np.random.Generator, progress: Progress | None
) -> Screen:
    """What is left after a model, its laws allowed to be wrong in form by a share of their own effect."""
    widened = fit(with_form_error(model), model.acting, start=model, iterations=10)
    return screen(widened, all_looks(widened), replicates=replicates, rng=rng, progress=progress)


def with_form_error(model: ModelFit) -> Setup:
    """Random effects that let each mechanism's effect be off per sample and regime, in size and slope."""
    s = model.setup
    c = s.observations.conditions
    columns, sizes = [], []
    for k in range(len(model.acting)):
        change = effect(model, k)
        for shape in (np.ones(s.observations.n), s.log_pressure):
            for sample in np.unique(c.sample):
                here = (c.sample == sample) * shape
                for regime in (0, 1):
                    column = np.zeros_like(change)
                    column[:, regime] = change[:, regime] * here
                    if np.abs(column).max() > 1e-6:
                        columns.append(column)
                        sizes.append(FORM)
    if not columns:
        return s
    return replace(
        s,
        random=np.concatenate([s.random, np.stack(columns, axis=2)], axis=2),
        unit=np.concatenate([s.unit, np.array(sizes)]),
        group=np.concatenate([s.group, np.full(len(sizes), FIXED)]),
    )


def weights_of(candidates: Sequence[Candidate]) -> FloatArray:
    """Shares of candidates by likelihood, adding to one; the likelihood is trusted as far as the laws are.

    Between laws that may each be wrong in form, a large log likelihood parts less than it seems: differences
    count in units of the tie that :data:`TIED` allows.
    """
    gains = np.array([c.gain for c in candidates])
    unit = max(1.0, TIED[1] * gains.max() / CLOSE)
    share = np.exp((gains - gains.max()) / unit)
    return np.asarray(share / share.sum())
