"""Ensembles: a design of samples, pressures and stratified angles, and the one scheduler that makes runs."""

from __future__ import annotations

import asyncio
import concurrent.futures
import platform
import re
import time
import warnings
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib import import_module, metadata
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from tribo.errors import Problem, SimulationError
from tribo.kept_results import LIBRARIES, DamagedResultWarning, sources
from tribo.records import Pattern, Run
from tribo.springblock.config import SimConfig
from tribo.springblock.lattice import pattern_of
from tribo.springblock.run import simulate

if TYPE_CHECKING:
    import pandas as pd

AngleRule = Literal["midpoints", "random", "nominal"]
Angles = AngleRule | Sequence[float]
Progress = Callable[[int, int], None]
SCHEDULER_TIMEOUT_S = 10.0
WORKERS_TIMEOUT_S = 120.0  # for the first worker of a scheduler, or the next one where all have left
LOOK_S = 5.0  # how often the scheduler is asked for its workers while no run ends
ANGLE_SPREAD_DEG = 10.0  # around the nominal direction of an anisotropic sample (Berardo 2019)


def angle_range_deg(sample: str, pattern: Pattern | None = None) -> tuple[float, float]:
    """Range of pull angles of a sample: nominal +-10 deg where its name ends in a direction, else 0 to 90.

    A name is a direction of a pattern when it ends in x or y and the pattern's own name (or the paper's) is the
    name without that letter, as ``Sx`` is S along x.
    """
    known = pattern or pattern_of(sample)
    direction = re.fullmatch(r"(.+?)[_ -]?([xy])", sample)
    if direction and (known is None or known.name != sample):
        nominal = 0.0 if direction[2] == "x" else 90.0
        return nominal - ANGLE_SPREAD_DEG, nominal + ANGLE_SPREAD_DEG
    return 0.0, 90.0


def middle_deg(limits_deg: tuple[float, float]) -> float:
    """The direction a sample is named after, from its range of angles; 0 where it is named after none."""
    low, high = limits_deg
    return 0.0 if (low, high) == (0.0, 90.0) else (low + high) / 2


def run_seed(seed: int, sample: str, pressure_Pa: float, repeat: int) -> int:
    """Seed of one run, from what the run is and not from its place in the list."""
    case = zlib.crc32(f"{sample} {pressure_Pa:.9g}".encode())
    return int(np.random.SeedSequence([seed, case, repeat]).generate_state(1)[0])


def stratified_design(
    samples: Mapping[str, Pattern | None] | Sequence[str],
    pressures_Pa: Sequence[float] | Mapping[str, Sequence[float]],
    repeats: int = 4,
    seed: int = 0,
    base: SimConfig | None = None,
    angles: Angles = "midpoints",
) -> list[SimConfig]:
    """Configurations of an ensemble: every sample at every pressure, ``repeats`` times.

    The angle range of a sample is cut into as many strata as there are repeats. Each stratum has one angle: its
    midpoint, which gives the best average over the uniform distribution of the paper, or a random one. With "nominal",
    every run is pulled in the direction of the sample's name, or along x. If angles are given in degrees, each is
    simulated ``repeats`` times instead.

    Parameters
    ----------
    samples
        Mapping of name to Pattern, or names of the paper's samples (F, A, B, C, Sx, Sy).
    pressures_Pa
        Nominal pressures in Pa, the same for all samples or by sample.
    repeats
        Runs per sample and pressure (and angle, where angles are given).
    seed
        From which the seed of every run follows; equal seeds give equal runs.
    base
        Everything else, by default that of the paper.
    angles
        "midpoints", "random", "nominal", or pull angles in degrees.

    Returns
    -------
    list of SimConfig
        By sample, pressure and repeat, for :func:`tribo.run_ensemble`.

    Examples
    --------
    >>> import tribo
    >>> [c.angle_deg for c in tribo.stratified_design(["A"], [10e3], repeats=3)]
    [15.0, 45.0, 75.0]
    """
    base = base or SimConfig()
    patterns = dict(samples) if isinstance(samples, Mapping) else dict.fromkeys(samples)
    design = []
    for sample, pattern in patterns.items():
        for pressure in pressures_Pa[sample] if isinstance(pressures_Pa, Mapping) else pressures_Pa:
            runs = range(repeats if isinstance(angles, str) else repeats * len(angles))
            seeds = [run_seed(seed, sample, pressure, k) for k in runs]
            pulls = _angles_deg(angles, angle_range_deg(sample, pattern), repeats, seeds)
            design += [
                base.with_(sample=sample, pattern=pattern, pressure_Pa=float(pressure), angle_deg=angle, seed=own)
                for own, angle in zip(seeds, pulls, strict=True)
            ]
    return design


