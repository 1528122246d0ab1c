"""One way to say what is wrong: where, what was found, what is allowed."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Problem:
    """One fault, said so that a person can go and mend it.

    Parameters
    ----------
    kind : str
        A short slug for programs ("unknown_unit", "missing_file", "truncated").
    what : str
        The fault in one sentence, without the place.
    file, row, column, found, allowed : str or int, optional
        Where it is, what stands there and what could. ``row`` counts lines of the file from 1.
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
        """The same problem with its file and test filled in; what is already known stays."""
        return replace(self, file=self.file or file, test_id=self.test_id or test_id)


class TriboError(Exception):
    """Something a user can mend. Carries every problem found, not only the first."""

    def __init__(self, problems: Problem | Iterable[Problem]):
        self.problems: tuple[Problem, ...] = (problems,) if isinstance(problems, Problem) else tuple(problems)
        super().__init__("\n".join(str(p) for p in self.problems))


class CampaignError(TriboError):
    """campaign.toml or tests.csv cannot be used."""


class ReadError(TriboError):
    """An export cannot be read, or not without guessing."""


class TraceError(TriboError):
    """A trace holds no friction force that can be read off it."""


class FitError(TriboError):
    """Too little or impossible data for a fit."""


class SimulationError(TriboError):
    """A simulation that cannot be run, or that met a non-finite number."""
