"""Where a command writes: -o, --force and --wait, and the folder held as long as the command runs."""

from __future__ import annotations

import functools
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from tribo.store.own_folder import KEPT, Access, check_folder, own_folder

FOLDER = click.Path(file_okay=False, path_type=Path)
FORCE = click.option(
    "--force", is_flag=True,
    help="Write even where there are files that tribo has not written; those of the same name are replaced.",
)  # fmt: skip
WAIT = click.option(
    "--wait", "wait_s", default=0.0, show_default=True,
    help="Seconds to wait if another process is writing there.",
)  # fmt: skip


@dataclass(frozen=True)
class Output:
    """The output folder of a command, ``path``, and how it may be taken."""

    path: Path
    force: bool = False
    wait_s: float = 0.0

    @property
    def kept(self) -> Path:
        """Folder of finished simulations and the like, for the next start."""
        return self.path / KEPT

    def check(self, *inputs: Path) -> None:
        """Refuse a folder that results of these inputs must not be written to."""
        check_folder(self.path, inputs, self.force)

    def taken(self, *inputs: Path, shared: bool = False) -> AbstractContextManager[Path]:
        """The folder, held as its only writer; or ``shared`` with others that only add kept results."""
        return own_folder(self.path, inputs, Access(self.force, self.wait_s, shared))


def output_options(default: str | None = None) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Add -o, --force and --wait to a command, which receives them as one :class:`Output`."""
    out = click.option(
        "-o", "--out", type=FOLDER, required=default is None, default=default, show_default=default is not None,
        help="Output folder.",
    )  # fmt: skip

    def with_options(function: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(function)
        def command(*arguments: Any, out: Path, force: bool, wait_s: float, **options: Any) -> Any:
            return function(*arguments, out=Output(out, force, wait_s), **options)

        return out(FORCE(WAIT(command)))

    return with_options
