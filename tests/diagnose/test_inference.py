"""Intervals of recovered parameters, away from their bounds and at them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from blind.tribometer import Design

from tribo.diagnostics import inference
from tribo.diagnostics.fit import ModelFit, fit
from tribo.diagnostics.inference import (
    DROP_90,
    _averaged,
    _log_freedom,
    _score_at,
    change_with_open_form,
    estimates,
    intervals,
    pattern_factor,
    recovered,
    standard_errors,
    understated,
    with_open_form,
    with_pattern_error,
)
from tribo.diagnostics.model import FIXED, OF_PATTERNS, Acting, Setup, candidates
from tribo.mechanisms import MECHANISMS

from . import known
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
    """Rims that adhere less leave no room for suction: the best value is zero, but some suction is possible."""
    f = fitted("suction", ("edge_adhesion", -1.0))
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
    low, high = intervals(moved, 0)[0]
    at_least, at_most = intervals(with_pattern_error(moved, 1.0), 0)[0]
    assert (high - low < at_most - at_least) == (factor < 1)


def test_the_scale_of_the_pattern_error_is_recovered() -> None:
    """Three patterns, both regimes, off by four times the stated error: the factor is within a third of four."""
    assert pattern_factor(off_by(4.0)) == pytest.approx(4.0, rel=0.34)
    assert pattern_factor(off_by(0.5)) < 1.0


def off_by(factor: float, *, alike: bool = False) -> ModelFit:
    """Off by a factor on the stated error of each regime, or by the same as in static friction in both."""
    f = fitted("edge_adhesion", ("edge_adhesion", 1.0))
    o = f.setup.observations
    off = sum(
        sign
        * factor
        * np.array(f.setup.predictor.error[sample].offset)[[0, 0] if alike else [0, 1]]
        * (o.conditions.sample == sample)[:, None]
        for sample, sign in (("A", 1), ("B", -1), ("C", 1))
    )
    return fit(replace(f.setup, observations=replace(o, log_force=o.log_force + off)), f.acting)


def test_patterns_that_are_off_by_the_same_factor_in_both_regimes_have_a_larger_error_in_common() -> None:
    f = off_by(1.25, alike=True)
    common, *own = f.noise.sizes[list(OF_PATTERNS)]
    assert common > 2 * max(own)
    assert pattern_factor(f) > 1.5


def test_an_averaged_interval_keeps_to_the_bounds() -> None:
    f = fitted("suction", ("normal_load_error", -0.4))
    value, low, high = recovered(f, 0)[0]
    assert low == 0.0 <= value < high


def test_an_interval_averaged_over_the_pattern_error_has_the_variance_of_the_mixture() -> None:
    """Normal distributions (1, 0.2) with a quarter and (2, 0.5) with three quarters of the weight."""
    weight, mean, sd = np.array([0.25, 0.75]), np.array([1.0, 2.0]), np.array([0.2, 0.5])
    ends = np.column_stack([mean - 1.645 * sd, mean + 1.645 * sd])
    value, low, high = _averaged(weight, mean, ends, 1.0, (-9.0, 9.0))
    variance = 0.25 * (0.2**2 + 0.75**2) + 0.75 * (0.5**2 + 0.25**2)
    assert value == 1.75
    assert (low, high) == pytest.approx((1.75 - 1.645 * variance**0.5, 1.75 + 1.645 * variance**0.5))
    assert _averaged(weight, mean, ends, 1.0, (1.5, 1.9)) == (1.75, 1.5, 1.9)
    twice = 0.25 * (0.4**2 + 0.75**2) + 0.75 * (1.0**2 + 0.25**2)  # what the values differ by is not widened
    assert _averaged(weight, mean, ends, 2.0, (-9.0, 9.0))[1] == pytest.approx(1.75 - 1.645 * twice**0.5)
    wider = ends + np.array([[0.0, 0.0], [0.0, 1.0]])  # the upper end of the second alone lies further out
    assert _averaged(weight, mean, wider, 1.0, (-9.0, 9.0))[1] == pytest.approx(low)
    assert _averaged(weight, mean, wider, 1.0, (-9.0, 9.0))[2] > high


def test_a_standard_error_is_that_of_the_curvature_under_the_expected_information_of_the_t() -> None:
    """(tail + 4) / (tail + 2) times the variance, of the parameter behind the four of the law."""
    f = fitted("run_in", ("run_in", 1.0))
    tail = f.noise.tail
    for k, error in enumerate(standard_errors(f, 0)):
        assert error**2 == pytest.approx(f.covariance[4 + k, 4 + k] * (tail + 4) / (tail + 2))
    assert len(standard_errors(f, 0)) == len(f.values[0]) > 1


def test_the_freedom_of_a_fit_is_half_the_log_determinant_of_law_and_mechanisms() -> None:
    f = fitted("run_in", ("run_in", 1.0))
    p = 4 + len(f.values[0])
    assert _log_freedom(f) == pytest.approx(0.5 * np.linalg.slogdet(f.covariance[:p, :p])[1])


def test_a_pattern_error_that_is_held_is_no_longer_estimated() -> None:
    f = fitted("temperature", ("temperature", 1.0))
    held, here = with_pattern_error(f, 2.5), f.setup.of_patterns
    sizes = f.noise.sizes[f.setup.group[here]] / pattern_factor(f)
    assert held.setup.unit[here] == pytest.approx(2.5 * sizes * f.setup.unit[here])
    assert np.array_equal(held.setup.unit[~here], f.setup.unit[~here])
    assert (held.setup.group[here] == FIXED).all()
    assert np.array_equal(held.setup.group[~here], f.setup.group[~here])
    assert held.acting == f.acting


def test_without_patterns_there_is_nothing_to_average_over() -> None:
    f = fitted("temperature", ("temperature", 1.0))
    flat = fit(with_pattern_error(f, 1.0).setup, f.acting)
    assert recovered(flat, 0)[0] == pytest.approx((flat.values[0][0], *intervals(flat, 0)[0]))


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


OF_HOLDS = Design(samples=("F", "A", "B", "Sx"), repeats=1, holds_s=(1.0, 5.0, 25.0, 120.0, 600.0))
AGEING = 0.07  # per unit of ln(1 + hold / 1 s)


def aged(seed: int, off: float) -> ModelFit:
    """Contact ageing whose change of ln T is off by a share of itself, in proportion to the logarithm of the hold about
    a mean of zero, so that the amplitude that fits the change best stays."""

    def change(s: Setup) -> np.ndarray:
        right, x = known.acting("contact_ageing", AGEING)(s), np.log(s.observations.conditions.hold_s)
        weight = np.sum(right**2, axis=1)
        x = x - np.average(x, weights=weight)
        return right * (1 + off * x / np.sqrt(np.average(x**2, weights=weight)))[:, None]

    b = known.baseline(known.made(change, seed, OF_HOLDS, (0.03, 0.03)))
    return fit(b.setup, (Acting(MECHANISMS["contact_ageing"]),), start=b)


def test_the_interval_of_a_formula_that_is_nearly_right_holds_the_size() -> None:
    """Off by 12 %, up or down, four campaigns each: of the intervals for a right formula none holds it."""
    as_right, open_form = [], []
    for seed in range(4):
        for off in (-0.12, 0.12):
            f = aged(seed, off)
            for held, found in ((as_right, estimates(f, 0)), (open_form, with_open_form(f, 0))):
                (e,) = found.values()
                held.append(e.low <= AGEING <= e.high)
    assert not any(as_right)
    assert sum(open_form) >= 6


def test_what_an_interval_widens_by_it_widens_by_on_both_sides_in_proportion(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(inference, "recovered", lambda *_: [(0.060, 0.058, 0.080)])
    f = aged(0, 0.12)
    (wider,) = with_open_form(f, 0).values()
    assert wider.high - wider.low > 1.1 * 0.022
    assert (wider.value - wider.low) / (wider.high - wider.value) == pytest.approx(0.002 / 0.020)


def test_the_change_that_one_parameter_makes_is_as_uncertain_as_that_parameter() -> None:
    f = aged(1, 0.12)
    (e,) = with_open_form(f, 0).values()
    value, low, high = change_with_open_form(f, 0, lambda values: float(2.0 * values[0]))
    assert value == pytest.approx(2.0 * e.value, rel=0.02)
    assert high - low == pytest.approx(2.0 * (e.high - e.low), rel=0.1)


def test_where_the_formula_is_right_the_campaign_says_so() -> None:
    """Five holds tell the course: the interval is wider by less than two thirds, and it holds the size."""
    for seed in range(4):
        f = aged(seed, 0.0)
        ((as_right,), (open_form,)) = (found.values() for found in (estimates(f, 0), with_open_form(f, 0)))
        assert open_form.high - open_form.low < 5 / 3 * (as_right.high - as_right.low)
        assert open_form.low <= AGEING <= open_form.high
