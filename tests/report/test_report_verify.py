"""tribo verify says of every input and output whether it is what it was; stale files of an earlier run go."""

from __future__ import annotations

import json
import shutil
import zipfile
from dataclasses import replace
from pathlib import Path

import pytest
import xarray as xr
from click.testing import CliRunner
from hostile_zips import packed

from tribo.cli import main
from tribo.errors import CampaignError
from tribo.records import Study
from tribo.report import gather_provenance, verify, write_until
from tribo.report.provenance import file_hash, input_names, read_record


@pytest.fixture
def placed(of_two: Study, tmp_path: Path) -> tuple[Study, Path, Path]:
    """A study whose campaign lies on disk, its folder and the folder it is written to."""
    root = tmp_path / "campaign"
    (root / "raw").mkdir(parents=True)
    (root / "campaign.toml").write_text("[campaign]\n")
    (root / "tests.csv").write_text("test_id\n")
    for k in (1, 2):
        (root / "raw" / f"T000{k}.csv").write_text(f"{k}\n")
    campaign = replace(of_two.ingested.campaign, root=root)
    only_read = Study(replace(of_two.ingested, campaign=campaign))
    out = tmp_path / "out"
    write_until(only_read, out, "ingest", provenance=gather_provenance(only_read, options={"rule": "first_peak"}))
    return only_read, root, out


def differences(out: Path, campaign: Path | None = None) -> set[tuple[str, str, str]]:
    return {(d.kind, d.status, d.file) for d in verify(out, campaign).differences}


def test_nothing_changed_is_said_so(placed: tuple[Study, Path, Path]) -> None:
    _, root, out = placed
    found = verify(out)
    assert found.unchanged
    assert (found.n_inputs, found.n_outputs) == (4, 2)
    assert "no changes" in found.in_words()
    assert list(input_names(root)) == ["campaign.toml", "tests.csv", "raw/T0001.csv", "raw/T0002.csv"]


def test_every_change_is_named(placed: tuple[Study, Path, Path]) -> None:
    _, root, out = placed
    (root / "raw" / "T0001.csv").write_text("other\n")
    (root / "raw" / "T0002.csv").unlink()
    (root / "raw" / "T0003.csv").write_text("new\n")
    (out / "tests.csv").write_text("forged\n")
    (out / "note.txt").write_text("mine\n")
    (out / "campaign.nc").unlink()
    assert differences(out) == {
        ("input", "changed", "raw/T0001.csv"),
        ("input", "missing", "raw/T0002.csv"),
        ("input", "added", "raw/T0003.csv"),
        ("output", "changed", "tests.csv"),
        ("output", "missing", "campaign.nc"),
        ("output", "added", "note.txt"),
    }


def test_results_of_two_runs_are_told_apart_although_every_hash_is_that_of_the_record(
    placed: tuple[Study, Path, Path],
) -> None:
    only_read, _, out = placed
    other = out.with_name("other")
    write_until(only_read, other, "ingest", provenance=gather_provenance(only_read, options={"rule": "iso_8295"}))
    shutil.copy(other / "campaign.nc", out / "campaign.nc")
    record = read_record(out)
    assert record is not None
    record["outputs"]["campaign.nc"] = file_hash(out / "campaign.nc")
    (out / "provenance.json").write_text(json.dumps(record))
    assert differences(out) == {("output", "another run's", "campaign.nc")}


def test_a_run_that_has_not_ended_is_said(placed: tuple[Study, Path, Path]) -> None:
    _, _, out = placed
    (out / ".tribo.unfinished").touch()
    found = verify(out)
    assert not found.unchanged
    assert "has not ended" in found.in_words()


def test_what_is_kept_for_the_next_start_is_no_output(placed: tuple[Study, Path, Path]) -> None:
    _, _, out = placed
    (out / "kept").mkdir()
    (out / "kept" / "diagnosis.json").write_text("{}")
    assert verify(out).unchanged


