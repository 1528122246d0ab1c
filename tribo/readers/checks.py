"""What a column of numbers tells about damage: a time that runs back, a gap, a stretch ten times off."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tribo.errors import Problem
from tribo.records import FloatArray

GAP_STEPS = 5.0  # a time step this many median steps long is a gap
_WORTH_A_LOOK = 1.5  # mean steps: where no step is this long, none is a gap
_TEN_TIMES = (9.0, 11.0)  # a decimal mark slipped by one place, noise allowed for
_LEAST_SHARE = 0.3  # of the range: smaller jumps are noise or stick-slip

RowOf = Callable[[int], int]


@dataclass(frozen=True)
class Finding:
    """A doubt: the flag it sets on the trace, and the problem that says where; ``fatal`` sets the trace aside."""

    flag: str
    problem: Problem
    fatal: bool = False


def check_time(time: FloatArray, file: str, column: str, row_of: RowOf) -> list[Finding]:
    """Faults of a time base: it runs back (fatal), repeats, or leaves a gap. ``row_of(k)`` is the line of sample k."""
    if time.size < 2:
        return []
    step = np.diff(time)
    least, largest = float(step.min()), float(step.max())
    found = []
    if least < 0:
        k = int(np.argmax(step < 0)) + 1
        what = f"time runs back from {time[k - 1]:.6g} s"
        place = (file, row_of(k), column, f"{time[k]:.6g} s", "a time that never decreases")
        found.append(Finding("time_goes_back", Problem("time_goes_back", what, *place), fatal=True))
    elif least == 0:
        k = int(np.argmax(step == 0)) + 1
        what = f"{int((step == 0).sum())} times stand twice, the first here"
        found.append(Finding("time_repeats", Problem("time_repeats", what, file, row_of(k), column)))
    if largest > _WORTH_A_LOOK * float(time[-1] - time[0]) / step.size:
        median = float(np.median(step))
        if median > 0 and largest > GAP_STEPS * median:
            k = int(np.argmax(step)) + 1
            what = f"{int((step > GAP_STEPS * median).sum())} gaps in time, the longest ends here"
            place = (file, row_of(k), column, f"{largest:.4g} s", f"steps of about {median:.4g} s")
            found.append(Finding("time_gap", Problem("time_gap", what, *place)))
    return found


def check_scale(values: FloatArray, file: str, column: str, row_of: RowOf) -> list[Finding]:
    """A stretch of two or more samples ten times larger or smaller than both neighbours: a slipped decimal mark."""
    if values.size < 4:
        return []
    step = np.diff(values)
    least = _LEAST_SHARE * float(values.max() - values.min())
    if step.max() <= least or step.min() >= -least:
        return []
    large = np.flatnonzero(np.abs(step) > least)
    if large.size < 2 or large.size > 40:
        return []
    before, after = values[large], values[large + 1]
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = after / before
    up = (ratio > _TEN_TIMES[0]) & (ratio < _TEN_TIMES[1])
    down = (ratio > 1 / _TEN_TIMES[1]) & (ratio < 1 / _TEN_TIMES[0])
    for (i, first), (j, second) in zip(enumerate(large), list(enumerate(large))[1:], strict=False):
        if (up[i] and down[j]) or (down[i] and up[j]):
            n = int(second - first)
            if n < 2:
                continue
            what = f"{n} rows ten times {'above' if up[i] else 'below'} their neighbours, the first here"
            place = (file, row_of(int(first) + 1), column, f"{values[first + 1]:.6g}", f"about {values[first]:.6g}")
            return [Finding("scale_jump", Problem("scale_jump", what, *place), fatal=True)]
    return []
