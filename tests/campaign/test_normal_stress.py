"""A load given as normal stress."""

from __future__ import annotations

from pathlib import Path

import pytest

from tribo.campaign import load_campaign
from tribo.errors import CampaignError

ROW = "test_id,sample,normal_stress_Pa,file\nT1,F,20000,\n"
FLAT = "[patterns.F]\ncavity = \"none\"\n"


def campaign(folder: Path, area: str) -> Path:
    (folder / "campaign.toml").write_text(f"[campaign]\ntitle = \"stress\"\n{area}\n{FLAT}")
    (folder / "tests.csv").write_text(ROW)
    return folder


def test_without_an_area_the_load_is_unknown_and_that_is_said(tmp_path: Path) -> None:
    with pytest.raises(CampaignError) as faults:
        load_campaign(campaign(tmp_path, ""), measured=False)
    assert [(p.kind, p.column) for p in faults.value.problems] == [("no_area", "nominal_area_mm2")]


def test_with_an_area_the_load_is_their_product(tmp_path: Path) -> None:
    found = load_campaign(campaign(tmp_path, "nominal_area_mm2 = 55.0"), measured=False)
    assert found.tests[0].normal_load_N == pytest.approx(20000 * 55e-6)
