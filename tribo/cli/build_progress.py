"""The progress of a build: one moving line on a terminal, a line for every change elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from tribo.cli.console import Console
from tribo.pipeline.live import Progress

EVERY_S = 30.0  # a line at least this often, also where nothing changes
MOST_NAMED = 3
Report = Callable[[Progress], None]


@contextmanager
def build_progress(console: Console) -> Iterator[Report]:
    """A function that shows how far a build is; it shows nothing with -q."""
    if console.verbosity < 0:
        yield lambda progress: None
    elif sys.stderr.isatty():
        with _moving_line() as report:
            yield report
    else:
        yield _Lines(console)


class _Lines:
    """Print a line whenever other steps run, and every half minute."""

    def __init__(self, console: Console):
        self._console = console
        self._started = time.monotonic()
        self._said: tuple[float, tuple[str, ...]] = (0.0, ())

    def __call__(self, progress: Progress) -> None:
        now = time.monotonic()
        when, running = self._said
        if not progress.running or (running == progress.running and now - when < EVERY_S):
            return
        self._said = now, progress.running
        self._console.say(in_words(progress, now - self._started))


def in_words(progress: Progress, spent_s: float) -> str:
    """"3 of 12 steps (40 s, about 2 min left): a: fitting laws"."""
    named = "; ".join(progress.running[:MOST_NAMED])
    more = len(progress.running) - MOST_NAMED
    left = f", about {_duration(left_s)} left" if (left_s := seconds_left(progress, spent_s)) is not None else ""
    steps = f"{progress.done} of {progress.total} steps ({_duration(spent_s)}{left})"
    return f"{steps}: {named}{f' and {more} more' if more > 0 else ''}"


def seconds_left(progress: Progress, spent_s: float) -> float | None:
    """Time left if the rest goes as fast as what is done; None before anything is done."""
    return spent_s * (1.0 - progress.share) / progress.share if progress.share > 0 else None


def _duration(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 120 else f"{seconds / 60:.0f} min"


@contextmanager
def _moving_line() -> Iterator[Report]:
    from rich.console import Console as RichConsole
    from rich.progress import BarColumn, Progress as Bars, TextColumn

    with Bars(TextColumn("{task.description}"), BarColumn(), console=RichConsole(stderr=True)) as bars:
        task, started = bars.add_task("starting", total=1.0), time.monotonic()

        def report(progress: Progress) -> None:
            bars.update(task, completed=progress.share, description=in_words(progress, time.monotonic() - started))

        yield report
