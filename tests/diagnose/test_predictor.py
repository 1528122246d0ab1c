"""What the model makes of a pattern: the bundled table of simulations, and an ensemble of one's own."""

from __future__ import annotations

import ast
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tribo.diagnostics import predictor as module, predictor as pattern_table
from tribo.diagnostics.predictor import (
    NO_ERROR,
    Predictor,
    error_sizes,
    flat_law,
    simulated_patterns,
    simulated_predictor,
    tabled_predictor,
)
from tribo.files import data_dir
from tribo.records import Pattern

from .synthetic import PATTERNS

AREA_M2 = 55e-6
LOADS_N = np.array([0.06, 0.25, 0.6, 1.4])
LAWS = pd.read_csv(data_dir() / "pattern_shares" / "laws.csv", comment="#").set_index(["sample", "regime"])
RUNS = pd.read_csv(data_dir() / "pattern_shares" / "runs.csv", comment="#")
TOTAL = error_sizes()["total"]


def own_runs() -> pd.DataFrame:
    """An ensemble of a campaign's own: forces on the laws of the table at four loads."""
    rows = []
    for sample, part in LAWS.groupby("sample"):
        laws = part.droplevel("sample")
        forces = {
            f"{regime}_N": laws.loc[regime, "mu"] * LOADS_N + laws.loc[regime, "tau0_kPa"] * 1e3 * AREA_M2
            for regime in ("static", "sliding")
        }
        rows.append(pd.DataFrame({"sample": sample, "normal_load_N": LOADS_N, **forces}))
    return pd.concat(rows, ignore_index=True)


def some_runs() -> pd.DataFrame:
    """A small ensemble as ``tribo compare`` leaves one: four runs of the table at each of three pressures."""
    runs = RUNS[RUNS["pressure_Pa"].isin([3e3, 11e3, 25e3])].groupby(["sample", "pressure_Pa"]).nth([2, 7, 12, 17])
    load = runs["pressure_Pa"] * AREA_M2
    return pd.DataFrame({
        "sample": runs["sample"], "normal_load_N": load,
        "static_N": runs["static_friction"] * load, "sliding_N": runs["sliding_friction"] * load,
    })  # fmt: skip


def log_force(p: Predictor, sample: str) -> np.ndarray:
    """ln T of both regimes at the loads under the flat law of the table."""
    m = np.array(p.shares[sample]) * np.array(flat_law())
    kPa = 1e3 * AREA_M2
    return np.log([m[0] * LOADS_N + m[1] * kPa, m[2] * LOADS_N + m[3] * kPa])


@pytest.mark.parametrize("sample", ["A", "B", "C", "Sx", "Sy"])
def test_the_shares_used_are_those_of_the_file(sample: str) -> None:
    rows = LAWS.loc[sample]
    in_file = [rows.loc[regime, name] for regime in ("static", "sliding") for name in ("mu_share", "tau0_share")]
    assert tabled_predictor(PATTERNS).shares[sample] == tuple(in_file)


def test_the_flat_law_is_that_of_the_file() -> None:
    rows = LAWS.loc["F"]
    assert flat_law() == tuple(rows.loc[r, name] for r in ("static", "sliding") for name in ("mu", "tau0_kPa"))


def test_the_directions_of_a_pattern_are_kept_apart() -> None:
    """tau0 of S along its cavities is larger than across them."""
    shares = tabled_predictor(PATTERNS).shares
    assert shares["Sx"][1] > 1.1 * shares["Sy"][1]


@pytest.mark.parametrize("sample", ["A", "B", "C", "Sx", "Sy"])
def test_a_small_ensemble_and_the_table_agree_within_the_error_that_a_pattern_carries(sample: str) -> None:
    own, table = simulated_predictor(PATTERNS, some_runs(), "F", AREA_M2), tabled_predictor(PATTERNS)
    off = np.abs(log_force(own, sample) - log_force(table, sample)).max(axis=1)
    assert off.max() > 0.0
    assert (off < np.array(TOTAL.offset)).all()


