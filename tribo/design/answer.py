"""Answers: each design with its prediction, an interval with its parts, what moves it most, and what cannot be had."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from tribo.berardo2019.published_tables import load_table2, load_table2_simulated_anew
from tribo.design.rounds import Lengths, Response, Say, Surrogate, Surrogates, Tried, misses, reached, responses, search
from tribo.design.target import Space, Target, Want, corrections_of_report, laws_of_report
from tribo.errors import Problem, SimulationError
from tribo.springblock.calibration import CalibrationRuns, calibrate
from tribo.springblock.config import LocalFriction, SimConfig
from tribo.springblock.design_file import with_parameters

NINETY = 1.645


@dataclass(frozen=True)
class Prediction:
    """One wanted quantity of one design; the parts are standard deviations of its logarithm."""

    want: str
    value: float
    low: float
    high: float
    goal: str
    met: bool
    off_percent: float
    parts: dict[str, float]


@dataclass(frozen=True)
class Answer:
    """One design: lengths in um, predictions, the length that moves it most, and its distance from the target."""

    rank: int
    space: int
    lengths_um: Lengths
    area_fraction: float
    predictions: list[Prediction]
    moves_most: str
    met: bool


@dataclass(frozen=True)
class Outcome:
    """All answers, best first; ``refusal`` says why the target cannot be had, empty where it can."""

    answers: list[Answer]
    refusal: list[str]
    model_error: dict[str, tuple[float, float]]
    notes: list[str]


def design(target: Target, folder: Path, kept: Path, seed: int, jobs: int, say: Say) -> tuple[Outcome, list[Space]]:
    """Search the families of a target; reports of its material are taken relative to ``folder``.

    Raises
    ------
    SimulationError
        No pattern of a family can be made, the material has no laws, or a run failed.
    """
    spaces = [Space(family, k) for k, family in enumerate(target.pattern)]
    if unmakeable := [_unmakeable(space) for space in spaces if not space.candidates(1, seed)]:
        raise SimulationError(unmakeable)
    names = {f.name for part in (SimConfig, LocalFriction) for f in fields(part)}
    if unknown := [name for name in target.parameters if name not in names]:
        raise SimulationError(Problem("unknown_key", "unknown parameter", column="parameters", found=unknown[0]))
    base = with_parameters(SimConfig(duration_peaks=2.0, cavity_shape="exact"), target.parameters)
    report = None if target.material.report is None else folder / target.material.report
    laws = {} if report is None else laws_of_report(report, target.material.flat)
    for regime in ("static", "sliding"):
        if (stated := getattr(target.material, regime)) is not None:
            laws[regime] = (stated[0], 1e3 * stated[1])
    if len(laws) == 1:
        raise SimulationError(Problem("no_laws", "a material has a static and a sliding law", column="material"))
    if laws:
        few = CalibrationRuns(repeats=2, iterations=3, seed=seed)
        base = base.with_(friction=calibrate(laws["static"], laws["sliding"], base, few, jobs))
    coarse, fine, finer, surrogates = search(spaces, target, base, kept, seed, jobs, say)
    errors = model_errors(target, report)
    mesh = {r: finer[1].logs[r] - finer[0].logs[r] for r in responses(target)}
    answers = [answered(k + 1, t, surrogates, spaces, target, errors, mesh) for k, t in enumerate(fine)]
    answers.sort(key=lambda a: (not a.met, a.rank))
    refusal = [] if any(a.met for a in answers) else refused([*coarse, *fine], spaces, target, answers[0])
    contact = "rigid" if base.contact_stiffness_Pa_per_m is None else "elastic"
    moved = ", ".join(f"{r[0]} along {r[2]} {100 * (math.exp(v) - 1):+.1f} %" for r, v in mesh.items())
    notes = [f"contact is {contact}; halving the mesh of 2.5 um moves {moved}"]
    return Outcome(answers, refusal, errors, notes), spaces


def _unmakeable(space: Space) -> Problem:
    middle = space.lengths_um(np.full(len(space.free), 0.5))
    return Problem(
        "cannot_be_made", f"no pattern within these bounds can be made: {space.fault(middle)}",
        column=f"pattern.{space.number}", found=", ".join(f"{k} = {v:g}" for k, v in middle.items()),
    )  # fmt: skip


def model_errors(target: Target, report: Path | None) -> dict[str, tuple[float, float]]:
    """By regime, the mean of ln(measured over predicted) to be added, and its standard deviation for a new pattern.

    From the patterns of a report; else from those of the paper, whose mean is not taken over to other materials: the
    deviation then is the root of the mean square.
    """
    found = {} if report is None else corrections_of_report(report, target.material.flat)
    measured = load_table2().query("source == 'experiment'").set_index(["sample", "regime"])
    simulated = load_table2_simulated_anew().set_index(["sample", "regime"])
    for regime in ("static", "sliding"):
        p = float(np.mean([target.pressure_Pa(w) for w in target.target])) / 1e3

        def law(table: object, sample: str, regime: str = regime, p: float = p) -> float:
            row = table.loc[(sample, regime)]  # type: ignore[attr-defined]
            return math.log(float(row["mu"]) + float(row["tau0_kPa"]) / p)

        off = [law(measured, s) - law(simulated, s) for s in ("A", "B", "C", "Sx", "Sy")]
        flat = law(measured, "F") - law(simulated, "F")
        found.setdefault(regime, (0.0, math.sqrt(float(np.mean([(v - flat) ** 2 for v in off])))))
        if target.material.model_error_percent is not None:
            found[regime] = (found[regime][0], math.log1p(target.material.model_error_percent / 100))
    return found


def answered(
    rank: int, t: Tried, surrogates: Surrogates, spaces: Sequence[Space], target: Target,
    errors: dict[str, tuple[float, float]], mesh: dict[Response, float],
) -> Answer:  # fmt: skip
    """The prediction of one design for everything that is wanted."""
    space = spaces[t.space]
    logs = {r: v + errors[r[0]][0] for r, v in t.logs.items()}
    own = surrogates.get(t.space)
    slopes = {want.text(): slopes_of(want, target, space, t.lengths_um, own) for want in target.target}
    predictions = []
    for want in target.target:
        value = float(reached(want, target, logs))
        involved = [r for r in t.errors if r[1] == target.pressure_Pa(want) and r[2] in (want.direction, want.over)]
        involved = [r for r in involved if want.friction == "static over sliding" or r[0] == want.friction]
        ratio = want.over is not None or want.friction == "static over sliding"
        # a ratio of one sample shares most of the model's error; half of it is kept
        model = max(errors[r[0]][1] for r in involved) * (0.5 if ratio else 1.0)
        parts = {
            "runs": math.sqrt(sum(t.errors[r] ** 2 for r in involved)),
            "mesh": abs(float(reached(want, target, mesh))),
            "model": model,
            "making": space.family.tolerance_um * math.sqrt(sum(s**2 for s in slopes[want.text()].values())),
        }
        width = NINETY * math.sqrt(sum(v**2 for v in parts.values()))
        miss = float(misses(want, target, logs))
        predictions.append(Prediction(
            want.text(), math.exp(value), math.exp(value - width), math.exp(value + width), goal_text(want, target),
            want.best is not None or miss <= (1.0 if target.goal(want) is not None else 1e-9),
            0.0 if want.best else 100 * math.expm1(miss * math.log1p(want.tolerance_percent / 100)), parts,
        ))  # fmt: skip
    first = slopes[target.target[0].text()]
    moves = max(first, key=lambda name: abs(first[name]), default="")
    words = f"{moves}: {100 * first[moves]:+.1f} % per um" if moves else "no length is free"
    area = space.pattern(t.lengths_um).area_fraction
    return Answer(rank, t.space, t.lengths_um, area, predictions, words, all(p.met for p in predictions))


def slopes_of(
    want: Want, target: Target, space: Space, lengths_um: Lengths, surrogates: dict[Response, Surrogate] | None
) -> dict[str, float]:
    """Change of ln of the wanted quantity per um of every free length, from the surrogate."""
    if surrogates is None:
        return {}
    found = {}
    for name, (low, high) in space.free.items():
        step = 0.05 * (high - low)
        ends = [max(low, lengths_um[name] - step), min(high, lengths_um[name] + step)]
        x = np.array([space.at(lengths_um | {name: end}) for end in ends])
        value = reached(want, target, {r: s(x) for r, s in surrogates.items()})
        found[name] = float((value[1] - value[0]) / (ends[1] - ends[0]))
    return found


def goal_text(want: Want, target: Target) -> str:
    goal = target.goal(want)
    if want.best is not None:
        return f"the {want.best}"
    if goal is not None:
        return f"{goal:.4g} within {want.tolerance_percent:g} %"
    bounds = {"at least": want.at_least, "at most": want.at_most}
    return " and ".join(f"{word} {bound:g}" for word, bound in bounds.items() if bound)


def refused(known: Sequence[Tried], spaces: Sequence[Space], target: Target, nearest: Answer) -> list[str]:
    """Why no design meets the target: what was reached at most, the nearest, and the limits it lies at."""
    said = []
    for want, p in zip(target.target, nearest.predictions, strict=True):
        values = np.exp([float(reached(want, target, t.logs)) for t in known])
        if not p.met:
            said.append(
                f"{p.want}: wanted {p.goal}; {len(values)} patterns of these families reach {values.min():.3g} to "
                f"{values.max():.3g}; the nearest has {p.value:.3g} ({p.off_percent:.0f} % off)"
            )
    limits = spaces[nearest.space].limits_at(nearest.lengths_um)
    said.append("what holds it back: " + ("; ".join(limits) if limits else "the other targets, not a length"))
    return said
