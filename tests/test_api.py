"""What the commands do, in a few lines of Python, with nothing heavy imported before it is used."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from small_lattices import small_lattices

import tribo
from tribo import stages
from tribo.campaign import load_campaign
from tribo.cli import main
from tribo.errors import Problem, SimulationError
from tribo.records import Study

MODULES = {"plot"}


@pytest.mark.parametrize("name", sorted(set(tribo.__all__) - MODULES))
def test_every_public_name_is_there_documented_and_no_package(name: str) -> None:
    found = getattr(tribo, name)
    assert not isinstance(found, ModuleType)
    assert (found.__doc__ or "").strip()


@pytest.mark.slow
def test_a_public_name_stays_what_it_is_after_its_package_was_imported() -> None:
    code = "import tribo, tribo.cli, tribo.diagnostics, tribo.report, tribo.springblock, tribo.fitting, types\n"
    code += "print([n for n in tribo.__all__ if isinstance(getattr(tribo, n), types.ModuleType)])"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip()
    assert found == str(sorted(MODULES))


def test_diagnosis_is_the_old_name_of_diagnose(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tribo.stages.diagnose", lambda ingested, **options: (ingested, options))
    ingested: Any = object()
    with pytest.warns(FutureWarning, match="tribo.diagnose"):
        assert tribo.diagnosis(ingested, seed=3) == (ingested, {"seed": 3})


def test_a_run_of_the_model_is_one_call() -> None:
    run = tribo.simulate(tribo.SimConfig(blocks=(12, 12), dt_s=1e-7, duration_peaks=1.3))
    assert run.static_friction > run.sliding_friction > 0


def test_importing_tribo_imports_none_of_the_heavy_libraries() -> None:
    code = "import sys, tribo; print([m for m in sys.modules if m.split('.')[0] in sys.argv[1:]])"
    heavy = ["numba", "xarray", "statsmodels", "matplotlib", "scipy", "pandas", "numpy", "pydantic"]
    seen = subprocess.run([sys.executable, "-c", code, *heavy], capture_output=True, text=True, check=True)
    assert seen.stdout.strip() == "[]"


def test_three_lines_of_python_give_the_numbers_of_tribo_fit(eight_pulls: Path, tmp_path: Path) -> None:
    from click.testing import CliRunner

    ingested = tribo.ingest(tribo.load_campaign(eight_pulls))
    fits = {(f.sample, f.regime): f.value("mu") for f in tribo.fit(ingested)}
    CliRunner().invoke(main, ["fit", str(eight_pulls), "-o", str(tmp_path), "-q"])
    import pandas as pd

    table = pd.read_csv(tmp_path / "fits.csv").set_index(["sample", "regime"])["mu"]
    assert {key: pytest.approx(mu, rel=1e-7) for key, mu in table.items()} == fits


TUTORIAL = Path(__file__).resolve().parents[1] / "docs" / "tutorials" / "in-python.md"


@pytest.mark.slow
def test_the_fifteen_lines_of_the_tutorial_run_as_written_and_give_what_the_report_states(tmp_path: Path) -> None:
    import re

    import pandas as pd
    from on_the_command_line import run

    cells = re.findall(r"```\{code-cell\} ipython3\n(.*?)```", TUTORIAL.read_text(encoding="utf-8"), re.DOTALL)[:2]
    lines = [line for cell in cells for line in cell.splitlines() if line.strip()]
    assert len(lines) <= 15
    said: dict[str, Any] = {}
    with small_lattices():
        exec("\n".join(lines), said)
    assert run("fit", tribo.data_dir() / "example", "-o", tmp_path, "-q").exit_code == 0
    written = pd.read_csv(tmp_path / "fits.csv")
    pd.testing.assert_frame_equal(said["table"], written[list(said["table"].columns)], rtol=1e-6)
    assert len(said["pulls"]) == 144
    assert set(said["residuals"]["regime"]) == {"static", "sliding"}
    assert said["run"].static_friction > said["run"].sliding_friction > 0


def test_a_law_that_the_model_cannot_run_with_leaves_the_fits_and_says_so(
    eight_pulls: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_: Any, **__: Any) -> Study:
        raise SimulationError(Problem("too_short", "the run ends too early", column="duration_s"))

    monkeypatch.setattr(stages, "compare", refused)
    study = stages.study(load_campaign(eight_pulls), until="compare")
    assert study.comparison is None
    assert len(study.fits) == 4
    assert any("cannot be run with the friction law of the flat sample" in note for note in study.notes)
