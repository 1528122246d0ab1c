"""How answers about the campaigns of virtual laboratories are counted."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest

sys.path.append(str(Path(__file__).resolve().parents[2] / "benchmarks"))

from laboratory_tables import effect_found, effect_wrong, nothing_left, other_physical

Row = dict[str, Any]


def law(*columns: str) -> Row:
    return {"kind": "law", "name": " and ".join(columns), "formula": "", "tied_with": []}


def answered(hidden: Row, verdict: str, *layers: Row, causes: tuple[str, ...] = (), left: bool | None = True) -> Row:
    return {
        "truth": hidden, "verdict": verdict, "causes": [{"mechanism": name} for name in causes], "equivalent": [],
        "layers": list(layers), "misfits": [{"column": x["name"]} for x in layers], "within_chance": left,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("effect", "column"),
    [("outside:day", "clock_h"), ("velocity_dependence", "speed_m_s"), ("outside:counterface", "run_order")],
)
def test_an_effect_is_found_by_a_law_of_the_column_that_it_follows_and_by_no_other(effect: str, column: str) -> None:
    assert effect_found(answered({"effect": effect}, "unknown", law(column)))
    assert not effect_found(answered({"effect": effect}, "unknown", law("film_um")))
    assert not effect_found(answered({"effect": effect}, "unknown", law(column, "film_um")))


def test_a_cause_that_follows_another_column_is_wrong() -> None:
    hidden = {"effect": "temperature"}
    assert effect_wrong(answered(hidden, "named", causes=("humidity",)))
    assert not effect_wrong(answered(hidden, "named", causes=("temperature",)))
    assert not effect_wrong(answered(hidden, "undetermined", causes=("humidity", "temperature")))


def test_a_law_of_the_series_is_no_other_physical_column() -> None:
    hidden = {"columns": ["film_um"]}
    for column in ("clock_h", "run_order", "elapsed_s", "specimen_run"):
        assert not other_physical(answered(hidden, "unknown", law(column)))
    assert other_physical(answered(hidden, "unknown", law("hold_s")))


def test_something_is_left_where_a_misfit_of_another_column_is_listed_or_what_remains_is_beyond_chance() -> None:
    hidden, told = {"column": "hold_s"}, law("hold_s")
    assert nothing_left(answered(hidden, "unknown", told))
    assert not nothing_left(answered(hidden, "unknown", told, left=False))
    assert not nothing_left(answered(hidden, "unknown", told, law("run_order")))
    assert not nothing_left(answered(hidden, "no_misfit", left=None))
