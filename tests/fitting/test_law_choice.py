"""The law of a sample is chosen by loads it was not fitted to; what T/N varies with, and what is inseparable."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import scipy.stats
from scipy.stats import rankdata, spearmanr

from tribo.fitting.alternatives import CANDIDATES, compared_laws, dependence, fit_candidate, force_N
from tribo.fitting.linear import levels_of, meant_to_be_one
from tribo.records import Campaign, Ingested, Pattern, Pull, Test

LOADS = np.repeat([1.0, 2.0, 4.0, 8.0, 16.0, 32.0], 3)
TRUE = {
    "constant": lambda n: 0.9 + 0 * n,
    "proportional": lambda n: 0.6 * n,
    "hertz": lambda n: 1.2 * n ** (2 / 3),
    "linear": lambda n: 0.3 * n + 2.0,
    "power": lambda n: 1.3 * n**0.8,
}


def table(force_N: np.ndarray, load_N: np.ndarray = LOADS) -> pd.DataFrame:
    ids = [f"T{k}" for k in range(load_N.size)]
    named = {"test_id": ids, "sample": "S", "specimen": "S1"}
    return pd.DataFrame({**named, "normal_load_N": load_N, "static_N": math.nan, "sliding_N": force_N})


@pytest.mark.parametrize("law", TRUE)
@pytest.mark.parametrize("seed", range(4))
def test_the_law_that_made_the_forces_is_chosen(law: str, seed: int) -> None:
    scatter = np.exp(0.02 * np.random.default_rng(seed).standard_normal(LOADS.size))
    found = compared_laws(table(TRUE[law](LOADS) * scatter))
    (chosen,) = found[found["chosen"]].to_dict("records")
    assert chosen["law"] == law
    assert chosen["held_out_percent"] < 5


def test_the_exponent_of_a_power_law_is_found_with_its_uncertainty() -> None:
    scatter = np.exp(0.03 * np.random.default_rng(9).standard_normal(LOADS.size))
    found = compared_laws(table(1.3 * LOADS**0.75 * scatter)).set_index("law").loc["power"]
    assert abs(found["b"] - 0.75) < 3 * found["b_u"] < 0.1


def test_loads_that_were_meant_to_be_one_give_no_law() -> None:
    loads = 2.0 * (1 + 0.003 * np.random.default_rng(1).standard_normal(20))
    assert meant_to_be_one(loads)
    assert compared_laws(table(0.8 * loads, loads)).empty


def test_closely_spaced_loads_do_not_run_together_into_one_level() -> None:
    loads = np.arange(0.50, 0.71, 0.01)
    assert np.unique(levels_of(loads)).size >= 10
    assert np.unique(levels_of(np.array([1.0, 1.001, 0.999, 2.0]))).size == 2


def ingested(order: np.ndarray, load: np.ndarray, ratio: np.ndarray) -> Ingested:
    tests = tuple(
        Test(f"T{k}", f"raw/T{k}.csv", "S", float(n), "S1", run_order=int(o), covariates={"cycle": str(k % 7)})
        for k, (n, o) in enumerate(zip(load, order, strict=True))
    )
    pulls = {
        t.test_id: Pull(t.test_id, "given", math.nan, math.nan, float(r) * t.normal_load_N, 0.01, 0, 0, 0, 0, (0, 1))
        for t, r in zip(tests, ratio, strict=True)
    }
    return Ingested(Campaign("made", Path(), 1.0, tests, {"S": Pattern("S")}), {}, pulls, ())


def test_what_the_friction_varies_with_is_found_and_the_rest_is_not() -> None:
    rng = np.random.default_rng(5)
    order, load = rng.permutation(40), np.tile([1.0, 2.0, 4.0, 8.0], 10)
    found = dependence(ingested(order, load, 0.5 * np.exp(0.01 * order) * np.exp(0.01 * rng.standard_normal(40))))
    rows = found.set_index("variable")
    assert rows.loc["run_order", "p_adjusted"] < 1e-6
    assert rows.loc["run_order", "change_percent"] == pytest.approx(100 * (math.exp(0.39) - 1), rel=0.1)
    assert min(rows.loc["normal_load_N", "p_adjusted"], rows.loc["cycle", "p_adjusted"]) > 0.05


def test_load_and_run_order_that_rise_together_are_said_to_be_inseparable() -> None:
    load = np.linspace(1, 8, 30)
    rows = dependence(ingested(np.arange(30), load, 0.5 * load**-0.2)).set_index("variable")
    assert rows.loc["normal_load_N", "inseparable_from"] == ("run_order",)
    assert rows.loc["cycle", "inseparable_from"] == ()


def test_the_error_on_loads_left_out_is_known_to_about_a_third_with_six_levels() -> None:
    """A mean of six squares of normal errors scatters by the root of 2/6, its root by half of that: 29 %."""
    shares = []
    for seed in range(30):
        scatter = np.exp(0.05 * np.random.default_rng(seed).standard_normal(LOADS.size))
        found = compared_laws(table(0.6 * LOADS * scatter)).set_index("law").loc["proportional"]
        shares.append(found["se_percent"] / found["held_out_percent"])
    assert 0.15 < float(np.median(shares)) < 0.45


def test_the_force_of_a_law_by_its_name_is_that_of_its_fit() -> None:
    load = np.array([1.0, 2.0, 4.0, 8.0])
    force = np.array([1.1, 1.9, 3.2, 5.9])
    for law in CANDIDATES.values():
        values, _, force_at = fit_candidate(law, load, force)
        a, b = (*values, np.nan)[:2]
        np.testing.assert_allclose(force_N(law.name, a, b, load), force_at(load))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_columns_are_inseparable_where_ranks_correlate_over_five_tests_or_more_that_record_both(seed: int) -> None:
    rng = np.random.default_rng(seed)
    order, load = rng.permutation(20), np.tile([1.0, 2.0, 4.0, 8.0], 5)
    one = rng.standard_normal(20)
    columns = {f"c{k}": rng.choice([-1, 1]) * one + rng.choice([0.05, 0.3]) * rng.standard_normal(20) for k in range(8)}
    columns["rounded"] = np.round(one)
    for name in ("c1", "c2", "c3"):
        columns[name][rng.random(20) < 0.4] = np.nan
    made = ingested(order, load, np.full(20, 0.5) + 0.01 * rng.standard_normal(20))
    tests = tuple(
        replace(t, covariates={name: f"{values[k]}" for name, values in columns.items()})
        for k, t in enumerate(made.campaign.tests)
    )
    found = dependence(replace(made, campaign=replace(made.campaign, tests=tests))).set_index("variable")
    inseparable = 0
    for name, values in columns.items():
        for other in columns.keys() - {name}:
            both = np.isfinite(values) & np.isfinite(columns[other])
            expected = both.sum() >= 5 and abs(spearmanr(values[both], columns[other][both]).statistic) >= 0.95
            assert (other in found.loc[name, "inseparable_from"]) == expected
            inseparable += expected
    assert 0 < inseparable < 72


def test_ranks_of_columns_without_gaps_are_taken_once_and_not_for_every_pair(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(1)
    made = ingested(rng.permutation(20), np.tile([1.0, 2.0, 4.0, 8.0], 5), 0.5 + 0.01 * rng.standard_normal(20))
    tests = tuple(
        replace(t, covariates={f"c{k}": f"{rng.standard_normal()}" for k in range(30)}) for t in made.campaign.tests
    )
    times: list[int] = []
    monkeypatch.setattr(scipy.stats, "rankdata", lambda *a, **k: times.append(1) or rankdata(*a, **k))
    assert len(dependence(replace(made, campaign=replace(made.campaign, tests=tests)))) == 32
    assert len(times) == 1
