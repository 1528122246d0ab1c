"""A file that a command was told to write: never in a campaign, and never in place of another kind of file."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from glob import escape
from pathlib import Path

from tribo.errors import CampaignError, Problem
from tribo.store.lock import BUSY, only_writer
from tribo.store.own_folder import place_problems


def check_file(path: Path, kind: str, kind_of: Callable[[Path], str], force: bool = False) -> None:
    """Refuse a file that results must not be written to.

    Parameters
    ----------
    kind : what is to be written, in words
    kind_of : what tribo wrote at a path, in the same words; empty for a file of another program

    Raises
    ------
    CampaignError
        It lies in a campaign, or is there and of another kind.
    """
    problems = place_problems(path)
    if not problems and not force and path.exists() and (found := kind_of(path)) != kind:
        allowed = f"a new file, {kind}, or --force to replace the file"
        found = found or "a file of another kind"
        problems = [Problem("other_file", "this file is not replaced", file=str(path), found=found, allowed=allowed)]
    if problems:
        raise CampaignError(problems)


@contextmanager
def only_writer_of(path: Path, wait_s: float = 0.0) -> Iterator[None]:
    """Hold one file as its only writer; leftovers of killed writers of this file are removed.

    Raises
    ------
    BusyError
        Another process writes it.
    """
    busy = Problem("busy", BUSY, file=str(path))
    with only_writer(path.with_name(f".{path.name}.lock"), wait_s, busy=busy):
        for part in path.parent.glob(f".{escape(path.name)}.*.part"):
            part.unlink(missing_ok=True)
        yield
