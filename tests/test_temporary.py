"""Folders for temporary files are gone at their end, and after a kill at the next start; those in use stay."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import pytest

from tribo.temporary import PREFIX, temporary_folder

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="files are not locked on this system")
HOLDER = """
import sys, time
from tribo.temporary import temporary_folder
with temporary_folder() as folder:
    (folder / "export.csv").write_text("unpacked")
    print(folder, flush=True)
    time.sleep(60)
"""


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    return tmp_path


def test_the_folder_of_a_killed_process_goes_at_the_next_start_and_not_before(place: Path) -> None:
    environment = {**os.environ, "TMPDIR": str(place)}
    with subprocess.Popen([sys.executable, "-c", HOLDER], stdout=subprocess.PIPE, text=True, env=environment) as other:
        assert other.stdout is not None
        theirs = Path(other.stdout.readline().strip())
        with temporary_folder() as own:
            assert own != theirs
            assert (theirs / "export.csv").read_text() == "unpacked"
        other.kill()
        other.wait()
    assert theirs.is_dir()
    with temporary_folder() as own:
        assert list(place.iterdir()) == [own.parent]
    assert list(place.iterdir()) == []


def test_an_empty_folder_of_a_process_killed_before_it_held_anything_goes_too(place: Path) -> None:
    (place / f"{PREFIX}abc").mkdir(mode=0o700)
    with temporary_folder() as own:
        assert list(place.iterdir()) == [own.parent]


def test_folders_that_others_can_write_to_and_links_are_not_touched(place: Path) -> None:
    (place / "precious").mkdir()
    (place / f"{PREFIX}link").symlink_to("precious")
    (place / f"{PREFIX}open").mkdir()
    (place / f"{PREFIX}open").chmod(0o777)
    with temporary_folder():
        pass
    assert sorted(p.name for p in place.iterdir()) == ["precious", f"{PREFIX}link", f"{PREFIX}open"]


def test_an_error_inside_leaves_nothing_behind(place: Path) -> None:
    def fill() -> None:
        with temporary_folder() as own:
            (own / "half").write_text("half")
            raise OSError("no space")

    with pytest.raises(OSError, match="no space"):
        fill()
    assert list(place.iterdir()) == []


def test_what_could_not_be_removed_goes_at_the_next_start(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    remove = os.unlink

    def refuse(path: Any, **options: Any) -> None:
        if os.path.basename(path) == "export.csv":
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        remove(path, **options)

    with monkeypatch.context() as full:
        full.setattr(os, "unlink", refuse)
        with temporary_folder() as folder:
            (folder / "export.csv").write_text("unpacked")
    assert (folder / "export.csv").exists()
    with temporary_folder() as own:
        assert [p for p in place.iterdir() if p not in own.parents] == []


def test_no_file_is_written_to_find_the_place_of_temporary_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The standard library tries a folder with a file, which stays if the process is killed just then."""
    opened = []
    real = os.open

    def watched(path: str, *given: Any, **named: Any) -> int:
        opened.append(Path(path).parent)
        return real(path, *given, **named)

    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", None)
    monkeypatch.setattr(os, "open", watched)
    with temporary_folder() as folder:
        assert folder.is_relative_to(tmp_path)
    assert opened
    assert tmp_path not in opened
