"""The intervals hold the law as often as they say, in a small run of benchmarks/interval_coverage.py."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np
import pytest

COVERAGE = Path(__file__).resolve().parents[2] / "benchmarks" / "interval_coverage.py"
DEFAULT, POOLED = "specimens first, relative", "pooled least squares"


@pytest.mark.parametrize("design", ["standard", "heavy, missing"])
def test_the_default_intervals_hold_the_law_in_95_percent_and_pooled_ones_do_not(design: str) -> None:
    if not COVERAGE.is_file():
        pytest.skip("the benchmarks are not beside these tests")
    benchmark = runpy.run_path(str(COVERAGE))
    found = benchmark["coverage"](design, benchmark["DESIGNS"][design], 60, 3, [DEFAULT, POOLED])
    held = found.set_index(["method", "quantity"])["coverage_pct"]
    intervals = int(found["intervals"].iloc[0])
    chance = 100 * 4 * np.sqrt(0.95 * 0.05 / intervals)
    assert intervals == 360
    assert (np.abs(held[DEFAULT] - 95) < chance).all()
    assert held[POOLED, "T at 10 kPa"] < 90
