"""A report without the spring-block model: by choice, or because nothing is patterned; one load; no nominal area."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from support.campaigns import written

from tribo.cli import main

RATE = 50.0


def write(folder: Path, loads: tuple[float, ...], area: str = "") -> Path:
    """Twelve pulls of a flat sample and their runs; the seventh record slides from its first sample."""
    exports = {}
    rows = ["test_id,file,sample,specimen,normal_load_N,run_order"]
    for k in range(12):
        load = loads[k % len(loads)]
        level = 0.5 * load * (1 + 0.01 * (k // 4))
        rest = [np.zeros(100), np.linspace(0, 1.3 * level, 60)] if k != 6 else []
        force = np.concatenate([*rest, np.full(600, level)]) + 0.003 * np.random.default_rng(k).standard_normal(
            600 + sum(map(len, rest))
        )
        lines = (f"{t:.2f},{f:.5f}" for t, f in zip(np.arange(force.size) / RATE, force, strict=True))
        exports[f"T{k}.csv"] = "\n".join(["time [s],force [N]", *lines]) + "\n"
        rows.append(f"T{k},raw/T{k}.csv,F,F{k % 3},{load},{k}")
    toml = f'[campaign]\ntitle = "flat"\n{area}\n[patterns.F]\ncavity = "none"\n'
    return written(folder, toml, rows, exports)


def report(folder: Path, out: Path, *options: str) -> str:
    result = CliRunner().invoke(main, ["report", str(folder), "-o", str(out), "--jobs", "1", *options])
    assert result.exit_code == 0, result.output
    assert (out / "report.pdf").read_bytes().startswith(b"%PDF")
    return (out / "report.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_campaign_of_flat_samples_is_reported_without_the_model(tmp_path: Path) -> None:
    page = report(write(tmp_path / "c", (1.0, 2.0, 4.0, 8.0), "nominal_area_mm2 = 55.0"), tmp_path / "out")
    assert "Friction and what it varies with" in page
    laws = pd.read_csv(tmp_path / "out" / "laws.csv").set_index(["regime", "law"])
    assert laws.loc[("sliding", "proportional"), "chosen"]
    assert "is described best by" in page
    assert "No sample has a pattern" in page.replace("\u00a0", " ")
    assert "Weights" in page
    assert "Simulations per load" not in page
    assert {p.stem for p in (tmp_path / "out" / "figures").glob("*.svg")} >= {"dependence", "records", "forces"}
    assert not (tmp_path / "out" / "comparison.csv").exists()
    assert "sample on counterface" not in page
    rows = dict(re.findall(r'<th scope="row">([^<]*)</th><td>([^<]*)</td>', page))
    unsaid = ("Test geometry", "Motion", "Lubrication", "Counterface, material")
    assert [rows[name] for name in unsaid] == ["not recorded"] * 4


@pytest.mark.slow
def test_without_a_nominal_area_the_intercept_is_a_force(tmp_path: Path) -> None:
    page = report(write(tmp_path / "c", (1.0, 2.0, 4.0, 8.0)), tmp_path / "out")
    assert "T₀ (N)" in page
    assert "kPa" not in page.split('id="friction"')[1].split('id="pulls"')[0]
    fits = pd.read_csv(tmp_path / "out" / "fits.csv")
    assert fits["tau0_kPa"].isna().all()
    assert fits.set_index("regime").loc["sliding", "T0_N"] == pytest.approx(0.0, abs=0.1)


def test_one_load_has_no_law_over_load_but_what_it_varies_with(tmp_path: Path) -> None:
    page = report(write(tmp_path / "c", (2.0, 2.004, 1.997)), tmp_path / "out").replace("\u00a0", " ")
    assert not (tmp_path / "out" / "laws.csv").exists()
    assert "No friction law over load was fitted" in page
    drawn = {p.stem for p in (tmp_path / "out" / "figures").glob("*.svg")}
    assert not drawn & {"forces", "fig6", "fig7"}
    assert "What friction varies with" in page
    assert "1 load of 2.00 N" in page
    assert "Where the model fails" not in page
    found = pd.read_csv(tmp_path / "out" / "dependence.csv").set_index(["regime", "variable"])
    assert found.loc[("sliding", "run_order"), "p_adjusted"] < 0.01


@pytest.mark.slow
def test_the_model_is_left_out_by_choice(tmp_path: Path) -> None:
    folder = write(tmp_path / "c", (1.0, 2.0, 4.0, 8.0), "nominal_area_mm2 = 55.0")
    text = (folder / "campaign.toml").read_text()
    pattern = '[patterns.A]\ncavity = "circle"\ndiameter_um = 5.0\npitch_um = 20.0\n'
    (folder / "campaign.toml").write_text(text + pattern)
    table = (folder / "tests.csv").read_text()
    (folder / "tests.csv").write_text(table.replace("T11,raw/T11.csv,F,", "T11,raw/T11.csv,A,"))
    page = report(folder, tmp_path / "out", "--no-model").replace("\u00a0", " ")
    assert "The spring-block model was not run, as requested." in page
