"""Mean force and stick-slip of a structured elastomer on a soft machine, against the same sample without structure.

    python benchmarks/structured_stick_slip.py run docs/data/structured-stick-slip.csv
    python benchmarks/structured_stick_slip.py table docs/data/structured-stick-slip.csv

After Broermann, Barel, Urbakh and Bennewitz (Tribology Letters 50, 2013): hexagonal pillars of PDMS slide with less
friction and smaller stick-slip than the flat sample. Patches of 32 x 32 blocks with elastic contact, 10 kPa, hexagonal
lattices of round pillars and holes, four seeds; the machine has 1/10 or 1/30 of the stiffness of the layer, the slider
the mass of the load. ``drop`` is that from the peak to the lowest force after it; mean and rms leave the first quarter
out. What the file holds already is not computed again.
"""

from __future__ import annotations

import math
import os
import sys
from pathlib import Path

import numpy as np
import pandas as pd

from tribo.records import Pattern
from tribo.springblock import SimConfig, simulate

ROOT3 = math.sqrt(3.0)
SEEDS = int(os.environ.get("SEEDS", "4"))


def hexagonal(name: str, feature: str, diameter_um: float, pitch_um: float) -> Pattern:
    size, pitch = (1e-6 * diameter_um,) * 2, (1e-6 * pitch_um, 0.5e-6 * ROOT3 * pitch_um)
    return Pattern(name, "circle", size, pitch, staggered=True, feature=feature, lattice="hexagonal")


SAMPLES = {
    "flat": None,
    "holes 20 um, pitch 40 um": hexagonal("holes 20", "hole", 20.0, 40.0),
    "pillars 32 um, pitch 40 um": hexagonal("pillars 32", "pillar", 32.0, 40.0),
    "pillars 24 um, pitch 40 um": hexagonal("pillars 24", "pillar", 24.0, 40.0),
}


def config_of(sample: str, share: float, seed: int) -> SimConfig:
    """A patch on a machine of 1 / ``share`` of the layer's stiffness, damped at 0.1 of critical, over four rises."""
    base = SimConfig(
        sample="F" if SAMPLES[sample] is None else "structured", pattern=SAMPLES[sample], blocks=(32, 32), seed=seed,
        contact_stiffness_Pa_per_m=1.2e11, angle_deg=0.0, sample_interval_s=2e-6, speed_m_s=2e-3, pressure_Pa=10e3,
    )  # fmt: skip
    layer = 32 * 32 * base.shear_stiffness_N_m
    stiffness, mass = layer / share, base.moved_mass_kg
    rise_s = 6.0 * base.normal_load_N / (stiffness * base.speed_m_s)
    return base.with_(
        machine_stiffness_N_per_m=stiffness, slider_mass_kg=mass, duration_s=4.0 * rise_s,
        machine_damping_N_s_per_m=0.2 * math.sqrt(stiffness * mass),
    )


def run(path: Path) -> None:
    rows = pd.read_csv(path).to_dict("records") if path.exists() else []
    done = {(row["sample"], row["softer"], row["seed"]) for row in rows}
    for softer in (10.0, 30.0):
        for seed in range(SEEDS):
            for sample in SAMPLES:
                if (sample, softer, seed) in done:
                    continue
                config = config_of(sample, softer, seed)
                pull = simulate(config)
                after = pull.time_s > pull.peak_s
                lowest = float(pull.force_N[after].min()) / pull.normal_load_N
                late = after & (pull.time_s > 0.25 * pull.time_s[-1])
                time, force = pull.time_s[late], pull.force_N[late] / pull.normal_load_N
                mean = float(np.trapezoid(force, time) / (time[-1] - time[0]))
                spread = float(np.sqrt(np.trapezoid((force - mean) ** 2, time) / (time[-1] - time[0])))
                rows.append({"sample": sample, "softer": softer, "seed": seed,
                             "area_fraction": pull.parameters["area_fraction"], "static": pull.static_friction,
                             "drop": pull.static_friction - lowest, "mean": mean, "rms": spread,
                             })  # fmt: skip
                print(*rows[-1].values(), flush=True)
                pd.DataFrame(rows).to_csv(path, index=False, float_format="%.5g")


def table(path: Path) -> pd.DataFrame:
    """Means over the seeds, each with its standard error."""
    rows = pd.read_csv(path).groupby(["softer", "area_fraction", "sample"])
    found = rows[["static", "drop", "mean", "rms"]].agg(["mean", "sem"])
    return found.sort_index(ascending=[True, False, True])


if __name__ == "__main__":
    what, file = sys.argv[1:]
    if what == "run":
        run(Path(file))
    else:
        print(table(Path(file)).round(3).to_string())
