"""A virtual sled tribometer that hides effects in a campaign and writes it as raw exports."""

from __future__ import annotations

from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pandas as pd

from .bench import AREA_MM2, GRAVITY, STANDARD, Bench, Design
from .effects import EFFECTS, FIRST, LARGEST
from .patterns import CAVITIES, draw_errors
from .scatter import add_noise, specimen_gains

__all__ = ["AREA_MM2", "EFFECTS", "LARGEST", "Bench", "Design", "hide", "write"]
SAMPLES_A_PULL = 700


def hide(seed: int, effects: list[tuple[str, float]], design: Design = STANDARD) -> Bench:
    """A bench with the named effects at work; flat law, patterns, specimens and repeats are drawn from ``seed``.

    The draws do not depend on the effects, so that the same seed without them is the campaign to compare with.
    """
    tests, law, errors, chance, scatter = _draws(seed)
    flat = (law.uniform(4.07, 5.57), law.uniform(19, 28), law.uniform(2.57, 3.47), law.uniform(10, 13))
    drawn = draw_errors(design.sizes(), design.pattern_error, design.pattern_draw, errors)
    bench = Bench(_table(design, tests), flat, drawn, design.measured_shares)
    _apply(effects, bench, chance)
    gains = specimen_gains(bench, design, scatter)
    bench.static, bench.sliding = bench.static * gains[:, 0], bench.sliding * gains[:, 1]
    add_noise(bench, design, scatter)
    return bench


def _draws(seed: int) -> list[np.random.Generator]:
    return [np.random.default_rng([seed, k]) for k in range(5)]


def _apply(effects: list[tuple[str, float]], bench: Bench, rng: np.random.Generator) -> None:
    for name, size in sorted(effects, key=lambda e: e[0] not in FIRST):
        EFFECTS[name](bench, size, rng)


def with_further(
    bench: Bench, rows: pd.DataFrame, seed: int, effects: list[tuple[str, float]], design: Design
) -> Bench:
    """A bench with further pulls on the same specimens, made after all others.

    ``rows`` are tests of the bench to be made again, as they are or at another load ``N``, speed or hold; where they
    have a column ``without``, the effect that it names does not act. Temperature, humidity and operator are those of
    the later day, or those of the columns ``set_temperature_C`` and so on where there are any. A specimen that the
    bench does not have is a fresh one. Effects that draw something at random are not allowed; a specimen that is
    mislabelled is so in the rows already, in which its true sample stands.
    """
    made = len(bench.tests)
    rng = np.random.default_rng([seed, made])
    rows = rows.reset_index(drop=True).copy()
    rows["test_id"] = [f"P{made + k + 1:04d}" for k in range(len(rows))]
    rows["mass_g"] = rows["N"] / GRAVITY * 1e3 - 1.5
    rows["run_order"] = made + 1 + np.arange(len(rows))
    last = bench.tests.groupby("specimen")["specimen_run"].max()
    rows["specimen_run"] = rows["specimen"].map(last).fillna(0).astype(int) + rows.groupby("specimen").cumcount() + 1
    rows["started_at"] = _stamps(made + len(rows))[made:]
    rows["temperature_C"] = (23 + rng.normal(0, 1.1, len(rows))).round(1)
    rows["humidity_pct"] = (48 + rng.normal(0, 3, len(rows))).round(1)
    rows["operator"] = rng.choice(["op1", "op2"], len(rows))
    for name in ("temperature_C", "humidity_pct", "operator"):
        rows[name] = rows.get(f"set_{name}", rows[name])
    removed = {*rows.get("without", pd.Series([""])), "mislabelled_specimen"}
    more = Bench(rows, bench.law, bench.errors, bench.measured_shares)
    _apply([(name, size) for name, size in effects if name not in removed], more, rng)
    gains = specimen_gains(more, design, _draws(seed)[4], bench)
    more.static, more.sliding = more.static * gains[:, 0], more.sliding * gains[:, 1]
    add_noise(more, design, rng)
    both = Bench(pd.concat([bench.tests, rows], ignore_index=True), bench.law, bench.errors, bench.measured_shares)
    for name in ("static", "sliding", "zero", "stiffness_N_per_mm"):
        setattr(both, name, np.concatenate([getattr(bench, name), getattr(more, name)]))
    return both


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
    write_tables(bench, folder, seed)
    rng = np.random.default_rng(seed + 1_000_003)
    for k, test in enumerate(bench.tests.itertuples()):
        time, force = _trace(bench, k, float(test.speed_mm_s), rng)
        head = f'"Specimen label","{test.test_id}"\n\n"Time","Extension","Load"\n"(s)","(mm)","(N)"\n'
        rows = np.column_stack([time, time * float(test.speed_mm_s), force])
        body = ('"%.4f","%.5f","%.5f"\n' * len(rows)) % tuple(rows.ravel().tolist())
        (folder / "raw" / f"{test.test_id}.csv").write_text(head + body)
    return folder


def write_tables(bench: Bench, folder: Path, seed: int) -> None:
    """campaign.toml, tests.csv and the folder for the exports that tests.csv names."""
    (folder / "raw").mkdir(parents=True)
    head = f'[campaign]\ntitle = "hidden {seed}"\nnominal_area_mm2 = {AREA_MM2}\n'
    head += "slider_mass_g = 1.5\npull_speed_mm_s = 0.2\n"
    blocks = [_pattern(name) for name in sorted({s[0] for s in bench.tests["sample"]})]
    (folder / "campaign.toml").write_text("\n".join([head, *blocks]))
    table = bench.tests.drop(columns=["true_sample", "N"])
    table.insert(1, "file", [f"raw/{t}.csv" for t in table["test_id"]])
    table.to_csv(folder / "tests.csv", index=False)


def _pattern(name: str) -> str:
    """A table of campaign.toml, lengths in micrometres."""
    if name not in CAVITIES:
        return f'[patterns.{name}]\ncavity = "none"\n'
    shape, x, y, pitch_x, pitch_y = CAVITIES[name]
    size = f"diameter_um = {x}" if shape == "circle" else f"size_um = [{x}, {y}]\nstaggered = true"
    return f'[patterns.{name}]\ncavity = "{shape}"\n{size}\npitch_um = [{pitch_x}, {pitch_y}]\n'


def _trace(bench: Bench, k: int, speed_mm_s: float, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Rest, linear rise, peak, exponential fall to the sliding force with a little fading stick-slip, noise."""
    static, sliding = float(bench.static[k]), float(bench.sliding[k])
    rest_s = rng.uniform(1.5, 3.0) * 0.2 / speed_mm_s
    rise_s = static / (float(bench.stiffness_N_per_mm[k]) * speed_mm_s)
    fall_s = 0.05 / speed_mm_s * 0.5
    end_s = rest_s + rise_s + 2.6 / speed_mm_s
    time = np.linspace(0.0, end_s, int(min(SAMPLES_A_PULL, max(end_s * bench.samples_per_s, 60))))
    after = time - rest_s - rise_s
    force = np.where(time < rest_s, 0.0, static * (time - rest_s) / rise_s)
    swing = 0.01 * sliding * np.sin(2 * np.pi * after * speed_mm_s / 0.147) * np.exp(-np.maximum(after, 0) * speed_mm_s)
    settled = sliding + (static - sliding) * np.exp(-np.maximum(after, 0) / fall_s) + swing
    force = np.where(after > 0, settled, force)
    return time, force + bench.zero[k] + rng.normal(0, 0.006, time.size)
