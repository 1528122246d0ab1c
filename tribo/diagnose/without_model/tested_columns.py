"""The tests of one regime as columns: ln T, the law of every sample alone, and every other recorded column."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribo.mechanisms.record import StringArray
from tribo.records import FloatArray, Ingested, Pull, Regime, Test

FEWEST_TESTS = 12
SAME_LOAD = 0.02  # relative distance of loads that were meant to be one
MOST_NAMES = 12
BINS = 4
PRESENT = 0.75  # share of the tests that must have a value in a column
LOGARITHMIC = ("speed_mm_s", "hold_s")
NUMBERS = ("hold_s", "temperature_C", "humidity_pct", "run_order", "specimen_run", "repeat")
_LOAD_BY_ANOTHER_NAME = ("nominal_load_N",)
LEFT_OVER = 0.02  # share of a column's variance beyond the laws of the samples below which it cannot be told from load


@dataclass(frozen=True)
class Column:
    """One way to follow a recorded column: ``columns`` (n, d) beside the law, and where its values run from and to.

    ``kind`` is trend, course (groups of a number) or names. ``levels`` are the names of groups, the first being the
    reference.
    """

    name: str
    kind: str
    columns: FloatArray
    low: float = float("nan")
    high: float = float("nan")
    levels: tuple[str, ...] = ()


@dataclass(frozen=True)
class Tested:
    """The tests of one regime with a positive force: ln T, (n,), and ``law`` (n, p), the law of every sample alone.

    The law of a sample is its mean at every load where loads are repeated, else a parabola of ln T in ln N as far as
    the loads determine it.
    """

    regime: Regime
    sample: StringArray
    specimen: StringArray
    load_N: FloatArray
    log_force: FloatArray
    law: FloatArray
    columns: tuple[Column, ...]
    untold: tuple[str, ...]

    @property
    def n(self) -> int:
        return len(self.log_force)

    @property
    def enough(self) -> bool:
        """Whether there are tests enough, and more than the laws take up."""
        return self.n >= FEWEST_TESTS and self.n >= 2 * self.law.shape[1]


def points_of(ingested: Ingested, regime: Regime) -> Tested:
    """The tests of one regime; ``untold`` are columns that vary within samples, but only together with the load."""
    pairs = [
        (test, pull)
        for test in ingested.campaign.tests
        if (pull := ingested.pulls.get(test.test_id)) is not None
        and getattr(pull, f"{regime}_N") > 0 and test.normal_load_N > 0
    ]  # fmt: skip
    tests, pulls = [t for t, _ in pairs], [p for _, p in pairs]
    sample = np.array([t.sample for t in tests], str)
    load = np.array([t.normal_load_N for t in tests], float)
    law = _laws(sample, load)
    found = [c for c in _columns(tests, pulls) if np.ptp(c.columns) > 0] if tests else []
    told = [c for c in found if _beyond(law, c.columns) > LEFT_OVER]
    samples = (sample[:, None] == np.unique(sample)[None]).astype(float)
    names = {c.name for c in told} | {c.name for c in found if _beyond(samples, c.columns) <= LEFT_OVER}
    return Tested(
        regime, sample, np.array([t.specimen for t in tests], str), load,
        np.log([getattr(p, f"{regime}_N") for p in pulls]), law, tuple(told),
        tuple(dict.fromkeys(c.name for c in found if c.name not in names)),
    )  # fmt: skip


def _laws(sample: StringArray, load_N: FloatArray) -> FloatArray:
    """Columns of the law of every sample, (n, p)."""
    found = []
    for name in np.unique(sample):
        here = sample == name
        level = load_levels(load_N[here])
        count = len(np.unique(level))
        if count > 1 and here.sum() >= 2 * count:
            shapes = [(level == k).astype(float) for k in range(count)]
        else:
            x = np.log(load_N[here])
            shapes = [(x - x.mean()) ** k for k in range(min(count, 3))]
        for shape in shapes:
            column = np.zeros(len(sample))
            column[here] = shape
            found.append(column)
    return np.column_stack(found) if found else np.zeros((len(sample), 0))


def load_levels(load_N: FloatArray) -> NDArray[np.int64]:
    """The number of the level of each load, (n,): neighbours closer than two percent are one level."""
    order = np.argsort(load_N)
    steps = np.diff(np.log(load_N[order])) > SAME_LOAD
    level = np.empty(len(load_N), int)
    level[order] = np.concatenate([[0], np.cumsum(steps)])
    return level


def _beyond(law: FloatArray, columns: FloatArray) -> float:
    """Share of the variance of columns that the laws do not take up."""
    centred = columns - columns.mean(axis=0)
    left = columns - law @ np.linalg.lstsq(law, columns, rcond=None)[0]
    return float(np.sum(left**2) / max(float(np.sum(centred**2)), 1e-300))


def _columns(tests: list[Test], pulls: list[Pull]) -> Iterator[Column]:
    yield from _of_numbers("speed_mm_s", np.array([1e3 * t.speed_m_s if t.speed_m_s else np.nan for t in tests]))
    for name in NUMBERS:
        values = np.array([np.nan if (v := getattr(t, name)) is None else float(v) for t in tests])
        yield from _of_numbers(name, values)
    yield from _of_names("operator", [t.operator for t in tests])
    yield from _of_names("direction", [_direction(t, p) for t, p in zip(tests, pulls, strict=True)])
    yield from _of_names("date", [t.started_at[:10] for t in tests])
    for name in sorted({c for t in tests for c in t.covariates} - set(_LOAD_BY_ANOTHER_NAME)):
        cells = [str(t.covariates.get(name, "")) for t in tests]
        numbers = np.array([_number(cell) for cell in cells])
        if np.isfinite(numbers).any():
            yield from _of_numbers(name, numbers)
        else:
            yield from _of_names(name, cells)


def _direction(test: Test, pull: Pull) -> str:
    return test.direction or next((way for way in ("forward", "backward") if way in pull.flags), "")


def _number(cell: str) -> float:
    try:
        return float(cell.replace(",", "."))
    except ValueError:
        return float("nan")


def _of_numbers(name: str, values: FloatArray) -> Iterator[Column]:
    """A trend, and the course over up to four groups; tests without a value lie at the mean."""
    there = np.isfinite(values) & ((values > 0) | (name not in LOGARITHMIC))
    if there.mean() < PRESENT or np.ptp(values[there]) <= 1e-9 * np.abs(values[there]).max():
        return
    low, high = float(values[there].min()), float(values[there].max())
    filled = np.where(there, values, values[there].mean())
    along = np.log(filled) if name in LOGARITHMIC else filled
    yield Column(name, "trend", ((along - along.mean()) / np.ptp(along))[:, None], low, high)
    distinct = np.unique(values[there])
    edges = distinct[1:] if len(distinct) <= BINS else np.unique(np.quantile(values[there], np.arange(1, BINS) / BINS))
    code = np.searchsorted(edges, filled, side="right")
    groups = [k for k in range(1, len(edges) + 1) if (there & (code == k)).any()]
    if len(groups) > 1:
        parts = [values[there & (code == k)] for k in (0, *groups)]
        levels = tuple(_span(part) for part in parts)
        yield Column(name, "course", np.column_stack([code == k for k in groups]).astype(float), low, high, levels)


def _span(values: FloatArray) -> str:
    return f"{values.min():.3g} to {values.max():.3g}" if np.ptp(values) else f"{values.min():.3g}"


def _of_names(name: str, cells: list[str]) -> Iterator[Column]:
    names = sorted(set(cells) - {""})
    if 1 < len(names) <= min(MOST_NAMES, len(cells) // 3) and sum(map(bool, cells)) >= PRESENT * len(cells):
        column = np.array(cells, str)
        levels = np.column_stack([column == n for n in names[1:]]).astype(float)
        yield Column(name, "names", levels, levels=tuple(names))
