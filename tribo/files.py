"""Files read whole, written whole, and links that lead out of their folder.

Where the system refuses to read, the error names the path, and nothing is left out in silence: ``Path.glob`` and
``Path.rglob`` leave out folders that they may not list, and an error of ``Path.read_text`` while it reads names no
file; the package uses the functions of this module in their place.

A file is written under a temporary name, then renamed, and so whole or absent. The same holds for HDF5 files. Their
library can neither close nor abandon a file that it failed to write to: what it does then ranges from a second error to
the end of the process. It therefore writes to a file object that keeps the first error of the operating system to
itself until the library has closed the file. One flipped bit can make the library search for ever: a checksum of all
bytes stands behind what it wrote, where it looks at nothing, and is compared before it opens the file.
"""

from __future__ import annotations

import hashlib
import io
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from tribo.errors import naming


def bytes_of(path: Path) -> bytes:
    """The contents of a file.

    Raises
    ------
    OSError
        With the path: the file is missing or cannot be read.
    """
    with naming(path):
        return path.read_bytes()


def text_of(path: Path, errors: str = "strict") -> str:
    """The contents of a file in UTF-8; ``errors`` as for :meth:`bytes.decode`, and raises as :func:`bytes_of`."""
    with naming(path):
        return path.read_text(encoding="utf-8", errors=errors)


def write_new(path: Path, text: str) -> None:
    """A new file in UTF-8 with plain newlines; nothing of it is left where it cannot be written.

    Raises
    ------
    OSError
        With the path: it exists, or it cannot be written.
    """
    with naming(path), path.open("x", encoding="utf-8", newline="\n") as out:
        try:
            out.write(text)
            out.flush()
        except BaseException:
            path.unlink(missing_ok=True)
            raise


def found_in(folder: Path, pattern: str) -> list[Path]:
    """What stands in a folder under names of a pattern, in order; nothing where there is no folder.

    Raises
    ------
    OSError
        With the path: the folder is there and cannot be listed.
    """
    try:
        with naming(folder):
            return sorted(path for path in folder.iterdir() if fnmatchcase(path.name, pattern))
    except (FileNotFoundError, NotADirectoryError):
        return []


def found_below(folder: Path, pattern: str = "*") -> list[Path]:
    """The same with everything in its folders, and in theirs; links to folders are not entered."""
    return sorted(path for path in _below(folder) if fnmatchcase(path.name, pattern))


def _below(folder: Path) -> Iterator[Path]:
    for place, folders, files in os.walk(folder, onerror=_unless_gone):
        yield from (Path(place, name) for name in (*folders, *files))


def _unless_gone(why: OSError) -> None:
    if not isinstance(why, FileNotFoundError | NotADirectoryError):
        raise why


LEADS_OUT = "a link that leads out of its folder is not followed; put the file or folder itself here"


def leads_out(folder: Path, path: Path) -> bool:
    """Whether a path below a folder leads out of it, all links followed."""
    return not Path(os.path.realpath(path)).is_relative_to(os.path.realpath(folder))


def paths_below(folder: Path, start: str = ".") -> Iterator[tuple[Path, bool]]:
    """Everything in the part ``start`` of a folder, in order, each with whether it is a link that leads out of it."""
    top = folder / start
    if top.is_dir() and not leads_out(folder, top):
        yield from ((path, path.is_symlink() and leads_out(folder, path)) for path in found_below(top))


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Yield a temporary path in the same folder; on success it is renamed to ``path``, else removed.

    Folders on the way are made. An interrupted run leaves at most a hidden ``.NAME.PID.part``, never half a
    file under the final name.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with naming(path, also_for=part):
            yield part
            os.replace(part, path)
    except BaseException:
        with suppress(OSError):  # the first error is the one to report
            part.unlink(missing_ok=True)
        raise


def write_text(path: Path, text: str) -> Path:
    """Write ``text`` as UTF-8 with plain newlines, whole or not at all."""
    return write_bytes(path, text.encode("utf-8"))


def write_bytes(path: Path, content: bytes) -> Path:
    """Write ``content``, whole or not at all."""
    with whole_file(path) as part:
        part.write_bytes(content)
    return path


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


class DamagedFileError(OSError):
    """The bytes of a file are not those that were written."""


_CHECKSUM = b"\nsha256 of all bytes before this line: %s\n"
_STATED = re.compile(re.escape(_CHECKSUM).replace(b"%s", b"([0-9a-f]{64})"))
_CHUNK = 1 << 20


@contextmanager
def whole_hdf5(path: Path) -> Iterator[HeldBackErrors]:
    """Yield a file object for h5py or h5netcdf to write to; on success the file gets a checksum and is renamed to
    ``path``.

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
        if held.failure is None:
            raw.seek(0)
            checksum = hashlib.file_digest(raw, "sha256").hexdigest()
            held.seek(0, io.SEEK_END)
            held.write(_CHECKSUM % checksum.encode())
        if held.failure is not None:
            raise held.failure


def intact_hdf5(path: str | Path) -> Path:
    """The path of an HDF5 file, to be opened by its library.

    Raises
    ------
    OSError
        With the path: the file cannot be read.
    DamagedFileError
        Its bytes are not those that :func:`whole_hdf5` wrote. A file with no checksum behind it is not compared.
    """
    path, digest = Path(path), hashlib.sha256()
    with naming(path), path.open("rb") as file:
        left = file.seek(0, io.SEEK_END) - len(_CHECKSUM % bytes(64))
        file.seek(max(left, 0))
        stated = _STATED.fullmatch(file.read())
        file.seek(0)
        while stated is not None and left > 0 and (part := file.read(min(left, _CHUNK))):
            digest.update(part)
            left -= len(part)
    if stated is not None and digest.hexdigest().encode() != stated[1]:
        raise DamagedFileError(f"{path}: the file differs from its checksum")
    return path


_PACKAGE = Path(__file__).resolve().parent
PATTERN_SHARES = "pattern_shares"
"""Folder of the bundled data with the table of what the model makes of each pattern."""


def data_dir() -> Path:
    """Folder of the bundled data: ``tribo/_data`` of an installed wheel, ``data`` of a source checkout.

    Returns
    -------
    Path
        The folder; it holds the example campaign and the published tables.

    Raises
    ------
    FileNotFoundError
        Neither is there: the installation is incomplete.

    Examples
    --------
    >>> sorted(path.name for path in (tribo.data_dir() / "example").glob("*.csv"))
    ['tests.csv']
    """
    places = (_PACKAGE / "_data", _PACKAGE.parent / "data")
    for folder in places:
        if folder.is_dir():
            return folder
    raise FileNotFoundError(f"the bundled data are neither in {places[0]} nor in {places[1]}; install tribo again")
