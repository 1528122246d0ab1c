"""The quick predictor: what the spring-block model makes of a pattern, as shares of the flat law, and its error.

The thresholds of all blocks scale together, so the model's law of a pattern is that of the flat sample times
four numbers: T = (m mu) N + (a tau0) A in each regime. They come from the bundled table of simulated patterns or from
an ensemble of the campaign's own. ``data/pattern_shares`` says how its files were made; docs/results/model-error.md
says what the numbers mean.
"""

from __future__ import annotations

import csv
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from functools import cache
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from tribo.display import displayed
from tribo.files import PATTERN_SHARES, data_dir
from tribo.records import REGIMES, FloatArray, Pattern

if TYPE_CHECKING:
    import pandas as pd


Law = tuple[float, float, float, float]
"""Static mu, static tau0, sliding mu, sliding tau0 (in kPa), or their shares of those of the flat sample."""
LAW, SHARES = ("mu", "tau0_kPa"), ("mu_share", "tau0_share")  # columns
UM = 1e-6


Known = tuple[Pattern, Law]
"""A simulated pattern, and its shares."""


@displayed()
@dataclass(frozen=True)
class ErrorSize:
    """Standard deviations of ln T of a pattern, each (static, sliding).

    ``offset`` is that of all loads, ``slope`` the change per e-fold of pressure, ``curve`` per squared e-fold.
    """

    offset: tuple[float, float]
    slope: tuple[float, float]
    curve: tuple[float, float]

    def with_(self, other: ErrorSize) -> ErrorSize:
        """Both errors at once, independent of each other."""

        def both(a: tuple[float, float], b: tuple[float, float]) -> tuple[float, float]:
            static, sliding = ((x * x + y * y) ** 0.5 for x, y in zip(a, b, strict=True))
            return static, sliding

        return ErrorSize(both(self.offset, other.offset), both(self.slope, other.slope), both(self.curve, other.curve))

    def scaled(self, factor: float) -> ErrorSize:
        """The error ``factor`` times as large."""
        offset, slope, curve = ((factor * v[0], factor * v[1]) for v in (self.offset, self.slope, self.curve))
        return ErrorSize(offset, slope, curve)


NO_ERROR = ErrorSize((0.0, 0.0), (0.0, 0.0), (0.0, 0.0))


@cache
def simulated_patterns() -> Mapping[str, Known]:
    """The patterns of ``laws.csv`` by sample, without the flat one; a sample whose pull has a direction ends in it."""
    rows = _rows("laws.csv")
    patterns = {}
    for sample in dict.fromkeys(row["sample"] for row in rows if row["cavity"] != "none"):
        own = [row for row in rows if row["sample"] == sample]
        row = own[0]
        size_x, size_y, pitch_x, pitch_y = (
            float(row[f"{name}_{axis}_um"]) * UM for name in ("size", "pitch") for axis in ("x", "y")
        )
        name = sample.removesuffix(row["direction"])
        pattern = Pattern(name, row["cavity"], (size_x, size_y), (pitch_x, pitch_y), row["staggered"] == "1")
        patterns[sample] = pattern, _four(own, SHARES)
    return MappingProxyType(patterns)


@cache
def flat_law() -> Law:
    """Law of the simulated flat sample under the paper's local friction."""
    return _four([row for row in _rows("laws.csv") if row["cavity"] == "none"], LAW)


@cache
def error_sizes() -> Mapping[str, ErrorSize]:
    """By source as in ``errors.csv``; "total" is that of a simulated pattern, "interpolation" what one that was not
    simulated has on top of it."""
    rows = {(row["source"], row["regime"]): row for row in _rows("errors.csv")}
    return MappingProxyType({
        source: ErrorSize(*(
            (float(rows[source, REGIMES[0]][size]), float(rows[source, REGIMES[1]][size]))
            for size in ("offset", "slope", "curve")
        ))
        for source in dict.fromkeys(source for source, _ in rows)
    })  # fmt: skip


def record() -> tuple[object, ...]:
    """Everything a diagnosis takes from the files: what a kept result of it was made from."""
    return flat_law(), simulated_patterns(), error_sizes()


def _rows(name: str) -> list[dict[str, str]]:
    with (data_dir() / PATTERN_SHARES / name).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def _four(rows: list[dict[str, str]], columns: tuple[str, str]) -> Law:
    by_regime = {row["regime"]: row for row in rows}
    a, b, c, d = (float(by_regime[regime][name]) for regime in REGIMES for name in columns)
    return a, b, c, d


