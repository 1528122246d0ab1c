"""How figures are drawn: what a command chooses before any of the drawing libraries is imported."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

Progress = Callable[[str, int, int], None]
Keep = Callable[[str, object, Callable[[], Any], Iterable[str]], Any]


def make_anew(name: str, made_from: object, make: Callable[[], Any], rooms: Iterable[str]) -> Any:
    """Keep nothing."""
    return make()


@dataclass(frozen=True)
class Drawing:
    """How figures are drawn: where the progress is reported, and in how many processes they are drawn.

    ``keep`` (:meth:`tribo.cache.kept_results.Shelf.take`) avoids redrawing a figure whose numbers have not changed.
    """

    progress: Progress | None = None
    jobs: int = 1
    keep: Keep = make_anew


DRAWING = Drawing()
