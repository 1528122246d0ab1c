"""A finished verdict in sentences: written once, last, and read by nothing.

:func:`worded` writes the finding, what it rests on, and every part. Cards, pages and terminals take their words from
there; nothing else says what a diagnosis found.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

from tribo.diagnostics.conclusion import patterns_apart
from tribo.diagnostics.model import WITHIN
from tribo.diagnostics.score_statistics import RecordedInPart
from tribo.diagnostics.verdict import (
    AgainstModel,
    Cause,
    Estimate,
    Excluded,
    Gain,
    Layer,
    LayerKind,
    Misfit,
    TooLittle,
    Verdict,
)
from tribo.diagnostics.without_model import ColumnsTested
from tribo.lawsearch.grammar import T
from tribo.lawsearch.known_laws import KnownLaw
from tribo.mechanisms.record import TraceEvidence
from tribo.user_text import plain
from tribo.vocabulary import OBSERVABLES, described, in_words, short_label
from tribo.wording.law_sentences import across_sentence, held_sentence, tied_laws
from tribo.wording.numerals import (
    counted,
    joined,
    p_text,
    sentence_case,
    signed,
    significant,
    with_uncertainty,
)
from tribo.wording.part_sentences import (
    cause_sentence,
    change_over_range,
    laws_in_short,
    layer_sentence,
    meaning_in_words,
    misfit_sentence,
    name_in_words,
    next_test_sentence,
    place,
    reason,
    why_not,
)
from tribo.wording.table_sentences import published_evidence, published_sentence, table_misfit_sentence

MOST_LAWS, IN_FULL = 4, 2  # laws of samples that a finding holds at all, and each in a sentence of its own
MOST_TESTED = 12
MOST_COPIED = 3  # groups of tests with equal forces that are listed
FACTOR = 1.1  # from which on a scatter is said as a factor instead of in percent
HEADINGS = {
    "fails": "Where the model fails", "misfits": "Significant misfits", "none": "No statistically significant misfit.",
    "cause": "Cause", "causes": "Possible causes, in order of weight",
    "not_testable": "Mechanisms that this design cannot test",
}  # fmt: skip
NOTHING_TESTED = "Too little was measured to test for a misfit or a dependence."
HEADINGS_WITHOUT_MODEL = {
    "fails": "What friction varies with", "misfits": "Significant dependences",
    "none": "No statistically significant dependence beyond the law of each sample.", "cause": "Result",
    "causes": "What friction varies with, with its size", "not_testable": "What this design cannot test",
}  # fmt: skip


def worded(v: Verdict) -> Verdict:
    """The same verdict with its finding, its evidence and every text in words.

    Parameters
    ----------
    v : Verdict
        As a diagnosis hands it on, in numbers and enumerations.

    Returns
    -------
    Verdict
        With ``sentence``, ``evidence`` and ``text``, and the texts of its parts.
    """
    of_a_table = isinstance(v.shows, tuple)
    excluded, not_testable = (
        tuple(replace(e, reason=reason(e, of_a_table)) for e in part) for part in (v.excluded, v.not_testable)
    )
    misfit = table_misfit_sentence if of_a_table else misfit_sentence
    v = replace(
        v,
        misfits=tuple(replace(m, text=misfit(m)) for m in v.misfits),
        causes=tuple(replace(c, text=cause_sentence(c)) for c in v.causes),
        excluded=excluded,
        not_testable=not_testable,
        layers=tuple(replace(layer, text=layer_sentence(layer), at=place(layer)) for layer in v.layers),
        next_test=replace(v.next_test, text=next_test_sentence(v.next_test)) if v.next_test is not None else None,
    )
    if of_a_table:
        v = replace(v, sentence=published_sentence(v.shows[0]), evidence=published_evidence(*v.shows))
        return replace(v, text=f"{v.sentence} {v.evidence}")
    if isinstance(v.shows, ColumnsTested):
        return _without_model(v)
    if isinstance(v.shows, TooLittle):
        v = replace(
            v, sentence=f"Cannot tell whether friction differs from the model: {lacking(v.shows)}.",
            evidence=scatter_in_words(v.shows),
        )  # fmt: skip
        return replace(v, text=f"{v.sentence} {v.evidence}".strip())
    v = replace(v, shows=v.shows or AgainstModel())
    if v.shows.known:
        v = replace(v, model={**v.model, "known_laws": _known_laws(v.shows.known)})
    v = replace(v, sentence=finding(v), evidence=" ".join(filter(None, _evidence(v))))
    return replace(v, text=f"{v.sentence} {v.evidence}")


def _known_laws(known: Sequence[KnownLaw]) -> list[dict[str, str]]:
    return [
        {"law": k.name, "found_in": k.found_in, "formula": k.law.formula(), "answer": str(k.answer),
         "text": held_sentence(k)}
        for k in known
    ]  # fmt: skip


def of_kind(v: Verdict, kind: LayerKind) -> list[Layer]:
    """The layers of one kind."""
    return [layer for layer in v.layers if layer.kind == kind]


def without_model(v: Verdict) -> bool:
    """Whether a verdict was made without the spring-block model."""
    return "baseline" in v.model


# ---------------------------------------------------------------------------------------------- the finding


def finding(v: Verdict) -> str:
    """What happens to friction, how much, with its interval, where, and what it is called."""
    if v.verdict == "no_misfit":
        return _no_misfit(v)
    layers = sorted(of_kind(v, "cause"), key=lambda layer: -abs(layer.effect_percent))
    if layers and v.verdict != "unknown":
        return _caused(v, layers)
    if laws := of_kind(v, "law"):
        also = joined([_followed(law) for law in laws[1:]])
        said = "; in addition, ".join(filter(None, [laws[0].text.rstrip("."), also]))
        return f"{said}; {_by_no_mechanism(v)}." if v.verdict == "unknown" else f"{said}."
    if v.causes and v.verdict != "unknown":
        return _seen_in_traces(v)
    return _unknown(v)


def _no_misfit(v: Verdict) -> str:
    flat = v.shows.flat or "the flat sample"
    said = f"The model calibrated on {flat} describes static and sliding friction of all samples within its own error"
    corrections = of_kind(v, "pattern_correction")
    if not corrections:
        return " ".join([f"{said}.", *(layer.text for layer in of_kind(v, "nuisance"))])
    most = max(corrections, key=lambda layer: abs(layer.effect_percent))
    said = f"{said}: the largest mean difference, {most.regimes[0]} friction of {most.name}, is {size_in_words(most)}."
    return " ".join([said, *(layer.text for layer in of_kind(v, "nuisance"))])


def _caused(v: Verdict, layers: Sequence[Layer]) -> str:
    """The cause that acts most, with what is tied with it; then the others by name and size."""
    first, *others = layers
    names = _alternatives(v, first)
    if len(names) == 1:
        called = f"{name_in_words(names[0])}{_concerned(first, ': {}')}"
        subject = f"{sentence_case(meaning_in_words(names[0]))} ({called}): this changes"
    else:
        subject = f"{sentence_case(_either(names))} (this campaign cannot tell which) changes"
    also = [
        f"{_either(_alternatives(v, layer))}{_concerned(layer, ' ({})')} by {size_in_words(layer)}" for layer in others
    ]
    also += [f"{name_in_words(c.mechanism)} ({_parameters(c)})" for c in v.causes if isinstance(c.shows, TraceEvidence)]
    also += [_followed(law) for law in of_kind(v, "law")]
    added = f"; in addition, {joined(also)}" if also else ""
    rest = v.verdict == "partly" and not v.shows.within_chance
    left = "; part of the difference from the model remains unexplained" if rest else ""
    up_to, most = ("", "") if first.over else ("up to ", f", most in {first.at}" if first.at else "")
    return f"{subject} {_where(v, first)} by {up_to}{size_in_words(first)}{most}{added}{left}."


def _concerned(layer: Layer, said: str) -> str:
    """The sample, specimen or value that a cause concerns, as it is ``said``; a column is in its name already."""
    return said.format(layer.choice) if layer.choice and not layer.name.endswith(f":{layer.choice}") else ""


def _where(v: Verdict, layer: Layer) -> str:
    """ "static and sliding friction of all samples"."""
    everywhere = len(v.shows.samples) > 1 and set(layer.samples) >= set(v.shows.samples)
    whose = "all samples" if everywhere else joined(list(layer.samples))
    return f"{' and '.join(layer.regimes)} friction" + (f" of {whose}" if whose else "")


def _alternatives(v: Verdict, layer: Layer) -> list[str]:
    rivals = [c.mechanism for c in v.causes] if v.verdict == "undetermined" else []
    return list(dict.fromkeys([layer.name, *layer.tied_with, *rivals]))


def _either(names: Sequence[str]) -> str:
    return " or ".join(map(name_in_words, names))


def _followed(law: Layer) -> str:
    """ "a change of the adhesion term with the humidity by +30 % (90 % interval +20 to +40 %)"."""
    found = getattr(law.shows, "law", None)
    term = f" of the {found.acts_on}" if found is not None and found.acts_on != T else ""
    return f"a change{term} with {_columns(law)} by {size_in_words(law)}"


def _columns(law: Layer) -> str:
    found = getattr(law.shows, "law", None)
    return joined([in_words(name) for name in (found.columns if found is not None else (law.name,))])


def _seen_in_traces(v: Verdict) -> str:
    """A cause without a layer, one that the traces show besides the forces, with the size of its parameter."""
    cause = v.causes[0]
    ties = next((names for names in v.equivalent if cause.mechanism in names), ())
    others = [name_in_words(name) for name in ties if name != cause.mechanism]
    or_else = f"; {joined(others)} would explain the data equally well" if others else ""
    size = f": {_parameters(cause)}" if cause.parameters else ""
    meaning = sentence_case(meaning_in_words(cause.mechanism, cause.shows))
    return f"{meaning} ({name_in_words(cause.mechanism)}){size}{or_else}."


def _parameters(cause: Cause) -> str:
    """ "F 0 = 0.00600 N (90 % interval 0.00500 to 0.00700)"."""
    sizes = [
        f"{name.replace('_', ' ')} = {significant(e.value)} {e.unit}".rstrip()
        + f" (90 % interval {significant(e.low)} to {significant(e.high)})"
        for name, e in cause.parameters.items()
    ]
    return joined(sizes)


def _unknown(v: Verdict) -> str:
    if not v.misfits:
        return (
            "Friction differs from the model beyond chance, and neither a mechanism nor a recorded column explains it."
        )
    largest = v.misfits[0]
    if largest.covariate == "sample":
        apart = list(dict.fromkeys(m.sample for m in v.misfits if m.covariate == "sample"))
        return (
            f"The model predicts the wrong friction for {joined(apart)}: measured {OBSERVABLES[largest.observable]} of "
            f"{largest.sample} differs most, by {size_in_words(largest)}; {_by_no_mechanism(v)}."
        )
    what = sentence_case(OBSERVABLES.get(largest.observable, "friction"))
    if largest.covariate.startswith("specimen "):
        return (
            f"{what} of {largest.covariate} of {largest.sample} differs from the model, and from the other specimens, "
            f"by {size_in_words(largest)}; {_by_no_mechanism(v)}."
        )
    return (
        f"{what} of {largest.sample or 'all samples'} "
        f"changes with {in_words(largest.covariate)} by {size_in_words(largest)} relative to the model, and "
        f"{_by_no_mechanism(v)}."
    )


def _by_no_mechanism(v: Verdict) -> str:
    """That nothing explains it, and whether the design could test every mechanism; or whose formula explains less."""
    if lost := [name_in_words(e.mechanism) for e in v.excluded if e.why == "a law explains more"]:
        return f"{joined(lost)} can be its cause, with another formula than that of the library"
    tested = "that this design can test" if v.not_testable else "of the library"
    return f"no mechanism {tested} explains it"


def size_in_words(effect: Layer | Misfit) -> str:
    """ "−27 % (90 % interval −31 to −23 %)" of a layer or a misfit; of a cause that follows a recorded column, from its
    lowest to its highest recorded values: "+25 % (90 % interval +22 to +29 %) as the pull speed rises from 0.05 to 0.8
    mm/s"."""
    if isinstance(effect, Layer) and effect.over:
        return change_over_range(effect.over)
    value, low, high = (signed(x) for x in (effect.effect_percent, effect.low, effect.high))
    known = math.isfinite(effect.low) and math.isfinite(effect.high)
    return f"{value} %" + (f" (90 % interval {low} to {high} %)" if known else "")


