"""Shared by all commands: common options, progress, errors as text or JSON, exit statuses."""

from __future__ import annotations

import functools
import json
import logging
import math
import os
import shutil
import sys
import textwrap
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from typing import Any

import click

from tribo.cli.grouped_faults import doubts_text, faults_text, set_aside_text
from tribo.cli.interruption import damage_said, ended_by_terminate
from tribo.errors import Problem, TriboError, failed_by_system, of_the_system, system_problem, unexpected
from tribo.escaping import printable
from tribo.records import Doubt, SetAside
from tribo.store.lock import BusyError

DONE, UNUSABLE, SOME_SET_ASIDE = 0, 1, 3
INTERRUPTED = 130
BUSY = 75  # EX_TEMPFAIL of sysexits.h: nothing is wrong, try again later


@dataclass(frozen=True)
class Console:
    """Output of a command: results to standard output, everything else to standard error."""

    as_json: bool = False
    verbosity: int = 0

    def say(self, text: str, *, level: int = 0) -> None:
        """Print a line to standard error; level 1 is shown only with -v, level -1 even with -q."""
        if self.verbosity >= level:
            click.echo(printable(text), err=True)

    def list_tests(self, what: str, tests: Sequence[SetAside], *, level: int = 0) -> None:
        """The tests of one kind with their reasons, equal ones grouped; nothing where there are none."""
        if tests:
            lines = set_aside_text(tests, all_of_them=self.verbosity > 0)
            self.say(f"{len(tests)} test{'s' if len(tests) != 1 else ''} {what}:\n{lines}", level=level)

    def status_after(self, set_aside: Sequence[SetAside]) -> int:
        """The exit status of finished work, once the tests that were set aside are listed, even with -q."""
        self.list_tests("set aside", set_aside, level=-1)
        return status_of(set_aside)

    def list_problems(self, problems: Sequence[Problem]) -> None:
        """What stands in the way, equal ones grouped; shown even with -q, nothing where there is none."""
        if problems:
            lines = faults_text(problems, all_of_them=self.verbosity > 0)
            self.say(f"{len(problems)} problem{'s' if len(problems) != 1 else ''}:\n{lines}", level=-1)

    def list_doubts(self, doubts: Sequence[Doubt]) -> None:
        """Numbers outside their broad physical bounds; shown even with -q, nothing where there are none."""
        if doubts:
            number = f"{len(doubts)} doubtful number{'s' if len(doubts) != 1 else ''}"
            self.say(f"{number}:\n{doubts_text(doubts)}", level=-1)

    def result(self, record: dict[str, Any], text: str) -> None:
        """The result itself: JSON where asked for, else ``text``."""
        if self.as_json:
            text = json.dumps(without_nan(record), indent=1, default=str)
        elif sys.stdout.isatty():
            text = wrapped(text, shutil.get_terminal_size().columns)
        click.echo(text if self.as_json else printable(text))

    @contextmanager
    def progress(self) -> Iterator[Callable[[str, int, int], None]]:
        """A function (stage, done, total): a bar with the time left on a terminal, plain lines elsewhere."""
        if self.verbosity < 0:
            yield lambda stage, done, total: None
        elif sys.stderr.isatty():
            with _bars() as report:
                yield report
        else:
            yield _PlainLines(self)


def wrapped(text: str, width: int) -> str:
    """The text with long sentences wrapped at ``width`` columns; tables (columns two spaces apart) stay as they are."""
    lines = []
    for line in text.splitlines():
        indent = line[: len(line) - len(line.lstrip())]
        if len(line) <= width or "  " in line.strip():
            lines.append(line)
        else:
            lines += textwrap.wrap(line, width, subsequent_indent=f"{indent}  " if indent else "")
    return "\n".join(lines)


class _PlainLines:
    """Print a line every ten seconds while a stage runs, and when it ends."""

    def __init__(self, console: Console):
        self._console = console
        self._started: dict[str, tuple[float, int]] = {}  # when, and how much was done before
        self._last: dict[str, float] = {}

    def __call__(self, stage: str, done: int, total: int) -> None:
        now = time.monotonic()
        start, before = self._started.setdefault(stage, (now, done if done < total else 0))
        if done < total and now - self._last.setdefault(stage, now) < 10.0:
            return
        self._last[stage] = now
        spent = now - start
        left = f", {spent / (done - before) * (total - done):.0f} s left" if before < done < total else ""
        self._console.say(f"{stage}: {done} of {total} ({spent:.0f} s{left})")