def test_a_campaign_that_was_moved_or_zipped_is_found_where_it_is_said_to_be(
    placed: tuple[Study, Path, Path], tmp_path: Path
) -> None:
    _, root, out = placed
    archive = tmp_path / "campaign.zip"
    with zipfile.ZipFile(archive, "w") as z:
        for name in input_names(root):
            z.write(root / name, f"some/folder/{name}")
    shutil.move(root, tmp_path / "elsewhere")
    assert {status for _, status, _ in differences(out)} == {"missing"}
    assert differences(out, tmp_path / "elsewhere") == set()
    assert differences(out, archive) == set()


def test_a_bomb_in_place_of_the_campaign_is_refused_before_it_is_unpacked(
    placed: tuple[Study, Path, Path], tmp_path: Path
) -> None:
    (tmp_path / "bomb.zip").write_bytes(packed(("raw/x.csv", bytes(30 << 20))))
    with pytest.raises(CampaignError) as refused:
        verify(placed[2], tmp_path / "bomb.zip")
    assert [problem.kind for problem in refused.value.problems] == ["zip_bomb"]


def test_study_and_campaign_moved_together_still_verify(placed: tuple[Study, Path, Path], tmp_path: Path) -> None:
    moved = tmp_path / "moved"
    moved.mkdir()
    for name in ("campaign", "out"):
        shutil.move(tmp_path / name, moved / name)
    assert verify(moved / "out").unchanged


def test_the_command_ends_with_0_or_1(placed: tuple[Study, Path, Path], tmp_path: Path) -> None:
    _, _, out = placed
    assert CliRunner().invoke(main, ["verify", str(out)]).exit_code == 0
    (out / "tests.csv").write_text("forged\n")
    result = CliRunner().invoke(main, ["verify", str(out), "--json"])
    assert result.exit_code == 1
    record = json.loads(result.stdout)
    assert record["unchanged"] is False
    assert record["differences"] == [{"kind": "output", "status": "changed", "file": "tests.csv"}]


def test_a_folder_without_a_record_is_refused(tmp_path: Path) -> None:
    with pytest.raises(CampaignError, match="no record"):
        verify(tmp_path)


def outputs(out: Path) -> set[str]:
    record = read_record(out)
    assert record is not None
    return set(record["outputs"])


def test_a_later_command_over_the_same_inputs_keeps_what_an_earlier_one_wrote(
    placed: tuple[Study, Path, Path], of_two: Study
) -> None:
    only_read, _, out = placed
    fitted = replace(of_two, ingested=only_read.ingested, comparison=None)
    write_until(fitted, out, "fit", provenance=gather_provenance(fitted, options={"rule": "first_peak", "runs": "4"}))
    assert "fits.csv" in outputs(out)
    write_until(only_read, out, "ingest", provenance=gather_provenance(only_read, options={"rule": "first_peak"}))
    assert "fits.csv" in outputs(out)
    assert verify(out).unchanged
    with xr.open_datatree(out / "campaign.nc", engine="h5netcdf") as tree:
        assert tree["fits"].sizes["fit"] == len(of_two.fits)
        assert "row_size" in tree["traces"]


def test_what_no_longer_holds_is_removed_unless_someone_changed_it(
    placed: tuple[Study, Path, Path], of_two: Study
) -> None:
    only_read, _, out = placed
    fitted = replace(of_two, ingested=only_read.ingested, comparison=None)
    write_until(fitted, out, "fit", provenance=gather_provenance(fitted, options={"rule": "first_peak"}))
    (out / "other_fits.csv").write_text("my own notes\n")
    (out / "mine.txt").write_text("mine\n")
    write_until(only_read, out, "ingest", provenance=gather_provenance(only_read, options={"rule": "iso_8295"}))
    assert not (out / "fits.csv").exists()
    assert (out / "other_fits.csv").read_text() == "my own notes\n"
    assert (out / "mine.txt").exists()
