"""A virtual sled tribometer that hides an effect: raw exports on disk, laws coded apart from the library.

Nothing here imports ``tribo.mechanisms``. The shares of each pattern lie between two published codes of the same
model (the paper's Table 2 and an independent one), so that the diagnosis also meets the error of its own predictor.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import datetime, timedelta
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


@dataclass
class Bench:
    """One campaign in the making: the table of tests and the forces, N, changed in place by effects."""

    tests: pd.DataFrame
    law: tuple[float, float, float, float]
    shares: dict[str, tuple[float, float, float, float]]
    static: np.ndarray = field(init=False)
    sliding: np.ndarray = field(init=False)
    zero: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        self.zero = np.zeros(len(self.tests))
        self.remake(self.tests["N"].to_numpy(), self.tests["true_sample"].to_list())

    def remake(self, load: np.ndarray, samples: list[str]) -> None:
        """Forces by the baseline law under these loads, of these samples."""
        rows = np.array([self.shares[s] for s in samples]) * np.array(self.law)
        adhesion = AREA_MM2 * 1e-3  # kPa to N
        self.static = rows[:, 0] * load + rows[:, 1] * adhesion
        self.sliding = rows[:, 2] * load + rows[:, 3] * adhesion

    def column(self, name: str) -> np.ndarray:
        return self.tests[name].to_numpy()

    def of_sample(self, table: dict[str, float]) -> np.ndarray:
        return np.array([table[s] for s in self.tests["true_sample"]])


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
    """Two specimens of strongly different samples carry each other's label."""
    first, second = ("A1", "C1") if "A" in set(b.tests["sample"]) else ("F1", "C1")
    swap = {first: second[0], second: first[0]}
    samples = [swap.get(s, t) for s, t in zip(b.tests["specimen"], b.tests["sample"], strict=True)]
    b.remake(b.column("N"), samples)


def _operator(b: Bench, size: float, rng: np.random.Generator) -> None:
    gain = np.exp(0.12 * size * (b.tests["operator"] == "op2").to_numpy())
    b.static, b.sliding = b.static * gain, b.sliding * gain


def _offset(b: Bench, size: float, rng: np.random.Generator) -> None:
    b.zero = b.zero + 0.1 * size


def _drift(b: Bench, size: float, rng: np.random.Generator) -> None:
    b.zero = b.zero + 0.15 * size * b.column("run_order") / len(b.tests)


def _tilt(b: Bench, size: float, rng: np.random.Generator) -> None:
    """Adhesion of the lifted part is lost once the moment passes a sixth of the length."""
    rows = np.array([b.shares[s] for s in b.tests["true_sample"]]) * np.array(b.law)
    for name, k in (("static", 0), ("sliding", 2)):
        force = getattr(b, name)
        for _ in range(60):
            arm = 0.02 * size * force / b.column("N")
            kept = np.clip(3 * (0.5 - arm), 0.0, 1.0)
            force = 0.5 * force + 0.5 * (rows[:, k] * b.column("N") + rows[:, k + 1] * AREA_MM2 * 1e-3 * kept)
        setattr(b, name, force)


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
    """The cavities of B came out narrower, so that more of it adheres."""
    rows = np.array([b.shares[s] for s in b.tests["true_sample"]]) * np.array(b.law)
    more = b.of_sample({"F": 0, "A": 0, "B": 0.7 * size, "C": 0, "Sx": 0, "Sy": 0}) * AREA_MM2 * 1e-3
    b.static, b.sliding = b.static + rows[:, 1] * more, b.sliding + rows[:, 3] * more


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


EFFECTS: dict[str, Effect] = {
    "suction": _suction, "normal_load_error": _load_error, "pressure_dependent_friction": _pressure,
    "contact_area_loss": _area_loss, "velocity_dependence": _velocity, "contact_ageing": _ageing,
    "run_in": _run_in, "edge_adhesion": _edges, "temperature": _temperature, "humidity": _humidity,
    "mislabelled_specimen": _mislabelled, "covariate:operator": _operator, "load_cell_offset": _offset,
    "load_cell_drift": _drift, "tilt": _tilt, "cavity_collapse": _collapse,
    "cavity_shear_deformation": _shear, "pattern_geometry": _moulding, "outside:day": _day_wave,
    "outside:temperature": _cold_and_hot,
}  # fmt: skip


# These change what the law is given, so they come before those that change what it gives.
FIRST = ("mislabelled_specimen", "suction", "normal_load_error", "pressure_dependent_friction")


def hide(seed: int, effects: list[tuple[str, float]], design: Design = Design()) -> Bench:
    """A bench with the named effects at work, specimens and repeats drawn from ``seed``."""
    rng = np.random.default_rng(seed)
    tests = _table(design, rng)
    law = (rng.normal(4.8, 0.35), rng.normal(23, 1.8), rng.normal(3.0, 0.2), rng.normal(11.6, 0.5))
    bench = Bench(tests, law, _shares(rng))
    for name, size in sorted(effects, key=lambda e: e[0] not in FIRST):
        EFFECTS[name](bench, size, rng)
    specimens = {s: np.exp(rng.normal(0, design.specimen_sd, 2)) for s in sorted(set(tests["specimen"]))}
    gains = np.array([specimens[s] for s in tests["specimen"]])
    noise = rng.normal(size=(len(tests), 2))
    if math.isfinite(design.tail):
        noise *= np.sqrt((design.tail - 2) / design.tail)
        noise /= np.sqrt(rng.chisquare(design.tail, (len(tests), 1)) / design.tail)
    gains = gains * np.exp(noise * np.array(design.repeat_sd))
    bench.static, bench.sliding = bench.static * gains[:, 0], bench.sliding * gains[:, 1]
    return bench


