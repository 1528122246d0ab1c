"""What the reference engine makes of every sample, for the campaigns of the blind test.

    python benchmarks/blind_engine.py tests/blind/reference_engine.csv

55 runs, about twenty minutes on one core. Runs that are already in the file are not made again. Each row is one run:
static and sliding friction over normal load, T/N. The flat sample is run on both lattices, because the blind test uses
only the ratio of a pattern to the flat sample on the same lattice.
"""

from __future__ import annotations

import csv
import sys
from dataclasses import dataclass
from pathlib import Path

from tribo.springblock import SimConfig, simulate

# The standard design of the blind test presses with 1.16 to 25 kPa; hidden loads reach somewhat further.
PRESSURES_PA = (1.15e3, 3e3, 8e3, 18e3, 36e3)
SMALL, WIDE = (36, 36), (44, 48)  # WIDE holds whole cavities of S: one along x, two staggered rows along y
HEAD = ("sample", "blocks_x", "blocks_y", "pressure_Pa", "angle_deg", "seed", "static_over_load", "sliding_over_load")


@dataclass(frozen=True)
class Series:
    """One sample at one angle on one lattice, run at every pressure."""

    sample: str
    blocks: tuple[int, int]
    angle_deg: float
    seed: int


# Round and square cavities repeat every 45 degrees by mirror symmetry: the middles of two halves stand for all angles.
SERIES = (
    *(Series(sample, SMALL, 33.75, 12) for sample in "FABC"),
    Series("F", WIDE, 22.5, 13), Series("Sx", WIDE, 5.0, 13), Series("Sy", WIDE, 85.0, 13),
    *(Series(sample, SMALL, 11.25, 11) for sample in "FABC"),
)  # fmt: skip


def key(series: Series, pressure_Pa: float) -> tuple[str, ...]:
    """What tells one run from another, as it is spelled in the file."""
    x, y = series.blocks
    return (series.sample, str(x), str(y), f"{pressure_Pa:g}", f"{series.angle_deg:g}", str(series.seed))


def main(path: Path) -> None:
    if not path.exists():
        path.write_text(",".join(HEAD) + "\n")
    with path.open(newline="") as file:
        known = {tuple(row[name] for name in HEAD[:6]) for row in csv.DictReader(file)}
    for series in SERIES:
        for pressure in PRESSURES_PA:
            if key(series, pressure) in known:
                continue
            run = simulate(
                SimConfig(
                    sample=series.sample, pressure_Pa=pressure, angle_deg=series.angle_deg, seed=series.seed,
                    blocks=series.blocks, engine="reference", duration_peaks=2.0,
                )
            )  # fmt: skip
            row = (*key(series, pressure), f"{run.static_friction:.5f}", f"{run.sliding_friction:.5f}")
            with path.open("a") as file:
                file.write(",".join(row) + "\n")
            print(*row, flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
