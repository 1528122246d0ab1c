"""All that is fitted to a campaign of eight samples is what was kept."""

from __future__ import annotations

import json

from kept_fits import KEPT, fitted
from kept_numbers import assert_as_kept


def test_a_campaign_is_fitted_and_judged_as_it_was() -> None:
    kept = json.loads(KEPT.read_text(encoding="utf-8"))
    assert len(kept) > 35
    assert_as_kept(fitted(), kept)
