"""Programmes of a virtual tribometer: every kind on many seeds, and records that drift, beside what was read.

    python benchmarks/programmes.py --seeds 50 --first 5000 --jobs 2 > programmes.json

The reading was tuned on seeds from 1000 to 3009; docs/results/programmes.md reports others.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections import Counter
from functools import partial
from multiprocessing import get_context
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

import numpy as np
from programmes.exam import Seen, sat, summary
from programmes.kinds import KINDS, disc

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


if __name__ == "__main__":
    options = argparse.ArgumentParser()
    options.add_argument("--seeds", type=int, default=50)
    options.add_argument("--first", type=int, default=5000)
    options.add_argument("--jobs", type=int, default=1)
    given = options.parse_args()
    seeds = range(given.first, given.first + given.seeds)
    with get_context("spawn").Pool(given.jobs) as pool:
        seen = [s for all_ in pool.map(partial(one_kind, seeds=seeds), list(KINDS), chunksize=1) for s in all_]
    found = summary(seen)
    kinds = found["kinds"].values()
    total = {name: int(np.sum([kind[name] for kind in kinds])) for name in next(iter(kinds))}
    drift = drifting(range(given.first, given.first + given.seeds))
    print(json.dumps({"total": total, "drifting": drift, **found}, indent=1))
    for said in [f"{s.kind} {s.seed}: {why}" for s in seen for why in (*s.missed, *s.extra)][:400]:
        print(said, file=sys.stderr)
