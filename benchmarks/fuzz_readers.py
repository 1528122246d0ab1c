"""Mutants of real exports: each must be read to the same columns as the original, or be refused with a reason.

    python benchmarks/fuzz_readers.py FILE... [--mutants 20000] [--seed 1]

Files are shortened to their head and tail first, so that many mutants fit into minutes. A mutant counts as

- refused: a ReadError, with problems;
- same: read, with time and force from the same columns in the same units as the original;
- another export spliced in: read as what the rest of another export says it is;
- other columns: read, but from other columns or in other units. Where the mutation did not touch the header,
  this is a silent wrong column and a failure;
- broken: any other exception, or more than SLOW_S seconds. A failure.

Exit status 1 if there was a failure.
"""

from __future__ import annotations

import argparse
import random
import re
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from tribo.errors import ReadError
from tribo.readers import read_blocks

SLOW_S = 5.0
KEEP_HEAD_BYTES, KEEP_TAIL_BYTES, LARGEST_BYTES = 7000, 1500, 200_000
BY_POSITION = {"time": "#1 [s]", "friction force": "#2 [N]"}
Mutation = Callable[[bytes, random.Random, list[bytes]], bytes]


def _place(data: bytes, rng: random.Random) -> int:
    return rng.randrange(len(data)) if data else 0


def flip_byte(data: bytes, rng: random.Random, pool: list[bytes]) -> bytes:
    at = _place(data, rng)
    return data[:at] + bytes([rng.randrange(256)]) + data[at + 1 :]


def drop_span(data: bytes, rng: random.Random, pool: list[bytes]) -> bytes:
    at = _place(data, rng)
    return data[:at] + data[at + rng.randrange(1, 60) :]


def insert_noise(data: bytes, rng: random.Random, pool: list[bytes]) -> bytes:
    at = _place(data, rng)
    return data[:at] + rng.randbytes(rng.randrange(1, 30)) + data[at:]


def repeat_span(data: bytes, rng: random.Random, pool: list[bytes]) -> bytes:
    at = _place(data, rng)
    span = data[at : at + rng.randrange(1, 400)]
    return data[: at + len(span)] + span + data[at + len(span) :]


def truncate(data: bytes, rng: random.Random, pool: list[bytes]) -> bytes:
    return data[: _place(data, rng)]


def splice(data: bytes, rng: random.Random, pool: list[bytes]) -> bytes:
    other = rng.choice(pool)
    return data[: _place(data, rng)] + other[_place(other, rng) :]


def on_a_line(change: Callable[[bytes, random.Random], list[bytes]]) -> Mutation:
    def mutate(data: bytes, rng: random.Random, pool: list[bytes]) -> bytes:
        lines = data.split(b"\n")
        at = rng.randrange(len(lines))
        return b"\n".join(lines[:at] + change(lines[at], rng) + lines[at + 1 :])

    mutate.__name__ = change.__name__
    return mutate


def drop_line(line: bytes, rng: random.Random) -> list[bytes]:
    return []


def double_line(line: bytes, rng: random.Random) -> list[bytes]:
    return [line, line]


def other_decimal(line: bytes, rng: random.Random) -> list[bytes]:
    return [line.replace(b".", b",")] if b"." in line else [line.replace(b",", b".")]


def other_delimiter(line: bytes, rng: random.Random) -> list[bytes]:
    return [line.replace(rng.choice([b"\t", b";", b","]), rng.choice([b"\t", b";", b",", b"|", b" "]))]


def drop_cell(line: bytes, rng: random.Random) -> list[bytes]:
    delimiter = next((d for d in (b"\t", b";", b",") if d in line), b" ")
    cells = line.split(delimiter)
    del cells[rng.randrange(len(cells))]
    return [delimiter.join(cells)]


def letter_for_digit(line: bytes, rng: random.Random) -> list[bytes]:
    return [line.replace(rng.choice([b"0", b"1", b"5"]), rng.choice([b"O", b"l", b"S", b"NaN", b"-", b""]), 1)]


def no_quotes(line: bytes, rng: random.Random) -> list[bytes]:
    return [line.replace(b'"', b"", rng.randrange(1, 4))]


