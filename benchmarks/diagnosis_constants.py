"""What the constants of the diagnosis decide: each halved and doubled on one fixed set of campaigns.

    python benchmarks/diagnosis_constants.py run out/constants.jsonl      one line a campaign and variant, resumable
    python benchmarks/diagnosis_constants.py table out/constants.jsonl    docs/data/diagnosis-constants.csv

The campaigns come from the generator of tests/blind with seeds of their own (SEED), which no reported figure uses. A
constant that acts only once a misfit is seen is varied on the campaigns with an effect; the others on all.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # the processes share the cores, not each product

import argparse
import csv
import json
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from blind_cases import Case, answer, clean_design, design_for, seed_of

DOCS = Path(__file__).resolve().parents[1] / "docs"
SEED = 7_700
CLEAN, LARGE_ERROR = 5, 3
REPLICATES = (60, 30)
# clear effects, about one and a half times what the promises are made for
EFFECTS = {
    "suction": 1.7, "normal_load_error": 3.7, "pressure_dependent_friction": 2.0, "contact_area_loss": 1.0,
    "run_in": 2.0, "edge_adhesion": 2.1, "pattern_geometry": 1.9, "cavity_shear_deformation": 1.9,
    "mislabelled_specimen": 1.0, "load_cell_offset": 0.05,
}  # fmt: skip
Value = Any


def _times(value: Value, factor: float) -> Value:
    return factor * value


def _row(row: int, column: int) -> Callable[[Value, float], Value]:
    def changed(value: Value, factor: float) -> Value:
        table = np.array(value, float)
        table[row, column] *= factor
        return table

    return changed


def _first(value: Value, factor: float) -> Value:
    return (factor * value[0], *value[1:])


def _second(value: Value, factor: float) -> Value:
    return (value[0], factor * value[1], *value[2:])


@dataclass(frozen=True)
class Constant:
    """Where a constant lives (modules that hold it by this name), how it is changed, on which campaigns it acts."""

    modules: tuple[str, ...]
    attribute: str
    change: Callable[[Value, float], Value] = _times
    on_clean: bool = False


CANDIDATES, CONTRASTS, NOISE, EVIDENCE = (
    f"tribo.diagnostics.{name}" for name in ("candidates", "contrasts", "scatter", "direct_evidence")
)
CONSTANTS = {
    "TIED (log likelihood)": Constant((CANDIDATES,), "TIED", _first),
    "TIED (share of the gain)": Constant((CANDIDATES,), "TIED", _second),
    "CLOSE": Constant((CANDIDATES,), "CLOSE"),
    "IN_COMMON": Constant((CANDIDATES,), "IN_COMMON"),
    "FORM": Constant((CONTRASTS,), "FORM"),
    "PER_PARAMETER": Constant((CANDIDATES,), "PER_PARAMETER"),
    "CERTAIN": Constant((EVIDENCE,), "CERTAIN", on_clean=True),
    "specimen gain, expected": Constant((NOISE,), "SIZE_PRIORS", _row(0, 0), on_clean=True),
    "specimen slope, expected": Constant((NOISE,), "SIZE_PRIORS", _row(2, 0), on_clean=True),
    "specimen slope, worth": Constant((NOISE,), "SIZE_PRIORS", _row(2, 1), on_clean=True),
    "pattern factor, worth": Constant((NOISE,), "SIZE_PRIORS", _row(4, 1), on_clean=True),
    "REPEAT_PRIOR (expected)": Constant((NOISE,), "REPEAT_PRIOR", _first, on_clean=True),
    "SCATTER_SD": Constant((NOISE,), "SCATTER_SD", on_clean=True),
}


def campaigns() -> Iterator[Case]:
    """The fixed set: clean ones, clean ones with three times the pattern error, and one of each effect."""
    for k in range(CLEAN):
        number = seed_of(SEED, "clean", k)
        yield Case("clean", number, (), clean_design(number))
    for k in range(LARGE_ERROR):
        number = seed_of(SEED, "large error", k)
        yield Case("pattern error 3", number, (), replace(clean_design(number), pattern_error=3.0))
    for name, size in EFFECTS.items():
        design = design_for(name, pattern_error=1.5, specimen_slope=0.04)
        yield Case(name, seed_of(SEED, name, 0), ((name, size),), design)


def outcome(row: dict[str, Any]) -> str:
    """right, wrong, undetermined, unknown or nothing; for a clean campaign nothing, misfit or wrong."""
    hidden = {name for name, _ in row["effects"]}
    named = {name for cause in row["causes"] for name in cause}
    if row["verdict"] == "no_misfit":
        return "nothing"
    if row["verdict"] == "unknown":
        return "unknown" if hidden else "misfit"
    if not hidden <= named or not hidden:
        return "wrong"
    tied = any(hidden <= set(cause) for cause in row["causes"])
    return "right" if row["verdict"] == "named" and tied and len(row["causes"]) == 1 else "undetermined"


def with_constant(c: Constant, factor: float) -> ExitStack:
    """A context in which the constant is ``factor`` times itself."""
    stack = ExitStack()
    for name in c.modules:
        module = import_module(name)
        stack.enter_context(patch.object(module, c.attribute, c.change(getattr(module, c.attribute), factor)))
    return stack


def run(path: Path) -> None:
    """Every campaign as it is, and under every constant halved and doubled."""
    done = {(r["constant"], r["factor"], r["seed"]) for r in _rows(path)}
    for name, c, factor in [("", None, 1.0), *((n, c, f) for n, c in CONSTANTS.items() for f in (0.5, 2.0))]:
        for case in campaigns():
            if (name, factor, case.seed) in done or (c is not None and not case.effects and not c.on_clean):
                continue
            with with_constant(c, factor) if c is not None else ExitStack():
                row = answer(case, REPLICATES)
            with path.open("a") as file:
                file.write(json.dumps({"constant": name, "factor": factor, **row, "outcome": outcome(row)}) + "\n")


def _rows(path: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []


def table(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Counts by constant and factor, and on how many campaigns the outcome is that of the constants as they are."""
    plain = {r["seed"]: r["outcome"] for r in rows if not r["constant"]}
    found = []
    for name in ("", *CONSTANTS):
        for factor in (1.0,) if not name else (0.5, 2.0):
            here = [r for r in rows if r["constant"] == name and r["factor"] == factor]
            for kind in ("effect", "clean"):
                part = [r for r in here if bool(r["effects"]) == (kind == "effect")]
                if part:
                    counts = Counter(r["outcome"] for r in part)
                    moved = sum(r["outcome"] != plain[r["seed"]] for r in part)
                    keys = ("right", "undetermined", "unknown", "wrong", "nothing", "misfit")
                    found.append(
                        {"constant": name or "as they are", "times": factor, "campaigns": f"{len(part)} {kind}"}
                        | {key: counts[key] for key in keys} | {"changed": moved}
                    )  # fmt: skip
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("what", choices=("run", "table"))
    parser.add_argument("file", type=Path)
    options = parser.parse_args()
    if options.what == "run":
        run(options.file)
        return
    found = table(_rows(options.file))
    with (DOCS / "data" / "diagnosis-constants.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, found[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(found)


if __name__ == "__main__":
    main()
