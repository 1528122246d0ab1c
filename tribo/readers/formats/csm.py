"""CSM and Anton Paar tribometers (TRB, NTR): names with units, or as passed on without, to be given then."""

from __future__ import annotations

import re

from tribo.readers.core.family import Family
from tribo.readers.source import Source

_NAMES = re.compile(r"\nTime *(?:\[s\])?[\t;] *Distance[^\t;]*[\t;] *laps\b", re.I)


def recognises(source: Source) -> bool:
    return bool(_NAMES.search(source.head_text))


ADVICE = 'this table has no units; give them: time = "Time [s]", friction_force = "FrictionForce [N]" in columns'
CSM = Family("csm", "CSM and Anton Paar tribometer, tab-separated", recognises, advice=ADVICE)
