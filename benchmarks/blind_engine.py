"""What the reference engine makes of a few samples and pressures, for campaigns that hide effects on top of it.

    python benchmarks/blind_engine.py tests/blind/reference_engine.csv

Sixteen runs of 36 x 36 blocks, about seven minutes on one core; rows already in the file are not computed again.
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path

from tribo.simulate import SimConfig, simulate

SAMPLES = ("F", "A", "B", "C")
PRESSURES_PA = (1.5e3, 5e3, 12e3, 25e3)
HEAD = ("sample", "pressure_Pa", "static_over_load", "sliding_over_load")


def main(path: Path) -> None:
    known = set()
    if path.exists():
        with path.open(newline="") as file:
            known = {(row["sample"], float(row["pressure_Pa"])) for row in csv.DictReader(file)}
    else:
        path.write_text(",".join(HEAD) + "\n")
    for sample in SAMPLES:
        for pressure in PRESSURES_PA:
            if (sample, pressure) in known:
                continue
            config = SimConfig(
                sample=sample, pressure_Pa=pressure, angle_deg=22.5, seed=11, blocks=(36, 36), engine="reference",
                duration_peaks=2.0,
            )  # fmt: skip
            run = simulate(config)
            with path.open("a") as file:
                file.write(f"{sample},{pressure:g},{run.static_friction:.5f},{run.sliding_friction:.5f}\n")
            print(sample, pressure, run.static_friction, run.sliding_friction, flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
