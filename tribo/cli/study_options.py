"""Options of the commands that run the stages of a study: rule, weights, zeros, flat sample, model."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from tribo.cli.given_paths import GivenPath
from tribo.cli.output import output_options
from tribo.cli.reading_options import reading_options

CAMPAIGN = click.argument("campaign", type=GivenPath())
OUT = output_options()
SCHEDULER = click.option("--scheduler", help="Address of a dask scheduler; its workers run the simulations.")
DRY_RUN = click.option("--dry-run", is_flag=True, help="Check everything and list the steps, without results.")

RULE = click.option(
    "--rule", default="seed", show_default=True, help="Rule by which static and sliding force are determined."
)
WEIGHTS = click.option(
    "--weights",
    type=click.Choice(["relative", "ratio", "force", "repeats"]),
    default="relative",
    show_default=True,
    help="Scatter assumed equal at all loads: of T in percent (relative), of T/N (ratio) or of T (force); or "
    "estimated from repeated tests (repeats).",
)
LAWS = click.option(
    "--laws", type=click.Path(exists=True, file_okay=False, path_type=Path), metavar="DIR",
    help="Folder with laws of earlier campaigns (law*.toml). Each is tested; one that holds is a layer of the verdict.",
)  # fmt: skip
FLAT = click.option(
    "--flat", default="", metavar="SAMPLE",
    help="Flat sample on which the model is calibrated. [default: F, or the only flat sample]",
)  # fmt: skip


def _a_zero(context: click.Context, parameter: click.Parameter, given: str) -> str:
    """The text of a zero as given, checked.

    Raises click.BadParameter.
    """
    from tribo.zeroing import zero_choice

    try:
        zero_choice(given)
    except ValueError as why:
        raise click.BadParameter(str(why)) from None
    return given


ZEROS = (
    click.option(
        "--zero", default="", metavar="ZERO", callback=_a_zero,
        help='Zero of the force for tests without their own: "before contact", "at rest", "none", a number of newtons, '
        "or [from, to] in seconds.",
    ),
    click.option(
        "--load-zero", default="", metavar="ZERO", callback=_a_zero,
        help="Zero of the recorded normal load, in the same form.",
    ),
)  # fmt: skip

OVERRIDES = click.option(
    "--overrides",
    type=GivenPath(dir_okay=False),
    help="overrides.csv as saved from the report page: pulls excluded by hand, static peaks and windows moved by hand.",
)


NO_MODEL = click.option(
    "--no-model", is_flag=True,
    help="Report without the spring-block model: friction, its laws and what it varies with.",
)  # fmt: skip


def fit_options(function: Callable[..., Any]) -> Callable[..., Any]:
    for option in (
        reading_options,
        *ZEROS,
        OVERRIDES,
        RULE,
        WEIGHTS,
    ):
        function = option(function)
    return function


def model_options(function: Callable[..., Any]) -> Callable[..., Any]:
    for option in (
        FLAT,
        NO_MODEL,
        click.option("--runs", type=click.IntRange(min=2), default=4, show_default=True, help="Simulations per load."),
        SCHEDULER,
    ):
        function = option(function)
    return function
