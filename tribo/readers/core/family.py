"""The record of a format family."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from tribo.readers.columns import Hint
from tribo.readers.layout import Layout
from tribo.readers.source import Source


def no_hints(source: Source, layout: Layout) -> tuple[Hint, ...]:
    """No hints: the names and units of the file are sufficient."""
    return ()


@dataclass(frozen=True)
class Family:
    """A family of exports.

    ``recognises(source)`` checks the content; ``hints(source, layout)`` gives columns or units that the format
    implies but does not write, each with its reason; ``advice`` states what the user must give for such a file.
    """

    name: str
    text: str
    recognises: Callable[[Source], bool]
    hints: Callable[[Source, Layout], tuple[Hint, ...]] = no_hints
    advice: str = ""
