"""Zwick testXpert: quoted key rows, then a row of names and a row of units, both quoted, numbers bare."""

from __future__ import annotations

import re

from tribo.readers.family import Family
from tribo.readers.source import Source

_NAMES = re.compile(
    r'^"(?:prüfzeit|zeit|temps|test time|time)"[;,\t].*'
    r'"(?:standardkraft|kraft|force standard|standard force|force)"',
    re.I | re.M,
)
_UNITS = re.compile(r'^"m?s"[;,\t]"', re.M)


def recognises(source: Source) -> bool:
    head = "\n".join(source.lines)
    return bool(_NAMES.search(head)) and bool(_UNITS.search(head))


TESTXPERT = Family("testxpert", "Zwick testXpert, CSV and TRA, German, French or English names", recognises)
