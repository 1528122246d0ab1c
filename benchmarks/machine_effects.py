"""What a machine leaves in its traces, hidden in campaigns: an inclined wire, a roller, a soft frame, a slow recorder.

    python benchmarks/machine_effects.py run    out/machine-effects.jsonl --count 40 --clean 200 --seed 8800
    python benchmarks/machine_effects.py tables out/machine-effects.jsonl

The generator is in tests/machines. Sizes are once, twice and three times what an observer sees in nine of ten campaigns
who knows how much the machines of the generator differ; the diagnosis does not. A run goes on where it stopped.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

from run_lines import Row, read_rows, work_off

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from machines.bench import EFFECTS, campaign, seen_in_nine_of_ten

import tribo

TIMES = (1.0, 2.0, 3.0)


class Piece(NamedTuple):
    seed: int
    effect: str
    times: float


def work(piece: Piece) -> Row:
    size = piece.times * seen_in_nine_of_ten(piece.effect) if piece.effect else 0.0
    with tempfile.TemporaryDirectory() as folder:
        ingested = tribo.ingest(
            tribo.load_campaign(campaign(Path(folder) / "campaign", piece.seed, piece.effect, size))
        )
        verdict = tribo.diagnose(ingested, seed=piece.seed).verdict
    named = {c.mechanism: next(iter(c.parameters.values())) for c in verdict.causes}
    return {
        **piece._asdict(), "size": size, "pulls": len(ingested.pulls), "verdict": verdict.verdict,
        "named": {name: [float(e.value), float(e.low), float(e.high)] for name, e in named.items()},
        "text": verdict.sentence,
    }  # fmt: skip


def planned(options: argparse.Namespace) -> list[Piece]:
    pieces = [Piece(options.seed + k, "", 0.0) for k in range(options.clean)]
    for number, effect in enumerate(EFFECTS, start=1):
        seeds = [options.seed + 10_000 * number + k for k in range(options.count)]
        pieces += [Piece(seed, effect, times) for seed in seeds for times in TIMES]
    return sorted(pieces, key=lambda piece: piece.seed % 1000)  # a part of a run has some of everything


def tables(rows: list[Row]) -> str:
    lines = ["| hidden | times | campaigns | right | another named | nothing named |", "|---|---|---|---|---|---|"]
    for effect in ("", *EFFECTS):
        for times in TIMES if effect else (0.0,):
            here = [r for r in rows if r["effect"] == effect and r["times"] == times]
            if not here:
                continue
            right = sum(list(r["named"]) == ([effect] if effect else []) for r in here)
            wrong = sum(bool(set(r["named"]) - {effect}) for r in here)
            none = sum(not r["named"] for r in here) if effect else 0
            lines.append(f"| {effect or 'nothing'} | {times:g} | {len(here)} | {right} | {wrong} | {none} |")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("run", "tables"))
    parser.add_argument("path", type=Path, help="JSON lines, one a campaign")
    parser.add_argument("--count", type=int, default=40, help="campaigns of each effect and size")
    parser.add_argument("--clean", type=int, default=200, help="campaigns with nothing hidden")
    parser.add_argument("--seed", type=int, default=8800)
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    if options.what == "run":
        known = {(r["seed"], r["effect"], r["times"]) for r in read_rows(options.path)}
        rest = [piece for piece in planned(options) if tuple(piece) not in known]
        work_off(rest, work, options.path, options.jobs, lambda row: f"{row['effect']} {row['times']}: {row['named']}")
    print(tables(read_rows(options.path)))


if __name__ == "__main__":
    main()
