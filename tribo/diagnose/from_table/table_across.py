"""The deviations of a published table, pattern by pattern, for a law across patterns."""

from __future__ import annotations

import numpy as np

from tribo.diagnose.discovery.across_patterns import Deviations
from tribo.diagnose.discovery.across_words import geometry_of
from tribo.diagnose.from_table.table_observations import Table, friction_at
from tribo.records import REGIMES

FLOOR = 1e-3  # of T/N: a printed line may reach zero at a load


def table_deviations(table: Table) -> Deviations:
    """What the printed lines are over the model calibrated on the printed flat sample, at the loads of the table."""
    flat = table.samples.index("F")
    law = table.values.reshape(-1, 2 * len(REGIMES))[flat]
    ratio = np.log(np.maximum(table.friction(table.values), FLOOR) / friction_at(table, law))
    patterns = [k for k in range(len(table.samples)) if k != flat]
    rows = (table.shares * law)[patterns]
    adhesion = np.stack([rows[:, 2 * r + 1, None] / table.pressures_kPa for r in range(len(REGIMES))], axis=1)
    load = np.stack([rows[:, 2 * r, None] + 0.0 * table.pressures_kPa for r in range(len(REGIMES))], axis=1)
    first = [k * len(table.pressures_Pa) for k in patterns]
    c = table.conditions
    return Deviations(
        tuple(table.samples[k] for k in patterns),
        geometry_of(c.area_fraction[first], c.rim_per_m[first], c.cavity_width_m[first], c.elongation[first]),
        table.pressures_Pa, ratio[patterns], adhesion / (adhesion + load),
    )  # fmt: skip
