"""Exams in virtual laboratories that share nothing with the diagnosis: days, drift, gaps, one value, levels, laws.

    python benchmarks/laboratories.py run    out/laboratories.jsonl                 all cells; goes on where it stopped
    python benchmarks/laboratories.py run    out/laboratories.jsonl --only nuisance --count 60 --seed 7
    python benchmarks/laboratories.py run    out/laboratories.jsonl --share 0.2     a fifth of every cell
    python benchmarks/laboratories.py tables out/laboratories.jsonl                 the tables, printed

The generator is in tests/laboratories. A run appends one line a campaign, in random order, so that a part of a run is
a fair sample of it. A line holds the hidden truth and the whole answer: tables are made from lines alone.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

from laboratory_cells import CELLS, Piece
from laboratory_tables import tables
from run_lines import Row, read_rows, work_off

import numpy as np  # after the cells, which say how many threads it may use  # isort: skip


def work(piece: Piece) -> Row:
    begin = time.process_time()
    row = CELLS[piece.cell].row(piece)
    seconds = round(time.process_time() - begin, 2)
    return {"cell": piece.cell, "seed": piece.seed, "what": piece.what, **row, "seconds": seconds}


def planned(options: argparse.Namespace) -> list[Piece]:
    """The campaigns that were asked for, in random order."""
    todo = [
        piece
        for name, cell in CELLS.items() if options.only in (name, "all") and name not in options.without
        for piece in cell.pieces(name, options.count or round(options.share * cell.count), options.seed)
    ]  # fmt: skip
    np.random.default_rng(options.seed).shuffle(todo)  # type: ignore[arg-type]
    return todo


def key(cell: str, seed: int, what: Row) -> tuple[str, int, str]:
    return cell, seed, str(sorted(what.items()))


def said(row: Row) -> str:
    causes = ", ".join(c["mechanism"] for c in row["causes"])
    laws = "; ".join(x["formula"] for x in row["layers"] if x["kind"] == "law")
    return " | ".join(x for x in (f"{row['cell']} {row['what']}: {row['verdict']}", causes, laws) if x)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("run", "tables"))
    parser.add_argument("path", type=Path, help="JSON lines, one a campaign")
    parser.add_argument("--only", choices=("all", *CELLS), default="all", help="one cell")
    parser.add_argument("--count", type=int, default=0, help="campaigns of each cell; by default what is asked for")
    parser.add_argument("--share", type=float, default=1.0, help="of what is asked for, in every cell")
    parser.add_argument("--without", action="append", default=[], choices=tuple(CELLS), help="a cell; may be repeated")
    parser.add_argument("--seed", type=int, default=2401)
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    if options.what == "run":
        todo, known = planned(options), {key(r["cell"], r["seed"], r["what"]) for r in read_rows(options.path)}
        rest = [p for p in todo if key(p.cell, p.seed, p.what) not in known]
        print(f"{len(todo)} campaigns, {len(todo) - len(rest)} of them done", flush=True)
        work_off(rest, work, options.path, options.jobs, said)
    print(tables(read_rows(options.path)))


if __name__ == "__main__":
    main()