# ------------------------------------------------------------------------------------- what the finding rests on


def _evidence(v: Verdict) -> Iterator[str]:
    """What a verdict on the spring-block model rests on, in the order of the search."""
    shows: AgainstModel = v.shows
    laws = of_kind(v, "law")
    stated = laws[0] if laws and (v.verdict == "unknown" or not of_kind(v, "cause")) else None  # in the finding
    if v.verdict == "no_misfit":
        yield "No misfit is beyond chance."
        weak = sorted(v.smallest_effects.items(), key=lambda item: item[1])[:6]
        if weak:
            sizes = ", ".join(f"{name_in_words(name)} {size:.0f} %" for name, size in weak)
            yield (
                f"This campaign would have shown these effects with a probability of one half (peak to peak): {sizes}."
            )
    elif v.verdict == "named":
        these = "this mechanism" if len(v.causes) == 1 else "these mechanisms"
        yield f"With {these} included, the remaining differences are within chance{_and_error(v)}."
    elif v.verdict == "partly" and not laws:
        yield _remains(v.misfits)
    elif v.verdict == "unknown" and (apart := patterns_apart(v.misfits)):
        yield (
            f"{joined(apart)} differ from the model independently of each other, and no recorded column explains the "
            "differences."
        )
    if v.verdict != "no_misfit":
        yield from (layer.text for layer in of_kind(v, "nuisance"))
    if v.equivalent:
        yield 'This design cannot distinguish the mechanisms joined by "or".'
    if shows.wrong_in_form and v.verdict in ("unknown", "partly"):
        names = ", ".join(sorted(map(name_in_words, shows.wrong_in_form)))
        yield (
            f"Tried and left out: {names}. Beside the formula of the library, a dependence on the same quantity "
            "remains beyond chance; the true formula may be another one."
        )
    if shows.excess is not None:
        factor, p = shows.excess
        yield (
            f"The patterned samples differ from the model by about {factor:.2g} times its stated error for patterns; a "
            f"true factor of {WITHIN:g} or less is excluded with p {p_text(p)}."
        )
    yield from in_part_sentences(shows.in_part)
    if shows.known:
        held = sum(law.answer == "held" for law in shows.known)
        yield f"{held} of {len(shows.known)} known laws held."
    for law in laws:
        if law is not stated:
            yield law.text
        yield tied_laws(getattr(law.shows, "ties", ()), by_values=bool(law.levels))
    if shows.within_chance is not None and v.verdict not in ("no_misfit", "named"):
        if shows.within_chance:
            yield f"With this included, the remaining differences are within chance{_and_error(v)}."
        else:
            yield _remains(of_kind(v, "remainder"))
    if shows.across:
        yield across_sentence(shows.across)
    yield from _simulation(v.model)


