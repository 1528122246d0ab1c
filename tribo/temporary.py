"""Folders for temporary files: removed at their end, or by the next start where the process was killed."""

from __future__ import annotations

import os
import shutil
import stat
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows: leftovers of killed processes stay there
    fcntl = None  # type: ignore[assignment]

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
    folder, release = held_folder(PREFIX)
    try:
        yield folder
    finally:
        release()


def held_folder(prefix: str) -> tuple[Path, Callable[[], None]]:
    """The same folder until the function that comes with it is called. No error of the removal is raised."""
    place = Path(tempfile.gettempdir())
    clear_abandoned(place, prefix)
    holder, lock = _made(prefix)

    def release() -> None:
        _remove(holder)
        os.close(lock)

    try:
        folder = holder / FILES
        folder.mkdir(mode=_OWNER_ONLY)
    except BaseException:
        release()
        raise
    return folder, release


def _made(prefix: str) -> tuple[Path, int]:
    """A new folder with a locked file in it."""
    while True:
        holder = Path(tempfile.mkdtemp(prefix=prefix))
        try:
            lock = os.open(holder / IN_USE, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o600)
        except FileNotFoundError:  # another start took it for an abandoned one
            continue
        except BaseException:
            with suppress(OSError):  # the first error is the one to report
                holder.rmdir()
            raise
        if fcntl is not None:
            fcntl.flock(lock, fcntl.LOCK_EX)
        return holder, lock


def clear_abandoned(place: Path, prefix: str) -> None:
    """Remove the folders of this user in ``place`` that no process uses any more."""
    for holder in place.glob(f"{prefix}*") if fcntl is not None else ():
        with suppress(OSError):  # of another user, or another start was faster
            if _is_own(holder):
                _remove_abandoned(holder)


def _is_own(holder: Path) -> bool:
    found = holder.lstat()
    return stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and stat.S_IMODE(found.st_mode) == _OWNER_ONLY


def _remove_abandoned(holder: Path) -> None:
    try:
        lock = os.open(holder / IN_USE, os.O_RDWR | os.O_NOFOLLOW)
    except FileNotFoundError:  # killed before it held anything
        holder.rmdir()
        return
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        _remove(holder)
    finally:
        os.close(lock)


def _remove(holder: Path) -> None:
    """The locked file goes last: by it the next start knows a folder that could not be removed."""
    shutil.rmtree(holder / FILES, ignore_errors=True)
    with suppress(OSError):
        if not (holder / FILES).exists():
            (holder / IN_USE).unlink(missing_ok=True)
            holder.rmdir()
