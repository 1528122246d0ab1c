"""Exam of ``tribo design``: hidden designs found again, targets that cannot be had, direction against brute force.

    python benchmarks/design_exam.py hidden docs/data/design-exam.csv --count 100
    python benchmarks/design_exam.py impossible docs/data/design-exam.csv --count 50
    python benchmarks/design_exam.py direction docs/data/design-exam.csv --count 2000
    python benchmarks/design_exam.py table docs/data/design-exam.csv

``hidden``: a design of one of three families is drawn and simulated at six loads, static and sliding (``--loads``);
what it has is the target, within 5 %. The best answer is simulated with fresh seeds at half the mesh of the answer.
``impossible``: the same with 1.4 to 2.2 times the friction of the flat sample wanted. ``direction``: the largest static
friction along over across of staggered rectangles, against the best of ``--count`` designs run one by one. The model's
error is set to zero: the truth here is the model. ``--small`` takes few blocks and few runs, for short of time: it
shows that the exam works, not what the search can do. Rows are written as they come; those that are there are not made
again.
"""

from __future__ import annotations

import argparse
import csv
import math
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd

from tribo.design import rounds
from tribo.design.answer import design
from tribo.design.rounds import Rounds, responses, tried
from tribo.design.target import Family, Material, Space, Target, Want
from tribo.springblock import SimConfig

FAMILIES = (
    Family(cavity="circle", lattice="hexagonal", diameter_um=[6, 24], pitch_um=[12, 40], smallest_wall_um=3),
    Family(cavity="square", size_x_um=[6, 24], pitch_um=[12, 40], smallest_wall_um=3),
    Family(cavity="ridge", size_x_um=[6, 24], pitch_um=[14, 50], smallest_wall_um=4),
)
SEED = 29_000
PRESSURES_KPA = (3.0, 5.0, 8.0, 12.0, 18.0, 25.0)
COLUMNS = ("cell", "small", "number", "family", "want", "wanted", "truth", "low", "high", "refused", "runs")
TRUTH_RUNS = 4
SMALL = {
    "FIRST": 6, "ROUNDS": 1, "BATCH": 2, "FINAL": 2, "FINE_RUNS": 2,
    "MESHES": {
        "coarse": (16, 5e-6, 1e-7), "fine": (24, 4e-6, 8e-8), "patch": (14, 4e-6, 8e-8), "halved": (28, 2e-6, 4e-8),
    },
}  # fmt: skip


def quiet(said: str, done: int, total: int) -> None:
    """No progress."""


def target_of(wants: list[Want], families: tuple[Family, ...]) -> Target:
    return Target(target=wants, pattern=list(families), material=Material(model_error_percent=0.0), designs=1)


def truth(target: Target, number: int, lengths: dict[str, float], seed: int, halved: bool) -> list[float]:
    """T/N of everything that is wanted, in the order of the responses, at fresh seeds."""
    n, spacing, dt = rounds.MESHES["fine"]
    fine = 2 if halved else 1
    config = SimConfig(duration_peaks=2.0, cavity_shape="exact").with_(
        blocks=(n * fine, n * fine), spacing_m=spacing / fine, thickness_m=5e-6, dt_s=dt / fine, rest_tolerance=1e-2
    )
    spaces = [Space(family, k) for k, family in enumerate(target.pattern)]
    with tempfile.TemporaryDirectory() as folder:
        all_rounds = Rounds(spaces, responses(target), Path(folder), seed, 1)
        (found,) = tried(all_rounds, "truth", [(number, lengths)], config, TRUTH_RUNS, seed, None)
    return [math.exp(found.logs[r]) for r in responses(target)]


def runs_of(target: Target) -> int:
    """Runs of a search of one family."""
    points = len({r[1:] for r in responses(target)})
    coarse = (len(target.pattern) * rounds.FIRST + rounds.ROUNDS * rounds.BATCH) * rounds.COARSE_RUNS
    return points * (coarse + rounds.FINAL * rounds.FINE_RUNS + 4)


def answered(target: Target, seed: int) -> Iterator[tuple[int, float, float, float, bool]]:
    """For each want: family, truth at half the mesh with fresh seeds, interval, and whether the target was refused."""
    with tempfile.TemporaryDirectory() as folder:
        outcome, _ = design(target, Path(folder), Path(folder), seed, 1, quiet)
    best = outcome.answers[0]
    made = truth(target, best.space, best.lengths_um, seed + 7, halved=True)
    for p, value in zip(best.predictions, made, strict=True):
        yield best.space, value, p.low, p.high, bool(outcome.refusal)


def hidden(number: int, loads: int) -> Iterator[dict[str, object]]:
    """One hidden design: its friction is wanted."""
    seed = SEED + 100 * number
    family = FAMILIES[number % len(FAMILIES)]
    designs = Space(family, 0).candidates(64, seed)
    lengths = designs[int(np.random.default_rng(seed).integers(len(designs)))]
    chosen = PRESSURES_KPA if loads == len(PRESSURES_KPA) else PRESSURES_KPA[2 : 2 + loads]
    wants = [Want(friction=f, pressure_kPa=p, best="largest") for p in chosen for f in ("static", "sliding")]
    had = truth(target_of(wants, (family,)), 0, lengths, seed, halved=False)
    goals = [w.model_copy(update={"best": None, "value": v}) for w, v in zip(wants, had, strict=True)]
    target = target_of(goals, FAMILIES)
    for want, (space, value, low, high, refused) in zip(goals, answered(target, seed + 1), strict=True):
        yield {"number": number, "family": FAMILIES[space].cavity, "want": want.text(), "wanted": want.value,
               "truth": value, "low": low, "high": high, "refused": refused, "runs": runs_of(target)}  # fmt: skip


