"""Commands killed at random moments, started again, and compared with a run that was left alone.

    python benchmarks/torture_kills.py [report | ensemble | build] [--kills 100] [--seed 1] [--rounds-of 5]

A round kills one command several times (SIGKILL to it and all its workers, at a moment drawn evenly over the time that
the command takes), lets the last start end, and compares every file of the results byte by byte, and looks for files
that a kill has left. Rounds of ``report`` begin with a random part of the kept results, so that kills fall into every
stage. Exit status 1 where anything differs.
"""

from __future__ import annotations

import argparse
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from torture_processes import (
    ENSEMBLE,
    REPORT,
    differing,
    ensemble,
    finished,
    leftovers,
    results,
    run,
    small_campaign,
    start,
    thinned,
)

BUILD = ("build", "../drop", "-o", "site", "--settle", "0", "--runs", "2", "--jobs", "2", "-q")
Round = Callable[[Path, int, random.Random], list[str]]


def kill_report(base: Path) -> Round:
    """Rounds of `tribo report` on one small campaign."""
    small_campaign(base / "campaign")
    run(base / "first", *REPORT)
    shutil.copytree(base / "first" / "out" / "kept", base / "untouched" / "out" / "kept")
    began = time.monotonic()
    assert run(base / "untouched", *REPORT) == 0
    took = time.monotonic() - began
    expected = results(base / "untouched" / "out")

    def one(folder: Path, kills: int, rng: random.Random) -> list[str]:
        thinned(base / "first" / "out" / "kept", folder / "out" / "kept", rng)
        for _ in range(kills):
            _kill_after(start(folder, *REPORT), rng.random() * took)
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
        for _ in range(kills):
            _kill_after(start(folder, *asked), rng.random() * took / kills)
        status = run(folder, *asked)
        same = ensemble(folder / "e.nc") == expected
        return [f"status {status}"] * (status != 0) + ["e.nc"] * (not same) + leftovers(folder)

    return one


def _kill_after(command: object, seconds: float) -> None:
    if command.wait(seconds) is None:  # type: ignore[attr-defined]
        command.kill()  # type: ignore[attr-defined]


def kill_build(base: Path) -> Round:
    """Rounds of `tribo build` on a drop folder of one campaign."""
    small_campaign(base / "drop" / "a")
    began = time.monotonic()
    assert _build(base / "untouched").wait() == 0
    took = time.monotonic() - began
    expected = results(base / "untouched" / "site" / "current")

    def one(folder: Path, kills: int, rng: random.Random) -> list[str]:
        for _ in range(kills):
            process = _build(folder)
            try:
                process.wait(rng.random() * took / 2)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
        status = _build(folder).wait()
        site = folder / "site"
        found = differing(results(site / "current"), expected) + leftovers(site / "current")
        copied = differing(results(site / "latest"), {**expected, ".number": ""}) != [".number"]
        return [f"status {status}"] * (status != 0) + found + ["latest"] * copied

    return one


def _build(folder: Path) -> subprocess.Popen[bytes]:
    folder.mkdir(exist_ok=True)
    with (folder.parent / f"{folder.name}.log").open("ab") as log:
        return subprocess.Popen(
            [sys.executable, "-m", "tribo", *BUILD], cwd=folder, start_new_session=True, stdout=log, stderr=log,
            env={**os.environ, "SOURCE_DATE_EPOCH": "1700000000"},
        )  # fmt: skip


KINDS = {"report": kill_report, "ensemble": kill_ensemble, "build": kill_build}


def main() -> int:
    """Kill as often as asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kind", choices=KINDS)
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--rounds-of", type=int, default=5, help="kills before a start is left to end")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    rng = random.Random(given.seed)
    failures: list[str] = []
    done = 0
    with tempfile.TemporaryDirectory(prefix="tribo-torture-") as base:
        one = KINDS[given.kind](Path(base))
        while done < given.kills:
            kills = min(given.rounds_of, given.kills - done)
            folder = Path(base) / f"trial-{done}"
            found = one(folder, kills, rng)
            failures += [f"after kill {done + kills}: {what}" for what in found]
            if not found:
                shutil.rmtree(folder)
            done += kills
            print(f"{done} of {given.kills} kills, {len(failures)} differences", file=sys.stderr, flush=True)
    return finished(f"kills of {given.kind}", {"kills": done, "seed": given.seed}, failures)


if __name__ == "__main__":
    sys.exit(main())
