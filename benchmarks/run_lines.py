"""Runs that append one JSON line for each piece of work, and go on where they were stopped."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

Row = dict[str, Any]


def read_rows(path: Path) -> list[Row]:
    """The lines of a run; one cut short by a kill is left out."""
    rows = []
    for line in path.read_text().splitlines() if path.exists() else ():
        try:
            rows.append(json.loads(line))
        except json.JSONDecodeError:
            continue
    return rows


def work_off(
    todo: Iterable[Any], work: Callable[[Any], Row], path: Path, jobs: int, said: Callable[[Row], str]
) -> None:
    """Append a line for each piece of work as it ends, and print what is ``said`` of it and how long the rest takes.

    An error of one piece ends the run at once, instead of after all the others.
    """
    todo, begin = list(todo), time.monotonic()
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.exists() and not path.read_bytes().endswith(b"\n"):
        path.write_bytes(path.read_bytes() + b"\n")
    with ProcessPoolExecutor(jobs) as pool, path.open("a") as file:
        waiting = [pool.submit(work, piece) for piece in todo]
        for done, future in enumerate(as_completed(waiting), start=1):
            if future.exception() is not None:
                pool.shutdown(cancel_futures=True)
            row = future.result()
            file.write(json.dumps(row) + "\n")
            file.flush()
            left = (time.monotonic() - begin) / done * (len(todo) - done) / 60
            print(f"{done}/{len(todo)}, {left:.0f} min left: {said(row)}", flush=True)
