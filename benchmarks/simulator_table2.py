"""What the choices that the paper's text leaves open do to its Table 2 (docs/table2.md).

    python benchmarks/simulator_table2.py FOLDER docs/data [jobs]

Ten variants of six samples, four pressures and eight runs each at dt = 5e-8 s (cavities resting below 1e-2, which
saves a third of the time and leaves the means where they are); FOLDER keeps every run, and a second start goes on
where the first was stopped. The column itself is ``tribo simulate --table2 -o FILE.nc``.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

from tribo.published import load_table2
from tribo.simulate import SimConfig
from tribo.simulate.study import combinations, run_study

BASE = SimConfig(rest_tolerance=1e-2)


def said(done: int, total: int) -> None:
    if done % 20 == 0 or done == total:
        print(f"{time.strftime('%H:%M:%S')} {done} of {total}", flush=True)


def main(folder: str, out: str, jobs: str = "2") -> None:
    Path(folder).mkdir(parents=True, exist_ok=True)
    fits, distances = combinations(run_study(folder, BASE, jobs=int(jobs), progress=said), load_table2())
    for name, table in (("table2-study", fits), ("table2-distances", distances)):
        table.to_csv(Path(out) / f"{name}.csv", index=False, float_format="%.5g")
    for regime, table in distances.groupby("regime", sort=False):
        print(regime, table.sort_values("rms_percent").drop(columns="regime").head(12).to_string(index=False), sep="\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
