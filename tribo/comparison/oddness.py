"""Outlying pulls compared with the other pulls of the same sample and load. They are shown and never removed."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from tribo.comparison import study_lookup
from tribo.records import REGIMES, Regime, Study

ODD_SCORE = 3.5  # modified z-score of Iglewicz and Hoaglin (1993)
MAD_TO_SD = 1.4826  # of a normal distribution
FEWEST_SIBLINGS = 2


def standings(study: Study) -> dict[str, dict[str, Any]]:
    """Deviation of every pull, in the regime in which it is larger: regime, deviation, score and siblings by test.

    ``deviation`` is from the median of the other pulls of the sample at the load, of which there are ``siblings``;
    ``score`` is the same in robust standard deviations.

    Deviations are taken in ln T from the median of the other pulls of the sample at the load, and scaled by the
    median absolute deviation over the whole campaign: one cell has too few pulls to determine a scale. A pull
    excluded by hand is judged like any other; a pull with fewer than two others to compare with is not judged.
    """
    ingested = study.ingested
    left_out = {i: b.automatic for i, b in ingested.by_hand.items() if b.override.action == "exclude"}
    table = replace(ingested, pulls={**ingested.pulls, **left_out}).table()
    found: dict[str, dict[str, Any]] = {}
    for regime in REGIMES if not table.empty else ():
        for test_id, pull in _judged_in(table, regime).items():
            if test_id not in found or abs(pull["score"]) > abs(found[test_id]["score"]):
                found[test_id] = pull
    return found


def _judged_in(table: pd.DataFrame, regime: Regime) -> dict[str, dict[str, Any]]:
    table = table[table[f"{regime}_N"] > 0]
    level_N = study_lookup.load_levels(table["normal_load_N"].to_numpy(float))
    log_force = np.log(table[f"{regime}_N"])
    cells = log_force.groupby([table["sample"], level_N])
    siblings = cells.transform("size") - 1
    deviation = cells.transform(_from_the_others)
    judged = siblings >= FEWEST_SIBLINGS
    scale = MAD_TO_SD * float(deviation[judged].abs().median())
    if not scale > 0:
        return {}
    rows = zip(table["test_id"][judged], deviation[judged], siblings[judged], strict=True)
    return {
        str(i): {"regime": regime, "deviation": float(np.expm1(d)), "score": float(d) / scale, "siblings": int(n)}
        for i, d, n in rows
    }


def _from_the_others(values: pd.Series) -> np.ndarray:
    """Each value less the median of all the others; NaN for a value alone."""
    x = values.to_numpy(float)
    others = len(x) - 1
    if others < 1:
        return np.full(len(x), np.nan)
    rank = np.empty(len(x), int)
    rank[np.argsort(x)] = np.arange(len(x))
    ordered = np.sort(x)
    low, high = ((others - 1) // 2, others // 2)  # the middle of the others, counted without the value itself
    return np.asarray(x - (ordered[low + (rank <= low)] + ordered[high + (rank <= high)]) / 2)
