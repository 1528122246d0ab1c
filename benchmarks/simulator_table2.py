"""What the choices that the paper's text leaves open do to its Table 2 (docs/results/table2-recomputed.md).

    tribo simulate --table2 -o table2.nc
    python benchmarks/simulator_table2.py column table2.nc docs/data data/berardo2019
    python benchmarks/simulator_table2.py study FOLDER docs/data [jobs]

``column`` writes the column of the 960 runs of the command before it to docs/data/table2.csv and to the bundled
table2_tribo.csv, and prints the rows of the page. ``study`` makes nine variants of six samples, three pressures and
four runs each, at dt = 1e-7 s and with cavities resting below 1e-2: a quarter of the time, the same static friction,
sliding friction 0.5 % higher. FOLDER keeps every run, and a second start goes on where the first was stopped.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

from table2_readings import combinations, run_study, study_designs

from tribo.berardo2019.published_tables import beside, distance, load_table2
from tribo.springblock import SimConfig, read_stored
from tribo.springblock.calibration import fitted

BASE = SimConfig(dt_s=1e-7, rest_tolerance=1e-2)


def said(done: int, total: int) -> None:
    if done % 20 == 0 or done == total:
        print(f"{time.strftime('%H:%M:%S')} {done} of {total}", flush=True)


def study(folder: str, out: str, jobs: str = "2") -> None:
    Path(folder).mkdir(parents=True, exist_ok=True)
    fits, distances = combinations(run_study(folder, study_designs(BASE), jobs=int(jobs), progress=said), load_table2())
    for name, table in (("table2-study", fits), ("table2-distances", distances)):
        table.to_csv(Path(out) / f"{name}.csv", index=False, float_format="%.5g")
    for regime, table in distances.groupby("regime", sort=False):
        print(regime, table.sort_values("rms_percent").drop(columns="regime").head(12).to_string(index=False), sep="\n")


def column(store: str, out: str, bundled: str) -> None:
    table = beside(fitted(read_stored(store)), load_table2())
    table.to_csv(Path(out) / "table2.csv", index=False, float_format="%.5g")
    own = table[["sample", "regime", "mu", "mu_se", "tau0_kPa", "tau0_kPa_se"]]
    own.to_csv(Path(bundled) / "table2_tribo.csv", index=False, float_format="%.5g")
    for r in table.itertuples(index=False):
        mu = f"{r.mu:.3f} +- {r.mu_se:.3f} | {r.mu_paper:.3f} | {r.mu_deviation_percent:+.1f}"
        tau0 = f"{r.tau0_kPa:.2f} +- {r.tau0_kPa_se:.2f} | {r.tau0_kPa_paper:.2f} | {r.tau0_deviation_percent:+.1f}"
        print(f"| {r.sample} {r.regime} | {mu} | {tau0} | {r.friction_deviation_percent:+.1f} |")
    print(distance(table))


if __name__ == "__main__":
    {"study": study, "column": column}[sys.argv[1]](*sys.argv[2:])
