"""File operations of this process below one folder: counted, and one of them made to fail or to be the last.

Patched are the functions that Python code reaches files by: ``open`` with the files it returns, the functions of
``os``, the descriptors that ``os.open`` gives, and the two functions by which h5py opens a file. What a C library
writes on its own is out of reach; a full file system and a limit on the size of files reach that (see ``full_disk``).
"""

from __future__ import annotations

import _io
import builtins
import errno
import io
import os
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import wraps
from pathlib import Path
from typing import Any

KILLED = 137  # exit status of a process that ended itself at the chosen operation
READING = ("open to read", "read", "stat", "list")
WRITING = ("open to write", "write", "fsync", "rename", "make folder", "delete", "link", "set mode", "copy")
KINDS = (*READING, *WRITING)
OF_READING = ("EIO", "EACCES", "EMFILE", "ENAMETOOLONG")
OF_WRITING = ("ENOSPC", "EROFS", "EIO", "EACCES", "EMFILE", "ENAMETOOLONG")
ONLY_AT_OPENING = {"EACCES", "EMFILE", "ENAMETOOLONG", "EROFS"}  # a file that is open never gives these
LASTING = {"ENOSPC", "EROFS"}  # states of a file system: every later attempt to write fails, too
KILL = "kill"


@dataclass(frozen=True)
class Operation:
    """One call: what it does, and the path it does it to, relative to the watched folder."""

    kind: str
    path: str


@dataclass(frozen=True)
class Fault:
    """The operation that fails, counted from 0, and how: the name of an error number, or KILL."""

    at: int
    name: str


def errors_of(kind: str) -> tuple[str, ...]:
    """The errors that an operation of this kind can give."""
    names = OF_READING if kind in READING else OF_WRITING
    if kind in ("read", "write", "fsync", "copy"):
        return tuple(name for name in names if name not in ONLY_AT_OPENING)
    return names if kind.startswith("open") else tuple(name for name in names if name != "EMFILE")


@dataclass
class Watch:
    """What happens below ``root``: every operation in order, and the fault that was let happen, if any.

    ``branching`` is told every operation before it is done; where it returns a fault, this process has that fault.
    Where it ``remembers``, steps of a build that are known need not be done (see ``remembered``).
    """

    root: str
    fault: Fault | None = None
    seen: list[Operation] = field(default_factory=list)
    struck: Operation | None = None
    on_strike: Callable[[Operation], object] = lambda operation: None
    branching: Callable[[int, Operation], Fault | None] | None = None
    remembers: bool = False
    is_off: bool = False

    @contextmanager
    def unseen(self) -> Iterator[None]:
        """What the bench itself does to files while this lasts does not count."""
        self.is_off = True
        try:
            yield
        finally:
            self.is_off = False

    @property
    def is_undisturbed(self) -> bool:
        """Whether a step that starts now meets no fault; in a build it would be a process of its own."""
        return self.remembers or (self.struck is not None and self.fault is not None and self.fault.name not in LASTING)

    def inside(self, path: Any) -> str | None:
        """The path relative to the watched folder; None where it lies elsewhere."""
        if isinstance(path, int):
            try:
                text = _real_readlink(f"/proc/self/fd/{path}")
            except OSError:
                return None
        else:
            try:
                text = os.path.abspath(os.fsdecode(path))
            except TypeError:
                return None
        return text[len(self.root) + 1 :] if text.startswith(f"{self.root}/") else None

    def at(self, kind: str, path: Any, half: Callable[[], object] = lambda: None) -> None:
        """Count this operation, and let it fail where it is the chosen one; ``half`` does the first half of it."""
        inside = None if self.is_off else self.inside(path)
        if inside is None:
            return
        operation = Operation(kind, inside)
        self.seen.append(operation)
        if self.branching is not None and (fault := self.branching(len(self.seen) - 1, operation)) is not None:
            self.fault, self.branching = fault, None
        if self.fault is None:
            return
        name = self.fault.name
        if len(self.seen) - 1 == self.fault.at:
            self.struck = operation
            self.on_strike(operation)
            half()
            if name == KILL:
                os._exit(KILLED)
        elif not (self.struck and name in LASTING and kind in WRITING and kind != "delete"):
            return
        number = getattr(errno, name)
        # as the operating system does it: a call by path names the path, one by descriptor does not
        if isinstance(path, int) or kind in ("read", "write", "fsync", "copy"):
            raise OSError(number, os.strerror(number))
        raise OSError(number, os.strerror(number), os.fsdecode(path))


real_open, real_listdir = _io.open, os.listdir
real_os_open, _real_readlink, _real_stat = os.open, os.readlink, os.stat
current: Watch | None = None  # that of this process