def _remains(left: Sequence[Layer | Misfit]) -> str:
    """That a misfit remains, and what the first of those ``left`` says."""
    return f"A misfit remains beyond chance: {left[0].text if left else 'no single column explains it.'}"


def _and_error(v: Verdict) -> str:
    """What differences are also compared with, where samples were predicted."""
    patterned = any(layer.kind == "pattern_correction" for layer in v.layers)
    return " and the error that the model has for the patterns" if patterned else ""


def _simulation(model: Any) -> Iterator[str]:
    """Where the predictions come from, and what the named mechanisms give in the simulator itself."""
    if "shares_from" in model:
        yield f"The predictions for the patterned samples are based on {model['shares_from']}."
    if found := model.get("not_simulated"):
        yield f"The model with {_all(found['mechanisms'])} was not simulated: {found['reason']}."
    if found := model.get("simulated"):
        yield (
            f"With {_all(found['mechanisms'])} in the simulator itself ({found['pairs_of_runs']} pairs of runs), the "
            f"effect is {with_uncertainty(found['effect_over_law'], found['effect_over_law_u'])} times that of its "
            f"formula. The tests differ from the calibrated model by {found['rms_percent_before']:.1f} %, from the "
            f"model with the simulated effect by {found['rms_percent_simulated']:.1f} % and with the formula by "
            f"{found['rms_percent_law']:.1f} % (root mean squares)."
        )


