"""The bundled example is what its own script makes, small, and obeys the law it states."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np
from support.sled import SledDesign, SledLaw, SledTribometer, write_campaign

EXAMPLE = Path(__file__).resolve().parents[1] / "data" / "example"
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
