"""Rtec and alike: a table a step, each with its own header and a time that starts again."""

from __future__ import annotations

import re

from tribo.readers.family import Family
from tribo.readers.source import Source

_STEP = re.compile(r"^\W*(?:step|recipe step)\W*\d+\b", re.I | re.M)
_FORCES = re.compile(r"\bF[xz]\b.*\bF[xz]\b|\bDAQ\.F[xz]\b|\bCOF\b")


def recognises(source: Source) -> bool:
    head = source.head_text
    return bool(_STEP.search(head)) and bool(_FORCES.search(head))


RTEC = Family("rtec", "Rtec-like, a table a step, columns in any order", recognises)
