"""Healthy campaigns spoiled in every way known: each fault is named, and nothing healthy touched."""

from __future__ import annotations

import importlib.util
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest
from support import first_quick
from support.campaigns import DIALECTS, MadeCampaign

from tribo.campaign import load_campaign
from tribo.stages import ingest

SPOIL = Path(__file__).parents[1] / "benchmarks" / "spoil_campaign.py"


@pytest.fixture(scope="module")
def spoil_campaign() -> ModuleType:
    spec = importlib.util.spec_from_file_location("spoil_campaign", SPOIL)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["spoil_campaign"] = module
    spec.loader.exec_module(module)
    return module


@pytest.mark.slow
@pytest.mark.parametrize("seed", first_quick(range(len(DIALECTS))), ids=DIALECTS)
def test_every_kind_of_damage_is_named_in_every_dialect_and_nothing_healthy_touched(
    spoil_campaign: ModuleType, made: Callable[[str], MadeCampaign], tmp_path: Path, seed: int
) -> None:
    counts, wrong = spoil_campaign.run(made(DIALECTS[seed]).folder, 2, seed, tmp_path / "spoiled")
    assert wrong == []
    assert all(counts[name] == 2 for name in spoil_campaign.KINDS)
    assert counts["healthy tests untouched"] > 80


@pytest.mark.slow
def test_every_kind_of_damage_is_named_in_the_practice_campaigns_and_nothing_healthy_touched(
    spoil_campaign: ModuleType, practice: Callable[[str], Path], tmp_path: Path
) -> None:
    found = {n: spoil_campaign.run(practice(n), 2, int(n), tmp_path / n) for n in ("01", "02", "03", "04")}
    assert {number: wrong for number, (_, wrong) in found.items() if wrong} == {}
    assert all(counts[name] == 2 for counts, _ in found.values() for name in spoil_campaign.KINDS)
    assert min(counts["healthy tests untouched"] for counts, _ in found.values()) > 220


def test_a_fault_that_nobody_names_and_a_healthy_test_touched_are_told(
    spoil_campaign: ModuleType, small_campaign: Path, tmp_path: Path
) -> None:
    """The benchmark itself can fail: a healthy test judged as spoiled, and two spoiled ones as healthy."""
    healthy = ingest(load_campaign(small_campaign))
    folder = Path(shutil.copytree(small_campaign, tmp_path / "spoiled"))
    (folder / "raw" / "T002.csv").write_bytes(b"")
    lines = (folder / "raw" / "T005.csv").read_bytes().splitlines(keepends=True)
    (folder / "raw" / "T005.csv").write_bytes(b"".join(lines[:-100]))
    spoiled = ingest(load_campaign(folder))
    _, wrong = spoil_campaign.judge(healthy, healthy, {"T001": ("nothing", {"empty"})})
    assert wrong == ["T001: nothing not found, told nothing"]
    _, wrong = spoil_campaign.judge(healthy, spoiled, {})
    assert [line.partition(":")[0] for line in wrong] == ["T002", "T005"]
    assert all("healthy, yet touched" in line for line in wrong)
