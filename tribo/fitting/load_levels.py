"""Loads that scatter but were meant to be one."""

from __future__ import annotations

import numpy as np

from tribo.records import FloatArray

SAME_LOAD = 0.02  # share by which loads may differ and still be repeats of one load
ONE_LOAD = 0.05  # share of their median within which all loads of a sample lie if they were meant to be one


def levels_of(load_N: FloatArray, tolerance: float = SAME_LOAD) -> FloatArray:
    """The mean load of the level of each load (n,): a level holds the loads up to ``tolerance`` above its lowest."""
    order = np.argsort(load_N, kind="stable")
    level = np.zeros(load_N.size, int)
    lowest, number = -np.inf, -1
    for place, load in zip(order, load_N[order], strict=True):
        if not load - lowest <= tolerance * abs(load):
            lowest, number = load, number + 1
        level[place] = number
    means = np.bincount(level, load_N) / np.bincount(level) if load_N.size else load_N
    return np.asarray(means[level])


def meant_to_be_one(load_N: FloatArray) -> bool:
    """Whether all loads lie so close together that they are one load with scatter."""
    loads = load_N[np.isfinite(load_N)]
    return loads.size == 0 or float(np.ptp(loads)) <= ONE_LOAD * abs(float(np.median(loads)))
