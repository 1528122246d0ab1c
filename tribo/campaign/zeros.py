"""The zeros of a campaign replaced by those of the command line; a test with a zero of its own keeps it."""

from __future__ import annotations

from dataclasses import replace

from tribo.records import Campaign, Test
from tribo.zeroing import DEFAULT, ZeroChoice, zero_choice


def with_zeros(campaign: Campaign, zero: str = "", load_zero: str = "") -> Campaign:
    """The campaign with the zero of the force and of the load as given; unchanged where nothing is given.

    Raises
    ------
    ValueError
        A text that is no zero.
    """
    if not zero and not load_zero:
        return campaign
    force, load = zero_choice(zero), zero_choice(load_zero)

    def own(test: Test) -> Test:
        return replace(
            test,
            zero=_chosen(test.zero, campaign.zero, force),
            load_zero=_chosen(test.load_zero, campaign.load_zero, load),
        )

    return replace(
        campaign, tests=tuple(map(own, campaign.tests)), zero=_chosen(campaign.zero, campaign.zero, force),
        load_zero=_chosen(campaign.load_zero, campaign.load_zero, load),
    )  # fmt: skip


def _chosen(own: ZeroChoice, of_campaign: ZeroChoice, given: ZeroChoice) -> ZeroChoice:
    return given if given != DEFAULT and own == of_campaign else own