LEAST_SPREAD = 2.0  # largest over smallest load from which mu and tau0 part
ALIKE = 0.02  # by which the lengths of a pattern may differ from those of a simulated one


@displayed()
@dataclass(frozen=True)
class Predictor:
    """Shares of the flat law per sample and the model's own ``error``; a flat sample has none.

    ``source`` says where the shares come from.
    """

    shares: Mapping[str, Law]
    error: Mapping[str, ErrorSize]
    source: str

    def scaled(self, factor: float) -> Predictor:
        """The same shares with the model's own error ``factor`` times as large.

        Raises
        ------
        ValueError
            The factor is negative or not a number.
        """
        if not factor >= 0.0:
            raise ValueError(f"the error of the model is scaled by {factor}, allowed is a factor of 0 or more")
        return replace(self, error={sample: error.scaled(factor) for sample, error in self.error.items()})

    def table(self, samples: FloatArray | np.ndarray) -> FloatArray:
        """Shares of every test, shape (n, 4)."""
        return np.array([self.shares[s] for s in samples], float).reshape(-1, 4)


def tabled_predictor(patterns: Mapping[str, Pattern]) -> Predictor:
    """The predictor of a campaign's samples from the bundled table of simulated patterns."""
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
    law: list[float] = []
    for column in ("static_N", "sliding_N"):
        force = rows[column].to_numpy(float)
        design = np.column_stack([load, np.full_like(load, area_m2)]) / force[:, None]
        law += list(np.linalg.lstsq(design, np.ones_like(load), rcond=None)[0])
    return np.array(law)


def _with_error(
    patterns: Mapping[str, Pattern], shares: Mapping[str, Law], source: str, simulated: Collection[str] = ()
) -> Predictor:
    """With that of the model for a pattern that was simulated, more for one that is interpolated."""
    known, error = error_sizes(), {}
    for name, pattern in patterns.items():
        if pattern.area_fraction == 1.0:
            error[name] = NO_ERROR
        elif name in simulated or _simulated_shares(name, pattern) is not None:
            error[name] = known["total"]
        else:
            error[name] = known["total"].with_(known["interpolation"])
    return Predictor({**shares, "flat": (1.0, 1.0, 1.0, 1.0)}, error, source)


def _shares(name: str, pattern: Pattern) -> Law:
    if pattern.area_fraction == 1.0:
        return (1.0, 1.0, 1.0, 1.0)
    same = _simulated_shares(name, pattern)
    return interpolated_shares(pattern.area_fraction, simulated_patterns().values()) if same is None else same


def interpolated_shares(area_fraction: float, known: Collection[Known]) -> Law:
    """Shares of a pattern that was not simulated, between those of the known ones and of the flat sample.

    By area fraction, in which mu's share and tau0's share per contact area are piecewise linear. Patterns of equal area
    fraction are averaged; below the smallest one both are held.
    """
    at = np.array([pattern.area_fraction for pattern, _ in known])
    levels = np.unique(at.round(9))
    per_area = np.array([shares for _, shares in known]) / np.array([np.ones_like(at), at, np.ones_like(at), at]).T
    rows = [per_area[np.isclose(at, level)].mean(axis=0) for level in levels]
    x, y = np.append(levels, 1.0), np.array([*rows, np.ones(4)])
    m_static, a_static, m_sliding, a_sliding = (float(np.interp(area_fraction, x, column)) for column in y.T)
    return m_static, a_static * area_fraction, m_sliding, a_sliding * area_fraction


def _simulated_shares(name: str, pattern: Pattern) -> Law | None:
    """Those of the simulated pattern with this cavity and pitch, pulled along the direction that ends the sample's
    name."""
    wanted = _lengths_m(pattern)
    for sample, (simulated, shares) in simulated_patterns().items() if wanted else ():
        direction = sample.removeprefix(simulated.name)
        same = np.allclose(_lengths_m(simulated), wanted, rtol=ALIKE, atol=0.0)
        if same and direction in ("", name[-1:].lower()):
            return shares
    return None


def _lengths_m(pattern: Pattern) -> tuple[float, ...]:
    """Size and pitch of the cavities, nothing for a pattern that does not say them."""
    return (*pattern.size_m, *pattern.pitch_m) if pattern.size_m and pattern.pitch_m else ()
