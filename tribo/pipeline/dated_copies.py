"""Dated copies of a site: the last so many are kept, and ``latest`` points to the newest."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import time
from pathlib import Path

from tribo.errors import Problem, TriboError

BUILDS, LATEST, CURRENT = "builds", "latest", "current"
NOT_COPIED = ("kept",)  # work in progress, not results
_DATED = re.compile(r"\d{4}-\d\d-\d\dT\d{6}Z(-\d+)?")


def date_build(site: Path, keep: int, now: float | None = None) -> Path | None:
    """Copy ``current`` to ``builds/DATE`` if it differs from the newest copy, and delete all but the last ``keep``.

    Files that did not change since the newest copy share its storage (hard links; plain copies where the file system
    has none): tribo never writes into a finished file. The copy appears whole or not at all, ``latest`` last.
    Returns the new copy, None where there was nothing new.

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
    for part in builds.glob(".*.part"):  # of a build that was killed
        shutil.rmtree(part)
    new = None
    if current.is_dir() and contents(current) != (contents(newest) if (newest := _newest(builds)) else None):
        new = _copy(current, builds, now)
        _point(site, new)
    for old in dated(builds)[:-keep]:
        shutil.rmtree(old)
    return new


def dated(builds: Path) -> list[Path]:
    """The dated copies, oldest first."""
    return sorted(p for p in builds.iterdir() if p.is_dir() and _DATED.fullmatch(p.name))


def _newest(builds: Path) -> Path | None:
    found = dated(builds)
    return found[-1] if found else None


def contents(folder: Path) -> dict[str, str]:
    """SHA-256 of every file that is copied, by its place in the folder."""
    files = sorted(p for p in folder.rglob("*") if p.is_file() and not _left_out(p.relative_to(folder)))
    return {p.relative_to(folder).as_posix(): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}


def _left_out(place: Path) -> bool:
    return place.name.startswith(".") or any(part in NOT_COPIED for part in place.parts[:-1])


def _copy(current: Path, builds: Path, now: float | None) -> Path:
    name = time.strftime("%Y-%m-%dT%H%M%SZ", time.gmtime(now))
    number = 1
    while (builds / name).exists():
        number += 1
        name = f"{name[:18]}-{number}"
    part = builds / f".{name}.part"

    def skipped(folder: str, names: list[str]) -> set[str]:
        return {n for n in names if n.startswith(".") or n in NOT_COPIED}

    shutil.copytree(current, part, ignore=skipped, copy_function=_linked)
    part.rename(builds / name)
    return builds / name


def _linked(source: str, target: str) -> None:
    try:
        os.link(source, target)
    except OSError:
        shutil.copy2(source, target)


def _point(site: Path, new: Path) -> None:
    """Let ``latest`` point to the new copy, in one step."""
    part = site / f".{LATEST}.part"
    part.unlink(missing_ok=True)
    part.symlink_to(new.relative_to(site), target_is_directory=True)
    os.replace(part, site / LATEST)
