"""A load that some exports record and others do not: rows that state it leave the others to their records."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tribo import stages
from tribo.campaign import load_campaign
from tribo.records import Ingested

TOML = '[campaign]\ntitle = "t"\nnominal_area_mm2 = 50\nzero = "none"\n[patterns.F]\ncavity = "none"\n'
TIME = np.arange(0, 20, 0.05)


def export(path: Path, load: str, encoding: str = "utf-8") -> None:
    """A pull of 2 N sliding; under 5.1 N where ``load`` names a column for it."""
    noise = np.random.default_rng(len(load)).normal(0, 0.005, TIME.size)
    force = np.interp(TIME, [0, 4, 7, 7.1, 20], [0, 0, 3, 2, 2]) + noise
    head = "Time [s];Friction [N]" + (f";{load}" if load else "")
    rows = (f"{t:.2f};{f:.4f}" + (";5.1" if load else "") for t, f in zip(TIME, force, strict=True))
    path.write_bytes((head + "\n" + "\n".join(rows) + "\n").encode(encoding))


def ingested(folder: Path, rows: list[str], extra: str = "") -> Ingested:
    (folder / "campaign.toml").write_text(TOML + extra, encoding="utf-8")
    table = ["test_id,file,sample,normal_load_N", *rows]
    (folder / "tests.csv").write_text("\n".join(table) + "\n", encoding="utf-8")
    return stages.ingest(load_campaign(folder))


@pytest.mark.parametrize(
    ("load", "encoding"),
    [("Fz [N]", "utf-8"), ("Load_N", "utf-8"), ("荷重 [N]", "cp932"), ("Obciążenie [N]", "cp1250")],
)
def test_a_row_without_a_load_takes_the_recorded_one_beside_rows_that_state_theirs(
    tmp_path: Path, load: str, encoding: str
) -> None:
    (tmp_path / "raw").mkdir()
    export(tmp_path / "raw" / "a.csv", load, encoding)
    export(tmp_path / "raw" / "b.csv", "")
    found = ingested(tmp_path, ["T1,raw/a.csv,F,", "T2,raw/b.csv,F,7"])
    assert not found.set_aside
    assert [t.normal_load_N for t in found.campaign.tests] == pytest.approx([5.1, 7.0])


def test_a_load_in_a_column_that_is_stated_is_taken_as_well_and_one_of_an_unknown_name_by_the_remedy(
    tmp_path: Path,
) -> None:
    (tmp_path / "raw").mkdir()
    export(tmp_path / "raw" / "a.csv", "Channel 3 [N]")
    export(tmp_path / "raw" / "b.csv", "")
    rows = ["T1,raw/a.csv,F,", "T2,raw/b.csv,F,7"]
    (fault,) = ingested(tmp_path, rows).set_aside
    assert "raw/a.csv#1 in file" in fault.reason
    stated = '[columns."raw/a.csv"]\nnormal_force = "Channel 3"\n'
    for row in (rows[0], "T1,raw/a.csv#1,F,"):
        found = ingested(tmp_path, [row, rows[1]], stated)
        assert [t.normal_load_N for t in found.campaign.tests] == pytest.approx([5.1, 7.0])
