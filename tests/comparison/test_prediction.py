"""The model is calibrated on the flat sample alone, and finished simulations are not run again."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tribo import stages
from tribo.campaign import load_campaign
from tribo.comparison.prediction import MOST_LOADS, Prediction, loads_to_simulate, predict
from tribo.comparison.prediction_runs import ModelRuns
from tribo.comparison.side_by_side import load_means
from tribo.errors import CampaignError, FitError
from tribo.records import LawFit, Regime


@pytest.fixture(scope="module")
def fitted(small_campaign: Path) -> tuple[stages.Ingested, tuple[LawFit, ...]]:
    ingested = stages.ingest(load_campaign(small_campaign))
    return ingested, stages.fit(ingested)


Fitted = tuple[stages.Ingested, tuple[LawFit, ...]]


def run(fitted: Fitted, kept: Path, **options: Any) -> tuple[Prediction, set[str]]:
    """A prediction of two runs a load, and the stages that had to be computed for it."""
    ingested, fits = fitted
    computed: set[str] = set()
    before = contents(kept)

    def progress(stage: str, done: int, total: int) -> None:
        if stage.startswith("calibrating"):
            computed.add("calibration")

    found = predict(ingested.campaign, fits, "F", ModelRuns(runs=2, kept=kept, **options), progress=progress)
    computed |= {name for name, content in contents(kept).items() if before.get(name) != content}
    return found, computed


def contents(folder: Path) -> dict[str, bytes]:
    """Every file of a folder."""
    return {p.name: p.read_bytes() for p in folder.glob("*")}


def test_a_second_start_computes_nothing_and_says_the_same(fitted: Fitted, tmp_path: Path) -> None:
    first, computed = run(fitted, tmp_path)
    again, recomputed = run(fitted, tmp_path)
    assert "calibration" in computed
    assert len([name for name in computed if name.endswith(".nc")]) == 4
    assert recomputed == set()
    assert again.table.equals(first.table)
    assert [r.force_N.tolist() for r in again.example_runs] == [r.force_N.tolist() for r in first.example_runs]


def test_a_damaged_cell_is_run_again_and_no_other(fitted: Fitted, tmp_path: Path) -> None:
    first, _ = run(fitted, tmp_path)
    damaged = sorted(tmp_path.glob("B@*.nc"))[0]
    damaged.write_bytes(b"not HDF5")
    again, recomputed = run(fitted, tmp_path)
    assert recomputed == {damaged.name}
    assert again.table.equals(first.table)


def test_runs_of_another_seed_replace_those_there_are(fitted: Fitted, tmp_path: Path) -> None:
    run(fitted, tmp_path)
    before = set(contents(tmp_path))
    run(fitted, tmp_path, seed=1)
    cells = {name for name in contents(tmp_path) if name.endswith(".nc")}
    assert len(cells) == 4
    assert not cells & before


def test_cells_run_one_by_one_are_what_a_prediction_takes(fitted: Fitted, tmp_path: Path) -> None:
    ingested, fits = fitted
    options = stages.StudyOptions(runs=2, kept=tmp_path)
    (only_b,) = {c.sample for c in stages.simulate_cells(ingested, fits, options, "B")}
    assert only_b == "B"
    cells = {p.name for p in tmp_path.glob("*.nc")}
    stages.simulate_cells(ingested, fits, options, "F")
    assert len(cells) == 2
    _, computed = run(fitted, tmp_path)
    assert computed == set()
    stages.simulate_cells(ingested, fits, replace(options, seed=1), "calibration")
    assert list(tmp_path.glob("*.nc")) == []
    with pytest.raises(CampaignError, match="no simulation has this name"):
        stages.simulate_cells(ingested, fits, options, "B@1Pa")


def test_the_flat_law_is_all_the_model_sees_of_the_measurement(fitted: Fitted, tmp_path: Path) -> None:
    ingested, fits = fitted
    alone = tuple(f for f in fits if f.sample == "F")
    with_all, _ = run((ingested, fits), tmp_path / "a")
    flat_only, _ = run((ingested, alone), tmp_path / "b")
    assert flat_only.table.equals(with_all.table)


def test_a_campaign_without_a_flat_law_is_refused(fitted: Fitted) -> None:
    ingested, fits = fitted
    with pytest.raises(FitError, match="flat sample F"):
        predict(ingested.campaign, tuple(f for f in fits if f.sample != "F"), "F")


def test_many_loads_are_thinned_over_their_whole_range(small_campaign: Path) -> None:
    campaign = load_campaign(small_campaign)
    tests = tuple(replace(campaign.tests[0], normal_load_N=0.1 * k) for k in range(1, 30))
    loads = loads_to_simulate(replace(campaign, tests=tests))
    assert len(loads) == MOST_LOADS
    assert (loads[0], loads[-1]) == pytest.approx((0.1, 2.9))


@pytest.mark.parametrize("regime", ["static", "sliding"])
def test_load_means_average_specimens_first(small_campaign: Path, regime: Regime) -> None:
    ingested = stages.ingest(load_campaign(small_campaign))
    table = ingested.table().query("sample == 'B'")
    for load, mean, u in load_means(ingested, "B", regime):
        specimens = table[table["normal_load_N"] == load].groupby("specimen")[f"{regime}_N"].mean()
        assert mean == pytest.approx(specimens.mean())
        assert u == pytest.approx(specimens.sem())