@contextmanager
def _bars() -> Iterator[Callable[[str, int, int], None]]:
    from rich.console import Console as RichConsole
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn as TimeLeft,
    )

    text = TextColumn("{task.description:<28}")
    columns = (text, BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TimeLeft())
    # drawn by hand: a refreshing thread would forbid the reading stage to fork
    with Progress(*columns, console=RichConsole(stderr=True), auto_refresh=False) as bars:
        tasks: dict[str, Any] = {}
        drawn = 0.0

        def report(stage: str, done: int, total: int) -> None:
            nonlocal drawn
            if stage not in tasks:
                tasks[stage] = bars.add_task(stage, total=total, completed=done)
            bars.update(tasks[stage], completed=done, total=total)
            now = time.monotonic()
            if done >= total or now - drawn > 0.1:
                drawn = now
                bars.refresh()

        yield report


def without_nan(value: Any) -> Any:
    """The same record with null for NaN and infinite numbers, which JSON does not have."""
    if isinstance(value, dict):
        return {key: without_nan(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [without_nan(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def set_aside_record(set_aside: Sequence[SetAside]) -> list[dict[str, Any]]:
    """The same for JSON, with every problem in full."""
    return [{"test_id": s.test_id, "reason": s.reason, "problems": [asdict(p) for p in s.problems]} for s in set_aside]


def status_of(set_aside: Sequence[SetAside]) -> int:
    """Exit status of finished work: 3 where a fault set a test aside, 0 where only the user's ``exclude`` did."""
    return SOME_SET_ASIDE if any(s.problems for s in set_aside) else DONE


def command_options(function: Callable[..., int | None]) -> Callable[..., None]:
    """Add --json, --seed, --jobs, -v, -q and --debug; errors become a list and exit status 1, never a traceback."""

    @click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
    @click.option("--seed", type=int, default=0, show_default=True, help="Seed of all random numbers.")
    @click.option(
        "--jobs",
        type=click.IntRange(min=1),
        default=os.cpu_count() or 1,
        help="Number of parallel jobs.  [default: all cores]",
    )
    @click.option("-v", "--verbose", count=True, help="Print more messages.")
    @click.option("-q", "--quiet", is_flag=True, help="Print only results and errors.")
    @click.option("--debug", is_flag=True, help="Print the traceback of unexpected errors.")
    @functools.wraps(function)
    def command(as_json: bool, verbose: int, quiet: bool, debug: bool, **options: Any) -> None:
        console = Console(as_json, -1 if quiet else verbose)
        logging.basicConfig(level=logging.INFO if verbose else logging.ERROR, stream=sys.stderr, format="%(message)s")
        logging.getLogger("tribo").setLevel(logging.DEBUG if debug else logging.NOTSET)
        try:
            with damage_said(lambda text: console.say(text, level=-1)), ended_by_terminate():
                status = function(console=console, **options)
        except (click.ClickException, BrokenPipeError):
            raise
        except Exception as why:
            _report_faults(console, why)
            status = BUSY if isinstance(why, BusyError) else UNUSABLE
        except (KeyboardInterrupt, click.Abort):
            console.say("interrupted; finished results are kept and no file is incomplete", level=-1)
            status = INTERRUPTED
        sys.exit(status or DONE)

    return command


def _report_faults(console: Console, why: Exception) -> None:
    problems = problems_of(why)
    console.list_problems(problems)
    if console.as_json:
        click.echo(json.dumps({"problems": [asdict(p) for p in problems]}, indent=1, default=str))


def problems_of(why: Exception) -> tuple[Problem, ...]:
    """What ended a command: the problems it found, an error of the system with its path, or an error of tribo.

    Problems that an error of the system caused are problems of the system, whatever they are called.
    """
    if isinstance(why, TriboError):
        by_system = why.__cause__ is not None and failed_by_system(why.__cause__)
        return tuple(map(of_the_system, why.problems)) if by_system else why.problems
    if isinstance(why, OSError):
        logging.getLogger("tribo").debug("an error of the system", exc_info=why)
        return (system_problem(why),)
    return (unexpected(why, "this command stopped"),)
