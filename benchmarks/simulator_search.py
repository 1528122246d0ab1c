"""Search for the reading of the paper that gives its simulated column of Table 2 (docs/results/table2-search.md).

    python benchmarks/simulator_search.py runs FOLDER [VARIANT ...]
    python benchmarks/simulator_search.py table FOLDER docs/data
    python benchmarks/simulator_search.py rules docs/data
    python benchmarks/simulator_search.py mesh docs/data

``runs`` keeps force against time of every run in FOLDER, at dt = 1e-7 s and with cavities resting below 1e-2, and goes
on where it was stopped; ``table`` reads every window off them. ``rules`` runs the rules of rest of the reference engine
on 12 x 12 blocks at the paper's time step. ``mesh`` compares the found reading on half the mesh and on larger lattices.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from table2_readings import mean_between

from tribo.berardo2019.published_tables import load_table2
from tribo.records import FloatArray
from tribo.springblock import SimConfig, simulate

SPREAD = {"F": (10.0,), "A": (11.25, 33.75), "B": (11.25, 33.75), "C": (11.25, 33.75), "Sx": (5.0,), "Sy": (85.0,)}
NOMINAL = {"F": (10.0,), "A": (0.0,), "B": (0.0,), "C": (0.0,), "Sx": (0.0,), "Sy": (90.0,)}
WINDOWS = {"1.02 to 2": (1.02, 2.0), "1.05 to 2": (1.05, 2.0), "1.05 to 3": (1.05, 3.0), "2 to 3": (2.0, 3.0)}
ENTRIES = ("static", *WINDOWS)


class Variant(NamedTuple):
    """Thickness of the layer in units of l, share of strength regained, whether all pulls are nominal."""

    layer: float
    share: float
    nominal: bool
    seeds: int = 1


VARIANTS = {
    "lz1,s0.3": Variant(1.0, 0.3, False),
    "lz1.41,s0.3": Variant(2.0**0.5, 0.3, False),
    "lz2,s0.3": Variant(2.0, 0.3, False),
    "nom,lz1.4,s0.3": Variant(1.4, 0.3, True),
    "nom,lz1.7,s0.3": Variant(1.7, 0.3, True, 2),
    "nom,lz1.7,s0.5": Variant(1.7, 0.5, True),
    "nom,lz2,s0.3": Variant(2.0, 0.3, True),
}
RULES: dict[str, dict[str, Any]] = {
    "turned": {},
    "never": {"sticking": "never"},
    "slow 0.2 mm/s": {"sticking": "slow", "stick_speed_m_s": 2e-4},
    "slow 20 mm/s": {"sticking": "slow", "stick_speed_m_s": 2e-2},
    "slow 2 mm/s": {"sticking": "slow", "stick_speed_m_s": 2e-3},
    "slow 5 mm/s": {"sticking": "slow", "stick_speed_m_s": 5e-3},
    "tested every 0.2 us": {"stick_interval_s": 2e-7},
    "tested every 0.5 us": {"stick_interval_s": 5e-7},
    "tested every 1 us": {"stick_interval_s": 1e-6},
    "tested every 2 us": {"stick_interval_s": 2e-6},
    "tested every 10 us": {"stick_interval_s": 1e-5},
}


def cases(name: str, pressures_kPa: tuple[float, ...]) -> Iterator[tuple[str, SimConfig]]:
    """File name and configuration of every run of a variant."""
    variant = VARIANTS[name]
    base = SimConfig(
        thickness_m=variant.layer * 5e-6, restrengthening=variant.share, dt_s=1e-7, rest_tolerance=1e-2,
        sample_interval_s=2e-6,
    )  # fmt: skip
    angles = NOMINAL if variant.nominal else SPREAD
    for p, (sample, pulls) in product(pressures_kPa, angles.items()):
        for angle, k in product(pulls, range(variant.seeds)):
            seed = int(p * 7) + 1 + k if variant.nominal else int(p * 7 + angle)
            config = base.with_(sample=sample, pressure_Pa=1e3 * p, angle_deg=angle, seed=seed)
            yield f"{name}_{sample}_{p:g}_{angle:g}_{seed}.npz", config


def runs(folder: str, *names: str) -> None:
    Path(folder).mkdir(parents=True, exist_ok=True)
    for name in names or VARIANTS:
        for file, config in cases(name, (10.0, 3.0, 25.0)):
            if not (Path(folder) / file).exists():
                run = simulate(config)
                friction = run.force_N / run.normal_load_N
                np.savez(Path(folder) / file, t=run.time_s, y=friction, peak=run.static_friction, tp=run.peak_s)
                print(file, flush=True)


def entries(path: Path) -> dict[str, float]:
    """Static friction of a kept run, and its sliding friction in every window."""
    with np.load(path) as run:
        time, friction, peak_s = run["t"], run["y"], float(run["tp"])
        found = {"static": float(run["peak"])}
    for window, (start, end) in WINDOWS.items():
        found[window] = mean_between(time, friction, start * peak_s, min(end * peak_s, float(time[-1])))
    return found


def printed(sample: str, entry: str, pressure_kPa: float) -> float:
    """T/N of the paper's own simulation."""
    regime = "static" if entry == "static" else "sliding"
    table = load_table2().query("source == 'simulation'").set_index(["sample", "regime"])
    return float(table.loc[(sample, regime), "mu"] + table.loc[(sample, regime), "tau0_kPa"] / pressure_kPa)


