"""Shimadzu Trapezium: a specimen row above the names, seconds as sec; specimens may stand side by side."""

from __future__ import annotations

import re

from tribo.readers.core.family import Family
from tribo.readers.source import Source

_NAMES = re.compile(
    r'^"?(?:Temps|Time|Zeit)"?[,;\t]"?(?:Force|Kraft)"?[,;\t]"?(?:Stroke|Disp|Hub|Course).*\n"?sec"?[,;\t]', re.M
)


def recognises(source: Source) -> bool:
    return bool(_NAMES.search(source.head_text))


TRAPEZIUM = Family("trapezium", "Shimadzu Trapezium CSV, one or several specimens", recognises)
