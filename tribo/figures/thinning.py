"""Traces thinned for drawing: fewer points that look the same."""

from __future__ import annotations

import numpy as np

from tribo.records import FloatArray

PAGE_POINTS = 1200  # a page is 190 mm wide: more points along a line cannot be seen


def thin_trace(time: FloatArray, force: FloatArray, points: int = PAGE_POINTS) -> tuple[FloatArray, FloatArray]:
    """At most about ``points`` samples that look the same: lowest and highest of each stretch, in order.

    No spike or dip is lost, as it would be by taking every n-th sample.
    """
    n = len(force)
    if n <= points:
        return np.asarray(time), np.asarray(force)
    stretch = -(-n // (points // 2))
    padded = np.full(-(-n // stretch) * stretch, np.nan)
    padded[:n] = force
    rows = padded.reshape(-1, stretch)
    starts = np.arange(len(rows)) * stretch
    lowest = starts + np.argmin(np.where(np.isnan(rows), np.inf, rows), axis=1)
    highest = starts + np.argmax(np.where(np.isnan(rows), -np.inf, rows), axis=1)
    index = np.unique(np.concatenate([[0, n - 1], lowest, highest]))
    return np.asarray(time)[index], np.asarray(force)[index]
