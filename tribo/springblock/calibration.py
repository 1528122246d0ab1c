"""Local friction of the blocks such that the simulated flat sample has the measured mu and tau0."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from tribo.display import displayed
from tribo.springblock.config import PAPER, LocalFriction, SimConfig
from tribo.springblock.ensemble import Progress, check_all, finished_runs, stratified_design
from tribo.springblock.ensemble_laws import simulated_law

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
