"""Files of the user, read whole: only regular files of bounded size, each with the hash of the bytes that were read."""

from __future__ import annotations

import errno
import mmap
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from hashlib import sha256
from pathlib import Path
from typing import Any

from tribo.errors import naming
from tribo.limits import DEEPEST_NESTING

MAPPED_BYTES = 64 << 20  # larger files are mapped and read in pieces, so that memory holds the numbers only

_HASHES: ContextVar[dict[str, str] | None] = ContextVar("hashes of the files that were read", default=None)


class NotRegularError(OSError):
    """A pipe, a device, a socket or a folder where a file is expected."""


class TooLargeError(OSError):
    """A file is larger than allowed; ``size`` in bytes."""

    def __init__(self, size: int, limit: int, path: Path):
        super().__init__(errno.EFBIG, f"{size} bytes; at most {limit} are allowed", str(path))
        self.size = size


@contextmanager
def hashes_of_reads() -> Iterator[dict[str, str]]:
    """Collect the SHA-256 of every file that is read in this block, by its path as it was opened."""
    found: dict[str, str] = {}
    token = _HASHES.set(found)
    try:
        yield found
    finally:
        _HASHES.reset(token)


def read_input(path: Path, most_bytes: int) -> bytes:
    """The bytes of a regular file.

    Raises
    ------
    NotRegularError, TooLargeError
        Before anything is read.
    OSError
        The file is missing or cannot be opened.
    """
    return bytes(read_or_map(path, most_bytes, mapped_from=most_bytes))


def read_or_map(path: Path, most_bytes: int, mapped_from: int = MAPPED_BYTES) -> bytes | mmap.mmap:
    """The same; a file larger than ``mapped_from`` bytes is mapped into memory."""
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    with naming(path), os.fdopen(descriptor, "rb") as stream:
        status = os.fstat(stream.fileno())
        if not stat.S_ISREG(status.st_mode):
            raise NotRegularError(errno.EINVAL, "not a regular file", str(path))
        if status.st_size > most_bytes:
            raise TooLargeError(status.st_size, most_bytes, path)
        content: bytes | mmap.mmap
        if status.st_size > mapped_from:
            content = mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ)
        else:
            content = stream.read(most_bytes + 1)
        if len(content) > most_bytes:
            raise TooLargeError(len(content), most_bytes, path)
    hashes = _HASHES.get()
    if hashes is not None:
        hashes[str(path)] = sha256(content).hexdigest()
    return content


def nests_too_deeply(parsed: Any) -> bool:
    """Whether arrays and tables of a TOML or JSON text stand within each other beyond the limit."""
    level = [parsed]
    for _ in range(DEEPEST_NESTING):
        below: list[Any] = []
        for value in level:
            if isinstance(value, dict):
                below += value.values()
            elif isinstance(value, list):
                below += value
        if not below:
            return False
        level = below
    return True
