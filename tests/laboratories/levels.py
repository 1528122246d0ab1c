"""A column of few values with a change of ln T of its own at each of them: any shape."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .campaign import Hide, LaboratoryBench, bare_bench, multiply, rms_percent, stream
from .laboratory import Laboratory, drawn_laboratory
from .observer import Observer

COLUMNS = {"speed_mm_s": "speeds_mm_s", "hold_s": "holds_s", "film_um": "films_um", "recipe": "recipes", "lot": "lots"}
LADDERS = {"speed_mm_s": (0.02, 1.0), "hold_s": (1.0, 600.0), "film_um": (0.5, 6.0)}
OF_NUMBERS = ("any", "line", "line of ln", "parabola of ln", "step", "one apart", "rising")
OF_NAMES = ("any", "one apart")
MOST = {"lot": 4}  # several specimens have to share one; six of all others
SIZES = (0.04, 0.12)
STRENGTH = 9.0  # at least, for an observer who knows all covariances
PLAN, PLACES = 31, 32


def level_laboratory(seed: int, column: str, number: int, **changes: Any) -> Laboratory:
    """A laboratory whose ``column`` has so many values."""
    rng = stream(seed, PLAN)
    if column in LADDERS:
        low, high = np.log(LADDERS[column])
        steps = low + (high - low) * (np.arange(number) + rng.uniform(-0.25, 0.25, number)) / max(number - 1, 1)
        values: object = tuple(float(f"{v:.2g}") for v in np.exp(np.clip(steps, low, high)))
    else:
        values = number
    return drawn_laboratory(seed, **{COLUMNS[column]: values, **changes})


def shape_at(values: Sequence[float], shape: str, rng: np.random.Generator) -> np.ndarray:
    """Changes at ascending values of a column, with mean 0 and root mean square 1 over them."""
    n, x = len(values), np.asarray(values, float)
    if shape == "line":
        found = x * rng.choice([-1, 1])
    elif shape == "line of ln":
        found = np.log(x) * rng.choice([-1, 1])
    elif shape == "parabola of ln":
        u = np.log(x)
        found = (u - rng.uniform(u.min(), u.max())) ** 2 * rng.choice([-1, 1])
    elif shape == "step":
        found = (np.arange(n) >= rng.integers(1, n)) * rng.choice([-1.0, 1.0])
    elif shape == "one apart":
        found = (np.arange(n) == rng.integers(n)) * rng.choice([-1.0, 1.0])
    elif shape == "rising":
        found = np.cumsum(rng.exponential(size=n)) * rng.choice([-1, 1])
    else:
        found = rng.normal(size=n)
    found = found - found.mean()
    return np.asarray(found / np.sqrt(np.mean(found**2)))


def hide_levels(seed: int, laboratory: Laboratory, column: str, shape: str) -> Hide:
    """Levels of this column, clear in this campaign, to be given to ``campaign.make``.

    They act in both regimes or in one; on all samples, on the patterned ones or on some.
    """
    rng = stream(seed, PLACES)
    bench = bare_bench(seed, laboratory)
    names, which = np.unique(bench.column(column), return_inverse=True)
    places = np.asarray(names, float) if column in LADDERS else np.arange(1.0, len(names) + 1)
    levels = rng.uniform(*SIZES) * shape_at(places.tolist(), shape, rng)
    regimes = ((1.0, 1.0), (1.0, 0.0), (0.0, 1.0))[rng.choice(3, p=(1 / 2, 1 / 4, 1 / 4))]
    present = sorted(set(bench.column("sample")))
    patterned = [s for s in present if s != "F"]
    some = [str(s) for s in rng.choice(patterned, 2, replace=False)]
    samples = (present, patterned, some)[rng.choice(3, p=(3 / 5, 1 / 5, 1 / 5))]
    acts = np.outer(np.isin(bench.column("sample"), samples), regimes)
    strength = Observer(bench, laboratory).strength(levels[which][:, None] * acts)
    larger = max(STRENGTH / strength, 1.0)
    change = larger * levels[which][:, None] * acts
    truth = {
        "column": column, "shape": shape, "regimes": regimes, "samples": sorted(samples),
        "levels": [[str(name), round(float(larger * x), 6)] for name, x in zip(names, levels, strict=True)],
        "strength": round(larger * strength, 2), "rms_percent": rms_percent(change, bench.tests),
    }  # fmt: skip

    def hide(bench: LaboratoryBench, rng: np.random.Generator) -> dict[str, Any]:
        multiply(bench, change)
        return truth

    return hide
