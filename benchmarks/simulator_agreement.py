"""Fast engine against the reference engine on the same random thresholds.

    python benchmarks/simulator_agreement.py peaks docs/data/simulator-peaks.csv
    python benchmarks/simulator_agreement.py sliding docs/data/simulator-sliding.csv
    python benchmarks/simulator_agreement.py tolerance docs/data/simulator-tolerance.csv docs/data/simulator-peaks.csv
    python benchmarks/simulator_agreement.py order docs/data/simulator-order.csv docs/data/simulator-peaks.csv
    python benchmarks/simulator_agreement.py itself docs/data/simulator-itself.csv docs/data/simulator-peaks.csv
    python benchmarks/simulator_agreement.py convergence docs/data/simulator-convergence.csv
    python benchmarks/simulator_agreement.py energy docs/data/simulator-energy.csv

``peaks`` compares static friction (the highest force, and the first local peak) and the order of the first failures
in 42 cases, cavities resting below 1e-4 and below the default tolerance (half an hour on one core); ``sliding`` the
mean over the same window, ten seeds of every sample (half an hour). ``tolerance`` repeats the fast runs of the 42
cases under other tolerances against the reference peaks already in the file (a minute), ``order`` says how far apart
in time the first failures lie in the cases where their order differs (a minute), and ``itself`` holds the reference
engine against itself, at other time steps, in the cases where the engines differ by more than 0.1 % (minutes).
``convergence`` runs the fast engine alone at four time steps, six seeds a sample (two minutes), and ``energy`` closes
its balance of energy, and that of the reference engine, over one rupture (a minute).
What a file holds already is not computed again: a stopped start goes on.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pandas as pd

from tribo.springblock import SimConfig, simulate
from tribo.springblock.engines import reference as r
from tribo.springblock.engines.fast import integrate as run_fast
from tribo.springblock.engines.reference import integrate as run_reference
from tribo.springblock.engines.state import Trajectory, drive_of, first_failure_s, lattice_of, thresholds_of

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests"))
from support.energy_balance import energy_balance

SAMPLES = ("F", "A", "B", "C", "Sx", "Sy")
PRESSURES_PA = (2e3, 3e3, 5e3, 10e3, 15e3, 25e3, 40e3)
CLOSE = 1e-4  # rest tolerance at which the engines are held against each other
TOLERANCES = (2e-2, 1e-2, 5e-3, 2e-3, 1e-3, 5e-4, 1e-4)
SEEDS = 10
NOMINAL_DEG = {"Sx": 0.0, "Sy": 90.0}

Row = dict[str, object]
Key = tuple[object, ...]
Task = tuple[Key, Callable[[], Row]]


def peak_cases() -> Iterator[SimConfig]:
    """Every sample at every pressure, the angles spread over each sample's range."""
    angles = np.random.default_rng(8).uniform(0, 90, (len(SAMPLES), len(PRESSURES_PA)))
    for sample, row in zip(SAMPLES, angles, strict=True):
        for k, (pressure, angle) in enumerate(zip(PRESSURES_PA, row, strict=True)):
            nominal = NOMINAL_DEG.get(sample)
            own = angle if nominal is None else nominal + (angle - 45) / 4.5
            yield SimConfig(
                sample=sample, pressure_Pa=pressure, angle_deg=float(own), seed=k, blocks=(48, 48), dt_s=1e-8,
                rest_tolerance=CLOSE,
            )  # fmt: skip


def sliding_case(sample: str, seed: int) -> SimConfig:
    """One of ten seeds and angles of a sample on a domain that the reference engine can pull beyond its peak."""
    config = SimConfig(sample=sample, seed=seed, dt_s=1e-8, duration_peaks=1.5, window_end_peaks=1.5)
    if sample in NOMINAL_DEG:  # one whole cavity of S and its rim
        angle = NOMINAL_DEG[sample] + 2.0 * seed - 9.0
        return config.with_(blocks=(44, 14), pattern_first=(2, 3), angle_deg=angle)
    return config.with_(blocks=(20, 20), angle_deg=9.0 * seed)


def fast_run(config: SimConfig) -> Trajectory:
    lattice = lattice_of(config)
    return run_fast(config, lattice, thresholds_of(config, lattice))


def both(config: SimConfig) -> tuple[Trajectory, Trajectory]:
    """The same configuration and thresholds on both engines."""
    lattice = lattice_of(config)
    thresholds = thresholds_of(config, lattice)
    return run_fast(config, lattice, thresholds), run_reference(config, lattice, thresholds, start_share=0.99)