def _all(names: Sequence[str]) -> str:
    return " and ".join(map(name_in_words, names))


# ------------------------------------------------------------------------------------------ too little measured


def lacking(lack: TooLittle) -> str:
    """ "too little was measured (5 usable tests, at least 12 are needed)"."""
    counts = (
        (lack.tests, lack.fewest_tests, "usable test"),
        (lack.loads, lack.fewest_loads, "load"),
        (lack.samples, lack.fewest_samples, "sample"),
    )
    short = [f"{counted(n, noun)}, at least {fewest} are needed" for n, fewest, noun in counts if n < fewest]
    return f"too little was measured ({'; '.join(short)})"


def scatter_in_words(lack: TooLittle) -> str:
    """How far the repeats that scatter most are apart, in one sentence; empty where nothing was repeated."""
    if lack.repeated is None:
        return ""
    regime, sample, load_N = lack.repeated
    if lack.factor >= FACTOR:
        apart = f"scatters by a factor of {lack.factor:.2f} (the largest over the smallest)"
    else:
        apart = f"scatters by {significant(100 * (lack.factor - 1), 2)} %"
    return (
        f"{sentence_case(regime)} friction of {sample} at {significant(load_N)} N, measured {lack.repeats} times, "
        f"{apart}."
    )


# ------------------------------------------------------------------------------------------ without the model


