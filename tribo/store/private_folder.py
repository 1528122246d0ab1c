"""Folders that no one else can write to, for files that are executed or unpickled when they are loaded."""

from __future__ import annotations

import atexit
import os
import stat
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path

from tribo.temporary import held_folder

_OWNER_ONLY = 0o700
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
    held = held_folder(prefix)
    atexit.register(_release, held.release, os.getpid())
    return held.folder


def _release(release: Callable[[], None], maker: int) -> None:
    if os.getpid() == maker:  # a forked process leaves the folder to the one that made it
        release()
