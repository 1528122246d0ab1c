"""The card on top of a report: the answer in one sentence, with what it rests on. Made once, then written everywhere.

Page, PDF, index page, terminal and ``--json`` take their words from this record.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tribo.comparison import study_lookup
from tribo.display import displayed
from tribo.records import REGIMES, CombinedFit, LawFit, Study
from tribo.report.result_tables import PA_PER_KPA, all_set_aside
from tribo.report.words import card_sentences
from tribo.report.words.numerals import counted, joined, loads_in_words, with_uncertainty
from tribo.report.words.wording import specimens_of, uncertainty_kind
from tribo.store.whole_files import write_text

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
        sentence=card_sentences.sentence(study, verdict),
        meanings=card_sentences.meanings(verdict),
        used=len(tests),
        set_aside=aside,
        specimens=specimens,
        counts=_counts(study, len(tests), aside, specimens),
        intercept="τ₀ (kPa)" if campaign.has_area else "T₀ (N)",
        laws=tuple(card_law(fit) for fit in fits),
        uncertainty=uncertainty_kind(study),
        to_know=tuple(card_sentences.to_know(study, verdict)),
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
    what, why = str(found["text"]), card_sentences.why_next(verdict or {})
    return NextStep(what, why, hours, f"{what.rstrip('.')}{_duration(hours)}: {why}.")


def _duration(hours: float | None) -> str:
    """ " (about 2.1 h)"; empty where nobody can say."""
    if hours is None:
        return ""
    return f" (about {hours:.1f} h)" if hours >= 1 else f" (about {60 * hours:.0f} min)"
