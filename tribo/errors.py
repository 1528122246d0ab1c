"""Errors with their place, the value found and the values allowed."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Problem:
    """One error, described so that a user can correct it.

    Parameters
    ----------
    kind : str
        A short slug for programs ("unknown_unit", "missing_file", "truncated").
    what : str
        The error in one sentence, without its place.
    file, row, column, found, allowed : str or int, optional
        Its place, the value found there and the values allowed. ``row`` counts lines of the file from 1.
    test_id : str, optional
        The test it belongs to.
    """

    kind: str
    what: str
    file: str | None = None
    row: int | None = None
    column: str | None = None
    found: str | None = None
    allowed: str | None = None
    test_id: str | None = None

    def __str__(self) -> str:
        place = [str(self.file)] if self.file else []
        if self.row is not None:
            place.append(f"row {self.row}")
        if self.column:
            place.append(f"column {self.column}")
        parts = [f"{', '.join(place)}: " if place else "", self.what]
        if self.found is not None:
            parts.append(f"; found {self.found!r}")
        if self.allowed is not None:
            parts.append(f"; allowed: {self.allowed}")
        return "".join(parts)

    def at(self, *, file: str | None = None, test_id: str | None = None) -> Problem:
        """The same problem with file and test filled in where they are not yet known."""
        return replace(self, file=self.file or file, test_id=self.test_id or test_id)


class TriboError(Exception):
    """An error that a user can correct. Holds all problems found, not only the first."""

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
