"""Combined intervals hold the law as often as they say, in a small run of benchmarks/combined_coverage.py."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

BENCHMARK = Path(__file__).resolve().parents[2] / "benchmarks" / "combined_coverage.py"


@pytest.fixture(scope="module")
def benchmark() -> ModuleType:
    if not BENCHMARK.is_file():
        pytest.skip("the benchmarks are not beside these tests")
    spec = importlib.util.spec_from_file_location("combined_coverage", BENCHMARK)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["combined_coverage"] = module  # where its dataclasses look up their annotations
    spec.loader.exec_module(module)
    return module


def test_combined_intervals_hold_the_law_and_those_of_lucky_specimens_too(benchmark: ModuleType) -> None:
    found = benchmark.coverage("standard", "poor", 40, 5).set_index(["samples", "interval"])
    every = found.loc["all", "combined"]
    chance = 100 * 4 * np.sqrt(0.95 * 0.05 / 40)  # the six samples of a campaign share its instrument
    for number in benchmark.NUMBERS:
        assert abs(every[number] - 95) < chance
        assert found.loc[("all", "type A"), number] < every[number]
    assert found.loc[("alike by luck", "combined"), "T_N"] > 80


@pytest.mark.slow
def test_without_the_other_samples_lucky_specimens_are_believed_too_much(benchmark: ModuleType) -> None:
    alone, pooled = (
        benchmark.coverage("standard", "precise", 25, 5, dof).set_index(["samples", "interval"])["T_N"]
        for dof in (0.0, benchmark.PRIOR_DOF)
    )
    assert alone["alike by luck", "combined"] < 80 < pooled["alike by luck", "combined"]


def test_errors_have_the_sizes_that_the_instrument_states(benchmark: ModuleType) -> None:
    stated = benchmark.INSTRUMENTS["poor"]
    rng = np.random.default_rng(1)
    drawn = [benchmark.drawn(stated, rng) for _ in range(4000)]
    for name, scale in (("gain", 0.03), ("zero_N", 0.03), ("load_gain", 0.02), ("area", 0.05)):
        assert np.std([getattr(e, name) for e in drawn]) == pytest.approx(scale, rel=0.05)
