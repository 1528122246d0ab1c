"""A campaign in the making: its design, its table of tests, and the forces of every pull.

Nothing here imports ``tribo.mechanisms``. What a pattern makes of the flat law comes from one of two sources: shares
that lie between two published codes of the same model (the paper's Table 2 and an independent one), or forces that
the reference engine gave at a few pressures (``reference_engine.csv``). The diagnosis so meets the error of its
own predictor.
"""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd

AREA_MM2 = 55.0
GRAVITY = 9.80665
STIFFNESS_N_PER_MM = 6.0
# mu_s, tau_s, mu_d, tau_d (kPa) over those of F: the paper's Table 2, and an independent code
PAPER = {
    "A": (0.868, 0.756, 0.995, 0.939), "B": (0.787, 0.419, 1.054, 0.506), "C": (0.837, 0.319, 1.079, 0.408),
    "Sx": (0.688, 0.462, 0.995, 0.721), "Sy": (0.680, 0.432, 0.990, 0.723),
}  # fmt: skip
OTHER = {
    "A": (0.919, 0.802, 1.014, 0.982), "B": (0.873, 0.456, 1.055, 0.625), "C": (0.843, 0.337, 1.051, 0.482),
    "Sx": (0.779, 0.533, 1.020, 0.759), "Sy": (0.758, 0.431, 1.024, 0.768),
}  # fmt: skip
OPEN_SHARE = {"F": 0.0, "A": 0.049, "B": 0.349, "C": 0.442, "Sx": 0.303, "Sy": 0.303}
RIM_PER_MM = {"F": 0.0, "A": 39.3, "B": 139.6, "C": 117.8, "Sx": 18.2, "Sy": 18.2}
PATTERNS = {
    "F": 'cavity = "none"',
    "A": 'cavity = "circle"\ndiameter_um = 5.0\npitch_um = [20.0, 20.0]',
    "B": 'cavity = "circle"\ndiameter_um = 10.0\npitch_um = [15.0, 15.0]',
    "C": 'cavity = "circle"\ndiameter_um = 15.0\npitch_um = [20.0, 20.0]',
    "S": 'cavity = "rectangle"\nsize_um = [200.0, 40.0]\npitch_um = [220.0, 120.0]\nstaggered = true',
}  # fmt: skip


@dataclass(frozen=True)
class Design:
    """What is measured: by default what the practice campaigns hold, at a third of the repeats."""

    samples: tuple[str, ...] = ("F", "A", "B", "C", "Sx", "Sy")
    specimens: int = 3
    masses_g: tuple[float, ...] = (5.0, 12.0, 25.0, 50.0, 90.0, 138.5)
    repeats: int = 2
    speeds_mm_s: tuple[float, ...] = (0.2,)
    holds_s: tuple[float, ...] = (10.0,)
    repeat_sd: tuple[float, float] = (0.09, 0.07)
    specimen_sd: float = 0.05
    tail: float = math.inf  # degrees of freedom of the repeats; small is heavy-tailed
    missing: float = 0.0  # share of tests that were never made
    engine: bool = False  # patterns as the reference engine has them (F, A, B, C)


STANDARD = Design()


@dataclass
class Bench:
    """One campaign in the making: the table of tests and the forces, N, changed in place by effects."""

    tests: pd.DataFrame
    law: tuple[float, float, float, float]
    shares: dict[str, tuple[float, float, float, float]]
    static: np.ndarray = field(init=False)
    sliding: np.ndarray = field(init=False)
    zero: np.ndarray = field(init=False)
    stiffness_N_per_mm: np.ndarray = field(init=False)
    samples_per_s: float = math.inf  # of the recorder; by default what 700 samples a pull come to
    engine: bool = False

    def __post_init__(self) -> None:
        self.zero = np.zeros(len(self.tests))
        self.stiffness_N_per_mm = np.full(len(self.tests), STIFFNESS_N_PER_MM)
        self.remake(self.tests["N"].to_numpy(), self.tests["true_sample"].to_list())

    def remake(self, load: np.ndarray, samples: list[str]) -> None:
        """Forces by the baseline law under these loads, of these samples."""
        rows = np.array([self.shares[s] for s in samples]) * np.array(self.law)
        adhesion = AREA_MM2 * 1e-3  # kPa to N
        self.static = rows[:, 0] * load + rows[:, 1] * adhesion
        self.sliding = rows[:, 2] * load + rows[:, 3] * adhesion
        if self.engine:
            static, sliding = _engine_factors(load / AREA_MM2 * 1e6, samples)
            flat = np.array(self.law)
            self.static = static * (flat[0] * load + flat[1] * adhesion)
            self.sliding = sliding * (flat[2] * load + flat[3] * adhesion)

    def column(self, name: str) -> np.ndarray:
        return self.tests[name].to_numpy()

    def of_sample(self, table: dict[str, float]) -> np.ndarray:
        return np.array([table[s] for s in self.tests["true_sample"]])


@cache
def _engine_table() -> dict[str, np.ndarray]:
    """Per sample: pressure (Pa), static and sliding force over those of F at that pressure, (3, pressures)."""
    rows: dict[str, list[list[float]]] = {}
    with (Path(__file__).parent / "reference_engine.csv").open(newline="") as file:
        for row in csv.DictReader(file):
            numbers = [float(row[key]) for key in ("pressure_Pa", "static_over_load", "sliding_over_load")]
            rows.setdefault(row["sample"], []).append(numbers)
    table = {sample: np.array(sorted(numbers)).T for sample, numbers in rows.items()}
    flat = table["F"][1:].copy()
    return {sample: np.vstack([t[0], t[1:] / flat]) for sample, t in table.items()}


def _engine_factors(pressure_Pa: np.ndarray, samples: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """Force of each pull over that of the flat sample under the same pressure, as the reference engine has it."""
    found = np.ones((2, len(samples)))
    for sample in set(samples):
        here = np.array([s == sample for s in samples])
        p, *factors = _engine_table()[sample]
        for k, factor in enumerate(factors):
            found[k, here] = np.interp(np.log(pressure_Pa[here]), np.log(p), factor)
    return found[0], found[1]
