"""The simulated column of Table 2 of the paper, recomputed and compared with the printed one."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tribo.records import FloatArray
from tribo.springblock.calibration import simulated_law
from tribo.springblock.config import SimConfig
from tribo.springblock.ensemble import Angles, Progress, run_ensemble, run_stored, stratified_design, varied_columns

if TYPE_CHECKING:
    import pandas as pd


SAMPLES = ("F", "A", "B", "C", "Sx", "Sy")
PRESSURES_PA = (3e3, 5e3, 8e3, 11e3, 14e3, 17.5e3, 21e3, 25e3)
"""Eight pressures over the range of the paper, which does not list its own."""


def table2_design(
    base: SimConfig | None = None,
    repeats: int = 20,
    pressures_Pa: Sequence[float] = PRESSURES_PA,
    samples: Sequence[str] = SAMPLES,
    seed: int = 0,
    angles: Angles = "midpoints",
) -> list[SimConfig]:
    """The runs behind the numerical column: 20 at each of 8 pressures for 6 samples, 960 in all, by default."""
    return stratified_design(samples, pressures_Pa, repeats, seed, base, angles)


def table2(
    design: Sequence[SimConfig] | None = None,
    weights: str = "ratio",
    published: pd.DataFrame | None = None,
    *,
    jobs: int = 2,
    path: str | Path | None = None,
    scheduler: str | None = None,
    progress: Progress | None = None,
) -> pd.DataFrame:
    """mu and tau0 of the simulated samples, static and sliding, as in Berardo 2019, Table 2.

    Parameters
    ----------
    design : the runs, those of :func:`table2_design` by default
    weights : as for :func:`tribo.springblock.calibration.simulated_law`
    path, scheduler : as for :func:`tribo.springblock.ensemble.run_stored`; without a path nothing is kept
    published : the published table (columns sample, regime, source, mu, tau0_kPa); adds the deviations

    Returns
    -------
    DataFrame with sample, regime, mu, mu_se, tau0_kPa, tau0_kPa_se and, with ``published``, mu_paper,
    tau0_kPa_paper, mu_deviation_percent, tau0_deviation_percent.
    """
    design = table2_design() if design is None else list(design)
    runs = run_stored(design, path, jobs, scheduler, progress) if path else run_ensemble(design, jobs, progress)
    table = fitted(runs, weights)
    return table if published is None else beside(table, published)


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


def means(runs: pd.DataFrame, by: Sequence[str] = ("sample",)) -> pd.DataFrame:
    """Mean T/N at every pressure, static and sliding, with its standard error over the runs (NaN for one run)."""
    grouped = runs.groupby([*by, "pressure_Pa"], sort=False)
    table = grouped.size().rename("runs").to_frame()
    for regime in ("static", "sliding"):
        table[regime] = grouped[f"{regime}_friction"].mean()
        table[f"{regime}_se"] = grouped[f"{regime}_friction"].sem()
    return table.reset_index()


def resampled_laws(
    pressure_Pa: FloatArray, friction: FloatArray, weights: str, rng: np.random.Generator, resamples: int
) -> FloatArray:
    """(mu, tau0 in Pa) of the runs, then of ``resamples`` drawings of them with replacement at each pressure."""
    strata = [np.flatnonzero(pressure_Pa == p) for p in np.unique(pressure_Pa)]
    drawn = [np.concatenate([rng.choice(s, s.size) for s in strata]) for _ in range(resamples)]
    return np.array([simulated_law(pressure_Pa[k], friction[k], weights) for k in (np.arange(len(friction)), *drawn)])


def beside(table: pd.DataFrame, published: pd.DataFrame) -> pd.DataFrame:
    """A fitted table with the published simulation and the deviation of each number in percent.

    ``friction_deviation_percent`` compares T/N at 10 kPa, since mu and tau0 are correlated.
    """
    paper = published.loc[published["source"] == "simulation", ["sample", "regime", "mu", "tau0_kPa"]]
    both = table.merge(paper, on=["sample", "regime"], how="left", suffixes=("", "_paper"))
    both["mu_deviation_percent"] = 100 * (both["mu"] / both["mu_paper"] - 1)
    both["tau0_deviation_percent"] = 100 * (both["tau0_kPa"] / both["tau0_kPa_paper"] - 1)
    at_10 = both["mu"] + both["tau0_kPa"] / 10
    at_10_paper = both["mu_paper"] + both["tau0_kPa_paper"] / 10
    both["friction_deviation_percent"] = 100 * (at_10 / at_10_paper - 1)
    return both


def distance(table: pd.DataFrame) -> dict[str, float]:
    """How far a table lies from the published one: root mean square of the deviations in percent."""
    columns = ("mu_deviation_percent", "tau0_deviation_percent", "friction_deviation_percent")
    return {name: float(np.sqrt((table[name] ** 2).mean())) for name in columns}


def table2_text(table: pd.DataFrame) -> str:
    """The computed and the printed column, one line per sample and regime, with deviations."""
    head = f"{'':<12}{'mu':>17}{'paper':>8}{'dev. %':>8}{'tau0 / kPa':>17}{'paper':>8}{'dev. %':>8}{'at 10 kPa %':>13}"
    lines = [
        f"{r.sample:<3}{r.regime:<9}{r.mu:>8.3f} +- {r.mu_se:.3f}{r.mu_paper:>8.3f}{r.mu_deviation_percent:>+8.1f}"
        f"{r.tau0_kPa:>10.2f} +- {r.tau0_kPa_se:.2f}{r.tau0_kPa_paper:>8.2f}{r.tau0_deviation_percent:>+8.1f}"
        f"{r.friction_deviation_percent:>+13.1f}"
        for r in table.itertuples(index=False)
    ]
    rms = distance(table)
    foot = (
        f"root mean square of the deviations: mu {rms['mu_deviation_percent']:.1f} %, "
        f"tau0 {rms['tau0_deviation_percent']:.1f} %, T/N at 10 kPa {rms['friction_deviation_percent']:.1f} %"
    )
    return "\n".join([head, *lines, foot])


def described(runs: pd.DataFrame) -> tuple[pd.DataFrame, pd.DataFrame, str]:
    """Means at every pressure, laws of samples with several pressures, and both as text."""
    import pandas as pd

    by = ["sample", *varied_columns(runs)]
    table = means(runs, by)
    several = runs.groupby(by, sort=False)["pressure_Pa"].transform("nunique") > 1
    laws = fitted(runs[several], by=by) if several.any() else pd.DataFrame()
    shown = [table.assign(pressure_kPa=table["pressure_Pa"] / 1e3).drop(columns="pressure_Pa"), laws]
    return table, laws, "\n\n".join(t.to_string(index=False, float_format="%.4g") for t in shown if len(t))
