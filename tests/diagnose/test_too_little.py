"""A campaign too small to be tested says that it cannot tell, and why, wherever its verdict is shown."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from on_the_command_line import run
from support.campaigns import written

import tribo
from tribo.diagnostics.verdict import Verdict
from tribo.records import Ingested
from tribo.wording.card import card_of, card_text

from .synthetic import hidden

TOML = '[campaign]\ntitle = "few"\nnominal_area_mm2 = 55.0\n[patterns.F]\ncavity = "none"\n'
SCATTERED_N = (0.40, 0.55, 0.62, 0.70, 0.48)  # the largest is 1.75 times the smallest


def campaign(folder: Path, forces_N: tuple[float, ...]) -> Path:
    rows = [f"T{k},F,S{k},1.2,{force},{force}" for k, force in enumerate(forces_N)]
    return written(folder, TOML, ["test_id,sample,specimen,normal_load_N,static_N,sliding_N", *rows])


def among(keep: int, loads: int | None = None, samples: int | None = None) -> Ingested:
    """The first tests of a campaign with a hidden pattern of ordinary size, of so many loads or samples only."""
    ingested = hidden()
    c = ingested.campaign
    of_loads = sorted({t.normal_load_N for t in c.tests})[:loads]
    of_samples = list(dict.fromkeys(t.sample for t in c.tests))[:samples]
    tests = [t for t in c.tests if t.normal_load_N in of_loads and t.sample in of_samples][:keep]
    return replace(ingested, campaign=replace(c, tests=tuple(tests)))


@pytest.mark.parametrize("options", [(), ("--no-model",)])
def test_one_pull_cannot_tell_in_every_file_of_its_report(tmp_path: Path, options: tuple[str, ...]) -> None:
    out = tmp_path / "out"
    result = run("report", campaign(tmp_path / "c", (0.5,)), "-o", out, "--jobs", "1", *options)
    assert result.exit_code == 0, result.output
    verdict = json.loads((out / "verdict.json").read_text(encoding="utf-8"))
    card = json.loads((out / "card.json").read_text(encoding="utf-8"))
    page = (out / "report.html").read_text(encoding="utf-8").replace("\u00a0", " ")
    assert verdict["verdict"] == "cannot_tell"
    for text in (verdict["text"], card["sentence"], page, " ".join(result.output.split())):
        assert "Cannot tell" in text
        assert "1 usable test, at least 12 are needed" in text
        assert "nothing exceeds chance" not in text
    assert "No statistically significant" not in page
    assert "No further test is recommended" not in page


def test_five_tests_that_scatter_by_1_75_cannot_tell_and_say_how_far_they_scatter(tmp_path: Path) -> None:
    out = tmp_path / "out"
    result = run("diagnose", campaign(tmp_path / "c", SCATTERED_N), "-o", out, "--no-model")
    assert result.exit_code == 0, result.output
    verdict = json.loads((out / "verdict.json").read_text(encoding="utf-8"))
    assert verdict["verdict"] == "cannot_tell"
    assert "friction of F at 1.20 N, measured 5 times, scatters by a factor of 1.75" in verdict["text"]
    assert "scatters by a factor of 1.75" in " ".join(result.stdout.split())


@pytest.mark.parametrize(
    ("few", "reason"),
    [
        (among(5), "5 usable tests, at least 12 are needed"),
        (among(200, loads=1), "1 load, at least 2 are needed"),
        (among(200, samples=1), "1 sample, at least 2 are needed"),
    ],
)
def test_with_the_model_few_tests_one_load_or_one_sample_cannot_tell(few: Ingested, reason: str) -> None:
    found: Verdict = tribo.diagnose(few).verdict
    assert found.verdict == "cannot_tell"
    assert reason in found.sentence
    assert "at least 12 tests, 2 loads and 2 samples" in card_text(card_of(tribo.Study(few, ()), found))


def test_columns_of_too_few_tests_are_not_said_to_be_tested(tmp_path: Path) -> None:
    rows = [f"T{k},F,S{k},1.2,{f},{f},{20 + k},{3 * k}" for k, f in enumerate(SCATTERED_N)]
    header = "test_id,sample,specimen,normal_load_N,static_N,sliding_N,temperature_C,strokes"
    found = tribo.diagnose(tribo.ingest(tribo.load_campaign(written(tmp_path / "c", TOML, [header, *rows])))).verdict
    assert found.verdict == "cannot_tell"
    assert "same column" not in found.text
    assert "It was tested" not in found.text
