"""Options that several commands share: how exports are read, rule, weights, zeros, flat sample, model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tribo.cli.console import GivenPath, output_options
from tribo.user_text import did_you_mean

if TYPE_CHECKING:
    from tribo.records import Campaign, Correction


COLUMNS = click.option(
    "--columns",
    default="",
    help="Column of each quantity: QUANTITY=NAME [UNIT],... as in the [columns] table of campaign.toml. "
    "#3 means the third column, * every further column; none leaves a quantity out.",
)
_MM = 1e-3
_KEYS = ("sign", "gain", "lever_arm_mm", "sampling_rate_Hz", "speed_mm_s", "normal_load_N", "nominal_area_mm2")


def _corrections(context: click.Context, parameter: click.Parameter, given: tuple[str, ...]) -> dict[str, float]:
    """KEY=VALUE texts as numbers by key."""
    found = {}
    for text in given:
        key, _, value = text.partition("=")
        try:
            found[key.strip()] = float(value)
        except ValueError:
            raise click.BadParameter(f"{text!r} is not KEY=NUMBER") from None
        if key.strip() not in _KEYS:
            hint = f"{did_you_mean(key, _KEYS)} Allowed: {', '.join(_KEYS)}".strip()
            raise click.BadParameter(f"{key.strip()!r} is unknown; {hint}")
        if key.strip() == "sign" and found["sign"] not in (1.0, -1.0):
            raise click.BadParameter("sign is 1 or -1")
        if key.strip() != "sign" and not 0 < found[key.strip()] < float("inf"):
            raise click.BadParameter(f"{key.strip()} must be more than 0")
    return found


SET = click.option(
    "--set",
    "stated",
    multiple=True,
    metavar="KEY=NUMBER",
    callback=_corrections,
    help="Correct what is read: sign=-1, gain, lever_arm_mm (torque to force), sampling_rate_Hz or speed_mm_s (where "
    "an export has no time), normal_load_N (of a friction coefficient), nominal_area_mm2 (of a stress). "
    "Can be repeated; holds for every test and replaces campaign.toml and tests.csv.",
)


def reading_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """Add --columns and --set to a command."""
    return COLUMNS(SET(function))


def corrected(correction: Correction, stated: dict[str, float]) -> Correction:
    """A correction with what the command line states in place of what it says."""
    lever, speed, area = (stated.get(key) for key in ("lever_arm_mm", "speed_mm_s", "nominal_area_mm2"))
    return replace(
        correction,
        sign=stated.get("sign", correction.sign),
        gain=stated.get("gain", correction.gain),
        lever_arm_m=correction.lever_arm_m if lever is None else lever * _MM,
        sampling_rate_Hz=stated.get("sampling_rate_Hz", correction.sampling_rate_Hz),
        speed_m_s=correction.speed_m_s if speed is None else speed * _MM,
        load_N=stated.get("normal_load_N", correction.load_N),
        area_m2=correction.area_m2 if area is None else area * _MM**2,
    )


def with_reading_options(campaign: Campaign, columns: str, stated: dict[str, float]) -> Campaign:
    """The campaign with the columns and corrections of the command line added to, or replacing, its own."""
    from tribo.readers import columns_from_text

    if columns:
        asked = columns_from_text(columns)
        by_file = {file: {**its, **asked} for file, its in campaign.columns_by_file.items()}
        campaign = replace(campaign, columns={**campaign.columns, **asked}, columns_by_file=by_file)
    if stated:
        load = stated.get("normal_load_N")
        tests = tuple(replace(t, correction=corrected(t.correction, stated)) for t in campaign.tests)
        tests = tests if load is None else tuple(replace(t, normal_load_N=load) for t in tests)
        area = stated.get("nominal_area_mm2")
        area_m2 = campaign.nominal_area_m2 if area is None else area * _MM**2
        campaign = replace(campaign, tests=tests, nominal_area_m2=area_m2)
    return campaign


CAMPAIGN = click.argument("campaign", type=GivenPath())
OUT = output_options()
RUNS = click.option("--runs", type=click.IntRange(min=2), default=4, show_default=True, help="Simulations per load.")
SCHEDULER = click.option("--scheduler", metavar="ADDRESS", help="Address of a dask scheduler for the simulations.")
DRY_RUN = click.option("--dry-run", is_flag=True, help="Check everything and list the steps, without results.")


def _rule(context: click.Context, parameter: click.Parameter, given: str) -> str:
    """The name of the rule today, said once where an old one was given; "?" lists all rules and ends the command."""
    from tribo.traces.rules import OLD_NAMES, RULES

    if given == "?":
        for rule in RULES.values():
            click.echo(f"{rule.name}: static friction, {rule.static_part}; sliding friction, {rule.sliding_part}")
        context.exit()
    if given in OLD_NAMES:
        click.echo(f"--rule {given} is now called {OLD_NAMES[given]}; both mean the same.", err=True)
    return OLD_NAMES.get(given, given)


RULE = click.option(
    "--rule", default="first_peak", show_default=True, callback=_rule, is_eager=True, metavar="NAME",
    help="Rule by which static and sliding force are determined; --rule ? lists all of them.",
)  # fmt: skip
WEIGHTS = click.option(
    "--weights",
    type=click.Choice(["relative", "ratio", "force", "repeats"]),
    default="relative",
    show_default=True,
    help="Scatter of the friction force T that is assumed equal at all loads N: in percent of T (relative), of T/N "
    "(ratio) or of T (force); or estimated from repeated tests (repeats).",
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
    """Add what decides readings and fits to a command; the help lists the options in this order."""
    for option in reversed((RULE, WEIGHTS, *ZEROS, OVERRIDES, reading_options)):
        function = option(function)
    return function


def model_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """Add what decides the runs of the spring-block model to a command."""
    for option in reversed((FLAT, NO_MODEL, RUNS, SCHEDULER)):
        function = option(function)
    return function
