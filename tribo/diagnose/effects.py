"""The size of what a look sees, as a signed percentage: 100 (measured / model - 1), or the change of that ratio."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribo.diagnose.search.looks import BENT, Look
from tribo.diagnose.statistics.interval import NORMAL_90
from tribo.diagnose.statistics.linearisation import ModelFit
from tribo.diagnose.statistics.percent import (
    bend_percent,
    change_percent,
    contrast_percent,
    interval_percent,
    mean_percent,
    percent,
)
from tribo.mechanisms.record import Conditions
from tribo.records import FloatArray

SHARES = {"static": (1.0, 0.0), "sliding": (0.0, 1.0), "both": (0.5, 0.5), "drop": (1.0, -1.0)}


@dataclass(frozen=True)
class Residual:
    """ln(measured / model) of every test (n, 2), with the conditions of the tests."""

    log_ratio: FloatArray
    conditions: Conditions


def residual_of(model: ModelFit) -> Residual:
    """What a model leaves."""
    return Residual(model.residual, model.setup.observations.conditions)


@dataclass(frozen=True)
class Effect:
    """A signed percentage with its 90 % interval, and between what it is taken."""

    percent: float
    low: float
    high: float
    between: str


def effect_of_look(look: Look, residual: Residual, coefficients: FloatArray, size: float, strength: float) -> Effect:
    """What a look sees; ``size`` is its peak-to-peak effect in ln T, stated where a straight line does not give it.

    That of a mechanism has the sign of its largest change; that of several columns has none.
    """
    value, between = _signed(look, residual)
    if not np.isfinite(value):
        change = (look.columns @ coefficients).ravel()
        sign = float(np.sign(change[np.abs(change).argmax()])) if look.freedom == 1 else 1.0
        value, between = float(percent(sign * min(size, 5.0))), "between its extremes"
    return Effect(value, *interval_percent(value, strength, NORMAL_90), between)


def _signed(look: Look, residual: Residual) -> tuple[float, str]:
    weight = np.array(SHARES[look.observable])
    y, x = residual.log_ratio @ weight, look.columns[:, int(weight[0] == 0.0), 0]
    sample = residual.conditions.sample
    here = sample == look.sample if look.kind == "sample" else np.ones(len(y), bool)
    if look.kind == "sample" and look.covariate == "sample":
        return mean_percent(y[here]), "mean"
    if look.kind == "sample" and look.covariate.endswith(BENT):
        line = np.log(residual.conditions.normal_load_N[here])
        return bend_percent(x[here], line, y[here]), "the ends above the middle"
    if look.kind in ("sample", "trend") and np.ptp(x[here]) > 0:
        return change_percent(x[here], y[here]), "from the low to the high end"
    if look.kind == "block" or (look.kind == "specimen" and not look.covariate.endswith(" by load")):
        siblings = np.isin(sample, look.sample.split("/")) if look.kind == "specimen" else here
        inside, outside = siblings & (x > 0), siblings & (x <= 0)
        if inside.any() and outside.any():
            return contrast_percent(y[inside], y[outside]), "ratio of geometric means"
    return float("nan"), ""
