"""The card on top of a report: the answer in one sentence, with what it rests on. Made once, then written everywhere.

Page, PDF, index page, terminal and ``--json`` take their words from this record.

What a campaign shows, in one plain sentence, and what else must be known before it is believed.

The card as text for a terminal.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tribo.comparison import findings, study_lookup
from tribo.diagnostics.sentences import meaning_in_words, sentence_case
from tribo.diagnostics.terms import in_words, name_in_words
from tribo.display import displayed
from tribo.files import write_text
from tribo.records import REGIMES, CombinedFit, LawFit, Study
from tribo.report.tables import PA_PER_KPA, all_set_aside
from tribo.report.words.wording import specimens_of, uncertainty_kind
from tribo.wording.numerals import counted, joined, loads_in_words, significant, with_uncertainty
from tribo.wording.verdict_headings import without_model

NUMBERS = {"mu": "μ", "tau0_Pa": "τ₀"}


@dataclass(frozen=True)
class CardLaw:
    """mu and tau0 (T0 without an area) of one sample in one regime, and what dominates their uncertainty."""

    sample: str
    regime: str
    mu: str
    intercept: str
    largest: str


@dataclass(frozen=True)
class NextStep:
    """The next test: what, why, and how long (``hours``, None where nobody can say); ``line`` says all of it."""

    what: str
    why: str
    hours: float | None
    line: str


@displayed(lambda card: card.counts)
@dataclass(frozen=True)
class Card:
    """What someone must know who reads nothing else.

    ``sentence`` says what happens to friction, how much, where and what it is called; ``meanings`` are the names used
    in it, each with one sentence. ``used`` and ``set_aside``
    count tests; ``specimens`` counts each one once, also if it was pulled in two directions. ``doubts`` are the numbers
    outside their physical bounds, one sentence each.
    """

    sentence: str
    meanings: tuple[tuple[str, str], ...]
    used: int
    set_aside: int
    specimens: int
    counts: str
    intercept: str
    laws: tuple[CardLaw, ...]
    uncertainty: str
    to_know: tuple[str, ...]
    next_test: NextStep | None
    doubts: tuple[str, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """The card as plain types."""
        return asdict(self)


def card_of(study: Study, verdict: Mapping[str, Any] | None) -> Card:
    """The card of a study; ``verdict`` is the diagnosis in the form of verdict.json, None where none was made."""
    campaign, used = study.ingested.campaign, study.ingested.pulls
    tests = [t for t in campaign.tests if t.test_id in used]
    aside, specimens = len(all_set_aside(study)), len(specimens_of(campaign, tests))
    fits = [fit for s in study_lookup.sample_numbers(study) for r in REGIMES if (fit := _law(study, s, r)) is not None]
    return Card(
        sentence=sentence(study, verdict),
        meanings=meanings(verdict),
        used=len(tests),
        set_aside=aside,
        specimens=specimens,
        counts=_counts(study, len(tests), aside, specimens),
        intercept="τ₀ (kPa)" if campaign.has_area else "T₀ (N)",
        laws=tuple(card_law(fit) for fit in fits),
        uncertainty=uncertainty_kind(study),
        to_know=tuple(to_know(study, verdict)),
        next_test=_next(verdict),
        doubts=tuple(map(str, study.doubts)),
    )


def write_card(card: Card, out: Path) -> Path:
    """OUT/card.json."""
    return write_text(out / "card.json", json.dumps(card.as_dict(), indent=2, ensure_ascii=False) + "\n")


def _law(study: Study, sample: str, regime: str) -> LawFit | None:
    fit = study_lookup.stated_fit(study, sample, regime)
    return fit if fit is not None and "tau0_Pa" in fit.parameters and np.isfinite(fit.values).all() else None


def card_law(fit: LawFit) -> CardLaw:
    """One fit as the card shows it."""
    unit = PA_PER_KPA if fit.has_area else 1.0  # without an area tau0_Pa stands for T0 in newton
    return CardLaw(
        fit.sample,
        fit.regime,
        with_uncertainty(fit.value("mu"), fit.standard_uncertainty("mu")),
        with_uncertainty(fit.value("tau0_Pa") / unit, fit.standard_uncertainty("tau0_Pa") / unit),
        _largest(fit),
    )


def _largest(fit: LawFit) -> str:
    """ "repeats (60 %)", or "μ: wire angle (52 %); τ₀: specimens (48 %)" where they differ."""
    if not isinstance(fit, CombinedFit) or not fit.largest:
        return ""
    names = NUMBERS if fit.has_area else NUMBERS | {"tau0_Pa": "T₀"}
    parts = {key: fit.largest[key] for key in names}
    if len({name for name, _ in parts.values()}) == 1:
        low, high = sorted(round(share) for _, share in parts.values())
        name = next(iter(parts.values()))[0]
        return f"{name} ({low} %)" if low == high else f"{name} ({low} to {high} %)"
    return "; ".join(f"{names[key]}: {name} ({share:.0f} %)" for key, (name, share) in parts.items())


def _counts(study: Study, used: int, aside: int, specimens: int) -> str:
    tests = [t for t in study.ingested.campaign.tests if t.test_id in study.ingested.pulls]
    samples = [s for s in study_lookup.sample_numbers(study) if any(t.sample == s for t in tests)]
    levels = np.unique(study_lookup.load_levels(np.array([t.normal_load_N for t in tests], float)))
    where = f"{counted(specimens, 'specimen')}, {counted(len(samples), 'sample')} ({joined(samples)})"
    loads = loads_in_words(levels.tolist()) if used else ""
    left_out = f"{counted(aside, 'test')} set aside" if aside else "no test set aside"
    doubts = f", {counted(len(study.doubts), 'doubtful number')}" if study.doubts else ""
    return f"{counted(used, 'test')} used, {left_out}{doubts}; {where}{f'; {loads}' if loads else ''}."


def _next(verdict: Mapping[str, Any] | None) -> NextStep | None:
    found = (verdict or {}).get("next_test")
    if not found:
        return None
    hours = (found.get("design") or {}).get("hours")
    what, why = str(found["text"]), why_next(verdict or {})
    return NextStep(what, why, hours, f"{what.rstrip('.')}{_duration(hours)}: {why}.")


def _duration(hours: float | None) -> str:
    """ " (about 2.1 h)"; empty where nobody can say."""
    if hours is None:
        return ""
    return f" (about {hours:.1f} h)" if hours >= 1 else f" (about {60 * hours:.0f} min)"


BENT = "the load means deviate from a straight line"
OBSERVABLES = {
    "static": "static friction", "sliding": "sliding friction", "both": "static and sliding friction",
    "drop": "the ratio of static to sliding friction", "rise": "the slope of the rise of the force",
    "zero": "the force before contact",
}  # fmt: skip
MOST_SAMPLES = 3


def sentence(study: Study, verdict: Mapping[str, Any] | None) -> str:
    """What happens to friction, how much, with its interval, where, and what it is called."""
    if verdict is None:
        return _without_diagnosis(study)
    if without_model(verdict):
        return _alone(verdict)
    outcome = str(verdict["verdict"])
    if outcome == "no_misfit":
        return _no_misfit(study, verdict)
    layers = sorted(_layers(verdict, "cause"), key=lambda layer: -abs(layer["effect_percent"]))
    if layers and outcome != "unknown":
        return _caused(study, verdict, layers)
    if _layers(verdict, "law"):
        law = str(_layers(verdict, "law")[0]["text"]).rstrip(".")
        return f"{law}; no mechanism of the library explains it." if outcome == "unknown" else f"{law}."
    if verdict["causes"] and outcome != "unknown":
        return _direct(verdict)
    return _unknown(verdict)


def _alone(verdict: Mapping[str, Any]) -> str:
    """Without the model: what friction varies with beside the load; without anything, the first law."""
    causes = [str(cause["text"]) for cause in verdict["causes"]]
    laws = [str(layer["text"]) for layer in _layers(verdict, "baseline")]
    found = causes or [*laws[:1], "Nothing beyond the law of each sample was found."]
    return " ".join(found)


def meanings(verdict: Mapping[str, Any] | None) -> tuple[tuple[str, str], ...]:
    """The plain name and the meaning of every mechanism that the verdict names, each once."""
    names = dict.fromkeys(str(c["mechanism"]) for c in (verdict or {}).get("causes") or ())
    return tuple((sentence_case(name_in_words(name)), f"{sentence_case(meaning_in_words(name))}.") for name in names)


def why_next(verdict: Mapping[str, Any]) -> str:
    """Why the next test is the one to make."""
    separates = [str(name) for name in verdict["next_test"].get("separates") or ()]
    if not separates:
        return "it is the most informative test"
    if verdict["verdict"] == "unknown" and not _layers(verdict, "law"):
        return f"to see whether friction follows {joined([in_words(s) for s in separates])} when nothing else changes"
    for law in _layers(verdict, "law"):
        if set(separates) <= {law["formula"], *law["tied_with"]}:
            columns = joined([in_words(name) for name in str(law["name"]).split(" and ")])
            return f"it distinguishes laws of {columns} that fit equally well"
    names = [in_words(s) if without_model(verdict) else name_in_words(s) for s in separates]
    if without_model(verdict) and len(names) > 1:
        return f"it tells the effect of {names[0]} from that of {joined(names[1:])}"
    if verdict["verdict"] == "no_misfit":
        return f"this campaign could not test {joined(names)}"
    if len(names) > 1:
        return f"it distinguishes {names[0]} from {joined(names[1:])}"
    return f"it tests {joined(names)}"


def to_know(study: Study, verdict: Mapping[str, Any] | None) -> Iterator[str]:
    """What changes how far the sentence can be trusted; nothing where nothing does."""
    aside = dict(_reasons(study))
    if aside:
        reasons = sorted(aside.items(), key=lambda item: -item[1])[:MOST_SAMPLES]
        yield f"Tests set aside: {'; '.join(f'{count} × {reason}' for reason, count in reasons)}."
    yield from _flat(study)
    yield from bent_laws(study)
    yield from _limits(verdict)
    moved = sum(1 for t in study.ingested.by_hand if t in study.ingested.pulls)
    if moved:
        yield f"The peak or the window of {counted(moved, 'pull')} was moved by hand."
    yield from (note for note in study.notes if note.startswith("no diagnosis"))


def bent_laws(study: Study) -> Iterator[str]:
    """The samples whose friction is no straight line in the load, with the chi-squared ratio of each."""
    bent = [fit for fit in study.fits if any(note.startswith(BENT) for note in fit.notes)]
    if bent:
        named = joined([f"{fit.sample} {fit.regime} (χ²/ν = {significant(fit.chi2_red, 2)})" for fit in bent])
        yield (
            f"T against N is not a straight line for {named}: μ and {_intercept(study)} there depend on the range of "
            "loads."
        )


def _intercept(study: Study) -> str:
    return "τ₀" if study.ingested.campaign.has_area else "T₀"


def _flat(study: Study) -> Iterator[str]:
    """That another sample than F calibrates the model."""
    campaign = study.ingested.campaign
    flat = campaign.flat_sample
    if study.comparison is not None and flat != "F":
        why = "as chosen" if campaign.chosen_flat else "the only flat sample; there is no sample F"
        yield f"The model is calibrated on sample {flat} ({why})."


def _limits(verdict: Mapping[str, Any] | None) -> Iterator[str]:
    if verdict is None:
        return
    if ties := [names for names in verdict.get("equivalent") or () if len(names) > 1]:
        tied = "; ".join(" or ".join(map(name_in_words, names)) for names in ties)
        yield f"The data fit each of these equally well: {tied}."
    if untested := [str(e["mechanism"]) for e in verdict.get("not_testable") or ()]:
        yield f"This design cannot test {joined([name_in_words(n) for n in dict.fromkeys(untested)])}."


def _reasons(study: Study) -> dict[str, int]:
    """How many tests were set aside for each reason."""
    from tribo.report.tables import all_set_aside

    found: dict[str, int] = {}
    for fault in all_set_aside(study).values():
        reason = fault.problems[0].what if fault.problems else fault.reason
        found[reason] = found.get(reason, 0) + 1
    return found


def _layers(verdict: Mapping[str, Any], kind: str) -> list[Mapping[str, Any]]:
    return [layer for layer in verdict.get("layers") or () if layer["kind"] == kind]


def size_in_words(effect: Mapping[str, Any]) -> str:
    """ "-27 % (90 % interval -31 to -23 %)" of a layer or a misfit."""
    value, low, high = effect["effect_percent"], effect.get("low"), effect.get("high")
    interval = f" (90 % interval {signed(low)} to {signed(high)} %)" if low is not None and high is not None else ""
    return f"{signed(value)} %{interval}"


def signed(value: float | None) -> str:
    """A percentage in whole numbers with its sign."""
    return "–" if value is None else f"{value:+.0f}".replace("-", "−")


def _where(study: Study, layer: Mapping[str, Any]) -> str:
    """ "static and sliding friction of all samples"."""
    regimes = " and ".join(layer["regimes"])
    samples, measured = list(layer["samples"]), study_lookup.sample_numbers(study)
    whose = "all samples" if set(samples) >= set(measured) and len(measured) > 1 else joined(samples)
    return f"{regimes} friction of {whose}" if whose else f"{regimes} friction"


def _caused(study: Study, verdict: Mapping[str, Any], layers: Sequence[Mapping[str, Any]]) -> str:
    """The cause that acts most, with what is tied with it; then the others by name and size."""
    first, *others = layers
    most = f", most in {first['at']}" if first.get("at") else ""
    said = f"{_named(verdict, first)} {_where(study, first)} by up to {size_in_words(first)}{most}"
    also = [f"{_names(verdict, layer)} ({size_in_words(layer)})" for layer in others]
    also += [f"a change with {in_words(law['name'])} ({size_in_words(law)})" for law in _layers(verdict, "law")]
    said += f"; in addition, {joined(also)}" if also else ""
    left = "; part of the difference from the model remains unexplained" if verdict["verdict"] == "partly" else ""
    return f"{said}{left}."


def _alternatives(verdict: Mapping[str, Any], layer: Mapping[str, Any]) -> list[str]:
    rivals = [str(c["mechanism"]) for c in verdict["causes"]] if verdict["verdict"] == "undetermined" else []
    return list(dict.fromkeys([layer["name"], *layer["tied_with"], *rivals]))


def _names(verdict: Mapping[str, Any], layer: Mapping[str, Any]) -> str:
    return " or ".join(name_in_words(name) for name in _alternatives(verdict, layer))


def _named(verdict: Mapping[str, Any], layer: Mapping[str, Any]) -> str:
    names = _alternatives(verdict, layer)
    if len(names) == 1:
        choice = f": {layer['choice']}" if layer.get("choice") else ""
        return f"{sentence_case(meaning_in_words(names[0]))} ({name_in_words(names[0])}{choice}): this changes"
    return f"{sentence_case(_names(verdict, layer))} (this campaign cannot tell which) changes"


def _direct(verdict: Mapping[str, Any]) -> str:
    """A cause without a layer, such as one that the traces show besides the forces, with the size of its parameter."""
    cause = verdict["causes"][0]
    sizes = [
        f"{name.replace('_', ' ')} = {significant(_number(e['value']))} {e['unit']}".rstrip()
        + f" (90 % interval {significant(_number(e['low']))} to {significant(_number(e['high']))})"
        for name, e in cause["parameters"].items()
    ]
    ties: list[str] = next((names for names in verdict.get("equivalent") or () if cause["mechanism"] in names), [])
    others = [name_in_words(name) for name in ties if name != cause["mechanism"]]
    or_else = f"; {joined(others)} would explain the data equally well" if others else ""
    size = f": {joined(sizes)}" if sizes else ""
    name = str(cause["mechanism"])
    return f"{sentence_case(meaning_in_words(name))} ({name_in_words(name)}){size}{or_else}."


def _number(value: float | None) -> float:
    return float("nan") if value is None else float(value)


def _unknown(verdict: Mapping[str, Any]) -> str:
    misfits = verdict.get("misfits") or ()
    if not misfits:
        return (
            "Friction differs from the model beyond chance, and neither a mechanism nor a recorded column explains it."
        )
    largest = misfits[0]
    if largest["covariate"] == "sample":
        apart = list(dict.fromkeys(m["sample"] for m in misfits if m["covariate"] == "sample"))
        return (
            f"The model predicts the wrong friction for {joined(apart)}: measured "
            f"{OBSERVABLES[largest['observable']]} of {largest['sample']} differs most, by {size_in_words(largest)}; "
            "no mechanism of the library explains it."
        )
    of = f" of {largest['sample']}" if largest["sample"] else " of all samples"
    return (
        f"{sentence_case(OBSERVABLES.get(largest['observable'], 'friction'))}{of} changes with "
        f"{in_words(largest['covariate'])} by {size_in_words(largest)} relative to the model, and no mechanism of the "
        "library explains it."
    )


def _no_misfit(study: Study, verdict: Mapping[str, Any]) -> str:
    flat = study_lookup.flat_sample(study)
    corrections = _layers(verdict, "pattern_correction")
    said = f"The model calibrated on {flat} describes static and sliding friction of all samples within its own error"
    if not corrections:
        return f"{said}."
    most = max(corrections, key=lambda layer: abs(layer["effect_percent"]))
    return (
        f"{said}: the largest mean difference, {most['regimes'][0]} friction of {most['name']}, is "
        f"{size_in_words(most)}."
    )


def _without_diagnosis(study: Study) -> str:
    """The measured friction, highest and lowest, where it was not compared with a model."""
    from tribo.wording.friction_words import ratio_of_samples

    if study.comparison is not None:
        off = [a for a in findings.agreements(study) if not a.calibrated]
        if off:
            worst = max((load for a in off for load in a.loads), key=lambda load: abs(load.deviation))
            a = next(a for a in off if worst in a.loads)
            value, low, high = (100 * (x - 1) for x in (worst.ratio, worst.low, worst.high))
            return (
                f"Measured friction differs most from the model for {a.regime} friction of {a.sample} at "
                f"{significant(worst.normal_load_N)} N, by {signed(value)} % (95 % interval {signed(low)} to "
                f"{signed(high)} %); no diagnosis was made."
            )
    return ratio_of_samples(study)


def card_text(card: Card) -> str:
    """The sentence, what it means, the tests, what else to know and the next test; the laws have their own table."""
    lines = [card.sentence, *(f"{name}: {meaning}" for name, meaning in card.meanings), card.counts, *card.to_know]
    if card.next_test is not None:
        lines.append(f"Next test: {card.next_test.line}")
    return "\n".join(lines)
