"""The flat law of the practice campaigns lies in the intervals of the fit to the forces behind the traces."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest

from tribo.fitting import fit_samples, fit_three_term
from tribo.records import LawFit, Regime

AREA = 55e-6
EVERY = [(number, regime) for number in ("01", "02", "03", "04") for regime in ("static", "sliding")]


@pytest.fixture(scope="module")
def forces(shared: Path, practice: Callable[[str], Path]) -> Callable[[str], pd.DataFrame]:
    def read(number: str) -> pd.DataFrame:
        tests = pd.read_csv(practice(number) / "tests.csv")
        return tests.merge(pd.read_csv(shared / "campaigns" / f"series-{number}.truth.csv"), on="test_id")

    return read


def flat(table: pd.DataFrame, regime: Regime) -> LawFit:
    return next(fit for fit in fit_samples(table, regime, AREA) if fit.sample == "F")


@pytest.mark.parametrize(("number", "regime"), EVERY)
def test_the_flat_law_lies_within_the_99_percent_intervals(
    shared: Path, forces: Callable[[str], pd.DataFrame], number: str, regime: Regime
) -> None:
    law = json.loads((shared / "campaigns" / "known.json").read_text())[f"series-{number}"]["law"]
    fit = flat(forces(number), regime)
    end = {"static": "s", "sliding": "d"}[regime]
    low, high = fit.interval("mu", 0.99)
    assert low < law[f"mu_{end}"] < high
    low, high = fit.interval("tau0_Pa", 0.99)
    assert low < 1e3 * law[f"tau_{end}"] < high


def test_pressure_dependent_friction_bends_the_flat_sliding_law_and_the_fit_says_so(
    forces: Callable[[str], pd.DataFrame],
) -> None:
    assert any("bend" in note for note in flat(forces("03"), "sliding").notes)
    assert not flat(forces("01"), "sliding").notes


def test_specimens_pulled_along_x_and_y_are_counted_once_in_the_three_term_law(
    forces: Callable[[str], pd.DataFrame],
) -> None:
    fractions = {"F": 1.0, "A": 0.951, "B": 0.651, "C": 0.558, "Sx": 0.697, "Sy": 0.697}
    fit = fit_three_term(forces("01"), "static", AREA, fractions)
    assert fit.n_specimens == 15
    assert fit.n_tests == 324
    assert fit.value("a_Pa") > 0
