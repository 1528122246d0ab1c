"""One run of the spring-block model, from a configuration to a Run."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tribo.errors import Problem, SimulationError
from tribo.records import Run
from tribo.springblock.config import SimConfig
from tribo.springblock.engines import ENGINES
from tribo.springblock.engines.state import Trajectory, lattice_of, thresholds_of

MOST_TIMES_LONGER = 4  # a force that rises without end is an error


def simulate(config: SimConfig, threads: int = 1) -> Run:
    """Simulate one pull of one sample at one load; static and sliding friction follow from the slider force.

    Static friction is T/N at the peak, sliding friction the mean of T/N over the window of the configuration,
    by default from 1.05 times the peak time to the end. N is the nominal load p l2 Nx Ny.

    Parameters
    ----------
    config
        Sample, pattern, pressure, pull angle, seed and everything else; the defaults are those of the paper.
    threads
        Threads that share a lattice of 100,000 blocks or more; the result does not depend on their number.

    Returns
    -------
    Run
        ``static_friction`` and ``sliding_friction`` (T/N), the trace ``time_s``, ``force_N`` and ``moving`` (blocks in
        contact that move), shape (n,), and every parameter.

    Raises
    ------
    SimulationError
        The configuration is impossible (every fault is listed), a force became non-finite, or the run ended
        before its sliding window began.

    Examples
    --------
    >>> import tribo
    >>> run = tribo.simulate(tribo.SimConfig(sample="F", blocks=(12, 12), dt_s=1e-7, duration_peaks=1.5))
    >>> run.static_friction > run.sliding_friction
    True
    """
    config.check()
    lattice = lattice_of(config)
    if not lattice.contact.any():
        raise SimulationError(
            Problem(
                "no_contact", "no block touches: the walls of this pattern are narrower than the blocks",
                column="spacing_m", found=f"{config.spacing_m * 1e6:g} um",
                allowed='a finer spacing, or cavity_shape "exact"',
            )
        )
    integrate, thresholds = ENGINES[config.engine].integrate, thresholds_of(config, lattice)
    trajectory = integrate(config, lattice, thresholds, threads)
    trajectory = until_it_slides(config, trajectory, lambda longer: integrate(longer, lattice, thresholds, threads))
    return run_of(config, trajectory, float(lattice.area_fraction))


def until_it_slides(
    config: SimConfig, trajectory: Trajectory, integrate: Callable[[SimConfig], Trajectory]
) -> Trajectory:
    """The trajectory of a run, integrated for longer where its sliding window would begin after its end.

    The highest force of few blocks may come late, among the slips of sliding. A run whose length is given does not go
    on.
    """
    for _ in range(MOST_TIMES_LONGER):
        if config.duration_s is not None or trajectory.time_s[-1] > config.window_start_peaks * trajectory.peak_s:
            break
        trajectory = integrate(config.with_(duration_s=config.duration_peaks * trajectory.peak_s))
    return trajectory


def run_of(config: SimConfig, trajectory: Trajectory, area_fraction: float) -> Run:
    """Read static and sliding friction off a trajectory."""
    first = config.peak_rule == "first"
    peak_N, peak_s = (
        (trajectory.first_peak_N, trajectory.first_peak_s) if first else (trajectory.peak_N, trajectory.peak_s)
    )
    time = trajectory.time_s
    start = config.window_start_peaks * peak_s
    # a jump over a quiet stretch can end beyond what was asked for
    finish = min(time[-1], config.duration_s or config.duration_peaks * peak_s)
    end = finish if config.window_end_peaks is None else min(config.window_end_peaks * peak_s, finish)
    kept = slice(0, int(np.searchsorted(time, finish, side="right")))
    if not end > start:
        raise SimulationError(
            Problem(
                "too_short", "the run ends before its sliding window begins", column="duration_s",
                found=f"{finish:.4g} s", allowed=f"more than {start:.4g} s",
            )
        )
    from_impulse, to_impulse = np.interp([start, end], time, trajectory.impulse_Ns)
    load = config.normal_load_N
    return Run(
        sample=config.sample,
        pressure_Pa=config.pressure_Pa,
        angle_deg=config.angle_deg,
        seed=config.seed,
        time_s=time[kept],
        force_N=trajectory.force_N[kept],
        moving=trajectory.moving[kept],
        normal_load_N=load,
        static_friction=peak_N / load,
        sliding_friction=float((to_impulse - from_impulse) / (end - start)) / load,
        peak_s=peak_s,
        window_s=(float(start), float(end)),
        engine=config.engine,
        parameters=config.parameters()
        | {"area_fraction": area_fraction, "first_failure_s": trajectory.first_failure_s},
    )
