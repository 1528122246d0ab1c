"""The recorded columns of a diagnosis as shown in figures: values, a score for regression, a label."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tribo.records import FloatArray

if TYPE_CHECKING:
    from tribo.diagnostics.model import Setup

BEND = "bend"  # the square of ln N: whether T(N) bends
LABELS = {
    "normal_load_N": "load", "specimen_run": "pull of specimen", "run_order": "run order", "started_at": "time",
    "time of day": "time of day", "temperature_C": "temperature", "humidity_pct": "humidity",
    "speed_mm_s": "speed", "hold_s": "hold time", BEND: "bend with load",
}  # fmt: skip
AXES = {
    "normal_load_N": "Normal load N (N)", "specimen_run": "Pull of the specimen", "run_order": "Run order",
    "started_at": "Time since the first pull (h)", "time of day": "Time of day (h)",
    "temperature_C": "Temperature (°C)", "humidity_pct": "Relative humidity (%)", "speed_mm_s": "Speed (mm/s)",
    "hold_s": "Hold (s)",
}  # fmt: skip
LOGARITHMIC = ("normal_load_N", "speed_mm_s", "hold_s")
MOST_LABEL = 16


@dataclass(frozen=True)
class Covariate:
    """A recorded column. ``values`` (n,) are numbers, or places in ``names`` where the column is text."""

    name: str
    values: FloatArray
    names: tuple[str, ...] = ()

    @property
    def score(self) -> FloatArray:
        """What a residual is regressed on: the logarithm of loads, speeds and holds, else the values."""
        if self.name == BEND:
            logs = np.log(self.values)
            return np.asarray((logs - 0.5 * (logs.min() + logs.max())) ** 2)
        return np.log(self.values) if self.name in LOGARITHMIC else self.values

    @property
    def label(self) -> str:
        """A short name for a table."""
        text = LABELS.get(self.name, self.name)
        return text if len(text) <= MOST_LABEL else f"{text[: MOST_LABEL - 1]}…"

    @property
    def axis(self) -> str:
        """A name with unit for an axis."""
        return AXES.get(self.name, self.name)


def mechanism_label(name: str) -> str:
    """The plain name of a mechanism without its article; of one that follows any column, that column."""
    from tribo.diagnostics.terms import name_in_words

    column = name.partition(":")[2]
    plain = f"dependence on {LABELS.get(column, column)}" if column else name_in_words(name)
    return plain.removeprefix("a ").removeprefix("an ")


def covariates(s: Setup) -> list[Covariate]:
    """The mean, the load and the bend with it, and every recorded column that varies; of text those of two names."""
    c, n = s.observations.conditions, s.observations.n
    found = [Covariate("mean", np.ones(n)), Covariate("normal_load_N", c.normal_load_N)]
    found.append(Covariate(BEND, c.normal_load_N))
    found += [covariate(s, name) for name in numeric(s)]
    for name, column in c.columns.items():
        names = np.unique(column)
        if len(names) == 2 and name not in {f.name for f in found}:
            found.append(covariate(s, name))
    return found


def numeric(s: Setup) -> list[str]:
    """Names of the recorded numbers that vary and are complete."""
    from tribo.diagnostics.contrasts import numeric_covariates

    return list(numeric_covariates(s))


def covariate(s: Setup, name: str) -> Covariate:
    """One column by the name that the diagnosis gives it; text columns as places in their names."""
    o, c = s.observations, s.observations.conditions
    known = {
        "normal_load_N": c.normal_load_N, "specimen_run": c.specimen_run, "run_order": c.run_order,
        "started_at": c.elapsed_s / 3600.0, "time of day": o.clock_h, "temperature_C": c.temperature_C,
        "humidity_pct": c.humidity_pct, "speed_mm_s": c.speed_m_s * 1e3, "hold_s": c.hold_s,
    }  # fmt: skip
    if name in known:
        return Covariate(name, known[name])
    column = {"sample": c.sample, "specimen": c.specimen, **c.columns}[name]
    try:
        return Covariate(name, np.asarray(column, float))
    except ValueError:
        names, places = np.unique(column, return_inverse=True)
        return Covariate(name, places.astype(float), tuple(map(str, names)))
