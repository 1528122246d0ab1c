"""The flat law of the practice campaigns lies in the intervals of the fit, from raw exports to mu and tau0."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

from tribo.campaign import load_campaign
from tribo.fitting import campaign_budgets, fit_power_law, fit_samples, fit_three_term, power_of_campaign
from tribo.records import Ingested, LawFit, Regime
from tribo.stages import ingest

EVERY = [(number, regime) for number in ("01", "02", "03", "04") for regime in ("static", "sliding")]
Read = Callable[[str], Ingested]


@pytest.fixture(scope="module")
def read(practice: Callable[[str], Path]) -> Read:
    """read("01") -> the practice campaign series-01, every export read."""
    return lru_cache(lambda number: ingest(load_campaign(practice(number))))


def flat(ingested: Ingested, regime: Regime) -> LawFit:
    fits = fit_samples(ingested.table(), regime, ingested.campaign.nominal_area_m2)
    return next(fit for fit in fits if fit.sample == "F")


@pytest.mark.parametrize(("number", "regime"), EVERY)
def test_the_flat_law_lies_within_the_99_percent_intervals(
    shared: Path, read: Read, number: str, regime: Regime
) -> None:
    law = json.loads((shared / "campaigns" / "known.json").read_text())[f"series-{number}"]["law"]
    fit = flat(read(number), regime)
    end = {"static": "s", "sliding": "d"}[regime]
    low, high = fit.interval("mu", 0.99)
    assert low < law[f"mu_{end}"] < high
    low, high = fit.interval("tau0_Pa", 0.99)
    assert low < 1e3 * law[f"tau_{end}"] < high


def test_pressure_dependent_friction_bends_the_flat_sliding_law_and_the_fit_says_so(read: Read) -> None:
    assert any("bend" in note for note in flat(read("03"), "sliding").notes)
    assert not flat(read("01"), "sliding").notes


@pytest.mark.parametrize("regime", ["static", "sliding"])
def test_the_exponent_of_the_power_law_is_above_zero_where_pressure_dependence_is_hidden_and_only_there(
    read: Read, regime: Regime
) -> None:
    low = {}
    for number in ("01", "03"):
        ingested = read(number)
        fits = fit_power_law(ingested.table(), regime, ingested.campaign.nominal_area_m2)
        low[number] = next(fit for fit in fits if fit.sample == "F").interval("n")[0]
    assert low["03"] > 0 > low["01"]


def test_specimens_pulled_along_x_and_y_are_counted_once_in_the_three_term_law(read: Read) -> None:
    campaign = read("01").campaign
    fractions = {sample: campaign.area_fraction(sample) for sample in campaign.samples}
    fit = fit_three_term(read("01").table(), "static", campaign.nominal_area_m2, fractions)
    assert fit.n_specimens == 15
    assert fit.n_tests == 324
    assert fit.value("a_Pa") > 0


def test_every_fit_of_a_campaign_gets_a_budget_with_the_clip_from_its_own_traces(read: Read) -> None:
    ingested = read("01")
    area = ingested.campaign.nominal_area_m2
    fits = tuple(f for r in ("static", "sliding") for f in fit_samples(ingested.table(), r, area))
    budgets = campaign_budgets(ingested, fits)
    assert len(budgets) == len(fits) == 12
    for budget in budgets:
        clip = [c for c in budget.components if c.name == "sampling clip"]
        assert len(clip) == (budget.fit.regime == "static")
        assert all(0 < c.u["T_N"] < 0.05 * budget.value("T_N") for c in clip)
        assert np.isfinite(budget.expanded_uncertainty("mu"))


def test_the_power_of_a_campaign_follows_from_its_own_table(read: Read) -> None:
    ingested = read("01")
    found = power_of_campaign(ingested.table(), "static", ingested.campaign.nominal_area_m2)
    assert [p.number for p in found] == ["mu", "tau0_kPa", "T_N"]
    assert all(5 < p.smallest_difference_pct < 100 for p in found)
