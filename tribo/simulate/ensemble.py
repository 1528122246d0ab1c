"""Ensembles: a design of samples, pressures and stratified angles, run on several threads."""

from __future__ import annotations

import re
import zlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from tribo.errors import Problem, SimulationError
from tribo.records import Pattern, Run
from tribo.simulate.config import SimConfig
from tribo.simulate.masks import pattern_of
from tribo.simulate.run import simulate

if TYPE_CHECKING:
    import pandas as pd

AngleRule = Literal["midpoints", "random", "nominal"]
Angles = AngleRule | Sequence[float]
Progress = Callable[[int, int], None]
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
    samples : mapping of name to Pattern, or names of the paper's samples
    pressures_Pa : nominal pressures, the same for all samples or by sample
    base : everything else, defaults included
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
    """Run a list of configurations on ``jobs`` threads; one row per run, in the order of the list.

    The rows do not depend on the number of threads. ``progress(done, total)`` is called after each run.

    Raises
    ------
    SimulationError
        A configuration is impossible (all of them are checked first), or a run failed.
    """
    import pandas as pd

    check_all(design)
    rows: list[dict[str, Any] | None] = [None] * len(design)
    threads = max(1, jobs // max(1, len(design)))
    with ThreadPoolExecutor(max(1, jobs)) as pool:
        pending = {pool.submit(simulate, config, threads): k for k, config in enumerate(design)}
        done = 0
        try:
            while pending:
                finished, _ = wait(pending, return_when=FIRST_COMPLETED)
                for future in finished:
                    rows[pending.pop(future)] = run_row(future.result())
                    done += 1
                    if progress is not None:
                        progress(done, len(design))
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return pd.DataFrame(rows)
