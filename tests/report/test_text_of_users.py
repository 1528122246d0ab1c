"""Ids and names reach every result as the text they are; none of them is a formula, a number or a command there."""

from __future__ import annotations

import csv
import io
import shutil
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest
from hypothesis import given, strategies as st
from matplotlib.figure import Figure

from tribo import stages
from tribo.campaign import load_campaign
from tribo.figures.catalogue import FIGURES, FRICTION_FIGURES
from tribo.figures.style import house_style
from tribo.outputs import csv_text
from tribo.records import Study
from tribo.report import tables as result_tables
from tribo.report.campaign_nc import write_store
from tribo.report.drawings import draw_all, svg_text
from tribo.user_text import for_spreadsheet, from_spreadsheet, plain

IDS = ("001", "1", "1.0", "1e5", "01", "+1", "1e05", "nan", "inf", "None", "True", "-0")
NAMES = ("=1+1", "@SUM(A1)", "+cmd|' /C calc'!A0", "-2+3", "'=1", "''@x", "'", "-1.5", "+1", "1e5", "plain", "'quoted'")


@pytest.fixture(scope="module")
def study(small_campaign: Path, tmp_path_factory: pytest.TempPathFactory) -> Study:
    """The small campaign with ids, specimens and operators that look like numbers, and a covariate of each kind."""
    folder = tmp_path_factory.mktemp("ids") / "campaign"
    shutil.copytree(small_campaign, folder)
    with (folder / "tests.csv").open(newline="", encoding="utf-8") as table:
        rows = list(csv.DictReader(table))
    for k, row in enumerate(rows):
        row["test_id"] = IDS[k] if k < len(IDS) else f"T{k}"
        row["specimen"] = {"F": "1", "B": "1.0"}[row["sample"]] + "0" * int(row["repeat"])
        row["operator"] = IDS[k % len(IDS)]
        row |= {"batch": f"{k:03d}", "humour": f"{k / 4}", "=2+3": "@x"}
    with (folder / "tests.csv").open("w", newline="", encoding="utf-8") as table:
        writer = csv.DictWriter(table, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    return stages.study(load_campaign(folder), until="fit")


def test_twelve_ids_that_look_like_numbers_stay_twelve_texts_in_campaign_nc(study: Study, tmp_path: Path) -> None:
    assert tuple(study.ingested.pulls)[: len(IDS)] == IDS
    with h5py.File(write_store(study, tmp_path)) as file:
        for group in ("tests", "traces"):
            assert tuple(file[group]["test_id"].asstr()[: len(IDS)]) == IDS
        assert set(file["tests"]["operator"].asstr()) == set(IDS)
        assert set(file["tests"]["specimen"].asstr()) == {t.specimen for t in study.ingested.campaign.tests}
        assert file["tests"]["batch"].asstr()[7] == "007"
        assert file["tests"]["humour"][3] == 0.75
        assert file["tests"]["normal_load_N"].dtype == np.float64


def test_twelve_ids_that_look_like_numbers_stay_twelve_texts_in_the_csv(study: Study) -> None:
    rows = list(csv.DictReader(io.StringIO(csv_text(result_tables.tests_table(study)))))
    assert tuple(row["test_id"] for row in rows[: len(IDS)]) == IDS
    assert {row["'=2+3"] for row in rows} == {"'@x"}


def test_decisions_by_hand_are_joined_to_ids_as_text(study: Study, tmp_path: Path) -> None:
    from tribo.ingestion.overrides import apply_overrides

    table = tmp_path / "overrides.csv"
    table.write_text("test_id,action,reason\n01,exclude,slipped\n1.0,exclude,slipped\nNone,exclude,slipped\n")
    left = apply_overrides(study.ingested, table, "first_peak").pulls
    assert set(study.ingested.pulls) - set(left) == {"01", "1.0", "None"}


def test_a_cell_that_a_spreadsheet_would_take_for_a_formula_is_escaped_and_read_back() -> None:
    said = csv_text(pd.DataFrame({"name": NAMES, "value": np.linspace(-1.5, 1.5, len(NAMES))}))
    rows = list(csv.DictReader(io.StringIO(said)))
    assert [from_spreadsheet(row["name"]) for row in rows] == list(NAMES)
    assert rows[0]["value"] == "-1.5"
    begins = {row["name"][:1] for row in rows if from_spreadsheet(row["name"]) != row["name"]}
    assert begins == {"'"}
    assert [row["name"] for row in rows if row["name"].startswith(tuple("=+-@"))] == ["-1.5", "+1"]


@pytest.mark.parametrize("begin", ["=", "+", "-", "@", "\t", "\r"])
def test_no_beginning_of_a_formula_is_left_bare(begin: str) -> None:
    assert for_spreadsheet(f"{begin}A1") == f"'{begin}A1"
    assert from_spreadsheet(for_spreadsheet(f"{begin}A1")) == f"{begin}A1"


def test_the_name_of_a_sample_is_not_read_as_a_formula_in_a_figure() -> None:
    with house_style():
        figure = Figure()
        ax = figure.add_subplot(title=r"$\frac$", xlabel="$x_{$")
        ax.plot([1, 2], [3, 4], label=r"$\undefined$")
        ax.legend()
    assert "<svg" in svg_text(figure)


def test_a_figure_that_fails_is_replaced_by_its_reason_and_the_others_are_drawn(
    study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    from dataclasses import replace

    tables = (FIGURES, FRICTION_FIGURES)
    first, second = (next(n for n, f in table.items() if not f.numbers(study).empty) for table in tables)

    def broken(numbers: pd.DataFrame) -> Figure:
        raise KeyError("$sample")

    def empty(results: Study) -> pd.DataFrame:
        raise FloatingPointError("overflow")

    for table in tables:
        for name in set(table) - {first, second}:
            monkeypatch.setitem(table, name, replace(table[name], numbers=lambda _: pd.DataFrame()))
    monkeypatch.setitem(FIGURES, first, replace(FIGURES[first], draw=broken))
    drawn = draw_all(study)
    assert "this figure cannot be drawn because of an error in tribo (KeyError" in drawn[first].caption
    assert len(drawn[first].files["csv"]) > 100
    assert "an error in tribo" not in drawn[second].caption
    monkeypatch.setitem(FRICTION_FIGURES, second, replace(FRICTION_FIGURES[second], numbers=empty))
    assert "the numbers of this figure cannot be computed" in draw_all(study)[second].caption


@given(st.floats(1e-9, 1e9))
def test_no_number_of_a_sentence_is_a_power_of_ten(value: float) -> None:
    said = plain(value)
    assert "e" not in said
    assert float(said) == float(f"{value:.3g}")
    assert plain(-value) == f"-{said}"
