"""Friction terms: exact values, the baseline to the bit at zero amplitude, and what they do to a run."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tribo.errors import SimulationError
from tribo.springblock import FrictionTerms, SimConfig, simulate
from tribo.springblock.engines.state import packed, sliding_threshold, static_threshold

SMALL = SimConfig(blocks=(30, 30), seed=4, angle_deg=20.0, duration_peaks=1.5)


def test_ageing_is_logarithmic_in_the_time_at_rest():
    """b = 0.05 over t = t0 (e - 1) adds five percent; at t = 0 nothing."""
    law = packed(FrictionTerms(ageing_b=0.05, ageing_t0_s=2.0))
    assert static_threshold(1e-6, 2.0 * (math.e - 1), law) == pytest.approx(1.05e-6)
    assert static_threshold(1e-6, 0.0, law) == 1e-6


def test_speed_dependence_is_logarithmic_in_the_slip_speed():
    """a = -0.1 at v = v0 (e - 1) takes ten percent; friction never turns negative."""
    law = packed(FrictionTerms(speed_a=-0.1, speed_v0_m_s=1e-3))
    assert sliding_threshold(1e-6, 1e-3 * (math.e - 1), law) == pytest.approx(0.9e-6)
    assert sliding_threshold(1e-6, 1e30, law) == 0.0


@pytest.mark.parametrize("engine", ["fast", "dense"])
@pytest.mark.parametrize("sample", ["F", "C"])
def test_terms_without_amplitude_are_the_baseline_to_the_bit(sample: str, engine: str):
    """Other constants of a term do nothing while its amplitude is zero."""
    config = SMALL.with_(sample=sample, engine=engine)
    with_terms = config.with_(terms=FrictionTerms(ageing_t0_s=7.0, hold_s=100.0, speed_v0_m_s=3.0))
    assert np.array_equal(simulate(config).force_N, simulate(with_terms).force_N)


def test_hold_raises_static_friction_and_leaves_sliding_friction_of_fresh_contacts():
    """Held t0 (e - 1) times longer than the run, the flat sample lets go b higher."""
    terms = FrictionTerms(ageing_b=0.04, ageing_t0_s=100.0, hold_s=100.0 * (math.e - 1))
    plain, held = simulate(SMALL), simulate(SMALL.with_(terms=terms))
    assert held.static_friction == pytest.approx(1.04 * plain.static_friction, rel=1e-3)
    assert held.sliding_friction == pytest.approx(plain.sliding_friction, rel=0.05)


@pytest.mark.parametrize("terms", [FrictionTerms(ageing_b=0.02), FrictionTerms(speed_a=0.02)])
def test_moving_blocks_alone_give_what_all_blocks_give_with_terms(terms: FrictionTerms):
    """The two loops know the same law."""
    config = SMALL.with_(terms=terms, duration_peaks=1.06, dt_s=2e-8)
    fast, dense = simulate(config), simulate(config.with_(engine="dense"))
    assert fast.static_friction == pytest.approx(dense.static_friction, rel=1e-6)
    assert np.abs(fast.force_N - dense.force_N).max() < 1e-6 * dense.force_N.max()


def test_friction_that_grows_with_speed_raises_the_sliding_force():
    """And friction that falls with it lowers it."""
    means = [simulate(SMALL.with_(terms=FrictionTerms(speed_a=a))).sliding_friction for a in (-0.03, 0.0, 0.03)]
    assert means[0] < means[1] < means[2]


def test_impossible_terms_are_refused():
    """Negative ageing, a time constant of zero, and the reference engine, which has no terms."""
    terms = FrictionTerms(ageing_b=-1.0, ageing_t0_s=0.0, speed_a=0.1)
    with pytest.raises(SimulationError) as refused:
        SMALL.with_(terms=terms, engine="reference").check()
    assert {p.column for p in refused.value.problems} == {"ageing_b", "ageing_t0_s", "engine"}
