"""Layers of a verdict where the model is wrong: causes on top of wrong patterns, three at once, and the next test.

    python benchmarks/blind_layers.py half   out/half.jsonl             sizes found half the time, by kind of patterns
    python benchmarks/blind_layers.py run    out/blind-layers.jsonl     all campaigns; goes on where it was stopped
    python benchmarks/blind_layers.py tables out/blind-layers.jsonl     the tables, printed
    python benchmarks/blind_layers.py page   out/blind-layers.jsonl     the same into docs/results/blind-layers.md

The generator is in tests/blind and shares no code with the diagnosis. A run appends one line a campaign, in random
order, so that a part of a run is a fair sample of it.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from blind_cases import (
    LADDER,
    Case,
    Staircase,
    answer,
    design_for,
    is_seen,
    make_campaign,
    seed_of,
    times_half,
    true_corrections,
)
from blind_layers_tables import COLUMNS, HALF_WAY, LOADS, OFF, RIGHT, tables
from blind_loop import closed_loop
from run_lines import read_rows, work_off

import numpy as np  # after blind_cases, which says how many threads it may use  # isort: skip
from blind.bench import Design, Shares  # isort: skip
from blind.patterns import ErrorSize  # isort: skip
from blind.tribometer import LARGEST  # isort: skip

DOCS = Path(__file__).resolve().parents[1] / "docs"
PAGE, DATA = DOCS / "results" / "blind-layers.md", DOCS / "data"
MARK = "<!-- below: python benchmarks/blind_layers.py page -->"
ALL = (*COLUMNS, *LOADS)
SLOPE = 0.02  # of the specimens, per e-fold of load
# Standard deviations of offset, slope and curve of a wrong pattern: 15 % rms over the loads, in the proportion of the
# root mean squares of half the way from the engine to the measured column, 0.26 : 0.10 : 0.02
RMS, PARTS = 0.15, (0.264, 0.101, 0.022)
TIED_TOO = ({"suction", "normal_load_error"}, {"tilt", "pressure_dependent_friction"})  # never hidden together
LOOPED = ("suction", "normal_load_error", "pressure_dependent_friction", "contact_area_loss", "tilt")
TRIALS, FIRST_COUNTED = 12, 4  # of a staircase, and the first that counts
STRENGTHS = 8  # campaigns of each effect and kind of patterns
HALF_SEED = 600_000_000


@dataclass(frozen=True)
class Piece:
    """One piece of work: what is done with which campaign."""

    kind: str  # named, clean, three, loop
    case: Case


@cache
def measured_shares() -> dict[str, Shares]:
    """Coefficient and adhesion of the patterns that were measured for the paper, over those of its flat sample."""
    from tribo.berardo2019.published_tables import load_table2

    table = load_table2()
    rows = table[table["source"] == "experiment"].set_index(["sample", "regime"])
    found = {}
    for sample in Design.samples[1:]:
        over = [
            float(rows.loc[(sample, regime), name] / rows.loc[("F", regime), name])
            for regime in ("static", "sliding") for name in ("mu", "tau0_kPa")
        ]  # fmt: skip
        found[sample] = (over[0], over[1], over[2], over[3])
    return found


def wrong_by(rms: float) -> dict[str, ErrorSize]:
    """The same size of error for every pattern, static and sliding."""
    sizes = rms * np.array(PARTS) / np.linalg.norm(PARTS)
    offset, slope, curve = ((float(x), float(x)) for x in sizes)
    return {sample: ErrorSize(offset, slope, curve) for sample in Design.samples[1:]}


def patterns(which: str) -> dict[str, Any]:
    """Changes of a design that make its patterns right, wrong by 15 %, or half way to the measured ones."""
    if which == RIGHT:
        return {"pattern_error": 0.0}
    if which == OFF:
        return {"pattern_error": 1.0, "error_sizes": wrong_by(RMS)}
    return {"pattern_error": 0.0, "measured_shares": measured_shares()}


def designed(which: str, *names: str) -> Design:
    return design_for(*names, specimen_slope=SLOPE, **patterns(which))


def pieces(
    half: dict[str, float], found: dict[str, dict[str, float]], options: argparse.Namespace
) -> Iterator[Piece]:
    """All campaigns; a seed follows from what a campaign is, so that a run can be widened.

    ``found`` are the sizes found half the time by kind of patterns, ``half`` those of docs/blind.md.
    """
    for which in (OFF, HALF_WAY):
        for name in found[which]:
            for k in range(options.campaigns):
                effects = ((name, times_half(name, found[which], 3)),)
                cell = f"{which}: {name}"
                yield Piece("named", Case(cell, seed_of(options.seed, cell, k), effects, designed(which, name)))
    for k in range(options.clean):
        number = seed_of(options.seed, "clean", k)
        ladder = {key: v for name, changes in LADDER.items() if number % 2 for key, v in changes.items()}
        yield Piece("clean", Case("clean", number, (), replace(designed(OFF), **ladder)))
    for k in range(options.three):
        number = seed_of(options.seed, "three", k)
        names = three_of(number)
        effects = tuple((name, times_half(name, half, 3)) for name in names)
        design = design_for(*names, specimen_slope=SLOPE, pattern_error=1.0)
        yield Piece("three", Case("three", number, effects, design))
    for k in range(options.loops):
        name = LOOPED[k % len(LOOPED)]
        number = seed_of(options.seed, "loop", k)
        design = design_for(name, specimen_slope=SLOPE, pattern_error=1.0)
        yield Piece("loop", Case("loop", number, ((name, times_half(name, half, 3)),), design))


def three_of(seed: int) -> tuple[str, ...]:
    """Three effects at random that can be told from each other."""
    rng = np.random.default_rng(seed)
    while True:
        names = set(rng.choice(ALL, 3, replace=False).tolist())
        if not any(tied <= names for tied in TIED_TOO):
            return tuple(sorted(names))


def work(piece: Piece) -> dict[str, Any]:
    begin = time.process_time()
    if piece.kind == "loop":
        row = closed_loop(piece.case)
    else:
        row = answer(piece.case) if piece.kind != "clean" else of_clean(piece.case)
    return row | {"kind": piece.kind, "seconds": round(time.process_time() - begin, 2)}


def of_clean(case: Case) -> dict[str, Any]:
    """Causes and laws of a campaign with nothing but wrong patterns, and how many corrections hold the truth."""
    from tribo.diagnostics.diagnosis import examine
    from tribo.diagnostics.inference import pattern_corrections
    from tribo.lawsearch.diagnosis_with_laws import with_laws

    d = examine(make_campaign(case), seed=case.seed)
    corrections = pattern_corrections(d.baseline)
    v = with_laws(d, seed=case.seed).verdict
    truth = true_corrections(case, d.baseline.setup)
    held = [bool(c.low <= truth[c.name, c.regimes[0]] <= c.high) for c in corrections]
    return {
        "cell": case.cell, "seed": case.seed, "effects": [], "verdict": v.verdict,
        "causes": sorted([c.mechanism] for c in v.causes), "covariates": [m.covariate for m in v.misfits[:3]],
        "laws": [layer.formula for layer in v.layers if layer.kind == "law"], "held": held,
    }  # fmt: skip


def half_of(name: str, which: str, size: float, seed: int) -> dict[str, Any]:
    """Size at which a misfit is seen half the time: a staircase that begins at ``size``."""
    first = seed + 1000 * ALL.index(name)  # the same for all patterns, so that the ratio is of like campaigns

    def seen_at(size: float, k: int) -> bool:
        return is_seen(Case("half", first + k, ((name, size),), designed(which, name)))

    stairs = Staircase(TRIALS, FIRST_COUNTED, 1.5, LARGEST.get(name, np.inf))
    half, trials = stairs.settled(size, seen_at)
    return {"effect": name, "patterns": which, "half": half, "trials": trials}


def half_work(task: tuple[str, str, float, int]) -> dict[str, Any]:
    return half_of(*task)


def strength_of(task: tuple[str, str, float, int]) -> dict[str, Any]:
    """How strongly the score test shows an effect of one ``size`` in the same campaigns with these patterns: normal
    deviates. For an effect that wrong patterns do not resemble, the size seen half the time goes as one over their
    mean, without the chance of a staircase."""
    from tribo.diagnostics.fit import fit
    from tribo.diagnostics.model import setup
    from tribo.diagnostics.observations import observe
    from tribo.diagnostics.predictor import tabled_predictor
    from tribo.diagnostics.score_statistics import start_effects

    name, which, size, seed = task
    found = []
    for k in range(STRENGTHS):
        number = seed + 100_000 + 1000 * ALL.index(name) + k
        o = observe(make_campaign(Case("strength", number, ((name, size),), designed(which, name))))
        e = start_effects(fit(setup(o, tabled_predictor(o.patterns))))
        here = [p / s for a, p, s in zip(e.acting, e.pull, e.length, strict=True) if a.name == name]
        found.append(round(float(max(here)), 3))
    return {"effect": name, "patterns": which, "size": size, "strengths": found}


def in_a_line(row: dict[str, Any]) -> str:
    if "strengths" in row:
        return f"{row['patterns']}: {row['effect']}: strength {np.mean(row['strengths']):.2f}"
    what = row.get("half") or f"{row['verdict']} {row['causes']}"
    return f"{row.get('cell') or (row['patterns'] + ': ' + row['effect'])}: {what}"


def find_half(options: argparse.Namespace) -> None:
    known = {(row["effect"], row["patterns"], "half" in row) for row in read_rows(options.path)}
    begin = {row["effect"]: row["half"] for row in read_rows(options.half)}
    every = [(n, w) for n in ALL for w in (RIGHT, OFF, HALF_WAY)]
    np.random.default_rng(options.seed).shuffle(every)
    for work_of, in_steps in ((strength_of, False), (half_work, True)):
        tasks = [(n, w, begin[n], options.half_seed) for n, w in every if (n, w, in_steps) not in known]
        work_off(tasks, work_of, options.path, options.jobs, in_a_line)


def run(todo: list[Piece], options: argparse.Namespace) -> None:
    known = {(row["cell"], row["seed"]) for row in read_rows(options.path)}
    rest = [p for p in todo if (p.case.cell, p.case.seed) not in known]
    print(f"{len(todo)} campaigns, {len(todo) - len(rest)} of them done", flush=True)
    work_off(rest, work, options.path, options.jobs, in_a_line)


def put_on_page(rows: list[dict[str, Any]], options: argparse.Namespace, whole: int, text: str) -> None:
    """Tables into the page below its mark, and the rows into docs/data."""
    above = PAGE.read_text().split(MARK)[0]
    PAGE.write_text(f"{above}{MARK}\n\nSeed {options.seed}: {len(rows)} of {whole} campaigns.\n\n{text}")
    ordered = sorted(rows, key=lambda r: (r["cell"], r["seed"]))
    (DATA / "blind-layers.jsonl").write_text("".join(json.dumps(row) + "\n" for row in ordered))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("half", "run", "tables", "page"))
    parser.add_argument("path", type=Path, help="JSON lines, one a campaign")
    parser.add_argument("--half", type=Path, default=DATA / "blind-half.jsonl", help="sizes of docs/blind.md")
    parser.add_argument("--found", type=Path, default=DATA / "blind-layers-half.jsonl", help="what half has found")
    parser.add_argument("--campaigns", type=int, default=20, help="per effect and kind of patterns")
    parser.add_argument("--clean", type=int, default=200)
    parser.add_argument("--three", type=int, default=100)
    parser.add_argument("--loops", type=int, default=100, help="campaigns of which those tied count")
    parser.add_argument("--only", default="", help="named, clean, three or loop")
    parser.add_argument("--seed", type=int, default=140)
    parser.add_argument("--half-seed", type=int, default=HALF_SEED)
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    if options.what == "half":
        find_half(options)
        return
    half = {row["effect"]: row["half"] for row in read_rows(options.half)}
    halves = read_rows(options.found)
    stairs = [row for row in halves if "half" in row]
    found = {w: {r["effect"]: r["half"] for r in stairs if r["patterns"] == w} for w in (OFF, HALF_WAY)}
    todo = [p for p in pieces(half, found, options) if options.only in ("", p.kind)]
    if options.what == "run":
        np.random.default_rng(options.seed).shuffle(todo)  # type: ignore[arg-type]
        run(todo, options)
    rows = read_rows(options.path)
    text = tables(rows, halves)
    if options.what == "page":
        put_on_page(rows, options, len(todo), text)
    print(text)


if __name__ == "__main__":
    main()