def _shares(rng: np.random.Generator) -> dict[str, tuple[float, float, float, float]]:
    shares = {"F": (1.0, 1.0, 1.0, 1.0)}
    for name in OTHER:
        mix = rng.uniform(0.0, 0.6)
        row = (1 - mix) * np.array(OTHER[name]) + mix * np.array(PAPER[name])
        shares[name] = tuple(row * np.exp(rng.normal(0, 0.015, 4)))  # type: ignore[assignment]
    return shares


def _table(design: Design, rng: np.random.Generator) -> pd.DataFrame:
    rows = [
        {"sample": s, "specimen": f"{s[0]}{k + 1}", "direction": s[1:], "mass_g": m, "repeat": r + 1}
        for s in design.samples for k in range(design.specimens) for m in design.masses_g
        for r in range(design.repeats)
    ]  # fmt: skip
    tests = pd.DataFrame(rows).sample(frac=1.0 - design.missing, random_state=int(rng.integers(2**31)))
    n = len(tests)
    tests = tests.reset_index(drop=True)
    tests["true_sample"] = tests["sample"]
    tests["N"] = (tests["mass_g"] + 1.5) * 1e-3 * GRAVITY
    tests["speed_mm_s"] = rng.choice(design.speeds_mm_s, n)
    tests["hold_s"] = rng.choice(design.holds_s, n)
    tests["run_order"] = np.arange(1, n + 1)
    tests["specimen_run"] = tests.groupby("specimen").cumcount() + 1
    tests["started_at"] = _stamps(n)
    hours = pd.to_datetime(tests["started_at"]).dt.hour.to_numpy()
    tests["temperature_C"] = (23 + 0.4 * np.sin(hours / 3.0) + rng.normal(0, 1.1, n)).round(1)
    tests["humidity_pct"] = (48 + np.cumsum(rng.normal(0, 0.5, n)) + rng.normal(0, 3, n)).round(1)
    tests["operator"] = rng.choice(["op1", "op2"], n)
    tests.insert(0, "test_id", [f"P{i + 1:04d}" for i in range(n)])
    return tests


def _stamps(n: int) -> list[str]:
    when, stamps = datetime(2026, 4, 13, 8, 30), []
    for _ in range(n):
        stamps.append(when.isoformat())
        when += timedelta(minutes=7)
        if when.hour >= 17:
            when = (when + timedelta(days=1)).replace(hour=8, minute=30)
    return stamps


def write(bench: Bench, folder: Path, seed: int) -> Path:
    """The campaign on disk: campaign.toml, tests.csv and one export a pull, in the style of a tensile machine."""
    rng = np.random.default_rng(seed + 1_000_003)
    (folder / "raw").mkdir(parents=True)
    patterns = sorted({s[0] for s in bench.tests["sample"]})
    head = f'[campaign]\ntitle = "hidden {seed}"\nnominal_area_mm2 = {AREA_MM2}\n'
    head += "slider_mass_g = 1.5\npull_speed_mm_s = 0.2\n"
    blocks = [f"[patterns.{name}]\n{PATTERNS[name]}\n" for name in patterns]
    (folder / "campaign.toml").write_text("\n".join([head, *blocks]))
    table = bench.tests.drop(columns=["true_sample", "N"])
    table.insert(1, "file", [f"raw/{t}.csv" for t in table["test_id"]])
    table.to_csv(folder / "tests.csv", index=False)
    for k, test in enumerate(bench.tests.itertuples()):
        time, force = _trace(bench, k, float(test.speed_mm_s), rng)
        with (folder / "raw" / f"{test.test_id}.csv").open("w", newline="") as file:
            out = csv.writer(file, quoting=csv.QUOTE_ALL)
            out.writerows([["Specimen label", test.test_id], [], ["Time", "Extension", "Load"], ["(s)", "(mm)", "(N)"]])
            travel = time * float(test.speed_mm_s)
            out.writerows([f"{t:.4f}", f"{x:.5f}", f"{f:.5f}"] for t, x, f in zip(time, travel, force, strict=True))
    return folder


def _trace(bench: Bench, k: int, speed_mm_s: float, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Rest, linear rise, peak, exponential fall to the sliding force with a little fading stick-slip, noise."""
    static, sliding = float(bench.static[k]), float(bench.sliding[k])
    rest_s = rng.uniform(1.5, 3.0) * 0.2 / speed_mm_s
    rise_s = static / (STIFFNESS_N_PER_MM * speed_mm_s)
    fall_s = 0.05 / speed_mm_s * 0.5
    time = np.linspace(0.0, rest_s + rise_s + 2.6 / speed_mm_s, 700)
    after = time - rest_s - rise_s
    force = np.where(time < rest_s, 0.0, static * (time - rest_s) / rise_s)
    swing = 0.01 * sliding * np.sin(2 * np.pi * after * speed_mm_s / 0.15) * np.exp(-np.maximum(after, 0) * speed_mm_s)
    settled = sliding + (static - sliding) * np.exp(-np.maximum(after, 0) / fall_s) + swing
    force = np.where(after > 0, settled, force)
    return time, force + bench.zero[k] + rng.normal(0, 0.006, time.size)