MUTATIONS: tuple[Mutation, ...] = (
    flip_byte,
    drop_span,
    insert_noise,
    repeat_span,
    truncate,
    splice,
    *map(on_a_line, (drop_line, double_line, other_decimal, other_delimiter, drop_cell, letter_for_digit, no_quotes)),
)


@dataclass(frozen=True)
class Seed:
    """A shortened export: its bytes, and the columns it is read from."""

    name: str
    data: bytes
    columns: frozenset[tuple[str, str]]
    options: dict[str, str] | None = None  # columns by position, for an export that does not say enough


def shortened(path: Path) -> bytes:
    """Head and tail of a file, cut at line ends; a binary file as it is."""
    data = path.read_bytes()
    if len(data) <= KEEP_HEAD_BYTES + KEEP_TAIL_BYTES or b"\0" in data[:2000]:
        return data[:LARGEST_BYTES]
    head, tail = data[:KEEP_HEAD_BYTES], data[-KEEP_TAIL_BYTES:]
    return head[: head.rfind(b"\n") + 1] + tail[tail.find(b"\n") + 1 :]


def columns_of(path: Path, options: dict[str, str] | None = None) -> frozenset[tuple[str, str]]:
    """Time and force columns with their units a file is read with; nothing where it is refused."""
    try:
        traces = read_blocks(path, columns=options)
    except ReadError as why:
        if not why.problems:
            raise AssertionError("refused without a reason") from why
        return frozenset()
    found = set()
    for trace in traces:
        assert trace.source is not None
        assert trace.time_s.size == trace.force_N.size > 0
        found |= {(q, trace.source.columns[q]) for q in ("time", "friction force")}
    return frozenset(found)


def text_lines(data: bytes) -> list[bytes]:
    """Lines with words in them: headers of all tables, and what mutations wrote into rows."""
    return [line for line in data.split(b"\n") if re.search(rb"[A-Za-z]{2}|[a-z]_", line)]


def load_seed(path: Path, scratch: Path) -> Seed:
    data = shortened(path)
    scratch.write_bytes(data)
    options = None
    columns = columns_of(scratch)
    if not columns:
        options = BY_POSITION
        columns = columns_of(scratch, options)
    return Seed(path.name, data, columns, options)


def judge(seed: Seed, mutant: bytes, spliced: bool, scratch: Path) -> str:
    scratch.write_bytes(mutant)
    began = time.perf_counter()
    try:
        columns = columns_of(scratch, seed.options)
    except Exception:  # the point of the exercise is that nothing else is raised
        traceback.print_exc()
        return "broken"
    if time.perf_counter() - began > SLOW_S:
        return "broken"
    if not columns:
        return "refused"
    if columns <= seed.columns or seed.options:
        return "same"
    if spliced:
        return "another export spliced in"
    header_touched = text_lines(mutant) != text_lines(seed.data)
    return "other columns, header changed" if header_touched or not seed.columns else "other columns"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("--mutants", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=Path, help="folder for the mutants that failed")
    options = parser.parse_args()
    rng = random.Random(options.seed)
    counts: Counter[str] = Counter()
    failed: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as folder:
        scratch = Path(folder) / "mutant.txt"
        seeds = [load_seed(path, scratch) for path in options.files]
        pool = [seed.data for seed in seeds]
        began = time.perf_counter()
        for k in range(options.mutants):
            seed = seeds[k % len(seeds)]
            mutant = seed.data
            done = []
            for _ in range(rng.choice((1, 1, 1, 2, 4))):
                mutation = rng.choice(MUTATIONS)
                mutant = mutation(mutant, rng, pool)
                done.append(mutation.__name__)
            verdict = judge(seed, mutant, "splice" in done, scratch)
            counts[verdict] += 1
            if verdict in ("broken", "other columns"):
                failed[f"{verdict}: {seed.name} after {', '.join(done)}"] += 1
                if options.keep:
                    options.keep.mkdir(parents=True, exist_ok=True)
                    (options.keep / f"{k:06d}_{seed.name}").write_bytes(mutant)
        took = time.perf_counter() - began
    print(f"{options.mutants} mutants of {len(seeds)} files in {took:.0f} s, seed {options.seed}")
    for verdict, n in counts.most_common():
        print(f"{n:8d}  {verdict}")
    for what, n in failed.most_common(30):
        print(f"{n:8d}  {what}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
