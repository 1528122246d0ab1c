"""One uncertainty: tribo.fit, fits.csv, the card, the tables and the bands of the figures state the same."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import tribo
from tribo.figures import FIGURES
from tribo.records import Fits, Study


@pytest.fixture(scope="module")
def study(small_campaign: Path) -> Study:
    return tribo.study(tribo.load_campaign(small_campaign), until="fit")


def test_fits_are_found_by_number_by_sample_and_by_regime(study: Study) -> None:
    fits = study.fits
    assert isinstance(tribo.fit(study.ingested), Fits)
    assert fits["B", "static"] is next(f for f in fits if (f.sample, f.regime) == ("B", "static"))
    assert [f.regime for f in fits["B"]] == ["static", "sliding"]
    assert fits[0].mu == fits[0].value("mu")
    assert list(fits.table()["sample"]) == [f.sample for f in fits]
    with pytest.raises(tribo.TriboError, match="B, F"):
        fits["Q", "static"]
    with pytest.raises(tribo.TriboError, match="static or sliding"):
        fits["B", "rolling"]


def test_what_python_returns_is_what_the_files_hold(study: Study, small_report: Path) -> None:
    table = pd.read_csv(small_report / "fits.csv").set_index(["sample", "regime"])
    for fit in tribo.fit(study.ingested):
        row = table.loc[(fit.sample, fit.regime)]
        assert row["mu_u"] == pytest.approx(fit.mu_u, rel=1e-6)
        assert row["tau0_u_kPa"] == pytest.approx(fit.tau0_u_Pa / 1e3, rel=1e-6)
        assert (row["mu_low"], row["mu_high"]) == pytest.approx(fit.interval("mu"), rel=1e-6)
        assert row["mu_type_a_u"] == pytest.approx(fit.mu_type_a_u, rel=1e-6)
        assert fit.mu_type_a_u != pytest.approx(fit.mu_u, rel=1e-3)
    assert not [name for name in table.columns if "combined" in name]


def test_the_card_states_the_uncertainty_that_python_returns(study: Study, small_report: Path) -> None:
    card = json.loads((small_report / "card.json").read_text(encoding="utf-8"))
    stated = {(law["sample"], law["regime"]): law["mu"] for law in card["laws"]}
    for fit in study.fits:
        u = float(stated[fit.sample, fit.regime].split(" ± ")[1])
        assert u == pytest.approx(fit.mu_u, rel=0.06)  # two digits


@pytest.mark.parametrize(("figure", "regime"), [("fig6", "static"), ("fig7", "sliding")])
def test_the_band_of_a_force_is_that_of_the_combined_uncertainty(study: Study, figure: str, regime: str) -> None:
    numbers = FIGURES[figure].numbers(study)
    for fit in (f for f in study.fits if f.regime == regime):
        line = numbers[(numbers["sample"] == fit.sample) & (numbers["mark"] == "fit")]
        loads = line["normal_load_N"].to_numpy(float)
        half = (line["T_high_N"] - line["T_low_N"]).to_numpy(float) / 2
        assert half == pytest.approx(fit.force_half_width_N(loads))
        assert fit.type_a is not None
        for load, width in zip(loads, half, strict=True):
            by = np.array([load, fit.nominal_area_m2])
            share = float(by @ fit.type_a @ by) / float(by @ fit.covariance @ by)
            assert fit.effective_dof(by) == pytest.approx(fit.dof / share**2)
            assert width > 1.9 * float(fit.force_u_N(load))


def test_samples_are_ordered_and_the_model_is_judged_by_the_tests_of_each_alone(study: Study) -> None:
    """What all pulls share moves every sample of a campaign alike; it neither orders them nor judges the model."""
    for fit in study.fits:
        assert fit.by_itself.alone is None
        assert fit.by_itself.method in fit.method
        np.testing.assert_array_equal(fit.by_itself.values, fit.values)


def test_the_page_says_where_the_scatter_of_other_samples_makes_an_interval_narrower(
    study: Study, small_report: Path
) -> None:
    narrower = [f for f in study.fits if np.ptp(f.interval("mu")) < np.ptp(f.by_itself.interval("mu"))]
    page = (small_report / "report.html").read_text(encoding="utf-8")
    assert narrower
    assert f"narrower than by its own specimens alone in {len(narrower)} of {len(study.fits)}" in " ".join(page.split())
