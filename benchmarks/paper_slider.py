"""A paper slider that sticks and slips: Coulomb friction from one record, and what records left out need beyond.

The four records are those of npusteln/stickslip (CeCILL-B), ``data_raw``: a slider of 30.7 g pulled over paper through
a spring, stiffness and speed in the names, force over weight at 2 kHz::

    python benchmarks/paper_slider.py FOLDER                     # tables of docs/results/paper-slider.md
    python benchmarks/paper_slider.py FOLDER --rows ROWS.csv --figure PICTURE.png

Every record is described by three numbers: its mean, the drop of a slip, both over the weight, and the period (medians
over cycles by ``tribo.traces.oscillation_of``, the first tenth left out). The same reader reads the simulated force.
"""

from __future__ import annotations

import argparse
import csv
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from scipy.io import loadmat
from scipy.optimize import minimize

from tribo.errors import SimulationError
from tribo.slider import SliderConfig, SliderRun, constant_speed, simulate_slider
from tribo.tracelaws import fit_slips
from tribo.traces import oscillation_of

MASS_KG, G = 0.0307, 9.80665
LOAD_N = MASS_KG * G
NUMBERS = ("mean", "drop", "period_s")
SPEED_M_S = 1e-3  # reference speed of the law
FIRST = "k168Nm_v42"  # the record from which alone a Coulomb slider is calibrated first
LEAST = {"mean": 0.004, "drop": 0.004}  # uncertainty of a number at the least: a hundredth of friction
LEAST_PERIOD = 0.03  # of a period, as a share: two samples in the fastest record
CYCLES = 12
STICKS_BELOW_N_PER_M = 500.0  # of the four records, those of the softest spring stick and slip

FROM_SLIPS = "with the mass that slips show"
LAWS: dict[str, tuple[str, ...]] = {
    "Coulomb": ("mu_s", "mu_d"),
    FROM_SLIPS: ("mu_s", "mu_d"),
    "and friction that grows with ln v": ("mu_s", "mu_d", "per_e_fold"),
    "and mass and damping fitted": ("mu_s", "mu_d", "per_e_fold", "mass_kg", "damping"),
}
START = {"mu_s": 0.345, "mu_d": 0.325, "mass_kg": 0.025, "damping": 0.1, "per_e_fold": 0.005}
SCALE = {"mu_s": 0.01, "mu_d": 0.01, "mass_kg": 0.005, "damping": 0.05, "per_e_fold": 0.005}


@dataclass(frozen=True, eq=False)
class Record:
    """One file: time s and force over weight, stiffness and speed, and its numbers whole and by halves."""

    name: str
    stiffness_N_per_m: float
    speed_m_s: float
    time_s: np.ndarray
    friction: np.ndarray
    whole: dict[str, float]
    halves: tuple[dict[str, float], dict[str, float]]

    def uncertainty(self, name: str) -> float:
        """Standard error of a number: half of what its halves differ by; friction wanders slowly along the track."""
        spread = 0.5 * abs(self.halves[0][name] - self.halves[1][name])
        least = LEAST_PERIOD * self.whole[name] if name == "period_s" else LEAST[name]
        return max(spread, least)


def numbers_of(
    time_s: np.ndarray, friction: np.ndarray, stiffness_N_per_m: float, speed_m_s: float
) -> dict[str, float]:
    free = 2 * math.pi * math.sqrt(MASS_KG / stiffness_N_per_m)
    found = oscillation_of(time_s, friction * LOAD_N, drive_N_per_s=stiffness_N_per_m * speed_m_s, free_period_s=free)
    mean = float(friction.mean())
    if not math.isfinite(found.peak_N):
        return {"mean": mean, "drop": 0.0, "period_s": math.nan}
    return {"mean": mean, "drop": found.drop_N / LOAD_N, "period_s": found.period_s}


