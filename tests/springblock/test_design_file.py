"""A design of simulations: what it may say, the runs it stands for, and every fault at once."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tribo.errors import SimulationError
from tribo.springblock.design_file import described_by_options, read_design, runs_of_design, setting

DESIGN = """
samples = ["F", "Gx"]
pressures_kPa = [5, 20]
repeats = 3
seed = 7
[parameters]
dt_s = 1e-7
blocks = 30
shear_factor = [0.5, 1.0]
mu_s = 5.0
[patterns.G]
cavity = "circle"
diameter_um = 10
pitch_um = 20
"""


def faults(table: dict) -> set[tuple[str, str | None]]:
    with pytest.raises(SimulationError) as refused:
        runs_of_design(table)
    return {(p.kind, p.column) for p in refused.value.problems}


def test_a_file_stands_for_every_combination_of_what_it_lists(tmp_path: Path):
    """Two samples, two pressures, three repeats, two values of a parameter: 24 runs, equal seeds in both values."""
    (tmp_path / "d.toml").write_text(DESIGN)
    runs = read_design(tmp_path / "d.toml")
    assert len(runs) == 24
    half, full = runs[:12], runs[12:]
    assert {r.shear_factor for r in half} == {0.5}
    assert [(r.sample, r.pressure_Pa, r.angle_deg, r.seed) for r in half] == [
        (r.sample, r.pressure_Pa, r.angle_deg, r.seed) for r in full
    ]
    assert len({r.seed for r in half}) == 12
    assert {(r.dt_s, r.blocks, r.friction.mu_s, r.friction.mu_d) for r in runs} == {(1e-7, (30, 30), 5.0, 2.9)}
    along_x = [r for r in runs if r.sample == "Gx"]
    assert along_x[0].cavities.size_m == pytest.approx((1e-5, 1e-5))
    assert all(-10 <= r.angle_deg <= 10 for r in along_x)


def test_json_says_the_same_as_toml(tmp_path: Path):
    table = {"samples": ["F"], "pressures_kPa": [5], "angles_deg": [0, 45], "repeats": 2}
    (tmp_path / "d.json").write_text(json.dumps(table))
    runs = read_design(tmp_path / "d.json", seed=3)
    assert [r.angle_deg for r in runs] == [0.0, 0.0, 45.0, 45.0]
    assert runs == runs_of_design({**table, "seed": 3})
    assert runs != runs_of_design(table)


def test_every_fault_of_a_design_is_named_at_once():
    """Keys, kinds, an unknown sample, a negative pressure, an unstable step, a NaN and overlapping cavities."""
    table = {
        "samples": ["Q"], "pressures_kPa": [-5], "repeats": 0, "angels": 1,
        "parameters": {"dt_s": 1e-3, "edges": "open", "frobnicate": 1, "mu_s": float("nan"), "blocks": [30, 30.5]},
        "patterns": {"G": {"cavity": "circle", "diameter_um": 30, "pitch_um": 20}},
    }  # fmt: skip
    assert faults(table) == {
        ("wrong_value", "repeats"), ("unknown_key", "angels"), ("wrong_value", "patterns.G"),
        ("wrong_value", "parameters.edges"), ("unknown_key", "parameters.frobnicate"),
        ("wrong_value", "parameters.blocks"), ("unknown_sample", "sample"), ("not_positive", "pressure_Pa"),
        ("not_finite", "mu_s"), ("unstable_step", "dt_s"),
    }  # fmt: skip


@pytest.mark.parametrize("angles", ["sometimes", [], ["x"], 45])
def test_angles_are_a_rule_or_a_list(angles: object):
    assert faults({"samples": ["F"], "pressures_kPa": [5], "angles_deg": angles}) & {
        ("wrong_value", "angles_deg"), ("wrong_value", "angles_deg.0")
    }  # fmt: skip


def test_a_file_that_is_no_design_is_refused_by_name(tmp_path: Path):
    for name, text in (("a.toml", "samples = ["), ("a.json", "[1]"), ("b.json", "{")):
        (tmp_path / name).write_text(text)
        with pytest.raises(SimulationError, match=name):
            read_design(tmp_path / name)


def test_a_setting_is_a_name_and_one_or_several_values():
    assert setting("shear_factor=0.5,1") == ("shear_factor", [0.5, 1])
    assert setting("edges=periodic") == ("edges", "periodic")
    assert setting("pattern_first=[0,0]") == ("pattern_first", [0, 0])


NOTHING = {"samples": (), "pressures_kPa": (), "angles_deg": (), "repeats": None, "settings": (), "blocks": None,
           "dt_s": None, "duration_ms": None, "engine": None}  # fmt: skip


@pytest.mark.parametrize(
    ("options", "one"),
    [
        ({}, True), ({"angles_deg": (30.0,), "settings": ("edges=periodic", "pattern_first=[0,0]")}, True),
        ({"repeats": 1}, False), ({"samples": ("F", "B")}, False), ({"settings": ("shear_factor=0.5,1",)}, False),
        ({"angles_deg": (0.0, 45.0)}, False),
    ],
)  # fmt: skip
def test_options_are_one_run_unless_they_ask_for_more(options: dict, one: bool):
    asked = NOTHING | {"samples": ("Sy",), "pressures_kPa": (5.0,)} | options
    assert described_by_options(asked, 0, False)[0] is one


def test_table_2_is_described_by_one_word():
    """All samples, eight pressures, twenty runs each, unless the options say otherwise."""
    one, table = described_by_options(NOTHING | {"dt_s": 1e-7, "pressures_kPa": (5.0,)}, 0, True)
    assert not one
    assert len(runs_of_design(table)) == 6 * 20
    assert len(runs_of_design(described_by_options(NOTHING, 0, True)[1])) == 960
