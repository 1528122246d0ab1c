"""Errors with their place, the value found and the values allowed."""

from __future__ import annotations

import logging
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

from tribo.display import displayed

_LOG = logging.getLogger("tribo")
_QUESTION = "did you mean"
LONGEST_FOUND = 2000  # characters of what was found that a problem holds
OF_THE_SYSTEM = "system"  # kind of a problem that another try may not have: disk full, no permission


def _without_middle(text: str) -> str:
    half = LONGEST_FOUND // 2
    return text if len(text) <= LONGEST_FOUND else f"{text[:half]} ... {text[-half:]}"


@displayed(str)
@dataclass(frozen=True)
class Problem:
    """One error, described so that a user can correct it.

    Parameters
    ----------
    kind : str
        A short slug for programs ("unknown_unit", "missing_file", "truncated").
    what : str
        The error in one sentence, without its place.
    file, row, column : str or int, optional
        Its place; ``row`` counts lines of the file from 1.
    found, allowed : str, optional
        The value found there, of a long one its beginning and end, and the values allowed.
    test_id : str, optional
        The test it belongs to.

    Examples
    --------
    >>> print(tribo.Problem("unknown_unit", "unknown unit", file="raw/T001.csv", row=4, found="lb", allowed="N, mN"))
    raw/T001.csv, row 4: unknown unit; found 'lb'; allowed: N, mN
    """

    kind: str
    what: str
    file: str | None = None
    row: int | None = None
    column: str | None = None
    found: str | None = None
    allowed: str | None = None
    test_id: str | None = None

    def __post_init__(self) -> None:
        if self.found is not None:
            object.__setattr__(self, "found", _without_middle(self.found))  # the record is frozen

    def __str__(self) -> str:
        place = [str(self.file)] if self.file else []
        if self.row is not None:
            place.append(f"row {self.row}")
        if self.column:
            place.append(f"column {self.column}")
        parts = [f"{', '.join(place)}: " if place else "", self.what]
        if self.found is not None:
            parts.append(f"; found {_without_middle(repr(self.found))}")
        if self.allowed is not None:
            parts.append(f"; {self.allowed if self.allowed.startswith(_QUESTION) else f'allowed: {self.allowed}'}")
        return "".join(parts)

    def at(self, *, file: str | None = None, test_id: str | None = None) -> Problem:
        """The same problem with file and test filled in where they are not yet known."""
        return replace(self, file=self.file or file, test_id=self.test_id or test_id)


class TriboError(Exception):
    """An error that a user can correct. Holds all problems found, not only the first.

    Parameters
    ----------
    problems : Problem or iterable of Problem
        What is wrong; of the error itself a tuple.

    Examples
    --------
    >>> try:
    ...     tribo.load_campaign(tribo.data_dir() / "berardo2019")
    ... except tribo.TriboError as error:
    ...     print(error.problems[0].what)
    a campaign must contain campaign.toml
    """

    def __init__(self, problems: Problem | Iterable[Problem]):
        self.problems: tuple[Problem, ...] = (problems,) if isinstance(problems, Problem) else tuple(problems)
        super().__init__("\n".join(str(p) for p in self.problems))


class CampaignError(TriboError):
    """campaign.toml or tests.csv cannot be used."""


class ReadError(TriboError):
    """An export cannot be read, or only by guessing."""


class TraceError(TriboError):
    """No friction force can be determined from a trace."""


class FitError(TriboError):
    """The data are insufficient or impossible for a fit."""


class SimulationError(TriboError):
    """A simulation cannot be run, or produced a non-finite number."""


@contextmanager
def naming(path: object, also_for: object = None) -> Iterator[None]:
    """Put ``path`` into errors of the system that name no file (a read, a write), or that name ``also_for``."""
    try:
        yield
    except OSError as why:
        if why.filename is None or why.filename == str(also_for):
            why.filename, why.filename2 = str(path), None
        raise


def failed_by_system(why: BaseException) -> bool:
    """Whether a file is there and the system could not read it; not where it is absent, or its contents are damaged.

    HDF5 gives errors without a number for damaged contents.
    """
    absent = isinstance(why, (FileNotFoundError, NotADirectoryError))
    return isinstance(why, OSError) and why.errno is not None and not absent


def system_problem(why: OSError, file: str | None = None) -> Problem:
    """An error of the operating system with its path and cause."""
    place = next((str(part) for part in (why.filename2, why.filename) if part), None) or file
    cause = why.strerror or str(why) or type(why).__name__
    of_many = bool(why.args) and isinstance(why.args[0], list)
    if of_many:  # shutil.Error: one (source, target, cause) for each file
        _, place, cause = (str(part) for part in why.args[0][0])
    damaged = why.errno is None and not of_many  # libraries say so of contents
    return Problem("unreadable" if damaged else OF_THE_SYSTEM, cause[:1].lower() + cause[1:], file=place)


def unexpected(why: Exception, what: str, file: str | None = None) -> Problem:
    """Any other error as a problem: ``what`` could not be done, and why. The traceback is shown with --debug."""
    _LOG.debug("%s", what, exc_info=why)
    if isinstance(why, OSError):
        problem = system_problem(why, file)
        return replace(problem, what=f"{what}: {problem.what}")
    if isinstance(why, MemoryError):
        return Problem("out_of_memory", f"{what}: not enough memory", file=file)
    if isinstance(why, RecursionError):
        return Problem("too_deep", f"{what}: nested too deeply", file=file)
    reason = re.sub(r"\s+", " ", str(why))[:200]
    detail = f"{type(why).__name__}: {reason}" if reason else type(why).__name__
    return Problem("unexpected", f"{what} because of an error in tribo ({detail})", file=file)


def is_of_the_system(kind: str) -> bool:
    """Whether a problem of this kind is one of the machine and not of the input."""
    return kind in (OF_THE_SYSTEM, "out_of_memory")
