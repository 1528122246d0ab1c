"""Campaigns with one slip that still parses: is it named first, at the right tests, and is nobody else blamed?

    python benchmarks/corruptions.py run    out/corruptions.jsonl [--count 100] [--seed 27000] [--designs 24 48 324]
    python benchmarks/corruptions.py tables out/corruptions.jsonl      the tables of docs/results/corruptions.md

Each trial draws a laboratory (scatter of specimens and repeats, normal or with long tails, drift, days, laws that are
not straight), measures a campaign without a slip, and the same with one. Both are read without the model. A slip counts
where it changes a force by more than three of its stated standard uncertainties, or a fitted friction by more than one.
Named first: the first doubt of the card, or the tests set aside by rule, are of the tests that were spoiled, or of the
column for slips of the whole campaign. Blamed: a test that was not spoiled is doubted or set aside, and is not so in
the campaign without the slip. A run appends one line a trial; it goes on where it stopped.
"""

from __future__ import annotations

import argparse
import csv
import json
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from support.sled import EXPORTERS, SledTribometer

import tribo
from tribo.errors import TriboError
from tribo.records import Study
from tribo.stages import with_doubts

G = 9.80665
DESIGNS = {  # samples, loads, specimens, repeats
    24: ((2, 4, 3, 1), (2, 3, 4, 1), (4, 2, 3, 1), (3, 4, 2, 1), (2, 3, 2, 2), (2, 6, 2, 1)),
    48: ((4, 4, 3, 1), (3, 4, 4, 1), (4, 3, 2, 2), (2, 4, 3, 2), (4, 6, 2, 1), (2, 4, 6, 1)),
    324: ((6, 6, 3, 3), (6, 9, 3, 2), (6, 3, 6, 3), (6, 6, 9, 1), (4, 9, 3, 3)),
}
SAMPLES = ("F", "A", "B", "C", "Sx", "Sy")
PATTERNS = """\
[patterns.F]
cavity = "none"
[patterns.A]
cavity = "circle"
diameter_um = 5.0
pitch_um = [10.0, 10.0]
[patterns.B]
cavity = "circle"
diameter_um = 10.0
pitch_um = [15.0, 15.0]
[patterns.C]
cavity = "circle"
diameter_um = 20.0
pitch_um = [30.0, 30.0]
[patterns.S]
cavity = "rectangle"
size_um = [200.0, 40.0]
pitch_um = [220.0, 120.0]
"""


@dataclass
class Measured:
    """A campaign before it is written: its table, the signals (time, travel, force) by test, and its description."""

    rows: list[dict[str, Any]]
    signals: dict[str, list[np.ndarray]]
    dialect: str
    described: dict[str, float]
    evaluated: bool = False
    noise_N: float = 0.006
    files: dict[str, str] = field(default_factory=dict)

    def write(self, folder: Path) -> Path:
        (folder / "raw").mkdir(parents=True)
        about = "\n".join(f"{name} = {value:g}" for name, value in self.described.items())
        title = 'title = "a drawn campaign"\nmaterial = "PDMS"\ncounterface = "glass"'
        (folder / "campaign.toml").write_text(f"[campaign]\n{title}\n{about}\n{PATTERNS}")
        for test_id, (t, travel, force) in self.signals.items() if not self.evaluated else ():
            (folder / "raw" / f"{test_id}.csv").write_bytes(EXPORTERS[self.dialect](test_id, t, travel, force))
        with (folder / "tests.csv").open("w", newline="", encoding="utf-8") as out:
            writer = csv.DictWriter(out, fieldnames=list(self.rows[0]), lineterminator="\n")
            writer.writeheader()
            writer.writerows(self.rows)
        return folder


