"""The bundled examples are what their own scripts make, small, and obey the laws they state."""

from __future__ import annotations

import json
import re
import runpy
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from support.sled import SledDesign, SledLaw, SledTribometer, write_campaign

from tribo.cli.commands import main
from tribo.report.without_study import write_demo_page

EXAMPLE = Path(__file__).resolve().parents[1] / "data" / "example"
SECOND_EXAMPLE = EXAMPLE.parent / "second_example"
LAW = {"F": SledLaw(5.0, 20e3, 3.0, 10e3)}


def test_the_script_writes_the_bundled_bytes_again(tmp_path: Path) -> None:
    runpy.run_path(str(EXAMPLE / "make_example.py"))["main"](tmp_path)
    made = {p.relative_to(tmp_path): p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()}
    assert len(made) == 144 + 2
    assert {name for name, content in made.items() if (EXAMPLE / name).read_bytes() != content} == set()


def test_the_example_is_at_most_two_megabytes() -> None:
    assert sum(p.stat().st_size for p in EXAMPLE.rglob("*") if p.is_file()) <= 2_000_000


def test_a_noiseless_pull_ends_at_its_sliding_force() -> None:
    quiet = SledTribometer(noise_N=0.0, drift_share=0.0, stick_slip_share=0.0, sampling_hz=1000.0)
    _, _, force = quiet.pull(2.0, 1.5, 0.2e-3, np.random.default_rng(0))
    assert np.isclose(force[-1], 1.5)
    assert np.isclose(force.max(), 2.0, rtol=1e-3)
    assert np.all(force[:1000] == 0.0)


def test_the_same_seed_writes_the_same_campaign_and_another_seed_another(tmp_path: Path) -> None:
    design = SledDesign(LAW, masses_g=(5.0, 50.0), specimens=1, repeats=1)
    contents = []
    for k, seed in enumerate((1, 1, 2)):
        write_campaign(tmp_path / str(k), design, "", seed=seed)
        contents.append([p.read_bytes() for p in sorted((tmp_path / str(k)).rglob("*.csv"))])
    assert contents[0] == contents[1] != contents[2]


def test_the_second_script_writes_its_bundled_bytes_again(tmp_path: Path) -> None:
    runpy.run_path(str(SECOND_EXAMPLE / "make_example.py"))["main"](tmp_path)
    made = {p.relative_to(tmp_path): p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()}
    assert len(made) == 96 + 2
    assert {name for name, content in made.items() if (SECOND_EXAMPLE / name).read_bytes() != content} == set()


@pytest.mark.slow
def test_the_demo_names_what_was_hidden_in_its_second_campaign_and_leads_to_both_reports(tmp_path: Path) -> None:
    assert CliRunner().invoke(main, ["demo", "-o", str(tmp_path / "out")]).exit_code == 0
    verdict = json.loads((tmp_path / "out" / "cause-found" / "verdict.json").read_text())
    (cause,) = [layer for layer in verdict["layers"] if layer["kind"] == "cause"]
    assert cause["name"] == "contact_ageing"
    low, high = cause["over"]["low"], cause["over"]["high"]
    assert low < 100 * (300.0**0.05 - 1) < high
    assert verdict["gain"]["rmse_percent_after"] < verdict["gain"]["rmse_percent_before"]
    page = (tmp_path / "out" / "index.html").read_text()
    links = set(re.findall(r'href="([^"#]+\.html)"', page))
    assert links == {"report.html", "cause-found/report.html"}
    assert all((tmp_path / "out" / link).is_file() for link in links)


def test_the_page_of_the_demo_repeats_the_sentence_of_each_card(tmp_path: Path) -> None:
    for folder, sentence in ((tmp_path, "One <answer>."), (tmp_path / "cause-found", "Another answer.")):
        (folder / "figures").mkdir(parents=True)
        (folder / "card.json").write_text(json.dumps({"sentence": sentence, "counts": "3 tests used."}))
        (folder / "verdict.json").write_text(json.dumps({"gain": None, "model": {}}))
        (folder / "figures" / "finding.svg").write_text('<?xml version="1.0"?>\n<svg width="3" height="2"></svg>')
    page = write_demo_page(tmp_path).read_text()
    assert "One &lt;answer&gt;." in page
    assert "Another answer." in page
    assert page == write_demo_page(tmp_path).read_text()
