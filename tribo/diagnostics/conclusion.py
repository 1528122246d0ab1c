"""The verdict of a diagnosis, put together from its finished pieces: misfits, causes, what was left out, layers."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tribo.diagnostics.candidates import Candidate, Named, Remainder, judged, refitted, weights_of
from tribo.diagnostics.contrasts import Screen
from tribo.diagnostics.direct_evidence import Evidence, TraceFindings, stated_evidence
from tribo.diagnostics.effect_sizes import Effect, Residual, effect_of_contrast, percent, residual_of
from tribo.diagnostics.fit import ModelFit, residual_on_flat
from tribo.diagnostics.inference import (
    PatternCorrection,
    PatternExcess,
    estimates,
    gain,
    gain_of_zero,
    pattern_corrections,
    pattern_excess,
)
from tribo.diagnostics.model import effect_of
from tribo.diagnostics.planning import next_test_of
from tribo.diagnostics.score_statistics import StartEffects
from tribo.diagnostics.verdict import (
    CERTAIN_CAUSES,
    UNTESTED,
    AgainstModel,
    Cause,
    Estimate,
    Excluded,
    Gain,
    Layer,
    Misfit,
    Outcome,
    Verdict,
    Why,
)
from tribo.mechanisms.record import Conditions, Mechanism
from tribo.mechanisms.table import MECHANISMS
from tribo.records import REGIMES, FloatArray

Weighed = tuple[Candidate, float, Mapping[str, Estimate]]  # with its share and its parameters
SHOWN = 8
SHARE = 0.1  # of the largest effect, above which a cause is said to act on a sample or in a regime


def misfits_of(screened: Screen, level: float, residual: Residual, flat: str = "") -> list[Misfit]:
    """The contrasts that chance does not explain, the strongest first. Mechanisms are reported as causes instead.

    ``residual`` is that of the model that was looked at; the size of each misfit is read off it.

    A difference between the sample ``flat`` and the other samples is reported as a misfit of the other samples, because
    the model is calibrated on the flat one.
    """

    def at(k: int) -> Misfit:
        size, strength = float(screened.size[k]), float(screened.strength[k])
        effect = effect_of_contrast(screened.contrasts[k], residual, screened.coefficients[k], size, strength)
        return misfit_of(effect, float(screened.p[k]))

    found: list[Misfit] = []
    order = np.argsort(-screened.strength)
    seen: set[tuple[str, str]] = set()
    for k in order:
        contrast = screened.contrasts[k]
        key = (contrast.column, contrast.sample)
        if screened.p[k] >= level or len(found) >= SHOWN:
            break
        if contrast.kind != "mechanism" and not contrast.is_taken_up(flat) and key not in seen:
            seen.add(key)
            found.append(at(int(k)))
    if not found and len(order) and screened.p[order[0]] < level:
        found.append(at(int(order[0])))
    return found


def misfit_remaining(r: Remainder, residual: Residual) -> Misfit:
    """What follows a recorded column and no mechanism."""
    return misfit_of(effect_of_contrast(r.contrast, residual, r.coefficients, r.size, r.strength), r.p)


def misfit_of(effect: Effect, p: float) -> Misfit:
    """What a contrast sees as a misfit."""
    c = effect.contrast
    return Misfit(
        c.observable, c.sample, c.column, effect.percent, p, low=effect.low, high=effect.high, shows=effect
    )  # fmt: skip


def each_once(misfits: Sequence[Misfit]) -> tuple[Misfit, ...]:
    """Each column of each observable and sample once: the first of its misfits."""
    first = {(m.observable, m.sample, m.covariate): m for m in reversed(misfits)}
    return tuple(m for m in misfits if first[m.observable, m.sample, m.covariate] is m)


def misfits_of_patterns(corrections: Sequence[Layer], level: float) -> list[Misfit]:
    """Each patterned sample whose mean friction differs from the model beyond chance, the largest first."""
    found = [
        Misfit(c.regimes[0], c.name, "sample", c.effect_percent, c.p_adjusted, low=c.low, high=c.high, shows=c)
        for c in corrections
        if c.p_adjusted < level
    ]
    return sorted(found, key=lambda m: -abs(m.effect_percent))


def patterns_apart(misfits: Sequence[Misfit]) -> tuple[str, ...]:
    """The samples that each have a misfit of their own, where there are three or more and no other column has one."""
    samples = tuple(dict.fromkeys(m.sample for m in misfits if m.sample))
    alone = all(m.covariate in ("sample", "normal_load_N") for m in misfits)
    return samples if alone and len(samples) >= 3 else ()


def causes_weighed(shown: Sequence[Weighed], baseline: ModelFit) -> list[Cause]:
    """Weighed mechanisms with their parameters, the effect of each beyond what ``baseline`` fits."""
    found = []
    for candidate, weight, parameters in shown:
        moved = candidate.fit.predicted - baseline.predicted
        low, high = percent(np.array([moved.min(), moved.max()]))
        changes = float(low), float(high)
        found.append(Cause(candidate.name, weight, parameters, choice=candidate.acting.choice, changes=changes))
    return found


def causes_from_evidence(certain: Mapping[str, tuple[Evidence, float]]) -> list[tuple[Cause, Misfit]]:
    """Mechanisms that direct evidence shows with certainty, each as a cause and as the misfit that it is."""
    found = []
    for name, stated in stated_evidence().items():
        if name in certain:
            e, p = certain[name]
            parameters = {MECHANISMS[name].amplitude.name: Estimate(e.value, *e.interval, e.unit)}
            cause = Cause(name, 1.0, parameters, shows=stated)
            observable, size = ("rise", 100.0 * e.change) if stated.quantity == "rise" else ("zero", float("nan"))
            found.append((cause, Misfit(observable, "", stated.covariate, size, p, shows=cause)))
    return found


def exclusions(
    conditions: Conditions, evidence: Mapping[str, Evidence], absorbed: Collection[str]
) -> list[Excluded]:
    """What is not weighed: mechanisms that the design cannot show, and those that direct evidence decides."""
    reasons = {
        name: _why_not_weighed(m, evidence.get(name), name in absorbed, m.applies(conditions))
        for name, m in MECHANISMS.items()
    }
    return [Excluded(name, why, shows=evidence.get(name)) for name, why in reasons.items() if why is not None]


def _why_not_weighed(m: Mechanism, e: Evidence | None, absorbed: bool, applies: bool) -> Why | None:
    """The reason; None where a mechanism is weighed."""
    stated = m.evidence
    if stated is not None and e is not None and stated.corrected:
        return "zero subtracted"
    if absorbed:
        return "absorbed"
    if not applies:
        return "not varied"
    if stated is not None and e is not None and not e.certain:
        return "not certain"
    return "only in traces" if m.untested else None


def exclusions_beside(
    causes: Sequence[Cause], barred: Sequence[Excluded], weighed: Sequence[Candidate]
) -> list[Excluded]:
    """What was not weighed, and what explains the campaign less well than the causes."""
    shown = {c.mechanism for c in causes}
    found = [e for e in barred if e.mechanism not in shown]
    if not causes:
        return found
    for c in weighed:
        if c.name not in shown and c.name not in {e.mechanism for e in found}:
            size = c.acting.mechanism.amplitude
            one_sided = c.values[0] == size.zero and size.zero in (size.low, size.high)
            found.append(Excluded(c.name, "wrong sign" if one_sided else "explains less", weighed[0].gain - c.gain))
    return found


def pattern_layers(model: ModelFit) -> list[Layer]:
    """One layer per patterned sample and regime: how far the measurement is from the model, with its interval."""
    return [_pattern_layer(c) for c in pattern_corrections(model)]


def _pattern_layer(c: PatternCorrection) -> Layer:
    parameters = {f"at {load:g} N": estimate for load, estimate in c.at_load.items()}
    return Layer(
        kind="pattern_correction", name=c.sample, samples=(c.sample,), regimes=(c.regime,), p_adjusted=c.p,
        effect_percent=c.mean.value, low=c.mean.low, high=c.mean.high, parameters=parameters,
    )  # fmt: skip


def cause_layers(
    named: Named, shown: Sequence[Weighed], first: Screen, before: ModelFit, rng: np.random.Generator
) -> list[Layer]:
    """One layer per cause, each with what it adds beside the others; ``shown`` holds the parameters of each."""
    parameters = [next(p for c, _, p in shown if c is alike[0]) for alike in named.causes]
    return [_cause_layer(named, k, p, first, before, rng) for k, p in enumerate(parameters)]


def _cause_layer(
    named: Named, k: int, parameters: Mapping[str, Estimate], first: Screen, before: ModelFit, rng: np.random.Generator
) -> Layer:
    best, *tied = named.causes[k]
    others = [alike[0].acting for j, alike in enumerate(named.causes) if j != k]
    without = refitted(named.model, others) if others else before
    beside = judged(without, refitted(without, [*others, best.acting]), 0.0)
    change = effect_of(beside.fit.setup, beside.fit.law, best.acting, beside.values)
    samples, regimes = _where(beside.fit, change)
    m = best.acting.mechanism
    # of two specimens that were swapped, one changes up as far as the other down: the first is taken
    test, regime = np.unravel_index(int(np.abs(change).round(9).argmax()), change.shape)
    where = int(test), int(regime)
    value, low, high = _effect_percent(best, parameters[m.amplitude.name], where)
    gained: Gain | None = gain(without, beside.fit, rng)
    c = best.fit.setup.observations.conditions
    most = REGIMES[where[1]], str(c.sample[where[0]]), float(c.normal_load_N[where[0]])
    return Layer(
        kind="cause", name=best.name, samples=samples, regimes=regimes, p_adjusted=first.p_library(beside.strength),
        effect_percent=value, low=low, high=high, parameters=parameters, formula=m.formula,
        tied_with=tuple(other.name for other in tied), gain=gained, choice=best.acting.choice, most=most,
    )  # fmt: skip


def _where(f: ModelFit, change: FloatArray) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The samples and regimes in which ln T changes by more than a tenth of the largest change."""
    least = SHARE * np.abs(change).max()
    sample = f.setup.observations.conditions.sample
    samples = tuple(str(name) for name in np.unique(sample) if np.abs(change[sample == name]).max() > least)
    return samples, tuple(r for k, r in enumerate(REGIMES) if np.abs(change[:, k]).max() > least)