def measured(tests: int, seed: int) -> Measured:
    """A campaign of a drawn laboratory."""
    rng = np.random.default_rng([seed, tests])
    n_samples, n_loads, specimens, repeats = DESIGNS[tests][rng.integers(len(DESIGNS[tests]))]
    samples = SAMPLES[:n_samples]
    masses = np.sort(np.round(np.geomspace(rng.uniform(4, 15), rng.uniform(80, 300), n_loads), 1))
    of_specimens, of_repeats = rng.uniform(0.01, 0.08), rng.uniform(0.01, 0.05)
    tails = rng.random() < 0.4
    days, of_days, drift = int(rng.integers(1, 5)), rng.uniform(0.0, 0.03), rng.uniform(-0.04, 0.04)
    power = rng.choice([1.0, 1.0, 0.9])
    area_mm2, slider_g = 55.0, float(rng.choice([1.5, 3.2, 12.0]))
    noise_N = float(rng.uniform(0.003, 0.012))
    machine = SledTribometer(noise_N=noise_N, sampling_hz=float(rng.choice([25.0, 50.0])))
    laws = {}
    for sample in samples:
        mu, tau = rng.uniform(1.0, 4.5), rng.uniform(2e3, 25e3)
        laws[sample] = (mu, tau, mu * rng.uniform(0.55, 0.9), tau * rng.uniform(0.3, 0.8))
    plan = [(s, k, m, r) for s in samples for k in range(specimens) for m in masses for r in range(repeats)]
    gains: dict[str, float] = {}
    rows, signals = [], {}
    evaluated = bool(rng.random() < 0.15)
    of_day = rng.normal(1.0, of_days, days)
    for order, place in enumerate(rng.permutation(len(plan)), start=1):
        sample, number, mass, repeat = plan[place]
        pattern = sample[:-1] if len(sample) > 1 else sample
        specimen = f"{pattern}{number + 1}"
        gain = gains.setdefault(specimen, float(np.exp(rng.normal(0.0, of_specimens))))
        day = (order - 1) * days // len(plan)
        gain *= of_day[day] * (1.0 + drift * order / len(plan))
        load = (mass + slider_g) * 1e-3 * G
        mu_s, tau_s, mu_k, tau_k = laws[sample]
        forces = []
        for mu, tau in ((mu_s, tau_s), (mu_k, tau_k)):
            scatter = rng.standard_t(5) * np.sqrt(3 / 5) if tails else rng.normal()
            forces.append((mu * load**power + tau * area_mm2 * 1e-6) * gain * float(np.exp(of_repeats * scatter)))
        static, sliding = max(forces), forces[1]
        test_id = f"T{order:03d}"
        signals[test_id] = list(machine.pull(static, sliding, 2e-4, rng))
        started = datetime(2026, 3, 2, 9) + timedelta(days=day, minutes=6 * (order - 1 - day * len(plan) // days))
        row = {
            "test_id": test_id, "file": "" if evaluated else f"raw/{test_id}.csv", "sample": sample,
            "specimen": specimen, "mass_g": f"{mass:g}", "speed_mm_s": "0.2", "hold_s": "10", "repeat": repeat + 1,
            "run_order": order, "started_at": started.isoformat(),
            "temperature_C": f"{rng.normal(22.5, 0.8):.1f}", "humidity_pct": f"{rng.normal(48, 3):.0f}",
        }  # fmt: skip
        if evaluated:
            row |= {"static_N": f"{static:.4f}", "sliding_N": f"{sliding:.4f}"}
        rows.append(row)
    dialect = str(rng.choice(list(EXPORTERS)))
    about = {"nominal_area_mm2": area_mm2, "slider_mass_g": slider_g, "pull_speed_mm_s": 0.2}
    return Measured(rows, signals, dialect, about, evaluated, noise_N)


@dataclass(frozen=True)
class Slip:
    """What was spoiled: the tests, or the words by which a doubt of the whole campaign must tell its place."""

    tests: tuple[str, ...]
    words: tuple[str, ...] = ()


Spoil = Callable[[Measured, np.random.Generator], Slip]
KINDS: dict[str, Spoil] = {}


def kind(make: Spoil) -> Spoil:
    KINDS[make.__name__.replace("_", " ")] = make
    return make


def one(c: Measured, rng: np.random.Generator) -> dict[str, Any]:
    return c.rows[rng.integers(len(c.rows))]


def scale(c: Measured, test_id: str, factor: float) -> None:
    """All forces of a test times a factor, as its export or its row gives them."""
    if c.evaluated:
        row = next(r for r in c.rows if r["test_id"] == test_id)
        row |= {name: f"{float(row[name]) * factor:.6g}" for name in ("static_N", "sliding_N")}
    else:
        c.signals[test_id][2] = c.signals[test_id][2] * factor


FACTORS = (0.01, 0.1, 10.0, 100.0, 1000.0, 1e-3, 1 / G, G, 1e3 / G)


@kind
def one_pull_in_another_unit(c: Measured, rng: np.random.Generator) -> Slip:
    row = one(c, rng)
    scale(c, row["test_id"], float(rng.choice(FACTORS)))
    return Slip((row["test_id"],))


@kind
def one_pull_half_or_twice_as_large(c: Measured, rng: np.random.Generator) -> Slip:
    row = one(c, rng)
    scale(c, row["test_id"], float(rng.choice([0.4, 0.5, 1.6, 2.0, 3.0])))
    return Slip((row["test_id"],))


@kind
def half_of_the_exports_in_another_unit(c: Measured, rng: np.random.Generator) -> Slip:
    names = [r["test_id"] for r in c.rows]
    chosen = rng.permutation(names)[: round(rng.uniform(0.25, 0.5) * len(names))]
    factor = float(rng.choice(FACTORS))
    for name in chosen:
        scale(c, name, factor)
    return Slip(tuple(map(str, chosen)))


@kind
def one_half_of_the_series_in_another_unit(c: Measured, rng: np.random.Generator) -> Slip:
    share = round(rng.uniform(0.2, 0.5) * len(c.rows))
    chosen = [r["test_id"] for r in (c.rows[:share] if rng.random() < 0.5 else c.rows[-share:])]
    factor = float(rng.choice(FACTORS))
    for name in chosen:
        scale(c, name, factor)
    return Slip(tuple(chosen))


@kind
def a_few_exports_in_another_unit(c: Measured, rng: np.random.Generator) -> Slip:
    chosen = rng.permutation([r["test_id"] for r in c.rows])[: rng.integers(2, 5)]
    factor = float(rng.choice(FACTORS))
    for name in chosen:
        scale(c, name, factor)
    return Slip(tuple(map(str, chosen)))


@kind
def a_load_with_a_digit_too_many_or_too_few(c: Measured, rng: np.random.Generator) -> Slip:
    row = one(c, rng)
    row["mass_g"] = f"{float(row['mass_g']) * float(rng.choice([10.0, 0.1, 100.0])):g}"
    return Slip((row["test_id"],))


@kind
def loads_of_two_tests_interchanged(c: Measured, rng: np.random.Generator) -> Slip:
    a = one(c, rng)
    others = [r for r in c.rows if r["mass_g"] != a["mass_g"]]
    b = others[rng.integers(len(others))]
    a["mass_g"], b["mass_g"] = b["mass_g"], a["mass_g"]
    return Slip((a["test_id"], b["test_id"]))


@kind
def a_load_copied_from_the_row_above(c: Measured, rng: np.random.Generator) -> Slip:
    places = [k for k in range(1, len(c.rows)) if c.rows[k]["mass_g"] != c.rows[k - 1]["mass_g"]]
    k = places[rng.integers(len(places))]
    c.rows[k]["mass_g"] = c.rows[k - 1]["mass_g"]
    return Slip((c.rows[k]["test_id"],))


@kind
def files_of_two_tests_interchanged(c: Measured, rng: np.random.Generator) -> Slip:
    a = one(c, rng)
    others = [r for r in c.rows if r["mass_g"] != a["mass_g"]]
    b = others[rng.integers(len(others))]
    names = ("static_N", "sliding_N") if c.evaluated else ("file",)
    for name in names:
        a[name], b[name] = b[name], a[name]
    return Slip((a["test_id"], b["test_id"]))


@kind
def the_sample_of_another_test(c: Measured, rng: np.random.Generator) -> Slip:
    a = one(c, rng)
    others = [r for r in c.rows if r["sample"] != a["sample"]]
    b = others[rng.integers(len(others))]
    a["sample"], a["specimen"] = b["sample"], b["specimen"]
    return Slip((a["test_id"],))


@kind
def one_force_of_a_million_newtons(c: Measured, rng: np.random.Generator) -> Slip:
    row = one(c, rng)
    if c.evaluated:
        row["static_N"] = "1000000"
    else:
        force = c.signals[row["test_id"]][2]
        at = int(np.argmax(force)) + int(rng.integers(0, 40))
        force[at : at + int(rng.integers(1, 8))] = 1e6
    return Slip((row["test_id"],))


def signal_of(c: Measured, rng: np.random.Generator) -> tuple[str, np.ndarray]:
    """The force of one test, of a large one: what exceeds the range of a recorder is not the smallest force."""
    if c.evaluated:
        c.evaluated = False
        for row in c.rows:
            row["file"] = f"raw/{row['test_id']}.csv"
            del row["static_N"], row["sliding_N"]
    largest = sorted(c.rows, key=lambda row: -float(c.signals[row["test_id"]][2].max()))
    name = str(largest[rng.integers(max(1, len(largest) // 3))]["test_id"])
    return name, c.signals[name][2]


@kind
def a_recorder_that_wraps_around(c: Measured, rng: np.random.Generator) -> Slip:
    name, force = signal_of(c, rng)
    limit = force.max() * rng.uniform(0.8, 0.93)
    force[force > limit] -= 2 * limit
    return Slip((name,))


@kind
def a_recorder_that_clips_with_noise_of_its_last_digit(c: Measured, rng: np.random.Generator) -> Slip:
    name, force = signal_of(c, rng)
    limit = force.max() * rng.uniform(0.5, 0.9)
    over = force > limit
    force[over] = limit + c.noise_N / 8 * rng.integers(-1, 2, over.sum())
    return Slip((name,))


@kind
def a_sensor_that_stops_and_toggles(c: Measured, rng: np.random.Generator) -> Slip:
    name, force = signal_of(c, rng)
    start = int(np.argmax(force)) - int(rng.integers(5, 20))
    force[start:] = force[start] + c.noise_N / 8 * rng.integers(0, 2, force.size - start)
    return Slip((name,))


@kind
def forces_in_steps_of_half_a_newton(c: Measured, rng: np.random.Generator) -> Slip:
    signal_of(c, rng)
    chosen = [r["test_id"] for r in c.rows] if rng.random() < 0.5 else [one(c, rng)["test_id"]]
    for name in chosen:
        c.signals[name][2] = np.round(c.signals[name][2] / 0.5) * 0.5
    return Slip(tuple(chosen))


@kind
def the_slider_a_hundred_times_too_heavy(c: Measured, rng: np.random.Generator) -> Slip:
    c.described["slider_mass_g"] *= 100
    return Slip(tuple(r["test_id"] for r in c.rows), ("slider_mass_g", "loads", "tau0", "mass"))


@kind
def masses_in_kilograms_for_some(c: Measured, rng: np.random.Generator) -> Slip:
    share = round(rng.uniform(0.2, 0.5) * len(c.rows))
    chosen = c.rows[:share] if rng.random() < 0.5 else c.rows[-share:]
    for row in chosen:
        row["mass_g"] = f"{float(row['mass_g']) / 1000:g}"
    return Slip(tuple(r["test_id"] for r in chosen), ("mass_g", "mass"))


@kind
def masses_moved_by_one_row_from_some_row_on(c: Measured, rng: np.random.Generator) -> Slip:
    start = int(rng.integers(0, len(c.rows) - 8))
    length = int(rng.integers(5, min(30, len(c.rows) - start)))
    part = c.rows[start : start + length]
    masses = [r["mass_g"] for r in part]
    moved = [masses[-1], *masses[:-1]]
    changed = [r["test_id"] for r, old, new in zip(part, masses, moved, strict=True) if old != new]
    for row, mass in zip(part, moved, strict=True):
        row["mass_g"] = mass
    return Slip(tuple(changed), ("mass_g", "loads"))


@kind
def forces_copied_from_another_sample(c: Measured, rng: np.random.Generator) -> Slip:
    names = sorted({r["sample"] for r in c.rows})
    a, b = (str(x) for x in rng.permutation(names)[:2])
    theirs = {(r["mass_g"], r["specimen"][1:], r["repeat"]): r for r in c.rows if r["sample"] == b}
    taken = []
    for row in c.rows:
        source = theirs.get((row["mass_g"], row["specimen"][1:], row["repeat"]))
        if row["sample"] == a and source is not None:
            taken += [row["test_id"], source["test_id"]]
            if c.evaluated:
                row |= {name: source[name] for name in ("static_N", "sliding_N")}
            else:
                t, travel, force = c.signals[source["test_id"]]
                c.signals[row["test_id"]] = [t + 0.01, travel, force]
    return Slip(tuple(dict.fromkeys(taken)))


def read(c: Measured, folder: Path, middle_N: float) -> dict[str, Any]:
    """Forces, fits at a load, doubts and tests set aside of a campaign as tribo reads it; why it is refused."""
    try:
        study = with_doubts(Study(tribo.ingest(tribo.load_campaign(c.write(folder)), jobs=1)))
        fits = tribo.fit(study.ingested)
    except TriboError as why:
        refused = [(p.test_id or "", str(p)[:300]) for p in why.problems]
        return {"forces": {}, "fits": {}, "doubts": [], "set_aside": [], "refused": refused}
    forces = {
        test_id: [pull.static_N, pull.static_u_N, pull.sliding_N, pull.sliding_u_N]
        for test_id, pull in study.ingested.pulls.items()
    }
    laws = {
        f"{fit.sample} {fit.regime}": [float(fit.force_N(middle_N)), float(fit.force_u_N(middle_N)), fit.mu, fit.mu_u]
        for fit in fits
    }
    doubts = [{"tests": list(d.tests), "text": str(d)[:400]} for d in study.doubts]
    aside = [(s.test_id, s.reason[:200]) for s in study.ingested.set_aside]
    return {"forces": forces, "fits": laws, "doubts": doubts, "set_aside": aside, "refused": []}


def changes(clean: dict[str, Any], spoiled: dict[str, Any]) -> bool:
    """Whether a number changed by more than is stated: a force by three standard uncertainties, a fit by one."""
    for name, (static, u_static, sliding, u_sliding) in clean["forces"].items():
        other = spoiled["forces"].get(name)
        for value, u, found in ((static, u_static, 0), (sliding, u_sliding, 2)):
            if other is None or not abs(other[found] - value) <= 3 * u:
                return True
    for name, (force, u_force, mu, u_mu) in clean["fits"].items():
        other = spoiled["fits"].get(name)
        if other is None or not (abs(other[0] - force) <= u_force and abs(other[2] - mu) <= u_mu):
            return True
    return False


def trial(tests: int, seed: int, name: str) -> dict[str, Any]:
    """One campaign read without and with a slip of a kind."""
    begin = time.process_time()
    c = measured(tests, seed)
    middle_N = (np.median([float(r["mass_g"]) for r in c.rows]) + c.described["slider_mass_g"]) * 1e-3 * G
    with tempfile.TemporaryDirectory() as scratch:
        clean = read(c, Path(scratch) / "clean", middle_N)
        slip = KINDS[name](c, np.random.default_rng([seed, tests, 1]))
        spoiled = read(c, Path(scratch) / "spoiled", middle_N)
    counts = bool(spoiled["refused"]) or changes(clean, spoiled)
    wrong = set(slip.tests)
    first = spoiled["doubts"][0] if spoiled["doubts"] else {"tests": [], "text": ""}
    right = bool(first["tests"]) and set(first["tests"]) <= wrong
    right |= bool(wrong & {t for t, _ in (*spoiled["set_aside"], *spoiled["refused"])})
    right |= any(word in first["text"] for word in slip.words)
    before = {t for d in clean["doubts"] for t in d["tests"]} | {t for t, _ in clean["set_aside"]}
    named = {t for d in spoiled["doubts"] for t in d["tests"]} | {t for t, _ in spoiled["set_aside"]}
    innocent = sorted(named - wrong - before)
    return {
        "tests": tests, "seed": seed, "kind": name, "evaluated": c.evaluated, "counts": counts, "named_first": right,
        "innocent": innocent, "spoiled": sorted(wrong)[:12], "first": first["text"],
        "doubts": [d["text"][:200] for d in spoiled["doubts"][:4]], "set_aside": spoiled["set_aside"][:4],
        "refused": spoiled["refused"][:2], "clean_doubts": [d["text"] for d in clean["doubts"]],
        "clean_set_aside": clean["set_aside"], "seconds": round(time.process_time() - begin, 2),
    }  # fmt: skip


def planned(options: argparse.Namespace) -> list[tuple[int, int, str]]:
    """Trials in random order, the kinds in equal numbers."""
    names = list(KINDS) if not options.kinds else [n for n in KINDS if any(k in n for k in options.kinds)]
    todo = [
        (tests, options.seed + k, names[(k + place) % len(names)])
        for place, tests in enumerate(options.designs)
        for k in range(options.count)
    ]
    return [todo[k] for k in np.random.default_rng(options.seed).permutation(len(todo))]


def rows_of(path: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in path.read_text().splitlines()] if path.is_file() else []


def tables(rows: list[dict[str, Any]]) -> str:
    """By size of the design, and by kind."""
    lines = ["| tests | slips | change a number | named first | an innocent one blamed | clean | with a false doubt |"]
    lines.append("|---|---|---|---|---|---|---|")
    for tests in sorted({r["tests"] for r in rows}):
        own = [r for r in rows if r["tests"] == tests]
        count = [r for r in own if r["counts"]]
        named, blamed = sum(r["named_first"] for r in count), sum(bool(r["innocent"]) for r in own)
        false = sum(bool(r["clean_doubts"]) for r in own)
        share = f"{named} ({100 * named / max(len(count), 1):.0f} %)"
        others = f"{blamed} ({100 * blamed / len(own):.1f} %) | {len(own)} | {false} ({100 * false / len(own):.1f} %)"
        lines.append(f"| {tests} | {len(own)} | {len(count)} | {share} | {others} |")
    lines += ["", "| kind of slip | 24 | 48 | 324 |", "|---|---|---|---|"]
    for name in KINDS:
        cells = []
        for tests in (24, 48, 324):
            own = [r for r in rows if r["kind"] == name and r["tests"] == tests and r["counts"]]
            cells.append(f"{sum(r['named_first'] for r in own)} of {len(own)}" if own else "")
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("run", "tables"))
    parser.add_argument("path", type=Path, help="JSON lines, one a trial")
    parser.add_argument("--count", type=int, default=100, help="trials of each design")
    parser.add_argument("--seed", type=int, default=27000)
    parser.add_argument("--designs", type=int, nargs="+", default=[24, 48, 324])
    parser.add_argument("--kinds", nargs="*", help="only kinds whose name holds one of these words")
    options = parser.parse_args()
    if options.what == "tables":
        print(tables(rows_of(options.path)))
        return
    options.path.parent.mkdir(parents=True, exist_ok=True)
    done = {(r["tests"], r["seed"], r["kind"]) for r in rows_of(options.path)}
    for tests, seed, name in planned(options):
        if (tests, seed, name) not in done:
            with options.path.open("a") as file:
                file.write(json.dumps(trial(tests, seed, name)) + "\n")


if __name__ == "__main__":
    main()
