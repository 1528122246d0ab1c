"""Time and memory of `tribo diagnose` and `tribo report` against the number of tests of a campaign.

    python benchmarks/scale.py run OUT [--tests 324 1000 3000 10000] [--grows repeats specimens] [--command diagnose]
                                        [--columns 300]
    python benchmarks/scale.py table OUT

Campaigns are those of tests/blind: six samples, six loads, 700 data points a pull, with an effect of humidity for the
diagnosis to name. ``repeats`` keeps 18 labels of specimens and repeats their tests, ``specimens`` keeps three repeats
and measures more specimens. Each command is a process of its own with an empty output folder, on two processes. A line
of OUT/scale.jsonl holds the time it took, its processor time, the peak memory of all of its processes together (shared
memory counted once), the verdict and the size of the page. The table is in docs/results/benchmarks.md; the exponent is
that of a power law through all sizes.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

import numpy as np
import pandas as pd
import psutil
from blind.tribometer import Design, hide, write

TESTS = (324, 1000, 3000, 10_000)
COMMANDS, GROWS = ("diagnose", "report"), ("repeats", "specimens")
A_SPECIMEN, A_SAMPLE = 18, 54  # tests: six loads, three repeats; of three specimens
EFFECT = ("humidity", 1.0)
SEED = 7
EVERY_S = 1.0  # between two looks at the memory


def design_of(tests: int, grows: str) -> Design:
    """So many tests, by more repeats of each specimen or by more specimens."""
    times = -(-tests // (2 * A_SAMPLE * 3))
    base = Design(repeats=3 * times) if grows == "repeats" else Design(repeats=3, specimens=3 * times)
    made = len(base.samples) * base.specimens * len(base.masses_g) * base.repeats
    return replace(base, missing=1.0 - tests / made)


def campaign(out: Path, tests: int, grows: str, columns: int) -> Path:
    """The campaign on disk, made once; further ``columns`` are noise, few values, names and walks in turn."""
    folder = out / f"{grows}-{tests}-{columns}"
    if not (folder / "tests.csv").exists():
        shutil.rmtree(folder, ignore_errors=True)
        write(hide(SEED, [EFFECT], design_of(tests, grows)), folder, SEED)
        table, rng = pd.read_csv(folder / "tests.csv", dtype=str), np.random.default_rng(SEED)
        kinds = (
            lambda n: rng.normal(10.0, 2.0, n).round(2), lambda n: rng.integers(1, 5, n),
            lambda n: rng.choice(["a", "b", "c"], n), lambda n: rng.normal(size=n).cumsum().round(2),
        )  # fmt: skip
        further = pd.DataFrame({f"extra_{k}": kinds[k % len(kinds)](len(table)) for k in range(columns)})
        pd.concat([table, further], axis=1).to_csv(folder / "tests.csv", index=False)
    return folder


@dataclass
class Memory:
    """Most memory that a process and its children held at the same time, bytes; shared pages count once."""

    pid: int
    most: int = 0
    ended: bool = False

    def watch(self) -> None:
        """Until :attr:`ended` is set."""
        while not self.ended:
            self.most = max(self.most, self._now())
            time.sleep(EVERY_S)

    def _now(self) -> int:
        try:
            first = psutil.Process(self.pid)
            family = [first, *first.children(recursive=True)]
            return sum(p.memory_full_info().pss for p in family)
        except psutil.Error:
            return 0


def measured(command: str, folder: Path, out: Path, seconds: float) -> dict[str, Any]:
    """One command in a process of its own."""
    shutil.rmtree(out, ignore_errors=True)
    asked = [sys.executable, "-m", "tribo", command, str(folder), "-o", str(out), "-q", "--jobs", "2"]
    before, started = os.times(), time.monotonic()
    process = subprocess.Popen(asked, env={**os.environ, "OPENBLAS_NUM_THREADS": "1"})
    memory = Memory(process.pid)
    watcher = threading.Thread(target=memory.watch)
    watcher.start()
    try:
        status = process.wait(seconds)
    except subprocess.TimeoutExpired:
        process.kill()
        status = process.wait()
    memory.ended = True
    watcher.join()
    after = os.times()
    used = after.children_user + after.children_system - before.children_user - before.children_system
    record = {
        "status": status, "wall_s": round(time.monotonic() - started, 1), "processor_s": round(used, 1),
        "memory_GB": round(memory.most / 1e9, 2), "load_before": [round(v, 1) for v in os.getloadavg()],
    }  # fmt: skip
    verdict = out / "verdict.json"
    if verdict.exists():
        said = json.loads(verdict.read_text(encoding="utf-8"))
        record |= {"verdict": said["verdict"], "causes": [c["mechanism"] for c in said["causes"]]}
    pages = sorted(out.glob("*.html"))
    return record | {"page_MB": {p.name: round(p.stat().st_size / 1e6, 2) for p in pages}}


def run(
    out: Path, sizes: Iterable[int], grows: Iterable[str], commands: Iterable[str], columns: int, seconds: float
) -> None:
    out.mkdir(parents=True, exist_ok=True)
    for way in grows:
        for tests in sizes:
            folder = campaign(out, tests, way, columns)
            for command in commands:
                found = measured(command, folder, out / f"{way}-{tests}-{command}", seconds)
                line = json.dumps({"command": command, "grows": way, "tests": tests, "columns": columns} | found)
                print(line, flush=True)
                with (out / "scale.jsonl").open("a", encoding="utf-8") as lines:
                    lines.write(line + "\n")


def exponent(tests: list[int], values: list[float]) -> float:
    """Of the power law through the points, by least squares of the logarithms."""
    return float(np.polyfit(np.log(tests), np.log(values), 1)[0]) if len(tests) > 1 else float("nan")


def table(out: Path) -> str:
    """The latest line of every command and size, as a table."""
    rows: dict[tuple[str, str, int], dict[str, Any]] = {}
    for line in (out / "scale.jsonl").read_text(encoding="utf-8").splitlines():
        record = json.loads(line)
        rows[record["command"], record["grows"], record["tests"]] = record
    said = ["| command | grows by | tests | time | processor time | memory | pages |", "|---|---|---|---|---|---|---|"]
    for command in COMMANDS:
        for way in GROWS:
            found = [rows[key] for key in sorted(rows) if key[:2] == (command, way)]
            for r in found:
                pages = ", ".join(f"{size:.1f} MB" for size in r["page_MB"].values())
                said.append(
                    f"| {command} | {way} | {r['tests']} | {r['wall_s']:.0f} s | {r['processor_s']:.0f} s | "
                    f"{r['memory_GB']:.2f} GB | {pages} |"
                )
            if len(found) > 1:
                tests = [r["tests"] for r in found]
                powers = [exponent(tests, [r[name] for r in found]) for name in ("wall_s", "processor_s", "memory_GB")]
                said.append(f"| {command} | {way} | exponent | {' | '.join(f'{p:.2f}' for p in powers)} | |")
    return "\n".join(said)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("run", "table"))
    parser.add_argument("out", type=Path)
    parser.add_argument("--tests", type=int, nargs="+", default=TESTS)
    parser.add_argument("--grows", nargs="+", choices=GROWS, default=GROWS)
    parser.add_argument("--command", nargs="+", choices=COMMANDS, default=COMMANDS)
    parser.add_argument("--columns", type=int, default=0, help="further columns of tests.csv")
    parser.add_argument("--seconds", type=float, default=1800.0, help="after which a command is ended")
    given = parser.parse_args()
    if given.what == "run":
        run(given.out, given.tests, given.grows, given.command, given.columns, given.seconds)
    else:
        print(table(given.out))
    return 0


if __name__ == "__main__":
    sys.exit(main())
