"""What a format family is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from tribo.readers.layout import Layout, sniff
from tribo.readers.source import Source


@dataclass(frozen=True)
class Family:
    """A family of exports: how its files are recognised by content, and how their tables stand."""

    name: str
    text: str
    recognises: Callable[[Source], bool]
    layout: Callable[[Source, Callable[[str], bool]], Layout] = sniff
