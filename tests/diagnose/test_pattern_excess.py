"""Patterns further from the model than its own error are said to be so; those within it are not."""

from __future__ import annotations

import math
from dataclasses import replace

from tribo.diagnostics.inference import pattern_corrections, pattern_excess
from tribo.records import REGIMES
from tribo.wording.verdict_sentences import worded

from .examined import Once, examined
from .test_scatter import baseline, off


def test_patterns_six_times_as_far_off_as_stated_are_reported_each_with_its_own_p(once: Once) -> None:
    verdict = examined("patterns_off", once).verdict
    assert verdict.verdict == "unknown"
    own = {(c.name, c.regimes[0]): c for c in verdict.layers if c.kind == "pattern_correction"}
    assert {name for name, _ in own} == {"A", "B", "C"}
    beyond = {key for key, c in own.items() if c.p_adjusted < 0.01}
    assert {(m.sample, m.observable) for m in verdict.misfits} == beyond
    assert len(beyond) == 3  # of six: C slides like the model, and B is off by less than its own error shows
    for m in verdict.misfits:
        assert (m.effect_percent, m.p_adjusted) == (
            own[m.sample, m.observable].effect_percent, own[m.sample, m.observable].p_adjusted
        )  # fmt: skip
    assert "times its stated error for patterns" in worded(verdict).text
    assert worded(verdict).sentence.endswith("no mechanism that this design can test explains it.")
    assert "of the library" in worded(replace(verdict, not_testable=())).sentence
    step = worded(verdict).next_test
    assert step is not None
    assert step.design["sample"] == verdict.misfits[0].sample
    assert set(step.separates) <= {e.mechanism for e in verdict.not_testable}
    assert {"velocity_dependence", "contact_ageing"} <= set(step.separates)
    assert step.text.startswith("Vary the pull speed")


def test_the_reported_percentages_are_those_by_which_the_patterns_were_moved() -> None:
    f = baseline(3, off(6.0))
    assert pattern_excess(f) is not None
    left = f.residual - f.setup.dense[:, :, f.setup.group < 4] @ f.effects[f.setup.group < 4]
    corrections = pattern_corrections(f)
    for c in corrections:
        mean = left[f.setup.observations.conditions.sample == c.name, REGIMES.index(c.regimes[0])].mean()
        assert abs(mean - math.log1p(c.effect_percent / 100.0)) < 0.03
    assert "F" not in {c.name for c in corrections}


def test_patterns_one_and_a_half_times_as_far_off_as_stated_are_not_reported() -> None:
    found = [pattern_excess(baseline(seed, off(1.5))) for seed in (1, 2, 3, 4, 5, 6)]
    assert all(excess is None or excess[1] > 0.01 for excess in found)
