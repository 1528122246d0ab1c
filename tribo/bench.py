"""Speed as ratios measured in one run: each pair is timed in turns, and the median of the ratios is told."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

Work = Callable[[], Any]


@dataclass(frozen=True)
class Ratio:
    """One line of the benchmark: seconds of two ways to do the same, and their ratio (ours over the other)."""

    name: str
    ours: str
    other: str
    ours_s: float
    other_s: float
    ratio: float
    lowest: float
    highest: float
    wanted: str
    rounds: int


def compare_in_turns(name: str, ours: tuple[str, Work], other: tuple[str, Work], wanted: str, rounds: int = 5) -> Ratio:
    """Time two pieces of work in turns, after one uncounted round of each."""
    ours[1](), other[1]()
    seconds = [(_timed(ours[1]), _timed(other[1])) for _ in range(rounds)]
    ratios = [a / b for a, b in seconds]
    return Ratio(
        name,
        ours[0],
        other[0],
        statistics.median(a for a, _ in seconds),
        statistics.median(b for _, b in seconds),
        statistics.median(ratios),
        min(ratios),
        max(ratios),
        wanted,
        rounds,
    )


def _timed(work: Work) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def ingest_against_pandas(path: Path, jobs: int = 1) -> Ratio:
    """Reading a campaign into pulls on ``jobs`` processes, against pandas.read_csv merely loading the same files."""
    import pandas as pd

    from tribo.campaign import open_campaign
    from tribo.stages import ingest

    with open_campaign(path) as campaign:
        ingested = ingest(campaign)
        known = []
        for test in campaign.tests:
            trace = ingested.traces.get(test.test_id)
            if trace is None or trace.source is None:
                continue
            form = trace.source
            known.append((campaign.root / test.file, form.delimiter, form.decimal, form.encoding, form.header_rows))

        def load_all() -> None:
            for file, sep, decimal, encoding, skip in known:
                pd.read_csv(file, sep=sep, decimal=decimal, encoding=encoding, skiprows=skip, header=None)

        return compare_in_turns(
            f"ingest {len(known)} exports",
            (f"tribo ingest, {jobs} processes", lambda: ingest(campaign, jobs=jobs)),
            ("pandas.read_csv of the same files", load_all),
            "under 3",
        )
