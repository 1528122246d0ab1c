"""tests.csv, fits.csv and comparison.csv in the columns other programs are written against."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tribo.comparison.findings import all_set_aside
from tribo.errors import Problem
from tribo.outputs import csv_text
from tribo.records import SetAside, Study
from tribo.report import tables as result_tables
from tribo.report.tables import write_tables

CONTRACT = {
    "tests.csv": "test_id, static_N, static_u_N, sliding_N, sliding_u_N, rule, window, zero_N, flags, set_aside",
    "fits.csv": "sample, regime, mu, mu_u, tau0_kPa, tau0_u_kPa, cov, n_specimens, n_tests, method, chi2_red",
    "comparison.csv": ("sample, regime, normal_load_N, measured_N, measured_u_N, simulated_N, simulated_u_N"),
}


@pytest.fixture(scope="module")
def written(study: Study, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("tables")
    write_tables(study, out)
    return out


@pytest.mark.parametrize("name", list(CONTRACT))
def test_a_table_starts_with_the_agreed_columns(name: str, written: Path) -> None:
    columns = CONTRACT[name].split(", ")
    assert pd.read_csv(written / name).columns[: len(columns)].tolist() == columns


def test_every_test_has_one_row_used_or_set_aside(written: Path, study: Study) -> None:
    table = pd.read_csv(written / "tests.csv", keep_default_na=False)
    assert sorted(table["test_id"]) == sorted([*(t.test_id for t in study.ingested.campaign.tests), "T9001"])
    aside = table[table["set_aside"] != ""]
    assert set(aside["test_id"]) == {"T9001", study.ingested.campaign.tests[-1].test_id}
    assert set(aside["static_N"]) == {""}


def test_what_is_written_is_what_the_pull_says(written: Path, study: Study) -> None:
    table = pd.read_csv(written / "tests.csv").set_index("test_id")
    for test_id in ("T0001", "T0050"):
        pull = study.ingested.pulls[test_id]
        assert table.loc[test_id, "static_N"] == pytest.approx(pull.static_N, rel=1e-7)
        assert table.loc[test_id, "sliding_N"] == pytest.approx(pull.sliding_N, rel=1e-7)
        start, end = map(float, str(table.loc[test_id, "window"]).split(":"))
        assert (start, end) == pull.window_s


def test_covariates_of_the_campaign_are_kept(written: Path) -> None:
    table = pd.read_csv(written / "tests.csv")
    assert set(table["batch"].dropna()) == {"b1"}


def test_fits_give_tau0_and_the_covariance_in_kilopascal(written: Path, study: Study) -> None:
    table = pd.read_csv(written / "fits.csv")
    for row, fit in zip(table.itertuples(), study.fits, strict=True):
        assert row.tau0_kPa * 1e3 == pytest.approx(fit.value("tau0_Pa"), rel=1e-7)
        assert row.cov * 1e3 == pytest.approx(fit.covariance[0, 1], rel=1e-7)
        assert (row.mu_low, row.mu_high) == pytest.approx(fit.interval("mu"), rel=1e-7)


def test_each_sample_and_regime_stands_once_in_fits(written: Path) -> None:
    table = pd.read_csv(written / "fits.csv")
    assert not table.duplicated(["sample", "regime"]).any()


def test_other_weights_and_the_model_have_a_table_of_their_own(written: Path, study: Study) -> None:
    table = pd.read_csv(written / "other_fits.csv")
    assert set(table["source"]) == {"measured", "simulated"}
    assert len(table) == 2 * (len(study.other_fits) + len(study.comparison.simulated))  # type: ignore[union-attr]


def test_the_comparison_carries_the_ratio(written: Path) -> None:
    table = pd.read_csv(written / "comparison.csv")
    assert table["ratio"].to_numpy() == pytest.approx((table["measured_N"] / table["simulated_N"]).to_numpy())
    assert (table["ratio_low"] < table["ratio"]).all()


def test_a_study_without_fits_has_only_its_tests(study: Study, tmp_path: Path) -> None:
    write_tables(replace(study, fits=(), comparison=None), tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["tests.csv"]


def test_a_number_that_is_none_is_an_empty_cell() -> None:
    text = csv_text(pd.DataFrame({"a": [1.5, np.nan, np.inf, -0.0], "b": ["x", "", None, "y"]}))
    assert text == "a,b\n1.5,x\n,\n,\n0,y\n"
    assert pd.read_csv(io.StringIO(text)).shape == (4, 2)


def test_a_test_faulty_in_its_row_and_its_export_is_listed_once(study: Study) -> None:
    fault = study.ingested.set_aside[0]
    doubled = replace(study.ingested, set_aside=(fault, *study.ingested.set_aside))
    assert list(all_set_aside(replace(study, ingested=doubled))).count(fault.test_id) == 1


def test_a_faulty_row_of_the_campaign_keeps_its_place(study: Study) -> None:
    fault = SetAside("T0003b", "no such file", (Problem("missing_file", "no such file", file="tests.csv", row=4),))
    with_fault = replace(study.ingested, set_aside=(*study.ingested.set_aside, fault))
    order = result_tables.tests_table(replace(study, ingested=with_fault))["test_id"].tolist()
    assert order.index("T0003b") == order.index("T0003") + 1
    assert order[-1] == "T9001"
