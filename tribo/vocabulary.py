"""The words for what is recorded and measured: columns, observables, and the units in which they are read."""

from __future__ import annotations

import re
from dataclasses import dataclass


@dataclass(frozen=True)
class ColumnWords:
    """A recorded column in words: in a sentence, in a narrow table, on an axis with its unit.

    ``unit`` is the one in which values are read, ``factor`` leads to it from the unit in which they are stored.
    """

    words: str
    short: str = ""
    axis: str = ""
    unit: str = ""
    factor: float = 1.0

    @property
    def label(self) -> str:
        """In a table or in a list of columns, with the unit."""
        return self.words.removeprefix("the ") + (f" ({self.unit})" if self.unit else "")


COLUMNS = {
    "sample": ColumnWords("the sample"),
    "normal_load_N": ColumnWords("the normal load", "load", "Normal load N (N)", "N"),
    "speed_mm_s": ColumnWords("the pull speed", "speed", "Speed (mm/s)", "mm/s"),
    "hold_s": ColumnWords("the hold time", "hold time", "Hold (s)", "s"),
    "run_order": ColumnWords("the run order", "run order", "Run order"),
    "specimen_run": ColumnWords("the number of the pull on its specimen", "pull of specimen", "Pull of the specimen"),
    "repeat": ColumnWords("the repeat", "repeat", "Repeat"),
    "started_at": ColumnWords("the time since the first pull", "time", "Time since the first pull (h)"),
    "time of day": ColumnWords("the time of day", "time of day", "Time of day (h)"),
    "temperature_C": ColumnWords("the temperature", "temperature", "Temperature (°C)", "°C"),
    "humidity_pct": ColumnWords("the humidity", "humidity", "Relative humidity (%)", "%"),
    # quantities that follow from what is recorded
    "elapsed_s": ColumnWords("the time since the first pull", unit="h", factor=1 / 3600),
    "clock_h": ColumnWords("the time of day", unit="h"),
    "speed_m_s": ColumnWords("the pull speed", unit="mm/s", factor=1e3),
    "pressure_Pa": ColumnWords("the nominal pressure", unit="kPa", factor=1e-3),
    "contact_pressure_Pa": ColumnWords("the contact pressure", unit="kPa", factor=1e-3),
    "tau0": ColumnWords("the share of adhesion in the friction force"),
    "clip_N": ColumnWords("the force lost between two samples"),
    "area_fraction": ColumnWords("the area fraction"),
    "rim_per_m": ColumnWords("the length of the cavity edges"),
    "elongation": ColumnWords("the pull direction along long cavities"),
    "bend": ColumnWords("the bend with load", "bend with load"),
}

OBSERVABLES = {
    "static": "static friction", "sliding": "sliding friction", "both": "friction (static and sliding)",
    "drop": "the drop from static to sliding friction", "rise": "the slope of the rise of the force",
    "zero": "the force before contact", "load": "the recorded normal load", "peak": "the highest recorded force",
    "turn": "the force when the drive turns back",
}  # fmt: skip


UNIT_OF_A_NAME = re.compile(
    r"(?P<words>.*?[A-Za-z].*?)_(?P<unit>[munk]?(?:m|s|g|N|Hz|Pa|W|J|V)|[MG]Pa|[um]?m_s|[mk]?N_per_m|h|min|rpm|pct|lb|deg)"
)
UNITS_READ = {"pct": "%", "deg": "°", "_per_": "/", "_": "/"}


def described(column: str) -> ColumnWords:
    """A recorded column; one that only this campaign has by its name, of which a unit at the end is taken off."""
    if column in COLUMNS:
        return COLUMNS[column]
    ends = UNIT_OF_A_NAME.fullmatch(column)
    if ends is None:
        return ColumnWords(column)
    words, unit = ends["words"].replace("_", " "), re.sub(r"^u(?=[a-zA-Z])", "µ", ends["unit"])
    for written, read in UNITS_READ.items():
        unit = unit.replace(written, read)
    return ColumnWords(words, words, f"{words} ({unit})", unit)


def in_words(column: str) -> str:
    """A recorded column in words; one that only this campaign has, by its name."""
    return described(column).words


def short_label(column: str) -> str:
    """A column in a narrow table."""
    return described(column).short or column


def axis_label(column: str) -> str:
    """A column on an axis, with its unit."""
    return described(column).axis or column


def label_with_unit(column: str) -> str:
    """A column in a list of columns, with its unit; one that only this campaign has, with spaces."""
    return described(column).label.replace("_", " ")
