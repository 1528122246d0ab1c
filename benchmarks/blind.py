"""The blind test in full: campaigns with hidden effects, and how often the diagnosis is right, wrong or undecided.

    python benchmarks/blind.py half   docs/data/blind-half.jsonl             the size of each effect found half the time
    python benchmarks/blind.py half   FILE --pattern-error 1.5 --specimen-slope 0.04       the same with larger errors
    python benchmarks/blind.py run    out/blind.jsonl                        all campaigns; goes on where it was stopped
    python benchmarks/blind.py run    out/blind.jsonl --only promised        only the parts that promises are made of
    python benchmarks/blind.py tables out/blind.jsonl                        the tables, printed
    python benchmarks/blind.py page   out/blind.jsonl                        the same into docs/blind.md, and curves

The generator is in tests/blind and shares no code with the diagnosis; docs/blind.md says how campaigns are made. A run
appends one line a campaign, in random order, so that a part of a run is a fair sample of it. ``half`` uses seeds of
its own.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from blind_cases import ALL_OR_NOTHING, UNSEEN, Case, Plan, Staircase, answer, cases, design_for, is_seen
from blind_tables import tables
from run_lines import read_rows, work_off

import numpy as np  # after blind_cases, which says how many threads it may use  # isort: skip
from blind.tribometer import EFFECTS, LARGEST  # isort: skip

DOCS = Path(__file__).resolve().parents[1] / "docs"
MARK = "<!-- below: python benchmarks/blind.py page -->"
HALF_SEED = 500_000_000
TRIALS = 16  # of each search for the size found half the time
# Parts of a run, by the names of their cells.
PARTS: dict[str, Callable[[str], bool]] = {
    "all": lambda cell: True,
    "promised": lambda cell: cell.startswith("clean") or cell.endswith("swept"),
    "curves": lambda cell: cell.startswith("curve"),
}


def half_of(name: str, errors: Mapping[str, float]) -> dict[str, Any]:
    """Size at which a misfit is seen half the time."""
    largest = LARGEST.get(name, np.inf)
    first = HALF_SEED + 1000 * sorted(EFFECTS).index(name)

    def seen_at(size: float, k: int) -> bool:
        return is_seen(Case("half", first + k, ((name, size),), design_for(name, **errors)))

    half, trials = Staircase(TRIALS, 5, 1.6, largest).settled(0.4 * min(largest, 1.0), seen_at)
    return {"effect": name, "half": half, "trials": trials}


def in_a_line(row: Mapping[str, Any]) -> str:
    """What a row says, for the progress of a run."""
    what = row.get("half") or f"{row['verdict']} {row['causes']}"
    return f"{row.get('cell') or row['effect']}: {what}"


def find_half(path: Path, errors: Mapping[str, float], jobs: int) -> None:
    known = {row["effect"] for row in read_rows(path)}
    rest = [n for n in EFFECTS if n not in known and n not in UNSEEN + ALL_OR_NOTHING]
    work_off(rest, partial(half_of, errors=errors), path, jobs, in_a_line)


def planned(options: argparse.Namespace) -> list[Case]:
    """The campaigns that were asked for, in random order."""
    half = {row["effect"]: row["half"] for row in read_rows(options.half)}
    plan = Plan(options.clean, options.large_error, options.campaigns, options.campaigns, options.points)
    todo = [case for case in cases(half, plan, options.seed) if PARTS[options.only](case.cell)]
    np.random.default_rng(options.seed).shuffle(todo)  # type: ignore[arg-type]
    return todo


def run(todo: list[Case], path: Path, jobs: int) -> None:
    known = {(row["cell"], row["seed"]) for row in read_rows(path)}
    rest = [case for case in todo if (case.cell, case.seed) not in known]
    print(f"{len(todo)} campaigns, {len(todo) - len(rest)} of them done", flush=True)
    work_off(rest, answer, path, jobs, in_a_line)


def put_on_page(rows: list[dict[str, Any]], todo: list[Case], options: argparse.Namespace) -> None:
    """Tables into docs/blind.md below its mark, curves into docs/figures, and the rows into docs/data."""
    from blind_figure import draw_curves

    page = DOCS / "blind.md"
    asked = {(case.cell, case.seed) for case in todo}
    rows = [row for row in rows if (row["cell"], row["seed"]) in asked]
    above = page.read_text().split(MARK)[0]
    made = f"Seed {options.seed}: {len(rows)} of {len(todo)} campaigns.\n\n"
    picture = "![Answers over pattern error, specimen slope and noise law](figures/blind-curves.svg)\n\n"
    page.write_text(above + MARK + "\n\n" + made + picture + tables(rows))
    data = DOCS / "data" / "blind.jsonl"
    data.write_text("".join(json.dumps(row) + "\n" for row in sorted(rows, key=lambda r: (r["cell"], r["seed"]))))
    draw_curves(rows, DOCS / "figures" / "blind-curves.svg")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("half", "run", "tables", "page"))
    parser.add_argument("path", type=Path, help="JSON lines, one a campaign")
    parser.add_argument("--half", type=Path, default=DOCS / "data" / "blind-half.jsonl")
    parser.add_argument("--pattern-error", type=float, default=1.0, help="of the campaigns of half")
    parser.add_argument("--specimen-slope", type=float, default=0.0, help="the same")
    parser.add_argument("--only", choices=sorted(PARTS), default="all", help="which part of a run")
    parser.add_argument("--campaigns", type=int, default=20, help="per cell with something hidden")
    parser.add_argument("--points", type=int, default=10, help="per point of a curve and effect")
    parser.add_argument("--clean", type=int, default=300)
    parser.add_argument("--large-error", type=int, default=100, help="clean campaigns at pattern error 2, and at 3")
    parser.add_argument("--seed", type=int, default=83)
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    if options.what == "half":
        errors = {"pattern_error": options.pattern_error, "specimen_slope": options.specimen_slope}
        find_half(options.path, errors, options.jobs)
        return
    if options.what == "run":
        run(planned(options), options.path, options.jobs)
    elif options.what == "page":
        put_on_page(read_rows(options.path), planned(options), options)
    print(tables(read_rows(options.path)))


if __name__ == "__main__":
    main()
