"""The model is calibrated on the flat sample alone, and finished simulations are not run again."""

from __future__ import annotations

from pathlib import Path

import pytest

from tribo import stages
from tribo.campaign import load_campaign
from tribo.errors import CampaignError, FitError
from tribo.prediction import MOST_LOADS, loads_to_simulate, predict
from tribo.records import LawFit, Regime


@pytest.fixture(scope="module")
def fitted(small_campaign: Path) -> tuple[stages.Ingested, tuple[LawFit, ...]]:
    ingested = stages.ingest(load_campaign(small_campaign))
    return ingested, stages.fit(ingested)


def run(fitted: tuple[stages.Ingested, tuple[LawFit, ...]], ensemble: Path, seed: int = 0) -> tuple[object, list[int]]:
    """A prediction, and how many runs each report of its progress counted as done."""
    ingested, fits = fitted
    seen: list[int] = []

    def progress(stage: str, done: int, total: int) -> None:
        if stage == "simulating the samples":
            seen.append(done)

    return predict(ingested.campaign, fits, "F", runs=2, seed=seed, ensemble=ensemble, progress=progress), seen


def test_a_second_start_takes_every_finished_run_from_the_store(
    fitted: tuple[stages.Ingested, tuple[LawFit, ...]], tmp_path: Path
) -> None:
    first, counted = run(fitted, tmp_path / "ensemble.nc")
    again, recounted = run(fitted, tmp_path / "ensemble.nc")
    assert counted[0] == 0
    assert recounted == [counted[-1]]
    assert again.table.equals(first.table)  # type: ignore[attr-defined]


def test_a_store_of_another_design_or_no_store_at_all_is_replaced(
    fitted: tuple[stages.Ingested, tuple[LawFit, ...]], tmp_path: Path
) -> None:
    store = tmp_path / "ensemble.nc"
    store.write_bytes(b"not HDF5")
    _, counted = run(fitted, store)
    _, other = run(fitted, store, seed=1)
    assert counted[0] == other[0] == 0
    assert counted[-1] == other[-1] > 0


def test_the_flat_law_is_all_the_model_sees_of_the_measurement(
    fitted: tuple[stages.Ingested, tuple[LawFit, ...]], tmp_path: Path
) -> None:
    ingested, fits = fitted
    alone = tuple(f for f in fits if f.sample == "F")
    with_all, _ = run((ingested, fits), tmp_path / "a.nc")
    flat_only, _ = run((ingested, alone), tmp_path / "b.nc")
    assert flat_only.table.equals(with_all.table)  # type: ignore[attr-defined]


def test_a_campaign_without_a_flat_law_is_refused(fitted: tuple[stages.Ingested, tuple[LawFit, ...]]) -> None:
    ingested, fits = fitted
    with pytest.raises(FitError, match="flat sample F"):
        predict(ingested.campaign, tuple(f for f in fits if f.sample != "F"), "F")


def test_many_loads_are_thinned_over_their_whole_range(small_campaign: Path) -> None:
    from dataclasses import replace

    campaign = load_campaign(small_campaign)
    tests = tuple(replace(campaign.tests[0], normal_load_N=0.1 * k) for k in range(1, 30))
    loads = loads_to_simulate(replace(campaign, tests=tests))
    assert len(loads) == MOST_LOADS
    assert (loads[0], loads[-1]) == pytest.approx((0.1, 2.9))


def test_a_flat_sample_of_another_name_is_found_and_two_are_asked_about(small_campaign: Path) -> None:
    from dataclasses import replace

    campaign = load_campaign(small_campaign)
    assert stages.flat_sample(campaign, "nothing of this name") == "F"
    both = {**campaign.samples, "B": replace(campaign.samples["F"], name="B")}
    with pytest.raises(CampaignError, match="one flat sample"):
        stages.flat_sample(replace(campaign, samples=both), "nothing of this name")


@pytest.mark.parametrize("regime", ["static", "sliding"])
def test_load_means_average_specimens_first(small_campaign: Path, regime: Regime) -> None:
    ingested = stages.ingest(load_campaign(small_campaign))
    table = ingested.table().query("sample == 'B'")
    for load, mean, u in stages.load_means(ingested, "B", regime):
        specimens = table[table["normal_load_N"] == load].groupby("specimen")[f"{regime}_N"].mean()
        assert mean == pytest.approx(specimens.mean())
        assert u == pytest.approx(specimens.sem())
