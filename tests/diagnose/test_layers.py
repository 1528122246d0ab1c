"""The layers of a verdict: corrections of patterns, causes beside each other, and what follows no law."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from blind.direct import ingested
from blind.tribometer import Design, hide
from laboratories.campaign import make
from laboratories.effects import hide_effect
from laboratories.handed_over import handed_over
from laboratories.laboratory import drawn_laboratory
from scipy.stats import norm

from tribo.diagnostics import examine
from tribo.diagnostics.diagnosis import Diagnosis
from tribo.diagnostics.fit import fit
from tribo.diagnostics.inference import pattern_corrections
from tribo.diagnostics.model import Setup, predict, setup
from tribo.diagnostics.observations import observe
from tribo.diagnostics.predictor import tabled_predictor
from tribo.wording.verdict_sentences import worded

from .examined import Once, examined
from .known import acting, made

FEW = (60, 25)
EXACT = {"repeat_sd": (1e-6, 1e-6), "specimen_sd": 1e-9}
QUIET = {"repeat_sd": (0.004, 0.004), "specimen_sd": 0.003}
SHORT = Design(samples=("F", "B", "Sx"), repeats=2)
FOUR = Design(samples=("F", "A", "B", "C", "Sx"), masses_g=(5.0, 25.0, 90.0, 138.5), pattern_error=1.5)


def three_effects(s: Setup) -> np.ndarray:
    """Tilt, running-in and the temperature, each of a size that is found alone."""
    return acting("tilt", 0.035)(s) + acting("run_in", 0.6, 6.0)(s) + acting("temperature", 0.05)(s)


def wave(s: Setup) -> np.ndarray:
    """A course over the series that no mechanism has: six turns of a sine."""
    order = s.observations.conditions.run_order
    return 0.25 * np.sin(2 * np.pi * 6 * order / order.max())[:, None] * np.ones(2)


def with_running_in(s: Setup) -> np.ndarray:
    return wave(s) + acting("run_in", 0.8, 6.0)(s)


@pytest.fixture(scope="module")
def beside() -> Diagnosis:
    two = Design(samples=("F", "B"), masses_g=(5.0, 25.0, 90.0, 138.5), repeats=3)
    return examine(made(with_running_in, seed=3, design=two), replicates=(40, 20))


@pytest.mark.slow
def test_three_causes_at_once_are_all_named() -> None:
    v = examine(made(three_effects, seed=1), replicates=FEW).verdict
    assert {c.mechanism for c in v.causes} >= {"tilt", "run_in", "temperature"}
    assert {layer.name for layer in v.layers if layer.kind == "cause"} == {"tilt", "run_in", "temperature"}


def test_a_cause_whose_formula_is_off_along_the_load_has_no_wrong_weight_beside_it() -> None:
    """A hidden suction whose change of ln T is off by a smooth course of the load, 12 % of itself in the mean."""
    seed = 986586287
    hidden = make(seed, drawn_laboratory(seed), hide=hide_effect("suction", 1.4115, off=0.12))
    v = examine(handed_over(hidden.bench, seed), seed=seed, replicates=FEW).verdict
    assert [c.mechanism for c in v.causes] == ["suction"]


def test_a_cause_that_follows_a_recorded_column_is_told_from_its_lowest_to_its_highest_recorded_value() -> None:
    ladder = Design(samples=("F", "A", "B"), masses_g=(12.0, 50.0, 138.5), speeds_mm_s=(0.05, 0.2, 0.8))

    def faster_slides_harder(s: Setup) -> np.ndarray:
        return 0.08 * np.log(s.observations.conditions.speed_m_s)[:, None] * np.array([0.0, 1.0])

    v = worded(examine(made(faster_slides_harder, seed=3, design=ladder), replicates=FEW).verdict)
    (layer,) = [layer for layer in v.layers if layer.kind == "cause"]
    assert layer.over is not None
    assert layer.over["column"] == "speed_m_s"
    assert (layer.over["from"], layer.over["to"]) == pytest.approx((5e-5, 8e-4))
    assert layer.over["low"] < 100 * (16**0.08 - 1) < layer.over["high"]
    assert "as the pull speed rises from 0.05 to 0.8 mm/s" in v.sentence
    assert "up to" not in v.sentence


def test_a_run_in_that_outlasts_the_pulls_is_told_by_what_they_show_of_it() -> None:
    """Of a run-in over as many pulls as were made, neither the size nor the number of pulls is known by itself."""
    hidden, shown = hide(404, [("run_in", 1.5)], SHORT), hide(404, [], SHORT)
    change = np.log(hidden.sliding / shown.sliding)
    run = hidden.tests["specimen_run"].to_numpy()
    truth = 100 * np.expm1(change[run == run.max()].mean() - change[run == run.min()].mean())
    (layer,) = [x for x in examine(ingested(hidden, 404), replicates=(40, 20)).verdict.layers if x.kind == "cause"]
    assert layer.parameters["c"].high > 2.0
    assert layer.over is not None
    assert layer.over["low"] < truth < layer.over["high"] < 0.0
    assert layer.over["high"] - layer.over["low"] < 15.0


def test_a_cause_is_certain_although_something_without_a_law_is_left(beside: Diagnosis) -> None:
    v = beside.verdict
    assert v.verdict == "partly"
    assert [c.mechanism for c in v.causes] == ["run_in"]
    left = [layer for layer in v.layers if layer.kind == "remainder"]
    assert left
    assert left[0].name == "run_order"
    assert "A misfit remains beyond chance" in worded(v).text


def test_the_size_of_a_cause_beside_a_remainder_is_that_which_was_hidden(beside: Diagnosis) -> None:
    layer = next(layer for layer in beside.verdict.layers if layer.kind == "cause")
    assert layer.parameters["c"].low < 0.8 < layer.parameters["c"].high
    assert layer.p_adjusted < 0.01
    assert layer.gain is not None
    assert layer.gain.difference > 0


@pytest.mark.slow
def test_a_wave_alone_is_a_remainder_and_no_cause() -> None:
    v = examine(made(wave, seed=2), replicates=FEW).verdict
    assert v.verdict == "unknown"
    assert v.causes == ()
    assert [layer.name for layer in v.layers if layer.kind == "remainder"][:1] == ["run_order"]


def test_without_noise_the_corrections_are_the_errors_that_were_drawn() -> None:
    """How often the intervals hold the drawn error under noise is counted by benchmarks/pattern_corrections.py."""
    quiet, exact = hide(905, [], replace(FOUR, **QUIET)), hide(905, [], replace(FOUR, **EXACT))
    o = observe(ingested(quiet, 905))
    s = setup(o, tabled_predictor(o.patterns))
    order = [list(exact.tests.test_id).index(name) for name in o.test_ids]
    true = np.log(np.column_stack([exact.static, exact.sliding]))[order]
    wrong_by = true - predict(s, np.array(exact.law), (), ())
    found = pattern_corrections(fit(s))
    drawn = [
        100 * np.expm1(wrong_by[o.conditions.sample == c.name, ("static", "sliding").index(c.regimes[0])].mean())
        for c in found
    ]
    assert np.abs(drawn).max() > 10
    assert min(c.p_adjusted for c in found) < 0.01
    assert max(c.p_adjusted for c in found) == 1.0
    assert np.corrcoef([c.effect_percent for c in found], drawn)[0, 1] > 0.95
    assert [c.effect_percent for c in found] == pytest.approx(drawn, abs=4)  # specimens are expected to differ by 5 %


def test_every_patterned_sample_has_a_correction_in_each_regime_and_the_flat_one_has_none(once: Once) -> None:
    layers = examined("nothing", once).verdict.layers
    corrected = {(x.name, *x.regimes) for x in layers if x.kind == "pattern_correction"}
    assert corrected == {(name, regime) for name in "ABC" for regime in ("static", "sliding")}


def test_the_chance_of_a_correction_is_that_of_its_interval_times_the_number_of_corrections(once: Once) -> None:
    found = pattern_corrections(examined("nothing", once).baseline)
    assert len(found) == 6
    for c in found:
        assert c.low < c.effect_percent < c.high
        low, value, high = np.log1p(np.array([c.low, c.effect_percent, c.high]) / 100)
        assert high - value == pytest.approx(value - low)
        two_sided = 2 * norm.sf(abs(value) / ((high - low) / (2 * 1.645)))
        assert c.p_adjusted == pytest.approx(min(6 * two_sided, 1.0))
