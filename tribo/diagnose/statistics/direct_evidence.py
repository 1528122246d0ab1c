"""Direct evidence: what the force before contact and the slope of the rise say by themselves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribo.diagnose.statistics.observations import Observations
from tribo.records import FloatArray

CERTAIN = 5.0  # standard errors
NOISE_SHARE = 0.5  # an offset below half the noise of one reading does not matter to any result
RISE_PER_FOLD = 0.02


@dataclass(frozen=True)
class Evidence:
    """An estimate with its standard error, and whether it is certain and large enough to matter."""

    value: float
    standard_error: float
    certain: bool
    unit: str
    change: float = 0.0  # over the whole series, N or relative

    @property
    def interval(self) -> tuple[float, float]:
        """Ninety percent."""
        half = 1.645 * self.standard_error
        return self.value - half, self.value + half


def zero_offset(o: Observations) -> Evidence | None:
    """The typical force before contact, N; None where no trace shows it."""
    zero = o.zero_N[np.isfinite(o.zero_N)]
    if len(zero) < 3:
        return None
    centre, error = _centre(zero)
    return Evidence(centre, error, abs(centre) > CERTAIN * error and abs(centre) > _matters_N(o), "N", centre)


def zero_drift(o: Observations) -> Evidence | None:
    """Slope of the force before contact over the series, N/h; within the traces where the series has no clock."""
    across, within = _drift_across(o), _drift_within(o)
    certain = [e for e in (across, within) if e is not None and e.certain]
    return certain[0] if certain else across or within


def _drift_across(o: Observations) -> Evidence | None:
    """Over the hours of the clock, or those at the bench (nights left out), whichever the zero follows more surely."""
    clocks = (o.conditions.elapsed_s / 3600.0, _bench_hours(o.conditions.elapsed_s))
    found = [e for e in (_drift_along(o, hours) for hours in clocks) if e is not None]
    return max(found, key=lambda e: abs(e.value) / e.standard_error, default=None)


def _bench_hours(elapsed_s: FloatArray) -> FloatArray:
    """Hours since the first pull, no pause counted for more than five times the usual one."""
    order = np.argsort(elapsed_s)
    gaps = np.diff(elapsed_s[order], prepend=elapsed_s[order[0]])
    hours = np.empty_like(elapsed_s)
    hours[order] = np.cumsum(np.minimum(gaps, 5.0 * np.median(gaps))) / 3600.0
    return hours


def _drift_along(o: Observations, hours: FloatArray) -> Evidence | None:
    from scipy.stats import theilslopes

    good = np.isfinite(o.zero_N) & np.isfinite(hours)
    if good.sum() < 10 or np.ptp(hours[good]) <= 0:
        return None
    slope, _, low, high = theilslopes(o.zero_N[good], hours[good], 0.90)
    error = max((high - low) / 3.29, 1e-15)
    change = float(slope * np.ptp(hours[good]))
    certain = abs(slope) > CERTAIN * error and abs(change) > _matters_N(o)
    return Evidence(float(slope), float(error), bool(certain), "N/h", change)


def _drift_within(o: Observations) -> Evidence | None:
    slopes = o.zero_slope_N_per_s[np.isfinite(o.zero_slope_N_per_s)]
    if len(slopes) < 10:
        return None
    centre, error = _centre(slopes)
    change = centre * 20.0  # a pull lasts some twenty seconds
    certain = abs(centre) > CERTAIN * error and abs(change) > _matters_N(o)
    return Evidence(centre * 3600.0, error * 3600.0, bool(certain), "N/h", change)


def rise_stiffening(o: Observations) -> Evidence | None:
    """Relative stiffening of the rise per e-fold of speed; None at one speed."""
    speed = np.log(o.conditions.speed_m_s)
    good = np.isfinite(o.rise_N_per_m) & (o.rise_N_per_m > 0) & np.isfinite(speed)
    if good.sum() < 10 or np.ptp(speed[good]) < 0.1:
        return None
    x, y = speed[good] - speed[good].mean(), np.log(o.rise_N_per_m[good])
    slope = float(x @ (y - np.median(y)) / (x @ x))
    left = y - np.median(y) - slope * x
    error = float(1.4826 * np.median(np.abs(left)) / np.sqrt(x @ x))
    certain = abs(slope) > CERTAIN * error and abs(slope) > RISE_PER_FOLD
    return Evidence(slope, error, bool(certain), "", slope * float(np.ptp(x)))


def _centre(values: FloatArray) -> tuple[float, float]:
    """Median and its standard error."""
    centre = float(np.median(values))
    spread = 1.4826 * float(np.median(np.abs(values - centre)))
    return centre, max(1.2533 * spread / np.sqrt(len(values)), 1e-15)


def _matters_N(o: Observations) -> float:
    """Half the noise of one reading; where the noise is unknown, half a percent of a weak pull."""
    noise = o.noise_N[np.isfinite(o.noise_N)]
    if len(noise):
        return NOISE_SHARE * float(np.median(noise))
    return 0.005 * float(np.exp(np.quantile(o.log_force, 0.05)))
