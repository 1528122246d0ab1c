"""What a format family is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from tribo.readers.core.assign import Hint
from tribo.readers.core.layout import Layout
from tribo.readers.core.source import Source


def no_hints(source: Source, layout: Layout) -> tuple[Hint, ...]:
    """Names and units of the file say it all."""
    return ()


@dataclass(frozen=True)
class Family:
    """A family of exports.

    ``recognises(source)`` looks at the content; ``hints(source, layout)`` names columns or units that the
    format is known to mean and does not write, each with its reason;
    ``advice`` is what a user must give who has such a file.
    """

    name: str
    text: str
    recognises: Callable[[Source], bool]
    hints: Callable[[Source, Layout], tuple[Hint, ...]] = no_hints
    advice: str = ""
