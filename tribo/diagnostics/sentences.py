"""The diagnosis in words: misfits, causes, exclusions and the summary."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from tribo.diagnostics.candidates import Candidate, Remainder
from tribo.diagnostics.contrasts import Contrast, Screen
from tribo.diagnostics.direct_evidence import Evidence, stated_evidence
from tribo.diagnostics.effect_sizes import Effect, Residual, effect_of_contrast, percent
from tribo.diagnostics.fit import ModelFit
from tribo.diagnostics.intervals import WITHIN, PatternExcess
from tribo.diagnostics.model import Acting
from tribo.diagnostics.terms import ABSORBED, in_words, name_in_words, not_varied
from tribo.diagnostics.verdict import Cause, Estimate, Excluded, Layer, Misfit, Outcome
from tribo.mechanisms.record import Conditions, Mechanism, TraceEvidence
from tribo.mechanisms.table import MECHANISMS, mechanism

Weighed = tuple[Candidate, float, Mapping[str, Estimate]]  # with its share and its parameters
SHOWN = 8
WHAT = {
    "static": "static friction", "sliding": "sliding friction", "both": "friction (static and sliding)",
    "drop": "the drop from static to sliding friction",
}  # fmt: skip
NOT_TESTABLE = "cannot be tested with this design"


def misfits_of(screened: Screen, level: float, residual: Residual, flat: str = "") -> list[Misfit]:
    """The contrasts that chance does not explain, the strongest first. Mechanisms are reported as causes instead.

    ``residual`` is that of the model that was looked at; the size of each misfit is read off it.

    A difference between the sample ``flat`` and the other samples is reported as a misfit of the other samples, because
    the model is calibrated on the flat one.
    """
    found: list[Misfit] = []
    order = np.argsort(-screened.strength)
    seen: set[tuple[str, str]] = set()
    for k in order:
        contrast = screened.contrasts[k]
        p = float(screened.p[k])
        key = (_covariate(contrast), contrast.sample)
        if p >= level or len(found) >= SHOWN:
            break
        if contrast.kind != "mechanism" and not contrast.is_taken_up(flat) and key not in seen:
            seen.add(key)
            found.append(_misfit_at(screened, int(k), residual))
    if not found and len(order) and screened.p[order[0]] < level:
        found.append(_misfit_at(screened, int(order[0]), residual))
    return found


def _misfit_at(screened: Screen, k: int, residual: Residual) -> Misfit:
    contrast, coefficients = screened.contrasts[k], screened.coefficients[k]
    effect = effect_of_contrast(contrast, residual, coefficients, float(screened.size[k]), float(screened.strength[k]))
    return misfit_of(contrast, effect, coefficients, float(screened.p[k]))


def misfits_remaining(remainders: Sequence[Remainder], residual: Residual) -> list[Misfit]:
    """What follows a recorded column and no mechanism, in the order in which it was found."""
    return [misfit_remaining(r, residual) for r in remainders]


def misfit_remaining(r: Remainder, residual: Residual) -> Misfit:
    """What follows a recorded column and no mechanism."""
    effect = effect_of_contrast(r.contrast, residual, r.coefficients, r.size, r.strength)
    return misfit_of(r.contrast, effect, r.coefficients, r.p)


def each_once(misfits: Sequence[Misfit]) -> tuple[Misfit, ...]:
    """Each column of each observable and sample once: the first of its misfits."""
    first = {(m.observable, m.sample, m.covariate): m for m in reversed(misfits)}
    return tuple(m for m in misfits if first[m.observable, m.sample, m.covariate] is m)


def _covariate(contrast: Contrast) -> str:
    """The column that a contrast follows; for a mechanism the columns it needs."""
    if contrast.acting is None:
        return contrast.covariate.split(",")[0]
    return contrast.acting.mechanism.column(contrast.acting.choice)


def misfit_of(contrast: Contrast, effect: Effect, coefficients: np.ndarray, p: float) -> Misfit:
    """A contrast as a misfit; ``coefficients`` tell the course of one with several columns."""
    of = f" of {contrast.sample}" if contrast.sample and contrast.kind != "specimen" else ""
    text = f"{sentence_case(WHAT[contrast.observable])}{of} {_predicate(contrast, effect.percent > 0, coefficients)}"
    text += f": {effect_in_words(effect)}, {effect.between} (adjusted p {p_text(p)})."
    return Misfit(
        contrast.observable, contrast.sample, _covariate(contrast), effect.percent, p, text, effect.low, effect.high
    )  # fmt: skip


def effect_in_words(effect: Effect) -> str:
    """ "-27 % (90 % interval -31 to -23 %)"."""
    return f"{effect.percent:+.0f} % (90 % interval {effect.low:+.0f} to {effect.high:+.0f} %)"


def _predicate(contrast: Contrast, up: bool, coefficients: np.ndarray) -> str:
    """What the observable does relative to the model, in words."""
    column, _, detail = contrast.covariate.partition(", ")
    words = in_words(column)
    if contrast.acting is not None:
        return f"varies as expected from {acting_in_words(contrast.acting)}"
    if contrast.kind == "sample":
        return _of_sample(column, detail, up)
    if contrast.kind == "specimen":
        return _of_specimen(column, contrast.sample, up)
    if contrast.kind == "trend":
        return f"{_goes(up)} with {words} relative to the model"
    if contrast.kind == "period":
        return f"varies periodically with {words}" + (f" ({detail} pulls)" if detail else "")
    if contrast.kind == "block":
        return f"{_lies(up)} for {words} {detail} than in the rest of the series"
    if contrast.kind == "level":
        return f"differs between values of {words}"
    return f"follows {words}, {_course(coefficients)}"


def _of_sample(column: str, detail: str, up: bool) -> str:
    if column == "sample":
        return f"{_lies(up)} at all loads than the model predicts"
    if detail:
        return f"bends {'upwards' if up else 'downwards'} with {in_words(column)} relative to the model"
    return f"{_goes(up)} with {in_words(column)} relative to the model"


def _of_specimen(column: str, sample: str, up: bool) -> str:
    name = f"of {column.removesuffix(' by load')} ({sample})"
    if column.endswith(" by load"):
        return f"{name} {_goes(up)} with the normal load relative to the other specimens"
    return f"{name} {_lies(up)} than that of the other specimens"


def acting_in_words(acting: Acting) -> str:
    """The plain name of a mechanism, with its choice in brackets."""
    name = name_in_words(acting.name)
    said = acting.name.partition(":")[2]  # a column that the name holds already
    return name + (f" ({acting.choice})" if acting.choice and acting.choice != said else "")


def meaning_in_words(name: str) -> str:
    """What a mechanism that a verdict names means, as a clause."""
    _, _, label = name.partition(":")
    return f"friction follows the recorded column {in_words(label)}" if label else mechanism(name).meaning


def sentence_case(text: str) -> str:
    """With a capital first letter."""
    return text[:1].upper() + text[1:]


def _goes(up: bool) -> str:
    return "rises" if up else "falls"


def _lies(up: bool) -> str:
    return "is higher" if up else "is lower"


def _course(coefficients: np.ndarray) -> str:
    """The run of the bins' means; the first is zero."""
    steps = np.diff(np.concatenate([[0.0], coefficients]))
    if np.all(steps > 0):
        return "rising throughout"
    if np.all(steps < 0):
        return "falling throughout"
    middle = coefficients[:-1].mean() if len(coefficients) > 1 else coefficients[0]
    return "highest in the middle" if middle > 0.5 * coefficients[-1] else "lowest in the middle"


