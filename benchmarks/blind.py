"""Campaigns with hidden effects in full: power against size, confusion, false alarms, coverage.

    python benchmarks/blind.py half   docs/data/blind-half.jsonl             the size of each effect found half the time
    python benchmarks/blind.py run    out/blind.jsonl --seed 73              three and six times that size, and the rest
    python benchmarks/blind.py tables out/blind.jsonl                        what came of it
    python benchmarks/blind.py page   out/blind.jsonl                        the same into docs/blind.md, rows beside it

Every campaign is written to disk as raw exports by the virtual tribometer of tests/blind and read back through
the whole chain; the diagnosis sees only the files. ``half`` has seeds of its own. A run appends one line a campaign
and takes up where it was stopped; campaigns are in random order, so that a part of a run is a fair sample of it.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # the processes share the cores, not each product

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

import numpy as np
from blind.tribometer import EFFECTS, LARGEST, Design, hide, write
from blind_tables import tables

if TYPE_CHECKING:
    from tribo.diagnose.diagnosis import Diagnosis

DOCS = Path(__file__).resolve().parents[1] / "docs"
MARK = "<!-- below: python benchmarks/blind.py page -->"
HALF_SEED = 500_000_000
TRIALS = 16  # of each search for the size found half the time
SPEEDS, HOLDS = (0.05, 0.2, 0.8), (1.0, 10.0, 300.0)
LADDER: dict[str, dict[str, Any]] = {
    "velocity_dependence": {"speeds_mm_s": SPEEDS}, "bulk_viscoelasticity": {"speeds_mm_s": SPEEDS},
    "sampling_clip": {"speeds_mm_s": SPEEDS}, "contact_ageing": {"holds_s": HOLDS},
}  # fmt: skip
# what no design of this kind can show: the flat law takes it up, it does not touch the forces, or (a slow recorder)
# the reader already puts back what the peak lost: of sixteen campaigns down to two samples a second, two were noticed
HIDDEN_FROM_ALL = ("pull_angle", "pulley_friction", "machine_compliance", "sampling_clip")
ALL_OR_NOTHING = ("mislabelled_specimen",)
ON_ENGINE = (
    "suction", "normal_load_error", "pressure_dependent_friction", "run_in", "temperature", "covariate:operator",
)  # fmt: skip
PAIRS = (
    ("suction", "run_in"), ("run_in", "temperature"), ("pressure_dependent_friction", "covariate:operator"),
    ("contact_area_loss", "velocity_dependence"), ("edge_adhesion", "load_cell_offset"),
)  # fmt: skip
# the amplitude that stands for size 1 in tests/blind/effects.py, where the library has the same parameter
TRUTH = {
    "suction": ("dp", 5000.0), "pressure_dependent_friction": ("n", 0.2), "velocity_dependence": ("a", 0.06),
    "contact_ageing": ("b", 0.035), "run_in": ("c", 0.25), "temperature": ("c", 0.06), "edge_adhesion": ("e", 0.08),
    "normal_load_error": ("dN", 0.12), "covariate:operator": ("g", 0.12), "load_cell_offset": ("F_0", 0.1),
}  # fmt: skip
Effects = tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class Case:
    """One campaign to be made: what it counts for, its seed, what is hidden, how it is measured."""

    cell: str
    seed: int
    effects: Effects
    design: Design


def design_for(*names: str, engine: bool = False) -> Design:
    """Three specimens, six loads, one pull each; a ladder of speeds or holds where an effect needs one."""
    ladders = {k: v for name in names for k, v in LADDER.get(name, {}).items()}
    samples = ("F", "A", "B", "C") if engine else Design.samples
    return Design(samples=samples, repeats=1 + engine, engine=engine, **ladders)


def clean_design(seed: int) -> Design:
    """Designs, noise, gaps and tails as they come."""
    rng = np.random.default_rng(seed)
    sets = (("F", "A", "B", "C", "Sx", "Sy"), ("F", "A", "B", "C"), ("F", "B", "C", "Sx", "Sy"))
    engine = bool(rng.random() < 0.15)
    scale = rng.uniform(0.5, 1.4)
    return Design(
        samples=sets[1] if engine else sets[rng.integers(3)],
        specimens=int(rng.integers(3, 5)), repeats=int(rng.integers(1, 4)),
        speeds_mm_s=((0.2,), SPEEDS)[rng.integers(2)], holds_s=((10.0,), HOLDS)[rng.integers(2)],
        repeat_sd=(0.09 * scale, 0.07 * scale), specimen_sd=float(rng.uniform(0.03, 0.07)),
        tail=float(rng.choice([np.inf, 4.0])), missing=float(rng.choice([0.0, 0.15])), engine=engine,
    )  # fmt: skip


def cases(half: dict[str, float], campaigns: int, clean: int, seed: int) -> Iterator[Case]:
    """Every campaign of a run: clean ones, each effect at its sizes, pairs, and what cannot be seen.

    A campaign's seed follows from its place among all cells, known or not, so that a run can be widened. Where a size
    is recovered it is the next seed's: with 73 the intervals covered too much, and what was changed then has to show
    on other campaigns.
    """
    for k in range(clean):
        yield Case("clean", seed * 1_000_000 + k, (), clean_design(seed * 1_000_000 + k))
    for place, names in enumerate([*((name,) for name in EFFECTS), *PAIRS], start=1):
        for step, (cell, effects) in enumerate(_cells(names, half)):
            for k in range(campaigns):
                number = (seed + (names[0] in TRUTH)) * 1_000_000 + 10_000 * place + 1000 * step + k
                engine = k % 5 == 0 and all(name in ON_ENGINE for name in names)
                yield Case(cell, number, effects, design_for(*names, engine=engine))


def _cells(names: tuple[str, ...], half: dict[str, float]) -> Iterator[tuple[str, Effects]]:
    """One effect at three and six times its half-found size, a pair at three times; all or nothing at size 1."""
    if names[0] in HIDDEN_FROM_ALL or names[0] in ALL_OR_NOTHING:
        yield f"{names[0]} x 1", ((names[0], 1.0),)
    elif all(name in half for name in names):
        for times in (3, 6)[: 3 - len(names)]:
            cell = f"{names[0]} x {times}" if len(names) == 1 else " + ".join(names)
            yield cell, tuple((name, _times(name, half, times)) for name in names)


def _times(name: str, half: dict[str, float], times: float) -> float:
    """So many times the size found half the time, as far as physics goes."""
    return round(min(times * half[name], LARGEST.get(name, np.inf)), 4)


def one(case: Case) -> dict[str, Any]:
    """Hide, write, read, diagnose."""
    from tribo.campaign import load_campaign
    from tribo.diagnose import examine
    from tribo.stages import ingest

    begin = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        path = write(hide(case.seed, list(case.effects), case.design), Path(folder) / "campaign", case.seed)
        d = examine(ingest(load_campaign(path)), seed=case.seed)
    v = d.verdict
    tied = [sorted(names) for names in v.equivalent]
    alone = [[c.mechanism] for c in v.causes if not any(c.mechanism in names for names in tied)]
    row = {
        "cell": case.cell, "seed": case.seed, "effects": case.effects, "verdict": v.verdict,
        "causes": sorted([*tied, *alone]), "covariates": [m.covariate for m in v.misfits[:3]],
        "seconds": round(time.process_time() - begin, 2),
    }  # fmt: skip
    if v.next_test is not None and tied:
        row["next_test"] = {"separates": sorted(v.next_test.separates), "bits": round(v.next_test.expected_bits, 2)}
    name, size = case.effects[0] if len(case.effects) == 1 else ("", 0.0)
    key, unit = TRUTH.get(name, ("", 0.0))
    for cause in v.causes:
        if cause.mechanism == name and key in cause.parameters:
            e = cause.parameters[key]
            row["interval"] = [float(f"{x:.5g}") for x in (unit * size, e.low, e.value, e.high)]
    if not case.effects and v.verdict == "no_misfit":
        row["gain"] = gain_of_the_best(d, case.seed)
    return row


def gain_of_the_best(d: Diagnosis, seed: int) -> list[float]:
    """What the mechanism that fits best by chance gains on samples left out: mean log score, standard error."""
    from tribo.diagnose.search.weigh import weigh
    from tribo.diagnose.statistics.gain import gain

    found = gain(d.baseline, weigh(d.baseline)[0].fit, np.random.default_rng(seed))
    return [round(found.difference, 5), round(found.se, 5)] if found is not None else []


def is_seen(case: Case) -> bool:
    """Whether anything is seen at all: the first part of a diagnosis, without naming."""
    from tribo.campaign import load_campaign
    from tribo.diagnose.search.looks import all_looks
    from tribo.diagnose.search.screen import screen
    from tribo.diagnose.statistics.direct_evidence import rise_stiffening, zero_drift, zero_offset
    from tribo.diagnose.statistics.fit import fit
    from tribo.diagnose.statistics.model import setup
    from tribo.diagnose.statistics.observations import observe
    from tribo.diagnose.statistics.predictor import tabled_predictor
    from tribo.stages import ingest

    with tempfile.TemporaryDirectory() as folder:
        path = write(hide(case.seed, list(case.effects), case.design), Path(folder) / "campaign", case.seed)
        o = observe(ingest(load_campaign(path)))
    if any(e is not None and e.certain for e in (zero_offset(o), zero_drift(o), rise_stiffening(o))):
        return True
    f = fit(setup(o, tabled_predictor(o.patterns)))
    rng = np.random.default_rng(case.seed)
    return screen(f, all_looks(f), replicates=120, rng=rng).p_adjusted() < 0.01


def half_of(name: str) -> dict[str, Any]:
    """Size at which a misfit is seen half the time: a staircase, up after a miss and down after a hit."""
    size, step, seen_before = 0.4 * min(LARGEST.get(name, 1.0), 1.0), 1.6, None
    trials: list[tuple[float, bool]] = []
    turns = 0
    for k in range(TRIALS):
        case = Case("half", HALF_SEED + 1000 * sorted(EFFECTS).index(name) + k, ((name, size),), design_for(name))
        seen = is_seen(case)
        trials.append((round(size, 5), seen))
        turns += seen_before is not None and seen != seen_before
        size = min(size / step if seen else size * step, LARGEST.get(name, np.inf))
        step, seen_before = (1.6 if turns < 2 else 1.25), seen
    settled = np.log([s for s, _ in trials[5:]] + [size])
    return {"effect": name, "half": float(f"{np.exp(settled.mean()):.4g}"), "trials": trials}


def read_rows(path: Path) -> list[dict[str, Any]]:
    """The lines of a run; one cut short by a kill is left out."""
    rows = []
    for line in path.read_text().splitlines() if path.exists() else ():
        try:
            rows.append(json.loads(line))
        except json.JSONDecodeError:
            continue
    return rows


def work_off(todo: Iterable[Any], work: Any, path: Path, jobs: int) -> None:
    """Append a line for each piece of work as it ends, and say how long the rest will take."""
    todo, begin = list(todo), time.monotonic()
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.exists() and not path.read_bytes().endswith(b"\n"):
        path.write_bytes(path.read_bytes() + b"\n")
    with ProcessPoolExecutor(jobs) as pool, path.open("a") as file:
        waiting = [pool.submit(work, piece) for piece in todo]
        for done, future in enumerate(as_completed(waiting), start=1):
            row = future.result()
            file.write(json.dumps(row) + "\n")
            file.flush()
            left = (time.monotonic() - begin) / done * (len(todo) - done)
            what = row.get("half") or f"{row['verdict']} {row['causes']}"
            name = row.get("cell") or row["effect"]
            print(f"{done}/{len(todo)}, {left / 60:.0f} min left: {name}: {what}", flush=True)


def find_half(path: Path, jobs: int) -> None:
    known = {row["effect"] for row in read_rows(path)}
    names = [n for n in EFFECTS if n not in known and n not in HIDDEN_FROM_ALL + ALL_OR_NOTHING]
    work_off(names, half_of, path, jobs)


def run(path: Path, half: Path, campaigns: int, clean: int, seed: int, jobs: int) -> None:
    sizes = {row["effect"]: row["half"] for row in read_rows(half)}
    todo = list(cases(sizes, campaigns, clean, seed))
    np.random.default_rng(seed).shuffle(todo)  # type: ignore[arg-type]
    known = {(row["cell"], row["seed"]) for row in read_rows(path)}
    print(f"{len(todo)} campaigns, seed {seed}, {len(known)} of them done", flush=True)
    work_off([c for c in todo if (c.cell, c.seed) not in known], one, path, jobs)


def put_on_page(rows: list[dict[str, Any]], planned: int, seed: int) -> None:
    """The tables into docs/blind.md below its mark, and the rows into docs/data."""
    page, data = DOCS / "blind.md", DOCS / "data" / "blind.jsonl"
    above = page.read_text().split(MARK)[0]
    made = f"Seed {seed}: {len(rows)} of {planned} campaigns, in random order.\n\n"
    page.write_text(above + MARK + "\n\n" + made + tables(rows))
    data.write_text("".join(json.dumps(row) + "\n" for row in sorted(rows, key=lambda r: int(r["seed"]))))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("half", "run", "tables", "page"))
    parser.add_argument("path", type=Path, help="JSON lines, one a campaign")
    parser.add_argument("--half", type=Path, default=Path("docs/data/blind-half.jsonl"))
    parser.add_argument("--campaigns", type=int, default=50, help="per cell")
    parser.add_argument("--clean", type=int, default=200)
    parser.add_argument("--seed", type=int, default=73)
    parser.add_argument("--jobs", type=int, default=2)
    o = parser.parse_args()
    if o.what == "half":
        find_half(o.path, o.jobs)
    elif o.what == "run":
        run(o.path, o.half, o.campaigns, o.clean, o.seed, o.jobs)
    elif o.what == "page":
        sizes = {row["effect"]: row["half"] for row in read_rows(o.half)}
        put_on_page(read_rows(o.path), len(list(cases(sizes, o.campaigns, o.clean, o.seed))), o.seed)
    if o.what != "half":
        print(tables(read_rows(o.path)))


if __name__ == "__main__":
    main()
