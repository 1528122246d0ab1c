"""PCS Instruments MTM and EHD: steps of several types, only some with a table, many empty columns."""

from __future__ import annotations

import re

from tribo.readers.core.family import Family
from tribo.readers.source import Source

_FIRST = re.compile(r"(MTM|EHD|ETM|HFRR)\d* Test Data File")


def recognises(source: Source) -> bool:
    return bool(_FIRST.match(source.head[0]))


PCS = Family("pcs", "PCS Instruments MTM and EHD, text export of steps", recognises)
