"""The flat law of a campaign lies in the intervals of the fit, from raw exports to mu and tau0."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from other_fits import fit_power_law
from support import first_quick
from support.campaigns import DESIGN, DIALECTS, LAWS, write_made
from support.sled import SledLaw

from tribo.campaign import load_campaign
from tribo.fitting import campaign_budgets, fit_samples, fit_three_term, power_of_campaign
from tribo.fitting.budget import PRESSURE_PA
from tribo.records import Ingested, LawFit, Regime
from tribo.stages import ingest

PULLS = replace(DESIGN, laws={"F": LAWS["F"]}, specimens=5)
Read = Callable[[str], Ingested]


@dataclass(frozen=True)
class Pressed(SledLaw):
    """Sliding friction that grows with the load to the power 0.7 where the flat law has a straight line."""

    def forces_N(self, normal_load_N: float, nominal_area_m2: float) -> tuple[float, float]:
        static, sliding = super().forces_N(normal_load_N, nominal_area_m2)
        bend = normal_load_N**0.7 - normal_load_N
        return static, sliding + self.sliding_mu * bend


def flat(ingested: Ingested, regime: Regime) -> LawFit:
    fits = fit_samples(ingested.table(), regime, ingested.campaign.nominal_area_m2)
    return next(fit for fit in fits if fit.sample == "F")


def outside(ingested: Ingested, law: dict[str, float]) -> list[str]:
    """Parameters of the flat law, such as static_mu, that lie outside their 99 % interval."""
    wrong = []
    for regime in ("static", "sliding"):
        fit = flat(ingested, regime)  # type: ignore[arg-type]
        for name in ("mu", "tau0_Pa"):
            low, high = fit.interval(name, 0.99)
            if not low < law[f"{regime}_{name}"] < high:
                wrong.append(f"{regime} {name}")
    return wrong


@pytest.mark.parametrize("dialect", first_quick(DIALECTS))
def test_the_flat_law_of_the_virtual_tribometer_lies_within_the_99_percent_intervals(
    read_made: Read, dialect: str
) -> None:
    assert outside(read_made(dialect), vars(LAWS["F"])) == []


@pytest.mark.slow
def test_the_flat_law_of_the_practice_campaigns_lies_within_the_99_percent_intervals(
    shared: Path, practice: Callable[[str], Path]
) -> None:
    known = json.loads((shared / "campaigns" / "known.json").read_text())
    wrong = {}
    for number in ("01", "02", "03", "04"):
        law = known[f"series-{number}"]["law"]
        plain = {
            f"{regime}_{name}": factor * law[f"{short}_{end}"]
            for regime, end in (("static", "s"), ("sliding", "d"))
            for name, short, factor in (("mu", "mu", 1.0), ("tau0_Pa", "tau", 1e3))
        }
        wrong[number] = outside(ingest(load_campaign(practice(number))), plain)
    assert not any(wrong.values()), wrong


@pytest.fixture(scope="module")
def straight_and_bent(tmp_path_factory: pytest.TempPathFactory) -> tuple[Ingested, Ingested]:
    """Pulls of the flat sample alone: by the flat law, and by one whose sliding friction bends with the load."""
    folder = tmp_path_factory.mktemp("laws")
    bent = replace(PULLS, laws={"F": Pressed(**vars(LAWS["F"]))})
    return (
        ingest(load_campaign(write_made(folder / "straight", "bluehill", 1, PULLS).folder)),
        ingest(load_campaign(write_made(folder / "bent", "bluehill", 1, bent).folder)),
    )


def test_a_sliding_law_that_bends_is_noted_and_a_straight_one_is_not(
    straight_and_bent: tuple[Ingested, Ingested],
) -> None:
    straight, bent = straight_and_bent
    assert any("deviate from a straight line" in note for note in flat(bent, "sliding").notes)
    assert not flat(bent, "static").notes
    assert not flat(straight, "sliding").notes


def test_the_exponent_of_the_power_law_is_above_zero_where_friction_depends_on_pressure_and_only_there(
    straight_and_bent: tuple[Ingested, Ingested],
) -> None:
    low = []
    for ingested in straight_and_bent:
        fits = fit_power_law(ingested.table(), "sliding", ingested.campaign.nominal_area_m2)
        low.append(next(fit for fit in fits if fit.sample == "F").interval("n")[0])
    assert low[0] < 0 < low[1]


@pytest.mark.slow
def test_the_practice_campaign_with_hidden_pressure_dependence_bends_and_the_one_without_does_not(
    practice: Callable[[str], Path],
) -> None:
    without, hidden = (ingest(load_campaign(practice(number))) for number in ("01", "03"))
    assert any("deviate from a straight line" in note for note in flat(hidden, "sliding").notes)
    assert not flat(without, "sliding").notes
    for regime in ("static", "sliding"):
        low = []
        for ingested in (without, hidden):
            fits = fit_power_law(ingested.table(), regime, ingested.campaign.nominal_area_m2)  # type: ignore[arg-type]
            low.append(next(fit for fit in fits if fit.sample == "F").interval("n")[0])
        assert low[0] < 0 < low[1]


def test_specimens_pulled_along_x_and_y_are_counted_once_in_the_three_term_law(read_made: Read) -> None:
    campaign = read_made("bluehill").campaign
    fractions = {sample: campaign.area_fraction(sample) for sample in campaign.samples}
    fit = fit_three_term(read_made("bluehill").table(), "static", campaign.nominal_area_m2, fractions)
    assert fit.n_specimens == 15
    assert fit.n_tests == 180
    assert fit.value("a_Pa") > 0


def test_every_fit_of_a_campaign_gets_a_budget_with_the_clip_from_its_own_traces(read_made: Read) -> None:
    ingested = read_made("bluehill")
    area = ingested.campaign.nominal_area_m2
    fits = tuple(f for r in ("static", "sliding") for f in fit_samples(ingested.table(), r, area))
    budgets = campaign_budgets(ingested, fits)
    assert len(budgets) == len(fits) == 12
    for fit, budget in budgets:
        clip = budget.loc[budget["component"] == "sampling clip", "u_T_N"]
        assert len(clip) == (fit.regime == "static")
        assert clip.between(0, 0.05 * float(fit.force_N(PRESSURE_PA * area)), inclusive="neither").all()
        assert np.isfinite(fit.interval("mu")).all()


def test_the_power_of_a_campaign_follows_from_its_own_table(read_made: Read) -> None:
    ingested = read_made("bluehill")
    found = power_of_campaign(ingested.table(), "static", ingested.campaign.nominal_area_m2)
    assert list(found["number"]) == ["mu", "tau0_kPa", "T_N"]
    assert found["smallest_difference_pct"].between(5, 100).all()
