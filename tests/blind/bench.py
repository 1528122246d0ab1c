"""A campaign in the making: its design, its table of tests, and the forces of every pull.

Nothing here imports the library that is tested. The patterns follow runs of the reference engine, with a random error
on top (``patterns.py``); specimens and repeats scatter as ``scatter.py`` says.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import pandas as pd

from .patterns import BETWEEN_READINGS, Draw, ErrorSize, engine_ratio, error_gain, shares

AREA_MM2 = 55.0
GRAVITY = 9.80665
STIFFNESS_N_PER_MM = 6.0
Noise = Literal["relative", "absolute", "heavy", "unequal"]
Shares = tuple[float, float, float, float]


@dataclass(frozen=True)
class Design:
    """What is measured, and how it scatters: by default the practice campaigns at a third of their repeats.

    ``repeat_sd`` (static, sliding) and ``specimen_sd`` are standard deviations of ln T, ``specimen_slope`` is the
    standard deviation of a specimen's slope per e-fold of load. ``pattern_error`` multiplies ``error_sizes``, which
    stand for every pattern that they do not name. ``missing`` is the share of tests that were never made. With
    ``measured_shares`` each pattern lies half way, in ln T, from the engine to a measured one: coefficient and adhesion
    over those of the flat sample, static then sliding.
    """

    samples: tuple[str, ...] = ("F", "A", "B", "C", "Sx", "Sy")
    specimens: int = 3
    masses_g: tuple[float, ...] = (5.0, 12.0, 25.0, 50.0, 90.0, 138.5)
    repeats: int = 2
    speeds_mm_s: tuple[float, ...] = (0.2,)
    holds_s: tuple[float, ...] = (10.0,)
    repeat_sd: tuple[float, float] = (0.09, 0.07)
    noise: Noise = "relative"
    specimen_sd: float = 0.05
    specimen_slope: float = 0.0
    missing: float = 0.0
    pattern_error: float = 1.0
    pattern_draw: Draw = "uniform"
    error_sizes: Mapping[str, ErrorSize] = field(default_factory=dict)
    measured_shares: Mapping[str, Shares] = field(default_factory=dict)

    def sizes(self) -> dict[str, ErrorSize]:
        """The size of the pattern error of every sample with cavities."""
        return {s: self.error_sizes.get(s, BETWEEN_READINGS) for s in self.samples if s != "F"}


STANDARD = Design()


@dataclass
class Bench:
    """One campaign in the making: the table of tests and the forces, N, changed in place by effects.

    ``law`` is that of the flat sample (mu, tau0 in kPa; static, then sliding), ``errors`` the drawn error of every
    pattern.
    """

    tests: pd.DataFrame
    law: tuple[float, float, float, float]
    errors: Mapping[str, np.ndarray]
    measured_shares: Mapping[str, Shares] = field(default_factory=dict)
    static: np.ndarray = field(init=False)
    sliding: np.ndarray = field(init=False)
    zero: np.ndarray = field(init=False)
    stiffness_N_per_mm: np.ndarray = field(init=False)
    samples_per_s: float = np.inf  # of the recorder; by default what 700 samples a pull come to

    def __post_init__(self) -> None:
        self.zero = np.zeros(len(self.tests))
        self.stiffness_N_per_mm = np.full(len(self.tests), STIFFNESS_N_PER_MM)
        self.remake(self.column("N"), list(self.tests["true_sample"]))

    def remake(self, load: np.ndarray, samples: list[str]) -> None:
        """Forces by the baseline law under these loads, of these samples."""
        both = self.forces(load, samples)
        self.static, self.sliding = both[:, 0], both[:, 1]

    def forces(self, load: np.ndarray, samples: list[str]) -> np.ndarray:
        """Static and sliding force of these samples under these loads, shape (n, 2)."""
        pressure_Pa = load / AREA_MM2 * 1e6
        mu, tau_kPa = np.array(self.law).reshape(2, 2).T
        flat = load[:, None] * mu + tau_kPa * AREA_MM2 * 1e-3
        ratio = engine_ratio(samples, pressure_Pa) * error_gain(self.errors, samples, pressure_Pa)
        return np.asarray(flat * ratio * self._half_way(load, samples, ratio))

    def _half_way(self, load: np.ndarray, samples: list[str], ratio: np.ndarray) -> np.ndarray:
        """Root of the measured ratio to the flat sample over ``ratio``, shape (n, 2); one where none was measured."""
        if not self.measured_shares:
            return np.ones_like(ratio)
        shares = np.array([self.measured_shares.get(s, (1.0, 1.0, 1.0, 1.0)) for s in samples]).reshape(-1, 2, 2)
        parts = np.stack([np.outer(load, self.law[::2]), np.full((len(load), 2), self.law[1::2]) * AREA_MM2 * 1e-3], 2)
        measured = np.sum(shares * parts, axis=2) / np.sum(parts, axis=2)
        there = np.array([[s in self.measured_shares] for s in samples])
        return np.where(there, np.sqrt(measured / ratio), 1.0)

    def adhesion_N(self) -> np.ndarray:
        """The part of each baseline force that does not grow with the load, shape (n, 2)."""
        rows = np.array([shares(s) for s in self.tests["true_sample"]]) * np.array(self.law)
        return rows[:, [1, 3]] * AREA_MM2 * 1e-3

    def scale(self, gain: np.ndarray | float) -> None:
        """Both forces times the same gain."""
        self.static, self.sliding = self.static * gain, self.sliding * gain

    def column(self, name: str) -> np.ndarray:
        return self.tests[name].to_numpy()

    def of_sample(self, value: Callable[[str], float]) -> np.ndarray:
        return np.array([value(s) for s in self.tests["true_sample"]])