def watch(root: Path, fault: Fault | None = None) -> Watch:
    """Patch this process, for good: meant for a forked child."""
    global current
    watched = current = Watch(str(root), fault)
    for module in (builtins, io, _io):
        module.open = _opener(watched)  # type: ignore[attr-defined]
    for name, kind in _OF_PATHS.items():
        setattr(os, name, _by_path(watched, kind, getattr(os, name)))
    for name in ("write", "pwrite", "fsync", "fdatasync", "ftruncate", "sendfile", "fchmod"):
        setattr(os, name, _by_descriptor(watched, name, getattr(os, name)))
    os.open = _os_opener(watched)
    _patch_h5py(watched)
    return watched


_OF_PATHS = {
    "stat": "stat", "lstat": "stat", "access": "stat", "readlink": "stat", "listdir": "list", "scandir": "list",
    "rename": "rename", "replace": "rename", "mkdir": "make folder", "rmdir": "delete", "unlink": "delete",
    "remove": "delete", "link": "link", "symlink": "link", "chmod": "set mode", "utime": "set mode",
    "truncate": "write",
}  # fmt: skip


class _FaultyFile(io.FileIO):
    """A file whose reads and writes are counted."""

    def __init__(self, watched: Watch, *given: Any):
        super().__init__(*given)
        self._watched, self._place = watched, given[0]

    def write(self, data: Any) -> int:
        view = memoryview(data).cast("B")
        self._watched.at("write", self._place, lambda: super(_FaultyFile, self).write(view[: len(view) // 2]))
        return super().write(data) or 0

    def readinto(self, buffer: Any) -> int:
        self._watched.at("read", self._place)
        return super().readinto(buffer) or 0

    def readall(self) -> bytes:
        self._watched.at("read", self._place)
        return super().readall() or b""


def _opener(watched: Watch) -> Callable[..., Any]:
    def opened(
        file: Any, mode: str = "r", buffering: int = -1, encoding: str | None = None, errors: str | None = None,
        newline: str | None = None, closefd: bool = True, opener: Any = None,
    ) -> Any:  # fmt: skip
        if watched.inside(file) is None:
            return real_open(file, mode, buffering, encoding, errors, newline, closefd, opener)
        if not isinstance(file, int):
            watched.at("open to write" if set(mode) & set("wax+") else "open to read", file)
        raw = _FaultyFile(watched, file, mode.replace("b", "").replace("t", ""), closefd, opener)
        if buffering == 0:
            return raw
        reads, writes = raw.readable(), raw.writable()
        kind: Any = io.BufferedRandom if reads and writes else io.BufferedWriter if writes else io.BufferedReader
        buffer = kind(raw, buffering) if buffering > 1 else kind(raw)
        if "b" in mode:
            return buffer
        text = io.TextIOWrapper(buffer, encoding or "utf-8", errors, newline, buffering == 1)
        text.mode = mode  # type: ignore[misc]
        return text

    return opened


def _os_opener(watched: Watch) -> Callable[..., int]:
    @wraps(real_os_open)
    def opened(path: Any, flags: int, mode: int = 0o777, *, dir_fd: int | None = None) -> int:
        writes = flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT)
        kind = "open to write" if writes else "list" if _is_folder(path, dir_fd) else "open to read"
        watched.at(kind, _joined(watched, path, dir_fd))
        return real_os_open(path, flags, mode, dir_fd=dir_fd)

    return opened


def _is_folder(path: Any, folder: int | None) -> bool:
    try:
        return stat.S_ISDIR(_real_stat(path, dir_fd=folder).st_mode)
    except OSError:
        return False


def _by_path(watched: Watch, kind: str, real: Callable[..., Any]) -> Callable[..., Any]:
    @wraps(real)
    def called(*given: Any, **named: Any) -> Any:
        # the second of two paths is the one that appears
        place = given[1] if kind in ("rename", "link") and len(given) > 1 else given[0] if given else "."
        watched.at(kind, _joined(watched, place, named.get("dir_fd")))
        return real(*given, **named)

    return called


def _by_descriptor(watched: Watch, name: str, real: Callable[..., Any]) -> Callable[..., Any]:
    kind = {"sendfile": "copy", "fsync": "fsync", "fdatasync": "fsync", "fchmod": "set mode"}.get(name, "write")

    @wraps(real)
    def called(descriptor: int, *given: Any, **named: Any) -> Any:
        watched.at(kind, descriptor)
        return real(descriptor, *given, **named)

    return called


def _joined(watched: Watch, path: Any, folder: int | None) -> Any:
    if folder is None or isinstance(path, int):
        return path
    return os.path.join(_real_readlink(f"/proc/self/fd/{folder}"), os.fsdecode(path))


def _patch_h5py(watched: Watch) -> None:
    from h5py import h5f

    real_open, real_create = h5f.open, h5f.create

    def opened(name: Any, flags: Any = h5f.ACC_RDONLY, *given: Any, **named: Any) -> Any:
        watched.at("open to read" if flags == h5f.ACC_RDONLY else "open to write", name)
        return real_open(name, flags, *given, **named)

    def created(name: Any, *given: Any, **named: Any) -> Any:
        watched.at("open to write", name)
        return real_create(name, *given, **named)

    h5f.open, h5f.create = opened, created