def p_text(p: float) -> str:
    return "below 0.001" if p < 1e-3 else f"{p:.3f}"


def causes_weighed(shown: Sequence[Weighed], baseline: ModelFit) -> list[Cause]:
    """Weighed mechanisms with their parameters, the effect of each beyond what ``baseline`` fits."""
    found = []
    for candidate, weight, parameters in shown:
        moved = candidate.fit.predicted - baseline.predicted
        low, high = percent(np.array([moved.min(), moved.max()]))
        name, first = next(iter(parameters.items()))
        text = (
            f"{sentence_case(acting_in_words(candidate.acting))}: {_estimate(name, first)}. With it, the "
            f"calibrated model changes by {low:+.0f} to {high:+.0f} %. {signs_of(candidate.acting.mechanism)}"
        )
        found.append(Cause(candidate.name, weight, parameters, text))
    return found


def signs_of(m: Mechanism) -> str:
    """The signs of a mechanism, and how to distinguish it from what has similar ones."""
    return f"Expected signs: {m.shows}. To distinguish it from {m.confused_with}: {m.separates}."


def _estimate(name: str, e: Estimate) -> str:
    return f"{name} = {e.value:.3g} {e.unit}".rstrip() + f" (90 % interval {e.low:.3g} to {e.high:.3g})"


