"""The budget on the page says what dominates, and the power stands beside it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from report.laid_out import html
from tribo.records import Study
from tribo.report.content import budget_origins, budget_tables, paired_sentences
from tribo.report.tables import write_tables


def components(sample: str, regime: str, specimens: float) -> list[dict[str, object]]:
    shares = {"specimens": specimens, "wire angle": 99.9 - specimens, "mass": 0.1, "combined": 100.0}
    return [
        {
            "component": name, "type": {"specimens": "A", "combined": ""}.get(name, "B"), "u_mu": 0.1,
            "u_tau0_kPa": 0.2, "u_T_N": 0.05, "share_pct_mu": share, "share_pct_tau0_kPa": share,
            "share_pct_T_N": share, "dof": 2.0, "origin": f"origin of {name}", "sample": sample, "regime": regime,
        }
        for name, share in shares.items()
    ]  # fmt: skip


@pytest.fixture
def budgeted(study: Study) -> Study:
    rows = [r for s, share in (("A", 80.0), ("F", 30.0)) for r in components(s, "static", share)]
    return replace(study, budget=pd.DataFrame(rows), power=("two samples <x> apart",), outlying=("T0007 & siblings",))


def test_the_largest_component_is_named_for_each_sample(budgeted: Study) -> None:
    (table,) = budget_tables(budgeted)
    assert table["components"] == ["specimens", "wire angle"]
    assert [row[0] for row in table["rows"]] == ["F", "A"]
    assert [table["components"][k] for k in table["largest"]] == ["wire angle", "specimens"]
    expected = "Largest contribution to the uncertainty of the static force: wire angle for F; specimens for A."
    assert table["sentence"] == expected


def test_type_b_components_say_what_they_rest_on(budgeted: Study) -> None:
    assert budget_origins(budgeted) == [("wire angle", "origin of wire angle"), ("mass", "origin of mass")]


def test_the_page_shows_budget_power_and_outlying_pulls(budgeted: Study) -> None:
    page = html(budgeted, drawn={})
    assert "<strong>80</strong>" in page
    assert "two samples &lt;x&gt; apart" in page
    assert "T0007 &amp; siblings" in page


def test_the_budget_is_a_table_of_its_own(budgeted: Study, tmp_path: Path) -> None:
    write_tables(budgeted, tmp_path)
    assert len(pd.read_csv(tmp_path / "budget.csv")) == 8


def test_a_study_without_a_budget_has_no_such_section(study: Study) -> None:
    assert 'id="uncertainty"' not in html(study, drawn={})
    assert budget_tables(study) == []


def test_samples_on_the_same_specimens_are_compared_by_their_difference(study: Study) -> None:
    row = {
        "sample": "Sx", "other": "Sy", "regime": "static", "number": "T_N", "pressure_Pa": 10e3, "difference": -0.25,
        "u": 0.0123, "unpaired_u": 0.0456, "low": -0.30, "high": -0.20, "specimens": "S1;S2;S3",
    }  # fmt: skip
    paired = replace(study, differences=pd.DataFrame([row, {**row, "number": "mu"}]))
    (sentence,) = paired_sentences(paired)
    assert "Sx minus Sy, measured on the same 3 specimens: −0.250 ± 0.012 N" in sentence
    assert "With different specimens the uncertainty would be ± 0.046 N" in sentence
    assert "on the same 3 specimens" in html(paired, drawn={}).replace("\u00a0", " ")
    assert paired_sentences(study) == []
