"""A law across patterns as part of a verdict: where the model is wrong about several patterns, does one law say how?"""

from __future__ import annotations

from dataclasses import replace

from tribo.diagnose.diagnosis_record import Diagnosis
from tribo.diagnose.discovery.across_patterns import AcrossPatterns, across_patterns
from tribo.diagnose.discovery.across_words import CERTAIN, deviations_of, sentence
from tribo.diagnose.discovery.in_verdict import explained


def across_of(d: Diagnosis, *, seed: int = 0) -> AcrossPatterns | None:
    """Laws across the patterns of a campaign, beside its causes; None where fewer than four were measured."""
    return across_patterns(deviations_of(explained(d)), seed=seed)


def with_law_across(d: Diagnosis, *, seed: int = 0) -> Diagnosis:
    """The same diagnosis, its text with the law across patterns where the model is wrong about several of them."""
    wrong = {x.name for x in d.verdict.layers if x.kind == "pattern_correction" and x.p_adjusted < CERTAIN}
    found = across_of(d, seed=seed) if len(wrong) > 1 and d.verdict.verdict != "no_misfit" else None
    if found is None:
        return d
    return replace(d, verdict=replace(d.verdict, text=f"{d.verdict.text} {sentence(found)}"))
