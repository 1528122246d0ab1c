"""The campaigns of the blind test: what is hidden in each, how it is measured, and how it scatters.

One campaign in memory, from Python (with ``benchmarks`` on the path):

    case = Case("try", 1, (("run_in", 1.2),), design_for("run_in", pattern_error=1.5, specimen_slope=0.04))
    answer(case)                       # a dict: verdict, causes, interval
    make_campaign(case)                # the same as an Ingested record
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # the processes share the cores, not each product

import math
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

import numpy as np
from blind.direct import IN_TRACE, ingested, pattern_of
from blind.patterns import ErrorSize
from blind.tribometer import EFFECTS, LARGEST, Design, hide, write

if TYPE_CHECKING:
    from tribo.diagnostics import Diagnosis
    from tribo.diagnostics.model import Setup
    from tribo.records import Ingested

SPEEDS, HOLDS = (0.06, 0.2, 0.7), (3.0, 30.0, 600.0)
LADDER: dict[str, dict[str, Any]] = {
    "velocity_dependence": {"speeds_mm_s": SPEEDS}, "bulk_viscoelasticity": {"speeds_mm_s": SPEEDS},
    "sampling_clip": {"speeds_mm_s": SPEEDS}, "contact_ageing": {"holds_s": HOLDS},
}  # fmt: skip
NOISES = ("relative", "absolute", "heavy", "unequal")
# Effects that leave no trace in the forces of such a design: the flat law absorbs them, they do not change the forces,
# or (a slow recorder) the reader corrects what the peak lost.
UNSEEN = ("pull_angle", "pulley_friction", "machine_compliance", "sampling_clip")
ALL_OR_NOTHING = ("mislabelled_specimen",)
PAIRS = (
    ("suction", "run_in"), ("run_in", "temperature"), ("pressure_dependent_friction", "covariate:operator"),
    ("contact_area_loss", "velocity_dependence"), ("edge_adhesion", "load_cell_offset"),
)  # fmt: skip
REPRESENTATIVE = ("suction", "run_in", "contact_area_loss", "pattern_geometry", "cavity_shear_deformation")
FACTORS = (0.0, 0.5, 1.0, 1.5, 2.0, 3.0)
SLOPES = (0.0, 0.02, 0.04, 0.06)
EXACT = {"repeat_sd": (1e-6, 1e-6), "specimen_sd": 1e-9, "specimen_slope": 0.0}
IN_FILES = 5  # one campaign in so many goes through raw files and the reader
Effects = tuple[tuple[str, float], ...]
Cell = tuple[str, Effects, dict[str, Any]]


@dataclass(frozen=True)
class Case:
    """One campaign to be made: the cell it counts for, its seed, what is hidden, how it is measured."""

    cell: str
    seed: int
    effects: Effects
    design: Design


@cache
def assumed_errors() -> Mapping[str, ErrorSize]:
    """The error that the diagnosis assumes for each pattern: the unit of ``pattern_error`` in the sweep.

    Read from the diagnosis here, where campaigns are counted; the generator is only told the numbers.
    """
    from tribo.diagnostics.predictor import tabled_predictor

    samples = [s for s in Design.samples if s != "F"]
    p = tabled_predictor({s: pattern_of(s) for s in Design.samples})
    return {s: ErrorSize(p.error[s].offset, p.error[s].slope, p.error[s].curve) for s in samples}


def design_for(*names: str, **changes: Any) -> Design:
    """Three specimens, six loads, one pull each; speeds or holds vary where an effect needs it."""
    ladders = {k: v for name in names for k, v in LADDER.get(name, {}).items()}
    return Design(**{"repeats": 1, "error_sizes": assumed_errors(), **ladders, **changes})


def clean_design(seed: int) -> Design:
    """Samples, repeats, noise law, slopes, pattern error and gaps at random, over the range that is promised."""
    rng = np.random.default_rng(seed)
    sets = (("F", "A", "B", "C", "Sx", "Sy"), ("F", "A", "B", "C"), ("F", "B", "C", "Sx", "Sy"))
    scale = rng.uniform(0.5, 1.4)
    return design_for(
        samples=sets[rng.integers(3)], specimens=int(rng.integers(3, 5)), repeats=int(rng.integers(1, 4)),
        speeds_mm_s=((0.2,), SPEEDS)[rng.integers(2)], holds_s=((10.0,), HOLDS)[rng.integers(2)],
        repeat_sd=(0.09 * scale, 0.07 * scale), specimen_sd=float(rng.uniform(0.03, 0.07)),
        noise=str(rng.choice(NOISES)), missing=float(rng.choice([0.0, 0.15])),
        specimen_slope=float(rng.uniform(0.0, 0.06)), pattern_error=float(rng.uniform(0.5, 1.5)),
    )  # fmt: skip


@dataclass(frozen=True)
class Plan:
    """How many campaigns each part of a run holds; a point of a curve has three times as many clean ones."""

    clean: int = 300
    large_error: int = 100
    singles: int = 20
    before: int = 20
    curves: int = 10


def cases(half: Mapping[str, float], plan: Plan, seed: int) -> Iterator[Case]:
    """Every campaign of a run. A campaign's seed follows from its cell, so that a run can be widened."""
    for k in range(plan.clean):
        number = seed_of(seed, "clean", k)
        yield Case("clean", number, (), clean_design(number))
    for times in (2.0, 3.0):
        for k in range(plan.large_error):
            cell = f"clean, pattern error {times:g}"
            number = seed_of(seed, cell, k)
            yield Case(cell, number, (), replace(clean_design(number), pattern_error=times))
    parts = ((plan.singles, singles(half)), (plan.before, as_before(half)), (plan.curves, curves(half)))
    for campaigns, cells in parts:
        for cell, effects, changes in cells:
            for k in range(campaigns if effects else 3 * campaigns):
                design = design_for(*(name for name, _ in effects), **changes)
                yield Case(cell, seed_of(seed, cell, k), effects, design)


