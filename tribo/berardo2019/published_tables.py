"""The published tables bundled with tribo, and the simulated column of Table 2, recomputed.

Tables are in the units of their source; those that its simulator made stand beside them.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tribo.files import PATTERN_SHARES, data_dir
from tribo.springblock.calibration import fitted
from tribo.springblock.config import PAPER_PRESSURES_PA, PAPER_SAMPLES, SimConfig
from tribo.springblock.ensemble import Angles, Progress, run_ensemble, stratified_design
from tribo.springblock.kept_runs import run_stored

if TYPE_CHECKING:
    import pandas as pd


BERARDO2019 = "berardo2019"


def load_table1() -> pd.DataFrame:
    """Table 1 of Berardo et al. (2019): the patterns.

    Returns
    -------
    DataFrame
        One row per sample: sample, cavity (none, circle, rectangle), size_x_um, size_y_um (the diameter twice for a
        circle), pitch_x_um, pitch_y_um (lengths in um), area_fraction_printed, area_fraction_computed (from the sizes
        printed beside it), area_fraction_model (of the paper's 85 x 85 blocks). NaN where a flat sample has no value.

    Examples
    --------
    >>> patterns = tribo.load_table1().set_index("sample")
    >>> float(patterns.loc["C", "size_x_um"]), round(float(patterns.loc["C", "area_fraction_computed"]), 3)
    (15.0, 0.558)
    """
    return _read("table1.csv")


def load_table2() -> pd.DataFrame:
    """Table 2 of Berardo et al. (2019) in long form.

    Returns
    -------
    DataFrame
        One row per sample, regime and source: sample, regime (static, sliding), source (experiment, simulation), mu,
        mu_sd (no unit), tau0_kPa, tau0_sd_kPa (kPa). The standard deviations are as printed; the covariance of mu and
        tau0 is not published.

    Examples
    --------
    >>> table = tribo.load_table2()
    >>> len(table), float(table.query("sample == 'F' and regime == 'static' and source == 'experiment'")["mu"].iloc[0])
    (24, 4.76)
    """
    return _read("table2.csv")


def load_table2_simulated_anew() -> pd.DataFrame:
    """The simulated part of Table 2 recomputed with tribo, from 960 runs at stratified angles.

    docs/results/table2-recomputed.md compares it with the paper.

    Columns: sample, regime, mu, mu_se, tau0_kPa, tau0_kPa_se.
    """
    return _read("table2_tribo.csv")


def load_pattern_laws() -> pd.DataFrame:
    """Law of each pattern of the paper by tribo's own simulator, and its shares of that of the flat sample.

    Columns: sample, regime, the geometry (lengths in um), runs, mu, tau0_kPa, their shares of those of the flat sample
    (mu_share, tau0_share), and the standard error of each (``_se``). docs/results/model-error.md says how it was made.
    """
    return _read("laws.csv", PATTERN_SHARES)


def load_pattern_errors() -> pd.DataFrame:
    """How wrong the spring-block model may be about a pattern: standard deviations of ln T by source and regime.

    Columns: source, regime, offset, slope (per e-fold of pressure), curve (per squared e-fold), cases (how many were
    compared), made_from. "total" holds for a simulated pattern, "interpolation" is added to it for any other.
    """
    return _read("errors.csv", PATTERN_SHARES)


def load_model_parameters() -> pd.DataFrame:
    """Parameters of the paper's spring-block model: name, symbol, value, unit, place (section)."""
    return _read("model_parameters.csv")


def contradictions() -> pd.DataFrame:
    """Points on which the paper contradicts itself or gives no value.

    Returns
    -------
    DataFrame
        One row per point, all text: topic, one_place, other_place, effect, tribo_default.

    Examples
    --------
    >>> points = tribo.contradictions().set_index("topic")
    >>> points.loc["pitch of pattern S along x", "tribo_default"]
    '220 x 120 um'
    """
    return _read("contradictions.csv")


def _read(name: str, folder: str = BERARDO2019) -> pd.DataFrame:
    import pandas as pd

    return pd.read_csv(data_dir() / folder / name, comment="#", keep_default_na=False, na_values=[""])


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
