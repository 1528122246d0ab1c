"""Instron Bluehill: quoted cells, "Specimen label" above the table, units in brackets in their own row."""

from __future__ import annotations

import re

from tribo.readers.family import Family
from tribo.readers.source import Source

_KEYS = re.compile(r'^"?(specimen label|results table|sample description|test method)\b', re.I | re.M)
_UNITS_ROW = re.compile(r'^"?\(s\)"?[,;\t]|[,;\t]"?\((?:mm|N|kN|s|m|gf)\)"?', re.M)


def recognises(source: Source) -> bool:
    head = "\n".join(source.lines[:40])
    return bool(_KEYS.search(head)) and bool(_UNITS_ROW.search(head))


BLUEHILL = Family("bluehill", "Instron Bluehill 3 and Universal, raw data CSV", recognises)