def records_of(folder: Path) -> list[Record]:
    found = []
    for path in folder.glob("*.mat"):
        told = re.match(r"k(\d+)Nm_v(\d+)", path.name)
        if told:
            k, v = float(told[1]), float(told[2]) * 1e-6
            file = loadmat(path)
            time, friction = (np.asarray(file[name], float).ravel() for name in ("t", "Fnorm"))
            n = time.size
            parts = [slice(n // 10, n), slice(n // 10, 55 * n // 100), slice(55 * n // 100, n)]
            whole, first, second = (numbers_of(time[p], friction[p], k, v) for p in parts)
            found.append(Record(path.stem, k, v, time, friction, whole, (first, second)))
    return sorted(found, key=lambda record: (record.stiffness_N_per_m, record.speed_m_s))


def run_of(record: Record, values: dict[str, float], cycles: int = CYCLES) -> SliderRun:
    """The slider at stiffness and speed of a record: static and sliding friction grow with ln v alike."""
    grown = values.get("per_e_fold", 0.0) * math.log(record.speed_m_s / SPEED_M_S)
    mass, k, v = values.get("mass_kg", MASS_KG), record.stiffness_N_per_m, record.speed_m_s
    mu_s, mu_d = values["mu_s"] + grown, values["mu_d"] + grown
    cycle = 2 * (mu_s - mu_d) * LOAD_N / (k * v) + 2 * math.pi * math.sqrt(mass / k)
    first = mu_s * LOAD_N / (k * v)
    return simulate_slider(
        SliderConfig(
            mass, k, max(values.get("damping", 0.0), 0.0), LOAD_N, values={"mu_s": mu_s, "mu_d": mu_d},
            drive=constant_speed(v), duration_s=first + cycles * cycle, rate_Hz=max(2000.0, 60.0 / cycle),
        )
    )  # fmt: skip


def predicted(record: Record, values: dict[str, float]) -> dict[str, float]:
    run = run_of(record, values)
    first = run.time_s > 1.05 * run.peak_s
    return numbers_of(run.time_s[first], run.force_N[first] / LOAD_N, record.stiffness_N_per_m, record.speed_m_s)


def misses(record: Record, values: dict[str, float]) -> dict[str, float]:
    """Predicted minus measured; of the period as a share."""
    told = predicted(record, values)
    found = {name: told[name] - record.whole[name] for name in NUMBERS}
    found["period_s"] /= record.whole["period_s"]
    return found


def in_uncertainties(record: Record, values: dict[str, float]) -> np.ndarray:
    found = misses(record, values)
    sizes = {name: record.uncertainty(name) for name in NUMBERS}
    sizes["period_s"] /= record.whole["period_s"]
    return np.array([found[name] / sizes[name] if math.isfinite(found[name]) else 20.0 for name in NUMBERS])


def calibrated(records: Sequence[Record], law: str) -> dict[str, float]:
    """Values of least squares of the numbers of all records, in their uncertainties."""
    names = LAWS[law]
    shown = {} if law == "Coulomb" else {"mass_kg": slip_mass(records)}
    start = dict(START)
    mean, drop = (float(np.mean([record.whole[name] for record in records])) for name in ("mean", "drop"))
    start["mu_s"], start["mu_d"] = mean + 0.25 * drop, mean

    def cost(z: np.ndarray) -> float:
        values = shown | {name: start[name] + SCALE[name] * x for name, x in zip(names, z, strict=True)}
        if (
            not 0 < values["mu_d"] < values["mu_s"]
            or values.get("mass_kg", 1.0) < 0.005
            or values.get("damping", 0) < 0
        ):
            return 1e6
        try:
            return float(sum((in_uncertainties(record, values) ** 2).sum() for record in records))
        except SimulationError:
            return 1e6

    simplex = np.vstack([np.zeros(len(names)), np.eye(len(names))])
    options = {"xatol": 0.05, "fatol": 0.05, "maxfev": 50 * len(names), "initial_simplex": simplex}
    found = minimize(cost, simplex[0], method="Nelder-Mead", options=options)
    return shown | {name: start[name] + SCALE[name] * float(x) for name, x in zip(names, found.x, strict=True)}


@cache
def mass_of(record: Record) -> float:
    """Mass by the shape of the slips of a record that sticks; NaN where it oscillates."""
    if record.stiffness_N_per_m > STICKS_BELOW_N_PER_M:
        return math.nan
    late = slice(record.time_s.size // 10, None)
    slipping = record.time_s[late], record.friction[late] * LOAD_N
    (law,) = fit_slips(*slipping, ["coulomb"], LOAD_N, record.speed_m_s)
    mass = law["mass_kg"]
    print(
        f"{record.name}: mass {mass.value:.4f} kg ({mass.low:.4f} to {mass.high:.4f}) by {law.samples} slips",
        flush=True,
    )
    return mass.value


def slip_mass(records: Sequence[Record]) -> float:
    found = [mass_of(record) for record in records]
    return float(np.nanmean(found)) if np.isfinite(found).any() else MASS_KG


def print_table(head: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    print("\n| " + " | ".join(head) + " |\n|" + "---|" * len(head))
    for row in rows:
        print("| " + " | ".join(map(str, row)) + " |")


def told(record: Record, numbers: dict[str, float]) -> list[str]:
    return [f"{numbers[name]:.3f}" for name in NUMBERS[:2]] + [f"{numbers['period_s']:.4g}"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--rows", type=Path)
    parser.add_argument("--figure", type=Path)
    given = parser.parse_args()
    records = records_of(given.folder)
    print_table(
        ("record", *NUMBERS, "halves: mean", "drop", "period"),
        [
            (r.name, *told(r, r.whole), *(f"{r.halves[0][n]:.4g}, {r.halves[1][n]:.4g}" for n in NUMBERS))
            for r in records
        ],
    )
    rows: list[dict[str, object]] = []

    def kept(kind: str, law: str, record: Record, values: dict[str, float]) -> None:
        found, sizes = predicted(record, values), in_uncertainties(record, values)
        rows.append(
            {
                "calibrated_on": kind,
                "law": law,
                "record": record.name,
                **{n: f"{found[n]:.5g}" for n in NUMBERS},
                **{f"{n}_in_u": round(float(x), 2) for n, x in zip(NUMBERS, sizes, strict=True)},
                **{f"law_{n}": f"{values.get(n, math.nan):.5g}" for n in START},
            }
        )

    first = next(record for record in records if record.name == FIRST)
    one = calibrated([first], "Coulomb")
    for record in records:
        kept(FIRST, "Coulomb", record, one)
    for law in LAWS:
        everything = calibrated(records, law)
        for record in records:
            kept("all", law, record, everything)
            kept("the others", law, record, calibrated([other for other in records if other is not record], law))
        print(law, {name: round(value, 4) for name, value in everything.items()}, flush=True)
    print_table(tuple(rows[0]), [tuple(row.values()) for row in rows])
    summed = []
    whole = {record.name: record.whole for record in records}
    for kind, law in dict.fromkeys((row["calibrated_on"], row["law"]) for row in rows):
        of = [row for row in rows if (row["calibrated_on"], row["law"]) == (kind, law) and row["record"] != kind]
        off = np.array([[float(str(row[n])) - whole[str(row["record"])][n] for n in NUMBERS] for row in of])
        share = off / np.array([[whole[str(row["record"])][n] for n in NUMBERS] for row in of])
        sizes = np.array([[float(str(row[f"{n}_in_u"])) for n in NUMBERS] for row in of])
        rms = np.sqrt(np.mean(off**2, axis=0))
        within = f"{int((np.abs(sizes) < 2).sum())} of {sizes.size}"
        shares = [
            f"{100 * np.median(np.abs(share[:, k])):.0f} %, {100 * np.abs(share[:, k]).max():.0f} %" for k in (1, 2)
        ]
        summed.append((kind, law, f"{rms[0]:.4f}", *shares, within))
    print_table(
        ("calibrated on", "law", "mean, rms", "drop, median and largest", "period, median and largest", "within 2 u"),
        summed,
    )
    limit = math.sqrt(np.mean([record.uncertainty("mean") ** 2 for record in records]))
    print(f"\nhalves: rms of half their difference in the mean {limit:.4f}")
    if given.rows:
        with given.rows.open("w", newline="") as file:
            writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
    if given.figure:
        draw(records, one, calibrated(records, list(LAWS)[2]), given.figure)


def draw(records: Sequence[Record], one: dict[str, float], last: dict[str, float], path: Path) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 7.0), layout="constrained")
    for axis, record in zip(figure.subplots(4, 1), records, strict=True):
        span = 8 * record.whole["period_s"]
        begin = record.time_s[record.time_s.size // 2]
        inside = (record.time_s > begin) & (record.time_s < begin + span)
        axis.plot(record.time_s[inside] - begin, record.friction[inside], color="#1f5fa8", lw=0.8, label="measured")
        for values, colour, label in (
            (one, "0.55", "Coulomb, from the first record"),
            (last, "#c0392b", "extended, from all four"),
        ):
            run = run_of(record, values)
            shown = run.time_s > run.time_s[-1] - span
            axis.plot(
                run.time_s[shown] - (run.time_s[-1] - span),
                run.force_N[shown] / LOAD_N,
                color=colour,
                lw=1.1,
                label=label,
            )
        axis.set_title(f"{record.stiffness_N_per_m:g} N/m, {1e3 * record.speed_m_s:g} mm/s", fontsize=9)
        axis.set_ylabel("force over weight", fontsize=8)
        axis.set_xlim(0, span)
        axis.tick_params(labelsize=8)
    figure.axes[0].set_ylim(top=0.40)
    figure.axes[0].legend(fontsize=7, loc="upper center", frameon=False, ncols=3)
    figure.axes[-1].set_xlabel("time (s)", fontsize=8)
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    main()
