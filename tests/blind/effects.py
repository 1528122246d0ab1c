"""Effects that the virtual tribometer can hide, coded apart from ``tribo.mechanisms``; size 1 is a clear one.

An effect changes a bench in place. ``LARGEST`` is the size beyond which its law leaves what physics or the bench
allows: cavities of more than the whole area, an air pressure below zero, contact lost by more than a third, a
sled that stands on its front edge.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd

from .bench import AREA_MM2, OPEN_SHARE, RIM_PER_MM, Bench

Effect = Callable[[Bench, float, np.random.Generator], None]


def _suction(b: Bench, size: float, rng: np.random.Generator) -> None:
    pull_N = 5.0 * size * b.of_sample(OPEN_SHARE) * AREA_MM2 * 1e-3
    b.remake(b.column("N") + pull_N, list(b.tests["true_sample"]))


def _load_error(b: Bench, size: float, rng: np.random.Generator) -> None:
    b.remake(b.column("N") + 0.12 * size, list(b.tests["true_sample"]))


def _pressure(b: Bench, size: float, rng: np.random.Generator) -> None:
    p_kPa = b.column("N") / AREA_MM2 * 1e3 / (1.0 - b.of_sample(OPEN_SHARE))
    b.remake(b.column("N") * (p_kPa / 8.0) ** (-0.2 * size), list(b.tests["true_sample"]))


def _area_loss(b: Bench, size: float, rng: np.random.Generator) -> None:
    kPa = b.static / AREA_MM2 * 1e3 / (1.0 - b.of_sample(OPEN_SHARE))
    left = 1.0 - np.minimum(1.6e-5 * size * kPa**2 / (1 + 1.6e-5 * size * kPa**2), 0.6)
    b.static, b.sliding = b.static * left, b.sliding * left


def _velocity(b: Bench, size: float, rng: np.random.Generator) -> None:
    b.sliding = b.sliding * (1 + 0.06 * size * np.log(b.column("speed_mm_s") / 0.2))


def _ageing(b: Bench, size: float, rng: np.random.Generator) -> None:
    b.static = b.static * (1 + 0.035 * size * np.log(1 + b.column("hold_s")))


def _run_in(b: Bench, size: float, rng: np.random.Generator) -> None:
    gain = 1 + 0.25 * size * np.exp(-(b.column("specimen_run") - 1) / 5.0)
    b.static, b.sliding = b.static * gain, b.sliding * gain


def _edges(b: Bench, size: float, rng: np.random.Generator) -> None:
    extra = 0.08e-3 * size * b.of_sample(RIM_PER_MM) * AREA_MM2
    b.static, b.sliding = b.static + extra, b.sliding + 0.1 * extra


def _temperature(b: Bench, size: float, rng: np.random.Generator) -> None:
    gain = np.exp(-0.06 * size * (b.column("temperature_C") - 23.0))
    b.static, b.sliding = b.static * gain, b.sliding * gain


def _humidity(b: Bench, size: float, rng: np.random.Generator) -> None:
    rows = np.array([b.shares[s] for s in b.tests["true_sample"]]) * np.array(b.law)
    extra = 0.03 * size * (b.column("humidity_pct") - 48.0) * AREA_MM2 * 1e-3
    b.static, b.sliding = b.static + rows[:, 1] * extra, b.sliding + rows[:, 3] * extra


def _mislabelled(b: Bench, size: float, rng: np.random.Generator) -> None:
    """Two specimens carry each other's label, or one that of another sample; the samples differ by a third.

    A specimen of S is pulled along x and y: what bears its label gives one force in both, what bears another's shows
    the direction it happens to lie in.
    """
    level = {s: float(np.median(b.static[(b.tests["sample"] == s).to_numpy()])) for s in set(b.tests["sample"])}
    pairs = [(p, q) for p in level for q in level if p[0] != q[0] and abs(np.log(level[p] / level[q])) > 0.3]
    label, other = sorted(pairs)[rng.integers(len(pairs))]
    number = str(rng.choice(sorted({s[1:] for s in b.tests["specimen"]})))
    moved = {f"{label[0]}{number}": other}
    if rng.random() < 0.5:
        moved[f"{other[0]}{number}"] = label
    samples = [moved.get(s, t) for s, t in zip(b.tests["specimen"], b.tests["sample"], strict=True)]
    b.remake(b.column("N"), samples)


def _operator(b: Bench, size: float, rng: np.random.Generator) -> None:
    gain = np.exp(0.12 * size * (b.tests["operator"] == "op2").to_numpy())
    b.static, b.sliding = b.static * gain, b.sliding * gain


def _offset(b: Bench, size: float, rng: np.random.Generator) -> None:
    b.zero = b.zero + 0.1 * size


def _drift(b: Bench, size: float, rng: np.random.Generator) -> None:
    b.zero = b.zero + 0.15 * size * b.column("run_order") / len(b.tests)


def _tilt(b: Bench, size: float, rng: np.random.Generator) -> None:
    """Adhesion of the lifted part is lost once the moment passes a sixth of the length; solved by halving."""
    rows = np.array([b.shares[s] for s in b.tests["true_sample"]]) * np.array(b.law)
    load = b.column("N")
    for name, k in (("static", 0), ("sliding", 2)):
        grip = rows[:, k + 1] * AREA_MM2 * 1e-3
        low, high = rows[:, k] * load, getattr(b, name)
        for _ in range(50):
            force = 0.5 * (low + high)
            held = rows[:, k] * load + grip * np.clip(3 * (0.5 - 0.02 * size * force / load), 0.0, 1.0)
            low, high = np.where(held > force, force, low), np.where(held > force, high, force)
        setattr(b, name, 0.5 * (low + high))


def _collapse(b: Bench, size: float, rng: np.random.Generator) -> None:
    """Floors of the wide cavities touch down with growing load; what touches grips like the flat sample."""
    kPa = b.column("N") / AREA_MM2 * 1e3
    limit = b.of_sample({"F": 1e9, "A": 40.0, "B": 20.0, "C": 12.0, "Sx": 7.0, "Sy": 7.0})
    down = min(0.8 * size, 1.0) / (1 + np.exp(-(kPa - limit) / (0.12 * limit)))
    flat = np.array(b.law)
    for name, k in (("static", 0), ("sliding", 2)):
        grip = flat[k] * b.column("N") + flat[k + 1] * AREA_MM2 * 1e-3
        setattr(b, name, getattr(b, name) + down * (grip - getattr(b, name)))


def _shear(b: Bench, size: float, rng: np.random.Generator) -> None:
    """Long cavities close when pulled along and open when pulled across."""
    gain = b.of_sample({"F": 1, "A": 1, "B": 1, "C": 1, "Sx": 1 + 0.3 * size, "Sy": 1 / (1 + 0.3 * size)})
    b.static, b.sliding = b.static * gain, b.sliding * gain


def _moulding(b: Bench, size: float, rng: np.random.Generator) -> None:
    """The cavities of one pattern came out wider than drawn, so that less of it adheres."""
    pattern = str(rng.choice(sorted({s[0] for s in b.tests["sample"]} - {"F"})))
    rows = np.array([b.shares[s] for s in b.tests["true_sample"]]) * np.array(b.law)
    here = np.array([s.startswith(pattern) for s in b.tests["true_sample"]])
    less = min(0.5 * size, 0.95) * here * AREA_MM2 * 1e-3
    b.static, b.sliding = b.static - rows[:, 1] * less, b.sliding - rows[:, 3] * less


def _wire_up(b: Bench, size: float, rng: np.random.Generator) -> None:
    """The wire rises by two degrees and carries part of the load."""
    rows = np.array([b.shares[s] for s in b.tests["true_sample"]]) * np.array(b.law)
    up = np.deg2rad(2.0 * size)
    b.static = b.static / (np.cos(up) + rows[:, 0] * np.sin(up))
    b.sliding = b.sliding / (np.cos(up) + rows[:, 2] * np.sin(up))


def _roller(b: Bench, size: float, rng: np.random.Generator) -> None:
    gain = np.exp(0.03 * size * np.pi / 2)
    b.static, b.sliding = b.static * gain, b.sliding * gain


def _soft_machine(b: Bench, size: float, rng: np.random.Generator) -> None:
    b.stiffness_N_per_mm = 1.0 / (1.0 / b.stiffness_N_per_mm + 0.05 * size)


def _prony(b: Bench, size: float, rng: np.random.Generator) -> None:
    """The bulk is stiffer when pulled faster."""
    b.stiffness_N_per_mm = b.stiffness_N_per_mm * (b.column("speed_mm_s") / 0.2) ** (0.06 * size)


def _slow_recorder(b: Bench, size: float, rng: np.random.Generator) -> None:
    """Fewer samples a second than the peak needs."""
    b.samples_per_s = 8.0 / size


def _day_wave(b: Bench, size: float, rng: np.random.Generator) -> None:
    """Outside the library: everything swings with the hour."""
    hours = pd.to_datetime(b.tests["started_at"]).dt.hour.to_numpy() + 0.0
    gain = np.exp(0.12 * size * np.sin(2 * np.pi * hours / 7.0))
    b.static, b.sliding = b.static * gain, b.sliding * gain


def _cold_and_hot(b: Bench, size: float, rng: np.random.Generator) -> None:
    """Outside the library: friction is least at the usual temperature and grows to either side."""
    off = b.column("temperature_C") - np.median(b.column("temperature_C"))
    gain = np.exp(0.10 * size * off**2)
    b.static, b.sliding = b.static * gain, b.sliding * gain


def _dry_and_damp(b: Bench, size: float, rng: np.random.Generator) -> None:
    """Outside the library: friction is highest at the usual humidity and falls to either side."""
    off = (b.column("humidity_pct") - np.median(b.column("humidity_pct"))) / 4.0
    gain = np.exp(-0.15 * size * np.minimum(off**2, 6.0))
    b.static, b.sliding = b.static * gain, b.sliding * gain


def _other_counterface(b: Bench, size: float, rng: np.random.Generator) -> None:
    """Outside the library: for a third of the series another counterface was mounted, and nobody wrote it down."""
    turn = b.column("run_order") / len(b.tests)
    start = rng.uniform(0.15, 0.5)
    gain = np.exp(0.15 * size * ((turn > start) & (turn < start + 0.33)))
    b.static, b.sliding = b.static * gain, b.sliding * gain


EFFECTS: dict[str, Effect] = {
    "suction": _suction, "normal_load_error": _load_error, "pressure_dependent_friction": _pressure,
    "contact_area_loss": _area_loss, "velocity_dependence": _velocity, "contact_ageing": _ageing,
    "run_in": _run_in, "edge_adhesion": _edges, "temperature": _temperature, "humidity": _humidity,
    "mislabelled_specimen": _mislabelled, "covariate:operator": _operator, "load_cell_offset": _offset,
    "load_cell_drift": _drift, "tilt": _tilt, "cavity_collapse": _collapse,
    "cavity_shear_deformation": _shear, "pattern_geometry": _moulding, "bulk_viscoelasticity": _prony,
    "sampling_clip": _slow_recorder, "pull_angle": _wire_up, "pulley_friction": _roller,
    "machine_compliance": _soft_machine, "outside:day": _day_wave, "outside:temperature": _cold_and_hot,
    "outside:humidity": _dry_and_damp, "outside:counterface": _other_counterface,
}  # fmt: skip
# These change what the law is given, so they come before those that change what it gives.
FIRST = ("mislabelled_specimen", "suction", "normal_load_error", "pressure_dependent_friction")
LARGEST = {
    "suction": 20.0, "normal_load_error": 12.0, "pressure_dependent_friction": 4.0, "contact_area_loss": 1.0,
    "velocity_dependence": 6.5, "contact_ageing": 10.0, "run_in": 12.0, "edge_adhesion": 12.0, "temperature": 6.0,
    "humidity": 2.0, "mislabelled_specimen": 1.0, "tilt": 3.0, "cavity_collapse": 1.25,
    "cavity_shear_deformation": 4.0, "pattern_geometry": 1.9, "bulk_viscoelasticity": 5.0, "sampling_clip": 4.0,
    "pull_angle": 3.0, "pulley_friction": 10.0, "machine_compliance": 10.0, "outside:day": 8.0,
    "outside:temperature": 4.0, "outside:humidity": 4.0, "outside:counterface": 8.0,
}  # fmt: skip
