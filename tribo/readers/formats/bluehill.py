"""Instron Bluehill 3 and Universal: quoted cells, units in brackets in a row of their own.

One specimen per file, or results tables and several specimens one below the other.
"""

from __future__ import annotations

import re

from tribo.readers.core.family import Family
from tribo.readers.source import Source

_KEYS = re.compile(r'^"?(specimen label|results table|sample description|test method|specimen)\b', re.I | re.M)
_UNITS_ROW = re.compile(r'^"?\(s\)"?[,;\t]|[,;\t]"?\((?:mm|m?N|kN|s|m|gf|kgf)\)"?', re.M)


def recognises(source: Source) -> bool:
    head = source.head_text
    return bool(_KEYS.search(head)) and bool(_UNITS_ROW.search(head))


BLUEHILL = Family("bluehill", "Instron Bluehill 3 and Universal, raw data CSV", recognises)
