"""A friction damper with backlash: calibrated on some records, predicted on the tensions and frequencies left out.

The records are those of the banded rotary friction device of ARTS-Laboratory/Dataset-Friction-Damper-with-Backlash
(CC-BY-SA 4.0), ``data/dataset-1``: a sinusoid of displacement, one file per frequency and band tension::

    python benchmarks/friction_damper.py FOLDER       # tables of docs/results/friction-damper.md
    python benchmarks/friction_damper.py FOLDER --rows ROWS.csv --figure PICTURE.png
    python benchmarks/friction_damper.py FOLDER --predict OTHER      # records of another folder, from all of FOLDER

Random numbers: seed 26.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
from scipy.stats import t as student

from tribo.slider import SliderConfig, recorded_displacement, simulate_slider
from tribo.tracelaws import DRIVEN_LAWS, TraceLaw, driven_force, fit_driven

INCH_M, POUND_N, SEED, DRAWS = 0.0254, 4.4482216152605, 26, 200
FRICTION = ("sliding_N", "forward_N", "backward_N")
FIRST = (0.5, 35.0)  # the record from which alone a Coulomb slider is calibrated first
WORDS = {
    "driven": "Coulomb slider on a spring", "driven_backlash": "with backlash",
    "driven_directions": "with a friction of its own each way", "driven_springy_backlash": "with a springy backlash",
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Record:
    """One file: time s, displacement m, force N, and what it was made at."""

    name: str
    frequency_Hz: float
    tension_lb: float
    time_s: np.ndarray
    displacement_m: np.ndarray
    force_N: np.ndarray

    @property
    def range_N(self) -> float:
        return float(np.ptp(self.force_N))


@dataclass(frozen=True)
class Calibrated:
    """A record with the law fitted to it alone."""

    record: Record
    law: TraceLaw
    residual_share: np.ndarray  # of the range of the record
    range_ratio: float  # range of the record over that of the law


def records_of(folder: Path) -> list[Record]:
    """Every record of a folder whose name tells frequency and tension, thinned to at most 2000 samples."""
    found = []
    for path in sorted(folder.glob("*.json")):
        told = re.match(r"([\d.]+)Hz([\d.]+)lbtension", path.name)
        if told:
            rows = np.array(json.loads(path.read_text())["data"])
            rows = rows[:: -(-rows.shape[0] // 2000)]
            found.append(Record(path.stem, float(told[1]), float(told[2]), rows[:, 0], rows[:, 1] * INCH_M,
                                rows[:, 2] * 1000 * POUND_N))  # fmt: skip
    return found


@cache
def calibrated(record: Record, law: str) -> Calibrated:
    fitted = fit_driven(record.displacement_m, record.force_N, law)
    assert fitted is not None, record.name
    force = driven_force(record.displacement_m, values_of(fitted))
    return Calibrated(record, fitted, (record.force_N - force) / record.range_N, record.range_N / float(np.ptp(force)))


def values_of(law: TraceLaw) -> dict[str, float]:
    return {p.name: p.value for p in law.parameters}


FORMS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "ln T over ln P": np.log, "T over ln P": np.log, "T over 1/P": lambda P: 1 / P,
}  # fmt: skip


def at_tension(form: str, tensions: np.ndarray, forces: np.ndarray, tension: float) -> float:
    """Friction at a tension by a line of the form through those of other tensions."""
    axis, logarithm = FORMS[form], form.startswith("ln T")
    line = np.polyfit(axis(tensions), np.log(forces) if logarithm else forces, 1)
    told = float(np.polyval(line, axis(np.array(tension))))
    return math.exp(told) if logarithm else max(told, 0.05 * float(forces.min()))


@dataclass(frozen=True)
class OverTension:
    """Friction over the band tension: the form that predicts tensions left out best, and how far it misses them."""

    form: str
    tensions: np.ndarray
    forces: np.ndarray  # a column per parameter
    misses: np.ndarray  # of the logarithm, for every tension left out

    def friction(self, tension: float) -> np.ndarray:
        """Of a tension that was calibrated, its own; else by the form."""
        known = np.isclose(self.tensions, tension)
        if known.any():
            return np.asarray(self.forces[known][0])
        return np.array([at_tension(self.form, self.tensions, column, tension) for column in self.forces.T])


def over_tension(calibration: Sequence[Calibrated], names: Sequence[str]) -> OverTension:
    tensions = np.unique([one.record.tension_lb for one in calibration])
    logarithms = np.array([[math.log(one.law[name].value) for name in names] for one in calibration])
    of = np.array([one.record.tension_lb for one in calibration])
    forces = np.exp([logarithms[of == P].mean(axis=0) for P in tensions])

    def miss(form: str, i: int, k: int) -> float:
        others = np.arange(tensions.size) != i
        return math.log(forces[i, k] / at_tension(form, tensions[others], forces[others, k], tensions[i]))

    misses = {
        form: np.array([[miss(form, i, k) for k in range(len(names))] for i in range(tensions.size)]) for form in FORMS
    }
    form = min(misses, key=lambda name: float(np.mean(misses[name] ** 2)))
    return OverTension(form, tensions, forces, misses[form])


@dataclass(frozen=True)
class Prediction:
    """Force of a record predicted from others, with the 95 % interval of the force and a bound of its rms error."""

    force_N: np.ndarray
    low_N: np.ndarray
    high_N: np.ndarray
    rms_share: float  # that 95 of 100 such predictions do not exceed
    form: str
    known: bool  # whether the tension was calibrated


def predicted(calibration: Sequence[Calibrated], record: Record, rng: np.random.Generator) -> Prediction:
    """Law of all calibrated records at the tension of another one, and how far such predictions may be off.

    The friction of a tension that was calibrated varies as it does from stroke to stroke, that of another one by as
    much as the form misses tensions left out; other parameters, and the rms error of a law in its own record, vary as
    they do from record to record. Student's t in each case.
    """
    names = [p.name for p in calibration[0].law.parameters]
    friction = [name for name in names if name in FRICTION]
    others = [name for name in names if name not in FRICTION]
    over = over_tension(calibration, friction)
    centre = dict(zip(friction, over.friction(record.tension_lb), strict=True))
    of = {name: np.array([one.law[name].value for one in calibration]) for name in others}
    centre |= {name: float(values.mean()) for name, values in of.items()}
    force = driven_force(record.displacement_m, centre)
    known = bool(np.isclose(over.tensions, record.tension_lb).any())
    freedom = len(calibration) - 1 if known else over.tensions.size - 1
    scatter = stroke_scatter(calibration, friction) if known else over.misses.T @ over.misses / over.misses.shape[0]
    root = np.linalg.cholesky(scatter + 1e-12 * np.eye(len(friction)))
    count = len(calibration)
    own = np.log([float(np.sqrt(np.mean(one.residual_share**2))) for one in calibration])
    ratio = float(np.mean([one.range_ratio for one in calibration]))
    drawn, shares = np.empty((DRAWS, force.size)), np.empty(DRAWS)
    wider = math.sqrt(1 + 1 / count)
    for j in range(DRAWS):
        heavy = math.sqrt(freedom / rng.chisquare(freedom))
        moved_by = np.exp(heavy * root @ rng.standard_normal(len(friction)))
        values = dict(zip(friction, np.array([centre[f] for f in friction]) * moved_by, strict=True))
        for name in others:
            value = centre[name] + of[name].std(ddof=1) * wider * float(rng.standard_t(count - 1))
            values[name] = value if name in ("zero_N", "start_m") else max(value, 1e-3 * centre[name])
        moved = driven_force(record.displacement_m, values)
        span = ratio * max(float(np.ptp(moved)), 1e-3 * float(np.ptp(force)))
        rest = math.exp(float(own.mean() + own.std(ddof=1) * wider * rng.standard_t(count - 1)))
        shares[j] = math.hypot(float(np.sqrt(np.mean((moved - force) ** 2))) / span, rest)
        one = calibration[int(rng.integers(count))]
        drawn[j] = moved + span * rng.choice(one.residual_share, force.size)
    low, high = np.quantile(drawn, [0.025, 0.975], axis=0)
    return Prediction(force, low, high, float(np.quantile(shares, 0.95)), over.form, known)


def stroke_scatter(calibration: Sequence[Calibrated], names: Sequence[str]) -> np.ndarray:
    """Variance of the logarithm of friction from stroke to stroke, from the intervals of its mean over strokes."""

    def square(law: TraceLaw, name: str) -> float:
        p = law[name]
        return ((p.high - p.value) / float(student.ppf(0.975, law.samples - 1)) / p.value) ** 2 * law.samples

    squares = [[square(one.law, name) for name in names] for one in calibration]
    return np.diag(np.mean(squares, axis=0))


def error_share(record: Record, force_N: np.ndarray) -> float:
    return float(np.sqrt(np.mean((record.force_N - force_N) ** 2))) / record.range_N


def left_out(records: Sequence[Record], law: str, way: str) -> list[dict[str, object]]:
    """Every record predicted from those of other tensions, or from those of the other frequency."""
    fitted = {record.name: calibrated(record, law) for record in records}
    rng, rows = np.random.default_rng(SEED), []
    for record in records:
        key = "tension_lb" if way == "tension" else "frequency_Hz"
        kept = [fitted[one.name] for one in records if getattr(one, key) != getattr(record, key)]
        rows.append(row_of(record, predicted(kept, record, rng), law, way))
    return rows


def row_of(record: Record, made: Prediction, law: str, way: str) -> dict[str, object]:
    inside = (record.force_N >= made.low_N) & (record.force_N <= made.high_N)
    share = error_share(record, made.force_N)
    return {
        "law": law, "left_out": way, "record": record.name, "frequency_Hz": record.frequency_Hz,
        "tension_lb": record.tension_lb, "form": "its own" if made.known else made.form,
        "rms_share": round(share, 5), "at_most": round(made.rms_share, 5), "holds": share <= made.rms_share,
        "samples_inside": round(float(inside.mean()), 4), "range_N": round(record.range_N, 1),
    }  # fmt: skip


def repeat_limit(record: Record) -> float:
    """Rms difference of two cycles over the same way, over root two, at the least: what no law of the way tells."""
    grid = np.arange(200) / 200 / record.frequency_Hz
    best = math.inf
    for start in np.arange(1, 6) / record.frequency_Hz:
        way, force = (
            [np.interp(start + k / record.frequency_Hz + grid, record.time_s, column) for k in range(2)]
            for column in (record.displacement_m, record.force_N)
        )
        if np.std(way[0] - way[1]) < 0.005 * np.ptp(record.displacement_m) < 0.006 * np.ptp(way[0]):
            best = min(best, float(np.std(force[0] - force[1])) / math.sqrt(2) / record.range_N)
    return best


def causes(record: Record, law: str) -> dict[str, float]:
    """Where the residual of a law lies: at small forces, in the gap, and what of it rings at 30 to 80 Hz."""
    one = calibrated(record, law)
    residual = one.residual_share * record.range_N
    size = float(np.quantile(np.abs(record.force_N), 0.75))
    moving = (
        np.abs(np.gradient(record.displacement_m, record.time_s))
        > 0.1 * np.ptp(record.displacement_m) * record.frequency_Hz
    )
    gap = moving & (np.abs(record.force_N) < 0.15 * size)
    near_zero = np.abs(record.force_N) < 0.5 * size
    power = np.abs(np.fft.rfft(residual)) ** 2
    line = np.fft.rfftfreq(residual.size, float(record.time_s[1] - record.time_s[0]))
    return {
        "rms_share": float(np.std(one.residual_share)),
        "small_forces": float((residual[near_zero] ** 2).sum() / (residual**2).sum()),
        "in_gap_N": float(np.median(residual[gap])),
        "rings": float(power[(line > 30) & (line < 80)].sum() / power[1:].sum()),
    }  # fmt: skip


def with_inertia(record: Record, mass_kg: float) -> float:
    """Error of the law with backlash with inertia on top, by the exact simulation, over that without it."""
    law = values_of(calibrated(record, "driven_backlash").law)
    k = law["stiffness_N_per_m"]
    config = SliderConfig(
        mass_kg, k, 0.3 * math.sqrt(k * mass_kg), 1.0, values={"mu_s": law["sliding_N"], "mu_d": law["sliding_N"]},
        drive=recorded_displacement(record.time_s[::4], record.displacement_m[::4]), backlash_m=law["backlash_m"],
        duration_s=float(record.time_s[-1]) * 0.999, rate_Hz=1 / float(record.time_s[1] - record.time_s[0]),
    )  # fmt: skip
    force = simulate_slider(config).force_N + law["zero_N"]
    late = slice(
        int(1.5 / record.frequency_Hz / float(record.time_s[1] - record.time_s[0])),
        min(force.size, record.force_N.size),
    )
    without = driven_force(record.displacement_m, law)
    return float(np.std(record.force_N[late] - force[late]) / np.std(record.force_N[late] - without[late]))


def percent(share: float) -> str:
    return f"{100 * share:.1f}"


def print_table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    print("\n| " + " | ".join(head) + " |\n|" + "---|" * len(head))
    for row in rows:
        print("| " + " | ".join(map(str, row)) + " |")


def print_tables(records: Sequence[Record], rows: Sequence[dict[str, object]]) -> None:
    one = next(r for r in records if (r.frequency_Hz, r.tension_lb) == FIRST)
    law = values_of(calibrated(one, "driven").law)
    other = [error_share(r, driven_force(r.displacement_m, law)) for r in records if r.name != one.name]
    print(f"{one.name} alone, Coulomb slider: others {percent(np.median(other))} %, {percent(max(other))} % at most")
    summed = []
    for name, way in product(DRIVEN_LAWS, ("tension", "frequency")):
        of = [row for row in rows if row["law"] == name and row["left_out"] == way]
        shares = np.array([row["rms_share"] for row in of], float)
        inside = percent(np.mean([float(str(row["samples_inside"])) for row in of]))
        holds = f"{sum(bool(row['holds']) for row in of)} of {len(of)}"
        summed.append((WORDS[name], way, percent(np.median(shares)), percent(shares.max()), holds, inside))
    head = ("law", "left out", "median rms error, %", "largest", "bound holds", "samples inside, %")
    print_table(head, summed)
    last = list(DRIVEN_LAWS)[-1]

    def told(record: Record, way: str) -> str:
        row = next(r for r in rows if (r["law"], r["left_out"], r["record"]) == (last, way, record.name))
        return f"{percent(float(str(row['rms_share'])))} (at most {percent(float(str(row['at_most'])))})"

    print_table(
        ("record", "its own law, %", "by other tensions (95 % bound)", "by the other frequency", "repeats itself, %"),
        [
            (r.name, percent(float(np.std(calibrated(r, last).residual_share))), told(r, "tension"),
             told(r, "frequency"), percent(repeat_limit(r)))
            for r in records
        ],
    )  # fmt: skip
    found = {name: [causes(record, name) for record in records] for name in DRIVEN_LAWS}
    middle = {name: {key: float(np.median([one[key] for one in of])) for key in of[0]} for name, of in found.items()}
    print_table(
        ("law", "own rms error, %", "of it at small forces, %", "measured minus law in the gap, N", "rings, %"),
        [
            (
                WORDS[name],
                percent(m["rms_share"]),
                percent(m["small_forces"]),
                round(m["in_gap_N"]),
                percent(m["rings"]),
            )
            for name, m in middle.items()
        ],
    )
    laws = [calibrated(record, last).law for record in records]
    print_table(
        ("parameter", *(record.name for record in records)),
        [
            (p.name, *(f"{x[p.name].value:.4g} ({x[p.name].low:.4g} to {x[p.name].high:.4g})" for x in laws))
            for p in laws[0].parameters
        ],
    )
    ratios = {m: float(np.median([with_inertia(r, m) for r in records])) for m in (15.0, 30.0, 60.0, 120.0)}
    print("\ninertia on top, error over that without, by mass in kg:", {m: round(r, 3) for m, r in ratios.items()})


def draw(records: Sequence[Record], path: Path) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 6.4), layout="constrained")
    axes = figure.subplots(2, 2)
    rng = np.random.default_rng(SEED)
    fitted = {record.name: calibrated(record, "driven_springy_backlash") for record in records}
    for axis, name in zip(
        axes.flat, ("0.5Hz35lbtension", "1Hz25lbtension", "1Hz70lbtension", "0.5Hz20lbtension"), strict=True
    ):
        record = next(r for r in records if r.name == name)
        kept = [fitted[one.name] for one in records if one.tension_lb != record.tension_lb]
        made = predicted(kept, record, rng)
        swing = (record.time_s > 2.25 / record.frequency_Hz) & (record.time_s < 3.3 / record.frequency_Hz)
        way, scale = 1e3 * record.displacement_m[swing], 1e-3
        turns = np.flatnonzero(np.diff(np.gradient(way) > 0)) + 1
        for side in np.split(np.arange(way.size), turns):
            axis.fill_between(
                way[side], scale * made.low_N[swing][side], scale * made.high_N[swing][side], color="0.88", lw=0
            )
        axis.plot(way, scale * record.force_N[swing], color="#1f5fa8", lw=0.8, label="measured")
        axis.plot(way, scale * made.force_N[swing], color="#c0392b", lw=1.4, label="predicted from other tensions")
        axis.set_title(
            f"{record.frequency_Hz:g} Hz, {record.tension_lb:g} lb: {percent(error_share(record, made.force_N))} %",
            fontsize=9,
        )
        axis.set_xlabel("displacement (mm)", fontsize=8)
        axis.set_ylabel("force (kN)", fontsize=8)
        axis.tick_params(labelsize=8)
    axes[0, 0].legend(fontsize=7, loc="upper left", frameon=False)
    figure.savefig(path, dpi=110)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--rows", type=Path)
    parser.add_argument("--figure", type=Path)
    parser.add_argument("--predict", type=Path)
    given = parser.parse_args()
    records = records_of(given.folder)
    if given.predict:
        rng = np.random.default_rng(SEED)
        kept = [calibrated(record, "driven_springy_backlash") for record in records]
        for record in records_of(given.predict):
            row = row_of(record, predicted(kept, record, rng), "driven_springy_backlash", "record")
            print(
                ", ".join(
                    f"{key} {row[key]}" for key in ("record", "form", "rms_share", "at_most", "holds", "samples_inside")
                )
            )
        return
    rows = [row for law in DRIVEN_LAWS for way in ("tension", "frequency") for row in left_out(records, law, way)]
    if given.rows:
        with given.rows.open("w", newline="") as file:
            writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
    print_tables(records, rows)
    if given.figure:
        draw(records, given.figure)


if __name__ == "__main__":
    main()