def _effect_percent(best: Candidate, amplitude: Estimate, where: tuple[int, int]) -> tuple[float, float, float]:
    """The change of T (percent) at the test and regime ``where``, with the ends of the amplitude's interval."""
    f = best.fit

    def at(size: float) -> float:
        values = np.array([size, *best.values[1:]])
        return float(percent(effect_of(f.setup, f.law, best.acting, values)[where]))

    ends = sorted((at(amplitude.low), at(amplitude.high)))
    return at(amplitude.value), ends[0], ends[1]


def remainder_layers(named: Named) -> list[Layer]:
    """What follows a recorded column, and no mechanism of the library."""
    found = []
    for r in named.remainders:
        m = misfit_remaining(r, residual_of(named.model))
        samples: Sequence[str] = (m.sample,) if m.sample else ()
        regimes = (m.observable,) if m.observable in REGIMES else tuple(REGIMES)
        layer = Layer(
            kind="remainder", name=m.covariate, samples=tuple(samples), regimes=regimes, p_adjusted=r.p,
            effect_percent=m.effect_percent, low=m.low, high=m.high, shows=m,
        )  # fmt: skip
        found.append(layer)
    return found


NEEDED = 3.7  # strength that chance reaches in one campaign of a hundred, where none was simulated


@dataclass(frozen=True)
class Findings:
    """What the stages of a diagnosis found, and the ``level`` at which it decides."""

    effects: StartEffects
    screened: Screen
    evidence: TraceFindings
    barred: Sequence[Excluded]
    named: Named | None
    level: float

    @property
    def baseline(self) -> ModelFit:
        return self.effects.model


