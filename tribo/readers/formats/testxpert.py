"""Zwick testXpert, CSV and TRA: quoted key rows, a row of names and a row of units, both quoted, bare numbers."""

from __future__ import annotations

import re

from tribo.readers.core.family import Family
from tribo.readers.source import Source

_NAMES = re.compile(
    r'^"(?:prüfzeit|zeit|temps|temps d.essai|test time|time|standardweg|standard travel)"[;,\t].*'
    r'"(?:standardkraft|kraft|force standard|standard force|force)"|'
    r'^"(?:prüfzeit|zeit|temps|test time)"[;,\t]"(?:standardweg|traverse absolue|course standard|standard travel)"',
    re.I | re.M,
)
_SHEET_NAMES = re.compile(r"^(?:.*\t)?(?:standard force|standardkraft|force standard)(?:\t|$)", re.I | re.M)
_UNITS = re.compile(r'^"(?:m?s|min|mm|m?N)"[;,\t]"', re.M)


def recognises(source: Source) -> bool:
    head = source.head_text
    if source.part:  # a sheet of a workbook has no quotes
        return bool(_SHEET_NAMES.search(head))
    return '"' in head and bool(_NAMES.search(head)) and bool(_UNITS.search(head))


TESTXPERT = Family("testxpert", "Zwick testXpert, CSV and TRA, German, French or English names", recognises)