def in_part_sentences(in_part: Sequence[RecordedInPart]) -> Iterator[str]:
    """For how many tests columns are recorded, those of one share together; and whose gaps follow the friction."""
    shares: dict[str, list[str]] = {}
    for gaps in in_part:
        shares.setdefault(f"{100.0 * gaps.share:.0f}", []).append(in_words(gaps.column))
    for percent, names in shares.items():
        recorded = f"is recorded for {percent} %" if len(names) == 1 else f"are each recorded for {percent} %"
        yield f"{sentence_case(joined(names))} {recorded} of the tests."
    for gaps in in_part:
        if gaps.doubted:
            yield (
                f"Tests with and without a value of {in_words(gaps.column)} differ in friction (p {p_text(gaps.p)}): "
                "what is missing may depend on the friction, and so may all that is said of this column."
            )


def _without_model(v: Verdict) -> Verdict:
    """What friction varies with beside the load; without anything, the first law and that nothing else was seen."""
    shows: ColumnsTested = v.shows
    laws = [layer.text for layer in of_kind(v, "baseline")]
    more = [f"The laws of {len(laws) - MOST_LAWS} more are listed below."] if len(laws) > MOST_LAWS else []
    evidence = []
    if shows.lack is not None:
        evidence = list(filter(None, [scatter_in_words(shows.lack)]))
    elif not v.causes:
        tested = sorted(map(in_words, shows.columns))
        if len(tested) > MOST_TESTED:
            tested = [*tested[:MOST_TESTED], f"{len(tested) - MOST_TESTED} more columns"]
        evidence = [f"Tested: {joined(tested)}." if tested else "No further column varies."]
    evidence += [same_columns_sentence(names) for names in shows.same] + copied_sentence(shows.copied)
    if v.causes:
        names = "; ".join(dict.fromkeys(name_in_words(c.mechanism) for c in v.causes))
        found = [c.text for c in v.causes]
        sentence, said = found, [f"Found beside the law of each sample: {names}.", *found]
        if shows.lack is not None:
            evidence.append(f"What else friction varies with cannot be told: {lacking(shows.lack)}.")
        if len(laws) <= MOST_LAWS:
            own = of_kind(v, "baseline")
            means = sum("T/N" in layer.parameters for layer in own)
            sentence = [*found, *(laws if len(laws) <= IN_FULL and means < len(laws) else laws_in_short(own))]
    elif shows.lack is not None:
        said = [f"Cannot tell what friction varies with beside the law of each sample: {lacking(shows.lack)}."]
        sentence = [*said, *laws[:1]]
    else:
        said = ["Beside the law of each sample, nothing exceeds chance."]
        sentence = [*laws[:1], *said]
    evidence += [e.reason for e in v.not_testable if e.why in ("only with the load", "vary together")]
    text = [*laws[:MOST_LAWS], *more, *said, *evidence]
    return replace(v, sentence=" ".join(sentence), evidence=" ".join(evidence), text=" ".join(text))


