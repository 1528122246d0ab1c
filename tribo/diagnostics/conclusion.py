"""The verdict of a diagnosis, put together from its finished pieces: misfits, causes, what was left out, layers."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from tribo.diagnostics.candidates import CauseCandidate, Named, beside_others, judged, refitted, weights_of
from tribo.diagnostics.column_search import with_repeats
from tribo.diagnostics.contrasts import Screen
from tribo.diagnostics.direct_evidence import OF_ZERO, Evidence, stated_evidence
from tribo.diagnostics.effect_sizes import misfit_of_contrast, percent
from tribo.diagnostics.fit import ModelFit, residual_on_flat
from tribo.diagnostics.inference import (
    change_with_open_form,
    gain,
    gain_of_zero,
    nuisance_layers,
    pattern_corrections,
    pattern_excess,
    with_open_form,
)
from tribo.diagnostics.model import RECORDED, effect_of
from tribo.diagnostics.observations import observe, too_little
from tribo.diagnostics.planning import more_tests, next_test_of
from tribo.diagnostics.score_statistics import Absorption, StartEffects, recorded_in_part
from tribo.diagnostics.verdict import (
    CERTAIN_CAUSES,
    UNTESTED,
    AgainstModel,
    Cause,
    Estimate,
    Excluded,
    Layer,
    Misfit,
    Outcome,
    Verdict,
    Why,
)
from tribo.mechanisms import MECHANISMS
from tribo.mechanisms.record import Conditions, Mechanism
from tribo.records import REGIMES, FloatArray, Ingested

Weighed = tuple[CauseCandidate, float, Mapping[str, Estimate]]  # with its share and its parameters
SHOWN = 8
SHARE = 0.1  # of the largest effect, above which a cause is said to act on a sample or in a regime
END = 0.02  # share of the tests that have the lowest or the highest values of a column, at least
NEEDED = 3.7  # strength that chance reaches in one campaign of a hundred, where none was simulated


def misfits_of(
    screened: Screen, level: float, log_ratio: FloatArray, conditions: Conditions, flat: str = ""
) -> list[Misfit]:
    """The contrasts that chance does not explain, the strongest first. Mechanisms are reported as causes instead.

    ``log_ratio`` (n, 2) is the residual of the model that was screened; the size of each misfit is read off it.

    A difference between the sample ``flat`` and the other samples is reported as a misfit of the other samples, because
    the model is calibrated on the flat one.
    """
    beyond = [int(k) for k in np.argsort(-screened.strength)]
    beyond = beyond[: next((i for i, k in enumerate(beyond) if screened.p[k] >= level), len(beyond))]
    shown: dict[tuple[str, str], int] = {}
    for k in beyond:
        contrast = screened.contrasts[k]
        if contrast.kind != "mechanism" and not contrast.is_taken_up(flat):
            shown.setdefault((contrast.column, contrast.sample), k)
    return [misfit_of_contrast(screened, k, log_ratio, conditions) for k in [*shown.values()][:SHOWN] or beyond[:1]]


def each_once(misfits: Sequence[Misfit]) -> tuple[Misfit, ...]:
    """Each column of each observable and sample once: the first of its misfits."""
    first = {(m.observable, m.sample, m.covariate): m for m in reversed(misfits)}
    return tuple(m for m in misfits if first[m.observable, m.sample, m.covariate] is m)


def misfits_of_patterns(corrections: Sequence[Layer], level: float) -> list[Misfit]:
    """Each patterned sample whose mean friction differs from the model beyond chance, the largest first."""
    misfits = [
        Misfit(c.regimes[0], c.name, "sample", c.effect_percent, c.p_adjusted, low=c.low, high=c.high, shows=c)
        for c in corrections
        if c.p_adjusted < level
    ]
    return sorted(misfits, key=lambda m: -abs(m.effect_percent))


def patterns_apart(misfits: Sequence[Misfit]) -> tuple[str, ...]:
    """The samples that each have a misfit of their own, where there are three or more and no other column has one."""
    samples = tuple(dict.fromkeys(m.sample for m in misfits if m.sample))
    alone = all(m.covariate in ("sample", "normal_load_N") for m in misfits)
    return samples if alone and len(samples) >= 3 else ()


def causes_weighed(shown: Sequence[Weighed], baseline: ModelFit) -> list[Cause]:
    """Weighed mechanisms with their parameters, the effect of each beyond what ``baseline`` fits."""
    causes = []
    for candidate, weight, parameters in shown:
        moved = candidate.fit.predicted - baseline.predicted
        low, high = percent(np.array([moved.min(), moved.max()]))
        changes = float(low), float(high)
        causes.append(Cause(candidate.name, weight, parameters, choice=candidate.acting.choice, changes=changes))
    return causes


def causes_from_evidence(certain: Mapping[str, tuple[Evidence, float]]) -> list[tuple[Cause, Misfit]]:
    """Mechanisms that direct evidence shows with certainty, each as a cause and as the misfit that it is."""
    each = []
    for name, stated in stated_evidence().items():
        if name in certain:
            e, p = certain[name]
            parameters = {MECHANISMS[name].amplitude.name: Estimate(e.value, *e.interval, e.unit)}
            cause = Cause(name, 1.0, parameters, shows=stated)
            size = float("nan") if stated.quantity in OF_ZERO else 100.0 * e.change
            each.append((cause, Misfit(stated.observable, "", stated.covariate, size, p, shows=cause)))
    return each


def exclusions(
    conditions: Conditions, evidence: Mapping[str, Evidence], absorbed: Mapping[str, Absorption]
) -> list[Excluded]:
    """What is not weighed: mechanisms that the design cannot show, and those that direct evidence decides."""
    excluded = []
    for name, m in MECHANISMS.items():
        e = evidence.get(name) if m.evidence is not None else None
        why: Why | None = "only in traces" if m.untested else None
        if e is not None and m.evidence is not None and m.evidence.corrected:
            why = "corrected"
        elif e is not None and not e.certain:
            why = "not certain"
        elif name in absorbed:
            why = absorbed[name]
        elif not m.applies(conditions):
            why = "recorded in part" if _recorded_in_part(m, conditions) else "not varied"
        if why is not None:
            shows = _recorded_in_part(m, conditions) if why == "recorded in part" else evidence.get(name)
            excluded.append(Excluded(name, why, shows=shows))
    return excluded


def never_weighed(barred: Sequence[Excluded]) -> list[str]:
    """Those that cannot explain a misfit. What the errors of the patterns hide cannot be found alone, but a misfit may
    be of its making: it is weighed, so that nothing that looks alike is named in its place."""
    return [e.mechanism for e in barred if e.why != "hidden"]


def _recorded_in_part(m: Mechanism, conditions: Conditions) -> tuple[str, int, int] | None:
    """The column that a mechanism needs, the number of tests with a value and of all tests, where its gaps cannot be
    filled."""
    for name in m.needs:
        known = int(np.isfinite(getattr(conditions, name)).sum())
        if 0 < known < len(conditions.sample):
            return name, known, len(conditions.sample)
    return None


def exclusions_beside(
    causes: Sequence[Cause], barred: Sequence[Excluded], weighed: Sequence[CauseCandidate]
) -> list[Excluded]:
    """What was not weighed, and what explains the campaign less well than the causes."""
    shown = {c.mechanism for c in causes}
    excluded = [e for e in barred if e.mechanism not in shown]
    for c in weighed if causes else ():
        if c.name not in shown and c.name not in {e.mechanism for e in excluded}:
            size = c.acting.mechanism.amplitude
            one_sided = c.values[0] == size.zero and size.zero in (size.low, size.high)
            why: Why = "wrong sign" if one_sided else "explains less"
            excluded.append(Excluded(c.name, why, weighed[0].gain - c.gain))
    return excluded


def cause_layers(
    named: Named, shown: Sequence[Weighed], first: Screen, before: ModelFit, rng: np.random.Generator
) -> list[Layer]:
    """One layer per cause, each with what it adds beside the others; ``shown`` holds the parameters of each.

    The effect is the change of T (percent) at the test and regime where it is largest, with the ends of the amplitude's
    interval.
    """
    layers = []
    for alike in named.causes:
        best, *tied = alike
        acting, m, f = best.acting, best.acting.mechanism, best.fit
        parameters = next(p for c, _, p in shown if c is best)
        others = [a[0].acting for a in named.causes if a is not alike]
        without = refitted(named.model, others) if others else before
        beside = judged(without, refitted(without, [*others, acting]), 0.0)
        p = first.p_library(beside_others(named.model, acting).strength)
        size = np.abs(effect_of(beside.fit.setup, beside.fit.law, acting, beside.values))
        # of two specimens that were swapped, one changes up as far as the other down: the first is taken
        test, regime = map(int, np.unravel_index(int(size.round(9).argmax()), size.shape))
        sample = f.setup.observations.conditions.sample
        least = SHARE * size.max()
        amplitude = parameters[m.amplitude.name]
        value, *ends = (
            float(percent(effect_of(f.setup, f.law, acting, np.array([a, *best.values[1:]]))[test, regime]))
            for a in (amplitude.value, amplitude.low, amplitude.high)
        )
        low, high = sorted(ends)
        load = float(f.setup.observations.conditions.normal_load_N[test])
        layer = Layer(
            kind="cause", name=best.name,
            samples=tuple(str(name) for name in np.unique(sample) if size[sample == name].max() > least),
            regimes=tuple(r for k, r in enumerate(REGIMES) if size[:, k].max() > least),
            p_adjusted=p, effect_percent=value, low=low, high=high,
            parameters=parameters, formula=m.formula, tied_with=tuple(c.name for c in tied),
            gain=gain(without, beside.fit, rng), choice=acting.choice, most=(REGIMES[regime], str(sample[test]), load),
        )  # fmt: skip
        layers.append(replace(layer, over=_over_recorded_values(best, parameters[m.amplitude.name], layer)))
    return layers


def _over_recorded_values(best: CauseCandidate, amplitude: Estimate, layer: Layer) -> dict[str, Any] | None:
    """``Layer.over``: the mean over the tests with the highest values of the column, less that over the lowest."""
    f, acting = best.fit, best.acting
    c = f.setup.observations.conditions
    needs = [name for name in acting.mechanism.needs if name in RECORDED]
    column = needs[0] if needs else acting.choice if acting.mechanism.any_column else ""
    try:
        x = c.recorded(column) if column in RECORDED else np.asarray(c.columns[column], float)
    except (KeyError, ValueError):
        return None
    here = np.flatnonzero(np.isin(c.sample, layer.samples) & np.isfinite(x))
    if not len(here) or np.ptp(x[here]) == 0.0:
        return None
    low_end, high_end = np.quantile(x[here], (END, 1.0 - END))
    first, last = here[x[here] <= low_end], here[x[here] >= high_end]
    regimes = [REGIMES.index(r) for r in layer.regimes]

    def change(values: FloatArray) -> float:
        effect = effect_of(f.setup, f.law, acting, values)[:, regimes]
        return float(effect[last].mean() - effect[first].mean())

    if len(acting.mechanism.parameters) > 1:
        ends = change_with_open_form(f, len(f.acting) - 1, change).tolist()
    else:
        ends = [change(np.array([size])) for size in (amplitude.value, amplitude.low, amplitude.high)]
    value, *between = (float(percent(end)) for end in ends)
    return {
        "column": column, "from": float(x[first].mean()), "to": float(x[last].mean()),
        "percent": value, "low": min(between), "high": max(between),
    }  # fmt: skip


def remainder_layers(misfits: Sequence[Misfit]) -> list[Layer]:
    """What follows a recorded column, and no mechanism of the library."""
    return [
        Layer(
            kind="remainder", name=m.covariate, samples=(m.sample,) if m.sample else (),
            regimes=(m.observable,) if m.observable in REGIMES else tuple(REGIMES), p_adjusted=m.p_adjusted,
            effect_percent=m.effect_percent, low=m.low, high=m.high, shows=m,
        )
        for m in misfits
    ]  # fmt: skip


def conclude(
    effects: StartEffects,
    screened: Screen,
    certain: Mapping[str, tuple[Evidence, float]],
    barred: Sequence[Excluded],
    named: Named | None,
    levels: tuple[float, float],
    rng: np.random.Generator,
) -> Verdict:
    """The verdict at the ``levels`` of a misfit and of days and drift; ``certain`` is the evidence of the traces with
    its p values, ``barred`` what was not weighed, and ``rng`` draws the resamples behind the error of the gain."""
    level, of_nuisance = levels
    baseline = effects.model
    o = baseline.setup.observations
    model = named.model if named is not None else baseline
    excess = pattern_excess(model if named is not None and named.causes else baseline)
    excess = excess if excess is not None and excess[1] < level else None
    outcome = _outcome(named, excess is not None, bool(certain), level)
    shown = _shown(named) if named is not None and outcome in CERTAIN_CAUSES else []
    gained = None
    zeros = [q for q in (stated_evidence()[name].quantity for name in certain) if q in OF_ZERO]
    if named is not None and named.causes and outcome != "unknown":
        gained = gain(baseline, model, rng)
    elif outcome == "named" and zeros:
        gained = gain_of_zero(o, zeros[0] == "zero drift", rng)
    equivalent = (
        tuple(tuple(c.name for c in alike) for alike in named.causes if len(alike) > 1)
        if named is not None and outcome in ("named", "partly")
        else ()
    )
    direct = causes_from_evidence(certain)
    misfits = [m for _, m in direct] + misfits_of(screened, level, residual_on_flat(baseline), o.conditions, o.flat)
    causes = [c for c, _ in direct] + sorted(causes_weighed(shown, baseline), key=lambda c: -c.weight)
    patterns = pattern_corrections(model)
    layers = patterns
    if named is not None:
        remain = [misfit_of_contrast(alone, 0, model.residual, o.conditions) for alone in named.remainders]
        left = remain + misfits_of(named.left, level, model.residual, o.conditions, o.flat)
        misfits = [*left, *misfits] if named.causes and not patterns_apart(misfits) else [*misfits, *left]
        layers = [*patterns, *cause_layers(named, shown, screened, baseline, rng), *remainder_layers(remain)]
    layers = [*layers, *nuisance_layers(model, of_nuisance)]
    if excess is not None:
        misfits = [*misfits_of_patterns(patterns, level), *misfits]
    excluded = exclusions_beside(causes, barred, named.weighed if named is not None else ())
    wrong_in_form = named.wrong_in_form if named is not None and outcome in ("unknown", "partly") else ()
    return Verdict(
        verdict=outcome,
        misfits=each_once(misfits),
        causes=tuple(causes),
        equivalent=equivalent,
        excluded=tuple(e for e in excluded if e.why not in UNTESTED),
        not_testable=tuple(e for e in excluded if e.why in UNTESTED),
        layers=tuple(layers),
        gain=gained,
        set_aside=o.set_aside,
        next_test=next_test_of(
            named, outcome, misfits, model, [e.mechanism for e in barred if e.why == "hidden"]
        ),
        smallest_effects=_smallest_effects(effects, screened.chance, {e.mechanism for e in barred}, level),
        shows=AgainstModel(
            tuple(sorted(set(o.conditions.sample.tolist()))), o.flat, excess, wrong_in_form,
            in_part=recorded_in_part(model, level),
        ),
    )


def cannot_tell(ingested: Ingested) -> Verdict | None:
    """The verdict on a campaign that is too small to be compared with the model; None where it is not."""
    lack = too_little(observe(ingested))
    if lack is None:
        return None
    lack = with_repeats(lack, ingested)
    return Verdict("cannot_tell", set_aside=ingested.set_aside, next_test=more_tests(lack), shows=lack)


def _outcome(named: Named | None, excess: bool, direct: bool, level: float) -> Outcome:
    if named is None and not direct:
        return "unknown" if excess else "no_misfit"
    if named is None:
        return "named"
    if not named.causes:
        return "unknown"
    if named.remainders or named.p_left < level:
        return "partly"
    return "undetermined" if named.rivals else "named"


def _shown(named: Named) -> list[Weighed]:
    """Every mechanism of every cause, and the rivals of the last, with their shares and parameters."""
    each: list[Weighed] = []
    for k, alike in enumerate(named.causes):
        shown = [*alike, *(named.rivals if k == len(named.causes) - 1 else ())]
        sizes = [with_open_form(c.fit, len(c.fit.acting) - 1) for c in shown]
        each += zip(shown, map(float, weights_of(shown)), sizes, strict=True)
    return each


def _smallest_effects(
    effects: StartEffects, chance: FloatArray, barred: Collection[str], level: float
) -> dict[str, float]:
    """Peak-to-peak effect in percent that each mechanism would need to be found half the time."""
    need = float(np.quantile(chance, 1.0 - level)) if len(chance) else NEEDED
    smallest: dict[str, float] = {}
    for a, left, size in zip(effects.acting, effects.length, effects.size, strict=True):
        if left > 1e-6 and a.name not in barred:
            in_percent = 100.0 * float(np.expm1(min(size * need / left, 5.0)))
            smallest[a.name] = min(in_percent, smallest.get(a.name, np.inf))
    return {n: round(float(v), 2) for n, v in smallest.items() if v < 300.0}