def seed_of(seed: int, cell: str, k: int) -> int:
    """From what the campaign is and not from its place in the list."""
    return int(np.random.SeedSequence([seed, *cell.encode(), k]).generate_state(1)[0])


def singles(half: Mapping[str, float]) -> Iterator[Cell]:
    """What is promised: three times the half-found size, pattern error 1.5, slopes of 4 %."""
    for name in EFFECTS:
        if name not in UNSEEN and (name in half or name in ALL_OR_NOTHING):
            size = 1.0 if name in ALL_OR_NOTHING else times_half(name, half, 3)
            yield f"{name} x 3, swept", ((name, size),), {"pattern_error": 1.5, "specimen_slope": 0.04}


def as_before(half: Mapping[str, float]) -> Iterator[Cell]:
    """Three and six times the half-found size, pairs at three times, and what cannot be seen; pattern error 1."""
    for name in EFFECTS:
        if name in UNSEEN or name in ALL_OR_NOTHING:
            yield f"{name} x 1", ((name, 1.0),), {}
        elif name in half:
            for times in (3, 6):
                yield f"{name} x {times}", ((name, times_half(name, half, times)),), {}
    for pair in PAIRS:
        if all(name in half for name in pair):
            yield " + ".join(pair), tuple((name, times_half(name, half, 3)) for name in pair), {}


def curves(half: Mapping[str, float]) -> Iterator[Cell]:
    """Clean campaigns and a few effects along each axis; the other axes stay at 1, 2 % and relative noise."""
    middle: dict[str, Any] = {"pattern_error": 1.0, "specimen_slope": 0.02, "noise": "relative"}
    axes = {
        "pattern_error": FACTORS, "specimen_slope": SLOPES, "noise": NOISES, "pattern_draw": ("uniform", "heavy"),
    }  # fmt: skip
    for name in ("", *REPRESENTATIVE):
        if name and name not in half:
            continue
        effects = ((name, times_half(name, half, 3)),) if name else ()
        for axis, values in axes.items():
            for value in values:
                yield f"curve {axis} {value} {name or 'clean'}", effects, {**middle, axis: value}


def times_half(name: str, half: Mapping[str, float], times: float) -> float:
    """So many times the size found half the time, as far as physics goes."""
    return round(min(times * half[name], LARGEST.get(name, math.inf)), 4)


def make_campaign(case: Case) -> Ingested:
    """The campaign of a case, read: most as records, one in five through raw files and the reader."""
    bench = hide(case.seed, list(case.effects), case.design)
    if not through_files(case):
        return ingested(bench, case.seed)
    from tribo.campaign import load_campaign
    from tribo.stages import ingest

    with tempfile.TemporaryDirectory() as folder:
        return ingest(load_campaign(write(bench, Path(folder) / "campaign", case.seed)))


def through_files(case: Case) -> bool:
    """Effects that show in the recorded curve itself always go through files."""
    return case.seed % IN_FILES == 0 or any(name in IN_TRACE for name, _ in case.effects)


def answer(case: Case, replicates: tuple[int, int] | None = None) -> dict[str, Any]:
    """Hide, read, diagnose: what the diagnosis said, beside what was hidden."""
    from tribo.diagnostics import examine

    begin = time.process_time()
    options: dict[str, Any] = {} if replicates is None else {"replicates": replicates}
    d = examine(make_campaign(case), seed=case.seed, **options)
    v, design = d.verdict, case.design
    tied = [sorted(names) for names in v.equivalent]
    alone = [[c.mechanism] for c in v.causes if not any(c.mechanism in names for names in tied)]
    row = {
        "cell": case.cell, "seed": case.seed, "effects": case.effects, "verdict": v.verdict,
        "causes": sorted([*tied, *alone]), "covariates": [m.covariate for m in v.misfits[:3]],
        "pattern_error": round(design.pattern_error, 3), "specimen_slope": round(design.specimen_slope, 4),
        "noise": design.noise, "files": through_files(case), "seconds": round(time.process_time() - begin, 2),
    }  # fmt: skip
    if v.next_test is not None and tied:
        row["next_test"] = {"separates": sorted(v.next_test.separates), "bits": round(v.next_test.expected_bits, 2)}
    if len(case.effects) == 1:
        name, size = case.effects[0]
        for key, truth in true_parameter(name, size).items():
            for cause in v.causes:
                if cause.mechanism == name and key in cause.parameters:
                    e = cause.parameters[key]
                    row["interval"] = [float(f"{x:.5g}") for x in (truth, e.low, e.value, e.high)]
    if not case.effects and v.verdict == "no_misfit":
        row["gain"] = gain_of_the_best(d, case.seed)
    return row


