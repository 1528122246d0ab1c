"""HDF5 files that are whole or absent, also where the disk is full.

The HDF5 library can neither close nor abandon a file that it failed to write to: what it does then ranges from a second
error to the end of the process. It therefore writes to a file object that keeps the first error of the operating
system to itself until the library has closed the file.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tribo.store.whole_files import whole_file


class HeldBackErrors(io.RawIOBase):
    """A binary file in which every write succeeds; ``failure`` is the first error. After it nothing is written."""

    def __init__(self, raw: io.RawIOBase):
        self._raw = raw
        self.failure: OSError | None = None

    def write(self, data: Any) -> int:
        view = memoryview(data).cast("B")
        done = 0
        try:
            while self.failure is None and done < len(view):
                done += self._raw.write(view[done:]) or 0
        except OSError as why:
            self.failure = why
        return len(view)

    def readinto(self, buffer: Any) -> int:
        return self._raw.readinto(buffer) or 0

    def truncate(self, size: int | None = None) -> int:
        try:
            if self.failure is None:
                return self._raw.truncate(size)
        except OSError as why:
            self.failure = why
        return size or 0

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        return self._raw.seek(offset, whence)

    def tell(self) -> int:
        return self._raw.tell()

    def readable(self) -> bool:
        return True

    def writable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True


@contextmanager
def whole_hdf5(path: Path) -> Iterator[HeldBackErrors]:
    """Yield a file object for h5py or h5netcdf to write to; on success the file is renamed to ``path``.

    Raises
    ------
    OSError
        The file could not be written; nothing stands at ``path`` that was not there before.
    """
    with whole_file(path) as part, part.open("w+b", buffering=0) as raw:
        held = HeldBackErrors(raw)
        try:
            yield held
        except Exception:
            if held.failure is None:
                raise
        if held.failure is not None:
            raise held.failure
