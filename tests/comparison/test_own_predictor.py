"""A diagnosis takes what the model makes of a pattern from the campaign's own simulations, where they are kept."""

from __future__ import annotations

import errno
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from diagnose.synthetic import PATTERNS

from tribo.comparison.prediction import cells_of, kept_runs, run_cells
from tribo.diagnostics import tabled_predictor
from tribo.kept_results import DamagedResultWarning
from tribo.records import Campaign, StudyOptions, Test
from tribo.springblock import LocalFriction, SimConfig, stratified_design
from tribo.stages import own_predictor

AREA_M2 = 55e-6
FRICTION = LocalFriction(mu_s=5.1, static_adhesion_Pa=20e3)


def campaign() -> Campaign:
    samples = {s: PATTERNS[s] for s in ("F", "B")}
    tests = tuple(Test(f"{s}{n}", "", s, n, s) for s in samples for n in (0.2, 1.2))
    return Campaign("two samples", Path("."), AREA_M2, tests, samples)


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four cells of two runs, as tribo predict keeps them."""
    folder = tmp_path_factory.mktemp("kept")
    pressures = [n / AREA_M2 for n in (0.2, 1.2)]
    base = SimConfig(friction=FRICTION)
    run_cells(cells_of(stratified_design(campaign().samples, pressures, 2, 0, base)), StudyOptions(kept=folder))
    return folder


def test_kept_runs_are_read_with_the_local_friction_they_were_made_with(kept: Path) -> None:
    runs = kept_runs(kept, campaign().samples)
    assert runs is not None
    assert len(runs) == 8
    assert set(runs["sample"]) == {"F", "B"}


def test_shares_come_from_the_kept_runs_and_agree_with_the_table(kept: Path) -> None:
    own = own_predictor(campaign(), kept)
    assert own is not None
    assert own.source == "an ensemble simulated for this campaign"
    assert own.shares["B"] == pytest.approx(tabled_predictor(campaign().samples).shares["B"], rel=0.15)
    assert own.shares["B"] != tabled_predictor(campaign().samples).shares["B"]
    assert np.allclose(own.shares["F"], 1.0)


def test_runs_that_todays_sources_would_not_make_are_left_out(kept: Path, tmp_path: Path) -> None:
    for path in kept.glob("*.nc"):
        (tmp_path / path.name.replace("Pa-", "Pa-0")).write_bytes(path.read_bytes())
    (tmp_path / "F@1Pa-0.nc").write_bytes(b"no HDF5")
    with pytest.warns(DamagedResultWarning, match=r"F@1Pa-0\.nc: these simulations are not used"):
        assert kept_runs(tmp_path, campaign().samples) is None
    with pytest.warns(DamagedResultWarning):
        assert own_predictor(campaign(), tmp_path) is None
    assert own_predictor(campaign(), None) is None


def test_runs_that_the_system_cannot_read_now_are_not_left_out(
    kept: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import h5py

    class Failing(h5py.File):
        def __init__(self, path: Path, *given: Any):
            if Path(path).name.startswith("B@"):
                raise OSError(errno.EMFILE, os.strerror(errno.EMFILE))
            super().__init__(path, *given)

    monkeypatch.setattr(h5py, "File", Failing)
    with pytest.raises(OSError, match="Too many open files") as raised:
        own_predictor(campaign(), kept)
    assert Path(raised.value.filename).name.startswith("B@")
