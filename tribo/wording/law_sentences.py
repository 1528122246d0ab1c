"""Laws in words: what follows what, the laws a design cannot tell from one, and whether a law holds elsewhere."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tribo.diagnostics.verdict import Estimate
from tribo.lawsearch.across_patterns import LawsAcross, formula
from tribo.lawsearch.diagnosis_with_laws import CERTAIN, Difference
from tribo.lawsearch.grammar import ALL, BOTH, CAVITY_SHARE, ELONGATION, FLAT, PATTERNED, RIM, Shape, T, WrittenLaw
from tribo.lawsearch.known_laws import SHOWS, KnownLaw, PlannedLaw, Untested
from tribo.lawsearch.model_choice import FoundLaw
from tribo.lawsearch.search import Discovery
from tribo.user_text import plain
from tribo.vocabulary import described, in_words
from tribo.wording.numerals import general, interval, p_text, signed

NAMED = 3  # tied laws that are written out in a sentence
WHERE = {
    ALL: "", PATTERNED: " of the patterned samples", FLAT: " of the flat sample",
    CAVITY_SHARE: ", in proportion to the share of cavities,", RIM: ", in proportion to the rim length,",
    ELONGATION: ", in proportion to the elongation along the pull,",
}  # fmt: skip


def law_sentence(found: FoundLaw) -> str:
    """What follows what, where, in which regime and by how much."""
    if found.law.shapes[0].kind in ("curve", "surface"):
        return (
            f"{curve_sentence(found.law, found.levels)} (adjusted p {p_text(found.p)}). No formula that was tried "
            f"predicts tests that were left out as well as this {found.law.shapes[0].kind}."
        )
    if found.levels:
        return f"{level_sentence(found.law, found.levels)} (adjusted p {p_text(found.p)})."
    said = size_sentence(found.law, found.parameters, found.effect_percent)
    return f"{said} (adjusted p {p_text(found.p)})."


def level_sentence(law: WrittenLaw, levels: Mapping[str, Estimate]) -> str:
    """ "Sliding friction depends on the pull speed: −10 % (90 % interval −12 to −8 %) at 0.05 mm/s, ..."."""
    column = law.columns[0]
    unit = described(column).unit
    return f"{subject(law)} depends on {in_words(column)}: {each_value(levels, unit)}"


def curve_sentence(law: WrittenLaw, places: Mapping[str, Estimate]) -> str:
    """ "Sliding friction follows the humidity along a curve: −10 % (90 % interval −12 to −8 %) at 30 %, ..."; of a
    surface, at pairs of values."""
    column, *others = law.columns
    unit = "" if others else described(column).unit
    said = each_value(places, unit, "the mean over the tests")
    if others:
        return f"{subject(law)} follows {in_words(column)} and {in_words(others[0])} together: {said}"
    return f"{subject(law)} follows {in_words(column)} along a curve: {said}"


def each_value(levels: Mapping[str, Estimate], unit: str = "", to: str = "the mean over these values") -> str:
    """ "+5 % (+2 to +8 %) at 0.05 mm/s, ...", relative to what."""
    each = [
        f"{signed(e.value)} % ({interval(e.low, e.high)}) at {value} {unit}".rstrip() for value, e in levels.items()
    ]
    return f"{', '.join(each)}, each relative to {to}, with 90 % intervals"


def size_sentence(
    law: WrittenLaw, parameters: Mapping[str, Estimate], effect_percent: tuple[float, float, float]
) -> str:
    """The same of any law with these parameters, without evidence and full stop."""
    value, low, high = effect_percent
    size = f"{signed(value)} %, 90 % interval {interval(low, high)}"
    if law.shapes[0].kind == "levels":
        return f"{subject(law)} changes with {in_words(law.columns[0])} from value to value by up to {size}"
    if law.shapes[0].kind == "curve":
        column = in_words(law.columns[0])
        return f"{subject(law)} follows {column} along a curve; highest relative to lowest: {size}"
    if law.shapes[0].kind == "surface":
        columns = " and ".join(map(in_words, law.columns))
        return f"{subject(law)} follows {columns} together; highest relative to lowest: {size}"
    if law.shapes[0].kind == "wave":
        return f"{subject(law)} {_wave(law.shapes[0])}; highest relative to lowest: {size}"
    return f"{subject(law)} {'is higher' if value > 0 else 'is lower'} ({size}) {_where(law, parameters)}"


def subject(law: WrittenLaw) -> str:
    """The observable and the samples."""
    regime = "Friction" if law.regime == BOTH else f"{law.regime.capitalize()} friction"
    what = regime if law.acts_on == T else f"The {law.acts_on} of {regime.lower()}"
    of = WHERE.get(law.where, f" of {law.where.replace(' + ', ', ')}")
    return f"{what}{of}"


def _where(law: WrittenLaw, parameters: Mapping[str, Estimate]) -> str:
    if len(law.shapes) > 1:
        names = " and ".join(in_words(s.column) for s in law.shapes)
        return f"where {names} are both at their highest than where one of them is at its lowest"
    s = law.shapes[0]
    if s.kind == "window":
        return f"for {in_words(s.column)} from {_value(s, s.place)} to {_value(s, s.place + s.width)} than elsewhere"
    if s.kind == "ramp":
        side = "above" if s.high > s.place else "below"
        return f"at {in_words(s.column)} = {_value(s, s.high)}, growing {side} {_value(s, s.place)}"
    if s.kind == "level":
        return f"where {in_words(s.column)} is {s.level or _value(s, s.place)}"
    if s.kind in ("step", "soft step"):
        return f"where {in_words(s.column)} is above {_value(s, s.place)}"
    if s.kind in ("optimum", "log optimum", "hump"):
        place = parameters["place"]
        factor, _ = _readable(s.column)
        low, high = general(factor * place.low), general(factor * place.high)
        near = f"{_value(s, place.value)} (90 % interval {low} to {high})"
        return f"near {in_words(s.column)} = {near} than far from it"
    how = {"log": ", in proportion to its logarithm", "saturating": ", approaching a limit"}.get(s.kind, "")
    return f"at {in_words(s.column)} = {_value(s, s.high)} than at {_value(s, s.low)}{how}"


def _wave(s: Shape) -> str:
    return f"varies periodically with {in_words(s.column)}, period {_value(s, s.width)}"


def form_in_words(law: WrittenLaw) -> str:
    """The formula of a law: "a parabola in the logarithm of the pull speed about 0.2 mm/s"."""
    names = [in_words(s.column) for s in law.shapes]
    if len(names) > 1:
        return f"a product of {' and '.join(names)}"
    (s,), (column,) = law.shapes, names
    at = f"{column} = {_value(s, s.place)}"
    words = {
        "linear": f"a straight line in {column}",
        "log": f"a straight line in the logarithm of {column}",
        "optimum": f"a parabola in {column} about {_value(s, s.place)}",
        "log optimum": f"a parabola in the logarithm of {column} about {_value(s, s.place)}",
        "step": f"a step at {at}",
        "soft step": f"a gradual step at {at}",
        "ramp": f"a straight line {'above' if s.high > s.place else 'below'} {at}",
        "window": f"another value for {column} from {_value(s, s.place)} to {_value(s, s.place + s.width)}",
        "hump": f"a hump at {at}",
        "saturating": f"an exponential approach to a limit along {column}, over {_value(s, abs(s.width))}",
        "wave": f"a wave along {column} of period {_value(s, s.width)}",
        "level": f"another value where {column} is {s.level or _value(s, s.place)}",
    }
    return words[s.kind]


def _value(s: Shape, x: float) -> str:
    factor, unit = _readable(s.column)
    return f"{general(factor * x)} {unit}".rstrip()


def _readable(column: str) -> tuple[float, str]:
    """The factor and the unit in which a column stands in a sentence."""
    return described(column).factor, described(column).unit


def tied_laws(ties: Sequence[WrittenLaw], *, by_values: bool = False) -> str:
    """The laws that the design cannot distinguish from one, or that the values of a column do not contradict, as a
    sentence; nothing without any."""
    if not ties:
        return ""
    opening = "Formulas that these values do not contradict" if by_values else "This design cannot distinguish it from"
    of_what = ["" if by_values else f" ({said[0].lower()}{said[1:]})" for said in map(subject, ties[:NAMED])]
    names = "; ".join(form_in_words(tie) + of for tie, of in zip(ties, of_what, strict=False))
    more = f"; and {len(ties) - NAMED} more" if len(ties) > NAMED else ""
    return f"{opening}: {names}{more}."


def discovery_sentence(d: Discovery) -> str:
    """What was found, or that nothing was."""
    if not d.laws:
        return f"None of the {d.searched} laws that were tried explains more than chance does."
    said = [text for f in d.laws for text in (law_sentence(f), tied_laws(f.ties, by_values=bool(f.levels))) if text]
    return f"{' '.join(said)} {d.searched} laws were tried."


def held_sentence(h: KnownLaw) -> str:
    """Whether a law of another campaign held in this one, where it was tested."""
    if h.untested is not None:
        return "The law changes nothing in this design." if h.untested[0] == "no effect" else (
            f"The law cannot be tested here: {untested_clause(h.untested)}."
        )
    opening = {
        "held": "The law held", "not held": "The law did not hold",
        "cannot be told": "This campaign is too small to test the law",
    }[str(h.answer)]  # fmt: skip
    both = (
        f"{name} = {e.value:.3g} ({e.low:.3g} to {e.high:.3g}) here, {e0.value:.3g} ({e0.low:.3g} to {e0.high:.3g}) "
        "before"
        for name, e in h.found.items()
        for e0 in [h.parameters[name]]
    )
    return f"{opening}: {'; '.join(both)}."


def untested_clause(untested: Untested) -> str:
    """Why a design cannot test a law."""
    why, columns = untested
    return {
        "not recorded": f"the column {columns[0]} is not recorded" if columns else "",
        "not varied": f"{' and '.join(columns)} does not vary", "no such sample": "no such sample",
        "no effect": "it changes nothing",
    }[why]  # fmt: skip


def planned_law_sentence(p: PlannedLaw) -> str:
    """Whether the planned tests would show a law of another campaign."""
    if p.untested is not None:
        return f"This design cannot test the law {p.formula}: {untested_clause(p.untested)}."
    more = f"; about {p.tests_needed} tests would" if not p.shows and p.tests_needed < 100 * p.n_tests else ""
    return (
        f"This design would {'' if p.shows else 'not '}show the law {p.formula} at the size that was found: "
        f"{p.strength:.1f} standard errors, {SHOWS:g} are needed to say that it is absent{more}."
    )


def law_test(difference: Difference, law: WrittenLaw, other: WrittenLaw, design: Mapping[str, Any]) -> str:
    """The test that parts two laws, without the number of its pulls."""
    words = " and ".join(dict.fromkeys(map(in_words, law.columns)))
    days = [s.level for s in law.shapes if s.kind == "level" and s.column == "date"]  # no day comes back
    found_out = f"Find out what differed on {' and '.join(days)}, and pull with it and without it"
    vary = found_out if days else f"Vary {words}"
    if difference == "pressures":
        return (
            "Pull patterned samples and the flat one at equal contact pressures, with loads in proportion to the "
            "contact area"
        )
    if difference == "columns":
        apart = set(law.columns) ^ set(other.columns)
        varied = dict.fromkeys(in_words(name) for name in (*law.columns, *other.columns) if name in apart)
        of_each_other = "of each other and " if len(varied) > 1 else ""
        return f"Vary {' and '.join(varied)} independently {of_each_other}of all other conditions"
    if difference == "samples":
        return f"{vary} on sample {design['sample']} alone, at one load"
    if difference == "terms":
        low, high = design["normal_load_N"]
        return f"{vary} at {plain(low)} N and at {plain(high)} N alone"
    if difference == "regimes":
        regime = next(r for r in (law.regime, other.regime) if r != BOTH)
        again = vary if days else f"Repeat pulls at the lowest and the highest value of {words}"
        return f"{again} ({regime} friction decides)"
    if difference == "corners":
        return vary if days else f"Pull at the corners of the ranges of {words}"
    column = law.columns[0]
    factor, unit = _readable(column)
    return f"Pull at {in_words(column)} = {general(factor * design[column])} {unit}".rstrip()


def across_sentence(found: Sequence[LawsAcross]) -> str:
    """Whether the geometry of the patterns predicts what the model gets wrong about them."""
    without = found[0].deviations.size
    beyond = [s for s in found if s.p < CERTAIN and s.nested < without]
    if beyond:
        best = min(beyond, key=lambda s: s.nested)
        return (
            f"One law across the patterns predicts the deviation of a pattern that it was not fitted to: "
            f"{formula(best.best)}. It lowers the error of friction from {_factor(without)} to "
            f"{_factor(best.nested)} (p {p_text(best.p)}). {_tried(best)}"
        )
    best = min(found, key=lambda s: s.best.error)
    return (
        "No law across the patterns is beyond chance: with the differences exchanged between the patterns at random, a "
        f"law is as good in {100 * best.p:.0f} % of the cases. Chosen and fitted without the pattern that it predicts, "
        f"the best law is wrong by {_factor(best.nested)}, the model alone by {_factor(without)}. {_tried(best)}"
    )


def _tried(s: LawsAcross) -> str:
    return f"{s.tried} laws of {s.terms} term{'s' if s.terms > 1 else ''} were tried."


def _factor(rms: float) -> str:
    """An rms error of ln T as a factor of friction."""
    return f"a factor of {np.exp(rms):.2f}"


def across_record(found: Sequence[LawsAcross]) -> Mapping[str, object]:
    """The outcome for a JSON file."""
    deviations = found[0].deviations
    return {
        "text": across_sentence(found), "patterns": list(deviations.patterns), "model_error": deviations.size,
        "searches": [
            {
                "terms": s.terms, "laws_tried": s.tried, "best": formula(s.best), "left_out_error": s.best.error,
                "p": s.p, "best_of_chance_error": s.chance, "nested_error": s.nested,
            }
            for s in found
        ],
    }  # fmt: skip
