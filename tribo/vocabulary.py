"""The words for what is recorded and measured: columns, observables, and the units in which they are read."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Column:
    """A recorded column: in a sentence, in a narrow table, on an axis with its unit.

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
    "sample": Column("the sample"),
    "normal_load_N": Column("the normal load", "load", "Normal load N (N)", "N"),
    "speed_mm_s": Column("the pull speed", "speed", "Speed (mm/s)", "mm/s"),
    "hold_s": Column("the hold time", "hold time", "Hold (s)", "s"),
    "run_order": Column("the run order", "run order", "Run order"),
    "specimen_run": Column("the number of the pull on its specimen", "pull of specimen", "Pull of the specimen"),
    "repeat": Column("the repeat", "repeat", "Repeat"),
    "started_at": Column("the time since the first pull", "time", "Time since the first pull (h)"),
    "time of day": Column("the time of day", "time of day", "Time of day (h)"),
    "temperature_C": Column("the temperature", "temperature", "Temperature (°C)", "°C"),
    "humidity_pct": Column("the humidity", "humidity", "Relative humidity (%)", "%"),
    # quantities that follow from what is recorded
    "elapsed_s": Column("the time since the first pull", unit="h", factor=1 / 3600),
    "speed_m_s": Column("the pull speed", unit="mm/s", factor=1e3),
    "pressure_Pa": Column("the nominal pressure", unit="kPa", factor=1e-3),
    "contact_pressure_Pa": Column("the contact pressure", unit="kPa", factor=1e-3),
    "tau0": Column("the share of adhesion in the friction force"),
    "clip_N": Column("the force lost between two samples"),
    "area_fraction": Column("the area fraction"),
    "rim_per_m": Column("the length of the cavity edges"),
    "elongation": Column("the pull direction along long cavities"),
    "bend": Column("the bend with load", "bend with load"),
}

OBSERVABLES = {
    "static": "static friction", "sliding": "sliding friction", "both": "friction (static and sliding)",
    "drop": "the drop from static to sliding friction", "rise": "the slope of the rise of the force",
    "zero": "the force before contact",
}  # fmt: skip


def in_words(column: str) -> str:
    """A recorded column in words; one that only this campaign has, by its name."""
    return COLUMNS[column].words if column in COLUMNS else column


def short_label(column: str) -> str:
    """A column in a narrow table."""
    return COLUMNS[column].short or column if column in COLUMNS else column


def axis_label(column: str) -> str:
    """A column on an axis, with its unit."""
    return COLUMNS[column].axis or column if column in COLUMNS else column


def label_with_unit(column: str) -> str:
    """A column in a list of columns, with its unit; one that only this campaign has, with spaces."""
    return COLUMNS[column].label if column in COLUMNS else column.replace("_", " ")
