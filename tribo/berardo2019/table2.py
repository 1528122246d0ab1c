"""The simulated column of Table 2 of the paper, recomputed and compared with the printed one."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tribo.springblock.config import PAPER_PRESSURES_PA, PAPER_SAMPLES, SimConfig
from tribo.springblock.ensemble import Angles, Progress, run_ensemble, stratified_design
from tribo.springblock.ensemble_laws import fitted
from tribo.springblock.kept_runs import run_stored

if TYPE_CHECKING:
    import pandas as pd


def table2_design(
    base: SimConfig | None = None,
    repeats: int = 20,
    pressures_Pa: Sequence[float] = PAPER_PRESSURES_PA,
    samples: Sequence[str] = PAPER_SAMPLES,
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
    weights : "ratio" for a scatter of T/N that is equal at all pressures, or "force" for one of T
    path, scheduler : as for :func:`tribo.springblock.run_stored`; without a path nothing is kept
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
