"""The card on top of a report: the answer in one sentence, with what it rests on. Made once, then written everywhere.

Page, PDF, index page, terminal and ``--json`` take their words from this record.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from tribo.comparison import findings
from tribo.comparison.findings import all_set_aside
from tribo.diagnostics.verdict import Verdict
from tribo.display import displayed
from tribo.mechanisms import MECHANISMS
from tribo.records import PA_PER_KPA, REGIMES, LawFit, Study
from tribo.wording.numerals import counted, joined, loads_in_words, with_uncertainty
from tribo.wording.part_sentences import name_in_words
from tribo.wording.study_sentences import bent_laws, friction_sentence, specimens_of, uncertainty_kind
from tribo.wording.verdict_sentences import meanings, why_next

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

    def as_dict(self) -> dict[str, Any]:
        """The card as plain types."""
        return asdict(self)


def card_of(study: Study, verdict: Verdict | None) -> Card:
    """The card of a study; ``verdict`` is the worded one of its diagnosis, None where none was made."""
    campaign, used = study.ingested.campaign, study.ingested.pulls
    tests = [t for t in campaign.tests if t.test_id in used]
    aside, specimens = len(all_set_aside(study)), len(specimens_of(campaign, tests))
    fits = [fit for s in findings.sample_numbers(study) for r in REGIMES if (fit := _law(study, s, r)) is not None]
    return Card(
        sentence=friction_sentence(study) if verdict is None else verdict.sentence,
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


def _counts(study: Study, used: int, aside: int, specimens: int) -> str:
    tests = [t for t in study.ingested.campaign.tests if t.test_id in study.ingested.pulls]
    samples = [s for s in findings.sample_numbers(study) if any(t.sample == s for t in tests)]
    levels = np.unique(findings.load_levels(np.array([t.normal_load_N for t in tests], float)))
    where = f"{counted(specimens, 'specimen')}, {counted(len(samples), 'sample')} ({joined(samples)})"
    loads = loads_in_words(levels.tolist()) if used else ""
    left_out = f"{counted(aside, 'test')} set aside" if aside else "no test set aside"
    doubts = f", {counted(len(study.doubts), 'doubtful number')}" if study.doubts else ""
    return f"{counted(used, 'test')} used, {left_out}{doubts}; {where}{f'; {loads}' if loads else ''}."


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
            yield f"The 90 % interval of the size holds if the formula is right ({causes})."
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
