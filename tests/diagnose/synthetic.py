"""Ingested campaigns straight from the virtual tribometer, without files: fast, and free of reading errors."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from blind.tribometer import AREA_MM2, Bench, Design, hide

from tribo.records import Campaign, Ingested, Pattern, Pull, Test

SMALL = Design(samples=("F", "A", "B", "C"), masses_g=(5.0, 25.0, 90.0, 138.5))


def _circle(name: str, diameter_um: float, pitch_um: float) -> Pattern:
    return Pattern(name, "circle", (diameter_um * 1e-6,) * 2, (pitch_um * 1e-6,) * 2)


_LONG = Pattern("S", "rectangle", (200e-6, 40e-6), (220e-6, 120e-6), True)
PATTERNS = {
    "F": Pattern("F"), "A": _circle("A", 5, 20), "B": _circle("B", 10, 15), "C": _circle("C", 15, 20),
    "Sx": _LONG, "Sy": _LONG,
}  # fmt: skip


def hidden(*effects: tuple[str, float], seed: int = 11, design: Design = SMALL) -> Ingested:
    """A campaign with effects hidden in it, as it looks once its traces are read."""
    return ingested(hide(seed, list(effects), design), seed)


def ingested(bench: Bench, seed: int = 0) -> Ingested:
    rng = np.random.default_rng(seed)
    tests, pulls = [], {}
    for k, row in enumerate(bench.tests.itertuples()):
        test = Test(
            row.test_id, f"raw/{row.test_id}.csv", row.sample, row.N, row.specimen, row.direction,
            row.speed_mm_s * 1e-3, row.hold_s, row.repeat, row.run_order, row.specimen_run, row.started_at,
            row.temperature_C, row.humidity_pct, row.operator,
        )  # fmt: skip
        tests.append(test)
        pulls[test.test_id] = Pull(
            test.test_id, "seed", bench.static[k], 0.004, bench.sliding[k], 0.001,
            zero_N=bench.zero[k] + rng.normal(0, 0.001), zero_u_N=0.001, onset_s=1.0, peak_s=2.0,
            window_s=(3.0, 9.0), rise_N_per_s=6.0 * row.speed_mm_s,
            rise_stiffness_N_per_m=6000.0 * np.exp(0.05 * rng.normal()), noise_N=0.006,
        )  # fmt: skip
    samples = {s: PATTERNS[s] for s in sorted(set(bench.tests["sample"]))}
    campaign = Campaign("hidden", Path("."), AREA_MM2 * 1e-6, tuple(tests), samples)
    return Ingested(campaign, {}, pulls, ())
