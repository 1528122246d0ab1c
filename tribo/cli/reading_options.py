"""Options of the command line that state how exports are read: columns, sign, gain, lever arm, sampling rate."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from tribo.nearest import did_you_mean

if TYPE_CHECKING:
    from tribo.records import Campaign, Correction

COLUMNS = click.option(
    "--columns",
    default="",
    help="Column of each quantity: QUANTITY=NAME [UNIT],... as in the [columns] table of campaign.toml. "
    "#3 means the third column, * every further column; none leaves a quantity out.",
)
_MM = 1e-3
_KEYS = ("sign", "gain", "lever_arm_mm", "sampling_rate_Hz", "speed_mm_s")


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
    "an export has no time). Can be repeated; holds for every test and replaces campaign.toml and tests.csv.",
)


def reading_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """Add --columns and --set to a command."""
    return COLUMNS(SET(function))


def corrected(correction: Correction, stated: dict[str, float]) -> Correction:
    """A correction with what the command line states in place of what it says."""
    lever, speed = stated.get("lever_arm_mm"), stated.get("speed_mm_s")
    return replace(
        correction,
        sign=stated.get("sign", correction.sign),
        gain=stated.get("gain", correction.gain),
        lever_arm_m=correction.lever_arm_m if lever is None else lever * _MM,
        sampling_rate_Hz=stated.get("sampling_rate_Hz", correction.sampling_rate_Hz),
        speed_m_s=correction.speed_m_s if speed is None else speed * _MM,
    )


def with_reading_options(campaign: Campaign, columns: str, stated: dict[str, float]) -> Campaign:
    """The campaign with the columns and corrections of the command line added to, or replacing, its own."""
    from tribo.readers import columns_from_text

    if columns:
        asked = columns_from_text(columns)
        by_file = {file: {**its, **asked} for file, its in campaign.columns_by_file.items()}
        campaign = replace(campaign, columns={**campaign.columns, **asked}, columns_by_file=by_file)
    if stated:
        tests = tuple(replace(t, correction=corrected(t.correction, stated)) for t in campaign.tests)
        campaign = replace(campaign, tests=tests)
    return campaign
