"""Folders and files of results that tribo may write to, each held by one writer.

Results are never written into a campaign, and never among files that others have written: a folder of results is known
by its provenance.json; one whose run has not ended, or was killed, by a mark in it. A folder that holds anything else
is refused, unless the user insists. What counts as a file of tribo is stated in :mod:`tribo.outputs`.

Locks are those of the operating system, taken by filelock: a killed process leaves none behind, and a forked worker
does not hold that of its parent. By hand stay the name of the holder in the lock file, so that a second process can say
whom it waits for, the removal of the file, and the sharing of a folder, which filelock offers with a database only.
"""

from __future__ import annotations

import json
import os
import shlex
import socket
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from glob import escape
from pathlib import Path

from tribo.errors import CampaignError, Problem, TriboError, naming
from tribo.files import found_in, text_of
from tribo.outputs import FIGURES, is_product

POLL_S = 0.2
WAIT = "this one stops (use --wait SECONDS to wait for the other one)"
BUSY = f"another process is writing here; {WAIT}"
MOMENT_S = 30.0  # for a holder that is about to give its name, or to let go


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
    shared : let others in that also ask for a shared lock. Each holds a file of its own beside ``path``, and ``path``
        only while it makes that file; a writer that does not share needs all of them.
    lasting : leave the file there afterwards; otherwise it is removed by its last holder
    busy : what to say where another process holds it; ``found`` is filled in with the name of that process

    Raises
    ------
    BusyError
        Another process holds it, and still does after ``wait_s`` seconds.
    """
    said = busy or Problem("busy", BUSY, file=str(path.parent))
    until = time.monotonic() + wait_s
    own = path.with_name(f"{path.name}.{os.getpid()}.lock")
    with ExitStack() as held:
        if shared:
            with _held(path, until, said, named=False):
                descriptor = held.enter_context(_held(own, until, said))
        else:
            descriptor = held.enter_context(_held(path, until, said, lasting=lasting))
            for other in found_in(path.parent, f"{escape(path.name)}.*.lock"):
                with _held(other, until, said):
                    pass
        yield descriptor


@contextmanager
def _held(path: Path, until: float, busy: Problem, *, lasting: bool = False, named: bool = True) -> Iterator[int]:
    """A lock file held, with the name of this process in it; one without a name is held for a moment only."""
    from filelock import FileLock, Timeout

    descriptors: list[int] = []
    lock = FileLock(path, timeout=0, mode=0o644, thread_local=False, on_acquired=descriptors.append)
    while True:
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            with naming(path):
                lock.acquire()
            break
        except FileNotFoundError:  # its last holder removed the folder in between
            continue
        except Timeout:
            holder = _holder_in(path)
            if time.monotonic() >= until + (0 if holder else MOMENT_S):
                raise BusyError(replace(busy, found=holder or "unknown")) from None
            time.sleep(POLL_S)
    try:
        with naming(path):
            os.ftruncate(descriptors[-1], 0)
            if named:
                started = time.strftime("%Y-%m-%d %H:%M:%S", time.gmtime())
                command = shlex.join(["tribo", *sys.argv[1:]])
                holder = f"process {os.getpid()} on {socket.gethostname()}, since {started} UTC: {command}"
                os.write(descriptors[-1], holder.encode())
        yield descriptors[-1]
    finally:
        if not lasting:
            with suppress(OSError):  # Windows removes it with its last descriptor
                path.unlink()
        lock.release()


def _holder_in(path: Path) -> str:
    try:
        return text_of(path, errors="replace")
    except OSError:
        return ""


LOCK = ".tribo.lock"
MARK = ".tribo.unfinished"
STATE = ".tribo"  # of a site: records of steps, logs, the lock
RECORD = "provenance.json"
KEPT = "kept"
CAMPAIGN_FILE = "campaign.toml"
OF_SYSTEMS = frozenset({".DS_Store", "Thumbs.db", "desktop.ini"})
LEFTOVERS = (".part", ".lock")  # endings of hidden files that a killed process leaves
MOST_NAMED = 5
FORCE = "a new or empty folder, an earlier output folder of tribo, or --force to write here all the same"


@contextmanager
def own_folder(
    out: Path, inputs: Sequence[Path] = (), *, force: bool = False, wait_s: float = 0.0, shared: bool = False
) -> Iterator[Path]:
    """Hold a folder of results as its only writer, made where it is absent; leftovers of killed writers are removed.

    Until the work has ended without an error the folder bears a mark, by which the next start knows it as tribo's.

    Parameters
    ----------
    out : the folder of results
    inputs : campaigns and other folders that are read, which the folder must not be, hold or lie in
    force : take it also where others have written
    wait_s : how long to wait for another process
    shared : take it together with others that only add kept results

    Raises
    ------
    CampaignError
        It is, holds or lies in a campaign, or holds files that tribo has not written.
    BusyError
        Another process writes into it.
    """
    check_folder(out, inputs, force)
    made = not out.exists()
    try:
        with only_writer(out / LOCK, wait_s, shared=shared):
            if shared:
                yield out
                return
            check_folder(out, inputs, force)  # once more: another process may have been first
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
        if how := _relation(_real(target), _real(given)):
            what = f"results must not be written here: it {how} {given}"
            return [Problem("out_in_input", what, file=str(target), allowed=allowed)]
    place = _real(target)
    around = [folder for folder in (place, *place.parents) if (folder / CAMPAIGN_FILE).is_file()]
    if around:
        what = f"results must not be written here: it is or lies in the campaign {around[0]}"
        return [Problem("out_in_campaign", what, file=str(target), allowed=allowed)]
    return []


def _real(path: Path) -> Path:
    """A path with its links followed; one of links in a circle, which Path.resolve refuses, as it is."""
    return Path(os.path.realpath(path))


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


def foreign_files(out: Path) -> list[str]:
    """The files and folders in ``out`` that tribo has not written, as far as they stand in its way.

    Beside a record of tribo only files that would be replaced count: notes beside a report are no hindrance.
    """
    if not out.is_dir() or (out / MARK).is_file():
        return []
    written = recorded_outputs(out)
    if written is not None:
        there = {path.name for path in found_in(out, "*") if path.name != RECORD and is_product(path.name)}
        there |= {f"{FIGURES}/{path.name}" for path in found_in(out / FIGURES, "*") if not is_leftover(path.name)}
        return sorted(there - written)
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
