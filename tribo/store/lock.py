"""One build of a site at a time, held by the operating system: a killed build leaves no lock behind."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tribo.errors import Problem, TriboError

POLL_S = 0.5


class SiteBusyError(TriboError):
    """Another build of the same site is running."""


@contextmanager
def only_build(state: Path, wait_s: float = 0.0) -> Iterator[int]:
    """Hold the lock of a site; yields a file descriptor that child processes inherit to hold it too.

    Raises
    ------
    SiteBusyError
        Another build holds it, and still does after ``wait_s`` seconds.
    """
    import fcntl

    state.mkdir(parents=True, exist_ok=True)
    path = state / "lock"
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
    try:
        until = time.monotonic() + wait_s
        while True:
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except BlockingIOError:
                if time.monotonic() >= until:
                    raise SiteBusyError(_busy(path)) from None
                time.sleep(POLL_S)
        os.ftruncate(descriptor, 0)
        started = time.strftime("%Y-%m-%d %H:%M:%S", time.gmtime())
        os.pwrite(descriptor, f"process {os.getpid()}, started {started} UTC".encode(), 0)
        yield descriptor
    finally:
        os.close(descriptor)


def _busy(path: Path) -> Problem:
    holder = path.read_text(encoding="utf-8") or "unknown"
    what = "another build of this site is running; this one stops (use --wait SECONDS to wait for the other one)"
    return Problem("busy", what, file=str(path.parent.parent), found=holder)
