"""Phoenix TE67: tabs, decimal commas, an empty first column, no units; what they are follows from the columns.

Load = mass times g only if the load is in newton and the mass in gram, and friction coefficient = friction force /
load only if both forces share a unit. Clock and test time run alike only if the test time is in seconds. The sliding
velocity is 2 pi times radius times turns a minute only if it is in m/s and the radius in millimetre.
"""

from __future__ import annotations

import re

import numpy as np

from tribo.readers.columns import Hint
from tribo.readers.core.family import Family
from tribo.readers.layout import Layout, cut
from tribo.readers.source import Source

_CLOCK = re.compile(r"(\d+):(\d\d):(\d\d)")
_G = 9.81  # what the rig itself reckons with
_ROWS_BYTES = 20_000
_STEADY = 0.9  # of the rows; while the drive speeds up, velocity and turns are not of the same instant


def recognises(source: Source) -> bool:
    head = source.head
    return head[0].startswith("Data file\t") and any(line.startswith("Test control file\t") for line in head[:8])


def hints(source: Source, layout: Layout) -> tuple[Hint, ...]:
    """Units that the numbers themselves prove."""
    start = source.offset(source.start, layout.header_rows)
    lines, _ = source.lines(start, _ROWS_BYTES)
    rows = [row for row in (cut(line, layout.delimiter) for line in lines) if len(row) == layout.n_cells]
    columns = {name: [row[k] for row in rows] for k, name in reversed(list(enumerate(layout.names)))}
    found = []
    if _runs_with_the_clock(columns):
        found.append(Hint("time", "Test Time [s]", "no unit in the file; it agrees with the clock column"))
    if _velocity_is_radius_times_turns(columns):
        reason = "no unit in the file; it equals 2 pi times the radius (mm) times the speed (turns a minute)"
        found.append(Hint("speed", "Sliding Velocity [m/s]", reason))
    if _load_is_mass_times_g(columns):
        reason = "no unit in the file; the load column equals mass (g) times 9.81 m/s2"
        found.append(Hint("normal force", "Load [N]", reason))
        if _coefficient_is_force_over_load(columns):
            reason += ", and the friction force equals friction coefficient times load"
            found.append(Hint("friction force", "Friction Force [N]", reason))
    return tuple(found)


def _numbers(columns: dict[str, list[str]], name: str) -> np.ndarray:
    try:
        return np.array([float(cell.replace(",", ".")) for cell in columns.get(name, [])])
    except ValueError:
        return np.array([])


def _runs_with_the_clock(columns: dict[str, list[str]]) -> bool:
    clock = [_CLOCK.fullmatch(cell) for cell in columns.get("Time", [])]
    time = _numbers(columns, "Test Time")
    if len(clock) < 10 or not all(clock) or time.size != len(clock):
        return False
    seconds = np.array([int(c[1]) * 3600 + int(c[2]) * 60 + int(c[3]) for c in clock if c])
    return bool(abs((seconds[-1] - seconds[0]) % 86400 - (time[-1] - time[0])) < 2.0)


def _load_is_mass_times_g(columns: dict[str, list[str]]) -> bool:
    mass, load = _numbers(columns, "Mass"), _numbers(columns, "Load")
    return bool(mass.size and mass.size == load.size and np.allclose(load, mass * 1e-3 * _G, rtol=1e-4))


def _velocity_is_radius_times_turns(columns: dict[str, list[str]]) -> bool:
    velocity, radius, turns = (_numbers(columns, name) for name in ("Sliding Velocity", "Radius", "Speed"))
    if not velocity.any() or not velocity.size == radius.size == turns.size:
        return False
    # the velocity is written to 1 mm/s, the turns to one a minute
    rounded = 1e-3 + 2.0 * np.pi * radius * 1e-3 / 60.0
    alike = np.abs(2.0 * np.pi * radius * 1e-3 * turns / 60.0 - velocity) <= rounded
    return bool(alike.mean() > _STEADY)


def _coefficient_is_force_over_load(columns: dict[str, list[str]]) -> bool:
    force, load = _numbers(columns, "Friction Force"), _numbers(columns, "Load")
    coefficient = _numbers(columns, "Friction Coefficient")
    if not force.size or not force.size == load.size == coefficient.size:
        return False
    return bool(np.all(np.abs(coefficient * load - force) <= 0.06))  # the force is written to 0.1 N


TE67 = Family("te67", "Phoenix TE67 pin-on-disc, TSV with decimal commas", recognises, hints)
