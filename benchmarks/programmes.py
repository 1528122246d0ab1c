"""Programmes of a virtual tribometer: every kind on many seeds, and records that drift, beside what was read.

    python benchmarks/programmes.py --seeds 50 --first 5000 --jobs 2 > programmes.json
    python benchmarks/programmes.py --seeds 4 --first 2000 --sweep --kinds "force only" > programmes-constants.csv

``--sweep`` halves and doubles every constant of the phases and counts the boundaries that are missed, and found where
none is.

The reading was tuned on seeds from 1000 to 3009; docs/results/programmes.md reports others.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from functools import partial
from multiprocessing import get_context
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

import numpy as np
from programmes.exam import Seen, boundaries, sat, summary, written
from programmes.kinds import KINDS, disc

from tribo.errors import TriboError
from tribo.readers import read_export
from tribo.traces import cuts, drive, loading, phases, phases_of

DRIFTS = (0.03, 0.05, 0.1, 0.2, 0.5)  # share by which friction changes over the record


def one_kind(kind: str, seeds: range) -> list[Seen]:
    with tempfile.TemporaryDirectory() as folder:
        return sat([kind], seeds, Path(folder) / "campaign")


def drifting(seeds: range) -> Counter[str]:
    """The states of discs whose friction drifts along a line, up or down, to the last sample."""
    states: Counter[str] = Counter()
    for drift in DRIFTS:
        for sign in (1.0, -1.0):
            KINDS["drift"] = partial(disc, "drift", "S", drift=sign * drift)
            states.update(seen.state or "none" for seen in one_kind("drift", seeds))
            del KINDS["drift"]
    return states


def swept(kinds: list[str], seeds: range) -> Iterator[tuple[str, float, float, int, int]]:
    """Name and value of every constant of the phases, the factor on it, and boundaries missed and extra."""
    with tempfile.TemporaryDirectory() as folder:
        records = [(kind, seed, KINDS[kind](np.random.default_rng([seed, 7]))) for kind in kinds for seed in seeds]
        written([record for *_, record in records], Path(folder) / "campaign")
        traces = []
        for k, (kind, seed, record) in enumerate(records):
            try:
                traces.append((kind, seed, record, read_export(Path(folder) / "campaign" / "raw" / f"T{k}.csv")))
            except TriboError:
                continue  # a reader sets it aside, whatever the constants

    def counted() -> tuple[int, int]:
        missed = extra = 0
        for kind, seed, record, trace in traces:
            seen = Seen(kind, seed)
            try:
                boundaries(seen, record, phases_of(trace))
            except TriboError:
                boundaries(seen, record, ())
            missed, extra = missed + len(seen.missed), extra + len(seen.extra)
        return missed, extra

    yield "none", 0.0, 1.0, *counted()
    for module in (phases, drive, loading, cuts):
        for name, value in vars(module).items():
            own = re.search(rf"^{name} = ", Path(str(module.__file__)).read_text(), re.MULTILINE)
            if name.startswith("_") and name.isupper() and own and isinstance(value, float | int):
                for factor in (0.5, 2.0):
                    tried = type(value)(value * factor)
                    setattr(module, name, tried)
                    yield f"{module.__name__.rpartition('.')[2]}.{name}", value, factor, *counted()
                setattr(module, name, value)


if __name__ == "__main__":
    options = argparse.ArgumentParser()
    options.add_argument("--seeds", type=int, default=50)
    options.add_argument("--first", type=int, default=5000)
    options.add_argument("--jobs", type=int, default=1)
    options.add_argument("--sweep", action="store_true")
    options.add_argument("--kinds", default="", help="of the sweep: those whose names hold this")
    given = options.parse_args()
    seeds = range(given.first, given.first + given.seeds)
    if given.sweep:
        print("constant,value,factor,missed,extra")
        for row in swept([kind for kind in KINDS if given.kinds in kind], seeds):
            print(*row, sep=",", flush=True)
        sys.exit()
    with get_context("spawn").Pool(given.jobs) as pool:
        seen = [s for all_ in pool.map(partial(one_kind, seeds=seeds), list(KINDS), chunksize=1) for s in all_]
    found = summary(seen)
    kinds = found["kinds"].values()
    total = {name: int(np.sum([kind[name] for kind in kinds])) for name in next(iter(kinds))}
    drift = drifting(range(given.first, given.first + given.seeds))
    print(json.dumps({"total": total, "drifting": drift, **found}, indent=1))
    for said in [f"{s.kind} {s.seed}: {why}" for s in seen for why in (*s.missed, *s.extra)][:400]:
        print(said, file=sys.stderr)
