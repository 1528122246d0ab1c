"""What T/N varies with: load, speed, distance, cycle, temperature and every other number recorded for the tests."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tribo.records import REGIMES, FloatArray, Ingested, Test
from tribo.vocabulary import label_with_unit

if TYPE_CHECKING:
    import pandas as pd

VARIABLES = (
    "normal_load_N", "speed_mm_s", "hold_s", "run_order", "specimen_run", "repeat", "temperature_C", "humidity_pct",
)  # fmt: skip
SPEED = "speed_mm_s"
COLUMNS = ["sample", "regime", "variable", "label", "n", "low", "high", "change_percent", "change_u_percent", "rank",
           "p", "p_adjusted", "inseparable_from"]  # fmt: skip
NOMINAL_LOAD = "nominal_load_N"  # the load by another name, beside the one that was recorded
SAME_COLUMN = 0.95  # rank correlation of two variables from which on their effects cannot be separated
_FEWEST = 5
_FEWEST_VALUES = 2


def test_values(test: Test) -> dict[str, float]:
    """Every number recorded for a test, by name."""
    found = {name: getattr(test, name) for name in VARIABLES if name != SPEED}
    found[SPEED] = None if test.speed_m_s is None else 1e3 * test.speed_m_s
    for name, cell in test.covariates.items():
        if name == NOMINAL_LOAD:
            continue
        try:
            found[name] = float(str(cell).replace(",", "."))
        except ValueError:
            continue
    return {name: float(value) for name, value in found.items() if value is not None and np.isfinite(value)}


def measured_points(ingested: Ingested) -> pd.DataFrame:
    """T/N of every test and regime with all numbers recorded for it, one row each."""
    import pandas as pd

    rows = []
    for test in ingested.campaign.tests:
        pull = ingested.pulls.get(test.test_id)
        if pull is None or not test.normal_load_N > 0:
            continue
        for regime in REGIMES:
            force, u = getattr(pull, f"{regime}_N"), getattr(pull, f"{regime}_u_N")
            if np.isfinite(force):
                known = {"test_id": test.test_id, "sample": test.sample, "regime": regime}
                ratio = {"T_over_N": force / test.normal_load_N, "T_over_N_u": u / test.normal_load_N, "T_N": force}
                rows.append({**test_values(test), **known, **ratio})
    return pd.DataFrame(rows)


def variables_of(points: pd.DataFrame) -> list[str]:
    """The recorded variables that take more than one value, load first."""
    said = ("test_id", "sample", "regime", "T_over_N", "T_over_N_u", "T_N")
    return [
        name for name in (*VARIABLES, *(c for c in points.columns if c not in VARIABLES and c not in said))
        if name in points.columns and points[name].nunique() >= _FEWEST_VALUES
    ]  # fmt: skip


def dependence(ingested: Ingested) -> pd.DataFrame:
    """Change of T/N over the range of each variable (percent, straight line in ln T/N), and its rank correlation.

    ``p_adjusted`` is Holm's adjustment over all rows. ``inseparable_from`` names variables whose rank correlation with
    this one, over the same tests, is 0.95 or more: their effects cannot be separated by these data.
    """
    import pandas as pd

    points = measured_points(ingested)
    found = []
    for (sample, regime), part in points.groupby(["sample", "regime"], sort=False) if len(points) else ():
        names = variables_of(part)
        for name in names:
            row = _one(part, name)
            if row:
                others = tuple(o for o in names if o != name and _same(part, name, o))
                found.append({"sample": sample, "regime": regime, **row, "inseparable_from": others})
    table = pd.DataFrame(found, columns=COLUMNS)
    return table.assign(p_adjusted=_holm(table["p"].to_numpy(float)))


def _one(part: pd.DataFrame, name: str) -> dict[str, object]:
    from scipy.stats import linregress, spearmanr

    known = part[np.isfinite(part[name]) & (part["T_over_N"] > 0)]
    if len(known) < _FEWEST or known[name].nunique() < _FEWEST_VALUES or known["T_over_N"].nunique() < _FEWEST_VALUES:
        return {}
    x, y = known[name].to_numpy(float), np.log(known["T_over_N"].to_numpy(float))
    line, rank = linregress(x, y), spearmanr(x, y)
    span = float(np.ptp(x))
    return {
        "variable": name, "label": label_with_unit(name), "n": len(known), "low": float(x.min()),
        "high": float(x.max()), "change_percent": 100 * float(np.expm1(line.slope * span)),
        "change_u_percent": 100 * float(line.stderr * span), "rank": float(rank.statistic), "p": float(rank.pvalue),
    }  # fmt: skip


def _same(part: pd.DataFrame, one: str, other: str) -> bool:
    from scipy.stats import spearmanr

    known = part[np.isfinite(part[one]) & np.isfinite(part[other])]
    if len(known) < _FEWEST or known[one].nunique() < _FEWEST_VALUES or known[other].nunique() < _FEWEST_VALUES:
        return False
    return abs(float(spearmanr(known[one], known[other]).statistic)) >= SAME_COLUMN


def _holm(p: FloatArray) -> FloatArray:
    """Holm's adjusted p values (Scand. J. Stat. 6 (1979) 65)."""
    order = np.argsort(p)
    steps = np.maximum.accumulate(p[order] * (len(p) - np.arange(len(p))))
    adjusted = np.empty(len(p))
    adjusted[order] = np.minimum(steps, 1.0)
    return adjusted
