"""Anton Paar RheoCompass: "Interval data:" before the names, units in brackets below, a table an interval."""

from __future__ import annotations

import re

from tribo.readers.core.family import Family
from tribo.readers.source import Source

_NAMES_FOLLOW = re.compile(r"\n(?:Interval data|Intervall-?\s?daten|Données de l.intervalle):", re.I)


def recognises(source: Source) -> bool:
    return bool(_NAMES_FOLLOW.search(source.head_text))


RHEOCOMPASS = Family("rheocompass", "Anton Paar RheoCompass, one table per interval", recognises)
