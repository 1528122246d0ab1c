"""How static friction depends on the number of blocks and on the mesh, which the paper asserts in a sentence each.

    python benchmarks/simulator_size.py blocks docs/data/simulator-blocks.csv
    python benchmarks/simulator_size.py mesh docs/data/simulator-mesh.csv

``blocks``: flat samples of growing size against the expected minimum of n Gaussian numbers. ``mesh``: the same domain
at l = 5 um with square cavities, and at 2.5 um with square and with round ones.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator

import numpy as np
import pandas as pd

from tribo.simulate import PAPER, SimConfig, simulate
from tribo.simulate.calibration import expected_minimum


def blocks() -> Iterator[dict[str, object]]:
    for n in (10, 20, 43, 85, 170, 340, 680):
        repeats = 20 if n < 200 else 5
        config = SimConfig(blocks=(n, n), duration_peaks=1.001, window_start_peaks=1.0005)
        adhesion = PAPER.static_adhesion_Pa / config.pressure_Pa
        static = [simulate(config.with_(seed=s)).static_friction - adhesion for s in range(repeats)]
        yield {
            "blocks_a_side": n, "runs": repeats, "mu_static": np.mean(static),
            "mu_static_se": np.std(static, ddof=1) / repeats**0.5,
            "mu_expected": PAPER.mu_s + PAPER.mu_s_sd * expected_minimum(n * n),
        }  # fmt: skip


def mesh() -> Iterator[dict[str, object]]:
    for sample in ("F", "A", "B", "C"):
        for spacing_um, shape in ((5.0, "square"), (2.5, "square"), (2.5, "round")):
            n = round(425 / spacing_um)
            config = SimConfig(
                sample=sample, blocks=(n, n), spacing_m=spacing_um * 1e-6, thickness_m=5e-6, cavity_shape=shape,
                dt_s=5e-8 if spacing_um == 5.0 else 2.5e-8, rest_tolerance=1e-2, duration_peaks=1.6,
            )  # fmt: skip
            runs = [simulate(config.with_(seed=s, angle_deg=22.5)) for s in range(2)]
            yield {
                "sample": sample, "spacing_um": spacing_um, "cavities": shape,
                "area_fraction": runs[0].parameters["area_fraction"],
                "static": np.mean([r.static_friction for r in runs]),
                "sliding": np.mean([r.sliding_friction for r in runs]),
            }  # fmt: skip


if __name__ == "__main__":
    what, path = sys.argv[1:3]
    rows = []
    for row in {"blocks": blocks, "mesh": mesh}[what]():
        rows.append(row)
        print(*row.values(), flush=True)
        pd.DataFrame(rows).to_csv(path, index=False, float_format="%.6g")
