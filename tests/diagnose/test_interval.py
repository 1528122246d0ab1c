"""Intervals of recovered parameters, away from their bounds and at them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tribo.diagnose.statistics.fit import fit
from tribo.diagnose.statistics.interval import (
    DROP_90,
    _score_at,
    intervals,
    recovered,
    standard_errors,
    understated,
    with_pattern_error,
)
from tribo.diagnose.statistics.linearisation import ModelFit
from tribo.diagnose.statistics.model import candidates

from .test_screen import baseline


def fitted(name: str, *effects: tuple[str, float]) -> ModelFit:
    b = baseline(*effects)
    acting = next(a for a in candidates(b.setup, b.law) if a.name == name)
    return fit(b.setup, (acting,), start=b)


def test_away_from_the_bounds_the_curvature_gives_the_interval() -> None:
    f = fitted("temperature", ("temperature", 1.0))
    (low, high), error = intervals(f, 0)[0], standard_errors(f, 0)[0]
    assert high - low == pytest.approx(2 * 1.645 * error)
    assert low < 0.06 < high


def test_at_a_bound_the_interval_opens_to_the_inside() -> None:
    """A load that is lifted leaves no room for suction: the best value is zero, but some suction is possible."""
    f = fitted("suction", ("normal_load_error", -0.4))
    low, high = intervals(f, 0)[0]
    assert f.values[0][0] == low == 0.0
    assert 10.0 < high < 3000.0


def test_the_ends_of_a_profile_interval_lose_what_they_should() -> None:
    f = fitted("suction", ("normal_load_error", -0.4))
    high = intervals(f, 0)[0][1]
    assert f.score - _score_at(f, 0, 0, high) == pytest.approx(DROP_90, rel=0.2)


@pytest.mark.parametrize("factor", [0.5, 4.0])
def test_the_patterns_of_the_campaign_tell_how_wrong_the_model_is_about_them(factor: float) -> None:
    """Where the patterns are off by half their stated error the interval is narrower than at that error, by four times
    wider.

    Each of A, B and C is off by so many standard deviations of that error, alternately up and down.
    """
    moved = off_by(factor)
    (_, low, high), (at_least, at_most) = recovered(moved, 0)[0], intervals(with_pattern_error(moved, 1.0), 0)[0]
    assert (high - low < at_most - at_least) == (factor < 1)


def test_the_scale_of_the_pattern_error_is_recovered() -> None:
    """Three patterns, both regimes, off by four times the stated error: the factor is within a third of four."""
    assert off_by(4.0).noise.pattern == pytest.approx(4.0, rel=0.34)
    assert off_by(0.5).noise.pattern < 1.0


def off_by(factor: float) -> ModelFit:
    f = fitted("edge_adhesion", ("edge_adhesion", 1.0))
    o = f.setup.observations
    off = sum(
        sign * factor * np.array(f.setup.predictor.offset[sample]) * (o.conditions.sample == sample)[:, None]
        for sample, sign in (("A", 1), ("B", -1), ("C", 1))
    )
    return fit(replace(f.setup, observations=replace(o, log_force=o.log_force + off)), f.acting)


def test_an_averaged_interval_keeps_to_the_bounds() -> None:
    f = fitted("suction", ("normal_load_error", -0.4))
    value, low, high = recovered(f, 0)[0]
    assert low == 0.0 <= value < high


def test_standard_errors_are_widened_by_what_campaigns_of_the_fit_itself_show() -> None:
    """Normal repeats under weights of a t distribution: the curvature is a little too confident, never by half."""
    factors = [understated(fitted(name, (name, 1.5)), 0) for name in ("covariate:operator", "run_in", "tilt")]
    assert [f.size for f in factors] == [1, 2, 1]
    every = np.concatenate(factors)
    assert every.min() >= 1.0
    assert 1.02 < every.mean() < 1.2


def test_an_interval_is_as_much_wider_as_the_errors_are_understated() -> None:
    f = fitted("covariate:operator", ("covariate:operator", 1.5))
    value, low, high = recovered(f, 0)[0]
    stated = 2 * 1.645 * standard_errors(f, 0)[0]
    assert high - low > 0.97 * stated * understated(f, 0)[0]
    assert low < value < high
