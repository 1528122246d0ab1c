"""How well the model agrees with the measurement: the ratio of their forces at each load, with its 95 % interval.

mu and tau0 trade off against each other in a fit, so a model is judged by T at a load, not by either alone.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from tribo.comparison.study_lookup import fit_of, sample_numbers
from tribo.records import ComparisonRow, Study

COLUMNS = ["sample_number", "sample", "regime", "normal_load_N", "ratio", "ratio_low", "ratio_high"]
LEVEL = 0.95


def ratios(study: Study) -> pd.DataFrame:
    """T measured over T simulated at each load (N), with the 95 % interval of the ratio.

    The interval is symmetric in the logarithm of the ratio, with Student's t and the degrees of freedom of
    both sides carried through Welch-Satterthwaite (GUM G.4): those of the sample's own fit, and for the model
    those of the measured flat sample, on whose calibration it rests.
    """
    comparison = study.comparison
    if comparison is None or not comparison.rows:
        return pd.DataFrame(columns=COLUMNS)
    order = sample_numbers(study)
    rows = [
        {
            "sample_number": order.get(row.sample, len(order)),
            "sample": row.sample,
            "regime": row.regime,
            "normal_load_N": row.normal_load_N,
            **_ratio(row, _dof(study, row.sample, row), _dof(study, comparison.flat, row)),
        }
        for row in comparison.rows
    ]
    table = pd.DataFrame(rows, columns=COLUMNS)
    table = table[np.isfinite(table["ratio"])]
    return table.sort_values(["sample_number", "regime", "normal_load_N"], ascending=[True, False, True])


def _dof(study: Study, sample: str, row: ComparisonRow) -> float:
    fit = fit_of(study.fits, sample, row.regime)
    return fit.by_itself.dof if fit is not None else float("inf")


def _ratio(row: ComparisonRow, measured_dof: float, simulated_dof: float) -> dict[str, float]:
    from scipy.stats import t

    if not (row.measured_N > 0 and row.simulated_N > 0):
        return dict.fromkeys(("ratio", "ratio_low", "ratio_high"), float("nan"))
    ratio = row.measured_N / row.simulated_N
    measured, simulated = row.measured_u_N / row.measured_N, row.simulated_u_N / row.simulated_N
    u = float(np.hypot(measured, simulated))
    dof = welch_dof((measured, measured_dof), (simulated, simulated_dof))
    half = float(t.ppf(0.5 + LEVEL / 2, dof)) * u
    return {"ratio": ratio, "ratio_low": ratio * np.exp(-half), "ratio_high": ratio * np.exp(half)}


def welch_dof(*components: tuple[float, float]) -> float:
    """Degrees of freedom of a sum of (standard uncertainty, degrees of freedom), Welch-Satterthwaite (GUM G.4).

    NaN where a part has an uncertainty without degrees of freedom, infinite where no part is uncertain.
    """
    uncertain = [(u, dof) for u, dof in components if u != 0]
    if not all(dof > 0 for _, dof in uncertain):
        return float("nan")
    parts = sum(u**4 / dof for u, dof in uncertain)
    return float(sum(u**2 for u, _ in uncertain) ** 2 / parts) if parts > 0 else float("inf")
