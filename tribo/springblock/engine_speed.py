"""Speed of the engines as ratios measured within one process, independent of the clock rate of the machine."""

from __future__ import annotations

import resource
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass

from tribo.springblock.config import SimConfig
from tribo.springblock.engines import ENGINES
from tribo.springblock.engines.fast import integrate as run_fast
from tribo.springblock.engines.reference import integrate as run_reference
from tribo.springblock.engines.state import Thresholds, Trajectory, lattice_of, thresholds_of
from tribo.springblock.lattice import Lattice

Progress = Callable[[int, int], None]
CASES = (("F", 20.0), ("A", 20.0), ("B", 20.0), ("C", 20.0), ("Sx", 0.0), ("Sy", 90.0))  # sample and angle


@dataclass(frozen=True)
class Timing:
    """One measured figure. ``aim`` is what the project asks of it, None where it is only reported."""

    name: str
    value: float
    unit: str
    aim: float | None = None
    better: str = "higher"
    note: str = ""

    @property
    def reached(self) -> bool | None:
        if self.aim is None:
            return None
        return self.value >= self.aim if self.better == "higher" else self.value <= self.aim

    def record(self) -> dict[str, object]:
        return asdict(self) | {"reached": self.reached}


def simulator_benchmarks(
    progress: Progress | None = None, large: bool = False, dt_s: float = 1e-8, reference_steps: int = 300
) -> list[Timing]:
    """All figures of the simulator; about two minutes on one core, with ``large`` some minutes more.

    The reference engine is timed over ``reference_steps`` steps through the rupture of the flat sample: its cost
    a step does not depend on what moves. The fast engine is timed over whole runs.
    """
    parts: list[Callable[[], Iterator[Timing]]] = [
        lambda: engine_ratios(dt_s, reference_steps),
        table2_cost,
    ]
    if large:
        parts.append(size_scaling)
    timings: list[Timing] = []
    for k, part in enumerate(parts):
        timings.extend(part())
        if progress is not None:
            progress(k + 1, len(parts))
    return timings


def engine_ratios(dt_s: float = 1e-8, reference_steps: int = 300) -> Iterator[Timing]:
    """Fast over reference, processor time per simulated time at the same step, 85 x 85 blocks at 10 kPa."""
    per_step = reference_cost(SimConfig(dt_s=dt_s), reference_steps)
    yield Timing("reference step", 1e6 * per_step, "us", note="85 x 85 blocks, RK4, finite rotation")
    for sample, angle_deg in CASES:
        aim = 1000.0 if sample == "F" else 30.0
        config = SimConfig(sample=sample, angle_deg=angle_deg, dt_s=dt_s, duration_s=10e-3)
        seconds, _ = timed_run(config)
        reference = per_step * config.duration_s / dt_s if config.duration_s else 0.0
        yield Timing(
            f"fast over reference, {sample}", reference / seconds, "ratio", aim,
            note=f"10 ms at dt = {dt_s:g} s in {seconds:.2f} s; reference {reference:.0f} s by its step",
        )  # fmt: skip


def table2_cost(repeats: int = 20, pressures: int = 8, jobs: int = 2) -> Iterator[Timing]:
    """Processor time of the whole Table 2 ensemble at 5e-8 s, from one run a sample at the middle pressure."""
    total = 0.0
    for sample, angle_deg in CASES:
        seconds, _ = timed_run(SimConfig(sample=sample, angle_deg=angle_deg, pressure_Pa=12e3))
        total += seconds * repeats * pressures
    yield Timing(
        "Table 2 ensemble", total / jobs / 60, "min", 10.0, "lower",
        note=f"{6 * repeats * pressures} runs at dt = 5e-8 s to 3 peak times, {jobs} cores, from one run a sample",
    )  # fmt: skip


def size_scaling(blocks: int = 1000, dt_s: float = 2e-8) -> Iterator[Timing]:
    """A large flat sample against 85 x 85: seconds for 10 ms, memory, and time per active block and step."""
    costs = {}
    for n in (85, blocks):
        config = SimConfig(blocks=(n, n), dt_s=dt_s, duration_s=10e-3, angle_deg=20.0, sample_interval_s=1e-5)
        seconds, run = timed_run(config)
        costs[n] = seconds / (run.active_block_steps + run.dense_steps * n * n)
        if n == blocks:
            yield Timing(f"{n} x {n} blocks, 10 ms, one thread", seconds, "s", note=f"dt = {dt_s:g} s")
            yield _by_the_clock(config, threads=2)
            yield Timing("peak memory", _peak_memory_GB(), "GB", 1.0, "lower", note="of the whole process")
    ratio = costs[blocks] / costs[85]
    yield Timing("time per block event, large over 85 x 85", ratio, "ratio", 4.0, "lower")


def _by_the_clock(config: SimConfig, threads: int) -> Timing:
    """Elapsed time of one run on several threads, which processor time does not show."""
    lattice, thresholds = _prepared(config)
    run_fast(config.with_(duration_s=1e-6), lattice, thresholds, threads)
    began = time.perf_counter()
    run_fast(config, lattice, thresholds, threads)
    name = f"{config.blocks[0]} x {config.blocks[1]} blocks, 10 ms, {threads} threads by the clock"
    return Timing(name, time.perf_counter() - began, "s", 25.0, "lower", note="on cores that do nothing else")


def reference_cost(config: SimConfig, steps: int) -> float:
    """Processor seconds of one step of the reference engine."""
    config = config.with_(rotation="finite", engine="reference")
    lattice, thresholds = _prepared(config)
    failure = run_fast(config.with_(duration_s=1e-6), lattice, thresholds).first_failure_s

    def run(n: int) -> float:
        began = time.process_time()
        run_reference(config.with_(duration_s=failure + n * config.dt_s), lattice, thresholds, start_share=1.0)
        return time.process_time() - began

    run(20)  # compiles
    return (run(20 + steps) - run(20)) / steps


def timed_run(config: SimConfig) -> tuple[float, Trajectory]:
    """Processor seconds of one run on compiled code, and the run."""
    lattice, thresholds = _prepared(config)
    integrate = ENGINES[config.engine].integrate
    integrate(config.with_(duration_s=1e-6), lattice, thresholds, 1)
    began = time.process_time()
    run = integrate(config, lattice, thresholds, 1)
    return time.process_time() - began, run


def _prepared(config: SimConfig) -> tuple[Lattice, Thresholds]:
    lattice = lattice_of(config)
    return lattice, thresholds_of(config, lattice)


def _peak_memory_GB() -> float:
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (1e9 if sys.platform == "darwin" else 1e6)
