"""A drop folder is told by content, and what is still on its way is left alone and named."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path
from types import SimpleNamespace

import pytest

from tribo.site import scan as scanning
from tribo.site.scan import UPLOAD_SUFFIXES, difference, scan


@pytest.fixture
def drop(tmp_path: Path) -> Path:
    """A folder with the campaign ``a`` of three files."""
    raw = tmp_path / "a" / "raw"
    raw.mkdir(parents=True)
    for name in ("campaign.toml", "tests.csv", "raw/T1.csv"):
        (tmp_path / "a" / name).write_text(name)
    return tmp_path


def test_the_digest_follows_contents_and_no_time(drop: Path) -> None:
    (before,) = scan(drop, 0.0)
    os.utime(drop / "a" / "tests.csv", (1.0, 1.0))
    assert scan(drop, 0.0)[0].digest == before.digest
    (drop / "a" / "raw" / "T1.csv").write_text("raw/T1.csX")
    assert scan(drop, 0.0)[0].digest != before.digest


UPLOADS = ["raw/.T2.csv.part", "raw/~$T2.csv", *(f"raw/T2.csv{suffix}" for suffix in UPLOAD_SUFFIXES)]


@pytest.mark.parametrize("name", UPLOADS)
def test_a_file_being_uploaded_holds_its_campaign_back_and_is_named(drop: Path, name: str) -> None:
    (drop / "a" / name).write_text("half")
    (found,) = scan(drop, 0.0)
    assert found.waiting == (f"{name} is being uploaded",)


def test_a_young_file_holds_its_campaign_back_until_it_has_settled(drop: Path) -> None:
    (found,) = scan(drop, settle_s=30.0)
    assert len(found.waiting) == 3
    assert all(why.endswith(" changed less than 30 s ago") for why in found.waiting)
    assert scan(drop, settle_s=0.0)[0].waiting == ()


def test_a_copy_that_kept_its_old_date_is_young_all_the_same(drop: Path) -> None:
    os.utime(drop / "a" / "raw" / "T1.csv", (1.0, 1.0))
    (found,) = scan(drop, settle_s=30.0)
    assert any(why.startswith("raw/T1.csv changed") for why in found.waiting)


def test_a_file_that_grows_while_it_is_read_is_named(drop: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    growing = drop / "a" / "raw" / "T1.csv"

    class WhileItIsWritten:
        """A hash during which the machine goes on writing."""

        def __init__(self, data: bytes = b"") -> None:
            self._hash = hashlib.sha256(data)

        def update(self, data: bytes) -> None:
            self._hash.update(data)
            if data.startswith(b"raw/T1"):
                with growing.open("ab") as stream:
                    stream.write(b"more")

        def hexdigest(self) -> str:
            return self._hash.hexdigest()

    monkeypatch.setattr(scanning, "hashlib", SimpleNamespace(sha256=WhileItIsWritten))
    (found,) = scan(drop, 0.0)
    assert found.waiting == ("raw/T1.csv is still being written",)


def test_a_folder_without_a_campaign_yet_waits(tmp_path: Path) -> None:
    (tmp_path / "b" / "raw").mkdir(parents=True)
    (tmp_path / "b" / "raw" / "T1.csv").write_text("1")
    (found,) = scan(tmp_path, 0.0)
    assert found.waiting == ("campaign.toml is missing so far",)


def test_a_half_uploaded_archive_waits_and_a_whole_one_is_a_campaign(drop: Path) -> None:
    (drop / "b.zip.part").write_bytes(b"PK")
    (drop / "c.zip").write_bytes(b"PK")
    found = {c.name: c for c in scan(drop, 0.0)}
    assert found["b.zip.part"].waiting == ("b.zip.part is being uploaded",)
    assert (found["c"].waiting, list(found["c"].files)) == ((), ["c.zip"])


def test_two_campaigns_of_one_name_are_refused_and_the_others_are_built(drop: Path) -> None:
    (drop / "a.zip").write_bytes(b"PK")
    (drop / "b.zip").write_bytes(b"PK")
    found = {c.name: c for c in scan(drop, 0.0)}
    assert list(found) == ["a", "a.zip", "b"]
    assert [c.is_ready for c in found.values()] == [False, False, True]
    assert all("rename one of them" in found[name].refused[0] for name in ("a", "a.zip"))


def test_names_that_look_the_same_have_a_row_each(drop: Path) -> None:
    for name in (b"\xff", b"\xfe", b"\xfd"):
        os.mkdir(os.fsencode(drop) + b"/" + name)
    found = scan(drop, 0.0)
    assert len({c.name for c in found}) == len(found) == 4
    assert [c.is_ready for c in found].count(True) == 1


def test_a_campaign_of_holes_is_refused_before_it_is_read(drop: Path) -> None:
    with (drop / "a" / "raw" / "T2.csv").open("wb") as out:
        out.truncate(8 << 40)
    (drop / "b.zip").touch()
    os.truncate(drop / "b.zip", 8 << 40)
    for campaign in scan(drop, 0.0):
        assert "at most 50000000000 are allowed" in campaign.refused[0]


def test_overrides_beside_a_campaign_belong_to_it(drop: Path) -> None:
    (before,) = scan(drop, 0.0)
    (drop / "a.overrides.csv").write_text("test_id,action\n")
    (found,) = scan(drop, 0.0)
    assert found.overrides == drop / "a.overrides.csv"
    assert found.digest != before.digest
    assert difference(before.files, found.files) == "added a.overrides.csv"


def test_a_difference_names_what_changed_was_added_and_removed() -> None:
    old, new = {"x": "1", "y": "1", "z": "1"}, {"x": "2", "y": "1", "w": "1"}
    assert difference(old, new) == "changed x; added w; removed z"
    assert difference(old, old) == ""
    assert difference(None, new) == "new"
