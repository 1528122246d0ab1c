"""What is looked up in a study: its samples, the flat one, load levels, fits; and its outlying pulls.

An outlying pull is far off the other pulls of its sample and load. It is shown and never removed.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from tribo.fitting.linear import levels_of
from tribo.records import REGIMES, FloatArray, LawFit, Pattern, Regime, SetAside, Study

LOAD_TOLERANCE = 0.02  # loads closer than this (relative) are repeats of one load


def flat_sample(study: Study) -> str:
    """The flat sample of the campaign; empty where none was measured or chosen."""
    return study.ingested.campaign.flat_sample


def sample_numbers(study: Study) -> dict[str, int]:
    """Each sample with its place, the flat one first, then in the order of the campaign."""
    campaign = study.ingested.campaign
    tested = {test.sample for test in campaign.tests}
    named = [s for s in campaign.samples if s in tested]
    rest = sorted(tested - set(named))
    order = sorted([*named, *rest], key=lambda s: s != flat_sample(study))
    return {sample: k for k, sample in enumerate(order)}


def is_anisotropic(pattern: Pattern) -> bool:
    """True where the cavities or their spacing differ between x and y."""
    unequal_size = pattern.size_m is not None and pattern.size_m[0] != pattern.size_m[1]
    unequal_pitch = pattern.pitch_m is not None and pattern.pitch_m[0] != pattern.pitch_m[1]
    return unequal_size or unequal_pitch


def fit_of(fits: Iterable[LawFit], sample: str, regime: str) -> LawFit | None:
    """The fit of one sample in one regime, None where there is none."""
    return next((f for f in fits if f.sample == sample and f.regime == regime), None)


def load_levels(normal_load_N: FloatArray, tolerance: float = LOAD_TOLERANCE) -> FloatArray:
    """The mean load of the level each load belongs to: loads within ``tolerance`` are one level."""
    return levels_of(np.asarray(normal_load_N, float), tolerance)


def shown(study: Study) -> bool:
    """Whether the study was made without the spring-block model, whose report shows other figures."""
    return study.comparison is None and bool(study.ingested.pulls)


def all_set_aside(study: Study) -> dict[str, SetAside]:
    """Every test that takes no part, by its id: faulty rows of tests.csv and exports that fail."""
    ingested = study.ingested
    return {fault.test_id: fault for fault in (*ingested.campaign.set_aside, *ingested.set_aside)}


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
    left_out = {i: o.automatic for i, o in ingested.by_hand.items() if o.action == "exclude"}
    table = replace(ingested, pulls={**ingested.pulls, **left_out}).table()
    found: dict[str, dict[str, Any]] = {}
    for regime in REGIMES if not table.empty else ():
        for test_id, pull in _judged_in(table, regime).items():
            if test_id not in found or abs(pull["score"]) > abs(found[test_id]["score"]):
                found[test_id] = pull
    return found


def _judged_in(table: pd.DataFrame, regime: Regime) -> dict[str, dict[str, Any]]:
    table = table[table[f"{regime}_N"] > 0]
    level_N = load_levels(table["normal_load_N"].to_numpy(float))
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