def compare_peaks(config: SimConfig) -> Row:
    """Both engines until shortly after the highest force of the sample, which the fast one finds beforehand."""
    config = config.with_(duration_s=1.01 * fast_run(config).peak_s)
    fast, reference = both(config)
    default = fast_run(config.with_(rest_tolerance=SimConfig().rest_tolerance))
    firsts = [first_peak(t.force_N, config.peak_drop) for t in (fast, reference)]
    return {
        "end_ms": 1e3 * (config.duration_s or 0.0),
        "static_fast": fast.peak_N / config.normal_load_N,
        "static_reference": reference.peak_N / config.normal_load_N,
        "difference_percent": 100 * (fast.peak_N / reference.peak_N - 1),
        "difference_default_tolerance_percent": 100 * (default.peak_N / reference.peak_N - 1),
        "difference_first_peak_percent": 100 * (firsts[0] / firsts[1] - 1),
        "first_five_equal": bool(np.array_equal(fast.failed[:5], reference.failed[:5])),
    }


def first_peak(force_N: np.ndarray, drop: float) -> float:
    """The largest force before the first fall of ``drop`` below it."""
    highest = np.maximum.accumulate(force_N)
    fallen = np.flatnonzero(force_N < (1.0 - drop) * highest)
    return float(highest[fallen[0]] if fallen.size else highest[-1])


def peaks() -> Iterator[Task]:
    for config in peak_cases():
        yield case_key(config), lambda config=config: compare_peaks(config)


def case_key(config: SimConfig) -> Key:
    return config.sample, round(config.pressure_Pa / 1e3, 6), round(config.angle_deg, 2)


def compare_sliding(config: SimConfig) -> Row:
    """Means of both engines over one window, from 1.05 to 1.5 times the peak time of the fast run."""
    peak_s = fast_run(config).peak_s
    window = 1.05 * peak_s, 1.5 * peak_s
    runs = both(config.with_(duration_s=window[1]))
    fast, reference = (mean_between(run, *window) / config.normal_load_N for run in runs)
    return {
        "angle_deg": config.angle_deg,
        "sliding_fast": fast,
        "sliding_reference": reference,
        "sliding_difference_percent": 100 * (fast / reference - 1),
    }


def mean_between(run: Trajectory, start_s: float, end_s: float) -> float:
    """Mean force from its running integral; a run ends within one sample of what it was asked for."""
    start_Ns, end_Ns = np.interp([start_s, end_s], run.time_s, run.impulse_Ns)
    return float((end_Ns - start_Ns) / (min(end_s, run.time_s[-1]) - start_s))


def sliding() -> Iterator[Task]:
    for sample in ("F", "C", "B", "Sx", "A", "Sy"):
        for seed in range(SEEDS):
            config = sliding_case(sample, seed)
            yield (sample, seed), lambda config=config: compare_sliding(config)


def tolerance(reference_peaks: str) -> Iterator[Task]:
    known = pd.read_csv(reference_peaks)
    cases = {case_key(c): c for c in peak_cases()}
    fast_run(next(iter(cases.values())))  # compiles
    for row in known.itertuples(index=False):
        key = (row.sample, row.pressure_kPa, row.angle_deg)
        for share in TOLERANCES:
            config = cases[key].with_(rest_tolerance=share, duration_s=row.end_ms * 1e-3)
            yield (*key, share), lambda config=config, static=row.static_reference: timed_peak(config, static)


def timed_peak(config: SimConfig, static_reference: float) -> Row:
    began = time.process_time()
    static = fast_run(config).peak_N / config.normal_load_N
    return {"difference_percent": 100 * (static / static_reference - 1), "seconds": time.process_time() - began}


def order(reference_peaks: str) -> Iterator[Task]:
    known = pd.read_csv(reference_peaks)
    cases = {case_key(c): c for c in peak_cases()}
    for row in known[~known["first_five_equal"]].itertuples(index=False):
        key = (row.sample, row.pressure_kPa, row.angle_deg)
        config = cases[key].with_(duration_s=row.end_ms * 1e-3)
        yield key, lambda config=config: orders_of(config)


def itself(reference_peaks: str) -> Iterator[Task]:
    """The reference engine at 1.5e-8 and 2e-8 s against itself at 1e-8 s, where the fast one differs from it."""
    known = pd.read_csv(reference_peaks)
    cases = {case_key(c): c for c in peak_cases()}
    for row in known[known["difference_percent"].abs() > 0.1].itertuples(index=False):
        key = (row.sample, row.pressure_kPa, row.angle_deg)
        for dt_s in (1.5e-8, 2e-8):
            config = cases[key].with_(duration_s=row.end_ms * 1e-3, dt_s=dt_s)
            yield (*key, dt_s), lambda config=config, static=row.static_reference: against_itself(config, static)


