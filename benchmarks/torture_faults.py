"""A fault at every file operation of every command, as SQLite is tested.

    python benchmarks/torture_faults.py [--out out/torture] [--only COMMAND] [--every N] [--distinct] [--seed N]
                                        [--operations-only]

Each command runs once undisturbed, on a campaign of 12 pulls, to count its file operations: to open, read, write,
rename, list, delete. Each of them then has two trials: once it fails, with an error number that it can give (the
numbers take turns), and once the process is killed at it. Where the process may have file systems of its own (Linux,
root), the command runs once for all of these trials and is forked before every operation; elsewhere once for each. The
command is also run with a limit on the size of files and, for root, with OUT on a file system that is too small; both
reach what C libraries write. Required, every time:

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
import re
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from faults.branches import branch_trials, can_branch
from faults.commands import prepared
from faults.file_operations import KILL, KINDS, Fault, Operation, errors_of
from faults.small_site import write_inputs
from faults.trial import Bench, Outcome, masked

IN_MEMORY = Path("/dev/shm")
COLUMNS = ("what", "tried", "held", "failed", "seed")


Trial = tuple[str, Outcome, list[str]]


def wanted(every: int, seed: int, distinct: bool) -> Callable[[int, Operation], list[str]]:
    """An error and a kill at each operation, or at each ``every``-th; the errors that one can give take turns.

    With ``distinct`` operations of one kind, from the same lines of tribo, on files of one kind in folders of one kind
    are tried once, and ``every`` counts these. The first one is given by the seed.
    """
    turns = {kind: itertools.count(seed) for kind in KINDS}
    tried: set[tuple[object, ...]] = set()

    def names(at: int, operation: Operation) -> list[str]:
        if distinct:
            like = (operation.kind, *kind_of_file(operation.path), *lines_of_tribo())
            if like in tried:
                return []
            at = len(tried)
            tried.add(like)
        if at % every != seed % every:
            return []
        possible = errors_of(operation.kind)
        return [possible[next(turns[operation.kind]) % len(possible)], KILL]

    return names


def kind_of_file(path: str) -> tuple[str, str, bool]:
    """The folder of a file without its numbers and random names, the ending, and whether it is hidden."""
    place = Path(masked(path))
    return re.sub(r"\d+", "", str(place.parent)), place.suffix, place.name.startswith(".")


def lines_of_tribo() -> Iterator[tuple[str, int]]:
    """The lines of tribo that are being executed, from the innermost outwards."""
    frame = sys._getframe()
    while (frame := frame.f_back) is not None:  # type: ignore[assignment]
        if frame.f_globals.get("__name__", "").startswith("tribo"):
            yield frame.f_code.co_filename, frame.f_lineno


def faults(bench: Bench, names: Callable[[int, Operation], list[str]], aside: Path) -> Iterator[Trial]:
    """All faults at the file operations of a command."""
    if can_branch():
        trials: Iterable[tuple[Fault, Outcome, list[str]]] = branch_trials(bench, names, aside)
    else:
        found = [Fault(at, name) for at, o in enumerate(bench.operations) for name in names(at, o)]
        trials = ((fault, *bench.trial(fault)) for fault in found)
    for fault, outcome, wrong in trials:
        what = "killed at file operations" if fault.name == KILL else "faults at file operations"
        yield what, outcome, [f"{fault.at} {fault.name}: {why}" for why in wrong]


def sizes(bench: Bench) -> Iterator[Trial]:
    """Limits of the size of a file, and file systems that are too small; a few of them for commands that take long."""
    few = 12 if len(bench.operations) < 600 else 4
    for k in range(few):
        limit = int(bench.written_bytes / 2 ** (k + 1)) if k else 0
        outcome, wrong = bench.with_largest_file(limit)
        yield "files not larger than a limit", outcome, [f"limit {limit}: {why}" for why in wrong]
    ready = bench.ready_bytes
    for share in range(few) if os.geteuid() == 0 else ():
        size = ready + max(bench.written_bytes - ready, 0) * share // few + 40960
        outcome, wrong = bench.on_full_disk(size)
        yield "disk full", outcome, [f"{size} bytes: {why}" for why in wrong]


@dataclass
class Table:
    """Trials by kind and command, and a line for everything that did not hold."""

    seed: int
    rows: dict[str, dict[str, int]] = field(default_factory=dict)
    failures: list[str] = field(default_factory=list)

    def add(self, trial: Trial, command: str) -> None:
        kind, outcome, wrong = trial
        what = f"{kind}: {command}"
        row = self.rows.setdefault(what, dict.fromkeys(COLUMNS[1:], 0) | {"seed": self.seed})
        row["tried"] += 1
        row["failed" if wrong else "held"] += 1
        if wrong:
            where = f"{outcome.struck.kind} {outcome.struck.path}" if outcome.struck else ""
            self.failures.append("\t".join((what, where, "; ".join(wrong), " ".join(outcome.said.split())[-400:])))

    def write(self, out: Path) -> None:
        with (out / "faults.csv").open("w", newline="", encoding="utf-8") as stream:
            table = csv.DictWriter(stream, COLUMNS)
            table.writeheader()
            table.writerows({"what": what, **row} for what, row in self.rows.items())
        text = "\n".join(self.failures) + "\n" * bool(self.failures)
        (out / "faults-failures.txt").write_text(text, encoding="utf-8")


def torture(bench: Bench, table: Table, given: argparse.Namespace, aside: Path) -> None:
    """All trials of one command."""
    name = bench.command.name
    assert bench.expected.status == 0, f"undisturbed, {name} ends with {bench.expected.status}: {bench.expected.said}"
    started = time.monotonic(), sum(os.times()[:4])
    for trial in faults(bench, wanted(given.every, given.seed, given.distinct), aside):
        table.add(trial, name)
        table.write(given.out)
    if not given.operations_only and name not in ("verify", "report again"):
        for trial in sizes(bench):
            table.add(trial, name)
            table.write(given.out)
    took, worked = time.monotonic() - started[0], sum(os.times()[:4]) - started[1]
    of_command = {what: row for what, row in table.rows.items() if what.endswith(f": {name}")}
    print(f"{name}: {len(bench.operations)} file operations, {took:.0f} s, {worked:.0f} s of processor time")
    for what, row in of_command.items():
        print(f"  {row['tried']:6} tried {row['held']:6} held  {what.partition(':')[0]}", flush=True)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/torture"))
    parser.add_argument("--only", action="append", help="name of a command; several may be given")
    parser.add_argument("--every", type=int, default=1, help="only each so manieth operation")
    parser.add_argument("--distinct", action="store_true", help="operations that are alike only once; see wanted()")
    parser.add_argument("--seed", type=int, default=0, help="also the first operation that --every takes")
    parser.add_argument("--operations-only", action="store_true", help="no limits of size, no full disk")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    table = Table(given.seed)
    with tempfile.TemporaryDirectory(prefix="torture-", dir=IN_MEMORY if IN_MEMORY.is_dir() else None) as folder:
        root = Path(folder).resolve()
        place = write_inputs(root / "watched")
        builds = not given.only or any("build" in name for name in given.only)
        for name, command in prepared(place, root, builds).items():
            if given.only and name not in given.only:
                continue
            torture(Bench(place, command), table, given, root / "aside")
    return 1 if table.failures else 0


if __name__ == "__main__":
    sys.exit(main())
