"""What the cavities of a sample make of the flat law: runs of the reference engine, and an error drawn on top.

The ratio of a sample to the flat sample, at the same pressure and on the same lattice, is read from
``reference_engine.csv`` (made by ``benchmarks/blind_engine.py``), averaged over the angles there, and interpolated in
the logarithm of the pressure.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.interpolate import PchipInterpolator

TABLE = Path(__file__).parent / "reference_engine.csv"
# cavity shape, size along x and y, pitch along x and y, in micrometres
CAVITIES: dict[str, tuple[str, float, float, float, float]] = {
    "A": ("circle", 5, 5, 20, 20), "B": ("circle", 10, 10, 15, 15), "C": ("circle", 15, 15, 20, 20),
    "S": ("rectangle", 200, 40, 220, 120),
}  # fmt: skip
MIDDLE_PRESSURE_PA = 6e3  # where the offset of a pattern error counts, about the middle of the loads in ln p
Samples = list[str]


@dataclass(frozen=True)
class ErrorSize:
    """Standard deviations of ln T by which a pattern deviates from the engine's, each (static, sliding).

    ``offset`` is the same at all pressures, ``slope`` is per e-fold of pressure, ``curve`` per squared e-fold.
    """

    offset: tuple[float, float]
    slope: tuple[float, float]
    curve: tuple[float, float]


# Used where a design gives no size: between readings of the paper that its text leaves open (shear stiffness, cavities
# at the edge, angles), the patterns move by about this much (docs/data/table2-study.csv).
BETWEEN_READINGS = ErrorSize((0.051, 0.039), (0.0147, 0.0153), (0.0061, 0.0059))
Draw = Literal["uniform", "heavy"]


def open_share(sample: str) -> float:
    """Cavity area over nominal area, 0 for the flat sample."""
    if sample[0] not in CAVITIES:
        return 0.0
    shape, x, y, pitch_x, pitch_y = CAVITIES[sample[0]]
    return (math.pi / 4 if shape == "circle" else 1.0) * x * y / (pitch_x * pitch_y)


def rim_per_mm(sample: str) -> float:
    """Length of the cavity rims per nominal area, 1/mm."""
    if sample[0] not in CAVITIES:
        return 0.0
    shape, x, y, pitch_x, pitch_y = CAVITIES[sample[0]]
    rim = math.pi * x if shape == "circle" else 2 * (x + y)
    return 1e3 * rim / (pitch_x * pitch_y)


def engine_ratio(samples: Samples, pressure_Pa: np.ndarray) -> np.ndarray:
    """Static and sliding force over those of the flat sample at the same pressure, shape (n, 2).

    Beyond the pressures of the table the ratio of its last pressure is kept.
    """
    found = np.ones((len(samples), 2))
    for sample in set(samples) - {"F"}:
        here = np.array([s == sample for s in samples])
        log_p, curve = _log_ratio(sample)
        found[here] = np.exp(curve(np.clip(np.log(pressure_Pa[here]), log_p[0], log_p[-1])))
    return found


@cache
def shares(sample: str) -> tuple[float, float, float, float]:
    """Coefficient and adhesion of a straight line through the engine's forces over those of the flat sample.

    Static mu, static tau0, sliding mu, sliding tau0; effects use them where only the adhesive part of a force changes.
    """
    if sample == "F":
        return (1.0, 1.0, 1.0, 1.0)
    runs = _runs()
    blocks = next(b for s, b in runs if s == sample)
    line, flat = (_line(runs[s, blocks]) for s in (sample, "F"))
    a, b, c, d = (line / flat).tolist()
    return (a, b, c, d)


def _line(runs: dict[float, np.ndarray]) -> np.ndarray:
    """mu and tau0 (Pa) of both regimes from T/N at each pressure, every run with the same relative weight."""
    p = np.array(sorted(runs))
    found = []
    for regime in (0, 1):
        over_load = np.array([runs[x][regime] for x in p])
        design = np.column_stack([np.ones_like(p), 1 / p]) / over_load[:, None]
        found += list(np.linalg.lstsq(design, np.ones_like(p), rcond=None)[0])
    return np.array(found)


@cache
def _log_ratio(sample: str) -> tuple[np.ndarray, PchipInterpolator]:
    """ln p, and the logarithms of both ratios as a smooth function of it."""
    runs = _runs()
    blocks = next(b for s, b in runs if s == sample)
    own, flat = runs[sample, blocks], runs["F", blocks]
    pressures = np.array(sorted(own.keys() & flat.keys()))
    ratio = np.array([own[p] / flat[p] for p in pressures])
    return np.log(pressures), PchipInterpolator(np.log(pressures), np.log(ratio))


@cache
def _runs() -> dict[tuple[str, str], dict[float, np.ndarray]]:
    """T/N (static, sliding) by sample, lattice and pressure, averaged over angles."""
    found: dict[tuple[str, str], dict[float, list[list[float]]]] = {}
    with TABLE.open(newline="") as file:
        for row in csv.DictReader(file):
            place = found.setdefault((row["sample"], f"{row['blocks_x']} x {row['blocks_y']}"), {})
            over_load = [float(row["static_over_load"]), float(row["sliding_over_load"])]
            place.setdefault(float(row["pressure_Pa"]), []).append(over_load)
    return {key: {p: np.mean(rows, axis=0) for p, rows in by_p.items()} for key, by_p in found.items()}


def draw_errors(
    sizes: Mapping[str, ErrorSize], factor: float, draw: Draw, rng: np.random.Generator
) -> dict[str, np.ndarray]:
    """Offset, slope and curve of every sample with cavities, shape (3, 2), ``factor`` times the sizes given.

    "uniform" is the default: a wrong reading of the model moves a pattern by a limited amount, and nothing makes a
    small one likelier. "heavy" has the same standard deviation and Laplace tails.
    """
    found = {}
    for sample, size in sorted(sizes.items()):
        unit = rng.uniform(-1, 1, (3, 2)) * math.sqrt(3)
        if draw == "heavy":
            unit = rng.laplace(0, 1 / math.sqrt(2), (3, 2))
        found[sample] = factor * unit * np.array([size.offset, size.slope, size.curve])
    return found


def error_gain(errors: Mapping[str, np.ndarray], samples: Samples, pressure_Pa: np.ndarray) -> np.ndarray:
    """Factor by which a drawn error changes the forces, shape (n, 2)."""
    x = np.log(pressure_Pa / MIDDLE_PRESSURE_PA)
    shapes = np.stack([np.ones_like(x), x, x**2 - 1.0], axis=1)
    rows = np.array([errors.get(s, np.zeros((3, 2))) for s in samples])
    return np.asarray(np.exp(np.einsum("nk,nkr->nr", shapes, rows)))