def true_parameter(name: str, size: float) -> dict[str, float]:
    """The hidden size in the parameter of the library, where both mean the same quantity.

    From the definitions in ``tests/blind/effects.py``; growth per decade and per e-fold, per first pull and the like
    are converted. Effects whose law has no such parameter are left out.
    """
    per_efold = 0.0853 * size / math.log(10)  # of the contact after 0.79 s; the library counts from 1 s
    truths = {
        "suction": ("dp", 5.37e3 * size), "normal_load_error": ("dN", 0.0133 * 9.80665 * size),
        "pressure_dependent_friction": ("n", 0.173 * size), "velocity_dependence": ("a", 0.0571 * size),
        "contact_ageing": ("b", per_efold / (1 + per_efold * math.log(1 / 0.79))), "run_in": ("c", 0.237 * size),
        "temperature": ("c", 43.4e3 * size / 8.314 / 296.0**2), "edge_adhesion": ("e", 0.0847 * size),
        "covariate:operator": ("g", math.log(1 + 0.117 * size)), "load_cell_offset": ("F_0", 0.113 * size),
        "cavity_shear_deformation": ("d", math.log(1 + 0.277 * size) / math.log(200 / 40)),
        "tilt": ("h_over_L", 0.0187 * size),
    }  # fmt: skip
    return {truths[name][0]: truths[name][1]} if name in truths else {}


def true_corrections(case: Case, s: Setup) -> dict[tuple[str, str], float]:
    """What every patterned sample is over the model at the true flat law, in percent: geometric mean over its tests."""
    from tribo.diagnostics.model import predict

    exact = hide(case.seed, list(case.effects), replace(case.design, **EXACT))
    order = [list(exact.tests.test_id).index(name) for name in s.observations.test_ids]
    true = np.log(np.column_stack([exact.static, exact.sliding]))[order]
    wrong_by = true - predict(s, np.array(exact.law), (), ())
    sample = s.observations.conditions.sample
    return {
        (name, regime): 100.0 * float(np.expm1(wrong_by[sample == name, k].mean()))
        for name in set(sample.tolist()) for k, regime in enumerate(("static", "sliding"))
    }  # fmt: skip


def gain_of_the_best(d: Diagnosis, seed: int) -> list[float]:
    """What the mechanism that fits best by chance gains on samples left out: mean log score, standard error."""
    from tribo.diagnostics.candidates import weigh
    from tribo.diagnostics.inference import gain
    from tribo.diagnostics.score_statistics import start_effects

    found = gain(d.baseline, weigh(start_effects(d.baseline))[0].fit, np.random.default_rng(seed))
    return [round(found.difference, 5), round(found.se, 5)] if found is not None else []


@dataclass(frozen=True)
class Staircase:
    """A search for the size that is seen half the time: up by a ``step`` after a miss and down after a hit, from the
    second turn on by the ``fine`` one; the trials from ``first_counted`` on settle the size."""

    trials: int
    first_counted: int
    step: float
    largest: float
    fine: float = 1.25

    def settled(self, size: float, seen_at: Callable[[float, int], bool]) -> tuple[float, list[tuple[float, bool]]]:
        """The size and the trials, beginning at ``size``; ``seen_at`` makes the campaign of a size and a number."""
        step, seen_before, turns = self.step, None, 0
        made: list[tuple[float, bool]] = []
        for k in range(self.trials):
            seen = seen_at(size, k)
            made.append((round(size, 5), seen))
            turns += seen_before is not None and seen != seen_before
            size = min(size / step if seen else size * step, self.largest)
            step, seen_before = (self.step if turns < 2 else self.fine), seen
        logs = np.log([s for s, _ in made[self.first_counted :]] + [size])
        return float(f"{np.exp(logs.mean()):.4g}"), made


def is_seen(case: Case) -> bool:
    """Whether anything is seen at all: the first part of a diagnosis, without naming."""
    from tribo.diagnostics.contrasts import all_contrasts, screen
    from tribo.diagnostics.direct_evidence import rise_stiffening, zero_drift, zero_offset
    from tribo.diagnostics.fit import fit
    from tribo.diagnostics.model import setup, start_changes
    from tribo.diagnostics.observations import observe
    from tribo.diagnostics.predictor import tabled_predictor

    o = observe(make_campaign(case))
    if any(e is not None and e.certain for e in (zero_offset(o), zero_drift(o), rise_stiffening(o))):
        return True
    f = fit(setup(o, tabled_predictor(o.patterns)))
    rng = np.random.default_rng(case.seed)
    acting, courses, _ = start_changes(f.setup, f.law)
    return screen(f, all_contrasts(f.setup, f.law, acting, courses), replicates=120, rng=rng).p_adjusted() < 0.01
