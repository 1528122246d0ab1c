"""What explains a screened campaign: layers that are added one after the other while a misfit remains.

A layer is a mechanism, or, where a recorded column explains far more than any mechanism, a free course of that column.
A mechanism stays only while it is beyond chance beside all other layers.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from tribo.diagnose.search.looks import Look
from tribo.diagnose.search.rivals import CLOSE, sort_rivals
from tribo.diagnose.search.screen import Progress, Screen, screen_left
from tribo.diagnose.search.weighing import Candidate, judged, refitted, weigh, weigh_beside
from tribo.diagnose.statistics.fit import fit
from tribo.diagnose.statistics.linearisation import ModelFit
from tribo.diagnose.statistics.model import Setup, with_free_columns
from tribo.diagnose.statistics.start_effects import StartEffects
from tribo.display import displayed

MAX_LAYERS = 8


@displayed()
@dataclass(frozen=True)
class Remainder:
    """A look that no mechanism explains: its ``strength`` as a normal deviate, its peak-to-peak ``size`` in ln T and
    its adjusted p value."""

    look: Look
    strength: float
    coefficients: np.ndarray
    size: float
    p: float


@displayed()
@dataclass(frozen=True)
class Named:
    """What explains the campaign: one set of candidates per cause, the best first in each.

    ``model`` is fitted with the causes and without the remainders. ``rivals`` are distinct mechanisms that explain the
    last cause about equally; ``remainders`` are what follows a column and no mechanism. ``left`` is the screen of what
    remains after all layers and ``p_left`` its adjusted p value. ``wrong_in_form`` are mechanisms that were left out
    because a misfit remained in the very column they depend on.
    """

    model: ModelFit
    causes: tuple[tuple[Candidate, ...], ...]
    rivals: tuple[Candidate, ...]
    weighed: tuple[Candidate, ...]
    left: Screen
    p_left: float
    remainders: tuple[Remainder, ...] = ()
    wrong_in_form: tuple[str, ...] = ()


@displayed()
@dataclass(frozen=True)
class Rules:
    """How layers are decided on: mechanisms that are ``excluded``, the ``level``, and the simulated campaigns."""

    excluded: Collection[str]
    level: float
    replicates: int
    rng: np.random.Generator
    progress: Progress | None = None


@displayed()
@dataclass(frozen=True)
class Layers:
    """The layers so far, and the model fitted with them. ``wrong_in_form`` are mechanisms that left a misfit in the
    very column they depend on."""

    model: ModelFit
    causes: tuple[tuple[Candidate, ...], ...] = ()
    rivals: tuple[Candidate, ...] = ()
    remainders: tuple[Remainder, ...] = ()
    wrong_in_form: frozenset[str] = field(default_factory=frozenset)


def name_causes(start: StartEffects, first: Screen, rules: Rules) -> Named:
    """Add layers while a misfit remains, then keep the mechanisms that stand beside the others."""
    layers, seen = Layers(start.model), first
    weighed: tuple[Candidate, ...] = ()
    for _ in range(MAX_LAYERS):
        if seen.p.min() >= rules.level:
            break
        barred = {*rules.excluded, *layers.wrong_in_form}
        fresh = layers.model is start.model
        ranked = weigh(start, barred) if fresh else weigh_beside(layers.model, barred)
        weighed = weighed or tuple(ranked)
        grown = _grown(layers, ranked, seen, rules.level)
        if grown is None:
            break
        left = _screen_left(grown.model, rules)
        if len(grown.causes) > len(layers.causes) and _misfit_in_own_column(grown.causes[-1][0], left, rules.level):
            layers = replace(layers, wrong_in_form=layers.wrong_in_form | {grown.causes[-1][0].name})
        else:
            layers, seen = grown, left
    settled = _standing(_picked_again(layers, rules), first, rules.level)
    if settled is not layers:
        seen = _screen_left(settled.model, rules)
    model = _without_remainders(settled, start.model.setup)
    left_p = float(seen.p.min())
    wrong = tuple(sorted(settled.wrong_in_form))
    return Named(model, settled.causes, settled.rivals, weighed, seen, left_p, settled.remainders, wrong)


def _screen_left(model: ModelFit, rules: Rules) -> Screen:
    return screen_left(model, replicates=rules.replicates, rng=rules.rng, progress=rules.progress)


def best_beyond_chance(ranked: Sequence[Candidate], seen: Screen, level: float) -> Candidate | None:
    """The first of those that chance does not make as strong; what is within chance explains no misfit."""
    return next((c for c in ranked if seen.p_library(c.strength) < level), None)


def strongest_beside_mechanisms(seen: Screen, level: float, flat: str) -> Remainder | None:
    """The strongest look beyond chance that is no mechanism."""
    for k in np.argsort(-seen.strength):
        look, p = seen.looks[k], float(seen.p[k])
        if p >= level:
            return None
        if look.kind != "mechanism" and not look.is_taken_up(flat):
            return Remainder(look, float(seen.strength[k]), seen.coefficients[k], float(seen.size[k]), p)
    return None


def _grown(layers: Layers, ranked: Sequence[Candidate], seen: Screen, level: float) -> Layers | None:
    """One layer more: the best mechanism, unless a free course of a column explains far more; None without either."""
    best = best_beyond_chance(ranked, seen, level)
    other = strongest_beside_mechanisms(seen, level, layers.model.setup.observations.flat)
    if best is not None and (other is None or best.raw > 0.5 * other.strength**2 - CLOSE):
        alike, rivals = sort_rivals(layers.model, best, ranked)
        return replace(layers, model=best.fit, causes=(*layers.causes, alike), rivals=rivals)
    if other is None:
        return None
    wider = with_free_columns(layers.model.setup, other.look.columns, other.coefficients)
    model = fit(wider, layers.model.acting, start=layers.model)
    return replace(layers, model=model, remainders=(*layers.remainders, other))


def _misfit_in_own_column(cause: Candidate, left: Screen, level: float) -> bool:
    """Whether what is left follows the column of a mechanism that was to explain it: its form is wrong.

    One name of a column of several may leave another one.
    """
    column, choice = cause.acting.mechanism.column(cause.acting.choice), cause.acting.choice
    if cause.acting.mechanism.any_column and choice != column:
        return False
    return any(
        p < level and look.kind in ("trend", "shape", "level", "period") and look.covariate.split(",")[0] == column
        for look, p in zip(left.looks, left.p, strict=True)
    )


def _picked_again(layers: Layers, rules: Rules) -> Layers:
    """Each cause but the last was picked before the later ones were known: pick it again beside them."""
    for k in range(len(layers.causes) - 1):
        acting = [alike[0].acting for alike in layers.causes]
        alone = refitted(layers.model, [a for j, a in enumerate(acting) if j != k])
        ranked = weigh_beside(alone, {*rules.excluded, *layers.wrong_in_form})
        if not ranked:
            continue
        alike, others = sort_rivals(alone, ranked[0], ranked)
        causes = (*layers.causes[:k], alike, *layers.causes[k + 1 :])
        layers = replace(layers, model=ranked[0].fit, causes=causes, rivals=(*layers.rivals, *others))
    return layers


def _standing(layers: Layers, first: Screen, level: float) -> Layers:
    """The causes that are still beyond chance when all other layers are there."""
    for alike in layers.causes if len(layers.causes) + len(layers.remainders) > 1 else ():
        others = [a[0].acting for a in layers.causes if a is not alike]
        without = refitted(layers.model, others)
        beside = judged(without, refitted(without, [*others, alike[0].acting]), 0.0)
        if first.p_library(beside.strength) >= level:
            layers = replace(layers, model=without, causes=tuple(a for a in layers.causes if a is not alike))
    return layers


def _without_remainders(layers: Layers, s: Setup) -> ModelFit:
    return fit(s, layers.model.acting, start=layers.model) if layers.remainders else layers.model
