"""The diagnosis in words: misfits, causes, exclusions, and the smallest effects that a campaign could show."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from tribo.diagnose.search.looks import Look, candidates
from tribo.diagnose.search.screen import Screen, beyond_law, cleared
from tribo.diagnose.search.weigh import Candidate
from tribo.diagnose.statistics.direct_evidence import Evidence, certain_evidence, stated_evidence
from tribo.diagnose.statistics.interval import recovered
from tribo.diagnose.statistics.model import Acting, ModelFit, predict
from tribo.diagnose.terms import ABSORBED, in_words, not_varied
from tribo.diagnose.verdict import Cause, Estimate, Excluded, Misfit, Outcome
from tribo.mechanisms.record import Mechanism
from tribo.mechanisms.table import MECHANISMS, mechanism

SHOWN = 8
WHAT = {
    "static": "static friction", "sliding": "sliding friction", "both": "friction (static and sliding)",
    "drop": "the drop from static to sliding friction",
}  # fmt: skip
NOT_TESTABLE = "cannot be tested with this design"


def misfits_of(screened: Screen, level: float, flat: str = "") -> list[Misfit]:
    """The looks that chance does not explain, the strongest first. Mechanisms are reported as causes instead.

    A difference between the sample ``flat`` and the other samples is reported as a misfit of the other samples, because
    the model is calibrated on the flat one.
    """
    found: list[Misfit] = []
    order = np.argsort(-screened.strength)
    seen: set[tuple[str, str]] = set()
    for k in order:
        look = screened.looks[k]
        p = screened.p_adjusted(float(screened.strength[k]))
        key = (_covariate(look), look.sample)
        if p >= level or len(found) >= SHOWN:
            break
        if look.kind != "mechanism" and not look.is_taken_up(flat) and key not in seen:
            seen.add(key)
            found.append(_misfit(look, float(screened.size[k]), screened.coefficients[k], p))
    if not found and len(order) and screened.p_adjusted() < level:
        k = order[0]
        look = screened.looks[k]
        found.append(_misfit(look, float(screened.size[k]), screened.coefficients[k], screened.p_adjusted()))
    return found


def _covariate(look: Look) -> str:
    """The column that a look follows; for a mechanism the columns it needs."""
    if look.acting is None:
        return look.covariate.split(",")[0]
    return look.acting.mechanism.column(look.acting.choice)


def _misfit(look: Look, size: float, coefficients: np.ndarray, p: float) -> Misfit:
    percent = 100.0 * float(np.expm1(min(size, 5.0)))
    of = f" of {look.sample}" if look.sample and look.kind != "specimen" else ""
    text = f"{sentence_case(WHAT[look.observable])}{of} {_predicate(look, coefficients)}"
    text += f": {percent:.0f} %, peak to peak (adjusted p {p_text(p)})."
    return Misfit(look.observable, look.sample, _covariate(look), percent, p, text)


def _predicate(look: Look, coefficients: np.ndarray) -> str:
    """What the observable does relative to the model, in words."""
    column, _, detail = look.covariate.partition(", ")
    words = in_words(column)
    up = coefficients[0] > 0
    if look.acting is not None:
        return f"varies as expected from {acting_in_words(look.acting)}"
    if look.kind == "sample":
        return _of_sample(column, detail, up)
    if look.kind == "specimen":
        return _of_specimen(column, look.sample, up)
    if look.kind == "trend":
        return f"{_goes(up)} with {words} relative to the model"
    if look.kind == "period":
        return f"varies periodically with {words}" + (f" ({detail} pulls)" if detail else "")
    if look.kind == "block":
        return f"{_lies(up)} for {words} {detail} than in the rest of the series"
    if look.kind == "level":
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
    return acting.mechanism.in_words + (f" ({acting.choice})" if acting.choice else "")


def name_in_words(name: str) -> str:
    """The plain name of a mechanism that a verdict names, with the column it may name."""
    _, _, label = name.partition(":")
    return mechanism(name).in_words + (f" ({label})" if label else "")


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


def cause_of(candidate: Candidate, weight: float, baseline: ModelFit) -> Cause:
    """A weighed mechanism with its parameters and 90 % intervals, its effect beyond what ``baseline`` fits."""
    parameters = estimates(candidate.fit, len(candidate.fit.acting) - 1)
    m = candidate.acting.mechanism
    moved = candidate.fit.predicted - baseline.predicted
    size = 100.0 * float(np.expm1(np.clip(np.ptp(moved), 0.0, 5.0)))
    name, first = next(iter(parameters.items()))
    text = (
        f"{sentence_case(acting_in_words(candidate.acting))}: {_estimate(name, first)}. It changes T by {size:.0f} %, "
        f"peak to peak. {signs_of(m)}"
    )
    return Cause(candidate.name, weight, parameters, text)


def signs_of(m: Mechanism) -> str:
    """The signs of a mechanism, and how to distinguish it from what has similar ones."""
    return f"Expected signs: {m.shows}. To distinguish it from {m.confused_with}: {m.separates}."


def _estimate(name: str, e: Estimate) -> str:
    return f"{name} = {e.value:.3g} {e.unit}".rstrip() + f" (90 % interval {e.low:.3g} to {e.high:.3g})"


def estimates(f: ModelFit, index: int) -> dict[str, Estimate]:
    """Parameters of one mechanism of a fit with their 90 % intervals."""
    parameters = f.acting[index].mechanism.parameters
    return {
        p.name: Estimate(value, low, high, p.unit)
        for p, (value, low, high) in zip(parameters, recovered(f, index), strict=True)
    }


def causes_from_evidence(evidence: Mapping[str, Evidence]) -> list[tuple[Cause, Misfit]]:
    """Mechanisms that direct evidence shows with certainty; p values are adjusted for every estimate that was made."""
    looks = sum(e.looks for e in evidence.values())
    return [_cause_from(name, e, e.p_adjusted(looks)) for name, e in certain_evidence(evidence).items()]


def _cause_from(name: str, e: Evidence, p: float) -> tuple[Cause, Misfit]:
    m, stated = MECHANISMS[name], stated_evidence()[name]
    value = Estimate(e.value, *e.interval, e.unit)
    text = f"{sentence_case(m.in_words)}: {_estimate(m.amplitude.name, value)}, {stated.source}."
    observable, percent = ("rise", 100.0 * e.change) if stated.quantity == "rise" else ("zero", float("nan"))
    cause = Cause(name, 1.0, {m.amplitude.name: value}, text)
    return cause, Misfit(observable, "", stated.covariate, percent, p, text)


def exclusions(
    baseline: ModelFit, evidence: Mapping[str, Evidence], unseen: Collection[str]
) -> list[Excluded]:
    """What is not weighed: mechanisms that the design cannot show, and those that direct evidence decides."""
    conditions = baseline.setup.observations.conditions
    reasons = {
        name: _why_not_weighed(m, evidence.get(name), name in unseen, m.applies(conditions))
        for name, m in MECHANISMS.items()
    }
    return [Excluded(name, reason) for name, reason in reasons.items() if reason]


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


def smallest_effects(
    baseline: ModelFit, screened: Screen, level: float, unseen: Collection[str]
) -> dict[str, float]:
    """Peak-to-peak effect in percent that each mechanism would need to be found half the time."""
    need = float(np.quantile(screened.chance, 1.0 - level)) if len(screened.chance) else 3.7
    found: dict[str, float] = {}
    s = baseline.setup
    before = predict(s, baseline.law, (), ())
    acting = candidates(s, baseline.law)
    columns = np.stack(
        [predict(s, baseline.law, (a,), (a.mechanism.start(),)) - before for a in acting], axis=2
    )
    left = np.sqrt(np.sum(cleared(baseline, columns)[0] ** 2, axis=0))
    size = np.ptp(beyond_law(baseline, columns), axis=(0, 1))
    for k, a in enumerate(acting):
        if left[k] > 1e-6 and a.name not in unseen:
            percent = 100.0 * float(np.expm1(min(size[k] * need / left[k], 5.0)))
            found[a.name] = min(percent, found.get(a.name, np.inf))
    return {n: round(float(v), 2) for n, v in found.items() if v < 300.0}


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
        return _named(causes, equivalent)
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


def _named(causes: Sequence[Cause], equivalent: Sequence[Sequence[str]]) -> str:
    tied = [" or ".join(name_in_words(n) for n in names) for names in equivalent]
    alone = [name_in_words(c.mechanism) for c in causes if not any(c.mechanism in names for names in equivalent)]
    reasons = list(dict.fromkeys([*tied, *alone]))
    told = " This design cannot distinguish the mechanisms joined by \"or\"." if tied else ""
    cause, these = ("Cause", "this mechanism") if len(reasons) == 1 else ("Causes", "these mechanisms")
    return (
        f"The model fails beyond chance. {cause}: {'; '.join(reasons)}. With {these} included, the remaining "
        f"differences are within chance.{told}"
    )


def patterns_apart(misfits: Sequence[Misfit]) -> tuple[str, ...]:
    """The samples that each have a misfit of their own, where there are three or more and no other column has one."""
    samples = tuple(dict.fromkeys(m.sample for m in misfits if m.sample))
    alone = all(m.covariate in ("sample", "normal_load_N") for m in misfits)
    return samples if alone and len(samples) >= 3 else ()
