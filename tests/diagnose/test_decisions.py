"""What decides on a verdict: each rule is held by a campaign that would be judged differently without it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tribo.diagnostics import candidates as naming, examine
from tribo.diagnostics.candidates import best_beyond_chance, weigh
from tribo.diagnostics.model import Setup
from tribo.diagnostics.score_statistics import start_effects
from tribo.wording.verdict_sentences import worded

from .known import acting, baseline, made

FEW = (60, 25)  # simulated campaigns that stand for chance


def steps(s: Setup) -> np.ndarray:
    """Twelve percent up for twelve tests, twelve percent down for the next twelve, and so on: no mechanism does it."""
    there = np.sin(2 * np.pi * s.observations.conditions.run_order / 24) > 0
    return np.where(there, 0.12, -0.12)[:, None] * np.ones(2)


def half_and_half(s: Setup) -> np.ndarray:
    """A little of the temperature and a little tilt of the specimens: either alone leaves no misfit beyond chance."""
    return acting("temperature", 0.022)(s) + acting("tilt", 0.012)(s)


def suction_that_varies(s: Setup) -> np.ndarray:
    """Suction whose effect is an eighth smaller or larger from one pattern to the next than its law says."""
    whole, sample = acting("suction", 25e3)(s), s.observations.conditions.sample
    for name, share in (("A", -0.12), ("B", 0.12), ("C", -0.12)):
        whole[sample == name] *= 1 + share
    return whole


def test_what_chance_would_give_a_mechanism_is_no_cause_however_certain_the_misfit() -> None:
    found = examine(made(steps, seed=0), replicates=FEW)
    assert found.verdict.verdict == "unknown"
    assert found.screened.p_adjusted() < 1e-4
    assert found.named is not None
    assert found.named.causes == ()


def test_a_mechanism_whose_own_column_is_still_wrong_is_left_out_and_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(naming, "_misfit_in_own_column", lambda cause, *_: cause.name == "humidity")
    verdict = examine(made(acting("humidity", 0.03), seed=0), replicates=FEW).verdict
    assert "humidity" not in [cause.mechanism for cause in verdict.causes]
    assert "Tried and left out: humidity." in worded(verdict).text


def test_of_the_mechanisms_weighed_only_one_beyond_chance_can_be_the_cause() -> None:
    """A swap among hundreds is stronger than chance makes any; pressure has no choices to pay for, but is within it."""
    found = examine(made(half_and_half, seed=2), replicates=FEW)
    assert found.named is not None
    candidate, chance = found.named.weighed[0], replace(found.screened, chance_library=np.linspace(2.0, 3.0, 100))
    pressure, swap = replace(candidate, gain=3.7, raw=3.7), replace(candidate, gain=2.4, raw=8.1)
    assert best_beyond_chance([pressure, swap], chance, 0.01) is swap
    assert best_beyond_chance([pressure], chance, 0.01) is None


def test_mechanisms_that_the_design_tells_apart_are_rivals_not_equivalent() -> None:
    """Two laws of different shape explain the campaign about equally well: the verdict stays open between them."""
    verdict = examine(made(half_and_half, seed=2), replicates=FEW).verdict
    assert verdict.verdict == "undetermined"
    assert {c.mechanism for c in verdict.causes} == {"temperature", "tilt"}
    assert not verdict.equivalent


def test_a_law_that_is_an_eighth_off_from_sample_to_sample_needs_no_second_cause() -> None:
    found = examine(made(suction_that_varies, seed=0, repeat_sd=(0.07, 0.05)), replicates=FEW)
    assert found.verdict.verdict == "named"
    assert found.named is not None
    assert len(found.named.causes) == 1
    assert "suction" in {c.name for c in found.named.causes[0]}


def test_a_further_parameter_has_to_earn_one_unit_of_log_likelihood() -> None:
    """Akaike 1974: what a parameter without any meaning earns on average is one unit."""
    start = baseline(made(lambda s: np.zeros((s.observations.n, 2)), seed=0))
    names = ("run_in", "edge_adhesion", "suction", "humidity")
    weighed = {c.name: c for c in weigh(start_effects(start)) if c.name in names}
    paid = {name: c.fit.score - start.score - c.raw for name, c in weighed.items()}
    further = {name: len(c.acting.mechanism.parameters) - 1 for name, c in weighed.items()}
    assert max(further.values()) >= 1
    assert min(further.values()) == 0
    assert paid == pytest.approx({name: float(k) for name, k in further.items()}, abs=1e-9)
