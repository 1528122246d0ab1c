"""One writer at a time, held by the operating system: a killed process leaves no lock behind.

The lock file names the process that holds it, so that a second process can say whom it waits for.
"""

from __future__ import annotations

import os
import shlex
import socket
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from tribo.errors import Problem, TriboError, naming
from tribo.file_contents import text_of

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
