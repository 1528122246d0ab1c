"""Healthy campaigns spoiled in every way known: each fault is named, and nothing healthy touched."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

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


@pytest.mark.parametrize("number", ["01", "02", "03", "04"])
def test_every_kind_of_damage_is_named_in_every_dialect_and_nothing_healthy_touched(
    spoil_campaign: ModuleType, practice: Callable[[str], Path], tmp_path: Path, number: str
) -> None:
    counts, wrong = spoil_campaign.run(practice(number), 2, int(number), tmp_path / "spoiled")
    assert wrong == []
    assert all(counts[name] == 2 for name in spoil_campaign.KINDS)
    assert counts["healthy tests untouched"] > 220


def test_a_fault_that_nobody_names_and_a_healthy_test_touched_are_told(
    spoil_campaign: ModuleType, practice: Callable[[str], Path]
) -> None:
    """The benchmark itself can fail: a healthy campaign judged as if one test were spoiled, and one other read anew."""
    healthy = ingest(load_campaign(practice("11-clean")))
    spoiled = ingest(load_campaign(practice("11-spoiled")))
    _, wrong = spoil_campaign.judge(healthy, healthy, {"T0001": ("nothing", {"empty"})})
    assert wrong == ["T0001: nothing not found, told nothing"]
    _, wrong = spoil_campaign.judge(healthy, spoiled, {})
    assert len(wrong) == 15
    assert all("healthy, yet touched" in line for line in wrong)
