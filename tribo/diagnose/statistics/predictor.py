"""The quick predictor: what the spring-block model makes of a pattern, as shares of the flat law.

The thresholds of all blocks scale together, so the model's law of a pattern is that of the flat sample times
four numbers: T = (m mu) N + (a tau0) A in each regime. They are tabulated from calibrated simulations
(85 x 85 blocks, 10 stratified angles, 3 to 25 kPa, local law 5.5 / 23.45 kPa static, 2.9 / 11.6 kPa sliding).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tribo.records import FloatArray, Pattern

if TYPE_CHECKING:
    import pandas as pd

Shares = tuple[float, float, float, float]  # static mu, static tau0, sliding mu, sliding tau0

# (cavity size x, y, pitch x, y in um, pulled along) -> mu, tau0 in kPa, static and sliding
FLAT_LAW = (4.79, 23.44, 2.93, 11.2)
_SIMULATED: dict[tuple[float, float, float, float, str], Shares] = {
    (5, 5, 20, 20, ""): (4.40, 18.8, 2.97, 11.0),
    (10, 10, 15, 15, ""): (4.18, 10.7, 3.09, 7.0),
    (15, 15, 20, 20, ""): (4.04, 7.9, 3.08, 5.4),
    (200, 40, 220, 120, "x"): (3.73, 12.5, 2.99, 8.5),
    (200, 40, 220, 120, "y"): (3.63, 10.1, 3.00, 8.6),
}
# Standard deviation of ln T by which two codes of the same model differ: K_s halved, cavities that touch the
# edge, window and angle law move a pattern's static force by 3 to 13 % and its sliding force by 2 to 8 %.
OFFSET = (0.055, 0.045)
SLOPE = (0.02, 0.02)  # per e-fold of pressure
LEAST_SPREAD = 2.0  # largest over smallest load from which mu and tau0 part
UNTABLED = 1.6  # a pattern that was never simulated is predicted that much worse


@dataclass(frozen=True)
class Predictor:
    """Shares of the flat law per sample and the model's own error, as standard deviations of ln T.

    ``offset`` and ``slope`` (per e-fold of pressure) hold (static, sliding) per sample; a flat sample has none.
    """

    shares: Mapping[str, Shares]
    offset: Mapping[str, tuple[float, float]]
    slope: Mapping[str, tuple[float, float]]
    source: str

    def table(self, samples: FloatArray | np.ndarray) -> FloatArray:
        """Shares of every test, shape (n, 4)."""
        return np.array([self.shares[s] for s in samples], float).reshape(-1, 4)


def tabled_predictor(patterns: Mapping[str, Pattern]) -> Predictor:
    """The predictor of a campaign's samples from the tabulated simulations."""
    shares = {name: _shares(name, pattern) for name, pattern in patterns.items()}
    return _with_error(patterns, shares, "tabulated simulations")


def simulated_predictor(
    patterns: Mapping[str, Pattern], simulated: pd.DataFrame, flat: str, nominal_area_m2: float
) -> Predictor:
    """The predictor of a campaign's samples from an ensemble of its own.

    ``simulated`` has one row a run: sample, normal_load_N, static_N, sliding_N. Samples it lacks, or has at
    loads too close together for a line, are taken from the table, and so is all where that is the flat sample.
    """
    spread = simulated.groupby("sample")["normal_load_N"].agg(lambda loads: loads.max() / loads.min())
    enough = simulated[simulated["sample"].isin(spread.index[spread >= LEAST_SPREAD])]
    laws = {str(s): _law_of_runs(rows, nominal_area_m2) for s, rows in enough.groupby("sample")}
    reference = laws.get(flat)
    if reference is None:
        return tabled_predictor(patterns)
    shares = {name: _shares(name, pattern) for name, pattern in patterns.items()}
    own = {
        s: (float(v[0]), float(v[1]), float(v[2]), float(v[3]))
        for s, law in laws.items()
        if s in patterns and np.all(np.isfinite(v := law / reference))
    }
    lacking = sorted(s for s, p in patterns.items() if p.area_fraction < 1.0 and s not in own)
    source = "an ensemble simulated for this campaign"
    said = f"{source} (without {', '.join(lacking)})" if lacking else source
    return _with_error(patterns, shares | own, said, simulated=own)


def _law_of_runs(rows: pd.DataFrame, area_m2: float) -> FloatArray:
    """mu and tau0 in Pa of both regimes, relative errors weighted alike."""
    load = rows["normal_load_N"].to_numpy(float)
    found = []
    for column in ("static_N", "sliding_N"):
        force = rows[column].to_numpy(float)
        design = np.column_stack([load, np.full_like(load, area_m2)]) / force[:, None]
        found += list(np.linalg.lstsq(design, np.ones_like(load), rcond=None)[0])
    return np.array(found)


def _with_error(
    patterns: Mapping[str, Pattern], shares: Mapping[str, Shares], source: str, simulated: Collection[str] = ()
) -> Predictor:
    wide = {name: _width(name, pattern, name in simulated) for name, pattern in patterns.items()}
    return Predictor(
        shares={**shares, "flat": (1.0, 1.0, 1.0, 1.0)},
        offset={name: (OFFSET[0] * w, OFFSET[1] * w) for name, w in wide.items()},
        slope={name: (SLOPE[0] * w, SLOPE[1] * w) for name, w in wide.items()},
        source=source,
    )


def _width(name: str, pattern: Pattern, simulated: bool) -> float:
    """0 for a flat sample, 1 for a pattern that was simulated, more for one that is interpolated."""
    if pattern.area_fraction == 1.0:
        return 0.0
    return 1.0 if simulated or _key(name, pattern) is not None else UNTABLED


def _shares(name: str, pattern: Pattern) -> Shares:
    if pattern.area_fraction == 1.0:
        return (1.0, 1.0, 1.0, 1.0)
    key = _key(name, pattern)
    if key is not None:
        row = np.array(_SIMULATED[key]) / np.array(FLAT_LAW)
        return (float(row[0]), float(row[1]), float(row[2]), float(row[3]))
    return _interpolated(pattern.area_fraction)


def _interpolated(area_fraction: float) -> Shares:
    """Between the tabulated patterns by area fraction: the efficiency of a pattern falls with its cavities."""
    keys = sorted(_SIMULATED, key=_area_fraction)
    known = np.array([*(_area_fraction(key) for key in keys), 1.0])
    rows = [np.array(_SIMULATED[key]) / FLAT_LAW / [1.0, a, 1.0, a] for key, a in zip(keys, known[:-1], strict=True)]
    at = [float(np.interp(area_fraction, known, column)) for column in np.array([*rows, np.ones(4)]).T]
    return (at[0], at[1] * area_fraction, at[2], at[3] * area_fraction)


def _area_fraction(key: tuple[float, float, float, float, str]) -> float:
    """Nominal area fraction: cavities as wide as long are round."""
    share = np.pi / 4 if key[0] == key[1] else 1.0
    return float(1.0 - share * key[0] * key[1] / (key[2] * key[3]))


def _key(name: str, pattern: Pattern) -> tuple[float, float, float, float, str] | None:
    """The tabulated pattern with this cavity and pitch, within 2 %."""
    if pattern.size_m is None or pattern.pitch_m is None:
        return None
    wanted = np.array([*pattern.size_m, *pattern.pitch_m]) * 1e6
    for key in _SIMULATED:
        alike = np.allclose(np.array(key[:4], float), wanted, rtol=0.02)
        if alike and (key[4] == "" or name[-1:].lower() == key[4]):
            return key
    return None
