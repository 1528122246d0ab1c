"""Causes that are bound to one value of a recorded quantity: a wrong weight, a day's tare, an operator, a specimen.

Sizes are drawn in plain units; where an observer who knows all covariances would hardly see one, it is made larger, or
another value is taken. ``LARGEST`` is how far it may go.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from blind.bench import GRAVITY

from .campaign import HIDDEN, Hide, LaboratoryBench, bare_bench, both, multiply, rms_percent
from .laboratory import SLIDER_G, Laboratory, day_of
from .observer import Observer

STRENGTH = 9.0  # at least, for an observer who knows all covariances
TRIES = 12  # of other values, where physics does not allow this strength
ROUNDS = 3  # of making a cause larger, as its strength is not quite in proportion to its size
# plain range of each kind's size, and the largest
SIZES: dict[str, tuple[float, float, float]] = {
    "weight": (0.08, 0.20, 0.5), "load of a day": (3.0, 8.0, 20.0), "tare of a day": (0.02, 0.06, 0.2),
    "operator": (0.05, 0.12, 0.4), "area of a specimen": (0.10, 0.25, 0.6), "recipe": (0.05, 0.10, 0.4),
    "lot": (0.08, 0.15, 0.5),
}  # fmt: skip
UNITS = {"load of a day": "g", "tare of a day": "N"}  # the others are shares of one
COLUMNS = {
    "weight": "mass_g", "load of a day": "date", "tare of a day": "date", "operator": "operator",
    "area of a specimen": "specimen", "recipe": "recipe", "lot": "lot",
}  # fmt: skip


def value_at(bench: LaboratoryBench, kind: str, rng: np.random.Generator) -> tuple[str, np.ndarray]:
    """The value that is concerned, and the tests (n,) that have it."""
    column = COLUMNS[kind]
    values = day_of(bench.tests) if column == "date" else bench.column(column).astype(str)
    names, counts = np.unique(values, return_counts=True)
    enough = names[counts >= 6]
    value = str(rng.choice(enough))
    return value, values == value


def _carried(extra_g: Callable[[np.ndarray], np.ndarray]) -> Callable[[LaboratoryBench, np.ndarray], None]:
    def act(bench: LaboratoryBench, here: np.ndarray) -> None:
        mass_g = bench.column("mass_g") + np.where(here, extra_g(bench.column("mass_g")), 0.0)
        bench.remake((np.maximum(mass_g, 0.0) + SLIDER_G) * 1e-3 * GRAVITY, list(bench.tests["true_sample"]))

    return act


def _act(bench: LaboratoryBench, kind: str, here: np.ndarray, size: float) -> None:
    """Let a cause of this signed size act on these tests."""
    if kind == "weight":
        _carried(lambda m: m * size)(bench, here)
    elif kind == "load of a day":
        _carried(lambda m: np.full_like(m, size))(bench, here)
    elif kind == "tare of a day":
        off = np.where(here, size, 0.0)
        bench.static = np.maximum(bench.static + off, bench.static / 4)
        bench.sliding = np.maximum(bench.sliding + off, bench.sliding / 4)
    elif kind == "area of a specimen":
        extra = bench.adhesion_N() * (size * here)[:, None]
        bench.static, bench.sliding = (both(bench) + extra).T
    else:
        multiply(bench, np.outer(here, [1.0, 1.0]) * np.log1p(size))


def hide_one_value(seed: int, laboratory: Laboratory, kind: str) -> Hide:
    """A cause of this kind that is clear in this campaign, to be given to ``campaign.make``."""
    observer = Observer(bare_bench(seed, laboratory), laboratory)
    for k in range(TRIES):
        rng = np.random.default_rng([seed, HIDDEN, k])
        low, high, largest = SIZES[kind]
        bench = bare_bench(seed, laboratory)
        before = np.log(both(bench))
        value, here = value_at(bench, kind, rng)
        sign, size = rng.choice([-1.0, 1.0]), rng.uniform(low, high)
        for _ in range(ROUNDS):
            bench = bare_bench(seed, laboratory)
            _act(bench, kind, here, sign * size)
            strength = observer.strength(np.log(both(bench)) - before)
            if strength >= STRENGTH:
                break
            size = min(1.02 * size * STRENGTH / strength, largest)
        if strength >= STRENGTH:
            break
    change = np.log(both(bench)) - before
    truth = {
        "kind": kind, "column": COLUMNS[kind], "value": value, "size": round(float(sign * size), 5),
        "unit": UNITS.get(kind, "1"), "strength": round(strength, 2), "tests": int(here.sum()),
        "rms_percent": rms_percent(change, bench.tests),
    }  # fmt: skip

    def hide(bench: LaboratoryBench, rng: np.random.Generator) -> dict[str, Any]:
        _act(bench, kind, here, sign * size)
        return truth

    return hide
