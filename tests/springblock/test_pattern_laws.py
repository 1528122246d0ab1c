"""The bundled table of pattern shares can be made again: single runs by the engine, laws and shares from the runs."""

from __future__ import annotations

import sys
from pathlib import Path

import pandas as pd
import pytest

from tribo.berardo2019.published_tables import table2_design
from tribo.files import data_dir
from tribo.springblock import simulate

sys.path.append(str(Path(__file__).resolve().parents[2] / "benchmarks"))
from pattern_laws import origin, pattern_laws, write_table

FOLDER = data_dir() / "pattern_shares"
RUNS = pd.read_csv(FOLDER / "runs.csv", comment="#")
LAWS = pd.read_csv(FOLDER / "laws.csv", comment="#", keep_default_na=False, na_values=[""])


def said(name: str) -> dict[str, str]:
    """What the first lines of a file say of it."""
    lines = [line for line in (FOLDER / name).read_text(encoding="utf-8").splitlines() if line.startswith("# ")]
    return dict(line[2:].split(": ", 1) for line in lines)


@pytest.mark.parametrize(("sample", "pressure_Pa", "repeat"), [("F", 8e3, 3), ("C", 17.5e3, 11), ("Sy", 5e3, 0)])
def test_a_run_of_the_table_is_made_again_by_the_engine(sample: str, pressure_Pa: float, repeat: int) -> None:
    """Within what two engines differ by (docs/simulator.md); another step, pattern or stiffness shows more."""
    design = [c for c in table2_design() if (c.sample, c.pressure_Pa) == (sample, pressure_Pa)]
    kept = RUNS[(RUNS["sample"] == sample) & (RUNS["pressure_Pa"] == pressure_Pa)].iloc[repeat]
    run = simulate(design[repeat])
    assert (run.seed, run.angle_deg) == (kept["seed"], pytest.approx(kept["angle_deg"]))
    assert run.static_friction == pytest.approx(kept["static_friction"], rel=1e-3)
    assert run.sliding_friction == pytest.approx(kept["sliding_friction"], rel=3e-3)


def test_laws_and_shares_are_those_of_the_runs_to_the_printed_digits() -> None:
    made = pattern_laws(RUNS)
    numbers = made.select_dtypes("number").columns
    assert list(made.columns) == list(LAWS.columns)
    assert made["sample"].tolist() == LAWS["sample"].tolist()
    assert made["direction"].tolist() == LAWS["direction"].fillna("").tolist()
    for name in numbers:
        assert LAWS[name].to_numpy() == pytest.approx(made[name].to_numpy(float), rel=2e-5, nan_ok=True), name


def test_a_share_has_the_relative_errors_of_both_its_laws() -> None:
    b = LAWS[(LAWS["sample"] == "B") & (LAWS["regime"] == "static")].iloc[0]
    f = LAWS[(LAWS["sample"] == "F") & (LAWS["regime"] == "static")].iloc[0]
    assert b["tau0_share"] == pytest.approx(b["tau0_kPa"] / f["tau0_kPa"], rel=1e-5)
    relative = ((b["tau0_kPa_se"] / b["tau0_kPa"]) ** 2 + (f["tau0_kPa_se"] / f["tau0_kPa"]) ** 2) ** 0.5
    assert b["tau0_share_se"] == pytest.approx(b["tau0_share"] * relative, rel=1e-4)
    assert (f["mu_share"], f["mu_share_se"]) == (1.0, 0.0)


@pytest.mark.parametrize("name", ["runs.csv", "laws.csv"])
def test_the_files_say_how_they_were_made(name: str) -> None:
    """Runs, seed, step, pressures, angles and rules are those of the design; versions are those of the day."""
    words = said(name)
    expected = origin(table2_design(), 0, "")
    changing = {"versions", "sources"}
    assert {k: v for k, v in words.items() if k not in {*changing, "made by"}} == {
        k: v for k, v in expected.items() if k not in changing
    }
    assert words["runs"].startswith(f"{len(RUNS)}, 20 at each")
    assert words["versions"].startswith("tribo ")
    assert len(words["sources"].removeprefix("sha256 ")) == 64


def test_a_table_is_read_back_behind_the_lines_that_describe_it(tmp_path: Path) -> None:
    path = write_table(pd.DataFrame({"a": [1.5], "b": ["x"]}), tmp_path / "t.csv", {"made by": "hand", "seed": "3"})
    assert path.read_text().splitlines() == ["# made by: hand", "# seed: 3", "a,b", "1.5,x"]
