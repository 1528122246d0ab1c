"""Effects that the virtual tribometer can hide; size 1 of each is a clear effect of this file's own scale.

An effect changes a bench in place. Laws and numbers are this file's own: ``test_effects.py`` looks for numbers that
also stand in the library. ``LARGEST`` is the size beyond which an effect leaves what physics or the bench allows:
cavities wider than their pitch, a pressure below vacuum, a sled that stands on its front edge.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd
from scipy.special import ndtr

from .bench import AREA_MM2, GRAVITY, Bench
from .patterns import open_share, rim_per_mm

Effect = Callable[[Bench, float, np.random.Generator], None]
ROOM_K, GAS_J_PER_MOL_K = 296.0, 8.314


def _suction(b: Bench, size: float, rng: np.random.Generator) -> None:
    """Vacuum under the cavities, 5.37 kPa, presses the sample down."""
    cavities_mm2 = AREA_MM2 * b.of_sample(open_share)
    b.remake(b.column("N") + 5.37e-3 * size * cavities_mm2, list(b.tests["true_sample"]))


def _load_error(b: Bench, size: float, rng: np.random.Generator) -> None:
    """13.3 g of the sled were not weighed."""
    b.remake(b.column("N") + 0.0133 * GRAVITY * size, list(b.tests["true_sample"]))


def _pressure(b: Bench, size: float, rng: np.random.Generator) -> None:
    """The load counts as a power of the contact pressure below one; no change at 7.1 kPa."""
    contact_kPa = b.column("N") / (AREA_MM2 * (1.0 - b.of_sample(open_share))) * 1e3
    counted = b.column("N") * np.exp(-0.173 * size * np.log(contact_kPa / 7.1))
    b.remake(counted, list(b.tests["true_sample"]))


def _area_loss(b: Bench, size: float, rng: np.random.Generator) -> None:
    """Contact falls as a Gaussian of the traction that is reached, 263 kPa wide at size 1; solved by halving."""
    traction_kPa = b.static / (AREA_MM2 * (1.0 - b.of_sample(open_share))) * 1e3
    low, high = np.zeros(len(b.tests)), np.ones(len(b.tests))
    for _ in range(40):
        left = (low + high) / 2
        more = np.exp(-size * (left * traction_kPa / 263.0) ** 2) > left
        low, high = np.where(more, left, low), np.where(more, high, left)
    b.scale((low + high) / 2)


def _velocity(b: Bench, size: float, rng: np.random.Generator) -> None:
    """Sliding friction is a power of the speed."""
    b.sliding = b.sliding * (b.column("speed_mm_s") / 0.31) ** (0.0571 * size)


def _ageing(b: Bench, size: float, rng: np.random.Generator) -> None:
    """Static friction grows by 8.53 % of the fresh one for each decade of rest after 0.79 s."""
    b.static = b.static * (1 + 0.0853 * size * np.log10(1 + b.column("hold_s") / 0.79))


def _run_in(b: Bench, size: float, rng: np.random.Generator) -> None:
    """The first pull of a specimen is 23.7 % higher; each further pull keeps 82.3 % of the excess."""
    b.scale(1 + 0.237 * size * 0.823 ** (b.column("specimen_run") - 1))


def _edges(b: Bench, size: float, rng: np.random.Generator) -> None:
    """Rims hold 84.7 N per km; an eighth of it is left while sliding."""
    extra = 84.7e-6 * size * b.of_sample(rim_per_mm) * AREA_MM2
    b.static, b.sliding = b.static + extra, b.sliding + extra / 8


def _temperature(b: Bench, size: float, rng: np.random.Generator) -> None:
    """An activated process of 43.4 kJ/mol: friction falls as it gets warmer."""
    kelvin = b.column("temperature_C") + 273.0
    b.scale(np.exp(43.4e3 * size / GAS_J_PER_MOL_K * (1 / kelvin - 1 / ROOM_K)))


def _humidity(b: Bench, size: float, rng: np.random.Generator) -> None:
    """Adhesion grows by 2.87 % per percent of humidity, compounded."""
    grown = np.expm1(0.0287 * size * (b.column("humidity_pct") - 47.3))
    extra = b.adhesion_N() * grown[:, None]
    b.static, b.sliding = b.static + extra[:, 0], b.sliding + extra[:, 1]


def _mislabelled(b: Bench, size: float, rng: np.random.Generator) -> None:
    """Two specimens carry each other's label, or one that of another sample; the samples differ by a third.

    A specimen of S is pulled along x and y: what bears its label gives one force in both, what bears another's shows
    the direction it happens to lie in.
    """
    level = {s: float(np.median(b.static[(b.tests["sample"] == s).to_numpy()])) for s in set(b.tests["sample"])}
    pairs = [(p, q) for p in level for q in level if p[0] != q[0] and abs(np.log(level[p] / level[q])) > 0.293]
    label, other = sorted(pairs)[rng.integers(len(pairs))]
    number = str(rng.choice(sorted({s[1:] for s in b.tests["specimen"]})))
    moved = {f"{label[0]}{number}": other}
    if rng.random() < 1 / 2:
        moved[f"{other[0]}{number}"] = label
    b.tests["true_sample"] = [moved.get(s, t) for s, t in zip(b.tests["specimen"], b.tests["sample"], strict=True)]
    b.remake(b.column("N"), list(b.tests["true_sample"]))


def _operator(b: Bench, size: float, rng: np.random.Generator) -> None:
    b.scale(1 + 0.117 * size * (b.tests["operator"] == "op2").to_numpy())


def _offset(b: Bench, size: float, rng: np.random.Generator) -> None:
    b.zero = b.zero + 0.113 * size


def _drift(b: Bench, size: float, rng: np.random.Generator) -> None:
    b.zero = b.zero + 0.163 * size * b.column("run_order") / len(b.tests)


def _false_weight(b: Bench, size: float, rng: np.random.Generator) -> None:
    """The 50 g weight is 15.7 % heavier than it says."""
    extra_g = np.where(b.column("mass_g") == 50.0, 50.0 * 0.157 * size, 0.0)
    b.remake(b.column("N") + extra_g * 1e-3 * GRAVITY, list(b.tests["true_sample"]))


def _tilt(b: Bench, size: float, rng: np.random.Generator) -> None:
    """The resultant moves forward with T/N; where the pressure would be negative, the sled is lifted.

    Of a linear pressure, three times the distance from the resultant to the front edge stays in contact. Adhesion of
    the rest is lost. Solved by halving.
    """
    load, whole = b.column("N"), b.adhesion_N()
    for name, k in (("static", 0), ("sliding", 1)):
        upright = getattr(b, name)
        low, high = upright - whole[:, k], upright
        for _ in range(50):
            force = (low + high) / 2
            to_front = 1 / 2 - 0.0187 * size * force / load
            held = upright - whole[:, k] * (1 - np.clip(3 * to_front, 0.0, 1.0))
            low, high = np.where(held > force, force, low), np.where(held > force, high, force)
        setattr(b, name, (low + high) / 2)


def _collapse(b: Bench, size: float, rng: np.random.Generator) -> None:
    """Floors of the wide cavities touch down with growing load; what touches grips like the flat sample.

    The pressures at which they touch scatter by a fifth around that of the pattern.
    """
    touch_kPa = {"A": 36.7, "B": 18.9, "C": 11.3, "S": 7.43}
    kPa = b.column("N") / AREA_MM2 * 1e3
    limit = b.of_sample(lambda s: touch_kPa.get(s[0], 1e9))
    down = min(0.779 * size, 1.0) * ndtr(np.log(kPa / limit) * 5)
    flat = b.forces(b.column("N"), ["F"] * len(b.tests))
    b.static = b.static + down * (flat[:, 0] - b.static)
    b.sliding = b.sliding + down * (flat[:, 1] - b.sliding)


def _shear(b: Bench, size: float, rng: np.random.Generator) -> None:
    """Long cavities close when pulled along and open when pulled across."""
    b.scale((1 + 0.277 * size) ** b.of_sample(lambda s: {"x": 1.0, "y": -1.0}.get(s[-1], 0.0)))


def _moulding(b: Bench, size: float, rng: np.random.Generator) -> None:
    """The cavities of one pattern came out wider than drawn, so that less of it adheres."""
    pattern = str(rng.choice(sorted({s[0] for s in b.tests["sample"]} - {"F"})))
    here = np.array([s.startswith(pattern) for s in b.tests["true_sample"]])
    lost = b.adhesion_N() * (min(0.479 * size, 0.943) * here)[:, None]
    b.static, b.sliding = b.static - lost[:, 0], b.sliding - lost[:, 1]


def _wire_up(b: Bench, size: float, rng: np.random.Generator) -> None:
    """The wire rises by 2.17 degrees and carries part of the load."""
    up = np.deg2rad(2.17 * size)
    rest = b.adhesion_N()
    load = b.column("N")
    b.static = b.static / (np.cos(up) + (b.static - rest[:, 0]) / load * np.sin(up))
    b.sliding = b.sliding / (np.cos(up) + (b.sliding - rest[:, 1]) / load * np.sin(up))


def _roller(b: Bench, size: float, rng: np.random.Generator) -> None:
    """The bearing of the roller takes 4.37 % of the pull."""
    b.scale(1 + 0.0437 * size)


def _soft_machine(b: Bench, size: float, rng: np.random.Generator) -> None:
    """The frame gives way by 56.3 um per N."""
    b.stiffness_N_per_mm = b.stiffness_N_per_mm / (1 + 0.0563 * size * b.stiffness_N_per_mm)


def _prony(b: Bench, size: float, rng: np.random.Generator) -> None:
    """The bulk is stiffer when pulled faster."""
    b.stiffness_N_per_mm = b.stiffness_N_per_mm * (b.column("speed_mm_s") / 0.31) ** (0.0623 * size)


def _slow_recorder(b: Bench, size: float, rng: np.random.Generator) -> None:
    """Fewer samples a second than the peak needs."""
    b.samples_per_s = 7.57 / size


def _day_wave(b: Bench, size: float, rng: np.random.Generator) -> None:
    """Outside the library: everything swings with the hour."""
    hours = pd.to_datetime(b.tests["started_at"]).dt.hour.to_numpy() + 0.0
    b.scale(np.exp(0.127 * size * np.sin(2 * np.pi * hours / 6.83)))


def _cold_and_hot(b: Bench, size: float, rng: np.random.Generator) -> None:
    """Outside the library: friction is least at the usual temperature and grows to either side."""
    off = b.column("temperature_C") - np.median(b.column("temperature_C"))
    b.scale(np.exp(0.103 * size * off**2))


def _dry_and_damp(b: Bench, size: float, rng: np.random.Generator) -> None:
    """Outside the library: friction is highest at the usual humidity and falls to either side."""
    off = b.column("humidity_pct") - np.median(b.column("humidity_pct"))
    b.scale(np.exp(-size * np.minimum((off / 10.3) ** 2, 1.0)))


def _other_counterface(b: Bench, size: float, rng: np.random.Generator) -> None:
    """Outside the library: for a third of the series another counterface was mounted, and nobody wrote it down."""
    turn = b.column("run_order") / len(b.tests)
    start = rng.uniform(1 / 6, 1 / 2)
    b.scale(np.exp(0.157 * size * ((turn > start) & (turn < start + 1 / 3))))


EFFECTS: dict[str, Effect] = {
    "suction": _suction, "normal_load_error": _load_error, "pressure_dependent_friction": _pressure,
    "contact_area_loss": _area_loss, "velocity_dependence": _velocity, "contact_ageing": _ageing,
    "run_in": _run_in, "edge_adhesion": _edges, "temperature": _temperature, "humidity": _humidity,
    "mislabelled_specimen": _mislabelled, "covariate:operator": _operator, "load_cell_offset": _offset,
    "load_cell_drift": _drift, "wrong_weight": _false_weight, "tilt": _tilt, "cavity_collapse": _collapse,
    "cavity_shear_deformation": _shear, "pattern_geometry": _moulding, "bulk_viscoelasticity": _prony,
    "sampling_clip": _slow_recorder, "pull_angle": _wire_up, "pulley_friction": _roller,
    "machine_compliance": _soft_machine, "outside:day": _day_wave, "outside:temperature": _cold_and_hot,
    "outside:humidity": _dry_and_damp, "outside:counterface": _other_counterface,
}  # fmt: skip
# These change what the law is given, so they come before those that change what it gives.
FIRST = ("mislabelled_specimen", "suction", "wrong_weight", "normal_load_error", "pressure_dependent_friction")
LARGEST = {
    "suction": 18.3, "normal_load_error": 11.7, "pressure_dependent_friction": 4.57, "contact_area_loss": 1.0,
    "velocity_dependence": 6.87, "contact_ageing": 9.0, "run_in": 11.7, "edge_adhesion": 11.3, "temperature": 6.0,
    "humidity": 2.0, "mislabelled_specimen": 1.0, "tilt": 3.0, "wrong_weight": 4.0, "cavity_collapse": 1.283,
    "cavity_shear_deformation": 4.0, "pattern_geometry": 1.97, "bulk_viscoelasticity": 4.83, "sampling_clip": 4.0,
    "pull_angle": 3.0, "pulley_friction": 10.0, "machine_compliance": 10.0, "outside:day": 8.0,
    "outside:temperature": 4.0, "outside:humidity": 3.0, "outside:counterface": 8.0,
}  # fmt: skip
