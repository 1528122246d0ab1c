"""Folders of a build: the campaigns dropped, by the contents of their files, and the dated copies of the site."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

from tribo.errors import CampaignError, Problem, TriboError, naming, system_problem
from tribo.files import LEADS_OUT, bytes_of, found_below, found_in, leads_out, paths_below, text_of, write_text
from tribo.input_files import LONGEST_NAME, MOST_DROPPED_BYTES
from tribo.user_text import is_control, well_formed

# how copying programs and browsers name a file that is not whole yet
UPLOAD_SUFFIXES = (".part", ".partial", ".tmp", ".temp", ".crdownload", ".download", ".filepart", ".upload", ".!ut")
OVERRIDES = ".overrides.csv"
_NOT_IN_NAMES = ("\\",)
_PAGES_OF_THE_SITE = ("index.html", "trend.csv")
IGNORED = ("Thumbs.db", "desktop.ini", ".DS_Store")
LEADS_NOWHERE = "this is a link that leads to no file or folder; put the file or folder itself here"
_CHUNK = 1 << 20
_LINK = "a link that leads out of the campaign"  # in place of a hash: nothing behind it is read


@dataclass(frozen=True)
class Dropped:
    """A campaign folder or .zip of a drop folder.

    ``files`` maps each file (relative to the campaign) to its SHA-256, ``waiting`` says which files are not whole
    yet and why; a campaign with such files is postponed. ``overrides`` is NAME.overrides.csv beside the
    campaign: decisions made by hand about single pulls. ``refused`` says why it cannot be built as it is.
    """

    name: str
    path: Path
    files: Mapping[str, str] = field(default_factory=dict)
    waiting: tuple[str, ...] = ()
    overrides: Path | None = None
    refused: tuple[str, ...] = ()

    @property
    def is_ready(self) -> bool:
        """Whether it can be built now."""
        return not (self.waiting or self.refused)

    @property
    def digest(self) -> str:
        """One SHA-256 over the names and contents of all files."""
        listing = "".join(f"{digest}  {name}\n" for name, digest in sorted(self.files.items()))
        return hashlib.sha256(listing.encode()).hexdigest()


def scan(drop: Path, settle_s: float = 60.0) -> tuple[Dropped, ...]:
    """Every campaign of a drop folder, by name.

    A folder is one campaign, and so is a .zip. A file changed less than ``settle_s`` seconds ago, one that changes
    while it is read, and one whose name says that it is being uploaded is not whole yet. Two campaigns of one name
    ("a" and "a.zip") are both refused, and listed under names of their own.

    Raises
    ------
    CampaignError
        No such folder.
    """
    if not drop.is_dir():
        raise CampaignError(Problem("missing", "this folder does not exist", file=str(drop)))
    found = [_looked_at(path, settle_s) for path in sorted(drop.iterdir()) if _is_campaign(path)]
    often = Counter(campaign.name for campaign in found)
    taken = {name for name, times in often.items() if times == 1}
    for k, campaign in enumerate(found):
        if often[campaign.name] == 1:
            continue
        name, number = well_formed(campaign.path.name), 1
        while name in taken:
            number += 1
            name = f"{campaign.name} ({number})"
        taken.add(name)
        what = "this name is that of another campaign, a folder or a .zip; rename one of them"
        found[k] = replace(campaign, name=name, waiting=(), refused=(*campaign.refused, what))
    return tuple(found)


def _looked_at(path: Path, settle_s: float) -> Dropped:
    """A campaign with its files; one whose name or files cannot be used is refused, and no other."""
    shown = well_formed(path.name)
    if why := _name_fault(path.stem if path.is_file() and not _uploading(path.name) else path.name):
        return Dropped(shown, path, refused=(f"the name of this campaign {why}; rename it",))
    try:
        return _with_overrides(_look(path, settle_s), settle_s)
    except OSError as why_not:
        return Dropped(shown, path, refused=(str(system_problem(why_not, shown)),))


def _name_fault(name: str) -> str:
    """Why files and folders cannot be named after a campaign, as the end of a sentence; empty where they can."""
    if well_formed(name) != name or any(map(is_control, name)):
        return "is not valid UTF-8 or contains a control character"
    if len(name.encode()) > LONGEST_NAME:
        return f"is longer than {LONGEST_NAME} bytes"
    if found := [c for c in _NOT_IN_NAMES if c in name]:
        return f"contains {' '.join(found)}"
    if name.lower() in _PAGES_OF_THE_SITE:
        return "is that of a page of the site"
    return ""


def _is_campaign(path: Path) -> bool:
    if path.name.startswith("."):
        return False
    return path.is_dir() or path.suffix.lower() == ".zip" or _uploading(path.name) or _leads_nowhere(path)


def _leads_nowhere(path: Path) -> bool:
    return path.is_symlink() and not (path.is_file() or path.is_dir())


def _uploading(name: str) -> bool:
    return name.lower().endswith(UPLOAD_SUFFIXES) or name.startswith(("~$", ".~", ".syncthing."))


def _look(path: Path, settle_s: float) -> Dropped:
    if leads_out(path.parent, path):
        return Dropped(path.stem if path.suffix.lower() == ".zip" else path.name, path, waiting=(LEADS_OUT,))
    if _leads_nowhere(path):
        return Dropped(path.name, path, refused=(LEADS_NOWHERE,))
    if path.is_file():
        name = path.stem if not _uploading(path.name) else path.name
        if too_much := _too_much([path]):
            return Dropped(name, path, refused=(too_much,))
        why = _not_whole(path, settle_s)
        if why:
            return Dropped(name, path, waiting=(f"{path.name} {why}",))
        digest, changed = _hashed(path)
        return Dropped(name, path, {path.name: digest}, (f"{path.name} is still being written",) if changed else ())
    files, waiting = {}, []
    below = list(_files(path))
    if too_much := _too_much([file for file, outward in below if not outward]):
        return Dropped(path.name, path, refused=(too_much,))
    for file, outward in below:
        shown = well_formed(file.relative_to(path).as_posix())
        if outward:
            files[shown] = _LINK
            continue
        why = _not_whole(file, settle_s)
        if not why:
            files[shown], changed = _hashed(file)
            why = "is still being written" if changed else ""
        if why:
            waiting.append(f"{shown} {why}")
    if not any(name.rsplit("/", 1)[-1] == "campaign.toml" for name in files) and not waiting:
        waiting.append("campaign.toml is missing so far")
    return Dropped(path.name, path, files, tuple(waiting))


def _with_overrides(campaign: Dropped, settle_s: float) -> Dropped:
    """The campaign with the overrides that lie beside it."""
    beside = campaign.path.with_name(f"{campaign.name}{OVERRIDES}")
    if leads_out(campaign.path.parent, beside):
        return replace(campaign, waiting=(*campaign.waiting, f"{beside.name} is {LEADS_OUT}"))
    if not beside.is_file():
        return campaign
    why = _not_whole(beside, settle_s)
    waiting = (*campaign.waiting, f"{beside.name} {why}") if why else campaign.waiting
    return replace(
        campaign, files={**campaign.files, beside.name: _hashed(beside)[0]}, waiting=waiting, overrides=beside
    )


def _files(folder: Path) -> Iterator[tuple[Path, bool]]:
    """The files of a campaign, each with whether it is a link that leads out of the campaign."""
    for path, outward in paths_below(folder):
        hidden = path.name.startswith(".") and not _uploading(path.name)
        if (outward or path.is_file()) and path.name not in IGNORED and not hidden:
            yield path, outward


def _not_whole(file: Path, settle_s: float) -> str:
    """Why a file may not be whole yet, as the end of a sentence; empty where it is."""
    if _uploading(file.name):
        return "is being uploaded"
    status = file.stat()
    # a copy that keeps the old modification time still changed its inode now
    age = time.time() - max(status.st_mtime, status.st_ctime)
    return f"changed less than {settle_s:g} s ago" if age < settle_s else ""


def _too_much(files: Iterable[Path]) -> str:
    """Why files are not read at all, as a sentence; empty where they are. A file of holes may have any size."""
    size = sum(file.stat().st_size for file in files)
    return f"its files have {size} bytes; at most {MOST_DROPPED_BYTES} are allowed" if size > MOST_DROPPED_BYTES else ""


def _hashed(file: Path) -> tuple[str, bool]:
    """SHA-256 of a file as long as it was at first, and whether the file changed meanwhile."""
    digest = hashlib.sha256()
    with naming(file), file.open("rb") as stream:
        before = os.fstat(stream.fileno())
        while (left := before.st_size - stream.tell()) > 0 and (chunk := stream.read(min(left, _CHUNK))):
            digest.update(chunk)
    after = file.stat()
    return digest.hexdigest(), (before.st_size, before.st_mtime_ns) != (after.st_size, after.st_mtime_ns)


def difference(old: Mapping[str, str] | None, new: Mapping[str, str]) -> str:
    """Changes between two sets of files as text; empty if there are none."""
    if old is None:
        return "new"
    kinds = {
        "changed": [name for name in new if name in old and old[name] != new[name]],
        "added": [name for name in new if name not in old],
        "removed": [name for name in old if name not in new],
    }
    return "; ".join(f"{kind} {_listed(names)}" for kind, names in kinds.items() if names)


def _listed(names: list[str], most: int = 5) -> str:
    shown = ", ".join(sorted(names)[:most])
    return shown if len(names) <= most else f"{shown} and {len(names) - most} more"


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
