"""The numerical column of Table 2 on a small design, and its fits on friction of known law."""

from __future__ import annotations

import pandas as pd
import pytest

from tribo.berardo2019.published_tables import beside, distance, table2, table2_design, table2_text
from tribo.springblock import SimConfig
from tribo.springblock.calibration import fitted


def runs_of(law: dict[str, tuple[float, float]]) -> pd.DataFrame:
    rows = [
        {"sample": s, "pressure_Pa": p, "static_friction": mu + tau / p, "sliding_friction": 0.5 * (mu + tau / p)}
        for s, (mu, tau) in law.items()
        for p in (3e3, 10e3, 25e3)
        for _ in range(3)
    ]
    return pd.DataFrame(rows)


@pytest.mark.parametrize("weights", ["ratio", "force", "relative"])
def test_fit_returns_the_law_of_the_runs(weights: str):
    """Runs that obey T = mu N + tau0 A exactly give it back under every weight, without uncertainty."""
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


def test_table2_runs_what_it_is_asked():
    """Each sample in both regimes, all runs counted, and the text holds every number with its deviation."""
    base = SimConfig(blocks=(21, 21), dt_s=1e-7, rest_tolerance=1e-2, duration_peaks=1.5)
    table = table2(table2_design(base, repeats=2, pressures_Pa=(5e3, 20e3), samples=("F", "B")))
    assert list(table["sample"] + table["regime"]) == ["Fstatic", "Fsliding", "Bstatic", "Bsliding"]
    assert set(table["runs"]) == {4}
    published = table.assign(source="simulation", mu=table["mu"] / 1.25)
    lines = table2_text(beside(table, published)).splitlines()
    assert [" ".join(line.split()[:2]) for line in lines[1:5]] == ["F static", "F sliding", "B static", "B sliding"]
    assert all("+25.0" in line for line in lines[1:5])
    assert "mu 25.0 %" in lines[5]


def test_the_whole_column_is_960_runs_over_the_range_of_the_paper():
    """Six samples, eight pressures from 3 to 25 kPa, twenty runs to three peak times, no seed twice."""
    design = table2_design()
    assert len(design) == len({c.seed for c in design}) == 960
    assert (min(c.pressure_Pa for c in design), max(c.pressure_Pa for c in design)) == (3e3, 25e3)
    assert {c.duration_peaks for c in design} == {3.0}
