"""Every benchmark that tries to make tribo lose something, one after another, and one table of what came out.

    python benchmarks/torture.py [--out out/torture] [--only NAME]

What each prints is kept in OUT/NAME.txt. The table is printed, and written to OUT/torture.md. Exit status 1 if
anything did not hold or a benchmark did not end.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
RUNS = {
    "faults": ("faults", "--distinct", "--out", "{out}"),
    "flips": ("flips", "--flips", "1000"),
    "inputs": ("inputs", "--cases", "2000"),
    "kills-of-report": ("kills", "report", "--kills", "100"),
    "kills-of-build": ("kills", "build", "--kills", "50"),
    "kills-of-ensemble": ("kills", "ensemble", "--kills", "50"),
    "pairs-of-report": ("pairs", "report", "--pairs", "50"),
    "pairs-of-build": ("pairs", "build", "--pairs", "50"),
    "pairs-of-ensemble": ("pairs", "ensemble", "--pairs", "50"),
}  # fmt: skip


def row(name: str, out: Path) -> tuple[str, int]:
    """Run one benchmark; its line of the table, and its exit status."""
    script, *options = (part.format(out=out) for part in RUNS[name])
    command = [sys.executable, str(HERE / f"torture_{script}.py"), *options]
    started = time.monotonic()
    with (out / f"{name}.txt").open("w", encoding="utf-8") as said:
        status = subprocess.run(command, stdout=said, stderr=subprocess.STDOUT, check=False).returncode
    held = {0: "all held", 1: "not all held"}.get(status, f"ended with exit status {status}")
    words = " ".join([f"torture_{script}.py", *options])
    return f"| {name} | `{words}` | {held} | {time.monotonic() - started:.0f} |", status


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/torture"))
    parser.add_argument("--only", action="append", choices=list(RUNS), help="name of a run; several may be given")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    rows = ["| run | command | what came out | seconds |", "|---|---|---|---|"]
    failed = False
    for name in given.only or RUNS:
        line, status = row(name, given.out)
        failed |= status != 0
        rows.append(line)
        print(line, flush=True)
    (given.out / "torture.md").write_text("\n".join(rows) + "\n", encoding="utf-8")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
