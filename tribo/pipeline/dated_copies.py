"""Dated copies of a site: the last so many are kept, and ``latest`` points to the newest."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import time
from contextlib import suppress
from pathlib import Path

from tribo.errors import Problem, TriboError
from tribo.file_contents import bytes_of, found_below, found_in, text_of
from tribo.store.whole_files import write_text

BUILDS, LATEST, CURRENT = "builds", "latest", "current"
NOT_COPIED = ("kept",)  # work in progress, not results
NUMBER = ".number"  # file in a copy: how many copies were made before, whatever the clock said
_DATED = re.compile(r"(\d{4}-\d\d-\d\dT\d{6}Z)(?:-(\d+))?")


def date_build(site: Path, keep: int, now: float | None = None) -> Path | None:
    """Copy ``current`` to ``builds/DATE`` if it differs from the newest copy, and delete all but the last ``keep``.

    A copy shares no storage with ``current`` or with another copy: an edit of one changes no other. It appears whole
    or not at all, ``latest`` after it; the order of the copies is that in which they were made, also where the clock
    was set back. Returns the new copy, None where there was nothing new.

    Raises
    ------
    TriboError
        ``keep`` is below 1.
    """
    if keep < 1:
        what = "at least the newest build must be kept"
        raise TriboError(Problem("keep_nothing", what, found=str(keep), allowed="1 or more"))
    current, builds = site / CURRENT, site / BUILDS
    builds.mkdir(parents=True, exist_ok=True)
    before = dated(builds)
    new = None
    if current.is_dir() and contents(current) != (contents(before[-1]) if before else None):
        new = _copy(current, builds, now)
    copies = [*before, *([new] if new else [])]
    if copies and not _points_to(site, copies[-1]):
        _point(site, copies[-1])
    for old in copies[:-keep]:
        shutil.rmtree(old)
    return new


def clear_unfinished(site: Path) -> None:
    """Remove the copies and links that a killed build has left half made; for the holder of the lock of the site."""
    for part in found_in(site / BUILDS, ".*.part"):
        shutil.rmtree(part)
    (site / f".{LATEST}.part").unlink(missing_ok=True)


def dated(builds: Path) -> list[Path]:
    """The dated copies in the order in which they were made, oldest first."""
    return sorted((p for p in builds.iterdir() if p.is_dir() and _DATED.fullmatch(p.name)), key=_order)


def _order(copy: Path) -> tuple[int, str, int]:
    """Number of a copy, then its date: copies of earlier versions bear no number and came before."""
    found = _DATED.fullmatch(copy.name)
    assert found is not None
    try:
        number = int(text_of(copy / NUMBER))
    except (FileNotFoundError, ValueError):
        number = 0
    return number, found[1], int(found[2] or 1)


def contents(folder: Path) -> dict[str, str]:
    """SHA-256 of every file that is copied, by its place in the folder."""
    files = sorted(p for p in found_below(folder) if p.is_file() and not _left_out(p.relative_to(folder)))
    return {p.relative_to(folder).as_posix(): hashlib.sha256(bytes_of(p)).hexdigest() for p in files}


def _left_out(place: Path) -> bool:
    return place.name.startswith(".") or any(part in NOT_COPIED for part in place.parts[:-1])


def _copy(current: Path, builds: Path, now: float | None) -> Path:
    stamp = time.strftime("%Y-%m-%dT%H%M%SZ", time.gmtime(now))
    name, repeated = stamp, 1
    while (builds / name).exists():
        repeated += 1
        name = f"{stamp}-{repeated}"
    part = builds / f".{name}.part"

    def skipped(folder: str, names: list[str]) -> set[str]:
        return {n for n in names if n.startswith(".") or n in NOT_COPIED}

    try:
        shutil.copytree(current, part, ignore=skipped)
        number = max((_order(copy)[0] for copy in dated(builds)), default=0) + 1
        write_text(part / NUMBER, f"{number}\n")
        part.rename(builds / name)
    except BaseException:
        shutil.rmtree(part, ignore_errors=True)
        raise
    return builds / name


def _points_to(site: Path, newest: Path) -> bool:
    link = site / LATEST
    return link.is_symlink() and link.resolve() == newest.resolve()


def _point(site: Path, new: Path) -> None:
    """Let ``latest`` point to the newest copy, in one step."""
    part = site / f".{LATEST}.part"
    try:
        part.symlink_to(new.relative_to(site), target_is_directory=True)
        os.replace(part, site / LATEST)
    except BaseException:
        with suppress(OSError):  # the first error is the one to report
            part.unlink(missing_ok=True)
        raise
