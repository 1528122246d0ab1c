"""Laws of the runs of an ensemble: mu and tau0 of each sample with standard errors, means at each pressure, as text."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from tribo.records import FloatArray
from tribo.springblock.kept_runs import varied_columns

if TYPE_CHECKING:
    import pandas as pd

WEIGHTS = ("ratio", "force", "relative")
"""Scatter assumed equal at all loads: that of T/N, of T, or of T in percent."""


def simulated_law(pressure_Pa: FloatArray, friction: FloatArray, weights: str = "ratio") -> FloatArray:
    """(mu, tau0 in Pa) of T/N over p by least squares.

    ``weights="ratio"`` fits T/N = mu + tau0/p, ``"force"`` fits T = mu N + tau0 A, and ``"relative"`` either of them
    with deviations relative to each force.
    """
    scale = {"ratio": np.ones_like(pressure_Pa), "force": pressure_Pa, "relative": 1.0 / friction}[weights]
    columns = np.stack([scale, scale / pressure_Pa], axis=1)
    return np.asarray(np.linalg.lstsq(columns, friction * scale, rcond=None)[0])


def fitted(
    runs: pd.DataFrame, weights: str = "ratio", resamples: int = 200, by: Sequence[str] = ("sample",)
) -> pd.DataFrame:
    """mu and tau0 of every sample of an ensemble; standard errors by resampling the runs at each pressure.

    ``by`` names the columns that part the laws, the sample and whatever parameters the design varies.
    """
    import pandas as pd

    rng = np.random.default_rng(0)
    rows = []
    for key, group in runs.groupby(list(by), sort=False):
        pressure = group["pressure_Pa"].to_numpy(float)
        for regime in ("static", "sliding"):
            laws = resampled_laws(pressure, group[f"{regime}_friction"].to_numpy(float), weights, rng, resamples)
            (mu, tau0), se = laws[0], laws[1:].std(axis=0, ddof=1)
            rows.append(
                dict(zip(by, key, strict=True))
                | {"regime": regime, "mu": mu, "mu_se": se[0], "tau0_kPa": tau0 / 1e3, "tau0_kPa_se": se[1] / 1e3}
                | {"runs": len(group)}
            )
    return pd.DataFrame(rows)


def resampled_laws(
    pressure_Pa: FloatArray, friction: FloatArray, weights: str, rng: np.random.Generator, resamples: int
) -> FloatArray:
    """(mu, tau0 in Pa) of the runs, then of ``resamples`` drawings of them with replacement at each pressure."""
    strata = [np.flatnonzero(pressure_Pa == p) for p in np.unique(pressure_Pa)]
    drawn = [np.concatenate([rng.choice(s, s.size) for s in strata]) for _ in range(resamples)]
    return np.array([simulated_law(pressure_Pa[k], friction[k], weights) for k in (np.arange(len(friction)), *drawn)])


def means(runs: pd.DataFrame, by: Sequence[str] = ("sample",)) -> pd.DataFrame:
    """Mean T/N at every pressure, static and sliding, with its standard error over the runs (NaN for one run)."""
    grouped = runs.groupby([*by, "pressure_Pa"], sort=False)
    table = grouped.size().rename("runs").to_frame()
    for regime in ("static", "sliding"):
        table[regime] = grouped[f"{regime}_friction"].mean()
        table[f"{regime}_se"] = grouped[f"{regime}_friction"].sem()
    return table.reset_index()


def described(runs: pd.DataFrame) -> tuple[pd.DataFrame, pd.DataFrame, str]:
    """Means at every pressure, laws of samples with several pressures, and both as text."""
    import pandas as pd

    by = ["sample", *varied_columns(runs)]
    table = means(runs, by)
    several = runs.groupby(by, sort=False)["pressure_Pa"].transform("nunique") > 1
    laws = fitted(runs[several], by=by) if several.any() else pd.DataFrame()
    shown = [table.assign(pressure_kPa=table["pressure_Pa"] / 1e3).drop(columns="pressure_Pa"), laws]
    return table, laws, "\n\n".join(t.to_string(index=False, float_format="%.4g") for t in shown if len(t))
