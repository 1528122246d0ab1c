"""How a laboratory measures a campaign: samples, order, days and breaks, the climate of its room, operators.

Nothing here imports the library that is tested. Days differ in the number of pulls; temperature and humidity follow the
hour, the weather of the day and noise; operators take turns by half days, as people do.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from typing import Any, Literal

import numpy as np
import pandas as pd
from blind.bench import GRAVITY

SLIDER_G = 1.5
SETS = (("F", "A", "B", "C", "Sx", "Sy"), ("F", "B", "C", "Sx", "Sy"), ("F", "A", "B", "C"))
MASSES_G = (5.0, 12.0, 25.0, 50.0, 90.0, 138.5)
SPEEDS_MM_S, HOLDS_S = (0.05, 0.2, 0.8), (2.0, 20.0, 200.0)
Order = Literal["random", "in order"]
Turns = Literal["half day", "pull"]
Shapes = Literal["plain", "odd"]
Tails = Literal["normal", "heavy"]


@dataclass(frozen=True)
class Laboratory:
    """What is measured, when and by whom, and how it scatters.

    Films are drawn between half a micrometre and five where ``films_um`` names none. ``order`` is random, or sample
    after sample and specimen after specimen with ascending loads. ``repeat_sd`` (static, sliding) and ``specimen_sd``
    are standard deviations of ln T, ``specimen_slope`` that of the slope of a specimen per e-fold of load.
    ``pattern_rms`` is the root mean square, over patterns, loads and regimes, of the lines in the logarithm of the load
    by which ln T of the patterns deviates from the engine. Where ``patterns_are`` or ``specimens_are`` odd, each has
    bumps, bends, stairs or waves besides, of ``pattern_curve`` and ``specimen_curve`` rms, and some specimens lie far
    out. ``noise_of`` multiplies the scatter of the repeats of a sample.
    """

    samples: tuple[str, ...] = SETS[0]
    specimens: int = 3
    masses_g: tuple[float, ...] = MASSES_G
    repeats: int = 2
    speeds_mm_s: tuple[float, ...] = (0.2,)
    holds_s: tuple[float, ...] = (10.0,)
    films_um: tuple[float, ...] = ()
    recipes: int = 4
    lots: int = 3
    days: int = 8
    order: Order = "random"
    operators: int = 2
    turns: Turns = "half day"
    repeat_sd: tuple[float, float] = (0.08, 0.06)
    tails: Tails = "normal"
    noise_of: Mapping[str, float] = field(default_factory=dict)
    specimen_sd: float = 0.04
    specimen_slope: float = 0.02
    specimen_curve: float = 0.012
    specimens_are: Shapes = "odd"
    pattern_rms: float = 0.04
    pattern_curve: float = 0.012
    patterns_are: Shapes = "odd"


def drawn_laboratory(seed: int, **changes: Any) -> Laboratory:
    """A laboratory at random, but for the ``changes``: 144 to 324 pulls on 6 to 20 days."""
    rng = np.random.default_rng([seed, 1])
    samples = SETS[rng.choice(3, p=(3 / 5, 1 / 5, 1 / 5))]
    scale = rng.uniform(0.7, 1.2)
    uneven = rng.random() < 1 / 4
    drawn: dict[str, Any] = {
        "samples": samples, "repeats": int(rng.integers(2, 4)), "days": int(rng.integers(6, 21)),
        "speeds_mm_s": ((0.2,), SPEEDS_MM_S)[rng.integers(2)], "holds_s": ((10.0,), HOLDS_S)[rng.integers(2)],
        "order": ("random", "in order")[rng.integers(2)], "operators": int(rng.integers(2, 4)),
        "turns": ("half day", "pull")[int(rng.random() < 1 / 3)], "repeat_sd": (0.08 * scale, 0.06 * scale),
        "tails": ("normal", "heavy")[int(rng.random() < 1 / 3)],
        "noise_of": {s: float(2.0 ** rng.uniform(-0.7, 0.7)) for s in samples} if uneven else {},
        "specimen_sd": float(rng.uniform(0.02, 0.06)), "specimen_slope": float(rng.uniform(0.0, 0.04)),
        "specimen_curve": float(rng.uniform(0.005, 0.02)), "specimens_are": ("plain", "odd")[rng.integers(2)],
        "pattern_rms": float(rng.uniform(0.02, 0.06)), "pattern_curve": float(rng.uniform(0.005, 0.02)),
        "patterns_are": ("plain", "odd")[rng.integers(2)],
    }  # fmt: skip
    return Laboratory(**{**drawn, **changes})


def table(laboratory: Laboratory, rng: np.random.Generator) -> pd.DataFrame:
    """The tests in the order in which they are made, with all that is written down about them.

    Beside the usual columns: ``film_um`` and ``wear_um`` (a number for every pull), ``recipe`` (of cleaning, one for
    every pull) and ``lot`` (of a specimen).
    """
    rows = [
        {"sample": s, "specimen": f"{s[0]}{k + 1}", "direction": s[1:], "mass_g": m, "repeat": r + 1}
        for s in laboratory.samples for k in range(laboratory.specimens) for m in laboratory.masses_g
        for r in range(laboratory.repeats)
    ]  # fmt: skip
    tests = pd.DataFrame(rows)
    n = len(tests)
    if laboratory.order == "random":
        tests = tests.iloc[rng.permutation(n)].reset_index(drop=True)
    when = _times(n, laboratory.days, rng)
    tests["true_sample"] = tests["sample"]
    tests["N"] = (tests["mass_g"] + SLIDER_G) * 1e-3 * GRAVITY
    tests["speed_mm_s"] = rng.choice(laboratory.speeds_mm_s, n)
    tests["hold_s"] = rng.choice(laboratory.holds_s, n)
    tests["run_order"] = np.arange(1, n + 1)
    tests["specimen_run"] = tests.groupby("specimen").cumcount() + 1
    tests["started_at"] = [w.isoformat(timespec="minutes") for w in when]
    tests["temperature_C"], tests["humidity_pct"] = _climate(when, rng)
    tests["operator"] = _operators(when, laboratory, rng)
    films = rng.uniform(0.5, 5.0, n).round(2)
    tests["film_um"] = rng.choice(laboratory.films_um, n) if laboratory.films_um else films
    tests["recipe"] = rng.choice([f"r{k + 1}" for k in range(laboratory.recipes)], n)
    names = sorted(set(tests["specimen"]))
    lots = np.resize([f"m{k + 1}" for k in range(laboratory.lots)], len(names))
    tests["lot"] = tests["specimen"].map(dict(zip(names, rng.permutation(lots), strict=True)))
    tests["wear_um"] = rng.normal(10.0, 2.0, n).round(1)
    tests.insert(0, "test_id", [f"L{i + 1:04d}" for i in range(n)])
    return tests


def day_of(tests: pd.DataFrame) -> np.ndarray:
    """The date of every test, (n,) of str."""
    return tests["started_at"].str[:10].to_numpy(str)


def _times(n: int, days: int, rng: np.random.Generator) -> list[datetime]:
    """Times of n pulls: days with their own number of pulls, weekends and pauses left out, a break at noon."""
    least = 3
    counts = least + rng.multinomial(n - least * days, rng.dirichlet(np.full(days, 5.0)))
    date, times = datetime(2026, 1, 5) + timedelta(weeks=int(rng.integers(40))), []
    minutes, lunch = rng.uniform(4, 9), rng.uniform(30, 60)
    for count in counts:
        while date.weekday() >= 5:
            date += timedelta(days=1)
        now, pause = date + timedelta(minutes=float(rng.uniform(480, 600))), min(minutes, 500 / count)
        for _ in range(count):
            times.append(now.replace(second=0, microsecond=0))
            later = now + timedelta(minutes=float(pause * rng.uniform(0.8, 1.3)))
            over_noon = now.hour < 12 <= later.hour
            now = later + timedelta(minutes=lunch if over_noon else 0.0)
        date += timedelta(days=1 + int(rng.integers(1, 10)) * int(rng.random() < 1 / 10))
    return times


def _climate(when: list[datetime], rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Temperature (°C) and humidity (%) of a room: the course of a day, weather that lasts for days, and noise."""
    hour = np.array([w.hour + w.minute / 60 for w in when])
    day = np.array([w.date().toordinal() for w in when])
    day = day - day[0]
    weather = _weather(int(day.max()) + 1, rng)[:, day]
    sun = np.sin(2 * np.pi * (hour - rng.uniform(8, 10)) / 24)
    n = len(when)
    noise = rng.uniform(0.1, 0.5) * rng.normal(size=n), rng.uniform(0.5, 2) * rng.normal(size=n)
    warm = 22 + rng.uniform(0.5, 2) * sun + rng.uniform(0.5, 1.5) * weather[0] + noise[0]
    damp = 45 - rng.uniform(0, 3) * sun + rng.uniform(2, 7) * weather[1] - rng.uniform(0, 2) * weather[0] + noise[1]
    return warm.round(1), np.clip(damp, 8, 95).round(1)


def _weather(days: int, rng: np.random.Generator) -> np.ndarray:
    """Two series of unit variance over the days of the calendar, each remembering two thirds of the day before."""
    kept = 2 / 3
    series = np.empty((2, days))
    series[:, 0] = rng.normal(size=2)
    for k in range(1, days):
        series[:, k] = kept * series[:, k - 1] + np.sqrt(1 - kept**2) * rng.normal(size=2)
    return series


def _operators(when: list[datetime], laboratory: Laboratory, rng: np.random.Generator) -> list[str]:
    names = [f"op{k + 1}" for k in range(laboratory.operators)]
    if laboratory.turns == "pull":
        return [str(x) for x in rng.choice(names, len(when))]
    sessions = [(w.date(), w.hour < 12) for w in when]
    order = list(dict.fromkeys(sessions))
    turns = {s: names[k] if k < len(names) else str(rng.choice(names)) for k, s in enumerate(order)}
    return [turns[s] for s in sessions]
