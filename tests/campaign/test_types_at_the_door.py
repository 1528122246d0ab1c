"""What tests.csv says is taken as what it is for: ids are text, dates are dates, numbers are possible ones."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from support.campaigns import written

from tribo.campaign import load_campaign
from tribo.campaign.table import order_of, parsed
from tribo.errors import CampaignError, Problem
from tribo.input_files import LARGEST_TABLE_BYTES

TOML = '[campaign]\ntitle = "door"\nnominal_area_mm2 = 55.0\n[patterns.F]\ncavity = "none"\n'
HEADER = "test_id,file,sample,specimen,normal_load_N,started_at,run_order,note"
IDS = ("001", "1", "1.0", "1e5", "01", "+1", "1e05", "nan", "inf", "None", "True", "-0")


def write(folder: Path, rows: list[str], toml: str = TOML, header: str = HEADER) -> Path:
    return written(folder, toml, [header, *rows], {f"{k}.csv": "1,2\n3,4\n5,6\n" for k in range(1, 20)})


def row(k: int, **cells: object) -> str:
    given = {"test_id": f"T{k}", "file": f"raw/{k}.csv", "sample": "F", "specimen": "F1", "normal_load_N": 0.5}
    given |= cells
    return ",".join(str(given.get(name, "")) for name in HEADER.split(","))


def faults(folder: Path, *rows: str) -> list[Problem]:
    """The problems of the second row among healthy ones, which stay usable."""
    campaign = load_campaign(write(folder, [row(1), *rows, row(9)]))
    assert {"T1", "T9"} <= {t.test_id for t in campaign.tests}
    return [p for s in campaign.set_aside for p in s.problems]


def test_ids_that_look_like_numbers_stay_apart(tmp_path: Path) -> None:
    rows = [row(k, test_id=i, specimen=i) for k, i in enumerate(IDS, start=1)]
    campaign = load_campaign(write(tmp_path, rows))
    assert tuple(t.test_id for t in campaign.tests) == IDS
    assert tuple(t.specimen for t in campaign.tests) == IDS
    assert not campaign.set_aside


@pytest.mark.parametrize(
    ("cell", "kind"),
    [
        ("yesterday", "not_a_date"), ("2026-13-45", "not_a_date"), ("1823-01-01", "not_a_date"),
        ("12:30", "not_a_date"), ("46013.5", "not_a_date"), ("2026-02-30T10:00:00", "not_a_date"),
        ("2026-02-03T25:00", "not_a_date"), ("3/2/2026", "not_a_date"), ("03/02/26", "not_a_date"),
    ],
)  # fmt: skip
def test_a_time_that_is_none_sets_its_test_aside_with_row_and_column(tmp_path: Path, cell: str, kind: str) -> None:
    (found,) = faults(tmp_path, row(2, started_at=cell))
    assert (found.kind, found.file, found.row, found.column, found.found) == (kind, "tests.csv", 3, "started_at", cell)


@pytest.mark.parametrize(
    ("cells", "iso"),
    [
        (["31/12/2025", "01/02/2026 14:05"], ["2025-12-31", "2026-02-01T14:05:00"]),
        (["12/31/2025", "01/02/2026 2:05 PM"], ["2025-12-31", "2026-01-02T14:05:00"]),
        (["1.2.2026 9:00"], ["2026-02-01T09:00:00"]),
        (["2026/2/1 09:00:07"], ["2026-02-01T09:00:07"]),
        (["2026-02-01T09:00:00+01:00", "20260201T0900"], ["2026-02-01T09:00:00+01:00", "2026-02-01T09:00:00"]),
        (["05/05/2026"], ["2026-05-05"]),
    ],
)
def test_dates_of_the_common_orders_are_read_as_the_column_settles_them(cells: list[str], iso: list[str]) -> None:
    assert [parsed(cell, order_of(cells)) for cell in cells] == iso


def test_a_column_that_settles_no_order_or_two_is_refused() -> None:
    for cells in (["01/02/2026"], ["31/12/2025", "12/31/2025"]):
        with pytest.raises(ValueError, match="of this column"):
            parsed("01/02/2026", order_of(cells))


def test_the_time_of_a_test_is_stored_as_iso_text(tmp_path: Path) -> None:
    rows = [row(1, started_at="31/12/2025 08:30"), row(2, started_at="01/02/2026")]
    campaign = load_campaign(write(tmp_path, rows))
    assert [t.started_at for t in campaign.tests] == ["2025-12-31T08:30:00", "2026-02-01"]


@pytest.mark.parametrize("load", ["1e300", "1e308", "5e-324", "1e-200", "1e16"])
def test_a_load_that_no_friction_test_has_is_refused(tmp_path: Path, load: str) -> None:
    (found,) = [p for p in faults(tmp_path, row(2, normal_load_N=load)) if p.column == "normal_load_N"][:1]
    assert found.kind in ("impossible_load", "impossible_number")
    assert (found.row, found.found) == (3, load)


def test_a_count_beyond_exact_whole_numbers_is_refused(tmp_path: Path) -> None:
    assert [p.kind for p in faults(tmp_path, row(2, run_order="1e300"))] == ["impossible_number"]


@pytest.mark.parametrize("column", ["test_id", "specimen", "sample"])
def test_a_name_with_a_control_character_is_refused(tmp_path: Path, column: str) -> None:
    (found,) = faults(tmp_path, row(2, **{column: "A\x1b[31mB"}))
    assert (found.kind, found.row, found.column) == ("control_character", 3, column)
    assert "\x1b" not in str(found)


def test_a_cell_of_131_kilobytes_names_its_row(tmp_path: Path) -> None:
    (found,) = faults(tmp_path, row(2, note="x" * 120_000))
    assert (found.kind, found.row, found.column) == ("cell_too_long", 3, "note")
    with pytest.raises(CampaignError) as refused:
        load_campaign(write(tmp_path, [row(1), row(2, note="x" * 140_000)]))
    assert [p.kind for p in refused.value.problems] == ["cell_too_long"]


def test_a_quotation_mark_that_is_not_closed_does_not_swallow_tests(tmp_path: Path) -> None:
    rows = [row(1), row(2, note='"open'), row(3), row(4, note='close"'), row(9)]
    campaign = load_campaign(write(tmp_path, rows))
    assert [t.test_id for t in campaign.tests] == ["T1", "T9"]
    (aside,) = campaign.set_aside
    assert [p.kind for p in aside.problems] == ["quote_not_closed"]


@pytest.mark.parametrize(
    "toml",
    [
        TOML + "x = " + "[" * 400 + "]" * 400 + "\n", TOML + "[a" + ".a" * 400 + "]\n",
        TOML.replace("55.0", "9" * 5000),
        TOML.replace("55.0", "1e300"), TOML.replace("55.0", "5e-324"), TOML.replace('"door"', '"\\u001b[31m"'),
        TOML.replace("patterns.F", 'patterns."F\\u0000"'), TOML + 'x = "\x00"\n',
        TOML.replace("patterns.F", f'patterns."{"ü" * 60}"'),
    ],
)  # fmt: skip
def test_a_hostile_description_is_refused_with_its_file(tmp_path: Path, toml: str) -> None:
    with pytest.raises(CampaignError) as refused:
        load_campaign(write(tmp_path, [row(1)], toml))
    assert {p.file for p in refused.value.problems} == {"campaign.toml"}
    assert max(len(str(p)) for p in refused.value.problems) < 1000


@pytest.mark.parametrize("name", ["tests.csv", "campaign.toml"])
def test_a_pipe_in_place_of_a_file_is_refused_and_not_waited_for(tmp_path: Path, name: str) -> None:
    write(tmp_path, [row(1)])
    (tmp_path / name).unlink()
    os.mkfifo(tmp_path / name)
    with pytest.raises(CampaignError, match="not a regular file"):
        load_campaign(tmp_path)


def test_a_table_larger_than_any_is_refused_before_it_is_read(tmp_path: Path) -> None:
    write(tmp_path, [row(1)])
    os.truncate(tmp_path / "tests.csv", LARGEST_TABLE_BYTES + 1)
    with pytest.raises(CampaignError, match="at most"):
        load_campaign(tmp_path)


def test_a_pipe_among_the_exports_costs_its_own_test_only(tmp_path: Path) -> None:
    write(tmp_path, [])
    (tmp_path / "raw" / "2.csv").unlink()
    os.mkfifo(tmp_path / "raw" / "2.csv")
    (tmp_path / "tests.csv").write_text("\n".join([HEADER, row(1), row(2), row(9), row(3, file=f"raw/{'x' * 300}")]))
    campaign = load_campaign(tmp_path)
    kinds = {s.test_id: [p.kind for p in s.problems] for s in campaign.set_aside}
    assert kinds["T2"] == ["not_a_file"]
    assert "T3" in kinds
    assert [t.test_id for t in campaign.tests] == ["T1", "T9"]
