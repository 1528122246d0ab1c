"""The card on top of a report, and what a terminal shows: the answer in one sentence, with what it rests on.

The card is made once, then written everywhere: page, PDF, index page, terminal and ``--json`` take their words from it.
A terminal shows the table of fitted laws, the agreement with the model, a verdict and a planned design as well.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from tribo.comparison import findings
from tribo.comparison.findings import all_set_aside
from tribo.diagnostics.planning import Finding, Plan
from tribo.diagnostics.verdict import Verdict
from tribo.display import displayed
from tribo.mechanisms import MECHANISMS, mechanism
from tribo.records import PA_PER_KPA, REGIMES, LawFit, Regime, Study
from tribo.user_text import plain
from tribo.wording import study_sentences as study_words
from tribo.wording.numerals import counted, joined, loads_in_words, with_uncertainty
from tribo.wording.part_sentences import TAKEN_UP, name_in_words, not_varied
from tribo.wording.study_sentences import bent_laws, friction_sentence, specimens_of, uncertainty_kind
from tribo.wording.verdict_sentences import meanings, verdict_in_words, why_next, without_model

MOST_REASONS = 3
NUMBERS = {"mu": "μ", "tau0_Pa": "τ₀", "T0_N": "T₀"}


@displayed(lambda card: card.counts)
@dataclass(frozen=True)
class Card:
    """What someone must know who reads nothing else.

    ``sentence`` says what happens to friction, how much, where and what it is called; ``meanings`` are the names used
    in it, each with one sentence. ``used`` and ``set_aside``
    count tests; ``specimens`` counts each one once, also if it was pulled in two directions. ``doubts`` are the numbers
    outside their physical bounds, one sentence each. ``laws`` are rows of mu and ``intercept``, tau0 (T0 without an
    area), of one sample in one regime, with the ``largest`` part of their uncertainty. ``next_test`` has ``what``,
    ``why``, ``hours`` (None where nobody can say), and the ``line`` that says all of it.
    """

    sentence: str
    meanings: tuple[tuple[str, str], ...]
    used: int
    set_aside: int
    specimens: int
    counts: str
    intercept: str
    laws: tuple[dict[str, str], ...]
    uncertainty: str
    to_know: tuple[str, ...]
    next_test: dict[str, Any] | None
    doubts: tuple[str, ...] = ()


def card_of(study: Study, verdict: Verdict | None) -> Card:
    """The card of a study; ``verdict`` is the worded one of its diagnosis, None where none was made."""
    campaign, tests = study.ingested.campaign, study.ingested.used_tests
    aside, specimens = len(all_set_aside(study)), len(specimens_of(campaign, tests))
    fits = [fit for s in findings.sample_numbers(study) for r in REGIMES if (fit := _law(study, s, r)) is not None]
    return Card(
        sentence=friction_sentence(study) if verdict is None else verdict.sentence,
        meanings=meanings(verdict),
        used=len(tests),
        set_aside=aside,
        specimens=specimens,
        counts=_counts(study, aside, specimens),
        intercept="τ₀ (kPa)" if campaign.has_area else "T₀ (N)",
        laws=tuple(card_law(fit) for fit in fits),
        uncertainty=uncertainty_kind(study),
        to_know=tuple(to_know(study, verdict)),
        next_test=_next(verdict),
        doubts=tuple(map(str, study.doubts)),
    )


def _law(study: Study, sample: str, regime: str) -> LawFit | None:
    fit = study.fits.of(sample, regime)
    return fit if fit is not None and np.isfinite(fit.values).all() else None


def card_law(fit: LawFit) -> dict[str, str]:
    """One fit as the card shows it."""
    unit = PA_PER_KPA if fit.has_area else 1.0
    intercept, u = fit.value(fit.adhesion) / unit, fit.standard_uncertainty(fit.adhesion) / unit
    return {
        "sample": fit.sample, "regime": fit.regime, "mu": with_uncertainty(fit.mu, fit.mu_u),
        "intercept": with_uncertainty(intercept, u), "largest": _largest(fit),
    }  # fmt: skip


def _largest(fit: LawFit) -> str:
    """ "repeats (60 %)", or "μ: wire angle (52 %); τ₀: specimens (48 %)" where they differ."""
    if not fit.largest:
        return ""
    parts = {key: fit.largest[key] for key in fit.parameters}
    if len({name for name, _ in parts.values()}) == 1:
        low, high = sorted(round(share) for _, share in parts.values())
        name = next(iter(parts.values()))[0]
        return f"{name} ({low} %)" if low == high else f"{name} ({low} to {high} %)"
    return "; ".join(f"{NUMBERS[key]}: {name} ({share:.0f} %)" for key, (name, share) in parts.items())


def _counts(study: Study, aside: int, specimens: int) -> str:
    tests, samples = study.ingested.used_tests, findings.tested_samples(study)
    levels = np.unique(findings.load_levels(np.array([t.normal_load_N for t in tests], float)))
    where = f"{counted(specimens, 'specimen')}, {counted(len(samples), 'sample')} ({joined(samples)})"
    loads = loads_in_words(levels.tolist()) if tests else ""
    left_out = f"{counted(aside, 'test')} set aside" if aside else "no test set aside"
    doubts = f", {counted(len(study.doubts), 'doubtful number')}" if study.doubts else ""
    return f"{counted(len(tests), 'test')} used, {left_out}{doubts}; {where}{f'; {loads}' if loads else ''}."


def _next(verdict: Verdict | None) -> dict[str, Any] | None:
    if verdict is None or verdict.next_test is None:
        return None
    hours: float | None = verdict.next_test.design.get("hours")
    what, why = verdict.next_test.text, why_next(verdict)
    takes = "" if hours is None else f" (about {hours:.1f} h)" if hours >= 1 else f" (about {60 * hours:.0f} min)"
    return {"what": what, "why": why, "hours": hours, "line": f"{what.rstrip('.')}{takes}: {why}."}


def to_know(study: Study, verdict: Verdict | None) -> Iterator[str]:
    """What changes how far the sentence can be trusted; nothing where nothing does."""
    aside = dict(_reasons(study))
    if aside:
        reasons = sorted(aside.items(), key=lambda item: -item[1])[:MOST_REASONS]
        yield f"Tests set aside: {'; '.join(f'{count} × {reason}' for reason, count in reasons)}."
    yield from _flat(study)
    bending = [c.mechanism for c in (verdict.causes if verdict is not None else ()) if _bends(c.mechanism)]
    because = f" This is what {joined([name_in_words(name) for name in bending])} would do." if bending else ""
    yield from (f"{said}{because}" for said in bent_laws(study))
    if verdict is not None:
        if ties := [names for names in verdict.equivalent if len(names) > 1]:
            tied = "; ".join(" or ".join(map(name_in_words, names)) for names in ties)
            yield f"The data fit each of these equally well: {tied}."
        sized = [n.name for n in verdict.layers if n.kind == "cause" and n.formula and np.isfinite(n.low)]
        if sized:
            causes = joined([name_in_words(n) for n in dict.fromkeys(sized)])
            yield f"The 90 % interval of the size holds if the formula is right or nearly right ({causes})."
        if untested := dict.fromkeys(e.mechanism for e in verdict.not_testable):
            yield f"This design cannot test {joined([name_in_words(n) for n in untested])}."
    moved = sum(1 for t in study.ingested.by_hand if t in study.ingested.pulls)
    if moved:
        yield f"The peak or the window of {counted(moved, 'pull')} was moved by hand."
    if study.undiagnosed:
        yield f"no diagnosis: {study.undiagnosed}"


def _bends(name: str) -> bool:
    """Whether a cause changes T by another share at every load."""
    m = MECHANISMS.get(name.partition(":")[0])
    return m is not None and (m.choosing.column == "normal_load_N" or "normal_load_N" in m.needs)


def _flat(study: Study) -> Iterator[str]:
    """That another sample than F calibrates the model."""
    campaign = study.ingested.campaign
    flat = campaign.flat_sample
    if study.comparison is not None and flat != "F":
        why = "as chosen" if campaign.chosen_flat else "the only flat sample; there is no sample F"
        yield f"The model is calibrated on sample {flat} ({why})."


def _reasons(study: Study) -> dict[str, int]:
    """How many tests were set aside for each reason."""
    found: dict[str, int] = {}
    for fault in all_set_aside(study).values():
        reason = fault.problems[0].what if fault.problems else fault.reason
        found[reason] = found.get(reason, 0) + 1
    return found


HEAD = ("sample", "mu", "tau0 (kPa)", "T (N)", "mu", "tau0 (kPa)", "T (N)", "specimens", "tests")


def table2_text(study: Study) -> str:
    """Table 2 of the paper for this campaign: mu, tau0 and T at the middle load, measured and simulated."""
    if not study.fits:
        return "No friction law was fitted."
    load = findings.common_loads(study)[1]
    blocks = [_regime_block(study, regime, load) for regime in REGIMES]
    foot = (
        f"T at N = {plain(load)} N. After ±: {study_words.uncertainty_kind(study)}.\n"
        "mu and tau0 of a fit are correlated: compare T rather than mu or tau0 alone."
    )
    return "\n\n".join([*(b for b in blocks if b), foot])


def _regime_block(study: Study, regime: Regime, load: float) -> str:
    simulated = study.comparison.simulated if study.comparison is not None else ()
    rows = []
    for sample in findings.sample_numbers(study):
        measured, model = (
            study.fits.of(sample, regime),
            findings.fit_of(simulated, sample, regime),
        )
        if measured is not None:
            counts = (str(measured.n_specimens), str(measured.n_tests))
            rows.append((sample, *fit_cells(measured, load), *fit_cells(model, load), *counts))
    if not rows:
        return ""
    if not simulated:
        names = HEAD if study.ingested.campaign.has_area else tuple(h.replace("tau0 (kPa)", "T0 (N)") for h in HEAD)
        return "\n".join([regime.upper(), *_aligned([(*row[:4], *row[7:]) for row in (names, *rows)])])
    lines = _aligned([HEAD, *rows])
    left, right = lines[0].index(" mu") + 1, lines[0].rindex(" mu") + 1
    head = f"{regime.upper():<{left}}measured"
    return "\n".join([f"{head:<{right}}simulated", *lines])


def _aligned(rows: list[tuple[str, ...]]) -> list[str]:
    """Columns of equal width, the first to the left, the others to the right."""
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    return [_line(row, widths) for row in rows]


def _line(row: tuple[str, ...], widths: list[int]) -> str:
    first, *rest = (
        cell.rjust(width) if k else cell.ljust(width) for k, (cell, width) in enumerate(zip(row, widths, strict=True))
    )
    return "  ".join([first, *rest])


def fit_cells(fit: LawFit | None, load_N: float) -> tuple[str, str, str]:
    """mu, tau0 in kPa (T0 in newton without an area) and T at a load, with uncertainties; dashes without a fit."""
    if fit is None:
        return "–", "–", "–"
    unit = PA_PER_KPA if fit.has_area else 1.0
    return (
        with_uncertainty(fit.mu, fit.mu_u),
        with_uncertainty(fit.value(fit.adhesion) / unit, fit.standard_uncertainty(fit.adhesion) / unit),
        with_uncertainty(float(fit.force_N(load_N)), float(fit.force_u_N(load_N))),
    )


def summary_text(study: Study) -> str:
    """The measurements and the agreement with the model, in the words of the report, one sentence per line."""
    agreements = findings.agreements(study)
    lines = [study_words.what_was_measured(study), *study_words.in_short(agreements, findings.flat_sample(study))]
    lines += [study_words.ranking_sentence(r) for r in findings.rankings(study)]
    lines += study_words.direction_sentences(findings.direction_ratios(study))
    return "\n".join(lines)


CARD_LINES = 8


def card_text(card: Card) -> str:
    """Doubts, the sentence, the tests, what else to know, what the names mean and the next test, in CARD_LINES lines.

    What does not fit stands in the report. The laws have their own table.
    """
    others = f" (and {len(card.doubts) - 1} more)" if len(card.doubts) > 1 else ""
    first = [f"Check first: {card.doubts[0]}{others}"] if card.doubts else []
    last = [] if card.next_test is None else [f"Next test: {card.next_test['line']}"]
    more = [*card.to_know, *(f"{name}: {meaning}" for name, meaning in card.meanings)]
    room = CARD_LINES - 2 - len(first) - len(last)
    if len(more) > room:
        more = [*more[: room - 1], f"The report has {len(more) - room + 1} further notes."]
    return "\n".join([*first, card.sentence, card.counts, *more, *last])


def verdict_text(v: Verdict) -> str:
    """What a finding rests on, for a terminal: evidence, misfits, causes with weights, ties and gain.

    What the finding says already in the same words is not said again.
    """
    words = verdict_in_words(v)
    told = [c["text"] for c in words["causes"] if c["text"] in v.sentence]
    lines = [words["evidence"]]
    lines += [f"  misfit: {misfit['text']}" for misfit in words["misfits"] if not (told and without_model(v))]
    lines += [
        f"  cause, weight {c['weight']}: {c['mechanism'] if c['text'] in told else c['text']}" for c in words["causes"]
    ]
    lines += [f"  {text}" for text in (*words["equivalent"], words["gain"])]
    return "\n".join(line for line in lines if line.strip())


def why_not_found(f: Finding) -> str:
    """Why a planned design cannot show a mechanism; empty where it can."""
    return {
        "": "", **TAKEN_UP,
        "not varied": not_varied(mechanism(f.mechanism).needs),
        "in the trace": "it changes the shape of the trace, not the friction forces",
    }[f.why]  # fmt: skip


def plan_text(plan: Plan) -> str:
    """The effect of each mechanism that a design detects with 90 % probability, and what it cannot distinguish."""
    lines = [f"{plan.n_tests} planned tests. Smallest effects detected with 90 % probability, easiest first:"]
    for f in (f for f in plan.findings if not f.why):
        size = f"{f.amplitude:.3g} {f.unit}".rstrip()
        names = ", ".join(map(name_in_words, f.confused_with))
        tie = f"; not distinguishable from {names}; to separate them: {f.separates}" if names else ""
        effect = f"changes T by {f.effect_percent:.0f} % over the design"
        lines.append(f"  {name_in_words(f.mechanism)}: {size} or more ({effect}){tie}")
    for f in (f for f in plan.findings if f.why):
        lines.append(f"  {name_in_words(f.mechanism)}: not detectable with this design ({why_not_found(f)})")
    return "\n".join(lines)
