"""The numerical column of Table 2, and the study of what the text leaves open.

    python benchmarks/simulator_table2.py all STORE.h5 docs/data/table2.csv [jobs [dt_s]]
    python benchmarks/simulator_table2.py study FOLDER docs/data/table2-study.csv

``all`` makes the 960 runs of the paper at dt = 5e-8 s; STORE.h5 keeps every run, and a second start goes on where
the first was stopped. ``study`` makes fewer runs a variant at dt = 1e-7 s.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import pandas as pd

from tribo.published import load_table2
from tribo.simulate import SimConfig
from tribo.simulate.tables import STUDY, distance, study, table2

QUICK = {"repeats": 3, "pressures_Pa": (3e3, 10e3, 25e3)}


def said(done: int, total: int) -> None:
    if done % 20 == 0 or done == total:
        print(f"{time.strftime('%H:%M:%S')} {done} of {total}", flush=True)


def main(what: str, place: str, out: str, jobs: int = 2, dt_s: float = 5e-8) -> None:
    if what == "all":
        base = SimConfig(dt_s=dt_s, rest_tolerance=5e-3 if dt_s <= 5e-8 else 1e-2)
        table = table2(base, path=place, published=load_table2(), jobs=jobs, progress=said)
        print(table.to_string(), distance(table))
    else:
        Path(place).mkdir(parents=True, exist_ok=True)
        base = SimConfig(dt_s=1e-7, rest_tolerance=1e-2)
        table = study(load_table2(), STUDY, base, place, jobs=jobs, **QUICK)
        summary = {name: distance(rows) for name, rows in table.groupby("variant", sort=False)}
        print(pd.DataFrame(summary).T.to_string())
    table.to_csv(out, index=False, float_format="%.5g")


if __name__ == "__main__":
    jobs, dt_s = [*sys.argv[4:6], *("2", "5e-8")[len(sys.argv[4:6]) :]]
    main(*sys.argv[1:4], jobs=int(jobs), dt_s=float(dt_s))
