"""Folders of this user alone: for temporary files, and for code that is loaded at the next start.

A folder for temporary files is made by tempfile, with a file in it that filelock holds for as long as the folder is in
use. ``tempfile.TemporaryDirectory`` alone would leave the folder of a killed process for ever, and that of another
program that was killed; here the next start of tribo removes both. By hand stays also the choice of the place:
tempfile tries a folder with a file, which stays where a kill falls on it.
"""

from __future__ import annotations

import atexit
import os
import shutil
import stat
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from tribo.errors import naming

PREFIX = "tribo-files-"
IN_USE = "in-use"  # locked for as long as the folder is in use; the system unlocks it when a process ends, however
FILES = "files"
_OWNER_ONLY = 0o700


@contextmanager
def temporary_folder() -> Iterator[Path]:
    """An empty folder of this user alone for as long as the context lasts; leftovers of killed processes are removed.

    Raises
    ------
    OSError
        There is no place for temporary files, or it cannot be written to.
    """
    with temporary_folder_of_child() as (folder, _):
        yield folder


@contextmanager
def temporary_folder_of_child(prefix: str = PREFIX) -> Iterator[tuple[Path, int]]:
    """The same folder for a child process, with a descriptor: the folder is in use as long as a process has it open.

    It is for temporary files of other programs, which leave them there when they are killed. No error of the removal
    is raised.
    """
    from filelock import FileLock

    clear_abandoned(place_of_temporary_files(), prefix)
    descriptors: list[int] = []
    while not descriptors:
        holder = Path(tempfile.mkdtemp(prefix=prefix))
        lock = FileLock(holder / IN_USE, mode=0o600, thread_local=False, on_acquired=descriptors.append)
        try:
            with naming(holder):
                lock.acquire()
        except FileNotFoundError:  # another start took it for an abandoned one
            continue
        except BaseException:
            with suppress(OSError):  # the first error is the one to report
                holder.rmdir()
            raise
    try:
        (holder / FILES).mkdir(mode=_OWNER_ONLY)
        yield holder / FILES, descriptors[0]
    finally:
        _remove(holder)
        lock.release()


def place_of_temporary_files() -> Path:
    """As :func:`tempfile.gettempdir`, which tries a folder with a file that stays where a kill falls on it."""
    if tempfile.tempdir is None:
        stated = [os.environ.get(name, "") for name in ("TMPDIR", "TEMP", "TMP")]
        usable = (place for place in (*stated, "/tmp") if os.path.isdir(place) and os.access(place, os.W_OK | os.X_OK))
        place = next(usable, None)
        tempfile.tempdir = os.path.abspath(place) if place is not None else None
    return Path(tempfile.gettempdir())


def clear_abandoned(place: Path, prefix: str) -> None:
    """Remove the folders of this user in ``place`` that no process uses any more; on Windows they stay there."""
    from filelock import FileLock, Timeout

    for holder in place.glob(f"{prefix}*") if hasattr(os, "getuid") else ():
        with suppress(OSError, Timeout):  # of another user, in use, or another start was faster
            found = holder.lstat()
            own = found.st_uid == os.getuid() and stat.S_IMODE(found.st_mode) == _OWNER_ONLY
            if stat.S_ISDIR(found.st_mode) and own:
                with FileLock(holder / IN_USE, timeout=0, mode=0o600):
                    _remove(holder)


def _remove(holder: Path) -> None:
    """The locked file goes last: by it the next start knows a folder that could not be removed."""
    shutil.rmtree(holder / FILES, ignore_errors=True)
    with suppress(OSError):
        if not (holder / FILES).exists():
            (holder / IN_USE).unlink(missing_ok=True)
            holder.rmdir()


_OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH


def private_folder(candidates: Iterable[Path], prefix: str) -> Path:
    """The first candidate that is private, made where it does not exist; else a fresh one for this process only.

    A folder is private if it is a folder and not a link, belongs to this user, has mode 0700, and no one else can
    rename or replace it: every folder above it belongs to this user or to root, and others cannot write there, or the
    sticky bit keeps them from touching what is not theirs. Systems without user numbers (Windows) give each user
    folders of their own; there only links are refused. The fresh folder is removed when the process ends.
    """
    for wanted in candidates:
        try:
            folder = _made(wanted)
            if is_private(folder) and _writable(folder):
                return folder
        except OSError:
            continue
    return _fresh(prefix)


def _made(wanted: Path) -> Path:
    """The folder, with no links left above it that someone could let point elsewhere later."""
    wanted.parent.mkdir(mode=_OWNER_ONLY, parents=True, exist_ok=True)
    folder = Path(os.path.realpath(wanted.parent)) / wanted.name
    folder.mkdir(mode=_OWNER_ONLY, exist_ok=True)
    return folder


def is_private(folder: Path) -> bool:
    """Whether a folder, given by a path without links above it, belongs to this user alone; see :func:`private_folder`.

    Raises
    ------
    OSError
        It cannot be looked at.
    """
    own = folder.lstat()
    if not stat.S_ISDIR(own.st_mode) or _is_junction(folder):
        return False
    if not hasattr(os, "getuid"):
        return True
    if own.st_uid != os.getuid() or stat.S_IMODE(own.st_mode) != _OWNER_ONLY:
        return False
    return all(_nobody_else_replaces_in(above) for above in folder.parents)


def _nobody_else_replaces_in(above: Path) -> bool:
    status = above.stat()
    if status.st_uid not in (0, os.getuid()):
        return False
    return not status.st_mode & _OTHERS_WRITE or bool(status.st_mode & stat.S_ISVTX)


def _is_junction(folder: Path) -> bool:
    """The second kind of link between folders that Windows has."""
    kind = getattr(stat, "IO_REPARSE_TAG_MOUNT_POINT", None)
    return kind is not None and getattr(folder.lstat(), "st_reparse_tag", 0) == kind


def _writable(folder: Path) -> bool:
    with tempfile.TemporaryFile(dir=folder):
        os.utime(folder)
    return True


def _fresh(prefix: str) -> Path:
    held = ExitStack()
    folder, _ = held.enter_context(temporary_folder_of_child(prefix))
    maker = os.getpid()
    atexit.register(lambda: held.close() if os.getpid() == maker else None)  # a forked process leaves it to its maker
    return folder
