"""Links in a folder: those that lead out of it are never followed."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from tribo.file_contents import found_below

LEADS_OUT = "a link that leads out of its folder is not followed; put the file or folder itself here"


def leads_out(folder: Path, path: Path) -> bool:
    """Whether a path below a folder leads out of it, all links followed."""
    return not Path(os.path.realpath(path)).is_relative_to(os.path.realpath(folder))


def paths_below(folder: Path, start: str = ".") -> Iterator[tuple[Path, bool]]:
    """Everything in the part ``start`` of a folder, in order, each with whether it is a link that leads out of it."""
    top = folder / start
    if top.is_dir() and not leads_out(folder, top):
        yield from ((path, path.is_symlink() and leads_out(folder, path)) for path in found_below(top))
