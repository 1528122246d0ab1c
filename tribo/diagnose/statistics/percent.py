"""Percentages of a diagnosis: all are 100 (measured / model - 1), with their sign, made here from ln(measured / model).

A change is that of measured / model from one end of a column to the other, as a ratio less one.
"""

from __future__ import annotations

import numpy as np

from tribo.records import FloatArray

ENDS = (0.05, 0.95)  # quantiles of a column between which a change is stated


def percent(log_ratio: FloatArray | float) -> FloatArray:
    """100 (measured / model - 1) of ln(measured / model), any shape."""
    return np.asarray(100.0 * np.expm1(log_ratio))


def mean_percent(log_ratio: FloatArray) -> float:
    """The mean over tests of 100 (measured / model - 1)."""
    return float(percent(log_ratio).mean())


def rms_percent(log_ratio: FloatArray) -> float:
    """The root mean square over tests of 100 (measured / model - 1); those without a value are left out."""
    return float(np.sqrt(np.nanmean(percent(log_ratio) ** 2)))


def change_percent(score: FloatArray, log_ratio: FloatArray) -> float:
    """Change of measured / model from the low to the high end of a column, by a straight line in ``score`` (n,)."""
    slope = np.polyfit(score, log_ratio, 1)[0]
    low, high = np.quantile(score, ENDS)
    return float(percent(slope * (high - low)))


def bend_percent(score: FloatArray, line: FloatArray, log_ratio: FloatArray) -> float:
    """How far the ends of a column lie above its middle: the part of ``score`` (n,) beside a straight ``line`` (n,)."""
    columns = np.column_stack([score, line, np.ones_like(score)])
    slope = np.linalg.lstsq(columns, log_ratio, rcond=None)[0][0]
    return float(percent(slope * np.ptp(score)))


def contrast_percent(inside: FloatArray, outside: FloatArray) -> float:
    """The geometric mean of measured / model ``inside`` over that ``outside``, less one; both as logarithms."""
    return float(percent(inside.mean() - outside.mean()))


def interval_percent(value: float, strength: float, factor: float) -> tuple[float, float]:
    """Ends of the interval of a percentage that differs from zero by ``strength`` standard deviations in ln T."""
    middle = np.log1p(value / 100.0)
    half = factor * abs(middle) / max(strength, 1e-9)
    low, high = percent(np.array([middle - half, middle + half]))
    return float(low), float(high)