def same_columns_sentence(names: Sequence[str]) -> str:
    """ "The pull speed and speed_rps are the same column: each follows from the other. It was tested once."."""
    return (
        f"{sentence_case(joined(list(map(in_words, names))))} are the same column: each follows from the other in "
        "every test. It was tested once."
    )


def copied_sentence(copied: Sequence[Sequence[str]]) -> list[str]:
    """The tests whose forces are exactly those of another one, in one sentence; none where there are none."""
    if not copied:
        return []
    shown = "; ".join(joined(list(ids)) for ids in copied[:MOST_COPIED])
    more = f" and {len(copied) - MOST_COPIED} more groups" if len(copied) > MOST_COPIED else ""
    return [
        f"Forces are equal to the last digit in {shown}{more}: these are copies of one reading, or of rounded ones. "
        "The scatter was taken to be no smaller than the uncertainty of a reading."
    ]


# ------------------------------------------------------------------------------------ its parts, for a report


def meanings(v: Verdict | None) -> tuple[tuple[str, str], ...]:
    """The plain name and the meaning of every mechanism that the verdict names, each once."""
    shown = {c.mechanism: c.shows for c in v.causes} if v is not None else {}
    return tuple(
        (sentence_case(name_in_words(name)), f"{sentence_case(meaning_in_words(name, shows))}.")
        for name, shows in shown.items()
    )


def why_next(v: Verdict) -> str:
    """Why the next test is the one to make."""
    separates = list(v.next_test.separates) if v.next_test is not None else []
    if v.verdict == "cannot_tell":
        return "with fewer, nothing can be told from chance"
    if not separates:
        return "with fewer, what else friction varies with cannot be told"
    if v.next_test is not None and "share_of_width" in v.next_test.design and len(separates) > 1:
        cause, *others = map(name_in_words, separates)
        untested = f"this campaign could not test {joined(others)}"
        return f"{untested}; pulls under the same conditions would hardly narrow the size of {cause}"
    if v.next_test is not None and v.next_test.kind == "vary what was fixed":
        return f"this campaign could not test {joined(list(map(name_in_words, separates)))}"
    if v.next_test is not None and v.next_test.kind == "confirm":
        design = v.next_test.design
        words = described(str(design["covariate"]))
        low, *_, high = (value * words.factor for value in design["values"])
        change = f"{signed(design['expected_percent'])} %"
        over = f"{design['regime']} friction from {plain(low)} to {plain(high)} {words.unit}"
        return f"{name_in_words(separates[0])} predicts {change} in {over}"
    if v.next_test is not None and len(separates) == 1 and v.next_test.kind in ("measure", "remove"):
        return f"it settles whether {name_in_words(separates[0])} is the cause"
    if v.next_test is not None and v.next_test.kind == "pull more":
        left = 100.0 * v.next_test.design["share_of_width"]
        return f"the interval of the size of {name_in_words(separates[0])} narrows to about {left:.0f} % of its width"
    alone = v.next_test is not None and v.next_test.kind in ("vary one column", "factorial")
    if alone and separates[0].startswith("specimen "):
        return f"to see whether {separates[0]} differs from other specimens of its sample"
    if alone or (v.verdict == "unknown" and not of_kind(v, "law")):
        return f"to see whether friction follows {joined(list(map(in_words, separates)))} when nothing else changes"
    for law in of_kind(v, "law"):
        if set(separates) <= {law.formula, *law.tied_with}:
            return f"it distinguishes laws of {_columns(law)} that fit equally well"
    first, *others = [in_words(s) if without_model(v) else name_in_words(s) for s in separates]
    if others:
        tells = "it tells the effect of" if without_model(v) else "it distinguishes"
        return f"{tells} {first} from {'that of ' if without_model(v) else ''}{joined(others)}"
    return f"it tests {first}"


