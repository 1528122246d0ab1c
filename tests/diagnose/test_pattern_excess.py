"""Patterns further from the model than its own error are said to be so; those within it are not."""

from __future__ import annotations

import math

from tribo.diagnose import examine
from tribo.diagnose.statistics.pattern_excess import pattern_excess

from .synthetic import hidden
from .test_scatter import baseline, off


def test_patterns_six_times_as_far_off_as_stated_are_reported_sample_by_sample() -> None:
    verdict = examine(hidden(seed=3, design=off(6.0)), replicates=(40, 20)).verdict
    assert verdict.verdict == "unknown"
    assert {m.sample for m in verdict.misfits} >= {"A", "B", "C"}
    assert all(m.p_adjusted < 0.01 for m in verdict.misfits)
    assert "times the error that is stated for it" in verdict.text


def test_the_reported_percentages_are_those_by_which_the_patterns_were_moved() -> None:
    f = baseline(3, off(6.0))
    excess = pattern_excess(f)
    assert excess is not None
    left = f.residual - f.setup.random[:, :, f.setup.group < 4] @ f.effects[f.setup.group < 4]
    for sample, percent in excess.percent.items():
        mean = left[f.setup.observations.conditions.sample == sample].mean(axis=0)
        assert max(abs(mean - [math.log1p(p / 100.0) for p in percent])) < 0.03
    assert "F" not in excess.percent


def test_patterns_one_and_a_half_times_as_far_off_as_stated_are_not_reported() -> None:
    found = [pattern_excess(baseline(seed, off(1.5))) for seed in (1, 2, 3, 4, 5, 6)]
    assert all(excess is None or excess.p > 0.01 for excess in found)
