"""The bundled record of what the spring-block model makes of known patterns, and of how wrong it may be.

``data/pattern_shares`` says how both files were made; docs/results/model-error.md says what the numbers mean.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType

from tribo.published import PATTERN_SHARES, data_dir
from tribo.records import REGIMES, Pattern

Law = tuple[float, float, float, float]
"""Static mu, static tau0, sliding mu, sliding tau0 (in kPa), or their shares of those of the flat sample."""
LAW, SHARES = ("mu", "tau0_kPa"), ("mu_share", "tau0_share")  # columns
UM = 1e-6


@dataclass(frozen=True)
class TabledPattern:
    """One simulated pattern. ``direction`` is "x" or "y" where the pull has one, else empty."""

    sample: str
    pattern: Pattern
    direction: str
    law: Law
    shares: Law


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
        return ErrorSize(
            _both(self.offset, other.offset), _both(self.slope, other.slope), _both(self.curve, other.curve)
        )


def _both(a: tuple[float, float], b: tuple[float, float]) -> tuple[float, float]:
    static, sliding = ((x * x + y * y) ** 0.5 for x, y in zip(a, b, strict=True))
    return static, sliding


NO_ERROR = ErrorSize((0.0, 0.0), (0.0, 0.0), (0.0, 0.0))


@cache
def simulated_patterns() -> tuple[TabledPattern, ...]:
    """The patterns of ``laws.csv``, without the flat sample."""
    rows = _rows("laws.csv")
    samples = dict.fromkeys(row["sample"] for row in rows if row["cavity"] != "none")
    return tuple(_tabled([row for row in rows if row["sample"] == s]) for s in samples)


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


def _tabled(rows: list[dict[str, str]]) -> TabledPattern:
    row = rows[0]
    size_x, size_y, pitch_x, pitch_y = (
        float(row[f"{name}_{axis}_um"]) * UM for name in ("size", "pitch") for axis in ("x", "y")
    )
    name = row["sample"].removesuffix(row["direction"])
    pattern = Pattern(name, row["cavity"], (size_x, size_y), (pitch_x, pitch_y), row["staggered"] == "1")
    return TabledPattern(row["sample"], pattern, row["direction"], _four(rows, LAW), _four(rows, SHARES))


def _four(rows: list[dict[str, str]], columns: tuple[str, str]) -> Law:
    by_regime = {row["regime"]: row for row in rows}
    a, b, c, d = (float(by_regime[regime][name]) for regime in REGIMES for name in columns)
    return a, b, c, d
