"""The numerical column of the paper's Table 2, computed anew, and what its silent choices do to it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tribo.simulate.calibration import simulated_law
from tribo.simulate.config import SimConfig
from tribo.simulate.ensemble import AngleRule, Progress, run_ensemble, stratified_design
from tribo.simulate.resume import run_stored

if TYPE_CHECKING:
    import pandas as pd

SAMPLES = ("F", "A", "B", "C", "Sx", "Sy")
PRESSURES_PA = (3e3, 5e3, 8e3, 11e3, 14e3, 17.5e3, 21e3, 25e3)
"""Eight pressures over the range of the paper, which does not list its own."""

STUDY: dict[str, dict[str, Any]] = {
    "baseline": {},
    "K_s halved": {"shear_factor": 0.5},
    "cavities touch the edge": {"pattern_first": (0, 0)},
    "K_s halved, cavities touch the edge": {"shear_factor": 0.5, "pattern_first": (0, 0)},
    "first local peak, window from 2 peak times": {"peak_rule": "first", "window_start_peaks": 2.0},
    "p l2 on every block": {"normal_force": "uniform"},
}
"""Choices the text leaves open, as changes of the baseline; periodic edges, angles and weights are asked apart."""


def table2(
    base: SimConfig | None = None,
    repeats: int = 20,
    pressures_Pa: Sequence[float] = PRESSURES_PA,
    samples: Sequence[str] = SAMPLES,
    weights: str = "ratio",
    seed: int = 0,
    jobs: int = 2,
    path: str | Path | None = None,
    scheduler: str | None = None,
    published: pd.DataFrame | None = None,
    progress: Progress | None = None,
    angles: AngleRule = "midpoints",
) -> pd.DataFrame:
    """mu and tau0 of the simulated samples, static and sliding, as in Berardo 2019, Table 2.

    Parameters
    ----------
    base : everything the design does not vary; the paper's parameters by default
    repeats, pressures_Pa, samples : 20 runs at each of 8 pressures for 6 samples, 960 in all, by default
    weights : "ratio" fits T/N = mu + tau0/p, "force" fits T = mu N + tau0 A
    path, scheduler : as for :func:`tribo.simulate.resume.run_stored`; without a path nothing is kept
    published : the published table (columns sample, regime, source, mu, tau0_kPa); adds the deviations

    Returns
    -------
    DataFrame with sample, regime, mu, mu_se, tau0_kPa, tau0_kPa_se and, with ``published``, mu_paper,
    tau0_kPa_paper, mu_deviation_percent, tau0_deviation_percent.
    """
    design = stratified_design(samples, pressures_Pa, repeats, seed, base, angles)
    runs = run_stored(design, path, jobs, scheduler, progress) if path else run_ensemble(design, jobs, progress)
    table = fitted(runs, weights)
    return table if published is None else beside(table, published)


def fitted(runs: pd.DataFrame, weights: str = "ratio", resamples: int = 200) -> pd.DataFrame:
    """mu and tau0 of every sample of an ensemble; standard errors by resampling the runs at each pressure."""
    import pandas as pd

    rng = np.random.default_rng(0)
    rows = []
    for sample, group in runs.groupby("sample", sort=False):
        pressure = group["pressure_Pa"].to_numpy(float)
        strata = [np.flatnonzero(pressure == p) for p in np.unique(pressure)]
        for regime in ("static", "sliding"):
            friction = group[f"{regime}_friction"].to_numpy(float)
            mu, tau0 = simulated_law(pressure, friction, weights)
            drawn = [np.concatenate([rng.choice(s, s.size) for s in strata]) for _ in range(resamples)]
            se = np.std([simulated_law(pressure[k], friction[k], weights) for k in drawn], axis=0, ddof=1)
            rows.append(
                {
                    "sample": sample, "regime": regime, "mu": mu, "mu_se": se[0], "tau0_kPa": tau0 / 1e3,
                    "tau0_kPa_se": se[1] / 1e3, "runs": len(group),
                }
            )  # fmt: skip
    return pd.DataFrame(rows)


def beside(table: pd.DataFrame, published: pd.DataFrame) -> pd.DataFrame:
    """A fitted table with the published simulation beside it and the deviation of each number in percent.

    ``friction_deviation_percent`` compares T/N at 10 kPa, since mu and tau0 trade off.
    """
    paper = published.loc[published["source"] == "simulation", ["sample", "regime", "mu", "tau0_kPa"]]
    both = table.merge(paper, on=["sample", "regime"], how="left", suffixes=("", "_paper"))
    both["mu_deviation_percent"] = 100 * (both["mu"] / both["mu_paper"] - 1)
    both["tau0_deviation_percent"] = 100 * (both["tau0_kPa"] / both["tau0_kPa_paper"] - 1)
    at_10 = both["mu"] + both["tau0_kPa"] / 10
    at_10_paper = both["mu_paper"] + both["tau0_kPa_paper"] / 10
    both["friction_deviation_percent"] = 100 * (at_10 / at_10_paper - 1)
    return both


def study(
    published: pd.DataFrame,
    variants: Mapping[str, Mapping[str, Any]] = STUDY,
    base: SimConfig | None = None,
    folder: str | Path | None = None,
    **design: Any,
) -> pd.DataFrame:
    """:func:`table2` under each variant of the baseline, one block of rows a variant (column ``variant``)."""
    import pandas as pd

    base = base or SimConfig()
    tables = []
    for k, (name, changes) in enumerate(variants.items()):
        path = None if folder is None else Path(folder) / f"variant-{k:02d}.h5"
        table = table2(base.with_(**changes), published=published, path=path, **design)
        tables.append(table.assign(variant=name))
    return pd.concat(tables, ignore_index=True)


def distance(table: pd.DataFrame) -> dict[str, float]:
    """How far a table lies from the published one: root mean square of the deviations in percent."""
    columns = ("mu_deviation_percent", "tau0_deviation_percent", "friction_deviation_percent")
    return {name: float(np.sqrt((table[name] ** 2).mean())) for name in columns}
