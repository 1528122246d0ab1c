"""A fault at every file operation of every command, as SQLite is tested.

    python benchmarks/torture_faults.py [--out out/torture] [--only COMMAND] [--every N] [--seed N]

Each command runs once undisturbed, on a campaign of 12 pulls, to count its file operations: to open, read, write,
rename, list, delete. Then it is run again for each of them, twice: once that operation fails, with an error number that
the operation can give (the numbers take turns), and once the process is killed at it. It is also run with a limit on
the size of files and, where the process may mount a file system, with OUT on one that is too small; both reach what C
libraries write. Required, every time:

- a sentence that names the path and the cause, no traceback, exit status 1; or the complete result, and where it was
  made without a file that could not be read, a sentence that says so;
- the inputs unchanged, and no temporary file left behind by a command that was not killed;
- the next, undisturbed start makes what it would have made without the fault, and leaves no temporary file.

Exit status 1 if anything did not hold.
"""

from __future__ import annotations

import argparse
import csv
import itertools
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from faults.commands import prepared
from faults.file_operations import KILL, Fault, Operation, errors_of
from faults.small_site import write_inputs
from faults.trial import Bench, Outcome

COLUMNS = ("what", "tried", "held", "failed", "seconds", "seed")


def faults_of(operations: list[Operation], every: int, seed: int) -> Iterator[Fault]:
    """An error and a kill at each operation, or at each ``every``-th; the errors that one can give take turns."""
    turns = {kind: itertools.count(seed) for kind in {o.kind for o in operations}}
    for at, operation in enumerate(operations):
        names = errors_of(operation.kind)
        name = names[next(turns[operation.kind]) % len(names)]
        if at % every == seed % every:
            yield Fault(at, name)
            yield Fault(at, KILL)


Trial = tuple[str, Callable[[], tuple[Outcome, list[str]]]]


def trials_of(bench: Bench, every: int, seed: int) -> dict[str, list[Trial]]:
    """The trials of a command by kind, each with its name."""
    name = bench.command.name
    faults = list(faults_of(bench.operations, every, seed))
    found = {
        f"faults at file operations: {name}": [
            (f"{f.at} {f.name}", partial(bench.trial, f)) for f in faults if f.name != KILL
        ],
        f"killed at file operations: {name}": [
            (f"{f.at} {f.name}", partial(bench.trial, f)) for f in faults if f.name == KILL
        ],
    }
    if name not in ("verify", "report again"):
        largest = [0, *(int(bench.written_bytes / 2**k) for k in range(1, 14))]
        found[f"files not larger than a limit: {name}"] = [
            (f"limit {size}", partial(bench.with_largest_file, size)) for size in largest
        ]
        ready = bench.ready_bytes
        sizes = [ready + (bench.written_bytes - ready) * share // 12 + 40960 for share in range(12)]
        if os.geteuid() == 0:
            found[f"disk full: {name}"] = [(f"{size} bytes", partial(bench.on_full_disk, size)) for size in sizes]
    return found


def torture(what: str, trials: Sequence[Trial], seed: int, failures: list[str]) -> dict[str, object]:
    """All trials of a kind as a row of the table; what did not hold is added to ``failures``."""
    failed = 0
    started = time.monotonic()
    for name, trial in trials:
        outcome, wrong = trial()
        if wrong:
            failed += 1
            where = f"{outcome.struck.kind} {outcome.struck.path}" if outcome.struck else ""
            said = " ".join(outcome.said.split())[-400:]
            failures.append(f"{what}\t{name}\t{where}\t{'; '.join(wrong)}\t{said}")
    return {
        "what": what, "tried": len(trials), "held": len(trials) - failed, "failed": failed,
        "seconds": round(time.monotonic() - started), "seed": seed,
    }  # fmt: skip


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/torture"))
    parser.add_argument("--only", action="append", help="name of a command; several may be given")
    parser.add_argument("--every", type=int, default=1, help="only each so manieth operation")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    rows, failures = [], []
    with tempfile.TemporaryDirectory(prefix="torture-") as folder:
        root = Path(folder).resolve()
        place = write_inputs(root / "watched")
        builds = not given.only or any("build" in name for name in given.only)
        for name, command in prepared(place, root, builds).items():
            if given.only and name not in given.only:
                continue
            for what, trials in trials_of(Bench(place, command), given.every, given.seed).items():
                rows.append(torture(what, trials, given.seed, failures))
                print(" ".join(f"{rows[-1][column]!s:>8}" for column in COLUMNS[1:]), what, flush=True)
    with (given.out / "faults.csv").open("w", newline="", encoding="utf-8") as stream:
        table = csv.DictWriter(stream, COLUMNS)
        table.writeheader()
        table.writerows(rows)
    (given.out / "faults-failures.txt").write_text("\n".join(failures) + "\n" * bool(failures), encoding="utf-8")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
