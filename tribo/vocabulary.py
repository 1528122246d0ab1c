"""The words for what is recorded and measured: columns, observables, and the units in which they are read."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Variable:
    """A recorded variable: in a sentence, in a narrow table, on an axis with its unit.

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
    "sample": Variable("the sample"),
    "normal_load_N": Variable("the normal load", "load", "Normal load N (N)", "N"),
    "speed_mm_s": Variable("the pull speed", "speed", "Speed (mm/s)", "mm/s"),
    "hold_s": Variable("the hold time", "hold time", "Hold (s)", "s"),
    "run_order": Variable("the run order", "run order", "Run order"),
    "specimen_run": Variable("the number of the pull on its specimen", "pull of specimen", "Pull of the specimen"),
    "repeat": Variable("the repeat", "repeat", "Repeat"),
    "started_at": Variable("the time since the first pull", "time", "Time since the first pull (h)"),
    "time of day": Variable("the time of day", "time of day", "Time of day (h)"),
    "temperature_C": Variable("the temperature", "temperature", "Temperature (°C)", "°C"),
    "humidity_pct": Variable("the humidity", "humidity", "Relative humidity (%)", "%"),
    # quantities that follow from what is recorded
    "elapsed_s": Variable("the time since the first pull", unit="h", factor=1 / 3600),
    "speed_m_s": Variable("the pull speed", unit="mm/s", factor=1e3),
    "pressure_Pa": Variable("the nominal pressure", unit="kPa", factor=1e-3),
    "contact_pressure_Pa": Variable("the contact pressure", unit="kPa", factor=1e-3),
    "tau0": Variable("the share of adhesion in the friction force"),
    "clip_N": Variable("the force lost between two samples"),
    "area_fraction": Variable("the area fraction"),
    "rim_per_m": Variable("the length of the cavity edges"),
    "elongation": Variable("the pull direction along long cavities"),
    "bend": Variable("the bend with load", "bend with load"),
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
