"""Zips that do harm are refused in a sentence before anything is unpacked; ordinary ones of all systems are read."""

from __future__ import annotations

import os
import unicodedata
import zipfile
from pathlib import Path

import pytest
from hostile_zips import EXPORT, GOOD, TESTS, Hostile, all_hostile, commented, named, numbers, packed, raw_name, sharing

from tribo.campaign import open_campaign
from tribo.errors import CampaignError, ReadError
from tribo.input_files import opened_zip, pieces, unpack
from tribo.readers import read_export

HOSTILE = all_hostile()


@pytest.mark.parametrize("hostile", HOSTILE, ids=lambda h: h.name)
def test_a_hostile_zip_is_refused_in_a_sentence_and_leaves_nothing_behind(
    hostile: Hostile, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    temporary, archive = tmp_path / "tmp", tmp_path / "c.zip"
    temporary.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(temporary))
    archive.write_bytes(hostile.make())
    with pytest.raises(CampaignError) as caught, open_campaign(archive):
        pass
    assert {p.kind for p in caught.value.problems} == {hostile.kind}
    assert all(p.file == "c.zip" for p in caught.value.problems)
    assert hostile.shown in (caught.value.problems[0].found or "")
    assert sorted(os.listdir(tmp_path)) == ["c.zip", "tmp"]
    assert os.listdir(temporary) == []


def test_there_are_as_many_hostile_zips_as_the_attack_had() -> None:
    assert len({h.name for h in HOSTILE}) == len(HOSTILE) >= 86


DECOMPOSED = unicodedata.normalize("NFD", "raw/é.csv")


@pytest.mark.parametrize(
    "name",
    ["raw\\T1.csv", "./raw/T1.csv", "raw//T1.csv", DECOMPOSED, "raw/10:30.csv", "a/" * 9],
)
def test_names_as_other_programs_write_them_are_read(tmp_path: Path, name: str) -> None:
    plain = name.replace("\\", "/").replace("./", "").replace("//", "/")
    good = {k: v for k, v in GOOD.items() if k != plain}
    good["tests.csv"] = TESTS.replace("raw/T1.csv", plain)
    (tmp_path / "c.zip").write_bytes(packed(named(name, EXPORT.encode()), good=good))
    with opened_zip(tmp_path / "c.zip") as (opened, found):
        assert plain in found or name.endswith("/")
        assert all(b"".join(pieces(opened, e, "c.zip")) for path, e in found.items() if not path.endswith("/"))


def test_forty_thousand_entries_are_none_too_many(tmp_path: Path) -> None:
    (tmp_path / "c.zip").write_bytes(sharing(numbers(40_000)))
    with opened_zip(tmp_path / "c.zip") as (_, found):
        assert len(found) == 40_004


def test_a_full_disk_is_not_taken_for_a_damaged_zip(tmp_path: Path) -> None:
    (tmp_path / "c.zip").write_bytes(packed())
    (tmp_path / "there").mkdir()
    (tmp_path / "there" / "tests.csv").mkdir()
    with pytest.raises(IsADirectoryError):
        unpack(tmp_path / "c.zip", tmp_path / "there")


def test_the_entries_at_fault_are_named_five_at_most_of_each_kind(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "c.zip", "w") as out:
        for k in range(1000):
            out.writestr(f"../{k}", "")
        out.writestr("raw/\n", "")
    with pytest.raises(CampaignError) as caught, open_campaign(tmp_path / "c.zip"):
        pass
    outside, control = caught.value.problems
    assert outside.found == "../0, ../1, ../2, ../3, ../4 and 995 more"
    assert control.found == "raw/\n"
    assert "\n" not in str(control)


def test_a_packed_export_with_a_name_that_is_not_utf8_is_refused_in_a_sentence(tmp_path: Path) -> None:
    (tmp_path / "T1.zip").write_bytes(raw_name(b"raw/\xff.csv"))
    with pytest.raises(ReadError) as caught:
        read_export(tmp_path / "T1.zip")
    assert [p.kind for p in caught.value.problems] == ["bad_archive"]


def test_a_packed_export_that_programs_unpack_differently_is_refused(tmp_path: Path) -> None:
    other = packed(good={"raw/T2.csv": EXPORT})
    (tmp_path / "T1.zip").write_bytes(commented(other, good={"raw/T1.csv": EXPORT}))
    with pytest.raises(ReadError, match="mark of the end") as caught:
        read_export(tmp_path / "T1.zip")
    assert [p.kind for p in caught.value.problems] == ["bad_archive"]
