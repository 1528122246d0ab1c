"""The model is calibrated on the flat sample alone, and finished simulations are not run again."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from small_lattices import small_lattices

from tribo import stages
from tribo.campaign import load_campaign
from tribo.comparison.prediction import (
    MOST_LOADS,
    calibrated_cells,
    load_means,
    loads_to_simulate,
    predict,
)
from tribo.errors import CampaignError, FitError
from tribo.kept_results import DamagedResultWarning
from tribo.records import LawFit, Regime, Run


@pytest.fixture(scope="module", autouse=True)
def on_small_lattices() -> Iterator[None]:
    with small_lattices():
        yield


@pytest.fixture(scope="module")
def fitted(small_campaign: Path) -> tuple[stages.Ingested, tuple[LawFit, ...]]:
    ingested = stages.ingest(load_campaign(small_campaign))
    return ingested, stages.fit(ingested)


Fitted = tuple[stages.Ingested, tuple[LawFit, ...]]


def run(fitted: Fitted, kept: Path, **options: Any) -> tuple[pd.DataFrame, tuple[Run, ...], set[str]]:
    """Table and example runs of a prediction of two runs a load, and the stages that had to be computed for it."""
    ingested, fits = fitted
    computed: set[str] = set()
    before = contents(kept)

    def progress(stage: str, done: int, total: int) -> None:
        if stage.startswith("calibrating"):
            computed.add("calibration")

    chosen = stages.StudyOptions(runs=2, kept=kept, **options)
    calibrated = calibrated_cells(ingested.campaign, fits, "F", chosen, progress)
    _, table, examples = predict(ingested, fits, "F", calibrated, chosen, progress)
    computed |= {name for name, content in contents(kept).items() if before.get(name) != content}
    return table, examples, computed


def contents(folder: Path) -> dict[str, bytes]:
    """Every file of a folder."""
    return {p.name: p.read_bytes() for p in folder.glob("*")}


@dataclass(frozen=True)
class First:
    """A prediction from nothing, what had to be computed for it, and the folder of what it keeps: for tests to copy."""

    table: pd.DataFrame
    examples: tuple[Run, ...]
    computed: set[str]
    kept: Path


@pytest.fixture(scope="module")
def first(fitted: Fitted, tmp_path_factory: pytest.TempPathFactory) -> First:
    kept = tmp_path_factory.mktemp("first")
    return First(*run(fitted, kept), kept)


@pytest.fixture
def kept(first: First, tmp_path: Path) -> Path:
    """A copy of what the first prediction keeps."""
    return Path(shutil.copytree(first.kept, tmp_path / "kept"))


def test_a_second_start_computes_nothing_and_says_the_same(fitted: Fitted, first: First, kept: Path) -> None:
    again, examples, recomputed = run(fitted, kept)
    assert "calibration" in first.computed
    assert len([name for name in first.computed if name.endswith(".nc")]) == 4
    assert recomputed == set()
    assert again.equals(first.table)
    assert [r.force_N.tolist() for r in examples] == [r.force_N.tolist() for r in first.examples]


def test_a_damaged_cell_is_run_again_and_no_other(fitted: Fitted, first: First, kept: Path) -> None:
    damaged = sorted(kept.glob("B@*.nc"))[0]
    damaged.write_bytes(b"not HDF5")
    with pytest.warns(DamagedResultWarning, match=f"{damaged.name}: cannot be read .*these simulations are made again"):
        again, _, recomputed = run(fitted, kept)
    assert recomputed == {damaged.name}
    assert again.equals(first.table)


def test_runs_of_another_seed_replace_those_there_are(fitted: Fitted, kept: Path) -> None:
    before = set(contents(kept))
    run(fitted, kept, seed=1)
    cells = {name for name in contents(kept) if name.endswith(".nc")}
    assert len(cells) == 4
    assert not cells & before


def test_cells_run_one_by_one_are_what_a_prediction_takes(fitted: Fitted, kept: Path) -> None:
    ingested, fits = fitted
    for cell in kept.glob("*.nc"):
        cell.unlink()
    options = stages.StudyOptions(runs=2, kept=kept)
    (only_b,) = {c.sample for c in stages.simulate_cells(ingested, fits, options, "B")}
    assert only_b == "B"
    cells = {p.name for p in kept.glob("*.nc")}
    stages.simulate_cells(ingested, fits, options, "F")
    assert len(cells) == 2
    *_, computed = run(fitted, kept)
    assert computed == set()
    stages.simulate_cells(ingested, fits, replace(options, seed=1), "calibration")
    assert list(kept.glob("*.nc")) == []
    with pytest.raises(CampaignError, match="no simulation has this name"):
        stages.simulate_cells(ingested, fits, options, "B@1Pa")


def test_the_flat_law_is_all_the_model_sees_of_the_measurement(fitted: Fitted, first: First, tmp_path: Path) -> None:
    ingested, fits = fitted
    alone = tuple(f for f in fits if f.sample == "F")
    flat_only, *_ = run((ingested, alone), tmp_path)
    assert flat_only.equals(first.table)


def test_a_campaign_without_a_flat_law_is_refused(fitted: Fitted) -> None:
    ingested, fits = fitted
    with pytest.raises(FitError, match="flat sample F"):
        calibrated_cells(ingested.campaign, tuple(f for f in fits if f.sample != "F"), "F", stages.StudyOptions())


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
