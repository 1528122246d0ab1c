"""The sizes of the model's own error: how a case is split and cases are pooled, and that the bundled file is theirs."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tribo.diagnostics.predictor import error_sizes, simulated_patterns
from tribo.files import data_dir
from tribo.records import Pattern

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT / "docs" / "data"
FLAT = np.array([5.0, 20e3])
sys.path.append(str(ROOT / "benchmarks"))

import pattern_error as e  # noqa: E402


def fits(scale: float = 1.0, of_b: float = 1.0) -> list[tuple[str, float, float]]:
    """Laws of F and B, all times ``scale`` and those of B times ``of_b``."""
    return [("F", 5.0 * scale, 20.0 * scale), ("B", 4.0 * scale * of_b, 10.0 * scale * of_b)]


def study(cases: dict[str, list[tuple[str, float, float]]]) -> pd.DataFrame:
    """A study whose variants have these laws, static alone under every peak rule."""
    return pd.DataFrame([
        {"variant": v, "regime": regime, "reading": reading, "weights": "ratio", "sample": s, "mu": mu, "tau0_kPa": t}
        for v, laws in cases.items()
        for regime, (_, reading) in e.OWN_READING.items()
        for s, mu, t in laws
    ])  # fmt: skip


def test_offset_slope_and_curve_of_a_known_change_are_found() -> None:
    x = np.log(e.LEVELS_PA / np.sqrt(e.LEVELS_PA[0] * e.LEVELS_PA[-1]))
    change = 0.05 - 0.02 * x + 0.01 * (x**2 - np.mean(x**2))
    assert e.split(change) == pytest.approx([0.05, -0.02, 0.01])


def test_a_share_of_mu_alone_acts_at_high_pressure() -> None:
    """With mu 1 % larger T is 1 % larger times the part of mu in it, 5 p of 5 p + 20 kPa."""
    change = e.change_of_force(np.array([1.01, 1.0]), np.ones(2), FLAT)
    assert change == pytest.approx(np.log(1 + 0.01 * 5 * e.LEVELS_PA / (5 * e.LEVELS_PA + 20e3)))


def test_a_reading_that_moves_all_samples_alike_is_no_error_of_a_pattern() -> None:
    """The flat law is fitted to the campaign, and the pattern's share stays."""
    cases = list(e.of_readings(study({"baseline": fits(), "softer": fits(scale=1.2)})))
    assert len(cases) == 4
    assert [c[name] for c in cases for name in e.SHAPES] == pytest.approx([0.0] * 12, abs=1e-12)


def test_the_size_is_the_root_of_the_mean_square_over_cases_with_the_table_s_own_among_them() -> None:
    cases = [*e.of_readings(study({"baseline": fits(), "softer": fits(of_b=1.1)}))]
    found = e.sizes([*cases, *of_interpolation()]).set_index(["source", "regime"])
    assert found.loc[("readings", "static"), "offset"] == pytest.approx(np.log(1.1) / np.sqrt(2))
    assert found.loc[("readings", "static"), "cases"] == 2


def test_squares_of_the_sources_add_but_interpolation_stands_apart() -> None:
    one = {"regime": "static", "case": "x", "sample": "B", "slope": 0.0, "curve": 0.0}
    found = e.sizes([
        one | {"source": "mesh", "offset": 0.03}, one | {"source": "readings", "offset": 0.04},
        one | {"source": "interpolation", "offset": 0.5},
    ]).set_index("source")["offset"]  # fmt: skip
    assert found["total"] == pytest.approx(0.05)
    assert found["interpolation"] == pytest.approx(0.5)


def of_interpolation() -> list[e.Case]:
    return list(e.of_interpolation(simulated_patterns(), np.array([5.0, 20.0, 3.0, 11.0])))


def test_a_reading_that_breaks_the_balance_of_normal_forces_is_left_out() -> None:
    table = study({"baseline": fits(), "p l2 on every block": fits(of_b=0.5)})
    assert {c["case"] for c in e.of_readings(table)} == {f"baseline, {rule}" for _, rule in e.OWN_READING.values()}


def test_no_direction_of_a_pattern_helps_to_interpolate_the_other() -> None:
    """S along x is predicted from A, B, C and the flat sample: that Sy is twice as large changes nothing."""
    table = simulated_patterns()
    pattern, shares = table["Sy"]
    static_mu, static_tau0, sliding_mu, sliding_tau0 = (2 * v for v in shares)
    doubled = {**table, "Sy": (pattern, (static_mu, static_tau0, sliding_mu, sliding_tau0))}
    flat = np.array([5.0, 20.0, 3.0, 11.0])
    before, after = ({c["sample"]: c["offset"] for c in e.of_interpolation(t, flat)} for t in (table, doubled))
    assert before["Sx"] == after["Sx"]
    assert before["Sy"] != after["Sy"]
    assert before["A"] != after["A"]  # whose neighbours S is


def test_a_pattern_like_one_of_the_table_but_for_its_name_is_interpolated_to_it() -> None:
    """At the area fraction of B the interpolation is B."""
    b, shares = simulated_patterns()["B"]
    plain = Pattern("new", "circle", (20e-6, 20e-6), (30e-6, 30e-6))
    assert plain.area_fraction == pytest.approx(b.area_fraction)
    assert e.interpolated_shares(plain.area_fraction, simulated_patterns().values()) == pytest.approx(shares)


def test_the_bundled_sizes_are_made_again_from_their_sources_to_the_printed_digits() -> None:
    import pattern_shares

    folder = data_dir() / "pattern_shares"
    made = e.sizes(pattern_shares.cases(DATA, folder))
    bundled = pd.read_csv(folder / "errors.csv", comment="#")
    assert made.drop(columns=list(e.SHAPES)).equals(bundled.drop(columns=list(e.SHAPES)))
    for name in e.SHAPES:
        assert [f"{v:.4g}" for v in made[name]] == [f"{v:.4g}" for v in bundled[name]], name


def test_the_bundled_sizes_are_those_the_predictor_loads() -> None:
    bundled = pd.read_csv(data_dir() / "pattern_shares" / "errors.csv", comment="#").set_index(["source", "regime"])
    for source, size in error_sizes().items():
        rows = bundled.loc[source]
        assert size.offset == (rows.loc["static", "offset"], rows.loc["sliding", "offset"])
        assert size.slope == (rows.loc["static", "slope"], rows.loc["sliding", "slope"])
        assert size.curve == (rows.loc["static", "curve"], rows.loc["sliding", "curve"])
