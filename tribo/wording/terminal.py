"""Text for a terminal: the card, the table of fitted laws, agreement with the model, a verdict, a planned design."""

from __future__ import annotations

from tribo.comparison import findings
from tribo.diagnostics.planning import Finding, Plan
from tribo.diagnostics.verdict import Verdict
from tribo.mechanisms import mechanism
from tribo.records import PA_PER_KPA, REGIMES, LawFit, Regime, Study
from tribo.wording import study_sentences as study_words
from tribo.wording.card import Card
from tribo.wording.numerals import with_uncertainty
from tribo.wording.part_sentences import TAKEN_UP, name_in_words, not_varied
from tribo.wording.verdict_sentences import verdict_in_words

HEAD = ("sample", "mu", "tau0 (kPa)", "T (N)", "mu", "tau0 (kPa)", "T (N)", "specimens", "tests")


def table2_text(study: Study) -> str:
    """Table 2 of the paper for this campaign: mu, tau0 and T at the middle load, measured and simulated."""
    if not study.fits:
        return "No friction law was fitted."
    load = findings.common_loads(study)[1]
    blocks = [_regime_block(study, regime, load) for regime in REGIMES]
    foot = (
        f"T at N = {load:.3g} N. After ±: {study_words.uncertainty_kind(study)}.\n"
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
    """What a finding rests on, for a terminal: evidence, misfits, causes with intervals, ties and gain."""
    words = verdict_in_words(v)
    lines = [words["evidence"]]
    lines += [f"  misfit: {misfit['text']}" for misfit in words["misfits"]]
    lines += [f"  cause, weight {c['weight']}: {c['text']}" for c in words["causes"]]
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
