"""One writer at a time, held by the operating system: a killed process leaves no lock behind.

The lock file names the process that holds it, so that a second process can say whom it waits for.

Folders and files of results that tribo may write to: never a campaign, and nothing that others have written.

A folder of results is known by its provenance.json; one whose run has not ended, or was killed, by a mark in it. A
folder that holds anything else is refused, unless the user insists.

A file that a command was told to write: never in a campaign, and never in place of another kind of file.
"""

from __future__ import annotations

import json
import os
import shlex
import socket
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from glob import escape
from pathlib import Path

from tribo.errors import CampaignError, Problem, TriboError, naming
from tribo.files import found_in, text_of

POLL_S = 0.2
WAIT = "this one stops (use --wait SECONDS to wait for the other one)"
BUSY = f"another process is writing here; {WAIT}"
_WORKERS_LET_GO: set[int] = set()  # descriptors that a forked worker closes: it must not outlive its parent's lock


class BusyError(TriboError):
    """Another process writes to the same place."""


@contextmanager
def only_writer(
    path: Path, wait_s: float = 0.0, *, shared: bool = False, lasting: bool = False, busy: Problem | None = None
) -> Iterator[int]:
    """Hold the lock file ``path``; yields its descriptor, which child processes can inherit to hold it too.

    Parameters
    ----------
    wait_s : how long to wait for another holder
    shared : let others in that also ask for a shared lock
    lasting : leave the file there afterwards; otherwise it is removed by its last holder
    busy : what to say where another process holds it; ``found`` is filled in with the name of that process

    Raises
    ------
    BusyError
        Another process holds it, and still does after ``wait_s`` seconds.
    """
    said = busy or Problem("busy", BUSY, file=str(path.parent))
    descriptor = _taken(path, time.monotonic() + wait_s, shared, said)
    _WORKERS_LET_GO.add(descriptor)
    try:
        with naming(path):
            os.ftruncate(descriptor, 0)
            os.pwrite(descriptor, _holder().encode(), 0)
        yield descriptor
    finally:
        if not lasting and _alone(descriptor):
            path.unlink(missing_ok=True)
        _WORKERS_LET_GO.discard(descriptor)
        os.close(descriptor)


def _taken(path: Path, until: float, shared: bool, busy: Problem) -> int:
    """A descriptor of the lock file with the lock held. The file may have been removed while this one waited."""
    import fcntl

    while True:
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o644)
        except FileNotFoundError:  # its last holder removed the folder in between
            continue
        try:
            fcntl.flock(descriptor, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
            if _is_at(descriptor, path):
                return descriptor
        except BlockingIOError:
            if time.monotonic() >= until:
                os.close(descriptor)
                raise BusyError(replace(busy, found=_found(path))) from None
            time.sleep(POLL_S)
        except BaseException:
            os.close(descriptor)
            raise
        os.close(descriptor)


def _is_at(descriptor: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(descriptor), path.stat())
    except FileNotFoundError:
        return False


def _alone(descriptor: int) -> bool:
    """Whether no other process shares the lock."""
    import fcntl

    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def _holder() -> str:
    started = time.strftime("%Y-%m-%d %H:%M:%S", time.gmtime())
    command = shlex.join(["tribo", *sys.argv[1:]])
    return f"process {os.getpid()} on {socket.gethostname()}, since {started} UTC: {command}"


def _found(path: Path) -> str:
    """The holder of a lock, by what it has written into the lock file."""
    try:
        return text_of(path, errors="replace") or "unknown"
    except OSError:
        return "unknown"


def _let_go() -> None:
    for descriptor in _WORKERS_LET_GO:
        os.close(descriptor)
    _WORKERS_LET_GO.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_let_go)


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


def check_file(path: Path, kind: str, kind_of: Callable[[Path], str], force: bool = False) -> None:
    """Refuse a file that results must not be written to.

    Parameters
    ----------
    kind : what is to be written, in words
    kind_of : what tribo wrote at a path, in the same words; empty for a file of another program

    Raises
    ------
    CampaignError
        It lies in a campaign, or is there and of another kind.
    """
    problems = place_problems(path)
    if not problems and not force and path.exists() and (found := kind_of(path)) != kind:
        allowed = f"a new file, {kind}, or --force to replace the file"
        found = found or "a file of another kind"
        problems = [Problem("other_file", "this file is not replaced", file=str(path), found=found, allowed=allowed)]
    if problems:
        raise CampaignError(problems)


@contextmanager
def only_writer_of(path: Path, wait_s: float = 0.0) -> Iterator[None]:
    """Hold one file as its only writer; leftovers of killed writers of this file are removed.

    Raises
    ------
    BusyError
        Another process writes it.
    """
    busy = Problem("busy", BUSY, file=str(path))
    with only_writer(path.with_name(f".{path.name}.lock"), wait_s, busy=busy):
        for part in path.parent.glob(f".{escape(path.name)}.*.part"):
            part.unlink(missing_ok=True)
        yield
