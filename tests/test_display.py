"""Every record shows itself in a few lines in a console, and in a small table in a notebook."""

from __future__ import annotations

import importlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from diagnose.examined import Once, examined
from report.synthetic import make_study

import tribo
from tribo import errors, records
from tribo.display import displayed, exact_text, in_short

MOST_LINES, MOST_LETTERS = 40, 120
FACES = (
    "tribo", "tribo.records", "tribo.errors", "tribo.springblock", "tribo.diagnostics", "tribo.report", "tribo.fitting",
    "tribo.traces", "tribo.readers", "tribo.mechanisms.record", "tribo.laws", "tribo.figures.style",
)  # fmt: skip


def within(value: object, seen: set[int]) -> Iterator[Any]:
    """Every record that can be reached from a value, once."""
    if id(value) in seen:
        return
    seen.add(id(value))
    if is_dataclass(value) and not isinstance(value, type):
        yield value
        parts = [getattr(value, f.name) for f in fields(value)]
    elif isinstance(value, Mapping):
        parts = list(value.values())
    else:
        parts = list(value) if isinstance(value, list | tuple | set) else []
    for part in parts:
        yield from within(part, seen)


@pytest.fixture(scope="module")
def found(once: Once) -> list[Any]:
    """A study and a diagnosis, with every record in them."""
    kept: set[int] = set()
    roots = (make_study(), examined("temperature", once), tribo.StudyOptions())
    return [record for root in roots for record in within(root, kept)]


def test_every_record_of_a_study_and_a_diagnosis_shows_itself_in_at_most_40_lines(found: list[Any]) -> None:
    assert len({type(r) for r in found}) > 30
    for record in found:
        lines = repr(record).split("\n")
        assert len(lines) <= MOST_LINES, type(record)
        assert max(map(len, lines)) <= MOST_LETTERS, type(record)
        assert lines[0].startswith(type(record).__name__)


def test_every_record_has_a_table_for_notebooks_with_the_same_words(found: list[Any]) -> None:
    for record in found:
        table = record._repr_html_()
        assert table.count("<tr>") == len(repr(record).split("\n")) - 1
        assert table.startswith("<table>")
        assert table.endswith("</table>")


def public_records() -> list[type]:
    """Every dataclass that a face of the package shows."""
    modules = [importlib.import_module(name) for name in FACES]
    named = [getattr(m, name) for m in modules for name in dir(m) if not name.startswith("_")]
    return sorted({c for c in named if isinstance(c, type) and is_dataclass(c)}, key=lambda c: c.__name__)


@pytest.mark.parametrize("record_class", public_records(), ids=lambda c: c.__name__)
def test_every_public_record_is_displayed(record_class: type) -> None:
    assert hasattr(record_class, "_repr_html_")


def test_names_of_users_cannot_put_markup_into_a_notebook() -> None:
    trace = records.Trace("<script>x</script>", np.arange(3.0), np.ones(3), metadata={"<b>": "<i>\x1b[2J"})
    assert "<script" not in trace._repr_html_()
    assert "<i>" not in trace._repr_html_()
    assert "\x1b" not in repr(trace)


def test_a_display_leaves_out_what_is_empty_and_names_what_is_there() -> None:
    shown = repr(records.Override("T7", "exclude", records.Pull("T7", "first_peak"), reason="tipped over"))
    assert shown.split("\n")[0] == "Override: T7: exclude"
    assert "reason     tipped over" in shown
    assert "peak_s" not in shown


@dataclass(frozen=True)
class Plain:
    values: Any = None
    name: str = ""


def test_a_problem_and_a_fit_say_what_they_are_in_the_first_line() -> None:
    fit = make_study().fits[0]
    assert repr(errors.Problem("slug", "no unit", file="a.csv", row=3)).startswith("Problem: a.csv, row 3: no unit\n")
    assert repr(fit).startswith(f"LawFit: {fit.sample}, {fit.regime}: mu = {fit.value('mu'):.4g} ± ")


def test_a_record_of_very_many_fields_says_how_many_are_left_out() -> None:
    from dataclasses import make_dataclass

    many = displayed()(make_dataclass("Many", [(f"f{k}", int) for k in range(50)]))
    lines = repr(many(*range(1, 51))).split("\n")
    assert len(lines) <= MOST_LINES
    assert lines[-1].split() == ["...", "and", "14", "more", "fields"]


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (float("nan"), ""), (None, ""), ((), ""), (1.23456789, "1.23457"), (True, "True"), ("a\nb", "a b"),
        (np.arange(1000.0), "array of 1000, between 0 and 999"), (np.array([1.0, np.nan]), "[1, nan]"),
        (np.full((3, 4), np.nan), "array of 3 x 4, no finite number"), (np.eye(2), "[1, 0, 0, 1] as (2, 2)"),
        ({"a": 1.0, "b": float("nan")}, "a = 1, b = nan"),
        (dict.fromkeys("abcdefg", ()), "7: a, b, c, d, e and 2 more"),
        (pd.DataFrame({"mu": [1, 2]}), "table of 2 rows: mu"), ((1, 2, 3, 4, 5, 6, 7), "1, 2, 3, 4, 5 and 2 more"),
        ("x" * 100, "x" * 75 + "..."),
    ],
)  # fmt: skip
def test_any_value_is_told_in_one_short_line(value: object, text: str) -> None:
    assert in_short(value) == text


def test_the_exact_text_tells_records_apart_that_differ_anywhere() -> None:
    study = make_study()
    test = study.ingested.campaign.tests[0]
    other = replace(test, correction=replace(test.correction, gain=1.0 + 1e-15))
    assert exact_text(test) != exact_text(other)
    assert exact_text(test) == exact_text(replace(test))
    assert exact_text(Plain({"a": (1.0, "b")})) == "Plain(values={'a': (1.0, 'b')}, name='')"
