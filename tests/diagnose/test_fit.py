"""The model of a campaign recovers what a campaign was made with."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from blind.tribometer import Design, hide

from tribo.diagnostics.fit import ModelFit, fit
from tribo.diagnostics.model import GAIN, Acting, predict, setup
from tribo.diagnostics.observations import observe
from tribo.diagnostics.predictor import tabled_predictor
from tribo.mechanisms import MECHANISMS

from .synthetic import PATTERNS, SMALL, hidden


def fitted(effects: tuple[tuple[str, float], ...] = (), acting: tuple[Acting, ...] = (), seed: int = 3) -> ModelFit:
    o = observe(hidden(*effects, seed=seed))
    return fit(setup(o, tabled_predictor(o.patterns)), acting)


def test_the_flat_law_is_recovered_within_four_standard_errors() -> None:
    truth = hide(3, [], SMALL).law
    f = fitted()
    error = np.sqrt(np.diag(f.covariance))[:4]
    assert np.all(np.abs(f.law - truth) < 4 * error)


def test_the_sizes_of_the_noise_are_recovered_within_a_quarter() -> None:
    o = observe(hidden(seed=5, design=Design(specimens=6)))
    f = fit(setup(o, tabled_predictor(o.patterns)))
    assert np.sqrt(np.diag(f.noise.repeat)) == pytest.approx([0.09, 0.07], rel=0.25)
    assert f.noise.sizes[GAIN : GAIN + 2] == pytest.approx([0.05, 0.05], rel=0.4)


def test_heavy_tails_do_not_move_the_law() -> None:
    """Ten percent of wild static peaks change the flat law by less than a standard error."""
    ingested = hidden(seed=4)
    o = observe(ingested)
    wild = o.log_force.copy()
    wild[::10, 0] += 0.6
    p = tabled_predictor(o.patterns)
    clean, spoiled = fit(setup(o, p)), fit(setup(replace(o, log_force=wild), p))
    error = np.sqrt(np.diag(clean.covariance))[:4]
    assert np.all(np.abs(spoiled.law - clean.law) < 1.5 * error)


def test_a_hidden_pressure_under_the_cavities_is_recovered() -> None:
    f = fitted((("suction", 1.0),), (Acting(MECHANISMS["suction"]),))
    error = float(np.sqrt(f.covariance[4, 4]))
    assert f.values[0][0] == pytest.approx(5000.0, abs=4 * error)
    assert error < 1500.0


def test_derivatives_of_the_fit_are_those_of_the_prediction() -> None:
    f = fitted((("suction", 1.0),), (Acting(MECHANISMS["suction"]),))
    analytic = f.jacobian[:, :, 4]
    up = predict(f.setup, f.law, f.acting, (f.values[0] + 5.0,))
    down = predict(f.setup, f.law, f.acting, (f.values[0] - 5.0,))
    assert analytic == pytest.approx((up - down) / 10.0, rel=1e-3, abs=1e-9)


def test_a_mechanism_without_amplitude_predicts_the_baseline_to_the_bit() -> None:
    f = fitted()
    for name, m in MECHANISMS.items():
        if name in ("velocity_dependence", "contact_ageing", "bulk_viscoelasticity") or m.regimes == ("rise",):
            continue
        choice = m.choices(f.setup.base(f.law), f.setup.observations.conditions)[0]
        with_it = predict(f.setup, f.law, (Acting(m, choice),), (m.zero(),))
        assert np.array_equal(with_it, predict(f.setup, f.law, (), ()))


def test_a_pattern_that_was_never_simulated_lies_between_its_neighbours_and_is_less_certain() -> None:
    from tribo.records import Pattern

    new = Pattern("D", "circle", (12e-6, 12e-6), (18e-6, 18e-6))
    p = tabled_predictor({**PATTERNS, "D": new})
    assert p.shares["C"][1] < p.shares["D"][1] < p.shares["A"][1]
    assert p.error["D"].offset[0] > p.error["B"].offset[0] > p.error["F"].offset[0] == 0.0
