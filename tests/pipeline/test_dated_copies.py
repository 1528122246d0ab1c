"""Dated copies appear whole, share nothing, and only the last so many stay, whatever the clock says."""

from __future__ import annotations

import errno
import os
import shutil
from pathlib import Path

import pytest

from tribo.errors import TriboError
from tribo.files import write_text
from tribo.site.scan import clear_unfinished, date_build, dated

DAY = 86400.0


def write(site: Path, text: str, name: str = "a/report.html") -> None:
    """A finished output, written as tribo does."""
    write_text(site / "current" / name, text)


def test_only_the_last_builds_stay_and_latest_is_the_newest(tmp_path: Path) -> None:
    for day in range(5):
        write(tmp_path, f"day {day}")
        date_build(tmp_path, keep=3, now=day * DAY)
    kept = dated(tmp_path / "builds")
    assert [p.name[:10] for p in kept] == ["1970-01-03", "1970-01-04", "1970-01-05"]
    assert [(p / "a/report.html").read_text() for p in kept] == ["day 2", "day 3", "day 4"]
    assert (tmp_path / "latest").resolve() == kept[-1].resolve()
    assert not os.path.isabs(os.readlink(tmp_path / "latest"))


def test_nothing_new_makes_no_build(tmp_path: Path) -> None:
    write(tmp_path, "same")
    assert date_build(tmp_path, keep=3, now=0.0) is not None
    write(tmp_path, "same")
    assert date_build(tmp_path, keep=3, now=DAY) is None
    assert len(dated(tmp_path / "builds")) == 1


def test_an_old_build_does_not_change_with_the_current_one(tmp_path: Path) -> None:
    write(tmp_path, "old")
    write(tmp_path, "same", "b/report.html")
    old = date_build(tmp_path, keep=3, now=0.0)
    write(tmp_path, "new")
    new = date_build(tmp_path, keep=3, now=DAY)
    assert old is not None
    assert new is not None
    assert ((old / "a/report.html").read_text(), (new / "a/report.html").read_text()) == ("old", "new")


def test_an_edit_of_a_copy_or_of_the_current_files_changes_no_other(tmp_path: Path) -> None:
    write(tmp_path, "first")
    write(tmp_path, "same", "b/report.html")
    old = date_build(tmp_path, keep=3, now=0.0)
    write(tmp_path, "second")
    new = date_build(tmp_path, keep=3, now=DAY)
    assert old is not None
    assert new is not None
    places = [folder / "b/report.html" for folder in (old, new, tmp_path / "current")]
    for k, place in enumerate(places):
        place.write_text(f"edit {k}")  # in place, as an editor does
    assert [place.read_text() for place in places] == ["edit 0", "edit 1", "edit 2"]


def test_with_the_clock_set_back_the_new_copy_stays_and_is_the_latest(tmp_path: Path) -> None:
    made = []
    for day in (5, 6, 1, 0, 7):
        write(tmp_path, f"day {day}")
        new = date_build(tmp_path, keep=2, now=day * DAY)
        assert new is not None
        made.append(new)
        assert (tmp_path / "latest/a/report.html").read_text() == f"day {day}"
        assert dated(tmp_path / "builds") == made[-2:]


@pytest.mark.parametrize("keep", [1, 3])
def test_latest_points_to_the_newest_copy_after_a_kill_or_a_deletion(tmp_path: Path, keep: int) -> None:
    for day in range(3):
        write(tmp_path, f"day {day}")
        date_build(tmp_path, keep=3, now=day * DAY)
    copies = dated(tmp_path / "builds")
    (tmp_path / "latest").unlink()  # a kill after the copy and before the link
    (tmp_path / "latest").symlink_to(copies[0].relative_to(tmp_path))
    date_build(tmp_path, keep=keep, now=4 * DAY)
    assert (tmp_path / "latest").resolve() == copies[-1].resolve()
    shutil.rmtree(copies[-1])
    date_build(tmp_path, keep=keep, now=5 * DAY)
    assert (tmp_path / "latest/a/report.html").read_text() == "day 2"


def test_copies_of_earlier_versions_are_older_than_all_others(tmp_path: Path) -> None:
    for name in ("2099-01-01T000000Z", "2099-01-01T000000Z-2", "2099-01-01T000000Z-10"):
        (tmp_path / "builds" / name).mkdir(parents=True)
    write(tmp_path, "now")
    new = date_build(tmp_path, keep=2, now=0.0)
    assert [p.name for p in dated(tmp_path / "builds")] == ["2099-01-01T000000Z-10", new.name if new else ""]


def test_work_in_progress_and_leftovers_of_a_killed_build_are_not_copied(tmp_path: Path) -> None:
    write(tmp_path, "page")
    write(tmp_path, "runs", "a/kept/F@1Pa.nc")
    write(tmp_path, "half", "a/.report.html.12.part")
    (tmp_path / "builds" / ".1970-01-01T000000Z.part").mkdir(parents=True)
    (tmp_path / ".latest.part").symlink_to("builds")
    clear_unfinished(tmp_path)
    new = date_build(tmp_path, keep=1, now=0.0)
    assert new is not None
    assert {p.relative_to(new).as_posix() for p in new.rglob("*") if p.is_file()} == {"a/report.html", ".number"}
    assert [p.name for p in (tmp_path / "builds").iterdir()] == [new.name]
    assert not os.path.lexists(tmp_path / ".latest.part")


@pytest.mark.parametrize("failing", ["shutil.copytree", "pathlib.Path.rename", "os.symlink", "os.replace"])
def test_a_copy_that_cannot_be_finished_leaves_nothing_half_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failing: str
) -> None:
    real = shutil.copytree

    def full(*given: object, **named: object) -> None:
        if failing == "shutil.copytree":
            real(*given, **named)  # type: ignore[arg-type]
        raise OSError(errno.ENOSPC, "No space left on device")

    write(tmp_path, "page")
    with monkeypatch.context() as patched:
        patched.setattr(failing, full)
        with pytest.raises(OSError, match="No space left"):
            date_build(tmp_path, keep=1, now=0.0)
    assert [p.name for p in (*tmp_path.glob(".*"), *(tmp_path / "builds").glob(".*"))] == []


def test_a_copy_whose_number_cannot_be_read_is_not_taken_for_the_oldest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def failing(self: Path, **_: object) -> str:
        raise OSError(errno.EIO, "Input/output error")

    write(tmp_path, "first")
    new = date_build(tmp_path, keep=1, now=0.0)
    assert new is not None
    monkeypatch.setattr(Path, "read_text", failing)
    with pytest.raises(OSError, match="Input/output") as why:
        date_build(tmp_path, keep=1, now=DAY)
    assert why.value.filename == str(new / ".number")


def test_two_builds_within_a_second_have_two_names_in_order(tmp_path: Path) -> None:
    names = []
    for k in range(12):
        write(tmp_path, str(k))
        new = date_build(tmp_path, keep=20, now=0.0)
        assert new is not None
        names.append(new.name)
    assert [p.name for p in dated(tmp_path / "builds")] == names


def test_the_newest_build_is_always_kept(tmp_path: Path) -> None:
    with pytest.raises(TriboError, match="must be kept"):
        date_build(tmp_path, keep=0)
