"""What explains a screened campaign: candidates are weighed, told apart, and added in layers while a misfit remains.

Each mechanism is fitted on top of a model, and its freedom is penalised. Those that the design cannot distinguish are
tied; distinct ones that explain about as much are rivals. A layer is a mechanism, or, where a recorded column explains
far more than any mechanism, a free course of that column. A mechanism stays only while it is beyond chance beside all
other layers.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import softmax

from tribo.diagnostics.contrasts import Screen, allowed_wrong_form
from tribo.diagnostics.fit import ModelFit, fit
from tribo.diagnostics.model import ADHESION, FIXED, WITHIN, Acting, Setup, Target, effect_of, with_free_columns
from tribo.diagnostics.observations import session_of
from tribo.diagnostics.scatter import held_at
from tribo.diagnostics.score_statistics import StartEffects, start_effects
from tribo.display import displayed
from tribo.records import FloatArray

PER_PARAMETER = 1.0  # log likelihood that a further parameter has to earn
CHOICES_FITTED = 4  # of a mechanism with many choices, how many are fitted in full
MAX_LAYERS = 8
IN_REACH, CLOSE_BY = 0.5, 3.0  # share of the best first gain, less so much, from which a mechanism is fitted to the end
# Log likelihood, at least and as a share of what the best gains, by which two mechanisms must differ to be told apart.
# If the one is at work, the difference has the expected value D = gain (1 - cosine^2) and the variance 2 D: the other
# one is ahead by 3 in at most 0.7 % of campaigns, whatever D is.
TIED = (3.0, 0.08)
ALIKE = float(np.sqrt(1.0 - 2.0 * TIED[1]))  # cosine above which not even a strong effect tells two mechanisms apart
CLOSE = 3.0  # log likelihood within which a mechanism that can be told apart explains about equally
LIKELY = 4.6  # log likelihood: odds of 100 to 1, the level of a misfit
ANY_FACTOR = 1.0  # standard deviation of ln T of a day or a specimen that may differ by any factor
NO_CHANGE = 1e-9  # of ln T
BELOW_ZERO = 2.33  # standard errors: one adhesion of zero in a hundred is fitted further below
IN_COMMON = 0.5  # share of its effect that a mechanism must have in common with one it is tied to


@displayed()
@dataclass(frozen=True)
class CauseCandidate:
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


def weigh(start: StartEffects, excluded: Collection[str] = ()) -> list[CauseCandidate]:
    """Every mechanism that is not excluded, added to a model; the best choice of each, best first.

    All are tried, and those within reach of the best are fitted to the end.
    """
    groups: dict[str, list[int]] = {}
    for k, acting in enumerate(start.acting):
        if acting.name not in excluded and acting not in start.model.acting:
            groups.setdefault(acting.mechanism.name, []).append(k)
    tried: dict[str, CauseCandidate] = {}
    for group in groups.values():
        trials = []
        for acting in _most_promising(start, group):
            trial = refitted(start.model, (*start.model.acting, acting), to_the_end=False)
            trials.append(judged(start.model, trial, float(np.log(len(group)))))
        tried |= {c.name: c for c in sorted(trials, key=lambda c: c.gain)}
    hopeful = IN_REACH * max((c.gain for c in tried.values()), default=0.0) - CLOSE_BY
    fitted = [
        judged(start.model, refitted(c.fit, c.fit.acting), c.raw - c.gain) if c.gain > hopeful else c
        for c in tried.values()
    ]
    standing = [c for c in fitted if c.gain <= min(hopeful, LIKELY) or _is_possible(start.model, c)]
    return sorted(standing, key=lambda c: -c.gain)


def _is_possible(start: ModelFit, c: CauseCandidate) -> bool:
    """Whether a cause that earns something holds in what it claims besides."""
    return (
        not _adhesion_turns_negative(start, c) and _more_than_groups_differ(start, c) and _specimens_lie_apart(start, c)
    )


def _adhesion_turns_negative(start: ModelFit, c: CauseCandidate) -> bool:
    """Whether a cause holds only with an adhesion below zero, which no surface has. What the calibration on the flat
    sample takes up of an offset or a load ends in the adhesion: one that is too large shows there."""
    sd = np.sqrt(np.diag(c.fit.covariance))[ADHESION]
    return bool(np.any(c.fit.law[ADHESION] < np.minimum(start.law[ADHESION], 0.0) - BELOW_ZERO * sd))


def _more_than_groups_differ(start: ModelFit, c: CauseCandidate) -> bool:
    """Whether a cause of whole sessions, of one specimen or of whole loads is likely beside what else sets these apart.

    One day or one specimen may differ from the others by far more than is usual, and the model may be wrong about each
    pattern at one load by as much as it may be at all of them. A physical cause has to show more than a factor on the
    tests of that day or specimen, or on those of every pattern at that load, in each regime. A recorded column claims
    no more than that it differs, and a label that is wrong says by how much.
    """
    s, m, here = c.fit.setup, c.acting.mechanism, _changed_tests(c)
    session, specimen, load = session_of(s.observations.conditions), s.specimen, s.log_pressure.round(4)
    of_sessions = not np.isin(session[~here], session[here]).any()
    of_one_specimen = len(np.unique(specimen[here])) == 1 and m.choosing.all_or_nothing_sd is None
    of_loads = not np.isin(load[~here], load[here]).any()
    if m.any_column or here.all() or not (of_sessions or of_one_specimen or of_loads):
        return True
    if of_sessions or of_one_specimen:
        apart = _with_factors(s, here[:, None], np.full((1, 2), ANY_FACTOR))
    else:
        sample, patterns = s.observations.conditions.sample, _patterned(s)
        sizes = np.array([s.predictor.error[name].offset for name in patterns]).reshape(-1, 2)
        apart = _with_factors(s, here[:, None] & (sample[:, None] == np.array(patterns, str)), WITHIN * sizes)
    differs = fit(apart, start.acting, start=start)
    beside = judged(differs, fit(apart, c.fit.acting, start=c.fit), 0.0)
    return beside.raw > LIKELY


def _specimens_lie_apart(start: ModelFit, c: CauseCandidate) -> bool:
    """Whether the specimens of a wrong label are likelier to differ by a factor of any size each than not to differ.

    A label that is wrong is seen at first as specimens that lie far from the others of their sample. Among hundreds of
    labels some follow what the model leaves along the load, by specimens that lie where their label says.
    """
    if c.acting.mechanism.choosing.all_or_nothing_sd is None:
        return True
    s = c.fit.setup
    moved = np.unique(s.specimen[_changed_tests(c)])
    apart = _with_factors(s, s.specimen[:, None] == moved, np.full((len(moved), 2), ANY_FACTOR))
    return fit(apart, start.acting, start=start).score > start.score


def _patterned(s: Setup) -> list[str]:
    """The samples about whose patterns the model may be wrong."""
    names = np.unique(s.observations.conditions.sample).tolist()
    return [name for name in names if min(s.predictor.error[name].offset) > 0.0]


def _changed_tests(c: CauseCandidate) -> NDArray[np.bool_]:
    """The tests (n,) that a cause changes."""
    return np.any(np.abs(effect_of(c.fit.setup, c.fit.law, c.acting, c.values)) > NO_CHANGE, axis=1)


def _with_factors(s: Setup, groups: NDArray[np.bool_], sizes: FloatArray) -> Setup:
    """The same where the tests of each of ``groups`` (n, k) may differ by a factor in each regime, of the standard
    deviations ``sizes`` (k, 2) of ln T."""
    factors = groups[:, None, :, None] * np.eye(2)[:, None, :]
    return s.with_effects(factors.reshape(len(groups), 2, -1), sizes.ravel())


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


def refitted(f: ModelFit, acting: Sequence[Acting], to_the_end: bool = True) -> ModelFit:
    """The same campaign with these mechanisms, from where a fit has got to."""
    return fit(f.setup, acting, start=f, to_the_end=to_the_end)


def judged(start: ModelFit, fitted: ModelFit, choosing: float) -> CauseCandidate:
    """What a fit earns beyond ``start``, a direct measurement included: its parameters and the choosing, in log
    likelihood, are paid for."""
    acting = fitted.acting[-1]
    measured = acting.measured_evidence(float(fitted.values[-1][0]))
    raw = fitted.score - start.score + measured - PER_PARAMETER * (len(acting.mechanism.parameters) - 1)
    sd = acting.mechanism.choosing.all_or_nothing_sd
    if sd is not None:
        raw -= 0.5 * ((fitted.values[-1][0] - acting.mechanism.amplitude.start) / sd) ** 2
    return CauseCandidate(acting, fitted, float(raw - choosing), float(raw))


def sort_rivals(
    start: ModelFit, best: CauseCandidate, ranked: Sequence[CauseCandidate]
) -> tuple[tuple[CauseCandidate, ...], tuple[CauseCandidate, ...]]:
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
    rivals = [c for c, apart in zip(near, told, strict=True) if apart and c.gain > best.gain - CLOSE]
    rivals = [c for c in rivals if c.raw > best.raw - CLOSE]
    return (best, *alike), tuple(rivals)


def _likeness(start: ModelFit, best: CauseCandidate, others: Sequence[CauseCandidate]) -> FloatArray:
    """Cosine between what ``best`` changes in the fitted ln T and what each other changes, (others,).

    Every model has its own flat law fitted, so what the flat law can absorb is already removed; the sample error
    and the specimens are taken out here.
    """
    f, ground = best.fit, Target(best.fit.setup, best.fit.acting[:-1])
    x = np.concatenate([f.law, *f.values[:-1]])
    jacobian = ground.jacobian(x, ground.predict(x))
    changes = [c.fit.predicted - start.predicted for c in (best, *others)]
    left = replace(f, jacobian=jacobian).cleared(np.stack(changes, axis=2))[0]
    length = np.sqrt(np.sum(left**2, axis=0)) + 1e-12
    return np.asarray((left[:, 1:].T @ left[:, 0]) / (length[1:] * length[0]))


def weights_of(candidates: Sequence[CauseCandidate]) -> FloatArray:
    """Shares of candidates by likelihood, adding to one; the likelihood is trusted as far as the laws are.

    Between laws that may each be wrong in form, a large log likelihood parts less than it seems: differences
    count in units of the tie that :data:`TIED` allows.
    """
    gains = np.array([c.gain for c in candidates])
    unit = max(1.0, TIED[1] * gains.max() / CLOSE)
    return np.asarray(softmax(gains / unit))


@displayed()
@dataclass(frozen=True)
class Named:
    """What explains the campaign: one set of candidates per cause, the best first in each.

    ``model`` is fitted with the causes; ``left`` is the screen of what remains after all layers. ``rivals`` are
    distinct mechanisms that explain the last cause about equally; ``remainders`` are what follows a column and no
    mechanism, each a screen of that contrast alone. ``wrong_in_form`` are mechanisms that were left out because a
    misfit remained in the very column they depend on, ``weighed`` all that were weighed for the first cause.
    """

    model: ModelFit
    left: Screen
    causes: tuple[tuple[CauseCandidate, ...], ...] = ()
    rivals: tuple[CauseCandidate, ...] = ()
    remainders: tuple[Screen, ...] = ()
    wrong_in_form: tuple[str, ...] = ()
    weighed: tuple[CauseCandidate, ...] = ()

    @property
    def acting(self) -> list[Acting]:
        """The best mechanism of every cause."""
        return [alike[0].acting for alike in self.causes]

    @property
    def p_left(self) -> float:
        """Adjusted p value of what remains."""
        return float(self.left.p.min())


def name_causes(
    start: StartEffects,
    first: Screen,
    excluded: Collection[str],
    level_beside: Callable[[ModelFit], float],
    screen_of: Callable[[ModelFit], Screen],
) -> Named:
    """Add layers while a misfit remains, then keep the mechanisms that stand beside the others.

    ``first`` is the screen of the model without mechanisms and ``screen_of`` that of what a model leaves, in which a
    misfit has a chance below ``level_beside`` that model. The model of the result is fitted without the remainders.
    """
    named, level = Named(start.model, first), level_beside(start.model)
    weighed: tuple[CauseCandidate, ...] = ()
    for _ in range(MAX_LAYERS):
        if named.p_left >= level:
            break
        barred = {*excluded, *named.wrong_in_form}
        before = start if named.model is start.model else start_effects(allowed_wrong_form(named.model))
        ranked = weigh(before, barred)
        weighed = weighed or tuple(ranked)
        grown = _grown(named, before.model, ranked, level)
        if grown is None:
            break
        left, beside = screen_of(grown.model), level_beside(grown.model)
        newest = grown.causes[-1][0] if len(grown.causes) > len(named.causes) else None
        if newest is not None and _misfit_in_own_column(newest, left, beside):
            named = replace(named, wrong_in_form=tuple(sorted({*named.wrong_in_form, newest.name})))
        else:
            named, level = replace(grown, left=left), beside
    standing = _standing(_picked_again(named, excluded, first, level), first, level)
    left = named.left if standing.acting == named.acting else screen_of(standing.model)
    named = replace(standing, left=left)
    if named.remainders:
        model = fit(start.model.setup, named.model.acting, start=named.model)
        named = replace(named, model=model)
    return replace(named, weighed=weighed)


def best_beyond_chance(ranked: Sequence[CauseCandidate], seen: Screen, level: float) -> CauseCandidate | None:
    """The first of those that chance does not make as strong, and that are likely once their choices are paid for; what
    is within chance explains no misfit."""
    return next((c for c in ranked if c.gain > LIKELY and seen.p_library(c.strength) < level), None)


def with_errors_of_patterns_anew(seen: Screen, start: StartEffects, excluded: Collection[str]) -> Screen:
    """The screen where every likely cause is stronger by what the errors of the patterns earn, beyond a further
    parameter, when their size is estimated beside it.

    A screen tests near the noise of the model without causes. What a cause changes on several patterns looks there like
    patterns that the model describes badly, and its score is weak. All other noise stays as it is. What is off on one
    pattern alone is what an error of a pattern is, and by chance one is the largest.
    """
    s, sizes = start.model.setup, start.model.noise.sizes
    free, others = s.of_patterns, ~s.of_patterns & (s.group != FIXED)
    if not free.any():
        return seen
    strength, sample, patterned = seen.strength.copy(), s.observations.conditions.sample, {*_patterned(s)}
    before, still = (
        fit(held_at(s, here, sizes), start.model.acting, start=start.model) for here in (others, others | free)
    )
    for c in weigh(replace(start, model=before), excluded):
        here = [contrast.acting == c.acting for contrast in seen.contrasts]
        if c.gain > LIKELY and any(here) and len(patterned & {*sample[_changed_tests(c)].tolist()}) > 1:
            earned = c.raw - judged(still, fit(still.setup, c.fit.acting, start=c.fit), 0.0).raw
            strength[here] = np.sqrt(strength[here] ** 2 + 2.0 * max(earned - PER_PARAMETER, 0.0))
    return replace(seen, strength=strength, p=np.array([seen.p_adjusted(float(value)) for value in strength]))


def strongest_beside_mechanisms(seen: Screen, level: float, flat: str) -> Screen | None:
    """The strongest contrast beyond chance that is no mechanism, alone."""
    for k in np.argsort(-seen.strength):
        if seen.p[k] >= level:
            return None
        if seen.contrasts[k].kind != "mechanism" and not seen.contrasts[k].is_taken_up(flat):
            return seen.alone(int(k))
    return None


def _grown(named: Named, before: ModelFit, ranked: Sequence[CauseCandidate], level: float) -> Named | None:
    """One layer more: the best mechanism, unless a free course of a column explains far more; None without either.

    ``before`` is the model on top of which they were ``ranked``, the formulas of its causes allowed to be off.
    """
    best = best_beyond_chance(ranked, named.left, level)
    other = strongest_beside_mechanisms(named.left, level, named.model.setup.observations.flat)
    if best is not None and (other is None or best.raw > 0.5 * float(other.strength[0]) ** 2 - CLOSE):
        alike, rivals = (_on_top_of(named.model, found) for found in sort_rivals(before, best, ranked))
        return replace(named, model=alike[0].fit, causes=(*named.causes, alike), rivals=rivals)
    if other is None:
        return None
    wider = with_free_columns(named.model.setup, other.contrasts[0].columns, other.coefficients[0])
    model = fit(wider, named.model.acting, start=named.model)
    return replace(named, model=model, remainders=(*named.remainders, other))


def _on_top_of(model: ModelFit, found: Sequence[CauseCandidate]) -> tuple[CauseCandidate, ...]:
    """The same candidates, fitted on top of a model whose causes follow their formulas."""
    return tuple(
        c if c.fit.setup is model.setup else replace(c, fit=fit(model.setup, c.fit.acting, start=c.fit)) for c in found
    )


def beside_others(model: ModelFit, acting: Acting) -> CauseCandidate:
    """What one of the mechanisms of a model earns beside the others, by its formula or one that is off by as much as
    theirs may be."""
    others = [a for a in model.acting if a is not acting]
    without = allowed_wrong_form(refitted(model, others))
    by_formula = refitted(without, [*others, acting])
    nearly = allowed_wrong_form(by_formula, len(others))
    return max((judged(without, f, 0.0) for f in (by_formula, nearly)), key=lambda c: c.raw)


def _misfit_in_own_column(cause: CauseCandidate, left: Screen, level: float) -> bool:
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


def _picked_again(named: Named, excluded: Collection[str], first: Screen, level: float) -> Named:
    """Each cause but the last was picked before the later ones were known: pick it again beside them, or leave it out
    where nothing is beyond chance there."""
    for alike in named.causes[:-1]:
        k = next(k for k, known in enumerate(named.causes) if known[0].acting is alike[0].acting)
        alone = _without(named, alike[0].acting)
        before = start_effects(allowed_wrong_form(alone.model))
        ranked = weigh(before, {*excluded, *named.wrong_in_form})
        best = best_beyond_chance(ranked, first, level)
        if best is None:
            named = alone
            continue
        found, others = (_on_top_of(alone.model, each) for each in sort_rivals(before.model, best, ranked))
        causes = (*named.causes[:k], found, *named.causes[k + 1 :])
        named = replace(named, model=found[0].fit, causes=causes, rivals=(*named.rivals, *others))
    return named


def _standing(named: Named, first: Screen, level: float) -> Named:
    """The causes that are still beyond chance when all other layers are there."""
    for alike in named.causes if len(named.causes) + len(named.remainders) > 1 else ():
        if first.p_library(beside_others(named.model, alike[0].acting).strength) >= level:
            named = _without(named, alike[0].acting)
    return named


def _without(named: Named, acting: Acting) -> Named:
    """The same without one cause: the model, and the candidates of the others, are fitted without it."""
    kept, causes = [alike for alike in named.causes if alike[0].acting is not acting], []
    for alike in kept:
        others = [known[0].acting for known in kept if known is not alike]
        causes.append(tuple(replace(c, fit=refitted(c.fit, [*others, c.acting])) for c in alike))
    return replace(named, model=refitted(named.model, [alike[0].acting for alike in kept]), causes=tuple(causes))
