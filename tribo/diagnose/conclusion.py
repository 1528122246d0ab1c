"""The verdict of a diagnosis, put together from its finished pieces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tribo.diagnose.effects import Residual, residual_of
from tribo.diagnose.layers import cause_layers, pattern_layers, remainder_layers
from tribo.diagnose.next_test import next_test_of
from tribo.diagnose.search.naming import Named
from tribo.diagnose.search.rivals import weights_of
from tribo.diagnose.search.screen import Screen
from tribo.diagnose.sentences import (
    NOT_TESTABLE,
    Weighed,
    causes_from_evidence,
    causes_weighed,
    each_once,
    excess_in_words,
    exclusions_beside,
    misfits_of,
    misfits_of_patterns,
    misfits_remaining,
    other_formula,
    patterns_apart,
    summary,
)
from tribo.diagnose.statistics.direct_evidence import TraceFindings, stated_evidence
from tribo.diagnose.statistics.fit import residual_on_flat
from tribo.diagnose.statistics.gain import gain, gain_of_zero
from tribo.diagnose.statistics.interval import estimates
from tribo.diagnose.statistics.linearisation import ModelFit
from tribo.diagnose.statistics.pattern_excess import PatternExcess, pattern_excess
from tribo.diagnose.statistics.start_effects import StartEffects
from tribo.diagnose.verdict import CERTAIN_CAUSES, Excluded, Gain, Layer, Outcome, Verdict

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
