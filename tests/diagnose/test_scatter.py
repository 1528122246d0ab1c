"""The sizes of all that scatters are estimated, and what they allow is no misfit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from blind.patterns import ErrorSize
from blind.tribometer import Design
from support import first_quick

from tribo.diagnostics import examine
from tribo.diagnostics.contrasts import screen
from tribo.diagnostics.fit import ModelFit, fit
from tribo.diagnostics.inference import pattern_factor
from tribo.diagnostics.model import SLOPE, setup
from tribo.diagnostics.observations import observe
from tribo.diagnostics.predictor import tabled_predictor
from tribo.diagnostics.replicates import drawn_residuals, refits

from .known import contrasts_of
from .synthetic import PATTERNS, SMALL, hidden

LARGE = Design(samples=("F", "A", "B", "C"), specimens=6)


def baseline(seed: int, design: Design) -> ModelFit:
    o = observe(hidden(seed=seed, design=design))
    return fit(setup(o, tabled_predictor(o.patterns)))


def off(pattern_error: float, **changes: object) -> Design:
    """A design whose patterns are off by so many times what the diagnosis assumes."""
    p = tabled_predictor(PATTERNS)
    sizes = {s: ErrorSize(e.offset, e.slope, e.curve) for s, e in p.error.items() if s != "F"}
    return replace(SMALL, pattern_error=pattern_error, error_sizes=sizes, **changes)  # type: ignore[arg-type]


def test_the_slopes_of_specimens_are_recovered_within_a_third() -> None:
    found = [baseline(seed, replace(LARGE, specimen_slope=0.06)).noise.sizes[SLOPE : SLOPE + 2] for seed in (1, 2, 3)]
    assert np.sqrt(np.mean(np.square(found))) == pytest.approx(0.06, rel=0.33)
    without = [baseline(seed, LARGE).noise.sizes[SLOPE : SLOPE + 2] for seed in (1, 2, 3)]
    assert np.sqrt(np.mean(np.square(without))) < 0.025


@pytest.mark.parametrize("seed", first_quick([1, 2, 3, 4]))
def test_specimens_with_slopes_of_5_percent_are_no_misfit(seed: int) -> None:
    v = examine(hidden(seed=seed, design=replace(SMALL, specimen_slope=0.05)), replicates=(40, 20)).verdict
    assert v.verdict == "no_misfit"


def test_the_slope_of_a_specimen_is_judged_against_those_of_the_others() -> None:
    """Slopes of 10 % per e-fold: no contrast of one specimen by load is beyond four standard deviations."""
    f = baseline(5, replace(LARGE, specimen_slope=0.10))
    contrasts = [contrast for contrast in contrasts_of(f) if contrast.detail == "by load"]
    assert screen(f, contrasts, replicates=0, rng=np.random.default_rng(0)).strength.max() < 4.0


def test_the_scale_of_the_pattern_error_is_recovered_within_a_third() -> None:
    """Geometric mean over eight campaigns of four patterns whose errors are three times those assumed."""
    six = off(3.0, samples=("F", "A", "B", "C", "Sx", "Sy"))
    found = [pattern_factor(baseline(seed, six)) for seed in range(8)]
    assert np.exp(np.mean(np.log(found))) == pytest.approx(3.0, rel=0.33)


@pytest.mark.parametrize("seed", first_quick([11, 12, 13]))
def test_patterns_off_by_three_times_what_is_assumed_are_given_no_cause(seed: int) -> None:
    v = examine(hidden(seed=seed, design=off(3.0)), replicates=(40, 20)).verdict
    assert v.causes == ()


def test_repeats_that_are_constant_in_newtons_are_recognised() -> None:
    """Their relative size falls as one over the force; where they are relative, it does not."""
    constant = baseline(3, replace(LARGE, noise="absolute")).noise.scatter
    relative = baseline(3, LARGE).noise.scatter
    assert constant is not None
    assert relative is not None
    assert constant[-1] == pytest.approx(-1.0, abs=0.35)
    assert relative[-1] == pytest.approx(0.0, abs=0.35)


def test_the_repeats_of_a_sample_that_scatters_three_times_as_much_are_told_from_the_rest() -> None:
    ingested = hidden(seed=3, design=LARGE)
    rng = np.random.default_rng(8)
    wide = {t.test_id: np.exp(0.25 * rng.normal(size=2)) for t in ingested.campaign.tests if t.sample == "B"}
    pulls = {
        k: replace(p, static_N=p.static_N * wide[k][0], sliding_N=p.sliding_N * wide[k][1]) if k in wide else p
        for k, p in ingested.pulls.items()
    }
    o = observe(replace(ingested, pulls=pulls))
    f = fit(setup(o, tabled_predictor(o.patterns)))
    sd = np.sqrt(np.linalg.det(f.noise.per_test(f.setup))) ** 0.5
    here = o.conditions.sample == "B"
    assert sd[here].mean() / sd[~here].mean() == pytest.approx(3.3, rel=0.25)


def test_simulated_campaigns_scatter_as_much_as_the_fit_says() -> None:
    """The variance of the drawn residuals of a test is that of its repeats, its specimen and its pattern."""
    f = baseline(4, replace(SMALL, repeats=3))
    drawn = drawn_residuals(f, np.random.default_rng(1), 2000)
    sd = 1.0 / np.sqrt(precision(f))
    effects = np.einsum("nrq,q->nr", f.setup.dense**2, sd**2)
    repeats = np.einsum("nrr->nr", f.noise.per_test(f.setup)) + f.setup.observations.reading**2
    assert np.mean(np.var(drawn, axis=0).T / (effects + repeats)) == pytest.approx(1.08, abs=0.12)


def precision(f: ModelFit) -> np.ndarray:
    return f.precision


def test_sizes_are_estimated_anew_in_every_simulated_campaign() -> None:
    """Replicates of a campaign with slopes of 8 % and patterns off by three times: sizes scatter about the fit's."""
    f = baseline(7, off(3.0, specimen_slope=0.08, specimens=8, samples=("F", "A", "B", "C", "Sx", "Sy")))
    sizes = refits(f, drawn_residuals(f, np.random.default_rng(2), 60))[0][2]
    assert np.exp(np.mean(np.log(sizes), axis=0)) == pytest.approx(f.noise.sizes, rel=0.25)
    assert np.all(np.std(np.log(sizes), axis=0) > 0.05)
