"""Commands for many campaigns: tribo build with its progress, tribo schedule print."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tribo.cli.console import (
    DONE,
    FOLDER,
    FORCE,
    SOME_SET_ASIDE,
    Console,
    GivenPath,
    command_options,
    findings_text,
)
from tribo.cli.study_options import FLAT, RULE, RUNS, SCHEDULER, WEIGHTS

if TYPE_CHECKING:
    from tribo.site.build import Built, Progress

    Report = Callable[[Progress], None]


EVERY_S = 30.0  # a line at least this often, also where nothing changes
MOST_NAMED = 3


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

    # drawn by hand: a refreshing thread would forbid the build to read campaigns in processes of their own
    columns = (TextColumn("{task.description}"), BarColumn())
    with Bars(*columns, console=RichConsole(stderr=True), auto_refresh=False) as bars:
        task, started = bars.add_task("starting", total=1.0), time.monotonic()

        def report(progress: Progress) -> None:
            bars.update(task, completed=progress.share, description=in_words(progress, time.monotonic() - started))
            bars.refresh()

        yield report


DROP = click.argument("drop", type=GivenPath(file_okay=False))
SITE = click.option("-o", "--site", type=FOLDER, required=True, help="Folder of the site.")
KEEP = click.option(
    "--keep", type=click.IntRange(min=1), default=10, show_default=True, help="Number of dated builds to keep."
)


@click.command()
@DROP
@SITE
@click.option("--dry-run", is_flag=True, help="Check the campaigns that are due and list the steps, without results.")
@click.option(
    "--profile",
    default="local",
    show_default=True,
    help="Snakemake profile: local, slurm, or a folder with a config.yaml.",
)
@click.option(
    "--settle",
    "settle_s",
    default=60.0,
    show_default=True,
    help="Read a campaign only after its files have not changed for this many seconds.",
)
@click.option(
    "--wait", "wait_s", default=0.0, show_default=True, help="Seconds to wait if another build of the site is running."
)
@click.option(
    "--most-minutes",
    type=click.FloatRange(min=0, min_open=True),
    default=240.0,
    show_default=True,
    help="Time that a step of one campaign may take; it is then ended, and the campaign counts as unusable.",
)
@click.option(
    "--most-gigabytes",
    type=click.FloatRange(min=0, min_open=True),
    default=4.0,
    show_default=True,
    help="Memory that a process of one campaign may take.",
)
@FORCE
@KEEP
@RULE
@WEIGHTS
@FLAT
@RUNS
@SCHEDULER
@command_options
def build(console: Console, drop: Path, site: Path, dry_run: bool, **options: Any) -> int:
    """Build the reports of a folder of campaigns.

    Each folder or .zip in DROP is a campaign. A campaign is built only if it has changed since the last build; an
    index page lists all of them. If DROP holds NAME.overrides.csv, it is applied to campaign NAME. Exit status 75:
    another build of the site is running.
    """
    from tribo.site.build import BuildOptions, build_site

    chosen = BuildOptions(force=console.force, wait_s=console.wait_s, **options)
    if dry_run:
        with console.progress() as checks:
            built = build_site(drop, site, chosen, dry_run=True, checks=checks)
    else:
        with build_progress(console) as steps:
            built = build_site(drop, site, chosen, steps=steps)
    console.result(built.as_dict(), _words(built, dry_run, all_of_them=console.verbosity > 0))
    unusable = any(status == "unusable" for status in built.status.values())
    return SOME_SET_ASIDE if unusable or built.waiting else DONE


def _words(built: Built, dry_run: bool, *, all_of_them: bool) -> str:
    """What was built, or would be built, and why."""
    verb = "would build" if dry_run else "built"
    lines = [f"{verb} {name}: {why}" for name, why in built.due.items()]
    lines += [f"postponed to the next build: {name}: {'; '.join(why)}" for name, why in built.waiting.items()]
    unusable = [name for name, status in built.status.items() if status == "unusable"]
    lines += [": ".join(filter(None, ("unusable", name, "; ".join(built.refused.get(name, ()))))) for name in unusable]
    if dry_run:
        lines += [f"  {step}" for step in built.steps]
        for name, found in built.checked.items():
            lines.append(f"checked {name}: {found.tests} tests can be used")
            lines += [text for text in (findings_text(found, all_of_them=all_of_them),) if text]
    if not built.due:
        lines.append("no campaign changed" if built.steps else "nothing changed, nothing to build")
    if not dry_run:
        lines.append(f"open {built.dated or built.site / 'latest'}/index.html")
    return "\n".join(lines)


@click.group()
def schedule() -> None:
    """Schedule daily builds of a folder of campaigns."""


@schedule.command("print")
@DROP
@SITE
@KEEP
@click.option("--at", default="06:00", show_default=True, help="Time of day, HH:MM.")
@click.option(
    "--notify",
    default="",
    help="Command to run after a failure, with the name of the unit and the last log lines as arguments.",
)
@click.option("--mail", default="", help="Address to send a mail to after a failure, instead of --notify.")
@command_options
def print_schedule(console: Console, drop: Path, site: Path, **options: Any) -> None:
    """Print a systemd timer and a cron line.

    Both build DROP every day.
    """
    from tribo.site.schedule import daily_build, in_words

    texts = daily_build(drop, site, **{name: options[name] for name in ("at", "keep", "notify", "mail")})
    console.result(texts, in_words(texts))