def _angles_deg(
    angles: Angles, limits_deg: tuple[float, float], repeats: int, seeds: Sequence[int]
) -> list[float]:
    """The pull angle of every run at one pressure."""
    if not isinstance(angles, str):
        return [float(angle) for angle in angles for _ in range(repeats)]
    low, high = limits_deg
    if angles == "nominal":
        return [middle_deg(limits_deg)] * repeats
    within = [0.5 if angles == "midpoints" else np.random.default_rng([own, 1]).random() for own in seeds]
    return [float(low + (high - low) * (k + share) / repeats) for k, share in enumerate(within)]


def run_row(run: Run) -> dict[str, Any]:
    """The row of a run in the table of an ensemble."""
    return {
        "sample": run.sample,
        "pressure_Pa": run.pressure_Pa,
        "angle_deg": run.angle_deg,
        "seed": run.seed,
        "static_friction": run.static_friction,
        "sliding_friction": run.sliding_friction,
        "peak_s": run.peak_s,
        "first_failure_s": run.parameters["first_failure_s"],
        "window_start_s": run.window_s[0],
        "window_end_s": run.window_s[1],
        "area_fraction": run.parameters["area_fraction"],
        "normal_load_N": run.normal_load_N,
        "engine": run.engine,
    }


RESULTS = {
    "static_friction": "1", "sliding_friction": "1", "peak_s": "s", "first_failure_s": "s", "window_start_s": "s",
    "window_end_s": "s", "area_fraction": "1", "normal_load_N": "N",
}  # fmt: skip


@dataclass(frozen=True)
class Work:
    """What is done for every configuration of a store. The functions are sent to workers in other processes.

    Parameters
    ----------
    run : makes the run; :func:`tribo.springblock.simulate` by default
    read : numbers by name, read off the run
    units : names of the numbers that are kept, with their units
    label : tells this work from another that keeps the same names
    rooms : packages of tribo whose sources decide the result
    """

    run: Callable[[SimConfig], Run] | None = None
    read: Callable[[Run], Mapping[str, Any]] = run_row
    units: Mapping[str, str] = field(default_factory=lambda: RESULTS)
    label: str = ""
    rooms: Sequence[str] = ("springblock", "laws", "records")


FRICTION = Work()


def check_all(configs: Iterable[SimConfig]) -> None:
    """Refuse a design with every distinct fault of its configurations."""
    found: dict[str, Problem] = {}
    for config in configs:
        try:
            config.check()
        except SimulationError as refused:
            found |= {str(problem): problem for problem in refused.problems}
    if found:
        raise SimulationError(list(found.values()))


def run_ensemble(
    design: Sequence[SimConfig], jobs: int = 2, progress: Progress | None = None
) -> pd.DataFrame:
    """Run a list of configurations in memory.

    The rows do not depend on the number of threads.

    Parameters
    ----------
    design
        Configurations, as :func:`tribo.stratified_design` makes them.
    jobs
        Threads.
    progress
        Called after each run with the runs done and their total.

    Returns
    -------
    DataFrame
        One row per run, in the order of the design: sample, pressure_Pa, angle_deg, seed, static_friction and
        sliding_friction (T/N), peak_s, first_failure_s, window_start_s, window_end_s, area_fraction, normal_load_N and
        engine.

    Raises
    ------
    SimulationError
        A configuration is impossible (all of them are checked first), or a run failed.

    Examples
    --------
    >>> import tribo
    >>> base = tribo.SimConfig(blocks=(12, 12), dt_s=1e-7, duration_peaks=1.5)
    >>> table = tribo.run_ensemble(tribo.stratified_design(["F"], [5e3, 20e3], repeats=2, base=base))
    >>> len(table)
    4
    """
    import pandas as pd

    check_all(design)
    rows: list[Any] = [None] * len(design)
    for done, (k, row) in enumerate(finished_runs(design, jobs)):
        rows[k] = row
        if progress is not None:
            progress(done + 1, len(design))
    return pd.DataFrame(rows)


