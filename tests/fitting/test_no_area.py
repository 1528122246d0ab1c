"""A nominal area is stated or it is not; without one the adhesion term is a force with a name of its own."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import tribo
from tribo.errors import CampaignError
from tribo.records import Ingested


@pytest.fixture(scope="module")
def ingested(small_campaign: Path) -> Ingested:
    return tribo.ingest(tribo.load_campaign(small_campaign))


def with_area(ingested: Ingested, area_m2: float | None) -> Ingested:
    return replace(ingested, campaign=replace(ingested.campaign, nominal_area_m2=area_m2))


def test_an_area_of_one_square_metre_is_an_area(ingested: Ingested) -> None:
    large = with_area(ingested, 1.0)
    assert large.campaign.has_area
    fit = tribo.fit(large)["F", "static"]
    assert fit.has_area
    assert fit.parameters == ("mu", "tau0_Pa")
    assert np.isfinite(tribo.fit(large).table()["tau0_kPa"]).all()


def test_without_an_area_the_adhesion_term_is_a_force_in_newton_and_no_pressure(ingested: Ingested) -> None:
    known, unknown = tribo.fit(ingested), tribo.fit(with_area(ingested, None))
    for with_it, without in zip(known, unknown, strict=True):
        assert without.parameters == ("mu", "T0_N")
        assert without.law == "coulomb_intercept"
        assert without.value("T0_N") == pytest.approx(with_it.T0_N)
        assert pytest.approx(with_it.T0_N) == without.T0_N
        assert without.force_N(0.7) == pytest.approx(with_it.force_N(0.7))
        with pytest.raises(tribo.TriboError, match="tau0_Pa"):
            _ = without.tau0_Pa
    assert unknown.table()["tau0_kPa"].isna().all()
    assert "T0_N" in unknown["F", "static"].largest


def test_what_needs_a_pressure_says_that_the_area_is_not_stated(ingested: Ingested) -> None:
    without = with_area(ingested, None)
    assert not without.campaign.has_area
    with pytest.raises(CampaignError, match="nominal_area_mm2"):
        without.campaign.nominal_pressure_Pa(1.0)
    with pytest.raises(CampaignError, match="nominal_area_mm2"):
        tribo.diagnose(without)
    with pytest.raises(CampaignError, match="nominal_area_mm2"):
        tribo.compare(without, tribo.fit(without))


@pytest.mark.slow
def test_the_report_of_a_campaign_without_an_area_states_forces(small_campaign: Path, tmp_path: Path) -> None:
    from on_the_command_line import run

    folder = tmp_path / "campaign"
    folder.mkdir()
    for path in small_campaign.rglob("*"):
        target = folder / path.relative_to(small_campaign)
        if path.is_dir():
            target.mkdir(exist_ok=True)
        elif path.name != "campaign.toml":
            target.write_bytes(path.read_bytes())
    toml = (small_campaign / "campaign.toml").read_text(encoding="utf-8")
    (folder / "campaign.toml").write_text(toml.replace("nominal_area_mm2 = 55.0\n", ""), encoding="utf-8")
    result = run("report", folder, "-o", tmp_path / "out", "-q")
    assert result.exit_code == 0, result.output
    import pandas as pd

    fits = pd.read_csv(tmp_path / "out" / "fits.csv")
    assert fits["tau0_kPa"].isna().all()
    assert np.isfinite(fits["T0_u_N"]).all()
    assert (fits["law"] == "coulomb_intercept").all()
