"""The commands of a lab that builds many campaigns: tribo build, tribo schedule print."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tribo.cli.console import DONE, SOME_SET_ASIDE, Console, command_options

if TYPE_CHECKING:
    from tribo.pipeline.build import Built

BUSY = 75  # EX_TEMPFAIL of sysexits.h: nothing is wrong, try again later
DROP = click.argument("drop", type=click.Path(exists=True, file_okay=False, path_type=Path))
FOLDER = click.Path(file_okay=False, path_type=Path)
SITE = click.option("-o", "--site", type=FOLDER, required=True, help="Output site.")
KEEP = click.option(
    "--keep", type=click.IntRange(min=1), default=10, show_default=True, help="Dated builds that are kept."
)


@click.command()
@DROP
@SITE
@click.option("--dry-run", is_flag=True, help="Say what would run and why, and do nothing.")
@click.option("--profile", default="local", show_default=True, help="local, slurm, or a folder with a config.yaml.")
@click.option("--settle", "settle_s", default=60.0, show_default=True, help="Seconds a file must be unchanged.")
@click.option("--wait", "wait_s", default=0.0, show_default=True, help="Seconds to wait for another build of the site.")
@KEEP
@click.option("--rule", default="seed", show_default=True, help="How static and sliding force are read off.")
@click.option("--weights", default="relative", show_default=True, help="As in tribo fit.")
@click.option("--flat", default="", metavar="SAMPLE", help="Flat sample that calibrates the model, as in tribo report.")
@click.option("--runs", type=click.IntRange(min=2), default=4, show_default=True, help="Simulated runs a load.")
@click.option("--scheduler", help="Address of a dask scheduler whose workers run the simulations.")
@command_options
def build(console: Console, drop: Path, site: Path, dry_run: bool, **options: Any) -> int:
    """Reports of all campaigns in DROP and an index page over them; only what changed is built.

    Each folder or .zip in DROP is a campaign. NAME.overrides.csv beside campaign NAME is applied to it. Exit status
    75: another build of the site is running.
    """
    from tribo.pipeline.build import BuildOptions, build_site
    from tribo.store.lock import SiteBusyError

    try:
        built = build_site(drop, site, BuildOptions(**options), dry_run=dry_run)
    except SiteBusyError as why:
        console.say(str(why), level=-1)
        return BUSY
    console.result(built.as_dict(), _words(built, dry_run))
    unusable = any(status == "unusable" for status in built.status.values())
    return SOME_SET_ASIDE if unusable or built.waiting else DONE


def _words(built: Built, dry_run: bool) -> str:
    """What was built or would be, and why."""
    verb = "would build" if dry_run else "built"
    lines = [f"{verb} {name}: {why}" for name, why in built.due.items()]
    lines += [f"left for the next round: {name}: {'; '.join(why)}" for name, why in built.waiting.items()]
    lines += [f"unusable: {name}" for name, status in built.status.items() if status == "unusable"]
    if dry_run:
        lines += [f"  {step}" for step in built.steps]
    if not built.due:
        lines.append("no campaign changed" if built.steps else "nothing changed, nothing to build")
    if not dry_run:
        lines.append(f"open {built.dated or built.site / 'latest'}/index.html")
    return "\n".join(lines)


@click.group()
def schedule() -> None:
    """Regular builds of a drop folder."""


@schedule.command("print")
@DROP
@SITE
@KEEP
@click.option("--at", default="06:00", show_default=True, help="Time of day, HH:MM.")
@click.option("--notify", default="", help="Command told of a failure; it gets the unit's name and the last log lines.")
@click.option("--mail", default="", help="Address that gets a mail on failure, in place of --notify.")
@command_options
def print_schedule(console: Console, drop: Path, site: Path, **options: Any) -> None:
    """A systemd service and timer, and a cron line, that build DROP every day."""
    from tribo.pipeline.schedule import Schedule, cron_line, in_words, units

    wanted = Schedule.checked(drop, site, **{name: options[name] for name in ("at", "keep", "notify", "mail")})
    texts = {**units(wanted), "crontab": cron_line(wanted)}
    console.result(texts, in_words(texts))
