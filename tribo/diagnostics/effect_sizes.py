"""The size of a contrast as a signed percentage: 100 (measured / model - 1), made here from ln(measured / model).

A change is that of measured / model from one end of a column to the other, as a ratio less one.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np

from tribo.diagnostics.contrasts import BEND, Contrast, Screen
from tribo.diagnostics.model import RECORDED
from tribo.diagnostics.verdict import Misfit
from tribo.mechanisms.record import Conditions
from tribo.records import FloatArray

NORMAL_90 = 1.645  # standard deviations to the ends of a 90 % interval
ENDS = (0.05, 0.95)  # quantiles of a column between which a change is stated


def percent(log_ratio: FloatArray | float) -> FloatArray:
    """100 (measured / model - 1) of ln(measured / model), any shape."""
    return np.asarray(100.0 * np.expm1(log_ratio))


def mean_percent(log_ratio: FloatArray) -> float:
    """The geometric mean over tests of measured over modelled T, less one, in percent."""
    return float(percent(log_ratio.mean()))


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


def interval_percent(value: float, strength: float) -> tuple[float, float]:
    """Ends of the 90 % interval of a percentage that differs from zero by ``strength`` standard deviations in ln T."""
    middle = np.log1p(value / 100.0)
    half = NORMAL_90 * abs(middle) / max(strength, 1e-9)
    low, high = percent(np.array([middle - half, middle + half]))
    return float(low), float(high)


SHARES = {"static": (1.0, 0.0), "sliding": (0.0, 1.0), "both": (0.5, 0.5), "drop": (1.0, -1.0)}


Between = Literal["mean", "bend", "ends", "groups", "extremes"]
Run = Literal["rising", "falling", "hump", "hollow"]


def misfit_of_contrast(screened: Screen, k: int, log_ratio: FloatArray, conditions: Conditions) -> Misfit:
    """What one contrast of a screen sees in ``log_ratio`` (n, 2), the ln(measured / model) of every test, as a misfit.

    Where no straight line gives its size, that is the peak-to-peak effect of the screen: positive where a mechanism
    rises with the recorded number that it follows, else with the sign of its largest change; without a sign of several
    columns. The misfit shows the contrast, between what its size is
    taken, and the run of the means of groups, of a contrast at several of them.
    """
    contrast, coefficients, size = screened.contrasts[k], screened.coefficients[k], float(screened.size[k])
    value, between = _signed(contrast, log_ratio, conditions)
    if not np.isfinite(value):
        sign = _direction(contrast, contrast.columns @ coefficients, conditions) if contrast.freedom == 1 else 1.0
        value, between = float(percent(sign * min(size, 5.0))), "extremes"
    steps = np.diff(np.concatenate([[0.0], coefficients]))  # between the means of groups; that of the first is zero
    middle = coefficients[:-1].mean() if len(coefficients) > 1 else coefficients[0]
    course: Run = "hump" if middle > 0.5 * coefficients[-1] else "hollow"
    if np.all(steps > 0) or np.all(steps < 0):
        course = "rising" if np.all(steps > 0) else "falling"
    low, high = interval_percent(value, float(screened.strength[k]))
    return Misfit(
        contrast.observable, contrast.sample, contrast.column, value, float(screened.p[k]), low=low, high=high,
        shows=(replace(contrast, courses=()), between, course),
    )  # fmt: skip


def _direction(contrast: Contrast, change: FloatArray, conditions: Conditions) -> float:
    """The sign of a change (n, 2) of ln T."""
    needs = contrast.acting.mechanism.needs if contrast.acting is not None else ()
    if len(needs) == 1 and needs[0] in RECORDED:
        number = conditions.recorded(needs[0])
        known = np.isfinite(number)
        along = float(np.sum(change[known].mean(axis=1) * (number - np.mean(number[known]))[known]))
        if along != 0.0:
            return float(np.sign(along))
    return float(np.sign(change.ravel()[np.abs(change).argmax()]))


def _signed(contrast: Contrast, log_ratio: FloatArray, conditions: Conditions) -> tuple[float, Between]:
    weight = np.array(SHARES[contrast.observable])
    y, x = log_ratio @ weight, contrast.columns[:, int(weight[0] == 0.0), 0]
    sample = conditions.sample
    here = sample == contrast.sample if contrast.kind == "sample" else np.ones(len(y), bool)
    if contrast.kind == "sample" and contrast.covariate == "sample":
        return mean_percent(y[here]), "mean"
    if contrast.kind == "sample" and contrast.detail == BEND:
        line = np.log(conditions.normal_load_N[here])
        return bend_percent(x[here], line, y[here]), "bend"
    if contrast.kind in ("sample", "trend") and np.ptp(x[here]) > 0:
        return change_percent(x[here], y[here]), "ends"
    if contrast.kind == "block" or (contrast.kind == "specimen" and not contrast.detail):
        siblings = np.isin(sample, contrast.sample.split("/")) if contrast.kind == "specimen" else here
        inside, outside = siblings & (x > 0), siblings & (x <= 0)
        if inside.any() and outside.any():
            return float(percent(y[inside].mean() - y[outside].mean())), "groups"
    return float("nan"), "extremes"
