"""Speed as ratios measured in one run: each pair is timed alternately; the result is the median of the ratios."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tribo.simulate.engine_speed import Timing

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
    """Time two tasks alternately, after one round of each that is not counted."""
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


def against_pandas(path: Path, jobs: int = 1) -> list[Ratio]:
    """Time of reading a campaign, and of reducing it to pulls, relative to pandas.read_csv with known file layouts."""
    import pandas as pd

    from tribo.campaign import open_campaign
    from tribo.readers import read_export
    from tribo.stages import ingest

    with open_campaign(path) as campaign:
        known = [
            (campaign.root / trace.file, trace.source)
            for trace in ingest(campaign).traces.values()
            if trace.source is not None
        ]

        def load_all() -> None:
            for file, form in known:
                pd.read_csv(
                    file, sep=form.delimiter, decimal=form.decimal, encoding=form.encoding, skiprows=form.header_rows,
                    header=None,
                )  # fmt: skip

        def read_all() -> None:
            for file, _ in known:
                read_export(file)

        pandas = ("pandas.read_csv of the same files", load_all)
        return [
            compare_in_turns(f"read {len(known)} exports", ("tribo reads", read_all), pandas, "at most 2"),
            compare_in_turns(
                f"ingest {len(known)} exports, {jobs} processes",
                ("tribo reads and reduces to pulls", lambda: ingest(campaign, jobs=jobs)),
                pandas,
                "under 3",
            ),
        ]


def in_words(ratio: Ratio) -> str:
    """One ratio as a line."""
    return (
        f"{ratio.name}: {ratio.ours} {ratio.ours_s:.3g} s, {ratio.other} {ratio.other_s:.3g} s, "
        f"ratio {ratio.ratio:.2f} ({ratio.lowest:.2f} to {ratio.highest:.2f} in {ratio.rounds} rounds; "
        f"target {ratio.wanted})"
    )


def timing_in_words(timing: Timing) -> str:
    """One figure of the simulator as a line."""
    bound = "at least" if timing.better == "higher" else "at most"
    aim = "" if timing.aim is None else f", target {bound} {timing.aim:g}"
    note = f" ({timing.note})" if timing.note else ""
    return f"{timing.name}: {timing.value:.4g} {timing.unit}{aim}{note}"
