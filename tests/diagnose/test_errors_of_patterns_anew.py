"""A cause that acts on all patterns is not lost in their errors, which seem as large as it is where it is left out."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from blind.bench import Design
from blind.direct import ingested
from blind.tribometer import hide

from tribo.diagnostics import candidates, diagnosis, examine
from tribo.diagnostics.candidates import judged, refitted, with_errors_of_patterns_anew
from tribo.diagnostics.contrasts import Screen, screen
from tribo.diagnostics.fit import ModelFit
from tribo.diagnostics.model import PATTERN, Acting, Setup
from tribo.diagnostics.score_statistics import start_effects
from tribo.mechanisms import MECHANISMS
from tribo.records import FloatArray, Ingested

from .known import acting, baseline, contrasts_of, made
from .test_days_and_drift import SMALL, days

CAVITIES, RUN_IN = "cavity_shear_deformation", "run_in"
ONCE = Design(repeats=1)


def nothing(s: Setup) -> FloatArray:
    return np.zeros((s.observations.n, 2))


def campaign(name: str, *values: float) -> Ingested:
    return made(acting(name, *values) if name else nothing, seed=0, design=ONCE)


@cache
def screens(name: str, *values: float) -> tuple[ModelFit, Screen, Screen]:
    """The model without causes, its screen, and the same with the errors of the patterns estimated anew."""
    start = start_effects(baseline(campaign(name, *values)))
    seen = screen(start.model, contrasts_of(start.model), replicates=20, rng=np.random.default_rng(0))
    return start.model, seen, with_errors_of_patterns_anew(seen, start, ())


def strength(seen: Screen, name: str) -> float:
    return max(float(v) for v, c in zip(seen.strength, seen.contrasts, strict=True) if c.title == name)


def test_cavities_that_deform_twice_as_much_are_stronger_although_patterns_seem_to_be_off_by_twice_as_much() -> None:
    (model, seen, anew), (larger, weak, strong) = screens(CAVITIES, 0.15), screens(CAVITIES, 0.3)
    assert larger.noise.sizes[PATTERN] > 1.8 * model.noise.sizes[PATTERN] > 8.0
    assert strength(weak, CAVITIES) < strength(seen, CAVITIES) + 0.3
    assert strength(strong, CAVITIES) > strength(anew, CAVITIES) + 0.6 > strength(seen, CAVITIES) + 2.0
    assert strong.p.min() < anew.p.min() < 0.01 * seen.p.min()


def test_only_the_cause_that_the_errors_of_the_patterns_took_up_is_stronger() -> None:
    _, seen, anew = screens(CAVITIES, 0.15)
    stronger = np.flatnonzero(anew.strength > seen.strength)
    assert [seen.contrasts[k].title for k in stronger] == [CAVITIES]
    assert np.array_equal(np.delete(anew.strength, stronger), np.delete(seen.strength, stronger))


def test_where_nothing_is_hidden_no_contrast_is_stronger() -> None:
    _, seen, anew = screens("")
    assert np.array_equal(seen.strength, anew.strength)
    assert np.array_equal(seen.p, anew.p)


def test_a_cause_that_changes_one_pattern_alone_is_no_stronger(monkeypatch: pytest.MonkeyPatch) -> None:
    model, seen, anew = screens(CAVITIES, 0.15)
    sample = model.setup.observations.conditions.sample
    monkeypatch.setattr(candidates, "_changed_tests", lambda _: np.isin(sample, ("F", "B")))
    alone = with_errors_of_patterns_anew(seen, start_effects(model), ())
    assert strength(anew, CAVITIES) > strength(alone, CAVITIES) + 1.0
    assert np.array_equal(alone.strength, seen.strength)


def test_a_size_that_is_estimated_anew_has_to_earn_what_a_further_parameter_has_to(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    _, seen, anew = screens(CAVITIES, 0.15)
    monkeypatch.setattr(candidates, "PER_PARAMETER", 0.0)
    free = with_errors_of_patterns_anew(seen, start_effects(baseline(campaign(CAVITIES, 0.15))), ())
    assert strength(free, CAVITIES) ** 2 - strength(anew, CAVITIES) ** 2 == pytest.approx(2.0, abs=0.01)


def test_a_cause_is_no_stronger_by_a_form_that_chance_was_not_given() -> None:
    """A run-in is fitted with the pulls over which it fades, and screened at one number of them."""
    model, seen, anew = screens(RUN_IN, 0.5, 12.0)
    fitted = judged(model, refitted(model, (Acting(MECHANISMS[RUN_IN]),)), 0.0)
    assert fitted.gain > 4.6
    assert fitted.strength > strength(seen, RUN_IN) + 0.5
    assert strength(anew, RUN_IN) == pytest.approx(strength(seen, RUN_IN), abs=0.1)


def test_a_campaign_without_errors_of_patterns_keeps_its_screen() -> None:
    flat = start_effects(baseline(made(nothing, seed=0, design=Design(samples=("F",)))))
    assert not flat.model.setup.of_patterns.any()
    seen = screens("")[1]
    assert with_errors_of_patterns_anew(seen, flat, ()) is seen


def test_cavities_that_deform_are_named() -> None:
    d = examine(made(acting(CAVITIES, 0.3), seed=0, design=ONCE), replicates=(40, 20))
    assert [c.mechanism for c in d.verdict.causes] == [CAVITIES]


def test_beside_certain_days_the_errors_of_patterns_stay_as_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    def unexpected(*_: object) -> Screen:
        raise AssertionError

    monkeypatch.setattr(diagnosis, "with_errors_of_patterns_anew", unexpected)
    b = hide(1, [], SMALL)
    with pytest.raises(AssertionError):
        examine(ingested(b, 1), replicates=(40, 20))
    b.scale(np.exp(days(b, np.random.default_rng([1, 31]))))
    assert examine(ingested(b, 1), replicates=(40, 20)).verdict.verdict == "no_misfit"
