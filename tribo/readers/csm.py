"""CSM and Anton Paar tribometer tables as often passed on: names without units, which must then be given."""

from __future__ import annotations

from tribo.readers.family import Family
from tribo.readers.layout import cut
from tribo.readers.source import Source


def recognises(source: Source) -> bool:
    names = {name.lower() for name in cut(source.head[0], "\t")}
    return "laps" in names and "time" in names


ADVICE = 'this table carries no units; give them: time = "Time [s]", friction_force = "FrictionForce [N]" in columns'
CSM = Family("csm", "CSM and Anton Paar tribometer, tab-separated", recognises, advice=ADVICE)
