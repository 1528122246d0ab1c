"""Laws on the command line: in the simulator, in a plan, and from a folder in a diagnosis."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from on_the_command_line import run

from tribo.diagnostics.verdict import Estimate
from tribo.lawsearch.grammar import Shape, WrittenLaw
from tribo.lawsearch.known_laws import law_text

SIZE = {"a": Estimate(0.7, 0.6, 0.8, "")}


@pytest.fixture
def law(tmp_path: Path) -> Path:
    """Friction rises with a column film_um that no campaign here records."""
    path = tmp_path / "laws" / "law-1.toml"
    path.parent.mkdir()
    path.write_text(law_text(WrittenLaw((Shape("linear", "film_um", 0.0, 4.0),)), SIZE, "before"))
    return path


def test_a_simulated_law_raises_the_friction_by_what_it_says(law: Path, tmp_path: Path) -> None:
    quick = ("--blocks", "20", "--dt", "1e-7", "--set", "rest_tolerance=0.01", "--set", "duration_peaks=1.5")
    run_of = ("simulate", "--sample", "F", "--pressure", "5", *quick, "--json", "-q")
    friction = []
    for number, text in enumerate((("--given", "film_um=4"), ("--given", "film_um=0"))):
        found = run(*run_of, "--with", str(law), *text, "-o", str(tmp_path / f"{number}.nc"))
        assert found.exit_code == 0, found.output
        friction.append(json.loads(found.stdout)["static_friction"])
    assert friction[0] / friction[1] == pytest.approx(2.0138, rel=1e-3)


def test_a_column_of_the_law_that_is_not_given_is_asked_for(law: Path, tmp_path: Path) -> None:
    found = run("simulate", "--sample", "F", "--pressure", "5", "--with", str(law), "-o", str(tmp_path / "x.nc"))
    assert found.exit_code == 1
    assert "--given film_um=VALUE" in found.output


def test_a_plan_says_why_it_cannot_show_a_law(law: Path, small_campaign: Path) -> None:
    found = run("plan", str(small_campaign), "--with", str(law))
    assert found.exit_code == 0
    assert "film_um is not recorded" in found.output


def test_laws_of_a_folder_are_answered_in_the_verdict(law: Path, small_campaign: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    found = run("diagnose", str(small_campaign), "-o", str(out), "--laws", str(law.parent), "--jobs", "1", "-q")
    assert found.exit_code in (0, 3), found.output
    verdict = json.loads((out / "verdict.json").read_text())
    assert verdict["model"]["known_laws"][0]["answer"] == "cannot be told"
    assert "0 of 1 known laws held." in verdict["text"]
