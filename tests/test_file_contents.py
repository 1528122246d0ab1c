"""Whole files and folders: an error names its path, and a folder that cannot be listed is no empty folder."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hostile_zips import packed

from tribo.campaign import open_campaign
from tribo.drafting.draft import exports_in
from tribo.errors import CampaignError
from tribo.files import bytes_of, found_below, found_in, text_of, write_new
from tribo.input_files import unpack
from tribo.report.provenance import _output_hashes, input_names
from tribo.site.history import answers_of
from tribo.site.scan import contents


@pytest.fixture
def closed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder that the system does not list, beside others that it does; root may list what permissions forbid."""
    for name in ("raw/closed/T1.csv", "raw/T2.csv", "tests.csv"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("1,2\n")

    def refusing(listing: Callable[..., Any]) -> Callable[..., Any]:
        def listed(place: Any = ".") -> Any:
            if os.fspath(place) == str(tmp_path / "raw" / "closed"):
                raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), os.fspath(place))
            return listing(place)

        return listed

    for name in ("scandir", "listdir"):
        monkeypatch.setattr(os, name, refusing(getattr(os, name)))
    return tmp_path


LISTINGS: dict[str, Callable[[Path], Any]] = {
    "everything below a folder": found_below,
    "what stands in a folder": lambda folder: found_in(folder / "raw" / "closed", "*"),
    "inputs of a campaign": lambda folder: list(input_names(folder)),
    "outputs of a report": lambda folder: list(_output_hashes(folder)),
    "contents of a dated copy": contents,
    "exports for a new campaign": lambda folder: exports_in(folder / "raw"),
    "answers of reports about a law": lambda folder: answers_of(folder / "raw"),
}


@pytest.mark.parametrize("listing", LISTINGS)
def test_a_folder_that_cannot_be_listed_is_an_error_with_its_path(closed: Path, listing: str) -> None:
    with pytest.raises(PermissionError, match=r"closed"):
        LISTINGS[listing](closed)


def test_a_campaign_is_not_said_to_be_absent_where_a_folder_cannot_be_listed(closed: Path) -> None:
    with pytest.raises((CampaignError, PermissionError)) as caught, open_campaign(closed):
        pass
    assert "closed" in str(caught.value)
    assert "no campaign.toml" not in str(caught.value)


def test_an_error_while_a_file_is_read_names_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any, **__: Any) -> None:
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    monkeypatch.setattr(Path, "read_bytes", refuse)
    monkeypatch.setattr(Path, "read_text", refuse)
    for read in (bytes_of, text_of):
        with pytest.raises(OSError, match=r"a\.json"):
            read(tmp_path / "a.json")


def test_nothing_is_left_of_a_new_file_that_cannot_be_written(tmp_path: Path) -> None:
    with pytest.raises(UnicodeEncodeError):
        write_new(tmp_path / "a.toml", "title\ud800")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
def test_an_error_while_an_entry_of_a_zip_is_unpacked_names_the_new_file(tmp_path: Path) -> None:
    (tmp_path / "c.zip").write_bytes(packed())
    (tmp_path / "there").mkdir()
    (tmp_path / "there" / "tests.csv").symlink_to("/dev/full")
    with pytest.raises(OSError, match=r"No space left on device: '.*there/tests\.csv'"):
        unpack(tmp_path / "c.zip", tmp_path / "there")


def test_there_is_nothing_in_a_folder_that_is_not_there(tmp_path: Path) -> None:
    assert found_below(tmp_path / "none") == found_in(tmp_path / "none", "*") == []
