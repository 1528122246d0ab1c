"""Kept results and stored ensembles with one flipped bit each: none may give another result in silence.

    python benchmarks/torture_flips.py [--flips 1000] [--seed 1] [--reports 10]

Half of the flips hit the kept results of a report (.json), half stored ensembles (.nc), at bits drawn evenly over the
bytes of each file. Every damaged file is read in a process of its own, so that a crash or a hang is seen: the result is
the same, made again, or refused. ``--reports`` of the damaged folders are also given to `tribo report`, whose files are
compared byte by byte. Exit status 1 where a result differs, or a process crashes or takes more than 20 s of processor
time or 120 s in all.
"""

from __future__ import annotations

import argparse
import os
import random
import re
import resource
import shutil
import signal
import sys
import tempfile
import time
import warnings
from collections import Counter
from pathlib import Path
from typing import Any
from unittest.mock import patch

from torture_processes import REPORT, differing, ensemble, finished, quick_reports, results, run, zipped_campaign

from tribo.errors import TriboError
from tribo.kept_results import fingerprint, kept_or_made
from tribo.springblock import SimConfig, simulate, stratified_design
from tribo.springblock.kept_runs import run_stored

PROCESSOR_S, WALL_S = 20, 120.0
SAME, MADE_AGAIN, REFUSED, DIFFERENT, CRASHED = range(5)
WORDS = ("the same", "made again", "refused", "DIFFERENT", "CRASHED OR HANGS")
SMALL = SimConfig(blocks=(40, 40), dt_s=1e-7, rest_tolerance=1e-2)


class MadeAgainError(Exception):
    """A kept result was to be made again."""


def flipped(intact: bytes, rng: random.Random) -> bytes:
    """The bytes with one bit turned."""
    damaged = bytearray(intact)
    damaged[rng.randrange(len(intact))] ^= 1 << rng.randrange(8)
    return bytes(damaged)


def kept_outcome(path: Path, key: str, expected: str) -> int:
    """What reading a damaged kept result comes to."""

    def again() -> Any:
        raise MadeAgainError

    with warnings.catch_warnings(), patch("tribo.kept_results.fingerprint", lambda *_: key):
        warnings.simplefilter("ignore")
        try:
            found = kept_or_made(path.parent, path.stem, None, again)
        except MadeAgainError:
            return MADE_AGAIN
    return SAME if fingerprint(found) == expected else DIFFERENT


def store_outcome(path: Path, design: list[SimConfig], runs: dict[SimConfig, Any], expected: str) -> int:
    """What continuing a damaged store comes to; runs made again are looked up."""
    made = []

    def look_up(config: SimConfig, threads: int) -> Any:
        made.append(config)
        return runs[config]

    with warnings.catch_warnings(), patch("tribo.springblock.ensemble.simulate", look_up):
        warnings.simplefilter("ignore")
        try:
            run_stored(design, path, 1)
        except TriboError:
            return REFUSED
    if ensemble(path) != expected:
        return DIFFERENT
    return MADE_AGAIN if made else SAME


def in_child(function: Any, *arguments: Any) -> int:
    """The outcome of a function in a forked process; a crash or a hang is an outcome too."""
    pid = os.fork()
    if not pid:
        resource.setrlimit(resource.RLIMIT_CPU, (PROCESSOR_S, PROCESSOR_S))
        try:
            os._exit(function(*arguments))
        except BaseException:
            import traceback

            traceback.print_exc()
            os._exit(CRASHED)
    until = time.monotonic() + WALL_S
    while True:
        done, code = os.waitpid(pid, os.WNOHANG)
        if done:
            status = os.waitstatus_to_exitcode(code)
            return status if 0 <= status <= CRASHED else CRASHED
        if time.monotonic() > until:
            os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)
            return CRASHED
        time.sleep(0.001)


def flip_kept(kept: Path, work: Path, flips: int, rng: random.Random) -> Counter[int]:
    """Flips in the .json files of a folder of kept results."""
    work.mkdir()
    outcomes: Counter[int] = Counter()
    files = sorted(kept.glob("*.json"))
    for k in range(flips):
        intact = files[k % len(files)]
        content = intact.read_bytes()
        found = re.match(rb'\{"made_from": "([0-9a-f]{64})"', content)
        assert found is not None
        key = found[1].decode()
        with patch("tribo.kept_results.fingerprint", lambda *_, key=key: key):
            expected = fingerprint(kept_or_made(kept, intact.stem, None, dict))
        (work / intact.name).write_bytes(flipped(content, rng))
        outcomes[in_child(kept_outcome, work / intact.name, key, expected)] += 1
    return outcomes


def flip_stores(work: Path, flips: int, rng: random.Random) -> Counter[int]:
    """Flips in stored ensembles, finished ones."""
    work.mkdir()
    design = stratified_design(["F", "B"], [5e3, 12e3], 2, base=SMALL)
    runs = {config: simulate(config) for config in design}
    run_stored(design, work / "intact.nc", 1)
    expected, intact = ensemble(work / "intact.nc"), (work / "intact.nc").read_bytes()
    outcomes: Counter[int] = Counter()
    for _ in range(flips):
        (work / "e.nc").write_bytes(flipped(intact, rng))
        outcomes[in_child(store_outcome, work / "e.nc", design, runs, expected)] += 1
    return outcomes


def flip_and_report(base: Path, trials: int, rng: random.Random) -> list[str]:
    """Whole reports on kept results with one flip each."""
    expected = results(base / "first" / "out")
    failures = []
    for k in range(trials):
        kept = base / f"flipped-{k}" / "out" / "kept"
        shutil.copytree(base / "first" / "out" / "kept", kept)
        file = rng.choice(sorted(kept.iterdir()))
        file.write_bytes(flipped(file.read_bytes(), rng))
        status = run(kept.parents[1], *REPORT)
        found = differing(results(kept.parent), expected)
        failures += [f"report with a flip in {file.name}: status {status}, {found}"] if status or found else []
        print(f"{k + 1} of {trials} reports", file=sys.stderr, flush=True)
    return failures


def main() -> int:
    """Flip as often as asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flips", type=int, default=1000)
    parser.add_argument("--reports", type=int, default=10)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    rng = random.Random(given.seed)
    with tempfile.TemporaryDirectory(prefix="tribo-torture-") as name:
        base = Path(name)
        zipped_campaign(base / "campaign")
        quick_reports(base, REPORT)
        assert run(base / "first", *REPORT) == 0
        outcomes = {"kept": flip_kept(base / "first" / "out" / "kept", base / "kept", given.flips // 2, rng)}
        print("kept results done", file=sys.stderr, flush=True)
        outcomes["stores"] = flip_stores(base / "stores", given.flips - given.flips // 2, rng)
        print("stores done", file=sys.stderr, flush=True)
        failures = flip_and_report(base, given.reports, rng)
    failures += [f"{n} {what}: {WORDS[k]}" for what, found in outcomes.items() for k, n in found.items() if k > REFUSED]
    said = {what: {WORDS[k]: n for k, n in sorted(found.items())} for what, found in outcomes.items()}
    return finished("flips", {"flips": given.flips, "reports": given.reports, "seed": given.seed, **said}, failures)


if __name__ == "__main__":
    sys.exit(main())
