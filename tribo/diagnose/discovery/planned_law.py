"""Before anything is measured: whether a design would show a law of an earlier campaign."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tribo.diagnose.discovery.held import SHOWS, not_tested
from tribo.diagnose.discovery.written_law import WrittenLaw
from tribo.diagnose.plan import PAPER_LAW, TYPICAL, expected_fit
from tribo.diagnose.statistics.model import Acting, effect_of
from tribo.diagnose.verdict import Estimate
from tribo.records import Campaign


@dataclass(frozen=True)
class PlannedLaw:
    """The ``strength`` of a law in a design, in standard errors of its amplitude, and how many tests would suffice."""

    formula: str
    strength: float
    tests_needed: int
    text: str


def plan_law(campaign: Campaign, law: WrittenLaw, parameters: Mapping[str, Estimate]) -> PlannedLaw:
    """Whether the planned tests of a campaign would show a law at the size that was found, at typical noise."""
    f = expected_fit(campaign, TYPICAL, PAPER_LAW, None)
    c, formula, n = f.setup.observations.conditions, law.formula(), len(campaign.tests)
    if why := not_tested(c, law):
        return PlannedLaw(formula, 0.0, 0, f"This design cannot test the law {formula}: {why}.")
    acting = Acting(law.mechanism())
    values = np.array([parameters[p.name].value for p in acting.mechanism.parameters])
    left = f.linear.cleared(effect_of(f.setup, f.law, acting, values)[:, :, None])[0]
    strength = float(np.sqrt(np.sum(left**2)))
    needed = int(np.ceil(n * (SHOWS / max(strength, 1e-6)) ** 2))
    shows = "would show" if strength >= SHOWS else "would not show"
    more = "" if strength >= SHOWS else f"; about {needed} tests would" if needed < 100 * n else ""
    text = (
        f"This design {shows} the law {formula} at the size that was found: {strength:.1f} standard errors, "
        f"{SHOWS:g} are needed to say that it is absent{more}."
    )
    return PlannedLaw(formula, strength, needed, text)