def impossible(number: int) -> Iterator[dict[str, object]]:
    """More friction than the flat sample has."""
    seed = SEED + 50_000 + 100 * number
    rng = np.random.default_rng(seed)
    p = float(rng.choice(PRESSURES_KPA))
    regime = ("static", "sliding")[number % 2]
    flat = (4.76 + 23.45 / p) if regime == "static" else (2.96 + 11.3 / p)
    want = Want(friction=regime, pressure_kPa=p, value=flat * float(rng.uniform(1.4, 2.2)))
    target = target_of([want], (FAMILIES[number % len(FAMILIES)],))
    for space, value, low, high, refused in answered(target, seed + 1):
        yield {"number": number, "family": target.pattern[space].cavity, "want": want.text(), "wanted": want.value,
               "truth": value, "low": low, "high": high, "refused": refused, "runs": runs_of(target)}  # fmt: skip


def direction(count: int) -> Iterator[dict[str, object]]:
    """Largest static friction along over across: the design, and the best of so many; both at fresh seeds."""
    family = Family(
        cavity="rectangle", lattice="staggered", size_x_um=[20, 120], size_y_um=[8, 40], pitch_x_um=[40, 160],
        pitch_y_um=[20, 80], smallest_wall_um=4,
    )  # fmt: skip
    want = Want(friction="static", pressure_kPa=5.0, direction="x", over="y", best="largest")
    target = target_of([want], (family,))
    space = Space(family, 0)
    n, spacing, dt = rounds.MESHES["coarse"]
    config = SimConfig(duration_peaks=2.0, cavity_shape="exact").with_(
        blocks=(n, n), spacing_m=spacing, thickness_m=5e-6, dt_s=dt, rest_tolerance=1e-2
    )
    with tempfile.TemporaryDirectory() as folder:
        outcome, _ = design(target, Path(folder), Path(folder), SEED, 1, quiet)
        all_rounds = Rounds([space], responses(target), Path(folder), SEED, 1)
        every = [(0, lengths) for lengths in space.candidates(count, SEED + 1)]
        tried_all = tried(all_rounds, "brute", every, config, rounds.COARSE_RUNS, SEED, None)
    along, across = responses(target)
    brute = max(tried_all, key=lambda t: t.logs[along] - t.logs[across])
    for name, lengths, runs in (
        ("design", outcome.answers[0].lengths_um, runs_of(target)),
        ("brute force", brute.lengths_um, len(every) * 2 * rounds.COARSE_RUNS),
    ):
        x, y = truth(target, 0, lengths, SEED + 3, halved=False)
        yield {"number": name, "family": "rectangle", "want": want.text(), "truth": x / y, "runs": runs}


def table(path: Path) -> None:
    """Shares and counts by cell."""
    rows = pd.read_csv(path)
    for (cell, small), part in rows.groupby(["cell", "small"]):
        said = f"{cell}{' (small)' if small else ''}: {part['number'].nunique()} targets, {len(part)} wants"
        if cell == "direction":
            print(said, part[["number", "truth", "runs"]].to_string(index=False), sep="\n")
            continue
        near = (np.abs(part["truth"] / part["wanted"] - 1) <= 0.05).mean()
        within = ((part["low"] <= part["truth"]) & (part["truth"] <= part["high"])).mean()
        refused = part.groupby("number")["refused"].first()
        print(said, f"within 5 %: {near:.2f}; within the interval: {within:.2f}; refused: {refused.sum()}", sep="; ")


def main() -> None:
    read = argparse.ArgumentParser()
    read.add_argument("cell", choices=["hidden", "impossible", "direction", "table"])
    read.add_argument("path", type=Path)
    read.add_argument("--count", type=int, default=3)
    read.add_argument("--loads", type=int, default=len(PRESSURES_KPA), choices=range(1, len(PRESSURES_KPA) + 1))
    read.add_argument("--small", action="store_true")
    given = read.parse_args()
    if given.cell == "table":
        table(given.path)
        return
    if given.small:
        for name, value in SMALL.items():
            setattr(rounds, name, value)
    known = pd.read_csv(given.path) if given.path.exists() else pd.DataFrame(columns=list(COLUMNS))
    mine = known[(known["cell"] == given.cell) & (known["small"] == given.small)]
    done = set(mine["number"].astype(str))
    if not given.path.exists():
        given.path.write_text(",".join(COLUMNS) + "\n")
    numbers = range(given.count) if given.cell != "direction" else [0] * (not done)
    for number in numbers:
        if str(number) in done:
            continue
        rows = {"hidden": lambda k: hidden(k, given.loads), "impossible": impossible,
                "direction": lambda _: direction(given.count)}[given.cell](number)  # fmt: skip
        made = [{"cell": given.cell, "small": given.small} | row for row in rows]
        with given.path.open("a", newline="") as file:
            csv.DictWriter(file, COLUMNS, lineterminator="\n").writerows(
                {k: f"{v:.5g}" if isinstance(v, float) else v for k, v in row.items()} for row in made
            )
        print(*made, sep="\n", flush=True)


if __name__ == "__main__":
    main()
