"""Tables as people keep them: cells left empty or filled with words, here and there, for days, or by one operator."""

from __future__ import annotations

import numpy as np
import pandas as pd

from .laboratory import day_of

HOW = ("at random", "whole days", "one operator")
COLUMNS = ("temperature_C", "humidity_pct", "hold_s", "speed_mm_s", "operator", "film_um", "recipe", "lot")
WORDED = {"film_um": ("n/a", "-", "<5"), "recipe": ("n/a", "-"), "lot": ("n/a", "-")}  # columns that may hold words


def gaps(tests: pd.DataFrame, share: float, how: str, rng: np.random.Generator) -> dict[str, np.ndarray]:
    """The cells (n,) of every column that a law may follow, this share of them empty or a word.

    Every column has gaps of its own; only an operator who forgets does so in all columns, the own name excepted.
    """
    forgetful = str(rng.choice(sorted(set(tests["operator"]))))
    cells = {}
    for name in COLUMNS:
        if name == "operator" and how == "one operator":
            continue
        values = tests[name].to_numpy(object)
        where = missing(tests, share, how, forgetful, rng)
        for k in np.flatnonzero(where):
            word = name in WORDED and rng.random() < 1 / 3
            values[k] = str(rng.choice(WORDED[name])) if word else None
        cells[name] = values
    return cells


def missing(
    tests: pd.DataFrame, share: float, how: str, forgetful: str, rng: np.random.Generator
) -> np.ndarray:
    """The tests (n,) whose cell is missing: the share of them, to the nearest test.

    Where the forgetful operator made fewer tests than that, the others forget at random.
    """
    n = len(tests)
    if how == "whole days":
        days = day_of(tests)
        place = dict(zip(np.unique(days), rng.permutation(len(np.unique(days))), strict=True))
        order = np.argsort([place[d] for d in days], kind="stable")
    else:
        order = rng.permutation(n)
        if how == "one operator":
            order = order[np.argsort(tests["operator"].to_numpy()[order] != forgetful, kind="stable")]
    found = np.zeros(n, bool)
    found[order[: round(share * n)]] = True
    return found
