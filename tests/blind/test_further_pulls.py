"""What the virtual tribometer adds for wrong patterns and for tests that are made later."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from .patterns import engine_ratio
from .scatter import specimen_gains
from .tribometer import Bench, Design, hide, with_further

EXACT = Design(samples=("F", "B"), repeats=1, repeat_sd=(1e-9, 1e-9), specimen_slope=0.03, pattern_error=0.0)
SUCTION = [("suction", 1.5)]


def test_half_way_is_the_geometric_mean_of_engine_and_measurement() -> None:
    shares = (0.43, 1.06, 0.7, 0.5)
    design = replace(EXACT, specimen_sd=1e-12, specimen_slope=0.0, measured_shares={"B": shares})
    engine, half_way = hide(3, [], replace(design, measured_shares={})), hide(3, [], design)
    here = engine.column("sample") == "B"
    load = engine.column("N")[here]
    mu, tau = engine.law[0] * load, engine.law[1] * 55e-3
    measured = shares[0] * mu + shares[1] * tau
    assert half_way.static[here] == pytest.approx(np.sqrt(engine.static[here] * measured), rel=1e-6)
    assert half_way.static[~here] == pytest.approx(engine.static[~here], rel=1e-6)
    ratio = engine_ratio(["B"] * here.sum(), load / 55.0 * 1e6)[:, 0]
    assert engine.static[here] == pytest.approx(ratio * (mu + tau), rel=1e-6)


def test_further_pulls_are_those_of_the_same_specimens() -> None:
    bench = hide(5, SUCTION, EXACT)
    again = with_further(bench, bench.tests[:7], 5, SUCTION, EXACT)
    assert again.static[-7:] == pytest.approx(bench.static[:7], rel=1e-6)
    assert again.static[:-7] == pytest.approx(bench.static)
    assert again.tests["run_order"].tolist() == list(range(1, len(again.tests) + 1))
    assert again.tests["test_id"].is_unique
    assert not again.tests.duplicated(["specimen", "specimen_run"]).any()


def test_an_effect_that_was_removed_for_a_pull_does_not_act_on_it() -> None:
    bench, free = hide(5, SUCTION, EXACT), hide(5, [], EXACT)
    again = with_further(bench, bench.tests.assign(without="suction"), 5, SUCTION, EXACT)
    n = len(bench.tests)
    assert again.static[n:] == pytest.approx(free.static, rel=1e-6)
    assert np.max(bench.static / free.static) > 1.1


def test_specimens_keep_their_draws_where_only_some_are_pulled_again() -> None:
    bench = hide(6, [], EXACT)
    gains = specimen_gains(bench, EXACT, np.random.default_rng(2))
    few = Bench(bench.tests[::5].reset_index(drop=True), bench.law, bench.errors)
    assert specimen_gains(few, EXACT, np.random.default_rng(2), bench) == pytest.approx(gains[::5])
