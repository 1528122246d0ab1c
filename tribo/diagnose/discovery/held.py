"""Whether a law of one campaign holds in another one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from tribo.diagnose.discovery.contested import without_rivals
from tribo.diagnose.discovery.written_law import UNITS, WrittenLaw
from tribo.diagnose.search.screen import FORM
from tribo.diagnose.statistics.fit import fit
from tribo.diagnose.statistics.interval import NORMAL_90, recovered
from tribo.diagnose.statistics.linearisation import ModelFit
from tribo.diagnose.statistics.model import Acting, effect_of
from tribo.diagnose.verdict import Estimate
from tribo.mechanisms.record import Conditions

Answer = Literal["held", "not held", "cannot be told"]
SURE = 2.58  # standard errors: both decisions are at 1 %
SHOWS = 4.0  # standard errors that the effect must have for its absence to be certain


@dataclass(frozen=True)
class Held:
    """The ``answer`` on one campaign, the amplitude found there beside the earlier one, and a sentence."""

    answer: Answer
    found: Estimate | None
    earlier: Estimate
    text: str


def holds(model: ModelFit, law: WrittenLaw, earlier: Mapping[str, Estimate], tried: int = 1) -> Held:
    """Fit the amplitude of a law, its form as written, on a campaign that it was not made from.

    It held if the amplitude is beyond chance (1 % over all laws ``tried``) and differs from the earlier one by less
    than 2.58 standard errors of the difference; of a wave, both amplitudes. The form may be wrong by a share of the
    effect, which adds to this error: another design shows another part of it. Causes of the columns of the law are left
    out unless they explain the campaign clearly better than the law (:func:`without_rivals`). Nothing can be told where
    a column is missing or does not vary, or the effect is below four standard errors in this design.
    """
    c, a0 = model.setup.observations.conditions, earlier["a"]
    if (why := not_tested(c, law)) or not np.any(law.weight(c)):
        return Held("cannot be told", None, a0, f"The law cannot be tested here: {why or 'no such sample'}.")
    acting = Acting(law.mechanism())
    names = [p.name for p in acting.mechanism.parameters]
    before = [earlier[name] for name in names]
    if np.abs(effect_of(model.setup, model.law, acting, np.array([e.value for e in before]))).max() < 1e-9:
        return Held("cannot be told", None, a0, "The law changes nothing in this design.")
    model, _ = without_rivals(model, law)
    after = fit(model.setup, (*model.acting, acting), start=model)
    found = [Estimate(*ends, a0.unit) for ends in recovered(after, len(after.acting) - 1)]
    beyond = max(np.sign(e0.value) * e.value / _error(e) for e, e0 in zip(found, before, strict=True))
    wrong_form = FORM * float(np.linalg.norm([e.value for e in before]))
    alike = all(
        abs(e.value - e0.value) < SURE * np.linalg.norm([_error(e), _error(e0), wrong_form])
        for e, e0 in zip(found, before, strict=True)
    )
    said = "; ".join(_both(*each) for each in zip(names, found, before, strict=True))
    if beyond > sure(tried) and alike:
        return Held("held", found[0], a0, f"The law held: {said}.")
    if max(abs(e0.value) / _error(e) for e, e0 in zip(found, before, strict=True)) < SHOWS:
        return Held("cannot be told", found[0], a0, f"This campaign is too small to test the law: {said}.")
    return Held("not held", found[0], a0, f"The law did not hold: {said}.")


def sure(tried: int) -> float:
    """Standard errors that one of so many laws exceeds by chance in 1 % of campaigns (Bonferroni)."""
    from scipy.special import ndtri

    return float(-ndtri(0.005 / tried))


def _error(e: Estimate) -> float:
    return max((e.high - e.low) / (2 * NORMAL_90), 1e-12)


def _both(name: str, found: Estimate, earlier: Estimate) -> str:
    return (
        f"{name} = {found.value:.3g} ({found.low:.3g} to {found.high:.3g}) here, {earlier.value:.3g} "
        f"({earlier.low:.3g} to {earlier.high:.3g}) before"
    )


def not_tested(c: Conditions, law: WrittenLaw) -> str:
    """Why the columns of a law do not allow a test; empty where they do."""
    for name in law.columns:
        if name not in UNITS and name not in c.columns:
            return f"the column {name} is not recorded"
    course = law.course(c)[law.weight(c) != 0]
    if not len(course) or np.ptp(course) < 1e-9:
        return f"{' and '.join(law.columns)} does not vary"
    return ""
