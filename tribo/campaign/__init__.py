"""A campaign as its folder describes it: campaign.toml, tests.csv, and the exports they name."""

from __future__ import annotations

from tribo.campaign.description import write_template
from tribo.campaign.load import load_campaign, open_campaign

__all__ = ["load_campaign", "open_campaign", "write_template"]
