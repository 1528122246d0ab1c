"""The end of a stroke in which the drive has stopped: the force stands still there, as it never does while sliding."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tribo.records import Trace
from tribo.traces.noise import running_mean

_MIDDLE = (0.3, 0.6)  # share of a stroke in which it slides
_STILL = 0.2  # share of the usual change from sample to sample while sliding, below which the force stands still
_SHORTEST = 0.1  # share of the stroke
_FEWEST_LEFT = 20
_WIDTH = 5


def without_rest_at_end(stroke: Trace) -> Trace:
    """A stroke without the end in which its force stands still; the same where there is none."""
    n = stroke.force_N.size
    if n < 2 * _FEWEST_LEFT:
        return stroke
    change = running_mean(np.abs(np.diff(stroke.force_N)), _WIDTH)
    first, last = (int(share * n) for share in _MIDDLE)
    moving = np.flatnonzero(change >= _STILL * float(np.median(change[first:last])))
    end = int(moving[-1]) + 2 if moving.size else n
    if n - end < _SHORTEST * n or end < _FEWEST_LEFT:
        return stroke
    cut = {name: values[:end] for name, values in stroke.columns.items()}
    path = None if stroke.displacement_m is None else stroke.displacement_m[:end]
    return replace(
        stroke, time_s=stroke.time_s[:end], force_N=stroke.force_N[:end], displacement_m=path, columns=cut
    )  # fmt: skip