def finished_runs(
    configs: Sequence[SimConfig], jobs: int = 2, scheduler: str | None = None, work: Work = FRICTION
) -> Iterator[tuple[int, Mapping[str, Any]]]:
    """Results in the order in which runs finish, each with its place among the configurations.

    The one scheduler: on ``jobs`` threads of this process, whose compiled loops run side by side, or on the workers of
    a dask scheduler at an address. Where there are more threads than runs, several share a run.

    Raises
    ------
    SimulationError
        A run failed; no dask, or no scheduler at the address; it has no workers, or none with the sources and versions
        of this process; the scheduler went away, or a run ended its workers.
    """
    threads = max(1, jobs // max(1, len(configs))) if scheduler is None else 1
    with _executor(jobs, scheduler) as (pool, check_workers):
        pending = {pool.submit(made, config, work, threads): k for k, config in enumerate(configs)}
        left = set(pending)
        try:
            while left:
                done, left = wait(left, LOOK_S, FIRST_COMPLETED)
                for future in done:
                    yield pending[future], future.result()
                if not done:
                    check_workers()
        except (OSError, asyncio.CancelledError, concurrent.futures.CancelledError) as why:
            if scheduler is None:
                raise
            what = "the dask scheduler stopped answering; finished runs are kept and the next start continues"
            reason = str(why) or type(why).__name__
            raise SimulationError(Problem("scheduler_gone", what, column="scheduler", found=reason[:200])) from why
        except Exception as why:
            if scheduler is None or not isinstance(why, import_module("distributed").KilledWorker):
                raise
            what = "a run ended every worker that tried it, for want of memory perhaps; finished runs are kept"
            reason = " ".join(str(why).split())[:200]
            raise SimulationError(
                Problem("workers_killed", what, column="scheduler", found=reason, allowed="workers with more memory")
            ) from why
        finally:
            for future in pending:
                future.cancel()


def made(config: SimConfig, work: Work, threads: int) -> Mapping[str, Any]:
    """One run as its row, here or on a worker."""
    return work.read(simulate(config, threads) if work.run is None else work.run(config))


class RefusedWorkerWarning(DamagedResultWarning):
    """A worker of a scheduler runs other code or versions, and gets no work."""


def identity() -> dict[str, str]:
    """What decides the bits of a run in this process: Python, the libraries, and a hash of the sources of tribo."""
    versions = {library: metadata.version(library) for library in (*LIBRARIES, "llvmlite")}
    return {"Python": platform.python_version(), **versions, "tribo": sources("")}


def checked_workers(client: Any, scheduler: str) -> list[str]:
    """Addresses of the workers that would make the same runs as this process; a warning names each other one.

    Raises
    ------
    SimulationError
        There are no workers, after :data:`WORKERS_TIMEOUT_S`, or all of them run other code.
    """
    try:
        client.wait_for_workers(1, timeout=WORKERS_TIMEOUT_S)
    except TimeoutError as why:
        raise SimulationError(_no_workers(scheduler)) from why
    own, good, refused = identity(), [], []
    for address, found in client.run(identity, on_error="return").items():
        if found == own:
            good.append(str(address))
            continue
        if isinstance(found, dict):
            other = [f"{name} {found.get(name)} (here {mine})" for name, mine in own.items() if found.get(name) != mine]
            named = [text if not text.startswith("tribo ") else "other sources of tribo" for text in other]
        else:
            named = [f"no answer: {type(found).__name__}: {' '.join(str(found).split())[:200]}"]
        refused.append(f"worker {address}: {', '.join(named)}")
    if not good:
        what = "no worker of this scheduler runs the code of this process"
        allowed = "workers with the same Python, libraries and sources of tribo"
        raise SimulationError(
            Problem("other_workers", what, column="scheduler", found="; ".join(refused), allowed=allowed)
        )
    for said in refused:
        warnings.warn(f"{said}; it gets no work", RefusedWorkerWarning, stacklevel=2)
    return good


def _no_workers(scheduler: str) -> Problem:
    what = f"the dask scheduler has no workers; {WORKERS_TIMEOUT_S:g} s were waited for one, and finished runs are kept"
    return Problem("no_workers", what, column="scheduler", found=scheduler, allowed=f"dask worker {scheduler}")


@contextmanager
def _executor(jobs: int, scheduler: str | None) -> Iterator[tuple[Executor, Callable[[], None]]]:
    """Threads of this process, or the workers of a dask scheduler; and a check that there still are workers."""
    if scheduler is None:
        with ThreadPoolExecutor(max(1, jobs)) as pool:
            yield pool, lambda: None
        return
    try:
        distributed = import_module("distributed")
    except ImportError as why:
        raise SimulationError(
            Problem(
                "missing_package", "a scheduler requires dask.distributed", column="scheduler", found=scheduler,
                allowed="pip install distributed, or no scheduler",
            )
        ) from why
    try:
        client = distributed.Client(scheduler, timeout=SCHEDULER_TIMEOUT_S, set_as_default=False)
    except (OSError, ValueError) as why:
        raise SimulationError(
            Problem(
                "no_scheduler", f"no dask scheduler answers here: {why}", column="scheduler", found=scheduler,
                allowed="the address printed by a running dask scheduler, such as tcp://HOST:8786",
            )
        ) from why
    try:
        with client, client.as_current():
            chosen = checked_workers(client, scheduler)
            seen = time.monotonic()

            def check() -> None:
                nonlocal seen
                now = time.monotonic()
                if set(client.scheduler_info()["workers"]) & set(chosen):
                    seen = now
                elif now - seen > WORKERS_TIMEOUT_S:
                    raise SimulationError(_no_workers(scheduler))

            yield client.get_executor(pure=False, workers=chosen), check
    finally:  # a client that ends leaves itself behind as the scheduler of whatever else uses dask in this process
        import_module("dask").config.set(scheduler=None)
