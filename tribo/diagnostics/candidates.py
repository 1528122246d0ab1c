"""Weighing the mechanisms: each is fitted on top of a model, and its freedom is penalised.

Which mechanisms explain a campaign about equally: those the design cannot distinguish, and distinct rivals.

What explains a screened campaign: layers that are added one after the other while a misfit remains.

A layer is a mechanism, or, where a recorded column explains far more than any mechanism, a free course of that column.
A mechanism stays only while it is beyond chance beside all other layers.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from tribo.diagnostics.contrasts import Contrast, Progress, Screen, screen_left
from tribo.diagnostics.fit import ModelFit, fit
from tribo.diagnostics.model import Acting, Setup, Target, with_free_columns
from tribo.diagnostics.score_statistics import StartEffects, start_effects
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


# Log likelihood, at least and as a share of what the best gains, by which two mechanisms must differ to be told apart.
# If the one is at work, the difference has the expected value D = gain (1 - cosine^2) and the variance 2 D: the other
# one is ahead by 3 in at most 0.7 % of campaigns, whatever D is.
TIED = (3.0, 0.08)
ALIKE = float(np.sqrt(1.0 - 2.0 * TIED[1]))  # cosine above which not even a strong effect tells two mechanisms apart
CLOSE = 3.0  # log likelihood within which a mechanism that can be told apart explains about equally
IN_COMMON = 0.5  # share of its effect that a mechanism must have in common with one it is tied to


def sort_rivals(
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


MAX_LAYERS = 8


@displayed()
@dataclass(frozen=True)
class Remainder:
    """A contrast that no mechanism explains: its ``strength`` as a normal deviate, its peak-to-peak ``size`` in ln T
    and its adjusted p value."""

    contrast: Contrast
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
    """The strongest contrast beyond chance that is no mechanism."""
    for k in np.argsort(-seen.strength):
        contrast, p = seen.contrasts[k], float(seen.p[k])
        if p >= level:
            return None
        if contrast.kind != "mechanism" and not contrast.is_taken_up(flat):
            return Remainder(contrast, float(seen.strength[k]), seen.coefficients[k], float(seen.size[k]), p)
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
    wider = with_free_columns(layers.model.setup, other.contrast.columns, other.coefficients)
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
        p < level and contrast.kind in ("trend", "shape", "level", "period") and contrast.covariate == column
        for contrast, p in zip(left.contrasts, left.p, strict=True)
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
