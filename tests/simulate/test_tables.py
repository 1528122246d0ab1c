"""The Table 2 command on a small design, and its fits on friction of known law."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from tribo.simulate import SimConfig, table2
from tribo.simulate.tables import beside, distance, fitted, study


def runs_of(law: dict[str, tuple[float, float]]) -> pd.DataFrame:
    rows = [
        {"sample": s, "pressure_Pa": p, "static_friction": mu + tau / p, "sliding_friction": 0.5 * (mu + tau / p)}
        for s, (mu, tau) in law.items()
        for p in (3e3, 10e3, 25e3)
        for _ in range(3)
    ]
    return pd.DataFrame(rows)


@pytest.mark.parametrize("weights", ["ratio", "force"])
def test_fit_returns_the_law_of_the_runs(weights: str):
    """Runs that obey T = mu N + tau0 A exactly give it back under either weight, without uncertainty."""
    table = fitted(runs_of({"F": (4.8, 23e3), "A": (4.1, 17e3)}), weights)
    static = table[table["regime"] == "static"].set_index("sample")
    assert static.loc["A", "mu"] == pytest.approx(4.1)
    assert static.loc["F", "tau0_kPa"] == pytest.approx(23.0)
    assert table["mu_se"].max() < 1e-9


def test_deviations_are_against_the_published_simulation():
    """Twice the published number is a deviation of 100 percent; the experiment's rows are left out."""
    published = pd.DataFrame(
        [
            {"sample": "F", "regime": r, "source": s, "mu": m, "tau0_kPa": 10.0}
            for r in ("static", "sliding")
            for s, m in (("experiment", 9.0), ("simulation", 2.0))
        ]
    )
    table = beside(fitted(runs_of({"F": (4.0, 10e3)})), published)
    static = table[table["regime"] == "static"].iloc[0]
    assert static["mu_deviation_percent"] == pytest.approx(100.0)
    assert static["tau0_deviation_percent"] == pytest.approx(0.0, abs=1e-6)
    assert len(table) == 2
    assert distance(table)["mu_deviation_percent"] > 0


def test_table2_and_study_run_what_they_are_asked():
    """Each sample in both regimes, one block of rows a variant; a variant changes what it says."""
    base = SimConfig(blocks=(21, 21), dt_s=1e-7, rest_tolerance=1e-2, duration_peaks=1.5)
    small = {"repeats": 2, "pressures_Pa": (5e3, 20e3), "samples": ("F", "B")}
    table = table2(base, **small)
    assert list(table["sample"] + table["regime"]) == ["Fstatic", "Fsliding", "Bstatic", "Bsliding"]
    published = table.assign(source="simulation")
    both = study(published, {"same": {}, "half": {"shear_factor": 0.5}}, base, **small)
    same = both[both["variant"] == "same"]
    assert np.allclose(same["mu_deviation_percent"], 0.0)
    half = both[both["variant"] == "half"].set_index(["sample", "regime"])
    assert half.loc[("B", "static"), "friction_deviation_percent"] < -0.5
    assert abs(half.loc[("F", "static"), "friction_deviation_percent"]) < 0.2