def against_itself(config: SimConfig, static: float) -> Row:
    lattice = lattice_of(config)
    again = run_reference(config, lattice, thresholds_of(config, lattice), start_share=0.99)
    return {"reference_difference_percent": 100 * (again.peak_N / config.normal_load_N / static - 1)}


def orders_of(config: SimConfig) -> Row:
    failures = reference_failures(config)
    steps = [step for _, step in failures]
    return {
        "fast": " ".join(map(str, fast_run(config).failed[:6])),
        "reference": " ".join(str(block) for block, _ in failures),
        "steps_after_the_first": " ".join(str(step - steps[0]) for step in steps),
    }


def reference_failures(config: SimConfig, count: int = 6) -> list[tuple[int, int]]:
    """(block, step) of the first failures of different blocks on the reference engine, stepped singly."""
    lattice = lattice_of(config)
    drive = drive_of(config, lattice)
    start = 0.99 * first_failure_s(lattice, thresholds_of(config, lattice), drive, config.stiffness_N_m)
    run = r.reference_model(config, lattice, thresholds_of(config, lattice), start, 1, 1)
    work = np.zeros((10, *run.u.shape))
    found: dict[int, int] = {}
    step = 0
    while len(found) < count:
        r.integrate_all(run._replace(start=start + step * config.dt_s, stop_at_peaks=np.inf), 1, work)
        for block in run.failed[: int(run.sums[r.N_FAILED])]:
            found.setdefault(int(block), step)
        step += 1
    return list(found.items())[:count]


def convergence() -> Iterator[Task]:
    """Static and sliding friction of the fast engine at one step after another, the same thresholds."""
    for sample in ("F", "C", "Sx"):
        for seed in range(6):
            for dt_s in (1e-8, 2e-8, 5e-8, 1e-7):
                config = SimConfig(sample=sample, seed=seed, blocks=(48, 48), dt_s=dt_s, duration_peaks=2.5)
                config = config.with_(angle_deg=3.0 * seed - 7.5 if sample == "Sx" else 15.0 * seed + 7.5)
                yield (sample, seed, dt_s), lambda config=config: frictions_of(config)


def frictions_of(config: SimConfig) -> Row:
    run = simulate(config)
    return {"static": run.static_friction, "sliding": run.sliding_friction}


def energy() -> Iterator[Task]:
    """What is missing of the work of the slider, as a share of it, over one rupture of 24 x 24 blocks."""
    for sample in ("F", "C"):
        for engine, dt_s in (("fast", 1e-8), ("fast", 2e-8), ("fast", 5e-8), ("fast", 1e-7), ("reference", 1e-8)):
            config = SimConfig(sample=sample, blocks=(24, 24), angle_deg=15.0, seed=2, dt_s=dt_s, engine=engine)
            yield (sample, engine, dt_s), lambda config=config: missing_energy(config)


def missing_energy(config: SimConfig) -> Row:
    lattice = lattice_of(config)
    thresholds = thresholds_of(config, lattice)
    config = config.with_(duration_s=1.02 * run_fast(config, lattice, thresholds).peak_s)
    run = run_fast if config.engine == "fast" else run_reference
    return {"missing_share": energy_balance(config, lattice, run(config, lattice, thresholds)).residual}


PEAK_KEY = ("sample", "pressure_kPa", "angle_deg")
KEYS = {"peaks": PEAK_KEY, "sliding": ("sample", "seed"), "tolerance": (*PEAK_KEY, "rest_tolerance"), "order": PEAK_KEY}
KEYS |= {
    "itself": (*PEAK_KEY, "dt_s"), "convergence": ("sample", "seed", "dt_s"), "energy": ("sample", "engine", "dt_s"),
}
TASKS: dict[str, Callable[..., Iterator[Task]]] = {
    "peaks": peaks, "sliding": sliding, "tolerance": tolerance, "order": order, "itself": itself,
    "convergence": convergence, "energy": energy,
}  # fmt: skip


def resumed(path: Path, names: tuple[str, ...], tasks: Iterator[Task]) -> None:
    """Work off the tasks whose keys the file does not hold, writing it anew after each."""
    rows = pd.read_csv(path).to_dict("records") if path.exists() else []
    done = {tuple(row[name] for name in names) for row in rows}
    for key, work in tasks:
        if key in done:
            continue
        rows.append(dict(zip(names, key, strict=True)) | work())
        print(*rows[-1].values(), flush=True)
        pd.DataFrame(rows).to_csv(path, index=False, float_format="%.6g")


if __name__ == "__main__":
    what, path, *further = sys.argv[1:]
    resumed(Path(path), KEYS[what], TASKS[what](*further))
