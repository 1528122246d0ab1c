"""The virtual tribometer itself, and the counting of answers."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from tribo.mechanisms.table import NAMES

from .tribometer import EFFECTS, LARGEST, Design, hide

ROOT = Path(__file__).resolve().parents[2]
FULL = Design(repeats=1, speeds_mm_s=(0.05, 0.2, 0.8), holds_s=(1.0, 300.0))
sys.path.append(str(ROOT / "benchmarks"))

from blind_tables import both_tied, covariate_right, part, right, share, wrong  # noqa: E402


def test_every_mechanism_of_the_library_can_be_hidden() -> None:
    assert {name.split(":")[0] for name in EFFECTS} - {"outside"} == set(NAMES)
    assert set(EFFECTS) - set(LARGEST) == {"covariate:operator", "load_cell_offset", "load_cell_drift"}


def test_no_effect_is_coded_with_the_library_it_is_to_test() -> None:
    for name in ("bench.py", "effects.py", "tribometer.py"):
        assert "import tribo" not in (source := (ROOT / "tests" / "blind" / name).read_text())
        assert "from tribo" not in source


@pytest.mark.parametrize("name", sorted(EFFECTS))
def test_an_effect_changes_something_that_a_pull_records(name: str) -> None:
    """Forces, the zero, the rise or the sampling; the same draw without the effect is the comparison."""
    plain, changed = hide(7, [], FULL), hide(7, [(name, 1.0)], FULL)
    pairs = ((plain.static, changed.static), (plain.sliding, changed.sliding), (plain.zero, changed.zero))
    moved = any(np.abs(a - b).max() > 1e-3 for a, b in pairs)
    stiffness = np.ptp(changed.stiffness_N_per_mm / plain.stiffness_N_per_mm) > 0 or (
        changed.stiffness_N_per_mm[0] != plain.stiffness_N_per_mm[0]
    )
    assert moved or stiffness or np.isfinite(changed.samples_per_s)


def test_the_reference_engine_makes_patterns_hold_less_than_the_flat_sample() -> None:
    bench = hide(7, [], Design(samples=("F", "A", "B", "C"), engine=True, specimen_sd=0.0, repeat_sd=(0.0, 0.0)))
    mean = {s: bench.static[(bench.tests["sample"] == s).to_numpy()].mean() for s in "FABC"}
    assert mean["F"] > mean["A"] > mean["B"] > mean["C"] > 0.5 * mean["F"]


def row(verdict: str, causes: list[list[str]], *hidden: str, **more: object) -> dict[str, object]:
    return {"verdict": verdict, "causes": causes, "effects": [[h, 1.0] for h in hidden], "covariates": [], **more}


def test_answers_are_counted_as_the_page_says() -> None:
    tied = row(
        "named",
        [["normal_load_error", "suction"]],
        "suction",
        next_test={"separates": ["normal_load_error", "suction"]},
    )
    assert right(tied)
    assert both_tied(tied)
    assert not wrong(tied)
    assert not both_tied(row("named", [["suction"]], "suction"))
    assert wrong(row("named", [["tilt"]], "run_in"))
    assert not right(row("named", [["tilt"]], "run_in"))
    half = row("named", [["run_in"]], "run_in", "suction")
    assert part(half)
    assert not right(half)
    assert wrong(row("named", [["run_in"], ["tilt"]], "run_in", "suction"))
    assert right(row("no_misfit", []))
    assert not right(row("undetermined", [["run_in"], ["tilt"]], "run_in"))
    outside = row("unknown", [], "outside:day", covariates=["time of day", "run_order"])
    assert right(outside)
    assert covariate_right(outside)
    assert share([outside, row("named", [["tilt"]], "outside:day")], right).startswith("1/2 = 50.0 %")
