"""The spoiled practice campaign from raw exports on: each fault by its name, the rest to the same bits."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tribo import stages
from tribo.campaign import load_campaign
from tribo.display import exact_text

Practice = Callable[[str], Path]


@pytest.mark.slow
def test_every_spoiled_test_is_named_with_its_damage_and_healthy_ones_are_read_to_the_same_bits(
    practice: Practice, shared: Path
) -> None:
    truth = json.loads((shared / "campaigns" / "series-11-spoiled.truth.json").read_text(encoding="utf-8"))
    ingested = stages.ingest(load_campaign(practice("11-spoiled")))
    listed = [*ingested.set_aside, *ingested.doubts()]
    found = {fault.test_id: {p.kind for p in fault.problems} for fault in listed}
    unlisted = "not_an_export_and_not_listed"
    found |= {str(p.file): {p.kind} for p in ingested.campaign.problems if p.kind == unlisted}
    assert found == {name: {kind} for name, kind in truth.items()}
    spoiled, clean = ingested, stages.ingest(load_campaign(practice("11-clean")))
    damaged = {fault.test_id for fault in spoiled.doubts()}
    assert not clean.set_aside
    assert not clean.doubts()
    assert len(spoiled.pulls) == 324 - 14
    for test_id, pull in spoiled.pulls.items():
        if test_id not in damaged:
            assert exact_text(pull) == exact_text(clean.pulls[test_id])
            assert np.array_equal(spoiled.traces[test_id].force_N, clean.traces[test_id].force_N)
