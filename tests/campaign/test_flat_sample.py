"""The flat sample is chosen once; calibration, diagnosis, plan and figures use the same one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from tribo import stages
from tribo.campaign import load_campaign
from tribo.campaign.load import required_flat_sample, with_flat_sample
from tribo.comparison.findings import flat_sample
from tribo.diagnostics.observations import observe
from tribo.diagnostics.planning import plan_design
from tribo.errors import CampaignError
from tribo.records import Campaign, Study

Of = Callable[..., Campaign]


@pytest.fixture
def two_flat(small_campaign: Path) -> Campaign:
    """A campaign whose samples F and G have no cavities; G was B before."""
    campaign = load_campaign(small_campaign)
    tests = tuple(replace(t, sample="G" if t.sample == "B" else t.sample) for t in campaign.tests)
    return replace(campaign, tests=tests, samples={"F": campaign.samples["F"], "G": replace(campaign.samples["F"])})


def test_sample_f_is_the_flat_one_unless_another_is_chosen(two_flat: Campaign) -> None:
    assert two_flat.flat_samples == ("F", "G")
    assert two_flat.flat_sample == "F"
    assert with_flat_sample(two_flat, "G").flat_sample == "G"


def test_every_stage_uses_the_chosen_flat_sample(two_flat: Campaign) -> None:
    ingested = stages.ingest(with_flat_sample(two_flat, "G"))
    assert required_flat_sample(ingested.campaign) == "G"
    assert observe(ingested).flat == "G"
    assert flat_sample(Study(ingested)) == "G"
    assert plan_design(ingested.campaign).n_tests == len(two_flat.tests)


def test_a_flat_sample_of_another_name_is_found_where_it_is_the_only_one(two_flat: Campaign) -> None:
    only = replace(two_flat, tests=tuple(t for t in two_flat.tests if t.sample == "G"))
    assert only.flat_sample == required_flat_sample(only) == "G"


@pytest.mark.parametrize("wanted", ["nothing of this name", "B"])
def test_a_sample_that_is_not_flat_or_not_measured_is_refused_with_the_flat_ones(
    small_campaign: Path, wanted: str
) -> None:
    with pytest.raises(CampaignError) as refused:
        with_flat_sample(load_campaign(small_campaign), wanted)
    (problem,) = refused.value.problems
    assert (problem.found, problem.allowed) == (wanted, "--flat F")


def test_two_flat_samples_without_f_are_asked_about_only_where_one_is_needed(two_flat: Campaign) -> None:
    renamed = replace(
        two_flat,
        tests=tuple(replace(t, sample="H" if t.sample == "F" else t.sample) for t in two_flat.tests),
        samples={"G": two_flat.samples["G"], "H": two_flat.samples["F"]},
    )
    assert renamed.flat_sample == ""
    with pytest.raises(CampaignError, match="--flat G or --flat H"):
        required_flat_sample(renamed)