def causes_from_evidence(certain: Mapping[str, tuple[Evidence, float]]) -> list[tuple[Cause, Misfit]]:
    """Mechanisms that direct evidence shows with certainty, each estimate with its adjusted p value."""
    return [_cause_from(name, stated, *certain[name]) for name, stated in stated_evidence().items() if name in certain]


def _cause_from(name: str, stated: TraceEvidence, e: Evidence, p: float) -> tuple[Cause, Misfit]:
    m = MECHANISMS[name]
    value = Estimate(e.value, *e.interval, e.unit)
    text = f"{sentence_case(m.in_words)}: {_estimate(m.amplitude.name, value)}, {stated.source}."
    observable, percent = ("rise", 100.0 * e.change) if stated.quantity == "rise" else ("zero", float("nan"))
    cause = Cause(name, 1.0, {m.amplitude.name: value}, text)
    return cause, Misfit(observable, "", stated.covariate, percent, p, text)


def exclusions(
    conditions: Conditions, evidence: Mapping[str, Evidence], absorbed: Collection[str]
) -> list[Excluded]:
    """What is not weighed: mechanisms that the design cannot show, and those that direct evidence decides."""
    reasons = {
        name: _why_not_weighed(m, evidence.get(name), name in absorbed, m.applies(conditions))
        for name, m in MECHANISMS.items()
    }
    return [Excluded(name, reason) for name, reason in reasons.items() if reason]


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
            found.append(Excluded(c.name, _lost(c, weighed[0].gain)))
    return found


def _lost(c: Candidate, best: float) -> str:
    """Why a weighed mechanism is not among the causes."""
    m = c.acting.mechanism
    if c.values[0] == m.amplitude.zero and m.amplitude.zero in (m.amplitude.low, m.amplitude.high):
        return "wrong sign: it can change friction in one direction only, and the misfit has the opposite sign"
    return f"explains the campaign less well: log likelihood lower by {best - c.gain:.1f}"


def _why_not_weighed(m: Mechanism, e: Evidence | None, absorbed: bool, applies: bool) -> str:
    """The reason, empty where a mechanism is weighed."""
    stated = m.evidence
    if stated is not None and e is not None and stated.corrected:
        return _zero_reason(stated.quantity, e)
    if absorbed:
        return f"{NOT_TESTABLE}: {ABSORBED}; to test it, {m.separates}"
    if not applies:
        return f"{NOT_TESTABLE}: {not_varied(m)}"
    if stated is not None and e is not None and not e.certain:
        return stated.absent.format(value=e.value, percent=100.0 * e.value)
    return f"{NOT_TESTABLE}: {m.untested}" if m.untested else ""


def _zero_reason(quantity: str, e: Evidence) -> str:
    what = "changes by" if quantity == "zero drift" else "is"
    return (
        f"the force before contact {what} {e.value:.2g} +- {e.standard_error:.1g} {e.unit}; the zero of each pull was "
        "subtracted, so it cannot explain the friction forces"
    )


