"""Recorded columns and mechanisms in words, and the reasons why a design says nothing about a mechanism."""

from __future__ import annotations

from tribo.mechanisms.record import Mechanism
from tribo.mechanisms.table import mechanism

ABSORBED = "the calibration on the flat sample absorbs its effect"
COLUMN = {
    "sample": "the sample", "normal_load_N": "the normal load", "speed_mm_s": "the pull speed",
    "hold_s": "the hold time", "run_order": "the run order", "specimen_run": "the number of the pull on its specimen",
    "started_at": "the time since the first pull", "elapsed_s": "the time since the first pull",
    "temperature_C": "the temperature", "humidity_pct": "the humidity", "time of day": "the time of day",
    "speed_m_s": "the pull speed", "pressure_Pa": "the nominal pressure", "contact_pressure_Pa": "the contact pressure",
    "tau0": "the share of adhesion in the friction force",
}  # fmt: skip
NEEDED = COLUMN | {
    "elapsed_s": "the starting time", "clip_N": "the force lost between two samples",
    "area_fraction": "the area fraction", "rim_per_m": "the length of the cavity edges",
    "elongation": "the pull direction along long cavities",
}  # fmt: skip


def in_words(column: str) -> str:
    """A recorded column in words; one that only this campaign has, by its name."""
    return COLUMN.get(column, column)


def name_in_words(name: str) -> str:
    """The plain name of a mechanism that a verdict names; of one that follows any column, with that column.

    A law, and whatever else the library does not know, keeps its name, with spaces.
    """
    _, _, column = name.partition(":")
    if column:
        return f"a dependence on {in_words(column)}"
    try:
        return mechanism(name).in_words
    except KeyError:
        return name.replace("_", " ") if name.isidentifier() else name


def not_varied(m: Mechanism) -> str:
    """That a design holds fixed, or does not record, what a mechanism needs."""
    needs = [NEEDED.get(name, name) for name in m.needs]
    return f"{' and '.join(needs)} {'does' if len(needs) == 1 else 'do'} not vary or {_is(needs)} not recorded"


def _is(names: list[str]) -> str:
    return "is" if len(names) == 1 else "are"
