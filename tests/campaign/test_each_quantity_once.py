"""A column that says what another one says is no second variable."""

from __future__ import annotations

from pathlib import Path

import pytest

from tribo.campaign import load_campaign
from tribo.records import Campaign

TOML = '[campaign]\ntitle = "t"\nnominal_area_mm2 = 50\n[patterns.F]\ncavity = "none"\n'


def campaign(folder: Path, columns: str, *rows: str) -> Campaign:
    (folder / "raw").mkdir()
    (folder / "campaign.toml").write_text(TOML, encoding="utf-8")
    lines = [f"test_id,file,sample,normal_load_N,{columns}"]
    for k, row in enumerate(rows, start=1):
        (folder / "raw" / f"T{k}.csv").write_text("Time [s],Force [N]\n0,1\n1,2\n", encoding="utf-8")
        lines.append(f"T{k},raw/T{k}.csv,F,{row}")
    (folder / "tests.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return load_campaign(folder)


def dropped(found: Campaign) -> dict[str, str]:
    return {str(p.column): p.what for p in found.problems if p.kind == "same_quantity"}


@pytest.mark.parametrize(
    ("columns", "rows", "beside"),
    [
        ("speed_mm_s,speed_rps", ("1,6.28,1", "2,12.6,2", "3,31.4,5"), "speed_mm_s"),
        ("speed_mm_s,nominal_load_N", ("1.01,1,1", "2.01,1,2", "2.99,1,3"), "the load"),
        ("speed_mm_s,load_gf", ("1,1,102", "2,1,204", "3,1,306"), "the load"),
    ],
)
def test_a_quantity_in_another_unit_is_named_beside_its_column_and_is_no_covariate(
    tmp_path: Path, columns: str, rows: tuple[str, ...], beside: str
) -> None:
    found = campaign(tmp_path, columns, *rows)
    name = columns.rpartition(",")[2]
    assert list(dropped(found)) == [name]
    assert beside in dropped(found)[name]
    assert all(name not in test.covariates for test in found.tests)


@pytest.mark.parametrize(
    ("columns", "rows"),
    [
        ("speed_mm_s,speed_rpm", ("1,6.28,60", "2,6.28,30", "3,31.4,300")),  # at two radii
        ("speed_mm_s,load_cell", ("1,1,1", "2,1,2", "3,1,3")),
        ("repeat,run_order", ("1,1,1", "1,2,2", "1,1,3")),
    ],
)
def test_a_column_that_says_something_of_its_own_stays(tmp_path: Path, columns: str, rows: tuple[str, ...]) -> None:
    found = campaign(tmp_path, columns, *rows)
    assert not dropped(found)
    assert [t.repeat for t in found.tests] == ([1, 2, 1] if "repeat" in columns else [None] * 3)


def test_a_repeat_that_counts_the_tests_in_their_order_is_the_run_order(tmp_path: Path) -> None:
    found = campaign(tmp_path, "repeat,run_order", "2,1,1", "2,2,2", "2,5,3")
    assert list(dropped(found)) == ["repeat"]
    assert [(t.repeat, t.run_order) for t in found.tests] == [(None, 1), (None, 2), (None, 3)]
