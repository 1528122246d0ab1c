"""Sentences of the parts of a verdict: misfits, causes, layers, what was left out and why, and the next test."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from tribo.diagnostics.column_search import ColumnEffect
from tribo.diagnostics.contrasts import Contrast
from tribo.diagnostics.direct_evidence import OFFSET, Evidence, RunningIn
from tribo.diagnostics.effect_sizes import Run
from tribo.diagnostics.verdict import UNTESTED, Cause, Estimate, Excluded, Layer, Misfit, NextTest
from tribo.diagnostics.without_model import SERIES
from tribo.lawsearch.grammar import WrittenLaw
from tribo.lawsearch.known_laws import KnownLaw
from tribo.lawsearch.model_choice import FoundLaw
from tribo.mechanisms import MECHANISMS, mechanism
from tribo.mechanisms.record import Mechanism, TraceEvidence
from tribo.user_text import plain
from tribo.vocabulary import OBSERVABLES, described, in_words
from tribo.wording.law_sentences import each_value, law_sentence, law_test, size_sentence, tied_laws
from tribo.wording.numerals import (
    counted,
    interval,
    joined,
    p_text,
    sentence_case,
    signed,
    true_minus,
    with_uncertainty,
)

BETWEEN = {
    "mean": "mean", "bend": "the ends above the middle", "ends": "from the low to the high end",
    "groups": "ratio of geometric means", "extremes": "between its extremes",
}  # fmt: skip
NUISANCES = {
    "days": "friction differs between days or sessions", "drift": "the series drifts",
    "specimen_drift": "the specimens drift, each at its own rate,",
}  # fmt: skip
COURSES = {
    "rising": "rising throughout", "falling": "falling throughout", "hump": "highest in the middle",
    "hollow": "lowest in the middle",
}  # fmt: skip
TAKEN_UP = {
    "absorbed": "the calibration on the flat sample absorbs its effect",
    "hidden": "the error of the model for the patterns, or a difference between specimens or days, could look the same",
}
MOST_LISTED, MOST_RECORDS = 6, 3
SYMBOLS = {"mu": "μ", "T0": "T₀"}  # of parameters of a law in a sentence
ALONE = {
    "normal_load_N": "Pull one specimen at nine loads over the range, first upwards, then downwards",
    "sample": "Pull one fresh specimen of every sample in turn, at one load and within one day",
    "date": "Pull the same specimens of one sample at one load again on several days",
    "clock_h": "Pull one sample at one load in the morning and in the afternoon of several days",
    "run_order": "Pull one sample at one load again and again through a series of the same length",
    "elapsed_s": "Pull one sample at one load again and again over the same time",
    "specimen_run": "Pull fresh specimens of one sample at one load, each as often as the most-used one",
}


def name_in_words(name: str) -> str:
    """The plain name of a mechanism that a verdict names; of one that follows any column, with that column.

    A law, and whatever else the library does not know, keeps its name, with spaces.
    """
    _, _, column = name.partition(":")
    if column:
        return f"a dependence on {in_words(column)}"
    if name in MECHANISMS:
        return MECHANISMS[name].in_words
    return name.replace("_", " ") if name.isidentifier() else name


def meaning_in_words(name: str, shows: object = None) -> str:
    """What a mechanism that a verdict names means, as a clause; ``shows`` is what showed it."""
    if isinstance(shows, tuple) and shows and isinstance(shows[0], RunningIn):
        return "within one record, friction changes with the distance"
    _, _, column = name.partition(":")
    if column:
        return f"friction changes with {in_words(column)}, and no mechanism of the library explains it"
    return mechanism(name).meaning


def with_choice(name: str, choice: str) -> str:
    """The plain name of a mechanism, with the specimen, pattern or value it concerns in brackets."""
    said = name.partition(":")[2]  # a column that the name holds already
    return name_in_words(name) + (f" ({choice})" if choice and choice != said else "")


def estimate_text(name: str, e: Estimate) -> str:
    """ "n = 0.27 (90 % interval 0.241 to 0.3)"."""
    return true_minus(f"{name} = {e.value:.3g} {e.unit}".rstrip() + f" (90 % interval {e.low:.3g} to {e.high:.3g})")


def signs_of(m: Mechanism) -> str:
    """The signs of a mechanism, and how to distinguish it from what has similar ones."""
    return f"Expected signs: {m.shows}. To distinguish it from {m.confused_with}: {m.separates}."


def not_varied(columns: Sequence[str]) -> str:
    """That a design holds these columns fixed, or does not record them."""
    needs = [in_words(name) for name in columns]
    verb, be = ("does", "is") if len(needs) == 1 else ("do", "are")
    return f"{' and '.join(needs)} {verb} not vary or {be} not recorded"


def misfit_sentence(m: Misfit) -> str:
    """What follows what, by how much and how surely."""
    shows = m.shows
    if isinstance(shows, tuple) and isinstance(shows[0], Contrast):
        contrast, between, course = shows
        of = f" of {m.sample}" if m.sample and contrast.kind != "specimen" else ""
        interval = f"90 % interval {signed(m.low)} to {signed(m.high)} %"
        size = f"{signed(m.effect_percent)} % ({interval}), {BETWEEN[between]}"
        what = f"{sentence_case(OBSERVABLES[m.observable])}{of} {_seen(contrast, m.effect_percent > 0, course)}"
        return f"{what}: {size} (adjusted p {p_text(m.p_adjusted)})."
    if isinstance(shows, Layer):
        return layer_sentence(shows)
    if isinstance(shows, Cause):
        return cause_sentence(shows)
    if isinstance(shows, FoundLaw):
        return law_sentence(shows)
    return without_model_sentence(shows) if shows else m.text


def _seen(contrast: Contrast, up: bool, course: Run) -> str:
    """What the observable does relative to the model."""
    goes, lies, words = "rises" if up else "falls", "is higher" if up else "is lower", in_words(contrast.covariate)
    if contrast.acting is not None:
        return f"varies as expected from {with_choice(contrast.acting.name, contrast.acting.choice)}"
    if contrast.kind == "sample" and contrast.covariate == "sample":
        return f"{lies} at all loads than the model predicts"
    if contrast.kind == "sample" and contrast.detail:
        return f"bends {'upwards' if up else 'downwards'} with {words} relative to the model"
    if contrast.kind == "specimen":
        by_load = f"{goes} with the normal load relative to the other specimens"
        said = by_load if contrast.detail else f"{lies} than that of the other specimens"
        return f"of {contrast.covariate} ({contrast.sample}) {said}"
    if contrast.kind in ("sample", "trend"):
        return f"{goes} with {words} relative to the model"
    if contrast.kind == "period":
        return f"varies periodically with {words}" + (f" ({contrast.detail} pulls)" if contrast.detail else "")
    if contrast.kind == "block":
        return f"{lies} for {words} {contrast.detail} than in the rest of the series"
    return f"differs between values of {words}" if contrast.kind == "level" else f"follows {words}, {COURSES[course]}"


def cause_sentence(c: Cause) -> str:
    """A cause with its size and what distinguishes it."""
    if isinstance(c.shows, Layer):
        return layer_sentence(c.shows)
    if isinstance(c.shows, tuple):
        return without_model_sentence(c.shows)
    name = sentence_case(with_choice(c.mechanism, c.choice))
    if c.mechanism.partition(":")[0] not in MECHANISMS:
        return c.text
    m, size = mechanism(c.mechanism), next((estimate_text(*item) for item in c.parameters.items()), "")
    if isinstance(c.shows, TraceEvidence):
        return f"{name}: {size}, {c.shows.source}."
    if c.changes is None:
        return f"{name}. {signs_of(m)}"
    low, high = c.changes
    said = f"{name}: {size}. It changes the calibrated model by {interval(low, high)}. {signs_of(m)}"
    return f"{said} {m.choosing.remedy(c.choice)}".rstrip() if c.choice else said


def layer_sentence(layer: Layer) -> str:
    """One part of what explains a campaign."""
    shows, value, low, high = layer.shows, layer.effect_percent, layer.low, layer.high
    if layer.kind == "pattern_correction":
        return (
            f"{sentence_case(layer.regimes[0])} friction of {layer.name} differs from the model by {signed(value)} % "
            f"(geometric mean over its tests; 90 % interval {interval(low, high)}; adjusted p "
            f"{p_text(layer.p_adjusted)})."
        )
    if layer.kind == "baseline":
        return _own_law(layer)
    if layer.kind == "nuisance":
        return f"{sentence_case(NUISANCES[layer.name])} by {value:.0f} % (root mean square; {low:.0f} to {high:.0f} %)."
    if isinstance(shows, FoundLaw):
        return law_sentence(shows)
    if isinstance(shows, KnownLaw):
        said = size_sentence(shows.law, {**shows.parameters, **layer.parameters}, (value, low, high))
        return f"The law of {shows.found_in or shows.name} held: {said}."
    if isinstance(shows, Misfit):
        return misfit_sentence(shows)
    tied = isinstance(shows, tuple) and any(isinstance(x, WrittenLaw) for x in shows)  # forms that a cause may have
    if isinstance(shows, tuple) and not tied:
        return _offset(layer) if layer.name == OFFSET else without_model_sentence(shows)
    if layer.kind != "cause" or layer.most is None:
        return layer.text
    if layer.levels and layer.kind == "cause":
        unit = described(layer.over["column"]).unit if layer.over else ""
        said = f"{sentence_case(name_in_words(layer.name))}: {each_value(layer.levels, unit)}."
        return f"{said} {tied_laws(shows)}" if tied else said
    if layer.over:
        said = f"{sentence_case(mechanism(layer.name).in_words)} changes T by {change_over_range(layer.over)}."
        return f"{said} {tied_laws(shows)}" if tied else said
    said = (
        f"{sentence_case(mechanism(layer.name).in_words)} changes T by {signed(value)} % "
        f"(90 % interval {interval(low, high)}) where it acts most: {place(layer)}."
    )
    return f"{said} {tied_laws(shows)}" if tied else said


def change_over_range(over: Mapping[str, Any]) -> str:
    """ "+25 % (90 % interval +22 to +29 %) as the pull speed rises from 0.05 to 0.8 mm/s"."""
    words = described(over["column"])
    start, end = (plain(words.factor * over[key]) for key in ("from", "to"))
    sizes = [signed(over[key]) for key in ("percent", "low", "high")]
    return (
        f"{sizes[0]} % (90 % interval {sizes[1]} to {sizes[2]} %) as {words.words} rises from {start} to "
        f"{end} {words.unit}".rstrip()
    )


def place(layer: Layer) -> str:
    """ "sliding friction of C at 1.37 N": where a cause acts most."""
    if layer.most is None:
        return layer.at
    regime, sample, load_N = layer.most
    return f"{regime} friction of {sample} at {plain(load_N)} N"


def _own_law(layer: Layer) -> str:
    """The law of one sample alone, and what a straight line leaves at zero load."""
    (regime,), (sample,) = layer.regimes, layer.samples
    if "T/N" in layer.parameters:
        mean = f"Mean {regime} T/N of {sample}: {_sized(layer.parameters['T/N'])}"
        return f"{mean}; measured at too few loads to choose the form of a law."
    sizes = joined([f"{SYMBOLS.get(n, n)} = {_sized(e)}" for n, e in layer.parameters.items()])
    said = f"{sentence_case(regime)} friction of {sample} follows {layer.formula} with {sizes}."
    if layer.shows is None:
        return said
    constant, share_percent, load_N = layer.shows
    if constant.low <= 0.0 <= constant.high:
        return f"{said} A straight line leaves no certain part of T that does not depend on the load."
    if constant.value < 0.0:
        return f"{said} A straight line falls to {_sized(constant)} at zero load: friction is weak at small loads."
    if "T0" in layer.parameters:
        return f"{said} At {plain(load_N)} N, T₀ is {share_percent:.0f} % of T."
    return (
        f"{said} A straight line leaves {_sized(constant)} at zero load: {share_percent:.0f} % of T at "
        f"{plain(load_N)} N does not depend on the load."
    )


def laws_in_short(layers: Sequence[Layer]) -> list[str]:
    """The laws of several samples, each with its telling parameter (the exponent, else the first), in a sentence a
    regime; and the means of those at too few loads for a law in another."""
    sentences = []
    for regime in dict.fromkeys(layer.regimes[0] for layer in layers):
        by_formula: dict[str, list[str]] = {}
        means = []
        for layer in (x for x in layers if x.regimes[0] == regime):
            sample = layer.samples[0]
            if "T/N" in layer.parameters:
                means.append(f"{_sized(layer.parameters['T/N'])} for {sample}")
                continue
            name = "b" if "b" in layer.parameters else next(iter(layer.parameters))
            size = _sized(layer.parameters[name]).replace(" (90 % interval", ",").removesuffix(")")
            by_formula.setdefault(layer.formula, []).append(f"{sample} ({SYMBOLS.get(name, name)} = {size})")
        told = [f"{formula} for {joined(samples)}" for formula, samples in by_formula.items()]
        if told:
            sentences.append(f"{sentence_case(regime)} friction follows {'; '.join(told)}; 90 % intervals in brackets.")
        if means:
            sentences.append(f"Mean {regime} T/N, at too few loads to choose a law: {joined(means)}.")
    return sentences


def _sized(e: Estimate) -> str:
    said = f"{e.value:.3g} {e.unit}".rstrip()
    return true_minus(f"{said} (90 % interval {e.low:.3g} to {e.high:.3g})" if math.isfinite(e.low) else said)


def without_model_sentence(shows: Sequence[Any]) -> str:
    """What friction varies with beside the law of each sample: columns, running-in along records."""
    return _running_in(shows) if isinstance(shows[0], RunningIn) else " ".join(map(_follows, shows))


def _follows(f: ColumnEffect) -> str:
    unit = f" {described(f.name).unit}".rstrip()
    first, last = f.where
    low, high = sorted((abs(f.low_percent), abs(f.high_percent)))
    size = f"{abs(f.change_percent):.1f} %"
    numbers = [x for x in (first, last) if x.replace(".", "").isdigit()]
    if f.kind == "trend" or (len(numbers) == 2 and float(first) < float(last)):
        way = "rises" if f.change_percent > 0 else "falls"
        change = f"{way} by {size} with {in_words(f.name)}, from {first} to {last}{unit}"
    else:
        way = "higher" if f.change_percent > 0 else "lower"
        change = f"is {size} {way} with {in_words(f.name)} {last}{unit} than with {first}{unit}"
    said = (
        f"{sentence_case(f.regime)} friction {change} (90 % interval {low:.1f} to {high:.1f} %, adjusted p "
        f"{p_text(f.p)})."
    )
    if f.alike:
        said += f" This design cannot tell {in_words(f.name)} from {' and '.join(map(in_words, f.alike))}."
    return said


def _running_in(records: Sequence[RunningIn]) -> str:
    ordered = sorted(records, key=lambda r: -abs(r.first_percent))
    shown = [f"{r.test_id} ({r.sample}) {signed(r.first_percent)} %" for r in ordered[:MOST_RECORDS]]
    more = f" and {len(records) - MOST_RECORDS} more by less" if len(records) > MOST_RECORDS else ""
    share = 100.0 * records[0].distance_m / records[0].whole_m
    return (
        f"Running-in or drift: over the first {share:.0f} % of the distance, sliding friction differs from that of the "
        f"second half in {counted(len(records), 'record')}: {', '.join(shown)}{more} (adjusted p at most "
        f"{max(max(r.p for r in records), 0.001):.2g})."
    )


def _offset(layer: Layer) -> str:
    (forward, backward), offset = layer.shows, layer.parameters["F0"]
    value, low, high = (true_minus(f"{x:.3g}") for x in (offset.value, offset.low, offset.high))
    return (
        f"The force recorded in {forward} forward and {backward} backward strokes is offset by {value} N "
        f"(90 % interval {low} to {high} N), {abs(layer.effect_percent):.0f} % "
        "of the sliding force: the directions differ by twice that. The offset was subtracted as the zero of each pair."
    )


def reason(e: Excluded, of_a_table: bool = False) -> str:
    """Why a mechanism is not among the causes; for verdict.json, where nothing stands above it."""
    if of_a_table and e.why in ("not varied", "not printed"):
        return f"cannot be tested with this table: {why_not(e)}"
    if e.why in UNTESTED and e.why not in ("only with the load", "vary together"):
        return f"cannot be tested with this design: {why_not(e)}"
    if e.why == "explains less":
        return f"explains the {'table' if of_a_table else 'campaign'} less well: log likelihood lower by {e.by:.1f}"
    return why_not(e)


def why_not(e: Excluded) -> str:
    """The same as a clause under a heading that says that it was left out, or that it cannot be tested."""
    if e.why == "only with the load":
        return (
            f"This design cannot tell the effect of {in_words(e.shows)} from that of the normal load: within each "
            f"sample, {in_words(e.shows)} varies only together with the load."
        )
    if e.why == "vary together":
        one, other, samples = e.shows
        return (
            f"This design cannot tell the effect of {in_words(one)} from that of {in_words(other)}: they "
            f"vary together for {_listed(samples)}."
        )
    if e.why == "recorded in part":
        column, known, tests = e.shows
        return f"{in_words(column)} is recorded for {known} of {tests} tests only"
    if isinstance(e.shows, str):
        return not_varied([e.shows])
    m = MECHANISMS[e.mechanism.partition(":")[0]]
    if isinstance(e.shows, Evidence) and m.evidence is not None:
        found = f"{with_uncertainty(e.shows.value, e.shows.standard_error)} {e.shows.unit}".rstrip()
        percent = 100.0 * (e.shows.change if m.evidence.quantity == "each pull" else e.shows.value)
        if e.why == "corrected":
            return m.evidence.corrected.format(found=found, percent=percent)
        if e.why == "not certain":
            return m.evidence.absent.format(value=e.shows.value, percent=percent)
    if e.why == "wrong sign" and isinstance(e.shows, float):
        most = f"at most {m.amplitude.name} = {e.shows:.2g} {m.amplitude.unit}".rstrip()
        return f"wrong sign: it can change friction in one direction only; {most} (95 %)"
    return {
        "absorbed": f"{TAKEN_UP['absorbed']}; to test it, {m.separates}",
        "hidden": f"{TAKEN_UP['hidden']}; to test it, {m.separates}",
        "not varied": not_varied(m.needs),
        "only in traces": m.untested,
        "not printed": m.in_table.missing,
        "contradicted": m.in_table.barred,
        "wrong sign": "wrong sign: it can change friction in one direction only, and the misfit has the opposite sign",
        "explains less": f"log likelihood lower by {e.by:.1f}",
        "nothing left beside a law": "beside the law that was found, what it adds is within chance",
        "a law explains more": (
            f"a law of the same column explains the campaign better: log likelihood higher by {e.by:.1f}"
        ),
    }.get(e.why, e.reason)


def next_test_sentence(t: NextTest) -> str:
    """What to do next, without the reason."""
    design, pulls = t.design, t.design.get("pulls")
    one_sample = design.get("sample", "one sample")
    if t.kind == "measure":
        measurement = mechanism(str(design["measure"])).measurement
        return measurement.text if measurement is not None else ""
    if t.kind == "remove":
        return f"{sentence_case(mechanism(design['without']).removed_by)}: {pulls} pulls of {design['sample']}."
    if t.kind == "pull further":
        return f"{pulls} further pulls of {design['sample']} at {plain(design['normal_load_N'])} N."
    if t.kind == "pull more":
        loads, samples = design["normal_loads_N"], design["samples"]
        shared = ", shared equally and in random order" if len(loads) * len(samples) > 1 else ""
        return f"{pulls} further pulls of {joined(samples)} at {joined(list(map(plain, loads)))} N{shared}."
    if t.kind == "confirm":
        words = described(str(design["covariate"]))
        values = joined([plain(value * words.factor) for value in design["values"]])
        where = f"{in_words(str(design['covariate']))} at {values} {words.unit}"
        return f"Pull {design['sample']} {pulls} times in random order with {where}, which were not measured."
    if t.kind == "vary one column":
        column = str(design["covariate"])
        if column.startswith("specimen "):
            fresh = f"fresh specimens of {design['sample']}" if "sample" in design else "fresh ones of its sample"
            return f"Pull {column} and {fresh} in turn, at one load: {pulls} pulls."
        alone = f"Vary {in_words(column)} alone, in random order, on {one_sample} at one load"
        return f"{ALONE.get(column, alone)}: {pulls} pulls."
    if t.kind == "factorial":
        both = joined([in_words(name) for name in design["vary"]])
        each = f"Set {both} to their lowest and highest value, each with each, in random order"
        return f"{each}, on {one_sample} at one load: {pulls} pulls."
    if t.kind == "vary what was fixed":
        varied = [v.text for name in t.separates if (v := mechanism(name).variation) is not None]
        if "sample" not in design:
            return f"Vary {' and '.join(varied)} in random order: {pulls} pulls of the flat sample."
        patterned, removed = design["sample"], [mechanism(name).removed_by for name in design["without"]]
        each = f"{design['pulls'] // (len(removed) + 2 * bool(varied))} pulls of"
        vary = f"Vary {' and '.join(varied)} in random order: {each} {patterned} and as many of the flat sample."
        steps = [vary] if varied else []
        return " ".join([*steps, *(f"{sentence_case(step)}: {each} {patterned}." for step in removed)])
    if t.kind == "measure more":
        counts = [(design["pulls"], "test"), (design["loads"], "load"), (design["samples"], "sample")]
        return f"Measure at least {joined([counted(n, noun) for n, noun in counts if n > 1])}, in random order."
    if t.kind == "part laws":
        difference, law, other = t.shows
        return f"{law_test(difference, law, other, design)}: {pulls} pulls."
    if t.kind == "part columns":
        varied_one = next((name for name in t.separates if name not in SERIES), "")
        others = _listed([in_words(name) for name in t.separates if name != varied_one])
        if not varied_one:
            return f"Repeat pulls of the beginning of the series after all others, to separate {others}: {pulls} pulls."
        return f"Choose the values of {in_words(varied_one)} at random, independently of {others}: {pulls} pulls."
    if t.kind == "part from load":
        columns = [name for name in t.separates if name != "normal_load_N"]
        names = _listed([in_words(name) for name in columns])
        loads = "four loads of the range, three times each, in random order"
        if set(columns) <= set(SERIES):
            return f"To tell {names} from the load, repeat {loads}."
        return f"Choose {names} independently of the load: {loads}."
    return (
        "Print T at every load, or the covariance of mu and tau0, which decides what is beyond chance. At the bench: "
        f"{t.shows}"
    )


def _listed(names: Sequence[str]) -> str:
    more = [f"{len(names) - MOST_LISTED} more"] if len(names) > MOST_LISTED else []
    return joined([*names[:MOST_LISTED], *more])
