"""Fast engine against the reference engine on the same random thresholds.

    python benchmarks/simulator_agreement.py peaks docs/data/simulator-peaks.csv
    python benchmarks/simulator_agreement.py sliding docs/data/simulator-sliding.csv

``peaks`` compares the static peak and the order of the first failures in 42 cases, cavities resting below 1e-4 and
below the default tolerance (about half an hour on one core); ``sliding`` the mean over the same window, ten seeds
(about ten minutes).
"""

from __future__ import annotations

import sys
from collections.abc import Iterator

import numpy as np
import pandas as pd

from tribo.simulate import SimConfig
from tribo.simulate.engine import Trajectory, lattice_of, run_fast, thresholds_of
from tribo.simulate.reference import run_reference
from tribo.simulate.run import run_of

SAMPLES = ("F", "A", "B", "C", "Sx", "Sy")
PRESSURES_PA = (2e3, 3e3, 5e3, 10e3, 15e3, 25e3, 40e3)


def peak_cases() -> Iterator[SimConfig]:
    """Every sample at every pressure, the angles spread over each sample's range."""
    angles = np.random.default_rng(8).uniform(0, 90, (len(SAMPLES), len(PRESSURES_PA)))
    for sample, row in zip(SAMPLES, angles, strict=True):
        for k, (pressure, angle) in enumerate(zip(PRESSURES_PA, row, strict=True)):
            nominal = {"Sx": 0.0, "Sy": 90.0}.get(sample)
            own = angle if nominal is None else nominal + (angle - 45) / 4.5
            yield SimConfig(
                sample=sample, pressure_Pa=pressure, angle_deg=float(own), seed=k, blocks=(48, 48), dt_s=1e-8,
                duration_peaks=1.01,
            )  # fmt: skip


def both(config: SimConfig) -> tuple[Trajectory, Trajectory]:
    """The same configuration and thresholds on both engines."""
    lattice = lattice_of(config)
    thresholds = thresholds_of(config, lattice)
    return run_fast(config, lattice, thresholds), run_reference(config, lattice, thresholds, 0.99)


def peaks() -> Iterator[dict[str, object]]:
    for config in peak_cases():
        fast, reference = both(config.with_(rest_tolerance=1e-4))
        lattice = lattice_of(config)
        default = run_fast(config, lattice, thresholds_of(config, lattice))
        yield {
            "sample": config.sample,
            "pressure_kPa": config.pressure_Pa / 1e3,
            "angle_deg": round(config.angle_deg, 2),
            "static_fast": fast.peak_N / config.normal_load_N,
            "static_reference": reference.peak_N / config.normal_load_N,
            "difference_percent": 100 * (fast.peak_N / reference.peak_N - 1),
            "difference_default_tolerance_percent": 100 * (default.peak_N / reference.peak_N - 1),
            "first_five_equal": bool(np.array_equal(fast.failed[:5], reference.failed[:5])),
        }


def sliding() -> Iterator[dict[str, object]]:
    for sample in ("F", "C"):
        for seed in range(10):
            config = SimConfig(
                sample=sample, angle_deg=9.0 * seed, seed=seed, blocks=(20, 20), dt_s=1e-8, duration_peaks=1.5
            )
            fast, reference = both(config)
            end_peaks = 1.5
            means = [
                run_of(config.with_(window_end_peaks=end_peaks), t, 1.0).sliding_friction for t in (fast, reference)
            ]
            yield {
                "sample": sample, "seed": seed, "angle_deg": config.angle_deg, "sliding_fast": means[0],
                "sliding_reference": means[1], "sliding_difference_percent": 100 * (means[0] / means[1] - 1),
            }  # fmt: skip


if __name__ == "__main__":
    what, path = sys.argv[1:3]
    rows = []
    for row in {"peaks": peaks, "sliding": sliding}[what]():
        rows.append(row)
        print(*row.values(), flush=True)
        pd.DataFrame(rows).to_csv(path, index=False, float_format="%.6g")
