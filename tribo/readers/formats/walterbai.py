"""Walter+Bai: semicolons, channel numbers before the names, units in brackets behind them."""

from __future__ import annotations

import re

from tribo.readers.core.family import Family
from tribo.readers.source import Source

_NAMES = re.compile(r"^S/No;C_\d+_")


def recognises(source: Source) -> bool:
    return bool(_NAMES.match(source.head[0]))


WALTERBAI = Family("walterbai", "Walter+Bai, semicolon-separated channels", recognises)
