"""Laws of the runs of an ensemble, and the local friction with which the flat sample has the measured one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from tribo.display import displayed
from tribo.records import FloatArray
from tribo.springblock.config import PAPER, LocalFriction, SimConfig
from tribo.springblock.ensemble import Progress, check_all, finished_runs, stratified_design
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


Law = tuple[float, float]
"""mu and tau0 (Pa) of T = mu N + tau0 A."""


@lru_cache(maxsize=32)
def expected_minimum(n: int) -> float:
    """Expected smallest of ``n`` standard normal numbers: the integral of z n f(z) (1 - F(z))^(n - 1)."""
    from scipy.integrate import quad
    from scipy.special import log_ndtr, ndtri  # scipy.stats would take longer to start than the integral

    def density(z: float) -> float:
        log_f = -z * z / 2.0 - np.log(np.sqrt(2.0 * np.pi))
        return float(z * n * np.exp(log_f + (n - 1) * log_ndtr(-z)))

    return float(quad(density, -12.0, 12.0, limit=400, points=(ndtri(1.0 / (n + 1)),))[0])


def static_calibration(law: Law, blocks: int, spread: float = PAPER.mu_s_sd / PAPER.mu_s) -> tuple[float, float, float]:
    """Mean and standard deviation of mu_s, and the adhesion (Pa), for a flat sample of ``blocks`` blocks.

    The flat sample starts to slide at its weakest block: mu = mean + sd E[min of n normals], tau0 = F_as / l2.
    """
    mu, tau0_Pa = law
    mean = mu / (1.0 + spread * expected_minimum(blocks))
    return mean, spread * mean, tau0_Pa


@displayed()
@dataclass(frozen=True)
class CalibrationRuns:
    """The runs that a calibration compares with the measured sliding law, ``iterations`` times over.

    ``repeats`` runs at each of ``pressures_Pa``, which should cover the range of the measurement.
    """

    pressures_Pa: Sequence[float] = (3e3, 10e3, 25e3)
    repeats: int = 3
    iterations: int = 3
    seed: int = 0


CALIBRATION_RUNS = CalibrationRuns()


def calibrate(
    static: Law,
    sliding: Law,
    base: SimConfig | None = None,
    runs: CalibrationRuns = CALIBRATION_RUNS,
    jobs: int = 2,
    progress: Progress | None = None,
) -> LocalFriction:
    """Local friction that gives the flat sample the laws ``static`` and ``sliding``, both (mu, tau0 in Pa).

    Static friction follows from the weakest block. Sliding friction is not that of the blocks, since they slip one
    by one; mu_d and F_ad are therefore corrected by the deviation of the simulated flat sample, with the same random
    numbers each time. Standard deviations scale with the means as in the paper (0.195 / 5.5 and 0.15 / 2.9).

    Parameters
    ----------
    static, sliding
        mu and tau0 (Pa) of T = mu N + tau0 A, measured on the flat sample.
    base
        Configuration of the runs (blocks, time step, window); its sample and friction are replaced.
    runs
        Pressures, repeats and seed of the runs that the sliding law is matched on.
    jobs
        Threads.
    progress
        Called after each run with the runs done and their total.

    Returns
    -------
    LocalFriction
        For ``SimConfig(friction=...)``.

    Raises
    ------
    SimulationError
        The configuration is impossible, or a run failed.

    Examples
    --------
    >>> import tribo
    >>> from tribo.springblock import CalibrationRuns
    >>> base = tribo.SimConfig(blocks=(12, 12), dt_s=1e-7, duration_peaks=1.5)
    >>> few = CalibrationRuns(repeats=1, iterations=1)
    >>> friction = tribo.calibrate(static=(4.8, 23e3), sliding=(2.9, 12e3), base=base, runs=few)
    >>> round(friction.static_adhesion_Pa)
    23000
    """
    base = (base or SimConfig()).with_(sample="F", pattern=None)
    mean, sd, adhesion = static_calibration(static, base.blocks[0] * base.blocks[1])
    ratio = PAPER.mu_d_sd / PAPER.mu_d
    local = np.array(sliding, float)

    def friction() -> LocalFriction:
        mu_d = max(float(local[0]), 0.0)
        return LocalFriction(mean, sd, mu_d, ratio * mu_d, adhesion, float(local[1]))

    for turn in range(runs.iterations):
        design = stratified_design(
            ["F"], runs.pressures_Pa, runs.repeats, runs.seed, replace(base, friction=friction())
        )
        check_all(design)
        pressure_Pa, friction_of_run = np.zeros(len(design)), np.zeros(len(design))
        for done, (k, row) in enumerate(finished_runs(design, jobs), start=1):
            pressure_Pa[k], friction_of_run[k] = row["pressure_Pa"], row["sliding_friction"]
            if progress is not None:
                progress(turn * len(design) + done, runs.iterations * len(design))
        local += np.array(sliding) - simulated_law(pressure_Pa, friction_of_run)
    return friction()
