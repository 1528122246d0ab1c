"""Make data/pattern_shares: what the model makes of each pattern of the paper, and how wrong it may be about it.

    python benchmarks/pattern_shares.py laws out/pattern-shares.h5 data/pattern_shares [jobs]
    python benchmarks/pattern_shares.py errors docs/data data/pattern_shares

``laws`` makes the 960 runs of the table (those of ``tribo simulate --table2``) into a store, where a second start goes
on, and writes runs.csv and laws.csv. ``errors`` writes errors.csv from these and from the tables that
``simulator_table2.py study`` and ``simulator_size.py mesh`` and ``domain`` left in docs/data; every single case goes to
docs/data/pattern-errors.csv.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
import pattern_error
from pattern_laws import KEPT, origin, pattern_laws, write_table

from tribo.berardo2019.published_tables import table2_design
from tribo.diagnostics.predictor import flat_law, simulated_patterns
from tribo.kept_results import sources
from tribo.springblock import run_stored

SEED = 0
COMMAND = "python benchmarks/pattern_shares.py"
ENGINE = tuple(f"springblock/{name}" for name in ("engines", "config", "ensemble", "lattice", "run"))


def said(done: int, total: int) -> None:
    if done % 40 == 0 or done == total:
        print(f"{time.strftime('%H:%M:%S')} {done} of {total}", flush=True)


def laws(store: str, out: str, jobs: str = "2") -> None:
    design = table2_design(seed=SEED)
    Path(store).parent.mkdir(parents=True, exist_ok=True)
    runs = run_stored(design, store, int(jobs), progress=said)[list(KEPT)]
    words = {"made by": f"{COMMAND} laws"} | origin(design, SEED, sources(*ENGINE))
    write_table(runs, Path(out) / "runs.csv", words, digits="%.8g")
    write_table(pattern_laws(runs), Path(out) / "laws.csv", words)


def cases(data: Path, out: Path) -> Iterator[pattern_error.Case]:
    mesh = pd.read_csv(data / "simulator-mesh.csv")
    yield from pattern_error.of_readings(pd.read_csv(data / "table2-study.csv"))
    yield from pattern_error.of_mesh(mesh)
    yield from pattern_error.of_domain(pd.read_csv(data / "simulator-domain.csv"), mesh)
    yield from pattern_error.of_form(pd.read_csv(out / "runs.csv", comment="#"))
    yield from pattern_error.of_interpolation(simulated_patterns(), np.array(flat_law()))


def errors(data: str, out: str) -> None:
    found = list(cases(Path(data), Path(out)))
    left_out = "; ".join(f"{name} ({why})" for name, why in pattern_error.NOT_ADMITTED.items())
    words = {
        "made by": f"{COMMAND} errors",
        "columns": "standard deviations of ln T; slope per e-fold of pressure, curve per squared e-fold",
        "left out": left_out,
        "reading of the paper": "text, and the variants of it that docs/data/table2-study.csv holds",
    }
    table = pattern_error.sizes(found)
    write_table(table, Path(out) / "errors.csv", words, digits="%.4g")
    pd.DataFrame(found).to_csv(Path(data) / "pattern-errors.csv", index=False, float_format="%.4g")
    print(table.to_string(index=False))
    print(shared(pd.DataFrame(found)).to_string(index=False))


def shared(cases: pd.DataFrame) -> pd.DataFrame:
    """How far the offsets of different patterns go together over the cases of a source that have all patterns.

    ``common`` is the mean product of two patterns' offsets over the mean square of one: 1 where all move alike.
    """
    rows = []
    for (source, regime), part in cases[cases["source"].isin(["readings", "mesh"])].groupby(["source", "regime"]):
        offsets = part.pivot(index="case", columns="sample", values="offset").dropna().to_numpy()
        products = offsets.T @ offsets
        n = len(products)
        others = (products.sum() - np.trace(products)) / (n * (n - 1))
        rows.append({"source": source, "regime": regime, "common": others / (np.trace(products) / n)})
    return pd.DataFrame(rows)


if __name__ == "__main__":
    {"laws": laws, "errors": errors}[sys.argv[1]](*sys.argv[2:])
