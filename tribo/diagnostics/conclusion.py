"""The layers of a verdict: corrections of patterns, causes, and what follows a column without a law.

The verdict of a diagnosis, put together from its finished pieces.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tribo.diagnostics.candidates import Candidate, Named, judged, refitted, weights_of
from tribo.diagnostics.contrasts import Screen
from tribo.diagnostics.direct_evidence import TraceFindings, stated_evidence
from tribo.diagnostics.effect_sizes import Residual, percent, residual_of
from tribo.diagnostics.fit import ModelFit, residual_on_flat
from tribo.diagnostics.gain import gain, gain_of_zero
from tribo.diagnostics.intervals import (
    PatternCorrection,
    PatternExcess,
    Percent,
    estimates,
    pattern_corrections,
    pattern_excess,
)
from tribo.diagnostics.model import effect_of
from tribo.diagnostics.planning import next_test_of
from tribo.diagnostics.score_statistics import StartEffects
from tribo.diagnostics.sentences import (
    NOT_TESTABLE,
    Weighed,
    causes_from_evidence,
    causes_weighed,
    each_once,
    excess_in_words,
    exclusions_beside,
    misfit_remaining,
    misfits_of,
    misfits_of_patterns,
    misfits_remaining,
    other_formula,
    p_text,
    patterns_apart,
    sentence_case,
    summary,
)
from tribo.diagnostics.verdict import CERTAIN_CAUSES, Estimate, Excluded, Gain, Layer, Outcome, Verdict
from tribo.records import REGIMES, FloatArray

SHARE = 0.1  # of the largest effect, above which a cause is said to act on a sample or in a regime


def pattern_layers(model: ModelFit) -> list[Layer]:
    """One layer per patterned sample and regime: how far the measurement is from the model, with its interval."""
    return [_pattern_layer(c) for c in pattern_corrections(model)]


def _pattern_layer(c: PatternCorrection) -> Layer:
    parameters = {f"at {load:g} N": _estimate(percent) for load, percent in c.at_load.items()}
    text = (
        f"{sentence_case(c.regime)} friction of {c.sample}: measured over modelled T, less one, is "
        f"{c.mean.value:+.0f} % (geometric mean over its tests; 90 % interval {c.mean.low:+.0f} to {c.mean.high:+.0f} "
        f"%; adjusted p {p_text(c.p)})."
    )
    return Layer(
        kind="pattern_correction", name=c.sample, samples=(c.sample,), regimes=(c.regime,), p_adjusted=c.p,
        effect_percent=c.mean.value, low=c.mean.low, high=c.mean.high, parameters=parameters, text=text,
    )  # fmt: skip


def _estimate(percent: Percent) -> Estimate:
    return Estimate(percent.value, percent.low, percent.high, "%")


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
    text = (
        f"{sentence_case(m.in_words)} changes T by {value:+.0f} % (90 % interval {low:+.0f} to "
        f"{high:+.0f} %) where it acts most: {_place(best.fit, where)}."
    )
    return Layer(
        kind="cause", name=best.name, samples=samples, regimes=regimes, p_adjusted=first.p_library(beside.strength),
        effect_percent=value, low=low, high=high, parameters=parameters, formula=m.formula,
        tied_with=tuple(c.name for c in tied), gain=gained, text=text, at=_place(best.fit, where),
        choice=best.acting.choice,
    )  # fmt: skip


def _where(f: ModelFit, change: FloatArray) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The samples and regimes in which ln T changes by more than a tenth of the largest change."""
    least = SHARE * np.abs(change).max()
    sample = f.setup.observations.conditions.sample
    samples = tuple(str(name) for name in np.unique(sample) if np.abs(change[sample == name]).max() > least)
    return samples, tuple(r for k, r in enumerate(REGIMES) if np.abs(change[:, k]).max() > least)


def _place(f: ModelFit, where: tuple[int, int]) -> str:
    """ "sliding friction of C at 1.37 N"."""
    c = f.setup.observations.conditions
    return f"{REGIMES[where[1]]} friction of {c.sample[where[0]]} at {c.normal_load_N[where[0]]:.3g} N"


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
            effect_percent=m.effect_percent, low=m.low, high=m.high, text=m.text,
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
        left = [*misfits_remaining(named.remainders, beyond), *misfits_of(named.left, level, beyond, flat)]
        misfits = [*left, *misfits] if named.causes and not patterns_apart(misfits) else [*misfits, *left]
    layers = _layers(found, shown, rng)
    corrections = [layer for layer in layers if layer.kind == "pattern_correction"]
    misfits = [*(misfits_of_patterns(corrections, level) if excess is not None else ()), *misfits]
    excluded = exclusions_beside(causes, found.barred, named.weighed if named is not None else ())
    shown_misfits = each_once(misfits)
    text = summary(outcome, causes, equivalent, misfits, smallest)
    if named is not None and outcome in ("unknown", "partly"):
        text += other_formula(named.wrong_in_form)
    if excess is not None:
        text = f"{text} {excess_in_words(excess)}"
    return Verdict(
        verdict=outcome,
        misfits=shown_misfits,
        causes=tuple(causes),
        equivalent=equivalent,
        excluded=tuple(e for e in excluded if not e.reason.startswith(NOT_TESTABLE)),
        not_testable=tuple(e for e in excluded if e.reason.startswith(NOT_TESTABLE)),
        layers=layers,
        gain=gained,
        set_aside=baseline.setup.observations.set_aside,
        next_test=next_test_of(named, outcome, misfits, baseline.setup.observations.conditions),
        text=text,
        smallest_effects=smallest,
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
