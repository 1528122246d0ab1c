"""Folders and files of results that tribo may write to: never a campaign, and nothing that others have written.

A folder of results is known by its provenance.json; one whose run has not ended, or was killed, by a mark in it. A
folder that holds anything else is refused, unless the user insists.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from tribo.errors import CampaignError, Problem
from tribo.file_contents import found_in, text_of
from tribo.store.lock import only_writer

LOCK = ".tribo.lock"
MARK = ".tribo.unfinished"
STATE = ".tribo"  # of a site: records of steps, logs, the lock
RECORD = "provenance.json"
KEPT = "kept"
FIGURES = "figures"
CAMPAIGN_FILE = "campaign.toml"
PRODUCTS = frozenset({
    "tests.csv", "fits.csv", "other_fits.csv", "budget.csv", "differences.csv", "comparison.csv", "campaign.nc",
    "verdict.json", "laws.csv", "dependence.csv", "restarts.csv", "discovery.json", "report.html", "report.pdf",
    "ro-crate-metadata.json", "compare.html", "compare.csv",
})  # fmt: skip
PULL_PAGES = "pulls-*.html"  # of reports of many pulls
OF_SYSTEMS = frozenset({".DS_Store", "Thumbs.db", "desktop.ini"})
LEFTOVERS = (".part", ".lock")  # endings of hidden files that a killed process leaves
MOST_NAMED = 5
FORCE = "a new or empty folder, an earlier output folder of tribo, or --force to write here all the same"


@dataclass(frozen=True)
class Access:
    """How a folder is taken: ``force`` also where others have written, ``wait_s`` for another process at most that
    long, ``shared`` with others that only add kept results."""

    force: bool = False
    wait_s: float = 0.0
    shared: bool = False


ACCESS = Access()


@contextmanager
def own_folder(out: Path, inputs: Sequence[Path] = (), access: Access = ACCESS) -> Iterator[Path]:
    """Hold a folder of results as its only writer, made where it is absent; leftovers of killed writers are removed.

    Until the work has ended without an error the folder bears a mark, by which the next start knows it as tribo's.

    Parameters
    ----------
    out : the folder of results
    inputs : campaigns and other folders that are read, which the folder must not be, hold or lie in

    Raises
    ------
    CampaignError
        It is, holds or lies in a campaign, or holds files that tribo has not written.
    BusyError
        Another process writes into it.
    """
    check_folder(out, inputs, access.force)
    made = not out.exists()
    try:
        with only_writer(out / LOCK, access.wait_s, shared=access.shared):
            if access.shared:
                yield out
                return
            check_folder(out, inputs, access.force)  # once more: another process may have been first
            clear_leftovers(out)
            (out / MARK).touch()
            yield out
            (out / MARK).unlink(missing_ok=True)
    except BaseException:
        if made:
            _remove_unused(out)
        raise


def _remove_unused(out: Path) -> None:
    """Remove a folder that was made for results that never came."""
    with suppress(OSError):
        if [path.name for path in out.iterdir()] == [MARK]:
            (out / MARK).unlink()
        out.rmdir()


def check_folder(out: Path, inputs: Sequence[Path] = (), force: bool = False) -> None:
    """Refuse a folder that results must not be written to.

    Raises
    ------
    CampaignError
        It is, holds or lies in a campaign, or holds files that tribo has not written.
    """
    linked = [out / name for name in (KEPT, FIGURES) if (out / name).is_symlink()]
    problems = [p for place in (out, *linked) for p in place_problems(place, inputs)]
    foreign = [] if force or problems else [*foreign_files(out), *(path.name for path in linked)]
    if problems or foreign:
        raise CampaignError(problems or [_foreign(out, foreign)])


def check_site(site: Path, drop: Path, force: bool = False) -> None:
    """Refuse a folder that the site of a drop folder must not be written to.

    Raises
    ------
    CampaignError
        It is, holds or lies in the drop folder or a campaign, or holds files that tribo has not written.
    """
    linked = [path for path in drop.iterdir() if path.is_symlink()] if drop.is_dir() else []
    problems = place_problems(site, (drop, *linked))
    ours = force or problems or not site.is_dir() or (site / STATE).is_dir()
    foreign = [] if ours else sorted(path.name for path in site.iterdir() if not _of_system(path))
    if problems or foreign:
        raise CampaignError(problems or [_foreign(site, foreign)])


def _foreign(folder: Path, names: Sequence[str]) -> Problem:
    more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
    what = "this folder holds files that tribo has not written; results are not written among them"
    return Problem("foreign_files", what, file=str(folder), found=", ".join(names[:MOST_NAMED]) + more, allowed=FORCE)


def place_problems(target: Path, inputs: Sequence[Path] = ()) -> list[Problem]:
    """Why nothing may be written at ``target``, links resolved: it is, holds or lies in something that is read."""
    allowed = "a folder outside of every campaign"
    for given in inputs:
        how = _relation(target.resolve(), given.resolve())
        if how:
            what = f"results must not be written here: it {how} {given}"
            return [Problem("out_in_input", what, file=str(target), allowed=allowed)]
    around = [folder for folder in _upwards(target.resolve()) if (folder / CAMPAIGN_FILE).is_file()]
    if around:
        what = f"results must not be written here: it is or lies in the campaign {around[0]}"
        return [Problem("out_in_campaign", what, file=str(target), allowed=allowed)]
    return []


def _relation(target: Path, given: Path) -> str:
    if _same(target, given):
        return "is"
    if any(_same(folder, given) for folder in target.parents):
        return "lies in"
    return "holds" if any(_same(folder, target) for folder in given.parents) else ""


def _same(one: Path, other: Path) -> bool:
    """Whether two places are one, also by another spelling that the file system takes for the same."""
    try:
        return one == other or os.path.samefile(one, other)
    except OSError:
        return False


def _upwards(target: Path) -> tuple[Path, ...]:
    return (target, *target.parents)


def foreign_files(out: Path) -> list[str]:
    """The files and folders in ``out`` that tribo has not written, as far as they stand in its way.

    Beside a record of tribo only files that would be replaced count: notes beside a report are no hindrance.
    """
    if not out.is_dir() or (out / MARK).is_file():
        return []
    written = recorded_outputs(out)
    if written is not None:
        figures = [f"{FIGURES}/{p.name}" for p in (out / FIGURES).iterdir()] if (out / FIGURES).is_dir() else []
        pages = [path.name for path in found_in(out, PULL_PAGES)]
        there = {*(name for name in PRODUCTS if (out / name).exists()), *figures, *pages}
        return sorted(name for name in there - written if not is_leftover(name.rpartition("/")[2]))
    return sorted(path.name for path in out.iterdir() if not (_of_system(path) or _holds_kept_results(path)))


def _of_system(path: Path) -> bool:
    return path.name in OF_SYSTEMS or is_leftover(path.name)


def _holds_kept_results(path: Path) -> bool:
    """Whether this is the folder of kept results, all that simulations alone leave."""
    endings = (".json", ".nc", *LEFTOVERS)
    return path.name == KEPT and path.is_dir() and all(inside.name.endswith(endings) for inside in path.iterdir())


def recorded_outputs(out: Path) -> set[str] | None:
    """The files that the record in a folder of results lists; None where there is no record.

    Raises
    ------
    OSError
        There is a record, and it cannot be read.
    """
    try:
        record = json.loads(text_of(out / RECORD))
    except (FileNotFoundError, NotADirectoryError, IsADirectoryError, ValueError, RecursionError):
        return None
    outputs = record.get("outputs") if isinstance(record, dict) else None
    return set(outputs) if isinstance(outputs, dict) else None


def is_leftover(name: str) -> bool:
    """Whether a file name is one that only a killed process leaves."""
    return name.startswith(".") and name.endswith(LEFTOVERS)


def clear_leftovers(folder: Path) -> None:
    """Remove what killed writers left in a folder of results; for the holder of its lock."""
    for place in (folder, folder / FIGURES, folder / KEPT):
        for path in place.iterdir() if place.is_dir() and not place.is_symlink() else ():
            if is_leftover(path.name) and path.name != LOCK and not path.is_dir():
                path.unlink(missing_ok=True)
