"""What the model makes of a pattern: the table of simulations, and an ensemble of one's own."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from tribo.diagnose.statistics.predictor import FLAT_LAW, OFFSET, Predictor, simulated_predictor, tabled_predictor
from tribo.published import load_table2_simulated_anew

from .synthetic import PATTERNS

AREA_M2 = 55e-6
LOADS_N = np.array([0.06, 0.25, 0.6, 1.4])


def own_runs() -> pd.DataFrame:
    """An ensemble as this engine gives it: the forces of its own Table 2 at four loads."""
    rows = []
    for sample, part in load_table2_simulated_anew().groupby("sample"):
        laws = part.set_index("regime")
        forces = {
            f"{regime}_N": laws.loc[regime, "mu"] * LOADS_N + laws.loc[regime, "tau0_kPa"] * 1e3 * AREA_M2
            for regime in ("static", "sliding")
        }
        rows.append(pd.DataFrame({"sample": sample, "normal_load_N": LOADS_N, **forces}))
    return pd.concat(rows, ignore_index=True)


def log_force(p: Predictor, sample: str) -> np.ndarray:
    """ln T of both regimes at the loads under the flat law of the table."""
    m = np.array(p.shares[sample]) * np.array(FLAT_LAW)
    kPa = 1e3 * AREA_M2
    return np.log([m[0] * LOADS_N + m[1] * kPa, m[2] * LOADS_N + m[3] * kPa])


@pytest.mark.parametrize("sample", ["A", "B", "C", "Sx", "Sy"])
def test_own_ensemble_and_table_agree_within_the_error_that_a_pattern_carries(sample: str) -> None:
    """Both codes run the baseline: the table's stated error of a pattern, one standard deviation, covers them."""
    own, table = simulated_predictor(PATTERNS, own_runs(), "F", AREA_M2), tabled_predictor(PATTERNS)
    off = np.abs(log_force(own, sample) - log_force(table, sample)).max(axis=1)
    assert (off < np.array(OFFSET)).all()


def test_shares_of_an_ensemble_are_those_its_forces_were_made_with() -> None:
    p = simulated_predictor(PATTERNS, own_runs(), "F", AREA_M2)
    laws = load_table2_simulated_anew().set_index(["sample", "regime"])[["mu", "tau0_kPa"]]
    expected = (laws.loc["C"] / laws.loc["F"]).loc[["static", "sliding"]].to_numpy().ravel()
    assert p.shares["C"] == pytest.approx(expected)
    assert p.shares["F"] == pytest.approx((1, 1, 1, 1))
    assert p.source == "an ensemble simulated for this campaign"


def test_a_sample_without_enough_loads_is_taken_from_the_table_and_said_so() -> None:
    runs = own_runs()
    some = runs[(runs["sample"] != "C") | (runs["normal_load_N"] < 0.1)]
    p = simulated_predictor(PATTERNS, some, "F", AREA_M2)
    assert p.shares["C"] == tabled_predictor(PATTERNS).shares["C"]
    assert "without C" in p.source
    assert simulated_predictor(PATTERNS, runs[runs["sample"] != "F"], "F", AREA_M2).source == "tabulated simulations"


def test_a_pattern_of_ones_own_is_trusted_as_a_tabulated_one_once_it_is_simulated() -> None:
    from dataclasses import replace

    wide = replace(PATTERNS["C"], name="W", pitch_m=(27e-6, 27e-6))
    runs = own_runs()
    simulated = pd.concat([runs, runs[runs["sample"] == "C"].assign(sample="W")])
    patterns = {**PATTERNS, "W": wide}
    assert tabled_predictor(patterns).offset["W"][0] > OFFSET[0]
    assert simulated_predictor(patterns, simulated, "F", AREA_M2).offset["W"] == pytest.approx(OFFSET)