def summary(
    outcome: Outcome,
    causes: Sequence[Cause],
    equivalent: Sequence[Sequence[str]],
    misfits: Sequence[Misfit],
    smallest: dict[str, float],
) -> str:
    """The verdict in two or three sentences."""
    if outcome == "no_misfit":
        weak = sorted(smallest.items(), key=lambda kv: kv[1])
        shown = ", ".join(f"{name_in_words(n)} {v:.0f} %" for n, v in weak[:6])
        return (
            "No misfit beyond chance: the model calibrated on the flat sample describes this campaign within its "
            f"own error. This campaign would have shown these effects with a probability of one half (peak to peak): "
            f"{shown}."
        )
    if outcome == "named":
        return f"{_named(causes, equivalent)} {_within_chance(causes)}{_joined(equivalent)}"
    if outcome == "partly":
        rest = misfits[0].text if misfits else "No single column explains it."
        return f"{_named(causes, equivalent)} A misfit remains beyond chance: {rest}{_joined(equivalent)}"
    if outcome == "undetermined":
        names = ", ".join(dict.fromkeys(name_in_words(c.mechanism) for c in causes))
        return f"The model fails beyond chance. Several mechanisms explain the misfit about equally well: {names}."
    where = misfits[0].text if misfits else "No single column explains the misfit."
    own = patterns_apart(misfits)
    if own:
        return (
            f"The model fails beyond chance, and no mechanism of the library explains it: {', '.join(own)} differ "
            f"from the model independently of each other, and no recorded column explains the differences. {where}"
        )
    return f"The model fails beyond chance, and no mechanism of the library explains it. {where}"


def other_formula(mechanisms: Collection[str]) -> str:
    """Mechanisms that explained a misfit in part only, because what was left followed the same column."""
    if not mechanisms:
        return ""
    names = ", ".join(sorted(name_in_words(name) for name in mechanisms))
    return (
        f" Tried and left out: {names}. Beside the formula of the library, a dependence on the same quantity remains "
        "beyond chance; the true formula may be another one."
    )


def _named(causes: Sequence[Cause], equivalent: Sequence[Sequence[str]]) -> str:
    tied = [" or ".join(name_in_words(n) for n in names) for names in equivalent]
    alone = [name_in_words(c.mechanism) for c in causes if not any(c.mechanism in names for names in equivalent)]
    reasons = list(dict.fromkeys([*tied, *alone]))
    return f"The model fails beyond chance. {'Cause' if len(reasons) == 1 else 'Causes'}: {'; '.join(reasons)}."


def _within_chance(causes: Sequence[Cause]) -> str:
    these = "this mechanism" if len(causes) == 1 else "these mechanisms"
    return f"With {these} included, the remaining differences are within chance."


def _joined(equivalent: Sequence[Sequence[str]]) -> str:
    return " This design cannot distinguish the mechanisms joined by \"or\"." if equivalent else ""


def misfits_of_patterns(corrections: Sequence[Layer], level: float) -> list[Misfit]:
    """Each patterned sample whose mean friction differs from the model beyond chance, the largest first."""
    found = [
        Misfit(c.regimes[0], c.name, "sample", c.effect_percent, c.p_adjusted, c.text, c.low, c.high)
        for c in corrections
        if c.p_adjusted < level
    ]
    return sorted(found, key=lambda m: -abs(m.effect_percent))


def excess_in_words(excess: PatternExcess) -> str:
    """By how much the patterned samples differ from the model."""
    return (
        f"The patterned samples differ from the model by about {excess.factor:.1f} times the error that is stated for "
        f"it (p {p_text(excess.p)} for a factor of at most {WITHIN:g})."
    )


def patterns_apart(misfits: Sequence[Misfit]) -> tuple[str, ...]:
    """The samples that each have a misfit of their own, where there are three or more and no other column has one."""
    samples = tuple(dict.fromkeys(m.sample for m in misfits if m.sample))
    alone = all(m.covariate in ("sample", "normal_load_N") for m in misfits)
    return samples if alone and len(samples) >= 3 else ()
