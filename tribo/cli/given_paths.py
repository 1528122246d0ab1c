"""Paths that a user gives and that must exist; one that cannot be looked at is not called missing."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import Any

import click

from tribo.nearest import nearest


class GivenPath(click.Path):
    """A path that exists. Errors of the system other than its absence are named as such, with exit status 1."""

    def __init__(self, *, file_okay: bool = True, dir_okay: bool = True):
        super().__init__(exists=True, file_okay=file_okay, dir_okay=dir_okay, path_type=Path)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        try:
            is_folder = stat.S_ISDIR(os.stat(value).st_mode)
        except (FileNotFoundError, NotADirectoryError):
            if near := _beside(Path(value)):
                self.fail(f"{value!r} does not exist; did you mean {near}?", param, ctx)
            return super().convert(value, param, ctx)  # click says so
        except OSError as why:
            raise click.ClickException(f"{value}: {(why.strerror or str(why)).lower()}") from why
        if self.dir_okay if is_folder else self.file_okay:
            return Path(value)
        return super().convert(value, param, ctx)


def _beside(path: Path) -> Path | None:
    """The file or folder beside ``path`` whose name is nearest to its name."""
    try:
        names = [p.name for p in path.parent.iterdir() if not p.name.startswith(".")]
    except OSError:
        return None
    near = nearest(path.name, names)
    return path.parent / near if near else None
