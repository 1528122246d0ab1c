"""The extended model run in the simulator itself, for the tests of a campaign."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from tribo.diagnostics import examine, residual_table, with_simulation
from tribo.diagnostics.diagnosis import Diagnosis
from tribo.diagnostics.effect_sizes import rms_percent
from tribo.diagnostics.model import effect_of
from tribo.diagnostics.predictor import flat_law
from tribo.diagnostics.simulated_extension import (
    MOST_LOADS,
    local_friction,
    ratio_of_effects,
    representatives,
)
from tribo.springblock import SimConfig, simulate
from tribo.wording.verdict_sentences import worded

from .examined import Once, examined
from .synthetic import hidden

FEW = (40, 25)


@pytest.fixture(scope="module")
def hot() -> Diagnosis:
    """Temperature hidden in F and B; its effect is a gain on every block, which the simulator must give back."""
    from blind.tribometer import Design

    design = Design(samples=("F", "B"), masses_g=(5.0, 25.0, 90.0, 138.5), repeats=3)
    found = examine(hidden(("temperature", 1.5), design=design), replicates=FEW)
    return with_simulation(found)


def simulated(d: Diagnosis) -> tuple[np.ndarray, pd.DataFrame]:
    assert d.simulated_log_force is not None
    assert d.extended_runs is not None
    return d.simulated_log_force, d.extended_runs


def test_a_gain_on_every_block_is_the_gain_of_the_sample(hot: Diagnosis) -> None:
    log_force, table = simulated(hot)
    assert hot.named is not None
    assert [a.name for a in hot.named.model.acting] == ["temperature"]
    assert ratio_of_effects(table)[0] == pytest.approx(1.0, abs=0.02)
    off = table[["simulated_static", "simulated_sliding"]].to_numpy() - table[["quick_static", "quick_sliding"]]
    assert float(np.sqrt(np.mean(off.to_numpy() ** 2))) < 0.01
    assert log_force == pytest.approx(hot.named.model.predicted, abs=0.02)


def test_few_tests_are_simulated_and_the_most_moved_is_among_them(hot: Diagnosis) -> None:
    assert hot.named is not None
    model = hot.named.model
    quick = effect_of(model.setup, model.law, model.acting[-1], model.values[-1])
    picked = representatives(model, quick)
    assert len(picked) <= len(set(model.setup.observations.conditions.sample)) * MOST_LOADS
    assert np.abs(quick[picked]).max() == pytest.approx(np.abs(quick).max(), rel=0.05)


def test_the_verdict_says_what_was_simulated_and_whose_shares_it_used(hot: Diagnosis) -> None:
    v = worded(hot.verdict)
    assert "tabulated simulations" in v.text
    assert "in the simulator itself" in v.text
    model = v.as_dict()["model"]
    assert model["simulated"]["mechanisms"] == ["temperature"]
    before, quick, after = (model["simulated"][f"rms_percent_{name}"] for name in ("before", "law", "simulated"))
    left = hot.baseline.setup.observations.log_force - simulated(hot)[0]
    assert after == pytest.approx(rms_percent(left))
    assert after < before
    assert after == pytest.approx(quick, rel=0.05)


def test_the_residual_table_carries_the_simulated_force(hot: Diagnosis) -> None:
    rows = residual_table(hot)
    static = rows[rows["regime"] == "static"]
    assert np.log(static["simulated_N"]).to_numpy() == pytest.approx(simulated(hot)[0][:, 0])


def test_nothing_named_means_nothing_simulated(once: Once) -> None:
    d = with_simulation(examined("nothing", once))
    assert d.simulated_log_force is None
    assert d.extended_runs is None
    assert "simulated" not in d.verdict.as_dict()["model"]


def test_local_friction_gives_the_flat_law_it_was_made_for() -> None:
    """The same draws under another law: mu and tau0 of the flat sample scale as asked."""
    law = np.array([6.0, 15.0, 2.5, 14.0])
    base = SimConfig(pressure_Pa=8e3, blocks=(25, 25), dt_s=1e-7, seed=4)
    plain = [simulate(base.with_(pressure_Pa=p)).static_friction for p in (8e3, 16e3)]
    other = [simulate(base.with_(pressure_Pa=p, friction=local_friction(law))).static_friction for p in (8e3, 16e3)]

    def parts(low: float, high: float) -> tuple[float, float]:
        return 2 * high - low, (low - high) * 16e3

    (mu, tau0), (mu_other, tau0_other) = parts(*plain), parts(*other)
    assert mu_other / mu == pytest.approx(6.0 / flat_law()[0], rel=1e-3)
    assert tau0_other / tau0 == pytest.approx(15.0 / flat_law()[1], rel=1e-3)


def test_a_diagnosis_with_its_simulation_can_be_kept_and_read_back(hot: Diagnosis) -> None:
    import json

    from tribo.kept_results import decoded, encoded

    again = decoded(json.loads(json.dumps(encoded(hot))))
    assert again.verdict.to_json() == hot.verdict.to_json()
    assert simulated(again)[1].equals(simulated(hot)[1])


def test_a_simulation_that_fails_is_reported_with_its_reason(hot: Diagnosis, monkeypatch: pytest.MonkeyPatch) -> None:
    from tribo.diagnostics import simulated_extension
    from tribo.errors import Problem, SimulationError

    def fails(*args: object) -> None:
        raise SimulationError(Problem("not_finite", "the force is not finite"))

    monkeypatch.setattr(simulated_extension, "simulate_pair", fails)
    d = with_simulation(replace(hot, simulated_log_force=None, extended_runs=None))
    assert d.simulated_log_force is None
    assert d.verdict.as_dict()["model"]["not_simulated"] == {
        "mechanisms": ["temperature"],
        "reason": "the force is not finite",
    }
    assert "was not simulated: the force is not finite." in worded(d.verdict).text
