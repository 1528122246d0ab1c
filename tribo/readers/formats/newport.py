"""Newport rotary rig: one tab-separated line of settings, then semicolon-separated numbers without names.

Columns by the rig's own evaluation script: step time, time, force across the contact, torque, position of the vertical
stage, turns a second, speed of that stage. The friction is a torque, so its lever must be given.
"""

from __future__ import annotations

import re

from tribo.readers.columns import Hint
from tribo.readers.core.family import Family
from tribo.readers.layout import Layout
from tribo.readers.source import Source

_SETTINGS = re.compile(r"(?:-?\d+\.\d+\t){15}-?\d+\.\d+\s*")
_ROW = re.compile(r"(?:-?\d+\.\d+;){6}-?\d+\.\d+\s*")


def recognises(source: Source) -> bool:
    head = source.head
    return len(head) > 1 and bool(_SETTINGS.fullmatch(head[0])) and bool(_ROW.fullmatch(head[1]))


def hints(source: Source, layout: Layout) -> tuple[Hint, ...]:
    reason = "fixed column order of this rig"
    if any(layout.names):  # of a file beside the export
        return ()
    return (
        Hint("time", "#2 [s]", reason),
        Hint("normal force", "#3 [N]", reason),
        Hint("torque", "#4 [N m]", reason),
        Hint("rotation speed", "#6 [rev/s]", reason),
    )


ADVICE = (
    "column 4 is the friction torque; give the lever arm: lever_arm_mm = 2.5 in campaign.toml, "
    'or friction_force = "#4 [N m / 2.5 mm]" in columns'
)
NEWPORT = Family("newport", "Newport rotary rig, settings line and columns without names", recognises, hints, ADVICE)
