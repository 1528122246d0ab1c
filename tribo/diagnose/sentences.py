"""The diagnosis in words: misfits, causes, exclusions, and the smallest effects that a campaign could show."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from tribo.diagnose.search.looks import OBSERVABLES, Look, candidates
from tribo.diagnose.search.screen import Screen, beyond_law, cleared
from tribo.diagnose.search.weigh import Candidate
from tribo.diagnose.statistics.direct_evidence import Evidence
from tribo.diagnose.statistics.interval import recovered
from tribo.diagnose.statistics.model import ModelFit, predict
from tribo.diagnose.verdict import Cause, Estimate, Excluded, Misfit, Outcome
from tribo.mechanisms.table import MECHANISMS

SHOWN = 8
WHAT = {
    "static": "static friction", "sliding": "sliding friction",
    "both": "static and sliding friction alike", "drop": "the drop from static to sliding",
}  # fmt: skip
COLUMN = {
    "normal_load_N": "the normal load", "speed_mm_s": "the speed", "hold_s": "the hold", "run_order": "the run order",
    "specimen_run": "how often the specimen was pulled", "started_at": "the time since the first pull",
    "temperature_C": "the temperature", "humidity_pct": "the humidity", "time of day": "the time of day",
    "tau0": "the share that adhesion has in it",
}  # fmt: skip


def misfits_of(screened: Screen, level: float, flat: str = "") -> list[Misfit]:
    """The looks that chance does not explain, the strongest first; mechanisms speak for themselves elsewhere.

    What parts the sample ``flat`` from all others is said of the others: the model is calibrated on it.
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
    """The column a look follows; a mechanism is said by what it needs."""
    if look.acting is None:
        return look.covariate.split(",")[0]
    if look.acting.mechanism.name == "mislabelled_specimen":
        return "specimen"
    return look.acting.choice or ", ".join(look.acting.mechanism.needs)


def _misfit(look: Look, size: float, coefficients: np.ndarray, p: float) -> Misfit:
    percent = 100.0 * float(np.expm1(min(size, 5.0)))
    of = f" of {look.sample}" if look.sample and look.kind != "specimen" else ""
    text = f"{WHAT[look.observable][0].upper()}{WHAT[look.observable][1:]}{of} {_predicate(look, coefficients)}"
    text += f": {percent:.0f} % from end to end (adjusted p {_p(p)})."
    return Misfit(look.observable, look.sample, _covariate(look), percent, p, text)


def _predicate(look: Look, coefficients: np.ndarray) -> str:
    """What the observable does, in words."""
    column, _, detail = look.covariate.partition(", ")
    words = COLUMN.get(column, column)
    up = coefficients[0] > 0
    if look.acting is not None:
        named = f"{look.acting.mechanism.name} {look.acting.choice}".rstrip()
        return f"has the shape that {named} would give"
    if look.kind == "sample":
        if column == "sample":
            return f"is {'higher' if up else 'lower'} as a whole than the other samples lead one to expect"
        bent = "upwards" if up else "downwards"
        return f"bends {bent} with {words}" if detail else f"{_goes(up)} with {words} beyond the model"
    if look.kind == "specimen":
        by_load = f"{_goes(up)} more with the normal load" if column.endswith(" by load") else ""
        return f"of {column.removesuffix(' by load')} ({look.sample}) {by_load or _lies(up)} than of its siblings"
    if look.kind == "trend":
        return f"{_goes(up)} with {words}"
    if look.kind == "period":
        return f"follows {words} as a wave" + (f" of {detail}" if detail else "")
    if look.kind == "block":
        return f"{_lies(up)} in the stretch of {words} {detail} than elsewhere"
    if look.kind == "level":
        return f"differs with {words}"
    return f"follows {words}, {_course(coefficients)}"


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


def _p(p: float) -> str:
    return "below 0.001" if p < 1e-3 else f"{p:.3f}"


def cause_of(candidate: Candidate, weight: float, baseline: ModelFit) -> Cause:
    """A weighed mechanism with its parameters and 90 % intervals, its effect beyond what ``baseline`` fits."""
    parameters = estimates(candidate.fit, len(candidate.fit.acting) - 1)
    mechanism = candidate.acting.mechanism
    moved = candidate.fit.predicted - baseline.predicted
    size = 100.0 * float(np.expm1(np.clip(np.ptp(moved), 0.0, 5.0)))
    first = next(iter(parameters.items()))
    choice = f" ({candidate.acting.choice})" if candidate.acting.choice else ""
    text = (
        f"{candidate.name}{choice}: {first[0]} = {first[1].value:.3g} {first[1].unit}".rstrip()
        + f" (90 % {first[1].low:.3g} to {first[1].high:.3g}), moving T by {size:.0f} % from end to end."
        + f" Sign: {mechanism.shows}. What separates it: {mechanism.separates}."
    )
    return Cause(candidate.name, weight, parameters, text)


