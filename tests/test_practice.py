"""The practice campaigns from raw exports on: forces against their truth, spoiled tests by their damage."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tribo import stages
from tribo.campaign import load_campaign

Practice = Callable[[str], Path]


@pytest.mark.parametrize("number", ["01", "02", "03", "04"])
def test_forces_of_four_dialects_lie_close_to_their_truth(practice: Practice, shared: Path, number: str) -> None:
    table = stages.ingest(load_campaign(practice(number))).table().set_index("test_id")
    truth = pd.read_csv(shared / "campaigns" / f"series-{number}.truth.csv").set_index("test_id").loc[table.index]
    assert len(table) == 324
    for regime in ("static", "sliding"):
        error = np.abs(table[f"{regime}_N"] / truth[f"{regime}_N"] - 1)
        assert error.median() < 0.007
        assert (error < 0.03).mean() > 0.97


def test_every_spoiled_test_is_named_with_its_damage_and_no_healthy_one_is_touched(
    practice: Practice, shared: Path
) -> None:
    truth = json.loads((shared / "campaigns" / "series-11-spoiled.truth.json").read_text(encoding="utf-8"))
    ingested = stages.ingest(load_campaign(practice("11-spoiled")))
    listed = [*ingested.set_aside, *ingested.doubts()]
    found = {fault.test_id: {p.kind for p in fault.problems} for fault in listed}
    unlisted = "not_an_export_and_not_listed"
    found |= {str(p.file): {p.kind} for p in ingested.campaign.problems if p.kind == unlisted}
    assert found == {name: {kind} for name, kind in truth.items()}


def test_healthy_tests_of_the_spoiled_campaign_are_read_to_the_same_bits(practice: Practice) -> None:
    spoiled, clean = (stages.ingest(load_campaign(practice(name))) for name in ("11-spoiled", "11-clean"))
    damaged = {fault.test_id for fault in spoiled.doubts()}
    assert not clean.set_aside
    assert not clean.doubts()
    assert len(spoiled.pulls) == 324 - 14
    for test_id, pull in spoiled.pulls.items():
        if test_id not in damaged:
            assert repr(pull) == repr(clean.pulls[test_id])
            assert np.array_equal(spoiled.traces[test_id].force_N, clean.traces[test_id].force_N)
