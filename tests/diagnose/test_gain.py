"""What a cause gains on tests that the fit has not seen: scores that are densities, and an error that is one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from blind.tribometer import Design
from scipy.stats import norm

from tribo.diagnostics.fit import fit
from tribo.diagnostics.inference import _folds, gain, gain_of_zero
from tribo.diagnostics.model import Acting, Setup
from tribo.diagnostics.observations import observe
from tribo.mechanisms import MECHANISMS

from .known import acting, baseline, made

FLAT = Design(samples=("F",), specimens=10, masses_g=(5.0, 25.0, 90.0, 138.5))
SPECIMEN_SD, REPEAT_SD = 0.25, 0.03


@pytest.mark.slow
def test_specimens_left_out_score_as_the_density_they_were_drawn_from() -> None:
    """A new specimen differs by 25 % from the last, its repeats by 3 %; the density has to allow for both."""

    def specimens_apart(s: Setup) -> np.ndarray:
        names, code = np.unique(s.observations.conditions.specimen, return_inverse=True)
        return np.random.default_rng(seed).normal(size=(len(names), 2))[code] * SPECIMEN_SD

    scores = []
    for seed in range(4):
        f = baseline(made(specimens_apart, seed, FLAT, (REPEAT_SD, REPEAT_SD)))
        found = gain(f, f, np.random.default_rng(0))
        assert found is not None
        assert found.held_out == "specimens"
        scores.append(found.log_score_baseline)
    variance = SPECIMEN_SD**2 + REPEAT_SD**2
    expected = -np.log(2 * np.pi * variance) - 1.0  # two regimes, mean log density of a normal distribution in each
    assert np.mean(scores) == pytest.approx(expected, abs=0.5)


@pytest.mark.slow
def test_the_error_of_the_gain_is_its_spread_from_campaign_to_campaign() -> None:
    differences, errors = [], []
    for seed in range(10):
        before = baseline(made(acting("temperature", 0.05), seed, FLAT))
        after = fit(before.setup, (Acting(MECHANISMS["temperature"]),), start=before)
        found = gain(before, after, np.random.default_rng(seed))
        assert found is not None
        differences.append(found.difference)
        errors.append(found.se)
    assert min(differences) > 0
    assert 0.5 < np.sqrt(np.mean(np.square(errors))) / np.std(differences, ddof=1) < 2.0


def test_the_error_of_the_gain_of_a_zero_is_that_of_a_mean_over_specimens() -> None:
    """Every specimen has a gain of its own; the error of their mean is their standard deviation over root k."""
    o = observe(made(lambda s: np.zeros((s.observations.n, 2)), 0, FLAT))
    names, specimen = np.unique(o.conditions.specimen, return_inverse=True)
    rng = np.random.default_rng(1)
    zero = 0.01 + 0.002 * rng.normal(size=len(names))[specimen] + 0.002 * rng.normal(size=o.n)
    each = []
    for k in range(len(names)):
        here, rest = zero[specimen == k], zero[specimen != k]
        off, none = (norm(centre, np.sqrt(np.mean((rest - centre) ** 2))) for centre in (np.median(rest), 0.0))
        each.append(np.mean(off.logpdf(here) - none.logpdf(here)))
    found = gain_of_zero(replace(o, zero_N=zero), False, rng)
    assert found is not None
    assert found.difference == pytest.approx(np.mean(each), rel=1e-6)
    assert found.se == pytest.approx(np.std(each) / np.sqrt(len(each)), rel=0.15)


def test_what_is_left_out_are_loads_for_a_label_else_samples_where_there_are_four_else_specimens() -> None:
    four = baseline(made(lambda s: np.zeros((s.observations.n, 2)), 0)).setup
    c = four.observations.conditions
    suction, label = Acting(MECHANISMS["suction"]), Acting(MECHANISMS["mislabelled_specimen"], "x")
    kind, labels = _folds(four, (suction,))
    assert (kind, labels.tolist()) == ("samples", c.sample.tolist())
    kind, labels = _folds(four, (suction, label))
    assert kind == "loads"
    assert np.array_equal(labels.astype(float), c.normal_load_N.round(4))
    three = four.take(c.sample != "C")
    kind, labels = _folds(three, (suction,))
    assert (kind, labels.tolist()) == ("specimens", three.observations.conditions.specimen.tolist())


def test_the_gain_of_a_drift_is_that_of_a_line_over_a_load_cell_at_zero() -> None:
    """Each specimen is scored by the line through the others, with the scatter of the others about it."""
    o = observe(made(lambda s: np.zeros((s.observations.n, 2)), 0, FLAT))
    hours = o.conditions.elapsed_s / 3600.0
    zero = 0.004 * hours + 0.002 * np.random.default_rng(1).normal(size=o.n)
    zero[5] = np.nan
    known, specimen = np.isfinite(zero), o.conditions.specimen
    before, after, off = [], [], []
    for name in np.unique(specimen):
        here, rest = known & (specimen == name), known & (specimen != name)
        line = np.polyfit(hours[rest], zero[rest], 1)
        for found, centre in ((before, np.zeros_like(zero)), (after, np.polyval(line, hours))):
            spread = np.sqrt(np.mean((zero - centre)[rest] ** 2))
            found += list(norm(0.0, spread).logpdf((zero - centre)[here]))
        off += list((zero - np.polyval(line, hours))[here])
    found = gain_of_zero(replace(o, zero_N=zero), True, np.random.default_rng(0))
    assert found is not None
    assert (found.log_score_baseline, found.log_score_extended) == pytest.approx((np.mean(before), np.mean(after)))
    assert found.difference == pytest.approx(np.mean(after) - np.mean(before))
    force = np.exp(np.median(o.log_force[:, 1]))
    assert found.rmse_percent_before == pytest.approx(100 * np.sqrt(np.nanmean(zero**2)) / force)
    assert found.rmse_percent_after == pytest.approx(100 * np.sqrt(np.mean(np.square(off))) / force)
    assert found.held_out == "specimens"
    one = o.take(specimen == specimen[0])
    assert gain_of_zero(one, False, np.random.default_rng(0)) is None


def test_of_tests_that_a_cause_can_say_nothing_about_it_says_what_the_model_says_without_it() -> None:
    """The temperature varies on one specimen alone: without it, nothing is known of its effect."""
    f = baseline(made(lambda s: np.zeros((s.observations.n, 2)), 1, FLAT))
    c = f.setup.observations.conditions
    own = c.specimen == c.specimen[0]
    warm = np.where(own & (c.normal_load_N > np.median(c.normal_load_N)), 30.0, 20.0)
    observations = replace(f.setup.observations, conditions=replace(c, temperature_C=warm))
    setup = replace(f.setup, observations=observations)
    before = fit(setup, (), start=f)
    after = fit(setup, (Acting(MECHANISMS["temperature"]),), start=before)
    found, same = gain(before, after, np.random.default_rng(0)), gain(before, before, np.random.default_rng(0))
    assert found is not None
    assert same is not None
    assert found.difference == pytest.approx(0.0, abs=0.05)
    assert found.rmse_percent_before == pytest.approx(same.rmse_percent_after)


def test_what_is_left_out_is_scored_with_the_uncertainty_of_its_own_reading() -> None:
    """Forces read to 30 % and repeated to 3 %: the density has to allow for both."""
    rng, read_sd = np.random.default_rng(2), 0.3
    begun = baseline(made(lambda s: read_sd * rng.normal(size=(s.observations.n, 2)), 0, FLAT, (REPEAT_SD, REPEAT_SD)))
    o = begun.setup.observations
    f = fit(replace(begun.setup, observations=replace(o, reading=np.full((o.n, 2), read_sd))), (), start=begun)
    found = gain(f, f, np.random.default_rng(0))
    assert found is not None
    expected = -np.log(2 * np.pi * (read_sd**2 + REPEAT_SD**2)) - 1.0
    assert found.log_score_baseline == pytest.approx(expected, abs=0.3)