def estimates(f: ModelFit, index: int) -> dict[str, Estimate]:
    """Parameters of one mechanism of a fit with their 90 % intervals."""
    parameters = f.acting[index].mechanism.parameters
    return {
        p.name: Estimate(value, low, high, p.unit)
        for p, (value, low, high) in zip(parameters, recovered(f, index), strict=True)
    }


def cause_from_evidence(name: str, e: Evidence, others: dict[str, Evidence]) -> tuple[Cause, Misfit]:
    """A mechanism that direct evidence shows by itself."""
    low, high = e.interval
    mechanism = MECHANISMS[name]
    parameter = mechanism.amplitude
    observable = "rise" if name == "bulk_viscoelasticity" else "zero"
    covariate = {"load_cell_offset": "", "load_cell_drift": "started_at"}.get(name, "speed_mm_s")
    text = f"{name}: {parameter.name} = {e.value:.3g} {e.unit}".rstrip() + f" (90 % {low:.3g} to {high:.3g})"
    text += {
        "load_cell_offset": ", read off the force before contact; it was subtracted from every force.",
        "load_cell_drift": ", read off the force before contact; the zero of each pull was subtracted.",
    }.get(name, ", read off the slope of the rise.")
    cause = Cause(name, 1.0, {parameter.name: Estimate(e.value, low, high, e.unit)}, text)
    percent = 100.0 * e.change if observable == "rise" else float("nan")
    return cause, Misfit(observable, "", covariate, percent, 1e-6, text)


def exclusions(
    baseline: ModelFit, evidence: dict[str, Evidence], unseen: dict[str, float]
) -> list[Excluded]:
    """What the design cannot show, and what direct evidence rules out or takes over."""
    conditions = baseline.setup.observations.conditions
    found = []
    for name, mechanism in MECHANISMS.items():
        if name in evidence and name != "bulk_viscoelasticity":
            found.append(Excluded(name, _zero_reason(evidence[name])))
        elif name in unseen:
            taken = "cannot be told from this design: the free flat law takes it up"
            found.append(Excluded(name, f"{taken}; {mechanism.separates}"))
        elif not mechanism.applies(conditions):
            what = ", ".join(mechanism.needs)
            found.append(Excluded(name, f"cannot be told from this design: {what} does not vary or is not recorded"))
        elif name == "bulk_viscoelasticity" and name in evidence and not evidence[name].certain:
            e = evidence[name]
            found.append(Excluded(name, f"the rise stiffens by {100 * e.value:.1f} % per e-fold of speed at most"))
        elif name == "machine_compliance":
            found.append(Excluded(name, "cannot be told from this design: no pull of a rigid dummy to compare with"))
    return found


def _zero_reason(e: Evidence) -> str:
    state = "is" if e.certain else "is no more than"
    return (
        f"the force before contact {state} {e.value:.2g} +- {e.standard_error:.1g} {e.unit}, "
        "and each pull's own zero was subtracted, so it cannot be behind the friction forces"
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
        shown = ", ".join(f"{n} {v:.0f} %" for n, v in weak[:6])
        return (
            "Nothing beyond chance: the model calibrated on the flat sample describes this campaign within its "
            f"own error. Effects this campaign would have shown half the time (peak to peak): {shown}."
        )
    if outcome == "named":
        tied = [" or ".join(names) for names in equivalent]
        alone = [c.mechanism for c in causes if not any(c.mechanism in names for names in equivalent)]
        told = " Which of those joined by or, this design cannot tell." if tied else ""
        reason = " and ".join(dict.fromkeys([*tied, *alone]))
        return f"Beyond chance something is at work: {reason}. What is left is within chance.{told}"
    if outcome == "undetermined":
        names = ", ".join(dict.fromkeys(c.mechanism for c in causes))
        return f"The model fails beyond chance, but several mechanisms explain it about equally: {names}."
    where = misfits[0].text if misfits else "No single column stands out."
    own = patterns_apart(misfits)
    if own:
        return (
            "The model fails beyond chance and no one mechanism of the library explains it: "
            f"{', '.join(own)} part from it each in its own way, and no recorded column accounts for that. {where}"
        )
    return f"The model fails beyond chance and nothing in the library explains it. {where}"


def patterns_apart(misfits: Sequence[Misfit]) -> tuple[str, ...]:
    """The samples that misfit each by itself, where there are three or more and no further column takes part."""
    samples = tuple(dict.fromkeys(m.sample for m in misfits if m.sample))
    alone = all(m.covariate in ("sample", "normal_load_N") for m in misfits)
    return samples if alone and len(samples) >= 3 else ()


__all__ = ["OBSERVABLES", "cause_of", "exclusions", "misfits_of", "summary"]
