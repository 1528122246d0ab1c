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
    """A binary file in which every write succeeds; ``failure`` is the first error.

    After it the file goes on in memory: the library reads back what it wrote, and may crash where it finds other bytes.
    """

    def __init__(self, raw: io.RawIOBase):
        self._raw: io.RawIOBase | io.BytesIO = raw
        self.failure: OSError | None = None

    def write(self, data: Any) -> int:
        view = memoryview(data).cast("B")
        done = 0
        while done < len(view):
            try:
                done += self._raw.write(view[done:]) or 0
            except OSError as why:
                self._go_on_in_memory(why)
        return len(view)

    def _go_on_in_memory(self, why: OSError) -> None:
        self.failure = why
        place = self._raw.tell()
        self._raw.seek(0)
        self._raw = io.BytesIO(self._raw.read() or b"")
        self._raw.seek(place)

    def readinto(self, buffer: Any) -> int:
        return self._raw.readinto(buffer) or 0

    def truncate(self, size: int | None = None) -> int:
        try:
            return self._raw.truncate(size)
        except OSError as why:
            self._go_on_in_memory(why)
            return self._raw.truncate(size)

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
