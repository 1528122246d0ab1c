"""Two processes at once on one folder of results, file or site: the results are wholly those of one of them.

    python benchmarks/torture_pairs.py [report | ensemble | build] [--pairs 50] [--seed 1]

The two differ in an option (report: weights of the fit; ensemble: the same runs or, in every second pair, others), or
are the same (build), and the second starts after a random part of the time that one takes. Each has to end with status
0, or with 75 because it was refused; one at least with 0. Then every file must be that of one of the two run alone, no
run may be missing, and `tribo verify` must find no difference. Exit status 1 where anything differs.
"""

from __future__ import annotations

import random
import shutil
import sys
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path

from torture_processes import (
    ENSEMBLE,
    REPORT,
    begun_site,
    ensemble,
    finished,
    folder_of_trials,
    leftovers,
    options,
    quick_builds,
    quick_reports,
    results,
    run,
    start,
    told,
    zipped_campaign,
)

BUSY = 75
Pair = Callable[[Path, int, random.Random], tuple[tuple[int | None, ...], list[str]]]


def pair_reports(base: Path) -> Pair:
    """Pairs of `tribo report` with other weights."""
    zipped_campaign(base / "campaign")
    ways = [REPORT, (*REPORT, "--weights", "force")]
    quick_reports(base, *ways)
    expected, took = [], 1.0
    for k, way in enumerate(ways):
        run(base / f"first-{k}", *way)
        shutil.rmtree(base / f"first-{k}" / "out" / "figures")
        began = time.monotonic()
        assert run(base / f"first-{k}", *way) == 0
        took = time.monotonic() - began
        expected.append(results(base / f"first-{k}" / "out"))

    def one(folder: Path, number: int, rng: random.Random) -> tuple[tuple[int | None, ...], list[str]]:
        for k in (0, 1):
            shutil.copytree(base / f"first-{k}" / "out" / "kept", folder / "out" / "kept", dirs_exist_ok=True)
        waiting = ("--wait", "600") if number % 3 == 0 else ()
        first = start(folder, *ways[number % 2])
        time.sleep(rng.random() * took)
        second = start(folder, *ways[1 - number % 2], *waiting)
        ended = first.wait(), second.wait()
        found = results(folder / "out")
        wrong = [] if any(_same_but_command(found, one) for one in expected) else ["mixed or incomplete results"]
        verified = run(folder, "verify", "out")
        return ended, wrong + [f"verify: status {verified}"] * (verified != 0) + leftovers(folder)

    return one


def _same_but_command(found: dict[str, str], expected: dict[str, str]) -> bool:
    """Equal results; where the commands differ by --wait, files that hold the command differ with it."""
    with_command = {"provenance.json", "ro-crate-metadata.json", "report.html", "report.pdf", "campaign.nc"}
    return found.keys() == expected.keys() and all(
        found[name] == expected[name] for name in found if name not in with_command
    )


def pair_ensembles(base: Path) -> Pair:
    """Pairs of `tribo simulate` on one file, with the same runs or with others."""
    ways = [(*ENSEMBLE, "6"), (*ENSEMBLE, "5")]
    expected, took = [], 1.0
    for k, way in enumerate(ways):
        began = time.monotonic()
        assert run(base / f"first-{k}", *way) == 0
        took = time.monotonic() - began
        expected.append(ensemble(base / f"first-{k}" / "e.nc"))

    def one(folder: Path, number: int, rng: random.Random) -> tuple[tuple[int | None, ...], list[str]]:
        first = start(folder, *ways[0])
        time.sleep(rng.random() * took * (number % 5) / 4)
        second = start(folder, *ways[number % 2], *(("--wait", "600") if number % 3 == 0 else ()))
        ended = first.wait(), second.wait()
        if ended[number % 2] == 1:  # the other runs were there first: refused by the design
            ended = (*ended[: number % 2], BUSY, *ended[number % 2 + 1 :])
        wrong = [] if ensemble(folder / "e.nc") in expected else ["mixed or missing runs"]
        return ended, wrong + leftovers(folder)

    return one


def pair_builds(base: Path) -> Pair:
    """Pairs of `tribo build` of one site."""
    builds = quick_builds(base)

    def one(folder: Path, number: int, rng: random.Random) -> tuple[tuple[int | None, ...], list[str]]:
        site = begun_site(folder)
        shutil.copytree(builds.kept, site / "current" / "a" / "kept")
        first = builds.start(folder)
        time.sleep(rng.random() * builds.seconds * (number % 5) / 4)
        second = builds.start(folder, *(("--wait", "600") if number % 3 == 0 else ()))
        ended = first.wait(), second.wait()
        same = results(site / "current") == builds.expected
        return ended, ["mixed or incomplete results"] * (not same) + leftovers(folder)

    return one


KINDS = {"report": pair_reports, "ensemble": pair_ensembles, "build": pair_builds}


def main() -> int:
    """Start as many pairs as asked for."""
    given = options(__doc__, KINDS, "pairs", 50).parse_args()
    rng = random.Random(given.seed)
    failures: list[str] = []
    statuses: Counter[str] = Counter()
    with folder_of_trials() as base:
        one = KINDS[given.kind](base)
        for number in range(given.trials):
            folder = base / f"pair-{number}"
            ended, found = one(folder, number, rng)
            statuses[" and ".join(map(str, sorted(map(int, map(str, ended)))))] += 1
            if not set(ended) <= {0, BUSY} or 0 not in ended:
                found = [*found, f"statuses {ended}"]
            failures += [f"pair {number}: {what}" for what in found]
            if not found:
                shutil.rmtree(folder)
            told(number + 1, given, "pairs", failures)
    record = {"pairs": given.trials, "seed": given.seed, "statuses": dict(statuses)}
    return finished(f"pairs of {given.kind}", record, failures)


if __name__ == "__main__":
    sys.exit(main())
