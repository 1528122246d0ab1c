"""The flat sample that calibrates the model: chosen once, checked once, carried by the campaign."""

from __future__ import annotations

from dataclasses import replace

from tribo.errors import CampaignError, Problem
from tribo.records import Campaign


def with_flat_sample(campaign: Campaign, wanted: str = "") -> Campaign:
    """The campaign with the flat sample a user asked for; unchanged where none was asked for.

    Raises
    ------
    CampaignError
        ``wanted`` was not measured, or has cavities.
    """
    if not wanted or wanted == campaign.chosen_flat:
        return campaign
    if wanted not in campaign.flat_samples:
        measured = {test.sample for test in campaign.tests}
        what = "this sample has cavities" if wanted in measured else "no test of this campaign has this sample"
        raise CampaignError(replace(_problem(campaign, what, wanted), file="--flat", column=None))
    return replace(campaign, chosen_flat=wanted)


def required_flat_sample(campaign: Campaign) -> str:
    """Name of the flat sample.

    Raises
    ------
    CampaignError
        No flat sample was measured, or several were and none of them was chosen.
    """
    if campaign.flat_sample:
        return campaign.flat_sample
    found = ", ".join(campaign.flat_samples) or "no sample whose pattern has cavity = none"
    raise CampaignError(_problem(campaign, "the model must be calibrated on one flat sample", found))


def _problem(campaign: Campaign, what: str, found: str) -> Problem:
    flat = campaign.flat_samples
    allowed = f"--flat {' or --flat '.join(flat)}" if flat else "at least one sample whose pattern has cavity = none"
    return Problem("no_flat_sample", what, file="tests.csv", column="sample", found=found, allowed=allowed)
