"""Commands killed at random moments, started again, and compared with a run that was left alone.

    python benchmarks/torture_kills.py [report | ensemble | build] [--kills 100] [--seed 1] [--rounds-of 5]

A round kills one command several times (SIGKILL to it and all its workers, at a moment drawn evenly over the time that
the command takes), lets the last start end, and compares every file of the results byte by byte, and looks for files
that a kill has left. Rounds of ``report`` and ``build`` begin with a random part of the kept results, so that kills
fall into every stage. Exit status 1 where anything differs.
"""

from __future__ import annotations

import random
import shutil
import sys
import time
from collections.abc import Callable
from pathlib import Path

from torture_processes import (
    ENSEMBLE,
    REPORT,
    Command,
    begun_site,
    differing,
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
    thinned,
    told,
    zipped_campaign,
)

Round = Callable[[Path, int, random.Random], list[str]]


def kill_report(base: Path) -> Round:
    """Rounds of `tribo report` on one small campaign."""
    zipped_campaign(base / "campaign")
    quick_reports(base, REPORT)
    run(base / "first", *REPORT)
    shutil.copytree(base / "first" / "out" / "kept", base / "untouched" / "out" / "kept")
    began = time.monotonic()
    assert run(base / "untouched", *REPORT) == 0
    took = time.monotonic() - began
    expected = results(base / "untouched" / "out")

    def one(folder: Path, kills: int, rng: random.Random) -> list[str]:
        thinned(base / "first" / "out" / "kept", folder / "out" / "kept", rng)
        _kill(lambda: start(folder, *REPORT), kills, lambda: rng.random() * took)
        status = run(folder, *REPORT)
        found = differing(results(folder / "out"), expected) + leftovers(folder)
        return [f"status {status}"] * (status != 0) + found

    return one


def kill_ensemble(base: Path) -> Round:
    """Rounds of `tribo simulate` with several runs."""
    asked = (*ENSEMBLE, "8")
    began = time.monotonic()
    assert run(base / "untouched", *asked) == 0
    took = time.monotonic() - began
    expected = ensemble(base / "untouched" / "e.nc")

    def one(folder: Path, kills: int, rng: random.Random) -> list[str]:
        _kill(lambda: start(folder, *asked), kills, lambda: rng.random() * took / kills)
        status = run(folder, *asked)
        same = ensemble(folder / "e.nc") == expected
        return [f"status {status}"] * (status != 0) + ["e.nc"] * (not same) + leftovers(folder)

    return one


def _kill(starting: Callable[[], Command], kills: int, moments: Callable[[], float]) -> None:
    """Start a command and kill it at a moment (s), until so many of its processes were killed before they ended."""
    hit = 0
    while hit < kills:
        command = starting()
        if command.wait(moments()) is None:
            command.kill()
            hit += 1


def kill_build(base: Path) -> Round:
    """Rounds of `tribo build` on a drop folder of one campaign."""
    builds = quick_builds(base)

    def one(folder: Path, kills: int, rng: random.Random) -> list[str]:
        site = begun_site(folder)
        thinned(builds.kept, site / "current" / "a" / "kept", rng)
        _kill(lambda: builds.start(folder), kills, lambda: rng.random() * builds.seconds / 2)
        status = builds.start(folder).wait()
        found = differing(results(site / "current"), builds.expected) + leftovers(folder)
        copied = differing(results(site / "latest"), {**builds.expected, ".number": ""}) != [".number"]
        return [f"status {status}"] * (status != 0) + found + ["latest"] * copied

    return one


KINDS = {"report": kill_report, "ensemble": kill_ensemble, "build": kill_build}


def main() -> int:
    """Kill as often as asked for."""
    parser = options(__doc__, KINDS, "kills", 100)
    parser.add_argument("--rounds-of", type=int, default=5, help="kills before a start is left to end")
    given = parser.parse_args()
    rng = random.Random(given.seed)
    failures: list[str] = []
    done = 0
    with folder_of_trials() as base:
        one = KINDS[given.kind](base)
        while done < given.trials:
            kills = min(given.rounds_of, given.trials - done)
            folder = base / f"trial-{done}"
            found = one(folder, kills, rng)
            failures += [f"after kill {done + kills}: {what}" for what in found]
            if not found:
                shutil.rmtree(folder)
            done += kills
            told(done, given, "kills", failures)
    return finished(f"kills of {given.kind}", {"kills": done, "seed": given.seed}, failures)


if __name__ == "__main__":
    sys.exit(main())
