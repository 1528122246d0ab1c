"""Files and folders read whole: where the system refuses, the error names the path, and nothing is left out in silence.

``Path.glob`` and ``Path.rglob`` leave out folders that they may not list, and an error of ``Path.read_text`` while it
reads names no file; the package uses the functions of this module in their place. Results are written by
:mod:`tribo.store.whole_files`.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from fnmatch import fnmatchcase
from pathlib import Path

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
