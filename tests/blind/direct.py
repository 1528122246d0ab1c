"""Campaigns handed to the diagnosis as records, without files: what a perfect reader would make of the raw exports.

A pull is given the forces of the bench with the small errors of reading that raw files of this noise show. Effects
that show in the recorded curve itself (a slow recorder, the slope of the rise, a drifting zero) should go through
files (``tribometer.write``) instead.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from tribo.records import Campaign, Correction, Ingested, Pattern, Pull, Test

from .bench import AREA_MM2, Bench
from .patterns import CAVITIES

READING_N = (0.04, 0.004)  # of a static peak and of a sliding mean, about what raw files of this noise give
ZERO_N = 0.001
IN_TRACE = {"bulk_viscoelasticity", "sampling_clip", "machine_compliance", "load_cell_offset", "load_cell_drift"}


def pattern_of(sample: str) -> Pattern:
    """The pattern of a sample name as campaign.toml would describe it."""
    if sample[0] not in CAVITIES:
        return Pattern(sample)
    shape, x, y, pitch_x, pitch_y = CAVITIES[sample[0]]
    return Pattern(sample[0], shape, (x * 1e-6, y * 1e-6), (pitch_x * 1e-6, pitch_y * 1e-6), shape == "rectangle")


def _removed(row: Any) -> dict[str, str]:
    """The column ``without`` of tests.csv, where a campaign has it."""
    removed = getattr(row, "without", None)
    return {"without": removed} if isinstance(removed, str) else {}


def ingested(bench: Bench, seed: int = 0) -> Ingested:
    """The campaign as it looks once its exports are read."""
    rng = np.random.default_rng(seed)
    tests, pulls = [], {}
    for k, row in enumerate(bench.tests.itertuples()):
        test = Test(
            row.test_id, f"raw/{row.test_id}.csv", row.sample, row.N, row.specimen, row.direction,
            row.speed_mm_s * 1e-3, row.hold_s, row.repeat, row.run_order, row.specimen_run, row.started_at,
            row.temperature_C, row.humidity_pct, row.operator, correction=Correction(speed_m_s=row.speed_mm_s * 1e-3),
            load_from="mass_g", mass_kg=row.mass_g * 1e-3, covariates=_removed(row),
        )  # fmt: skip
        tests.append(test)
        stiffness = float(bench.stiffness_N_per_mm[k]) * 1e3 * np.exp(0.05 * rng.normal())
        pulls[test.test_id] = Pull(
            test.test_id, "first_peak", bench.static[k] + rng.normal(0, READING_N[0]), READING_N[0],
            bench.sliding[k] + rng.normal(0, READING_N[1]), READING_N[1],
            zero_N=bench.zero[k] + rng.normal(0, ZERO_N), zero_u_N=ZERO_N, onset_s=1.0, peak_s=2.0,
            window_s=(3.0, 9.0), rise_N_per_s=float(bench.stiffness_N_per_mm[k]) * row.speed_mm_s,
            rise_stiffness_N_per_m=stiffness, noise_N=0.006,
        )  # fmt: skip
    samples = {s: pattern_of(s) for s in sorted(set(bench.tests["sample"]))}
    campaign = Campaign("hidden", Path("."), AREA_MM2 * 1e-6, tuple(tests), samples)
    return Ingested(campaign, {}, pulls, ())