def verdict_in_words(v: Verdict) -> dict[str, Any]:
    """The parts of a worded verdict as text for the report; empty where the verdict has none.

    Samples that differ from the model are in the table of all samples, once.
    """
    listed = bool(of_kind(v, "pattern_correction"))
    headings = HEADINGS_WITHOUT_MODEL if without_model(v) else HEADINGS
    return {
        "headings": headings | ({"none": NOTHING_TESTED} if v.verdict == "cannot_tell" else {}),
        "own_laws": [layer.text for layer in of_kind(v, "baseline")],
        "evidence": v.evidence,
        "equivalent": [
            f"This campaign cannot distinguish between {joined(list(map(name_in_words, names)))}."
            for names in v.equivalent
            if len(names) > 1
        ],
        "causes": [_cause(cause) for cause in v.causes],
        "gain": _gain(v.gain),
        "next_test": v.next_test.text if v.next_test is not None else "",
        "misfits": [_misfit(misfit) for misfit in v.misfits if not (listed and misfit.covariate == "sample")],
        "no_misfit": not v.misfits,
        "excluded": [_excluded(e, e.reason) for e in v.excluded],
        "not_testable": [_excluded(e, why_not(e)) for e in v.not_testable],
        "corrections": [_correction(x) for x in of_kind(v, "pattern_correction")],
        "laws": [_law(x) for x in of_kind(v, "law")],
    }


def _excluded(e: Excluded, why: str) -> tuple[str, str]:
    return name_in_words(e.mechanism), why


def _law(layer: Layer) -> dict[str, str]:
    """A law: the formula, what it says with its size, the laws that the design cannot tell apart from it, its gain."""
    return {
        "formula": "; ".join([layer.formula, *_sizes(layer)]), "text": layer.text,
        "ties": "; ".join(layer.tied_with) or "none", "gain": _gain(layer.gain) or "not tested",
    }  # fmt: skip


def _correction(layer: Layer) -> tuple[str, str, str, str]:
    """Sample, regime, mean of measured over modelled T less one with its interval, and the adjusted p value."""
    value, low, high = map(signed, (layer.effect_percent, layer.low, layer.high))
    return layer.name, layer.regimes[0], f"{value} % ({low} to {high} %)", p_text(layer.p_adjusted)


def _cause(cause: Cause) -> dict[str, Any]:
    name = sentence_case(name_in_words(cause.mechanism))
    return {"mechanism": name, "weight": f"{cause.weight:.2f}", "sizes": _sizes(cause), "text": cause.text}


def _sizes(named: Cause | Layer) -> list[str]:
    """The parameters of a cause or a law with their intervals."""

    def size(name: str, e: Estimate) -> str:
        interval = f"({significant(e.low)} to {significant(e.high)})" if math.isfinite(e.low) else ""
        return f"{name.replace('_', ' ')} = {significant(e.value)} {interval} {e.unit}".rstrip()

    return [size(name, e) for name, e in named.parameters.items()]


def _misfit(m: Misfit) -> dict[str, str]:
    return {
        "observable": OBSERVABLES.get(m.observable, m.observable), "sample": m.sample or "all",
        "covariate": short_label(m.covariate).replace("_", " ") or "–", "p": p_text(m.p_adjusted), "text": m.text,
    }  # fmt: skip


def _gain(gain: Gain | None) -> str:
    """Improvement by the extended model on tests not used in the fit, in one sentence."""
    if gain is None:
        return ""
    clear = abs(gain.difference) > 2 * gain.se
    return (
        f"For tests left out of the fit ({gain.held_out.replace('_', ' ')}), the extended model predicts "
        f"{'better' if gain.difference > 0 else 'worse'} by a log score of {significant(abs(gain.difference))} ± "
        f"{significant(gain.se, 2)} per test{'' if clear else ', which may be due to chance'}; the RMSE changes from "
        f"{significant(gain.rmse_percent_before, 2)} % to {significant(gain.rmse_percent_after, 2)} %."
    )
