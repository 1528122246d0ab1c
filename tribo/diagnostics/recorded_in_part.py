"""Columns that are recorded for some tests only: for how many, and whether what is missing follows the friction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from tribo.diagnostics.fit import ModelFit
from tribo.diagnostics.observations import Observations
from tribo.display import displayed
from tribo.records import FloatArray


@displayed()
@dataclass(frozen=True)
class RecordedInPart:
    """A column with gaps.

    Parameters
    ----------
    column : str
        Its name.
    share : float
        Share of the tests for which it is recorded.
    p : float
        Chance that tests with and without a value differ in friction as they do, beyond all that the model explains,
        where gaps have nothing to do with friction; adjusted for the number of such columns.
    doubted : bool
        Whether this is beyond chance.
    """

    column: str
    share: float
    p: float
    doubted: bool


def gaps_in(o: Observations) -> dict[str, np.ndarray]:
    """The tests (n,) without a value, of every column that is recorded for some of them."""
    c = o.conditions
    numbers = {
        "run_order": c.run_order, "specimen_run": c.specimen_run, "started_at": c.elapsed_s,
        "temperature_C": c.recorded("temperature_C"), "humidity_pct": c.recorded("humidity_pct"),
        "speed_mm_s": c.recorded("speed_m_s"), "hold_s": c.recorded("hold_s"),
    }  # fmt: skip
    missing = {name: ~np.isfinite(values) for name, values in numbers.items()}
    for name, column in c.columns.items():
        missing[name] = c.gaps[name].missing if name in c.gaps else column == ""
    return {name: gaps for name, gaps in missing.items() if gaps.any() and not gaps.all()}


def recorded_in_part(model: ModelFit, level: float) -> tuple[RecordedInPart, ...]:
    """Every column with gaps, and whether friction differs with them beyond the model: a score test of one step in
    static and one in sliding friction."""
    gaps = gaps_in(model.setup.observations)
    different = len({tuple(missing.tolist()) for missing in gaps.values()})
    found = []
    for column, missing in gaps.items():
        p = min(_p_of_step(model, missing * 1.0) * different, 1.0)
        found.append(RecordedInPart(column, float(1.0 - missing.mean()), p, p < level))
    return tuple(found)


def _p_of_step(model: ModelFit, step: FloatArray) -> float:
    left, residual = model.cleared(step[:, None, None] * np.eye(2))
    pull, information = left.T @ residual, left.T @ left
    size = float(pull @ np.linalg.lstsq(information, pull, rcond=1e-6)[0])
    return float(chi2.sf(max(size, 0.0), 2))
