"""Rtec and alike: one table per step, each with its own header, or one log whose time starts again with each step.

The log writes its timestamp without a unit; it is in seconds.
"""

from __future__ import annotations

import re

from tribo.readers.columns import Hint
from tribo.readers.core.family import Family
from tribo.readers.layout import Layout
from tribo.readers.source import Source

_STEP = re.compile(r"\n\W{0,3}(?:recipe )?step\W{0,3}\d+\b", re.I)
_FORCES = re.compile(r"F[xz].*F[xz]|COF")


def recognises(source: Source) -> bool:
    head = source.head_text
    return "DAQ.F" in head or (bool(_FORCES.search(head)) and bool(_STEP.search(head)))


def hints(source: Source, layout: Layout) -> tuple[Hint, ...]:
    """The log of an Rtec counts its timestamp in seconds."""
    is_log = any(name.startswith("DAQ.F") for name in layout.names)
    return (Hint("time", "Timestamp [s]", "Rtec logs count in seconds"),) if is_log and _bare_timestamp(layout) else ()


def _bare_timestamp(layout: Layout) -> bool:
    return "Timestamp" in layout.names and not layout.units[layout.names.index("Timestamp")]


RTEC = Family("rtec", "Rtec and similar, one table per step, columns in any order", recognises, hints)