def test_shares_of_an_ensemble_are_those_its_forces_were_made_with() -> None:
    p = simulated_predictor(PATTERNS, own_runs(), "F", AREA_M2)
    laws = LAWS[["mu", "tau0_kPa"]]
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
    wide = replace(PATTERNS["C"], name="W", pitch_m=(27e-6, 27e-6))
    runs = own_runs()
    simulated = pd.concat([runs, runs[runs["sample"] == "C"].assign(sample="W")])
    patterns = {**PATTERNS, "W": wide}
    interpolation = error_sizes()["interpolation"]
    table, own = tabled_predictor(patterns), simulated_predictor(patterns, simulated, "F", AREA_M2)
    assert table.error["W"].offset == pytest.approx(np.hypot(TOTAL.offset, interpolation.offset))
    assert table.error["W"].slope == pytest.approx(np.hypot(TOTAL.slope, interpolation.slope))
    assert table.error["W"].curve == pytest.approx(np.hypot(TOTAL.curve, interpolation.curve))
    assert own.error["W"] == TOTAL


def test_a_flat_sample_carries_no_error_and_a_tabulated_pattern_that_of_the_file() -> None:
    p = tabled_predictor(PATTERNS)
    assert p.error["F"] == NO_ERROR
    assert p.error["B"] == TOTAL


def test_lengths_may_differ_from_the_table_by_two_percent_and_no_more() -> None:
    def shares_at(factor: float) -> tuple[float, ...]:
        b = PATTERNS["B"]
        assert b.size_m is not None
        return tabled_predictor({"b": replace(b, size_m=(b.size_m[0] * factor, b.size_m[1] * factor))}).shares["b"]

    assert shares_at(1.01) == shares_at(1.0)
    assert shares_at(1.03) != shares_at(1.0)


def test_a_pattern_with_less_contact_than_any_simulated_keeps_the_efficiency_of_the_last() -> None:
    """C has the smallest area fraction: mu's share is held, and tau0's share falls with the contact area."""
    sparse = Pattern("D", "circle", (18e-6, 18e-6), (20e-6, 20e-6))
    c, d = PATTERNS["C"], tabled_predictor({"D": sparse}).shares["D"]
    of_c = tabled_predictor(PATTERNS).shares["C"]
    less = sparse.area_fraction / c.area_fraction
    assert less < 1.0
    assert d == pytest.approx((of_c[0], of_c[1] * less, of_c[2], of_c[3] * less))


def test_a_pattern_known_by_its_area_fraction_alone_is_interpolated() -> None:
    p = tabled_predictor({"Q": Pattern("Q", "rectangle", measured_area_fraction=0.8)})
    assert p.shares["Q"][1] < 1.0
    assert p.error["Q"].offset[0] > TOTAL.offset[0]


def test_the_error_of_the_model_is_scaled_as_a_whole_and_nothing_else() -> None:
    p = tabled_predictor(PATTERNS)
    double = p.scaled(2.0)
    for sample, error in p.error.items():
        for size in ("offset", "slope", "curve"):
            assert getattr(double.error[sample], size) == tuple(2 * v for v in getattr(error, size))
    assert double.shares == p.shares
    with pytest.raises(ValueError, match="allowed is a factor of 0 or more"):
        p.scaled(-1.0)


@pytest.mark.parametrize("source", [module, pattern_table], ids=["predictor", "pattern_table"])
def test_no_table_of_numbers_stands_in_the_code(source: object) -> None:
    """Shares, laws and error sizes come from the files: the code holds 0, 1 and the two tolerances it names."""
    tree = ast.parse(Path(source.__file__).read_text(encoding="utf-8"))
    numbers = {n.value for n in ast.walk(tree) if isinstance(n, ast.Constant) and isinstance(n.value, float)}
    assert numbers <= {0.0, 1.0, 0.5, 1e-6, module.LEAST_SPREAD, module.ALIKE}


def test_every_simulated_pattern_is_one_of_the_paper() -> None:
    assert list(simulated_patterns()) == ["A", "B", "C", "Sx", "Sy"]
    for sample, (pattern, _) in simulated_patterns().items():
        assert pattern.area_fraction == pytest.approx(PATTERNS[sample].area_fraction)
        assert pattern.staggered == PATTERNS[sample].staggered
