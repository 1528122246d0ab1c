"""Campaigns with hidden effects in full: power against size, confusion, false alarms, coverage.

    python benchmarks/blind.py --campaigns 6 --seed 1 --jobs 2 --out docs/blind.json

Every campaign is written to disk as raw exports by the virtual tribometer of tests/blind and read back through
the whole chain; the diagnosis sees only the files. Nothing here is used to tune it.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # the processes share the cores, not each product
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

import numpy as np
from blind.tribometer import EFFECTS, Design, hide, write

SIZES = (0.4, 0.7, 1.0)
LADDER = {"velocity_dependence": {"speeds_mm_s": (0.05, 0.2, 0.8)}, "contact_ageing": {"holds_s": (1.0, 10.0, 300.0)}}
TIED = {"suction": {"suction", "normal_load_error"}, "normal_load_error": {"suction", "normal_load_error"}}
PAIRS = (
    ("suction", "run_in"), ("run_in", "temperature"), ("pressure_dependent_friction", "covariate:operator"),
    ("contact_area_loss", "velocity_dependence"),
)  # fmt: skip
# the amplitude that stands for size 1 in tribometer.py, where the library has the same parameter
TRUTH = {
    "suction": ("dp", 5000.0), "pressure_dependent_friction": ("n", 0.2), "velocity_dependence": ("a", 0.06),
    "contact_ageing": ("b", 0.035), "run_in": ("c", 0.25), "temperature": ("c", 0.06),
    "normal_load_error": ("dN", 0.12),
}  # fmt: skip


def clean_design(seed: int) -> Design:
    """Designs, noise, gaps and tails as they come."""
    rng = np.random.default_rng(seed)
    sets = (("F", "A", "B", "C", "Sx", "Sy"), ("F", "A", "B", "C"), ("F", "B", "C", "Sx", "Sy"))
    scale = rng.uniform(0.5, 1.4)
    return Design(
        samples=sets[rng.integers(3)], specimens=int(rng.integers(3, 5)), repeats=int(rng.integers(1, 4)),
        speeds_mm_s=((0.2,), (0.05, 0.2, 0.8))[rng.integers(2)], holds_s=((10.0,), (1.0, 10.0, 300.0))[rng.integers(2)],
        repeat_sd=(0.09 * scale, 0.07 * scale), specimen_sd=float(rng.uniform(0.03, 0.07)),
        tail=float(rng.choice([np.inf, 4.0])), missing=float(rng.choice([0.0, 0.15])),
    )  # fmt: skip


def cases(campaigns: int, clean: int, seed: int) -> Iterator[tuple[int, tuple[tuple[str, float], ...], Design]]:
    """Clean campaigns, then each effect at each size, then pairs."""
    for k in range(clean):
        yield seed * 100_000 + k, (), clean_design(seed * 100_000 + k)
    number = seed * 100_000 + 10_000
    for name in EFFECTS:
        for size in SIZES:
            for _ in range(campaigns):
                number += 1
                yield number, ((name, size),), Design(**LADDER.get(name, {}))
    for pair in PAIRS:
        for _ in range(campaigns):
            number += 1
            ladders = {k: v for name in pair for k, v in LADDER.get(name, {}).items()}
            yield number, tuple((name, 1.0) for name in pair), Design(**ladders)


def one(case: tuple[int, tuple[tuple[str, float], ...], Design]) -> dict[str, Any]:
    """Hide, write, read, diagnose."""
    from tribo.campaign import load_campaign
    from tribo.diagnose import examine
    from tribo.stages import ingest

    seed, effects, design = case
    with tempfile.TemporaryDirectory() as folder:
        path = write(hide(seed, list(effects), design), Path(folder) / "campaign", seed)
        v = examine(ingest(load_campaign(path)), seed=seed).verdict
    intervals = {c.mechanism: {n: (e.low, e.value, e.high) for n, e in c.parameters.items()} for c in v.causes}
    return {
        "seed": seed, "effects": effects, "verdict": v.verdict, "causes": sorted({c.mechanism for c in v.causes}),
        "covariate": v.misfits[0].covariate if v.misfits else "", "intervals": intervals,
    }  # fmt: skip


def expected(effects: tuple[tuple[str, float], ...]) -> set[str]:
    """Mechanisms a right answer may hold: what was hidden and what cannot be told from it."""
    return set().union(*(TIED.get(name, {name}) for name, _ in effects)) if effects else set()


def right(row: dict[str, Any]) -> bool:
    """Named every hidden cause and nothing else; unknown for what is outside; nothing where nothing is."""
    names = {name for name, _ in row["effects"]}
    if not names:
        return row["verdict"] == "no_misfit"
    if any(name.startswith("outside") for name in names):
        return row["verdict"] == "unknown"
    causes = set(row["causes"])
    all_found = all(causes & TIED.get(name, {name}) for name in names)
    return row["verdict"] == "named" and all_found and causes <= expected(row["effects"])


def wrong(row: dict[str, Any]) -> bool:
    """Named something that was not hidden."""
    return row["verdict"] == "named" and not set(row["causes"]) <= expected(row["effects"])


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Rates by effect and size, false alarms, the confusion matrix, and coverage of the 90 % intervals."""
    clean = [r for r in rows if not r["effects"]]
    groups: dict[str, list[dict[str, Any]]] = {}
    for r in rows:
        if r["effects"]:
            groups.setdefault(" + ".join(f"{n} x {s:g}" for n, s in r["effects"]), []).append(r)
    held = [h for r in rows for h in _held(r)]
    return {
        "clean": len(clean),
        "false_alarms": sum(r["verdict"] != "no_misfit" for r in clean),
        "false_causes": sum(bool(r["causes"]) for r in clean),
        "effects": {
            name: {
                "campaigns": len(g), "misfit": sum(r["verdict"] != "no_misfit" for r in g),
                "right": sum(map(right, g)), "wrong": sum(map(wrong, g)),
                "answers": dict(Counter(f"{r['verdict']}: {', '.join(r['causes'])}" for r in g)),
            }
            for name, g in groups.items()
        },
        "intervals": len(held), "coverage": sum(held) / max(len(held), 1),
    }  # fmt: skip


def _held(row: dict[str, Any]) -> list[bool]:
    """Whether the 90 % interval of each recovered amplitude holds the one that was hidden."""
    found = []
    for name, size in row["effects"]:
        key, unit = TRUTH.get(name, ("", 0.0))
        interval = row["intervals"].get(name, {}).get(key)
        if interval is not None and len(row["effects"]) == 1:
            found.append(interval[0] <= unit * size <= interval[2])
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--campaigns", type=int, default=6, help="per effect and size")
    parser.add_argument("--clean", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=None, help="only so many of the shuffled campaigns")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", type=Path, default=None, help="where the rows and the summary go, as JSON")
    options = parser.parse_args()
    rows = []
    todo = list(cases(options.campaigns, options.clean, options.seed))
    np.random.default_rng(options.seed).shuffle(todo)  # so that a part of the run is a fair sample of it
    if options.first is not None:
        todo = todo[: options.first]
    with ProcessPoolExecutor(options.jobs) as pool:
        for row in pool.map(one, todo):
            rows.append(row)
            print(row["seed"], row["effects"], row["verdict"], row["causes"], flush=True)
    found = summary(rows)
    print(json.dumps(found, indent=2))
    if options.out is not None:
        options.out.write_text(json.dumps({"seed": options.seed, "summary": found, "rows": rows}, indent=1))


if __name__ == "__main__":
    main()
