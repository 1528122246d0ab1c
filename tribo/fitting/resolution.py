"""Whether the loads of a sample span enough for a slope."""

from __future__ import annotations

import math

import numpy as np

from tribo.fitting.rows import Rows


def loads_too_close(rows: Rows, mu_u: float) -> str:
    """Why the tests of a sample determine no slope, as a note; empty where they do.

    ``mu_u`` is the standard uncertainty of the slope from the scatter of tests or specimens, NaN where there is none.

    A slope is not resolved where its standard uncertainty exceeds the friction coefficient T/N itself: the data then
    exclude neither that the friction force is independent of the load nor that it rises twice as fast as the load. The
    uncertainty is the larger of ``mu_u`` and of what the reading uncertainty of the forces alone gives for a line
    through these loads.
    """
    load, force = float(rows.load_N.mean()), float(rows.force_N.mean())
    coefficient = abs(force) / load if load > 0 else math.inf
    uncertainty = max([u for u in (mu_u, _from_readings(rows)) if math.isfinite(u)], default=0.0)
    if uncertainty <= coefficient:
        return ""
    low, high = rows.load_N.min(), rows.load_N.max()
    return (
        f"the loads span only {100 * (high / low - 1.0):.2g} % ({low:.5g} to {high:.5g} N), which does not determine a "
        f"slope: the standard uncertainty of mu ({uncertainty:.2g}) exceeds the friction coefficient T/N "
        f"({coefficient:.2g})"
    )


def _from_readings(rows: Rows) -> float:
    """Standard uncertainty of the slope from the reading uncertainties of the forces; NaN where they are not known."""
    known = np.isfinite(rows.u_N) & (rows.u_N > 0)
    if np.count_nonzero(known) < 2:
        return math.nan
    weight, load = rows.u_N[known] ** -2.0, rows.load_N[known]
    spread = float(weight @ (load - np.average(load, weights=weight)) ** 2)
    return 1.0 / math.sqrt(spread) if spread > 0 else math.nan
