"""The layers of a verdict: corrections of patterns, causes, and what follows a column without a law."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from tribo.diagnose.effects import residual_of
from tribo.diagnose.search.naming import Named
from tribo.diagnose.search.screen import Screen
from tribo.diagnose.search.weighing import Candidate, judged, refitted
from tribo.diagnose.sentences import Weighed, misfit_remaining, p_text, sentence_case
from tribo.diagnose.statistics.gain import gain
from tribo.diagnose.statistics.linearisation import ModelFit
from tribo.diagnose.statistics.model import effect_of
from tribo.diagnose.statistics.pattern_correction import PatternCorrection, Percent, pattern_corrections
from tribo.diagnose.statistics.percent import percent
from tribo.diagnose.verdict import Estimate, Gain, Layer
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
