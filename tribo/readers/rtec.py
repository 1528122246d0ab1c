"""Rtec and alike: a table a step, each with its own header and a time that starts again."""

from __future__ import annotations

import re

from tribo.readers.family import Family
from tribo.readers.source import Source

_STEP = re.compile(r"\n\W{0,3}(?:recipe )?step\W{0,3}\d+\b", re.I)
_FORCES = re.compile(r"F[xz].*F[xz]|COF")


def recognises(source: Source) -> bool:
    head = source.head_text
    return bool(_FORCES.search(head)) and bool(_STEP.search(head))


RTEC = Family("rtec", "Rtec-like, a table a step, columns in any order", recognises)
