"""What a mechanism means for a published table of mu and tau0 that prints neither pulls nor conditions."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from tribo.display import displayed


@displayed()
@dataclass(frozen=True)
class Readings:
    """A mechanism over all readings of the table that are possible for a line fit.

    ``gains`` are log likelihoods earned and ``sizes`` amplitudes, one a reading; ``limit()`` is the largest
    amplitude within 95 % in the first reading, ``flat_traction_Pa`` the static traction of the flat sample at 10 kPa.
    """

    gains: tuple[float, ...]
    sizes: tuple[float, ...]
    limit: Callable[[], float]
    flat_traction_Pa: float


@displayed()
@dataclass(frozen=True)
class BenchTest:
    """A test at the bench that would decide what the table leaves open, and the mechanisms it separates."""

    text: str
    separates: tuple[str, ...]
    design: Mapping[str, Any] = field(default_factory=dict)


@displayed()
@dataclass(frozen=True)
class InTable:
    """A mechanism in the diagnosis of a published table.

    Parameters
    ----------
    missing
        What the table does not print and the mechanism needs; such a mechanism is not weighed.
    barred
        Why it is not weighed although its law could change the table.
    guess
        The explanation proposed by the authors that it stands for.
    finding
        What the table says about that explanation, in sentences.
    next_test
        The bench test to do next.
    """

    missing: str = ""
    barred: str = ""
    guess: str = ""
    finding: Callable[[Readings], str] | None = None
    next_test: BenchTest | None = None


WEIGHED = InTable()