def conclude(found: Findings, rng: np.random.Generator) -> Verdict:
    """The verdict; ``rng`` draws the resamples behind the error of the gain."""
    baseline, named, level = found.baseline, found.named, found.level
    excess = _excess(found)
    outcome = _outcome(named, excess, bool(found.evidence.certain), level)
    smallest = _smallest_effects(found)
    shown = _shown(named) if outcome in CERTAIN_CAUSES else []
    gained = _gain(found, outcome, rng)
    equivalent = _equivalent(named) if outcome in ("named", "partly") else ()
    flat = baseline.setup.observations.flat
    direct = causes_from_evidence(found.evidence.certain)
    weighed = causes_weighed(shown, baseline)
    calibrated = Residual(residual_on_flat(baseline), baseline.setup.observations.conditions)
    misfits = [m for _, m in direct] + misfits_of(found.screened, level, calibrated, flat)
    causes = [c for c, _ in direct] + sorted(weighed, key=lambda c: -c.weight)
    if named is not None:
        beyond = residual_of(named.model)
        left = [misfit_remaining(r, beyond) for r in named.remainders] + misfits_of(named.left, level, beyond, flat)
        misfits = [*left, *misfits] if named.causes and not patterns_apart(misfits) else [*misfits, *left]
    layers = _layers(found, shown, rng)
    corrections = [layer for layer in layers if layer.kind == "pattern_correction"]
    misfits = [*(misfits_of_patterns(corrections, level) if excess is not None else ()), *misfits]
    excluded = exclusions_beside(causes, found.barred, named.weighed if named is not None else ())
    wrong_in_form = named.wrong_in_form if named is not None and outcome in ("unknown", "partly") else ()
    o = baseline.setup.observations
    return Verdict(
        verdict=outcome,
        misfits=each_once(misfits),
        causes=tuple(causes),
        equivalent=equivalent,
        excluded=tuple(e for e in excluded if e.why not in UNTESTED),
        not_testable=tuple(e for e in excluded if e.why in UNTESTED),
        layers=layers,
        gain=gained,
        set_aside=o.set_aside,
        next_test=next_test_of(named, outcome, misfits, o.conditions),
        smallest_effects=smallest,
        shows=AgainstModel(tuple(sorted(set(o.conditions.sample.tolist()))), o.flat, excess, wrong_in_form),
    )