def table(folder: str, out: str) -> None:
    rows = []
    for name, variant in VARIANTS.items():
        made = [(config, Path(folder) / file) for file, config in cases(name, (3.0, 10.0, 25.0))]
        kept = [(c, f) for c, f in made if f.exists()]
        found = pd.DataFrame([{"sample": c.sample, "p_kPa": c.pressure_Pa / 1e3} | entries(f) for c, f in kept])
        for (sample, p), group in found.groupby(["sample", "p_kPa"], sort=False) if len(found) else ():
            of = {"variant": name} | variant._asdict() | {"sample": sample, "pressure_kPa": p, "runs": len(group)}
            off = {e: 100.0 * (group[e].mean() / printed(sample, e, p) - 1.0) for e in ENTRIES}
            rows.append(of | off)
    found = pd.DataFrame(rows)
    found.to_csv(Path(out) / "table2-search.csv", index=False, float_format="%.3g")
    grouped = found.groupby(["variant", "pressure_kPa"], sort=False)[list(ENTRIES)]
    rms = grouped.agg(lambda off: float(np.sqrt((off**2).mean())))
    print(rms.round(2).to_string())
    print(found.round(1).to_string(index=False))


def rules(out: str) -> None:
    rows = []
    for (rule, changes), (sample, angle) in product(RULES.items(), (("F", 10.0), ("C", 22.5))):
        config = SimConfig(
            sample=sample, pressure_Pa=3e3, angle_deg=angle, seed=1, blocks=(12, 12), edges="periodic",
            engine="reference", dt_s=1e-8, duration_peaks=2.0, window_start_peaks=1.5, sample_interval_s=2e-6,
            **changes,
        )  # fmt: skip
        run = simulate(config)
        steady = 2.9 + 11.6 * run.parameters["area_fraction"] / 3.0
        after: FloatArray = run.time_s > 1.5 * run.peak_s
        rows.append(
            {"rule": rule, "sample": sample, "sliding_over_sum_percent": 100 * (run.sliding_friction / steady - 1)}
            | {"share_moving": run.moving[after].mean() / (144 * run.parameters["area_fraction"])}
        )
        print(rows[-1], flush=True)
    pd.DataFrame(rows).to_csv(Path(out) / "table2-rules.csv", index=False, float_format="%.3g")


LATTICES = {"85, 5 um": (5e-6, 85), "170, 2.5 um": (2.5e-6, 170), "170, 5 um": (5e-6, 170), "340, 5 um": (5e-6, 340)}


def mesh(out: str) -> None:
    rows = []
    for sample, (name, (spacing_m, blocks)) in product(NOMINAL, LATTICES.items()):
        config = SimConfig(
            sample=sample, pressure_Pa=3e3, angle_deg=NOMINAL[sample][0], seed=5, duration_peaks=1.5,
            rest_tolerance=1e-2, sample_interval_s=2e-6, dt_s=0.01 * spacing_m,
        )  # fmt: skip
        run = simulate(config.of_reading("berardo2019").with_(spacing_m=spacing_m, blocks=(blocks, blocks)))
        of = {"sample": sample, "lattice": name, "blocks": blocks, "spacing_um": 1e6 * spacing_m}
        rows.append(of | {"static": run.static_friction, "sliding": run.sliding_friction})
        print(rows[-1], flush=True)
    pd.DataFrame(rows).to_csv(Path(out) / "table2-mesh.csv", index=False, float_format="%.5g")


if __name__ == "__main__":
    {"runs": runs, "table": table, "rules": rules, "mesh": mesh}[sys.argv[1]](*sys.argv[2:])
