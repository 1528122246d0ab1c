"""Every benchmark that tries to make tribo lose something, one after another, and one table of what came out.

    python benchmarks/torture.py [--out out/torture] [--only NAME] [--seed N]

Starts each ``benchmarks/torture_NAME.py --out OUT --seed N``. Each writes OUT/NAME.csv (what was tried, how often, how
often the requirement held) and OUT/NAME-failures.txt. The table is printed, and written to OUT/torture.md. Exit status
1 if anything did not hold or a benchmark did not end.
"""

from __future__ import annotations

import argparse
import csv
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent


def benchmarks(only: list[str] | None) -> list[Path]:
    """The benchmarks to run, by name; what they share is no program."""
    found = sorted(p for p in HERE.glob("torture_*.py") if "__main__" in p.read_text(encoding="utf-8"))
    return [path for path in found if not only or path.stem.removeprefix("torture_") in only]


def rows_of(out: Path, name: str) -> list[dict[str, str]]:
    """What a benchmark wrote; nothing where it did not get that far."""
    path = out / f"{name}.csv"
    if not path.is_file():
        return []
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def table(rows: list[dict[str, str]]) -> str:
    """The rows as a Markdown table."""
    lines = ["| what | tried | held | did not | seconds | seed |", "|---|---|---|---|---|---|"]
    lines += [f"| {' | '.join(r[c] for c in ('what', 'tried', 'held', 'failed', 'seconds', 'seed'))} |" for r in rows]
    return "\n".join(lines) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/torture"))
    parser.add_argument("--only", action="append", help="name of a benchmark; several may be given")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    rows: list[dict[str, str]] = []
    unfinished = []
    for path in benchmarks(given.only):
        name = path.stem.removeprefix("torture_")
        (given.out / f"{name}.csv").unlink(missing_ok=True)
        command = [sys.executable, str(path), "--out", str(given.out), "--seed", str(given.seed)]
        status = subprocess.run(command, check=False).returncode
        found = rows_of(given.out, name)
        rows += found
        if status not in (0, 1) or not found:
            unfinished.append(f"{path.name} ended with exit status {status}")
    text = table(rows)
    (given.out / "torture.md").write_text(text, encoding="utf-8")
    print(text, *unfinished, sep="\n")
    return 1 if unfinished or any(int(row["failed"]) for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