def _layers(found: Findings, shown: Sequence[Weighed], rng: np.random.Generator) -> tuple[Layer, ...]:
    """Of the final model: pattern corrections, causes with the parameters ``shown``, and what is left."""
    named, baseline = found.named, found.baseline
    if named is None:
        return tuple(pattern_layers(baseline))
    causes = cause_layers(named, shown, found.screened, baseline, rng)
    return (*pattern_layers(named.model), *causes, *remainder_layers(named))


def _excess(found: Findings) -> PatternExcess | None:
    """Of the model with the causes that were named, where the patterned samples differ from it beyond its own error."""
    named = found.named
    excess = pattern_excess(named.model if named is not None and named.causes else found.baseline)
    return excess if excess is not None and excess.p < found.level else None


def _outcome(named: Named | None, excess: PatternExcess | None, direct: bool, level: float) -> Outcome:
    if named is None and not direct:
        return "no_misfit" if excess is None else "unknown"
    if named is None:
        return "named"
    if not named.causes:
        return "unknown"
    if named.remainders or named.p_left < level:
        return "partly"
    return "undetermined" if named.rivals else "named"


def _equivalent(named: Named | None) -> tuple[tuple[str, ...], ...]:
    if named is None:
        return ()
    return tuple(tuple(c.name for c in alike) for alike in named.causes if len(alike) > 1)


def _shown(named: Named | None) -> list[Weighed]:
    """Every mechanism of every cause, and the rivals of the last, with their shares and parameters."""
    if named is None:
        return []
    found: list[Weighed] = []
    for k, alike in enumerate(named.causes):
        shown = [*alike, *(named.rivals if k == len(named.causes) - 1 else ())]
        sizes = [estimates(c.fit, len(c.fit.acting) - 1) for c in shown]
        found += zip(shown, map(float, weights_of(shown)), sizes, strict=True)
    return found


def _smallest_effects(found: Findings) -> dict[str, float]:
    """Peak-to-peak effect in percent that each mechanism would need to be found half the time."""
    chance, effects = found.screened.chance, found.effects
    need = float(np.quantile(chance, 1.0 - found.level)) if len(chance) else NEEDED
    barred = {e.mechanism for e in found.barred}
    smallest: dict[str, float] = {}
    for a, left, size in zip(effects.acting, effects.length, effects.size, strict=True):
        if left > 1e-6 and a.name not in barred:
            percent = 100.0 * float(np.expm1(min(size * need / left, 5.0)))
            smallest[a.name] = min(percent, smallest.get(a.name, np.inf))
    return {n: round(float(v), 2) for n, v in smallest.items() if v < 300.0}


def _gain(found: Findings, outcome: Outcome, rng: np.random.Generator) -> Gain | None:
    """Of the extended model where a mechanism was weighed, else of what direct evidence shows."""
    named = found.named
    if named is not None and named.causes and outcome != "unknown":
        return gain(found.baseline, named.model, rng)
    quantities = [stated_evidence()[name].quantity for name in found.evidence.certain]
    zeros = [quantity for quantity in quantities if quantity != "rise"]
    if outcome == "named" and zeros:
        return gain_of_zero(found.baseline.setup.observations, zeros[0] == "zero drift", rng)
    return None
