"""Days and drift: how the friction of a laboratory moves beside everything that is recorded.

Sessions differ (setting up, room, cleaning), the whole series drifts (a walk along it), and each specimen drifts along
its own pulls. These columns are random effects of :mod:`tribo.diagnostics.model`, with sizes of their own.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tribo.mechanisms.record import Conditions
from tribo.records import FloatArray

BREAK_S = 3 * 3600.0  # without a pull: another session begins
FEWEST_IN_SESSION = 3.0  # pulls on average: below, sessions are not told from repeats
WALK_TERMS = 14  # of the expansion of a random walk: it is followed down to a fourteenth of the series


def place_in_series(c: Conditions) -> FloatArray:
    """Where in the series every test was made, from 0 to 1: by time, else by run order; NaN where neither is known."""
    when = c.elapsed_s if np.isfinite(c.elapsed_s).all() and np.ptp(c.elapsed_s) > 0 else c.run_order
    if not np.isfinite(when).all() or np.ptp(when) == 0:
        return np.full(len(when), np.nan)
    rank = np.argsort(np.argsort(when, kind="stable"), kind="stable")
    return np.asarray((rank + 0.5) / len(rank))


def session_of(c: Conditions) -> NDArray[np.int64]:
    """The number of the session of every test, (n,): the time without a pull, else the date, divides them; all zero
    where there is one, or too few pulls in each."""
    none = np.zeros(len(c.sample), np.int64)
    if np.isfinite(c.elapsed_s).all():
        order = np.argsort(c.elapsed_s, kind="stable")
        found = none.copy()
        found[order] = np.cumsum(np.diff(c.elapsed_s[order], prepend=c.elapsed_s[order[0]]) > BREAK_S)
    elif "date" in c.columns:
        found = np.unique(c.columns["date"], return_inverse=True)[1]
    else:
        return none
    return found if len(found) >= FEWEST_IN_SESSION * (found.max() + 1) else none


def sessions(c: Conditions) -> list[FloatArray]:
    """One column (n,) a session, where there are several."""
    number = session_of(c)
    return [(number == k) * 1.0 for k in range(number.max() + 1)] if number.max() > 0 else []


def walks(c: Conditions) -> list[tuple[FloatArray, float]]:
    """Columns (n,) of a random walk along the series and their standard deviations, for a walk whose root mean square
    over the series is one: its expansion after Karhunen and Loève, about its mean."""
    place = place_in_series(c)
    if not np.isfinite(place).all() or len(place) < 2 * WALK_TERMS:
        return []
    # a walk less its mean has the eigenfunctions cos(k pi t) with variances in proportion to 1 / k^2
    order = np.arange(1, WALK_TERMS + 1)
    sd = (1.0 / order) / np.sqrt(np.sum(1.0 / order**2))
    return [(np.sqrt(2.0) * np.cos(np.pi * k * place), float(s)) for k, s in zip(order, sd, strict=True)]


def along_specimens(c: Conditions) -> FloatArray:
    """Where every test lies among the pulls of its specimen, (n,): about a mean of zero with a root mean square of one
    for each specimen; zero where the order is not known."""
    found = np.zeros(len(c.sample))
    if not np.isfinite(c.specimen_run).all():
        return found
    for name in np.unique(c.specimen):
        here = c.specimen == name
        x = c.specimen_run[here] - c.specimen_run[here].mean()
        spread = float(np.sqrt(np.mean(x**2)))
        found[here] = x / spread if spread > 0 else 0.0
    return found
